"""The record of an optimisation: all that is needed to look at it, or to run it again.

JSON, read strictly. It holds the problem, the settings, every iterate, and the versions of
the libraries that found it.
"""

from __future__ import annotations

from pathlib import Path
from typing import Literal

import msgspec

from explorer.errors import InputError
from explorer.files.json_text import decode_strictly
from explorer.files.versions import versions
from explorer.mechanism.design import Design
from explorer.optimise.outcome import Iterate, Outcome, Phase, Status
from explorer.optimise.problem import Problem

# No honest record comes near this size, in bytes.
LARGEST_FILE = 200_000_000


class Settings(msgspec.Struct, frozen=True, forbid_unknown_fields=True, kw_only=True):
    """How the search was run; see `optimise_design`."""

    starts: int = 1
    seed: int = 0
    iterations: int = 300


class Step(msgspec.Struct, frozen=True, forbid_unknown_fields=True, kw_only=True):
    """An iterate without its design, which follows from the values; see `Iterate`."""

    number: int
    run: int
    phase: Phase
    values: tuple[float, ...]
    objective: float
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
    """An optimisation as it is kept in a file.

    Attributes:
        schema: Version of the file format.
        problem: What was looked for.
        settings: How.
        design: The best design found.
        chosen: Index of the best run.
        runs: Each start; their best iterate is an index into the history.
        history: Every iterate.
        seconds: How long it took.
        versions: Of Python and the libraries, by name.
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
        history=tuple(step_of(each) for each in outcome.history),
        seconds=outcome.seconds,
        versions=versions(),
    )


def encode_record(record: Record) -> bytes:
    """Return a record as indented JSON, which `decode_record` reads back unchanged."""
    return msgspec.json.format(msgspec.json.encode(record), indent=1) + b"\n"


def decode_record(data: bytes, source: str) -> Record:
    """Return the record in a JSON text.

    Args:
        data: The text, UTF-8.
        source: What to call it in an error message.

    Raises:
        InputError: not JSON, of another schema, with unknown fields, fields given twice or
            unusable values.
    """
    return decode_strictly(data, Record, source)


def load_record(path: Path) -> Record:
    """Return the record in a file.

    Raises:
        InputError: no such file, or one that holds no record.
    """
    try:
        with path.open("rb") as file:
            data = file.read(LARGEST_FILE + 1)
    except (OSError, ValueError) as error:
        reason = error.strerror if isinstance(error, OSError) else str(error)
        raise InputError(f"cannot read {str(path)!r}: {reason}") from None
    if len(data) > LARGEST_FILE:
        raise InputError(
            f"{path}: no record of an optimisation is larger than {LARGEST_FILE} bytes"
        )
    return decode_record(data, str(path))


def step_of(iterate: Iterate) -> Step:
    """Return an iterate without its design."""
    return Step(**{name: getattr(iterate, name) for name in Step.__struct_fields__})


def iterate_of(problem: Problem, step: Step) -> Iterate:
    """Return an iterate of a problem, with its design.

    Raises:
        InputError: its values are not those of a design.
    """
    if len(step.values) != len(problem.variables):
        raise InputError(
            f"iterate {step.number} must have {len(problem.variables)} values; "
            f"got {len(step.values)}"
        )
    return Iterate(design=problem.design_at(step.values), **msgspec.structs.asdict(step))
