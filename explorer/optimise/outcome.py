"""What an optimisation returns: how far it got, every iterate on the way, and what holds it.

All of it are plain values, so that it goes to another process or into a file.
"""

from __future__ import annotations

from dataclasses import dataclass
from typing import Literal

from explorer.mechanism.design import Design
from explorer.optimise.problem import Problem

Status = Literal["converged", "not converged", "infeasible", "stalled", "cancelled"]
"""Converged: the design, read back from its file, meets all demands and has a workspace that
is not empty, and within the demands the objective cannot get better nearby.
Not converged: the iterations ended first. Infeasible: no design that meets all demands was
found. Stalled: the demands are met, but no step made the objective better although it
should get better. Cancelled: on request."""

Phase = Literal["opening", "growing", "solving"]
"""Opening: looking for a design whose workspace is not empty. Growing: making the workspace
larger first, since the volume was out of reach. Solving: the problem itself."""


@dataclass(frozen=True)
class Iterate:
    """A design on the way.

    Attributes:
        number: From 0, over all runs.
        run: Which start it belongs to, from 0.
        phase: What the solver was doing.
        design: The design itself, to draw.
        values: Of the variables of the problem.
        objective: F = |1 − V/V′|, the reach, the volume or the worst margin.
        volume: Of its workspace, exact.
        worst: The demand that is missed most, or is nearest to being; "" if there is none.
        spare: Its value, dimensionless: below zero where it is missed by more than its
            tolerance.
    """

    number: int
    run: int
    phase: Phase
    design: Design
    values: tuple[float, ...]
    objective: float
    volume: float
    worst: str
    spare: float


@dataclass(frozen=True)
class Run:
    """What came of one start.

    Attributes:
        start: The values of the variables that it started from.
        status: How it ended.
        best: Its best iterate.
        iterations: Steps of the solver.
        evaluations: Designs that were measured.
        attempts: How often it began, at the start and elsewhere.
        holding: The demand or bound that holds it, "" if nothing does.
        message: One line for people.
    """

    start: tuple[float, ...]
    status: Status
    best: Iterate
    iterations: int
    evaluations: int
    attempts: int
    holding: str
    message: str


@dataclass(frozen=True)
class Outcome:
    """What an optimisation found.

    Attributes:
        problem: The problem.
        runs: Each start.
        chosen: Index of the best run.
        history: Every iterate, in the order in which they were found.
        seconds: How long it took.
    """

    problem: Problem
    runs: tuple[Run, ...]
    chosen: int
    history: tuple[Iterate, ...]
    seconds: float

    @property
    def run(self) -> Run:
        """The best run."""
        return self.runs[self.chosen]

    @property
    def status(self) -> Status:
        """How the best run ended."""
        return self.run.status

    @property
    def converged(self) -> bool:
        """Whether the best run converged."""
        return self.run.status == "converged"

    @property
    def best(self) -> Iterate:
        """The best iterate."""
        return self.run.best

    @property
    def design(self) -> Design:
        """The best design."""
        return self.run.best.design

    @property
    def iterations(self) -> int:
        """Steps of the solver in the best run."""
        return self.run.iterations

    @property
    def evaluations(self) -> int:
        """Designs that were measured in the best run."""
        return self.run.evaluations
