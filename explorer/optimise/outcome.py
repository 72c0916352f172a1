"""The outcome of an optimisation: status, every iterate, and the demand or bound that holds it.

All are plain values, to send to another process or write into a file.
"""

from __future__ import annotations

import math
from dataclasses import dataclass
from typing import Literal

import msgspec

from explorer.mechanism.design import Design
from explorer.optimise.problem import Problem

Status = Literal["converged", "not converged", "infeasible", "stalled", "outdone", "cancelled"]
"""Converged: the design, read back from its file, meets all demands and has a workspace, and no
design nearby that meets them has a better objective. Not converged: the iterations ended first.
Infeasible: the search found no design that meets all demands. Stalled: the demands are met,
but no step improves the objective although the conditions of an optimum fail. Outdone: even
without the clearance demanded, the best design is no better than that of an earlier start.
Cancelled: `stop` ended the search."""

Phase = Literal["opening", "growing", "solving"]
"""Opening: searching a design whose workspace is not empty. Growing: enlarging the workspace,
since the volume was out of reach. Solving: the problem itself."""


class Step(msgspec.Struct, frozen=True, forbid_unknown_fields=True, kw_only=True):
    """An iterate without its design, which follows from the values.

    Attributes:
        number: Number from 0, over all runs.
        run: Number of the run, from 0.
        phase: Phase of the search.
        values: Values of the variables of the problem.
        objective: F = |1 − V/V′|, or the value of the measure that the objective improves; None
            if it is infinite.
        volume: Exact volume of the workspace, in cubed design units.
        worst: Demand that is missed most, or has the least to spare; "" without demands.
        spare: Value of that demand, dimensionless: below zero where it is missed by more than
            its tolerance.
    """

    number: int
    run: int
    phase: Phase
    values: tuple[float, ...]
    objective: float | None
    volume: float
    worst: str
    spare: float


class Iterate(Step, frozen=True, kw_only=True):
    """A design that the solver accepted on its way."""

    design: Design

    @property
    def value(self) -> float:
        """The objective as a number, which may be infinite."""
        return math.inf if self.objective is None else self.objective


class RunSummary(msgspec.Struct, frozen=True, forbid_unknown_fields=True, kw_only=True):
    """The result of the search from one start.

    Attributes:
        start: Values of the variables at the start.
        status: Status at the end.
        iterations: Number of steps of the solver.
        evaluations: Number of designs that were measured.
        attempts: Number of attempts, from the start and from elsewhere.
        holding: Demand or bound that holds the best iterate, "" if none does.
        message: Result in one line.
    """

    start: tuple[float, ...]
    status: Status
    iterations: int
    evaluations: int
    attempts: int
    holding: str
    message: str


class Run(RunSummary, frozen=True, kw_only=True):
    """The search from one start, with its best iterate."""

    best: Iterate


class RunRecord(RunSummary, frozen=True, kw_only=True):
    """A run in a file, with the index of its best iterate in the history."""

    best: int


@dataclass(frozen=True)
class Outcome:
    """The result of an optimisation.

    Attributes:
        problem: The problem.
        runs: Run from each start.
        chosen: Index of the best run.
        history: Every iterate, in order.
        seconds: Duration in seconds.
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
        """Status of the best run."""
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
        """Number of steps of the solver in the best run."""
        return self.run.iterations

    @property
    def evaluations(self) -> int:
        """Number of designs that were measured in the best run."""
        return self.run.evaluations
