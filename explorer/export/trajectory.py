"""Trajectories as tables of comma-separated values: time, joints and pose in each row."""

from __future__ import annotations

import numpy as np

from explorer.mechanism.design import JOINTS
from explorer.paths.trajectory import Trajectory

COLUMNS = ("time_s", *JOINTS, "x", "y", "z", "qw", "qx", "qy", "qz")
"""The names of the columns, without the unit of lengths."""

TOOL_COLUMNS = ("tool_x", "tool_y", "tool_z")
"""The names of the columns that follow if the tool point moves straight."""

LENGTH_COLUMNS = (*JOINTS, "x", "y", "z", *TOOL_COLUMNS)
"""The names of the columns in design units."""


def trajectory_csv(trajectory: Trajectory) -> str:
    """Return a trajectory as CSV: a header, then a line per sample.

    The header has the unit of each length, such as "l1 [10 mm]". Numbers round-trip to the
    last bit.
    """
    columns = [trajectory.time, trajectory.joints, trajectory.position, trajectory.quaternion]
    names = COLUMNS
    if trajectory.tool_position is not None:
        columns.append(trajectory.tool_position)
        names += TOOL_COLUMNS
    rows = np.column_stack(columns)
    unit = repr(trajectory.unit_mm).removesuffix(".0")
    head = [f"{name} [{unit} mm]" if name in LENGTH_COLUMNS else name for name in names]
    lines = [",".join(head), *(",".join(map(repr, row)) for row in rows.tolist())]
    return "\n".join(lines) + "\n"
