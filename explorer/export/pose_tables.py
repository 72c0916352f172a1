"""Tables of poses and of joints as CSV: read with the units of their columns, answered by line.

A heading is a name with a unit, such as `x_mm`, `x [mm]`, `x [10 mm]` or `yaw_deg`. Without a unit
a length is in design units and an angle in degrees. Columns with other names are skipped, so that
a trajectory and the answers of this module are tables too; one with a known name and an unknown
unit is refused. What spreadsheets of any country write
is read: columns separated by commas, semicolons or tabs, the latter two also with decimal commas,
and a first line such as `sep=;`, which names the separator.
"""

from __future__ import annotations

import csv
import difflib
import io
import math
import re
from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import NamedTuple, NoReturn

import numpy as np
from numpy.typing import ArrayLike

from explorer.errors import InputError
from explorer.export.tables import length_heads
from explorer.files.json_text import decode_text
from explorer.files.writing import read_at_most
from explorer.mechanism import kinematics
from explorer.mechanism.configuration import Configuration, Point, offset_of
from explorer.mechanism.design import JOINTS, LENGTHS, Design
from explorer.mechanism.margins import mode_of
from explorer.mechanism.pose import (
    Pose,
    quaternion_from_rotation,
    rotation_from_quaternion,
    rotation_from_yaw_pitch_roll,
)
from explorer.mechanism.tilt_torsion import rotation_from_tilt_torsion
from explorer.numerics.arrays import BoolArray, FloatArray, IntArray
from explorer.numerics.checks import STIFFEST, size_problem
from explorer.workspace.limits.valid_poses import COLLISIONS, colliding_pairs, sides_of_limits

MOST_LINES = 100_000
"""Largest number of poses or joints in a table."""
NO_POSE = "the lengths do not close"
"""The message on joints that have no pose."""

POSITION, TOOL = ("x", "y", "z"), ("tool_x", "tool_y", "tool_z")
QUATERNION = ("qw", "qx", "qy", "qz")
YAW_PITCH_ROLL, TILT_TORSION = ("yaw", "pitch", "roll"), ("azimuth", "tilt", "torsion")
TARGETS = tuple(f"t{k}_{axis}" for k in (1, 2, 3) for axis in "xyz")
DISTANCES, SIGMA, PLANE = ("bar", "gauge"), "sigma", "plane"
"""The columns of what is measured, besides positions and orientations."""
_ROTATIONS: dict[tuple[str, ...], Callable[[ArrayLike], FloatArray]] = {
    QUATERNION: rotation_from_quaternion,
    YAW_PITCH_ROLL: rotation_from_yaw_pitch_roll,
    TILT_TORSION: rotation_from_tilt_torsion,
}

# The factor of each unit: to millimetres, degrees and seconds.
_LENGTH = {"mm": 1.0, "cm": 10.0, "m": 1000.0, "in": 25.4}
_RADIAN = math.degrees(1.0)
_ANGLE = {"deg": 1.0, "°": 1.0, "degrees": 1.0, "rad": _RADIAN, "radians": _RADIAN}
_UNITS: dict[str, Mapping[str, float]] = {
    **dict.fromkeys((*JOINTS, *POSITION, *TOOL, *TARGETS, *DISTANCES, SIGMA), _LENGTH),
    **dict.fromkeys((*YAW_PITCH_ROLL, *TILT_TORSION), _ANGLE),
    **{name: {} for name in (*QUATERNION, PLANE)},
    **{name: {"s": 1.0} for name in ("time", "pause")},
}
_HEADING = re.compile(
    r"(\w+?)\s*(?:[\[(]\s*([-+.\de]*)\s*([a-z°]+)\s*[\])]"
    r"|[_\s]+(mm|cm|m|in|deg|degrees|rad|radians|s))?"
)
# A known name, and one word after it that can only be a unit.
_UNKNOWN_UNIT = re.compile(
    rf"({'|'.join(sorted(_UNITS, key=len, reverse=True))})(?:\s*[^\w\s][^a-z°]*|[\s_-]+)[^\s_]+"
    rf"|({'|'.join(_UNITS)})({'|'.join([*_LENGTH, *_ANGLE, 's'])})"
)
_ANSWERED = ("line", "mode", "within_limits", "violations")


class PoseColumn(NamedTuple):
    """A column: its place in a line, its heading, and its factor to units, degrees or seconds."""

    place: int
    heading: str
    factor: float


