"""Records of optimisations, to read them or run them again, and the curves of their iterates.

They are JSON, read strictly: the problem, the settings, every iterate, and the versions of the
libraries.
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from pathlib import Path
from types import MappingProxyType
from typing import Any, Literal

import msgspec
import numpy as np

from explorer.files.json_text import decode_strictly
from explorer.files.packaged import versions
from explorer.files.writing import read_at_most
from explorer.measures.catalogue import CATALOGUE
from explorer.mechanism.design import Design
from explorer.numerics.arrays import FloatArray
from explorer.optimise.outcome import Iterate, Outcome, RunRecord, RunSummary, Step
from explorer.optimise.problem import ObjectiveName, Problem

# Largest record that is read, in bytes; real ones are much smaller.
LARGEST_FILE = 200_000_000


class Settings(msgspec.Struct, frozen=True, forbid_unknown_fields=True, kw_only=True):
    """Settings of a search; see `optimise_design`."""

    starts: int = 1
    seed: int = 0
    iterations: int = 300


class Record(msgspec.Struct, frozen=True, forbid_unknown_fields=True, kw_only=True):
    """An optimisation as a file holds it.

    Attributes:
        schema: Version of the file format.
        problem: The problem.
        settings: Settings of the search.
        design: Best design.
        chosen: Index of the best run.
        runs: Run from each start; the best iterate is an index into the history.
        history: Every iterate.
        seconds: Duration in seconds.
        versions: Versions of Python and the libraries by name.
    """

    schema: Literal[1] = 1
    problem: Problem
    settings: Settings
    design: Design
    chosen: int
    runs: tuple[RunRecord, ...]
    history: tuple[Step, ...]
    seconds: float
    versions: dict[str, str]


def record_of(outcome: Outcome, settings: Settings) -> Record:
    """Return the record of an optimisation that was run with these settings."""
    return Record(
        problem=outcome.problem,
        settings=settings,
        design=outcome.design,
        chosen=outcome.chosen,
        runs=tuple(
            RunRecord(best=run.best.number, **_fields(RunSummary, run)) for run in outcome.runs
        ),
        history=tuple(map(step_of, outcome.history)),
        seconds=outcome.seconds,
        versions=versions(),
    )


def encode_record(record: Record) -> bytes:
    """Return a record as indented JSON, which `decode_record` reads back unchanged."""
    return msgspec.json.format(msgspec.json.encode(record), indent=1) + b"\n"


def decode_record(data: bytes, source: str) -> Record:
    """Return the record in a JSON text.

    Args:
        data: The text, UTF-8 or UTF-16.
        source: Name of the text in an error message.

    Raises:
        InputError: Not JSON, of another schema, with unknown fields, fields given twice or
            unusable values.
    """
    return decode_strictly(data, Record, source)


def load_record(path: Path) -> Record:
    """Return the record in a file.

    Raises:
        InputError: The file holds no record.
        StorageError: The file cannot be read.
    """
    return decode_record(read_at_most(path, LARGEST_FILE), str(path))


def step_of(iterate: Iterate) -> Step:
    """Return an iterate without its design."""
    return Step(**_fields(Step, iterate))


def _fields(base: type[msgspec.Struct], value: msgspec.Struct) -> dict[str, Any]:
    """Return the values of those fields that a value has from a base."""
    return {name: getattr(value, name) for name in base.__struct_fields__}


GOALS: Mapping[ObjectiveName, str] = MappingProxyType(
    {
        "match-volume": "volume",
        "smallest-reach": "longest_leg",
        "largest-volume": "volume",
        "largest-margin": "box_margin",
        "smallest-load": "load_share",
        "smallest-error": "worst_error",
        "smallest-deflection": "deflection",
    }
)
"""The name in the catalogue of the measure that each objective improves."""

OBJECTIVE_SYMBOLS: Mapping[ObjectiveName, str] = MappingProxyType(
    {
        objective: "F" if objective == "match-volume" else CATALOGUE[name].label
        for objective, name in GOALS.items()
    }
)
"""The name of the value of each objective: F, or the label of the measure in the catalogue."""

# Value drawn for an objective of zero, which has no logarithm.
LEAST = 1e-16


@dataclass(frozen=True)
class Curve:
    """Values of the iterates of one start.

    Attributes:
        kind: Quantity of the values.
        values: Value of each iterate, shape (n,); NaN for an infinite one.
        level: Value to compare the others with, or None.
        powers: Whether the values are exponents of ten.
    """

    kind: Literal["objective", "volume", "spare"]
    values: FloatArray
    level: float | None
    powers: bool = False


def curves_of(problem: Problem, iterates: Sequence[Step]) -> list[Curve]:
    """Return the curves of one start of a search.

    Args:
        problem: The problem.
        iterates: Iterates in their order; not empty.
    """
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
