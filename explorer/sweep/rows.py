"""Rows of a study: one for each design, whatever happens to it.

A row and its sample are functions of the study and the index alone, so that any process can compute
any chunk, in any order, repeatedly. The status and the reason of a row say what went wrong with the
design, so that no row is missing.
"""

from __future__ import annotations

import functools
import importlib
import math
from collections.abc import Callable, Iterator, Mapping
from dataclasses import dataclass
from typing import Literal, TypeAlias

import msgspec
import numpy as np

from explorer.errors import DesignError, InputError
from explorer.files.json_text import one_line
from explorer.files.packaged import versions
from explorer.measures.catalogue import CATALOGUE, measure_design, reason_for_missing, unmet_needs
from explorer.measures.measure import Case
from explorer.mechanism.design import Design
from explorer.numerics.arrays import FloatArray
from explorer.numerics.compiled import warm
from explorer.optimise.problem import with_values
from explorer.sweep.machine import MACHINE
from explorer.sweep.study import RADIUS, Study, decode_study

Kind = Literal["int64", "float64", "string"]
"""Name of the type of a column in a file."""

Value: TypeAlias = float | int | str | None
"""Value of a row; None where there is none."""

# Number of designs tried before a study is refused because none of them can be made.
MOST_TRIED = 256


@dataclass(frozen=True)
class Rows:
    """Some rows of a study.

    Attributes:
        indices: Indices of the designs, without gaps.
        columns: Values by column, one for each index, see `columns_of`.
        versions: Versions of the libraries that computed the rows.
    """

    indices: range
    columns: dict[str, list[Value]]
    versions: dict[str, str]


def columns_of(study: Study) -> dict[str, Kind]:
    """Return the columns of a study's rows by name, in their order.

    The status is "done" (all is measured), "empty workspace" (only the design itself is measured),
    "invalid design" (the variables make none), "failed" (an error that is not the design's) or
    "worker died" (each process that tried it died).
    """
    columns: dict[str, Kind] = {"index": "int64"}
    columns.update((name, "float64") for name in (*study.variables, *study.measures))
    columns.update(status="string", reason="string")
    return columns


def evaluate(study: bytes, start: int, stop: int) -> Rows:
    """Return the rows of the designs of an encoded study from one index to before another."""
    decoded = _decode_study(study)
    return _rows(decoded, range(start, stop), lambda sample: _measure(decoded, sample))


def rows_of_dead_workers(study: Study, indices: range, reason: str) -> Rows:
    """Return the rows of designs whose evaluation killed its workers."""
    return _rows(study, indices, lambda _: {"status": "worker died", "reason": reason})


def design_of(study: Study, values: Mapping[str, float], name: str | None = None) -> Design:
    """Return the design with given values of variables of a study, and maybe another name.

    What is not given is as in the study's design.
    """
    design = with_values(study.base, values)
    if RADIUS in values:
        design = design.with_limits(leg_radii=(values[RADIUS],) * 4)
    for variable, number in values.items():
        if variable in MACHINE:
            design = MACHINE[variable].with_value(design, number)
    return design if name is None else msgspec.structs.replace(design, name=name)


def check_study(study: Study) -> None:
    """Check that some of many designs of a study can be made, and have its measures.

    The user then reads at once what is wrong with all of them, rather than in every row.

    Raises:
        InputError: None of them can be used, or all lack what a measure needs.
    """
    first: InputError | None = None
    # The first points of a sequence or a hypercube are spread like the others.
    tried = range(min(study.count, MOST_TRIED))
    if study.sampling.method == "grid" and study.count > MOST_TRIED:
        # Random indices keep no step with a grid.
        tried = np.random.default_rng(0).integers(study.count, size=MOST_TRIED).tolist()
    has_needs = any(CATALOGUE[name].needs for name in study.measures)
    cases: list[Case] = []
    for index in tried:
        (sample,) = _named_samples(study, range(index, index + 1))
        try:
            design = design_of(study, sample)
        except InputError as error:
            first = first or error
            continue
        cases.append(Case(design))
        if not has_needs:
            break
    which = "the" if len(tried) == study.count else f"{len(tried)}"
    if not cases:
        raise InputError(f"none of {which} designs all over the study can be used: {first}")
    if lacking := unmet_needs(cases, study.measures):
        raise InputError(f"the designs of the study have {lacking}")


