"""Results of a study: a folder of parts as columns, and the Pareto front of their rows.

The front has the designs that no other beats in one objective without being worse in another.
"""

from __future__ import annotations

import io
import math
from collections import Counter
from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray

from explorer.errors import InputError
from explorer.files.extras import load_extra
from explorer.measures.catalogue import CATALOGUE
from explorer.mechanism.design import Design
from explorer.numerics.arrays import BoolArray, FloatArray, IntArray
from explorer.numerics.number_text import UNITS, Unit
from explorer.optimise.problem import YAW
from explorer.sweep.machine import MACHINE
from explorer.sweep.parts import pyarrow, sound_parts, stray_paths, words_of_paths
from explorer.sweep.rows import Kind, Value, columns_of, design_of
from explorer.sweep.study import NAMES, Objective, Study


def costs(columns: Mapping[str, Any], objectives: Sequence[Objective]) -> FloatArray:
    """Return m objectives of n rows with such signs that less is better, shape (n, m)."""
    signs = [1.0 if objective.sense == "min" else -1.0 for objective in objectives]
    values = [np.asarray(columns[objective.measure], np.float64) for objective in objectives]
    return np.column_stack(values) * signs


def front(columns: Mapping[str, Any], objectives: Sequence[Objective]) -> BoolArray:
    """Return which rows are on the Pareto front of one objective or more, shape (n,).

    Only rows that are done and have all objectives can be on it; equal rows are on it together.
    """
    cost = costs(columns, objectives)
    rows = np.flatnonzero((columns["status"] == "done") & np.isfinite(cost).all(axis=1))
    is_best = np.zeros(len(cost), dtype=np.bool_)
    is_best[rows[undominated_rows(cost[rows])]] = True
    return is_best


def undominated_rows(cost: FloatArray) -> IntArray:
    """Return the rows of costs (n, m) that no other row dominates, ascending.

    A row dominates another if it is no larger anywhere and smaller somewhere.
    """
    # In this order a row is dominated only by rows before it.
    order = np.lexsort(cost.T[::-1])
    remaining = cost[order]
    done = 0
    while done < len(remaining):
        best = remaining[done]
        beaten = (remaining >= best).all(axis=1) & (remaining > best).any(axis=1)
        order, remaining = order[~beaten], remaining[~beaten]
        done += 1
    return np.sort(order)


Column = NDArray[Any]


@dataclass(frozen=True)
class Results:
    """The rows of a study so far.

    Attributes:
        study: The study.
        columns: Columns by name, in the order of the files, shape (n,) each: numbers as float64
            with NaN where there is none, "index" as int64, "status" and "reason" as str objects.
    """

    study: Study
    columns: dict[str, Column]

    @property
    def count(self) -> int:
        """Number of rows."""
        return len(self.columns["index"])

    def front(self) -> BoolArray:
        """Return which rows are on the Pareto front of the study's objectives, shape (n,)."""
        if not self.study.objectives:
            return np.zeros(self.count, dtype=np.bool_)
        return front(self.columns, self.study.objectives)

    def design_of_row(self, row: int) -> Design:
        """Return the design of a row from 0; where parts are missing it is not the design's index.

        Raises:
            InputError: There is no such row.
        """
        if not 0 <= row < self.count:
            raise InputError(f"the row must lie within 0 to {self.count - 1}; got {row}")
        study, index = self.study, int(self.columns["index"][row])
        values = {name: float(self.columns[name][row]) for name in study.variables}
        return design_of(study, values, f"{study.name[:80]} #{index}")

    def design_at(self, index: int) -> Design:
        """Return the design with an index.

        Raises:
            InputError: There is no such design, or it has not been computed yet.
        """
        if not 0 <= index < self.study.count:
            raise InputError(f"the index must lie within 0 to {self.study.count - 1}; got {index}")
        rows = np.flatnonzero(self.columns["index"] == index)
        if not len(rows):
            raise InputError(f"design {index} has not been computed yet")
        return self.design_of_row(int(rows[0]))


@dataclass(frozen=True)
class Summary:
    """Summary of a results folder, from one pass that keeps nothing but the front.

    Attributes:
        study: The study.
        counts: Number of rows of each status.
        front: Rows on the Pareto front, in the order of their first objective.
        incomparable: Number of rows that are done but lack an objective, so no front has them.
        damaged: Number of parts that cannot be read; a run computes them again.
        strays: Names of Parquet files that are no parts of the study, such as copies.
    """

    study: Study
    counts: dict[str, int]
    front: list[dict[str, Value]]
    incomparable: int
    damaged: int
    strays: list[str]

    @property
    def count(self) -> int:
        """Number of rows."""
        return sum(self.counts.values())