@dataclass(frozen=True)
class PoseTable:
    """A table of text, whose known columns, by names without units, are read as numbers.

    A row that is not blank has its number in the file, and cells; the decimal sign is of all.
    """

    file: str
    headings: Sequence[str]
    columns: Mapping[str, PoseColumn]
    rows: Sequence[tuple[int, list[str]]]
    decimal: str

    @property
    def has_orientations(self) -> bool:
        """Whether a column states orientations."""
        return any(not self.columns.keys().isdisjoint(names) for names in _ROTATIONS)

    @property
    def skipped(self) -> tuple[str, ...]:
        """The headings of the columns that are not known, nor written by the explorer."""
        read = {column.place for column in self.columns.values()}
        unread = (heading for place, heading in enumerate(self.headings) if place not in read)
        return tuple(heading for heading in unread if heading not in ("", *_ANSWERED))

    @property
    def lines(self) -> list[int]:
        """The number of the line in the file of each row."""
        return [line for line, _ in self.rows]

    def numbers(self, *names: str, blank: float | None = None) -> FloatArray:
        """Return columns as numbers, shape (n, len(names)), in design units, degrees or seconds.

        Blank cells are the number that is given for them; None if they are faults.

        Raises:
            InputError: A column is missing, or a cell is no finite number; the message has its
                line and column.
        """
        missing = [name for name in names if name not in self.columns]
        if missing:
            example = "_".join([names[0], *list(_UNITS[names[0]])[:1]])
            raise InputError(
                f"{self.file} has no column {missing[0]} among {', '.join(self.headings)}; it "
                f"needs {', '.join(names)}, each with its unit if it has one, such as {example}"
            )
        columns = [self.columns[name] for name in names]
        values = np.empty((len(self.rows), len(names)))
        # The other sign separates thousands, so that a cell with it is no plain number.
        signs = str.maketrans(",.", ".,") if self.decimal == "," else {}
        for index, (_, cells) in enumerate(self.rows):
            for k, (place, _, factor) in enumerate(columns):
                if blank is not None and not cells[place].strip():
                    values[index, k] = blank
                    continue
                try:
                    value = factor * float(cells[place].translate(signs))
                except ValueError:
                    self.refuse(index, names[k], f"a number, such as 12{self.decimal}5, is needed")
                if problem := size_problem(value, most=STIFFEST):
                    self.refuse(index, names[k], f"this {problem}")
                values[index, k] = value
        return values

    def refuse(self, index: int, name: str, needs: str) -> NoReturn:
        """Raise the error of a cell, with its line, its column, and what it needs to be."""
        line, cells = self.rows[index]
        place, heading, _ = self.columns[name]
        raise InputError(f"{self.file}, line {line}, column {heading}: {cells[place]!r}: {needs}")


def read_table(path: Path, unit_mm: float) -> PoseTable:
    """Return the table in a CSV file, as `parse_table` does."""
    return parse_table(str(path), read_at_most(path), unit_mm)


def parse_table(file: str, data: bytes, unit_mm: float) -> PoseTable:
    """Return the table in the contents of a CSV file, whose name messages tell.

    They are UTF-8 or UTF-16, with or without a byte order mark, or Windows-1252.

    Raises:
        InputError: The file is no table, or a heading has a wrong unit or appears twice.
    """
    try:
        text = decode_text(data, "cp1252")
    except InputError as error:
        raise InputError(f"{file}: {error}") from None
    first = next((line for line in text.splitlines() if line.strip(" ;,\t")), "")
    named = re.match('"?sep=([;,|\t])', first)
    separator = named[1] if named else next((sign for sign in ";\t" if sign in first), ",")
    reader = csv.reader(io.StringIO(text, newline=""), delimiter=separator)
    try:
        rows = [(reader.line_num, cells) for cells in reader if any(map(str.strip, cells))]
    except csv.Error as error:
        raise InputError(f"{file}, line {reader.line_num}: this is no CSV: {error}") from None
    rows = rows[1:] if named else rows
    if not 2 <= len(rows) <= MOST_LINES + 1:
        raise InputError(
            f"{file} needs a line of headings, such as x_mm, and 1 to {MOST_LINES} lines of "
            f"numbers below it; lines that are not blank: {len(rows)}"
        )
    headings, columns = [cell.strip() for cell in rows[0][1]], dict[str, PoseColumn]()
    for place, heading in enumerate(headings):
        match = _HEADING.fullmatch(heading.lower())
        if match is None or match[1] not in _UNITS:
            if unknown := _UNKNOWN_UNIT.fullmatch(heading.lower()):
                raise _wrong_unit(file, heading, unknown[1] or unknown[2])
            continue
        if match[1] in columns:
            raise InputError(f"{file} has two columns {match[1]}: leave one out")
        factor = _factor(match, unit_mm)
        if factor is None:
            raise _wrong_unit(file, heading, match[1])
        columns[match[1]] = PoseColumn(place, heading, factor)
    width = len(headings)
    for line, cells in rows[1:]:
        if any(map(str.strip, cells[width:])):
            raise InputError(
                f"{file}, line {line} has {len(cells)} cells below {width} headings; numbers have "
                "decimal points, or semicolons separate the columns"
            )
        cells.extend([""] * (width - len(cells)))
    places = [column.place for column in columns.values()]
    has_comma = separator != "," and any("," in cells[k] for _, cells in rows[1:] for k in places)
    return PoseTable(file, headings, columns, rows[1:], "," if has_comma else ".")


