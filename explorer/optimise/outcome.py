"""The outcome of an optimisation with every iterate, its record in a file, and curves of iterates.

Records are JSON, read strictly: the problem, the settings, every iterate, and the versions of the
libraries. All are plain values, to send to another process or write into a file.
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import Literal

import msgspec
import numpy as np

from explorer.files.json_text import decode_strictly
from explorer.files.packaged import versions
from explorer.files.writing import read_at_most
from explorer.measures.catalogue import CATALOGUE, Measurements, measure_design, measures_in
from explorer.measures.measure import Case
from explorer.mechanism.design import VARIABLES, Design
from explorer.numerics.arrays import FloatArray
from explorer.numerics.number_text import format_ascii
from explorer.optimise.problem import ObjectiveName, Problem

Status = Literal["converged", "not converged", "infeasible", "stalled", "outdone", "cancelled"]
"""Converged: the design has a workspace and meets all demands, which is proven for every position
of the workspace, and no design nearby that meets them has a better objective. Not converged: the
iterations ended first, or a demand is not proven. Infeasible: the search found no design that meets
all demands. Stalled: the demands are met, but no step improves the objective although the
conditions of an optimum fail. Outdone: even without the clearance demanded, the best design is no
better than that of an earlier start. Cancelled: `stop` ended the search."""

Phase = Literal["growing", "solving"]
"""Growing: enlarging the workspace, since the volume was out of reach. Solving: the problem."""


class IterateRecord(msgspec.Struct, frozen=True, forbid_unknown_fields=True, kw_only=True):
    """An iterate without its design, which follows from the values.

    Attributes:
        number, run: Number from 0 over all runs, and number of the run from 0.
        values: Values of the variables of the problem.
        objective: F = |1 − V/V′|, or the value of the measure that the objective improves.
        volume: Exact volume of the workspace, in cubed design units.
        worst: Demand that is missed most, or has the least to spare; "" without demands.
        spare: Value of that demand, dimensionless: below zero where it is missed by more than
            its tolerance.
    """

    number: int
    run: int
    phase: Phase
    values: tuple[float, ...]
    objective: float
    volume: float
    worst: str
    spare: float


class Iterate(IterateRecord, frozen=True, kw_only=True):
    """A design that the solver accepted on its way."""

    design: Design


class Run(
    msgspec.Struct, frozen=True, forbid_unknown_fields=True, kw_only=True, omit_defaults=True
):
    """The search from one start.

    Attributes:
        start: Values of the variables at the start.
        status: Status at the end.
        iterations: Number of steps of the solver.
        evaluations: Number of designs that were measured.
        attempts: Number of attempts, from the start and from elsewhere.
        holding: Demand or bound that holds the best iterate, "" if none does.
        message: Result in one line, in design units.
        best: Index of the best iterate in the history.
        reason: Why it found no optimum, in one line, "" where its status says all.
    """

    start: tuple[float, ...]
    status: Status
    iterations: int
    evaluations: int
    attempts: int
    holding: str
    message: str = ""
    best: int
    reason: str = ""

    def words(self, reached: str) -> str:
        """Return the result in one line, given the objective that was reached, with its name."""
        end = f"{reached} after {self.iterations} iterations"
        held = f"{end}, held by {self.holding}" if self.holding else end
        told: dict[Status, str] = {
            "converged": f"converged: {held}",
            "infeasible": f"no design was found that meets all demands: {held}",
            "not converged": f"not converged: {held}; allow more iterations or start elsewhere",
            "stalled": f"stalled: {held}; try several starts",
            "outdone": f"no better than an earlier start, even without the clearance: {end}",
            "cancelled": f"cancelled: {end}",
        }
        return self.reason or told[self.status]


@dataclass(frozen=True)
class Outcome:
    """The result of an optimisation: the run from each start, the chosen one of which is the best.

    The history has every iterate, in order; the duration is in seconds.
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
        """Status of the best run; cancelled if `stop` ended the search, in whichever run."""
        last = self.runs[-1].status
        return last if last == "cancelled" else self.run.status

    @property
    def converged(self) -> bool:
        """Whether the search went on to its end, and the best run converged."""
        return self.status == "converged"

    @property
    def message(self) -> str:
        """Result in one line, in design units."""
        return self.words(reached_text(self.problem, self.best))

    def words(self, reached: str) -> str:
        """Return the result in one line, given the objective that was reached, with its name.

        It has the demand that the best so far of a cancelled search misses.
        """
        words, last, best = self.run.words(reached), len(self.runs), self.chosen + 1
        if self.status != "cancelled":
            return words
        if best < last:
            words = f"cancelled in start {last}; the best so far is of start {best}, {words}"
        return words + (f"; missed: {self.best.worst}" if self.best.spare < 0.0 else "")

    @property
    def best(self) -> Iterate:
        """The best iterate."""
        return self.history[self.run.best]

    @property
    def design(self) -> Design:
        """The best design."""
        return self.best.design

    @property
    def iterations(self) -> int:
        """Number of steps of the solver in the best run."""
        return self.run.iterations

    @property
    def evaluations(self) -> int:
        """Number of designs that were measured in the best run."""
        return self.run.evaluations


