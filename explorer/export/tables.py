"""Trajectories, and the tolerances of a design, as tables of comma-separated values."""

from __future__ import annotations

import csv
import io

import numpy as np

from explorer.mechanism.design import JOINTS
from explorer.paths.trajectory import Trajectory
from explorer.statics.accuracy import IS_TILT, SOURCES
from explorer.statics.budget.costs import PARTS, SourceCosts

_TRAJECTORY_COLUMNS = ("time_s", *JOINTS, "x", "y", "z", "qw", "qx", "qy", "qz")
"""The names of the columns, without the unit of lengths."""

_TOOL_COLUMNS = ("tool_x", "tool_y", "tool_z")
"""The names of the columns that follow if the tool point moves straight."""

_LENGTHS = (*JOINTS, "x", "y", "z", *_TOOL_COLUMNS)
"""The names of the columns in design units."""


def trajectory_csv(trajectory: Trajectory) -> str:
    """Return a trajectory as CSV: a header, then a line per sample.

    The header has the unit of each length, such as "l1 [10 mm]". Numbers round-trip to the
    last bit.
    """
    columns = [trajectory.time, trajectory.joints, trajectory.position, trajectory.quaternion]
    names = _TRAJECTORY_COLUMNS
    if trajectory.tool_position is not None:
        columns.append(trajectory.tool_position)
        names += _TOOL_COLUMNS
    rows = np.column_stack(columns)
    unit = repr(trajectory.unit_mm).removesuffix(".0")
    head = [f"{name} [{unit} mm]" if name in _LENGTHS else name for name in names]
    lines = [",".join(head), *(",".join(map(repr, row)) for row in rows.tolist())]
    return "\n".join(lines) + "\n"


TOLERANCE_COLUMNS = (
    *("part", "error of", "unit", "tolerance"),
    *("mm per unit", "degrees per unit", "mm at tolerance", "degrees at tolerance", "share"),
)
"""The names of the columns: what an error of a unit, and one of the whole tolerance, does at the
tool, and the share in its worst displacement."""


def tolerance_csv(costs: SourceCosts) -> str:
    """Return the tolerances and their costs as CSV: a header, then a line per source of errors.

    The lines are sorted by part; a tolerance that may be any is empty. Numbers round-trip to the
    last bit.
    """
    numbers = (
        costs.displacement,
        costs.turn,
        costs.displacement_within,
        costs.turn_within,
        costs.shares,
    )
    text = io.StringIO()
    writer = csv.writer(text, lineterminator="\n")
    writer.writerow(TOLERANCE_COLUMNS)
    for k in sorted(range(len(SOURCES)), key=lambda k: PARTS[k]):
        tolerance = float(costs.tolerances[k])
        writer.writerow(
            [
                PARTS[k],
                SOURCES[k],
                "degree" if IS_TILT[k] else "mm",
                repr(tolerance) if np.isfinite(tolerance) else "",
                *(repr(float(values[k])) for values in numbers),
            ]
        )
    return text.getvalue()
