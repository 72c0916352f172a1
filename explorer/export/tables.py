"""Trajectories, and the tolerances of a design, as tables of comma-separated values."""

from __future__ import annotations

import csv
import io
from collections.abc import Iterable

import numpy as np

from explorer.mechanism.configuration import tool_position
from explorer.mechanism.design import JOINTS
from explorer.mechanism.pose import Pose, Triple
from explorer.numerics.arrays import FloatArray
from explorer.numerics.number_text import Unit
from explorer.paths.drives import PathDrives
from explorer.paths.trajectory import Trajectory
from explorer.statics.accuracy import IS_TILT, SOURCES
from explorer.statics.budget import PARTS, SourceCosts


def trajectory_csv(trajectory: Trajectory, unit_mm: float | None = None) -> str:
    """Return a trajectory as CSV: a header, then a line per sample.

    The header has the unit of each length, given in millimetres; None for the design unit, such as
    "l1 [10 mm]", in which numbers round-trip to the last bit.
    """
    head, columns = _columns(trajectory, unit_mm or trajectory.unit_mm)
    return csv_text(head, np.column_stack(columns).tolist())


def drives_csv(drives: PathDrives, trajectory: Trajectory) -> str:
    """Return the actuators' motion and forces along a path as CSV: a header, a line per sample.

    The trajectory is that of the same path and time law; lengths are in mm.
    """
    head, columns = _columns(trajectory, 1.0)
    rows = drives.at(trajectory.time)
    for name, unit in (("speed", "mm/s"), ("force", "N"), ("power", "W")):
        head += [Unit(unit).head(f"{joint} {name}") for joint in JOINTS]
        columns.append(getattr(rows, name))
    return csv_text(head, np.column_stack(columns).tolist())


def _columns(trajectory: Trajectory, unit_mm: float) -> tuple[list[str], list[FloatArray]]:
    """Return headings and columns of a trajectory, with a unit of lengths."""
    scale, tool = trajectory.unit_mm / unit_mm, trajectory.tool_position
    columns = [trajectory.time, scale * trajectory.joints, scale * trajectory.position]
    columns += [trajectory.quaternion, *([] if tool is None else [scale * tool])]
    head = ["time_s", *length_heads((*JOINTS, *"xyz"), unit_mm), "qw", "qx", "qy", "qz"]
    return head + length_heads([f"tool_{a}" for a in "xyz" if tool is not None], unit_mm), columns


def corners_csv(poses: Iterable[Pose], tool: Triple | None = None) -> str:
    """Return corners of a path as CSV, in design units: positions of the tool, or of b4 if None."""
    name = "" if tool is None else "tool_"
    head = [*(f"{name}{axis}" for axis in "xyz"), "qw", "qx", "qy", "qz"]
    places = ((p.position if tool is None else tool_position(p, tool), p) for p in poses)
    return csv_text(head, ((*position, *pose.quaternion) for position, pose in places))


TOLERANCE_COLUMNS = (
    *("part", "error of", "unit", "tolerance"),
    *("mm per unit", "degrees per unit", "mm at tolerance", "degrees at tolerance", "share"),
)
"""The names of the columns: what an error of a unit, and one of the whole tolerance, does at the
tool, and the share in its worst displacement."""


def tolerance_csv(costs: SourceCosts) -> str:
    """Return tolerances and their costs as CSV: a header, then lines of sources, by part.

    A tolerance that may be any is empty. Numbers round-trip to the last bit.
    """
    effects = costs.displacement, costs.turn, costs.displacement_within, costs.turn_within
    numbers = np.stack([*effects, costs.shares], axis=-1).tolist()
    tolerances = [value if np.isfinite(value) else "" for value in costs.tolerances.tolist()]
    rows = [
        (PARTS[k], SOURCES[k], "degree" if IS_TILT[k] else "mm", tolerances[k], *numbers[k])
        for k in sorted(range(len(SOURCES)), key=lambda k: PARTS[k])
    ]
    return csv_text(TOLERANCE_COLUMNS, rows)


def length_heads(names: Iterable[str], unit_mm: float) -> list[str]:
    """Return headings of lengths in design units, such as "l1 [10 mm]"."""
    unit = Unit("mm" if unit_mm == 1.0 else f"{repr(unit_mm).removesuffix('.0')} mm")
    return [*map(unit.head, names)]


def csv_text(head: Iterable[str], rows: Iterable[Iterable[object]]) -> str:
    """Return a table of comma-separated values."""
    text = io.StringIO()
    csv.writer(text, lineterminator="\n").writerows([head, *rows])
    return text.getvalue()