def _wrong_unit(file: str, heading: str, name: str) -> InputError:
    """Return the error of a heading whose unit its name cannot have, with the nearest that can."""
    units, needs = _UNITS[name], "left out"
    if units:
        headings = [f"{name} [{unit}]" if unit == "°" else f"{name}_{unit}" for unit in units]
        (nearest,) = difflib.get_close_matches(heading.lower(), headings, 1, cutoff=0.0)
        needs = f"one of {', '.join(units)}, such as {nearest}"
    return InputError(
        f"{file}, column {heading}: its unit must be {needs}; a column of anything else needs "
        "another name"
    )


def _factor(match: re.Match[str], unit_mm: float) -> float | None:
    """Return the factor of a heading's unit; None if the column cannot have this unit."""
    name, number, *units = match.groups()
    unit = units[0] or units[1]
    if unit is None:
        return 1.0
    try:
        factor = _UNITS[name][unit] * float(number or 1.0)
    except (KeyError, ValueError):
        return None
    return factor / unit_mm if _UNITS[name] is _LENGTH else factor


def read_poses(
    table: PoseTable, design: Design, rotation: FloatArray, at: Point = "b4"
) -> Configuration:
    """Return the poses of a table; the rotation (3, 3) is theirs if it states no orientation.

    With `at` "tool" the columns `tool_x`, `tool_y` and `tool_z` are the positions of the tool.

    Raises:
        InputError: A column is missing, or a cell is faulty.
    """
    stated = [names for names in _ROTATIONS if not table.columns.keys().isdisjoint(names)]
    if len(stated) > 1:
        both = " and ".join(f"the columns {', '.join(names)}" for names in stated)
        raise InputError(f"{table.file} states the orientation twice, by {both}: leave one out")
    for names in stated:
        values = table.numbers(*names)
        zeros: list[int] = np.flatnonzero(~values.any(axis=1)).tolist()
        if names == QUATERNION and zeros:
            needs = "a quaternion must not be all zeros; no turn is 1, 0, 0, 0"
            table.refuse(zeros[0], "qw", needs)
        rotation = _ROTATIONS[names](values)
    position = table.numbers(*(POSITION if at == "b4" else TOOL))
    return Configuration(design, position - offset_of(design, rotation, at), rotation)


def read_corners(
    table: PoseTable, design: Design, rotation: FloatArray, at: Point = "b4"
) -> tuple[tuple[Pose, ...], tuple[float, ...]]:
    """Return the corners of a path in a table, and its pauses there in seconds, zero if none.

    Raises:
        InputError: As in `read_poses`; the table is a path in time, or a pause is below zero.
    """
    if "time" in table.columns:
        raise InputError(
            f"{table.file} has a column time, so it is a path in time already: give the "
            "corners alone, such as those of explorer path --corners"
        )
    c = read_poses(table, design, rotation, at)
    poses = tuple(Pose.of(*each) for each in zip(c.positions, c.rotations, strict=True))
    has_pauses = "pause" in table.columns
    pauses = table.numbers("pause", blank=0.0)[:, 0] if has_pauses else np.zeros(len(poses))
    for index in np.flatnonzero(pauses < 0.0).tolist():
        table.refuse(index, "pause", "a pause must not be below zero")
    return poses, tuple(pauses.tolist())


def read_joints(table: PoseTable) -> FloatArray:
    """Return the joints (l1, d1, d2, d3, d4, l4) of a table, shape (n, 6), in design units.

    Raises:
        InputError: A column is missing, a cell is faulty, or a length is negative.
    """
    joints = table.numbers(*JOINTS)
    for name in LENGTHS:
        negative: list[int] = np.flatnonzero(joints[:, JOINTS.index(name)] < 0.0).tolist()
        if negative:
            table.refuse(negative[0], name, "a length must not be negative")
    return joints


class TableAnswer(NamedTuple):
    """A table of poses with their joints as CSV, and what became of the lines of the given one.

    These are counts of lines: given, with a pose, and with a pose within the limits; the number and
    the fault of the first one without; and the headings of columns that are not read.
    """

    csv: str
    lines: int
    closing: int
    within: int
    first: tuple[int, str] | None
    skipped: tuple[str, ...]