class Settings(msgspec.Struct, frozen=True, forbid_unknown_fields=True, kw_only=True):
    """Settings of a search; see `optimise_design`."""

    starts: int = 1
    seed: int = 0
    iterations: int = 300


class Record(msgspec.Struct, frozen=True, forbid_unknown_fields=True, kw_only=True):
    """An optimisation as a file holds it, with its best design and the index of the best run.

    A run of each start has its best iterate as an index into the history, which has all iterates.
    """

    schema: Literal[1] = 1
    problem: Problem
    settings: Settings
    design: Design
    chosen: int
    runs: tuple[Run, ...]
    history: tuple[IterateRecord, ...]
    seconds: float
    versions: dict[str, str]


def reached_text(problem: Problem, best: Iterate) -> str:
    """Return the name of the objective, and its value in design units to six digits."""
    # F compares numbers of unit size.
    size = 1.0 if problem.objective == "match-volume" else 0.0
    value = format_ascii(best.objective, 6, size=size)
    return f"{OBJECTIVE_SYMBOLS[problem.objective]} = {value}"


def record_of(outcome: Outcome, settings: Settings) -> Record:
    """Return the record of an optimisation that was run with these settings."""
    return Record(
        problem=outcome.problem,
        settings=settings,
        design=outcome.design,
        chosen=outcome.chosen,
        runs=outcome.runs,
        history=msgspec.convert(outcome.history, tuple[IterateRecord, ...], from_attributes=True),
        seconds=outcome.seconds,
        versions=versions(),
    )


def encode_record(record: Record) -> bytes:
    """Return a record as indented JSON, which `decode_record` reads back unchanged."""
    return msgspec.json.format(msgspec.json.encode(record), indent=1) + b"\n"


def decode_record(data: bytes, source: str) -> Record:
    """Return the record in a JSON text, of which error messages tell the source.

    Raises:
        InputError: Not JSON, of another schema, or with unknown, repeated or unusable fields.
    """
    return decode_strictly(data, Record, source)


def load_record(path: Path) -> Record:
    """Return the record in a file.

    Raises:
        InputError: The file holds no record.
        StorageError: The file cannot be read.
    """
    return decode_record(read_at_most(path), str(path))


def compare_designs(
    problem: Problem, before: Design, after: Design
) -> tuple[Measurements, Measurements]:
    """Return the measures of a design, and of one that a search for a problem has found."""
    demands, names = problem.demands, (*measures_in("optimise"), *VARIABLES)
    margin = None if demands.clearance is None else demands.clearance_margin
    first, second = (Case(each, demanded_margin=margin) for each in (before, after))
    return measure_design(first, names), measure_design(second, names)


GOALS: Mapping[ObjectiveName, str] = {
    "match-volume": "volume",
    "smallest-reach": "longest_leg",
    "largest-volume": "volume",
}
"""The name in the catalogue of the measure that each objective improves."""

OBJECTIVE_SYMBOLS: Mapping[ObjectiveName, str] = {
    **{objective: CATALOGUE[name].label for objective, name in GOALS.items()},
    "match-volume": "F",
}
"""The name of the value of each objective: F, or the label of the measure in the catalogue."""

# Value drawn for an objective of zero, which has no logarithm.
LEAST = 1e-16


@dataclass(frozen=True)
class Curve:
    """Values of a quantity of the iterates of one start, shape (n,); NaN for an infinite one.

    The level is a value to compare the others with; powers are exponents of ten.
    """

    kind: Literal["objective", "volume", "spare"]
    values: FloatArray
    level: float | None
    powers: bool = False


def curves_of(problem: Problem, iterates: Sequence[IterateRecord]) -> list[Curve]:
    """Return the curves of the iterates of one start, of which there is at least one."""
    objective = np.array([iterate.objective for iterate in iterates], dtype=np.float64)
    curves: list[Curve] = []
    if problem.objective == "match-volume":
        powers = np.log10(np.maximum(objective, LEAST))
        curves.append(Curve("objective", powers, None, powers=True))
    elif problem.objective != "largest-volume":
        curves.append(Curve("objective", objective, None))
    volume = np.array([iterate.volume for iterate in iterates])
    curves.append(Curve("volume", volume, problem.demands.volume))
    if any(iterate.worst for iterate in iterates):
        curves.append(Curve("spare", np.array([iterate.spare for iterate in iterates]), 0.0))
    return curves