def load_kernels(study: Study) -> None:
    """Import all kernels that the rows of a study may need."""
    for measure, module in (
        ("accessible_volume", "explorer.workspace.accessible.workspace"),
        ("held_volume", "explorer.workspace.carried_region"),
    ):
        if measure in study.measures:
            importlib.import_module(module)


@functools.lru_cache(4)
def _decode_study(study: bytes) -> Study:
    decoded = decode_study(study, "the study")
    load_kernels(decoded)
    # Compiled kernels repay their second within a few designs, and the last digits must
    # not depend on the time of compilation.
    warm()
    return decoded


def _rows(
    study: Study, indices: range, measure: Callable[[dict[str, float]], dict[str, Value]]
) -> Rows:
    """Return the rows of designs, given what measures the design of a sample."""
    numbered = zip(indices, _named_samples(study, indices), strict=True)
    rows = [{"index": index, **sample, **measure(sample)} for index, sample in numbered]
    columns = {name: [_finite_or_none(row.get(name)) for row in rows] for name in columns_of(study)}
    return Rows(indices, columns, versions())


def _measure(study: Study, sample: dict[str, float]) -> dict[str, Value]:
    """Return the values, the status and the reason of a design; without values if it fails."""
    try:
        return _measure_case(
            Case(design_of(study, sample), study.nodes, study.clearance_margin), study
        )
    except DesignError as error:
        status, reason = "invalid design", str(error)
    except InputError as error:
        status, reason = "failed", str(error)
    except Exception as error:  # noqa: BLE001 - an error of one design must not end the others
        status, reason = "failed", f"{type(error).__name__}: {error}"
    return {"status": status, "reason": one_line(reason)}


def _measure_case(case: Case, study: Study) -> dict[str, Value]:
    status, reason = "done", ""
    if case.volume.volume <= 0.0:
        because = ", ".join(case.volume.empty_because)
        status, reason = "empty workspace", f"emptied by {because}" if because else "no volume"
    measured = measure_design(case, study.measures)
    lacking = unmet_needs([case], study.measures)
    reasons = reason, lacking and f"it has {lacking}", reason_for_missing(case, measured)
    return {**measured.values, "status": status, "reason": "; ".join(filter(None, reasons))}


def _finite_or_none(value: Value) -> Value:
    """Return a value, or None for NaN and infinity."""
    return None if isinstance(value, float) and not math.isfinite(value) else value


def _named_samples(study: Study, rows: range) -> Iterator[dict[str, float]]:
    return (dict(zip(study.variables, row, strict=True)) for row in samples(study, rows).tolist())


def samples(study: Study, rows: range) -> FloatArray:
    """Return the values of the variables of some designs, without gaps, shape (len(rows), d)."""
    ends = np.array(list(study.variables.values()))
    lows, highs = ends[:, 0], ends[:, 1]
    match study.sampling.method:
        case "sobol":
            shares = _sobol(study, rows)
        case "latin-hypercube":
            shares = _hypercube(len(ends), study.count, study.sampling.seed)[rows.start : rows.stop]
        case "grid":
            shares = _grid(study, rows)
    # Rounding must not lead beyond the ends.
    return np.clip(lows + (highs - lows) * shares, lows, highs)


def _sobol(study: Study, rows: range) -> FloatArray:
    from scipy.stats import qmc

    sequence = qmc.Sobol(len(study.variables), rng=study.sampling.seed)
    # SciPy warns of other than powers of two in the first draw, so that is one point.
    first = sequence.random(1)
    if rows.start > 1:
        sequence.fast_forward(rows.start - 1)
    others = len(rows) - (rows.start == 0)
    points = sequence.random(others) if others else first[:0]
    return points if rows.start > 0 else np.concatenate([first, points])


@functools.lru_cache(1)
def _hypercube(variables: int, count: int, seed: int) -> FloatArray:
    """Return the whole hypercube, shape (count, variables), which a process makes once."""
    from scipy.stats import qmc

    return qmc.LatinHypercube(variables, rng=seed).random(count)


def _grid(study: Study, rows: range) -> FloatArray:
    shape = study.shape
    at = np.unravel_index(np.arange(rows.start, rows.stop), shape)
    # A single value lies in the middle of the range.
    return np.column_stack(
        [
            index / (count - 1.0) if count > 1 else np.full(len(rows), 0.5)
            for index, count in zip(at, shape, strict=True)
        ]
    )