def inverse_answer(
    table: PoseTable,
    poses: Configuration,
    at: Point = "b4",
    joints: FloatArray | None = None,
    closes: BoolArray | None = None,
) -> TableAnswer:
    """Return the joints of the poses of a table, and which limits each violates.

    Other joints (n, 6) than those of the design may be given, and which of the poses close, (n,).
    """
    rows = np.arange(len(table.rows))
    closes = np.ones(len(rows), np.bool_) if closes is None else closes
    joints = poses.joints if joints is None else joints
    return _answer(table, (rows, mode_of(poses.margins)), poses, joints, closes, at)


def forward_answer(
    table: PoseTable,
    design: Design,
    joints: FloatArray,
    at: Point = "b4",
    modes: kinematics.ForwardKinematics | None = None,
) -> TableAnswer:
    """Return the eight modes of the joints (n, 6) of a table, and which limits each violates.

    Joints that do not close have one line without a mode. Other modes than those of the design may
    be given.
    """
    modes = modes or kinematics.forward(design, joints)
    given, mode = np.nonzero(modes.feasible[:, None] | (np.arange(8) == 0))
    poses = Configuration(design, modes.position[given, mode], modes.rotation[given, mode])
    return _answer(table, (given, mode), poses, joints, modes.feasible, at)


def _answer(
    table: PoseTable,
    numbers: tuple[IntArray, IntArray],
    poses: Configuration,
    joints: FloatArray,
    closes: BoolArray,
    at: Point,
) -> TableAnswer:
    """Return the answer for joints (n, 6) and poses, given the line and the mode of each, (m,)."""
    (given, mode), (words, kind, broken) = numbers, _verdicts(poses)
    heads, columns = _columns(poses, len(given), at)
    time = [name for name in ("time",) if name in table.columns]
    known = np.hstack([table.numbers(*time), joints]).tolist()
    starts = [
        f"{line},{','.join(map(repr, row))}" for line, row in zip(table.lines, known, strict=True)
    ]
    rows: list[str] = []
    lists = (each.tolist() for each in (given, mode, columns, kind))
    for index, number, row, which in zip(*lists, strict=True):
        if closes[index]:
            values = ",".join([str(number), *map(repr, row), "false" if words[which] else "true"])
            rows.append(f"{starts[index]},{values},{words[which]}")
        else:
            rows.append(f"{starts[index]},{',' * len(row)},false,{NO_POSE}")
    within = np.zeros(len(closes), dtype=np.bool_)
    within[given[closes[given] & (broken == 0)]] = True
    outside: list[int] = np.flatnonzero(~within).tolist()
    first = (table.lines[outside[0]], NO_POSE) if outside else None
    if outside and closes[outside[0]]:
        # Of eight modes the one that violates the fewest limits.
        there = np.flatnonzero(given == outside[0])
        best = int(there[broken[there].argmin()])
        first = table.lines[outside[0]], f"mode {mode[best]} violates {words[kind[best]]}"
    start = ["line", *(f"{name}_s" for name in time), *length_heads(JOINTS, poses.design.unit_mm)]
    head = [*start, "mode", *heads, "within_limits", "violations"]
    text = "\n".join([",".join(head), *rows, ""])
    counts = len(closes), int(closes.sum()), int(within.sum())
    return TableAnswer(text, *counts, first, table.skipped)


def _verdicts(poses: Configuration) -> tuple[list[str], IntArray, IntArray]:
    """Return sets of violated limits in words, and the index and size of that of each pose, (m,).

    The limits are in the order of the design file, then come pairs of legs that collide.
    """
    demands, _, sides = sides_of_limits(poses)
    pairs = zip(COLLISIONS, COLLISIONS, strict=True)
    ends = np.array([*(demand.end_names() for demand in demands), *pairs])
    sides = np.hstack([sides, colliding_pairs(poses)])
    # Poses violate few of all sets of limits, each a number in balanced ternary digits.
    numbers = sides @ 3 ** np.arange(len(ends))
    _, first, kind = np.unique(numbers, return_index=True, return_inverse=True)
    words = ["; ".join(ends[side != 0, (side[side != 0] > 0) * 1]) for side in sides[first]]
    return words, kind, np.count_nonzero(sides, axis=1)


def _columns(poses: Configuration, count: int, at: Point) -> tuple[list[str], FloatArray]:
    """Return the headings and the numbers of poses, shape (count, 7), or (count, 10) with tools."""
    position = np.broadcast_to(poses.position, (count, 3))
    rotation = np.broadcast_to(poses.rotation, (count, 3, 3))
    heads = [*length_heads(POSITION, poses.design.unit_mm), *QUATERNION]
    numbers = [position, quaternion_from_rotation(rotation)]
    if at == "tool":
        heads += length_heads(TOOL, poses.design.unit_mm)
        numbers.append(position + offset_of(poses.design, rotation, at))
    return heads, np.hstack(numbers)