def load_results(folder: str | Path, study: Study | None = None) -> Results:
    """Return the rows of a results folder, as far as they have been computed.

    If the study is given, the folder may have no rows yet; else it is that of its parts.

    Raises:
        InputError: The folder holds no results, or those of another study or of several.
        MissingExtraError: Pyarrow is not installed.
    """
    damaged: list[Path] = []
    parts = list(sound_parts(Path(folder), damaged, study))
    if not parts and (study is None or damaged):
        raise _no_results(folder, damaged)
    known = parts[0][0] if study is None else study
    columns: dict[str, Column] = {}
    for name, kind in columns_of(known).items():
        found = [_column(table, name, kind) for *_, table in parts]
        columns[name] = np.concatenate([np.zeros(0, _dtype(name, kind)), *found])
    return Results(known, columns)


def parquet_bytes(results: Results) -> bytes:
    """Return all rows as Parquet, in design units; a number that a row lacks is null.

    Raises:
        MissingExtraError: Pyarrow is not installed.
    """
    return _table_bytes(results.columns, pyarrow().parquet.write_table)


def csv_bytes(results: Results, lengths: Unit) -> bytes:
    """Return all rows as CSV, given the unit of lengths; a number that a row lacks is empty.

    The header has the unit of each column that has one, such as "volume [mm³]".

    Raises:
        MissingExtraError: Pyarrow is not installed.
    """
    columns = dict[str, Column]()
    for name, values in results.columns.items():
        unit = unit_of(name, lengths)
        columns[unit.head(name)] = values if unit.factor == 1.0 else unit.factor * values
    (csv,) = load_extra("study", "pyarrow.csv")
    return _table_bytes(columns, csv.write_csv)


def unit_of(name: str, lengths: Unit) -> Unit:
    """Return the unit of a variable or measure, given that of lengths; "" for a plain number."""
    if name in CATALOGUE:
        return CATALOGUE[name].unit_in(lengths, math.inf)
    if name in MACHINE and MACHINE[name].unit != UNITS.name:
        return Unit(MACHINE[name].unit)
    if name in NAMES and name != YAW:
        return lengths
    return Unit("°" if name == YAW else "")


def _table_bytes(columns: Mapping[str, Column], write: Callable[[Any, io.BytesIO], None]) -> bytes:
    (arrow,) = load_extra("study", "pyarrow")
    pairs, data = columns.items(), io.BytesIO()
    write(arrow.table({name: arrow.array(each, from_pandas=True) for name, each in pairs}), data)
    return data.getvalue()


def summarise(folder: str | Path) -> Summary:
    """Return a summary of a results folder, in memory that does not grow with its parts.

    Raises:
        InputError: The folder holds no results, or those of several studies.
    """
    damaged: list[Path] = []
    counts: Counter[str] = Counter()
    study, best, lacking = None, list[dict[str, Value]](), 0
    for study, _, table in sound_parts(Path(folder), damaged):
        columns = {name: _column(table, name, kind) for name, kind in columns_of(study).items()}
        counts.update(columns["status"].tolist())
        if study.objectives:
            lacks = ~np.isfinite(costs(columns, study.objectives)).all(axis=1)
            lacking += int((lacks & (columns["status"] == "done")).sum())
            chosen = table.filter(front(columns, study.objectives))
            best += chosen.to_pylist()
            of_best = {
                goal.measure: [row[goal.measure] for row in best] for goal in study.objectives
            }
            best = [best[k] for k in undominated_rows(costs(of_best, study.objectives)).tolist()]
    if study is None:
        raise _no_results(folder, damaged)
    for first in study.objectives[:1]:
        best.sort(key=lambda row: float(row[first.measure] or 0.0), reverse=first.sense == "max")
    strays = [path.name for path in stray_paths(Path(folder), study)]
    return Summary(study, dict(counts), best, lacking, len(damaged), strays)


def _column(table: Any, name: str, kind: Kind) -> Column:
    return np.asarray(table.column(name).to_numpy(), _dtype(name, kind))


def _dtype(name: str, kind: Kind) -> Any:
    # Missing numbers become NaN; the index and texts are never missing.
    return object if kind == "string" else np.int64 if name == "index" else np.float64


def _no_results(folder: str | Path, damaged: Sequence[Path]) -> InputError:
    message = f"{str(folder)!r} holds no results of a study"
    if damaged:
        message += f" that can be read: {words_of_paths(damaged)} cannot be"
    return InputError(message)
