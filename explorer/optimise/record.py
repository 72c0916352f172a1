"""Records of optimisations, to read them or run them again.

They are JSON, read strictly: the problem, the settings, every iterate, and the versions of the
libraries.
"""

from __future__ import annotations

from pathlib import Path
from typing import Literal

import msgspec

from explorer.files.json_text import decode_strictly
from explorer.files.packaged import versions
from explorer.files.writing import read_at_most
from explorer.mechanism.design import Design
from explorer.optimise.outcome import Iterate, Outcome, Phase, Status
from explorer.optimise.problem import Problem

# Largest record that is read, in bytes; real ones are much smaller.
LARGEST_FILE = 200_000_000


class Settings(msgspec.Struct, frozen=True, forbid_unknown_fields=True, kw_only=True):
    """Settings of a search; see `optimise_design`."""

    starts: int = 1
    seed: int = 0
    iterations: int = 300


class Step(msgspec.Struct, frozen=True, forbid_unknown_fields=True, kw_only=True):
    """An iterate without its design, which follows from the values; see `Iterate`."""

    number: int
    run: int
    phase: Phase
    values: tuple[float, ...]
    objective: float | None
    volume: float
    worst: str
    spare: float


class RunRecord(msgspec.Struct, frozen=True, forbid_unknown_fields=True, kw_only=True):
    """A run without its iterates; see `Run`."""

    start: tuple[float, ...]
    status: Status
    best: int
    iterations: int
    evaluations: int
    attempts: int
    holding: str
    message: str


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
            RunRecord(
                start=run.start,
                status=run.status,
                best=run.best.number,
                iterations=run.iterations,
                evaluations=run.evaluations,
                attempts=run.attempts,
                holding=run.holding,
                message=run.message,
            )
            for run in outcome.runs
        ),
        history=tuple(step_of(iterate) for iterate in outcome.history),
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
        InputError: not JSON, of another schema, with unknown fields, fields given twice or
            unusable values.
    """
    return decode_strictly(data, Record, source)


def load_record(path: Path) -> Record:
    """Return the record in a file.

    Raises:
        InputError: the file holds no record.
        StorageError: the file cannot be read.
    """
    return decode_record(read_at_most(path, LARGEST_FILE), str(path))


def step_of(iterate: Iterate) -> Step:
    """Return an iterate without its design."""
    return Step(**{name: getattr(iterate, name) for name in Step.__struct_fields__})
