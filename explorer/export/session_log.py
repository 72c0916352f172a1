"""The poses of a session as CSV.

A row holds its design too, so that it is reproducible on its own: the forward kinematics of its
joints in its assembly mode is its pose.
"""

from __future__ import annotations

import csv
import io
from dataclasses import dataclass

import numpy as np

from explorer.export.trajectory import COLUMNS as TRAJECTORY_COLUMNS
from explorer.mechanism.design import VARIABLES
from explorer.mechanism.design_file import PRESETS
from explorer.mechanism.kinematics import inverse
from explorer.mechanism.margins import margins
from explorer.mechanism.pose import rotation_from_quaternion
from explorer.numerics.arrays import FloatArray

COLUMNS = (
    *TRAJECTORY_COLUMNS,
    *("kappa1", "kappa2", "kappa3", "mode", "moved_by", "unit_mm"),
    *VARIABLES,
)
"""The names of the columns; lengths are in design units of `unit_mm` millimetres, and so are
the margins δ1 to δ3, in the columns kappa1 to kappa3. The column moved_by is in words."""


@dataclass(frozen=True)
class SessionTable:
    """The poses of a session, in their order.

    Attributes:
        time: Time in seconds since the session began, shape (n,).
        position: Position of b4 in the base frame, in design units, shape (n, 3).
        quaternion: Orientation, platform to base, (w, x, y, z), shape (n, 4).
        mode: Assembly mode, 0 to 7, shape (n,).
        moved_by: Cause of each move, in words.
        unit_mm: Millimetres per design unit, shape (n,).
        variables: Design variables, in the order of `VARIABLES`, shape (n, 6).
    """

    time: FloatArray
    position: FloatArray
    quaternion: FloatArray
    mode: FloatArray
    moved_by: tuple[str, ...]
    unit_mm: FloatArray
    variables: FloatArray


def session_csv(table: SessionTable) -> str:
    """Return the poses of a session as CSV: a header, then a line per pose.

    Numbers round-trip to the last bit.
    """
    rotation = rotation_from_quaternion(table.quaternion)
    numbers = np.column_stack(
        [
            table.time,
            _joints(table, rotation),
            table.position,
            table.quaternion,
            margins(table.position, rotation),
        ]
    ).tolist()
    designs = np.column_stack([table.unit_mm, table.variables]).tolist()
    text = io.StringIO()
    writer = csv.writer(text, lineterminator="\n")
    writer.writerow(COLUMNS)
    modes = table.mode.astype(int).tolist()
    for pose, mode, moved_by, design in zip(numbers, modes, table.moved_by, designs, strict=True):
        writer.writerow([*map(repr, pose), mode, moved_by, *map(repr, design)])
    return text.getvalue()


def _joints(table: SessionTable, rotation: FloatArray) -> FloatArray:
    """Return the joints (n, 6), each row by its own design."""
    joints = np.empty((len(table.time), 6))
    if not len(joints):
        return joints
    any_design = next(iter(PRESETS.values()))
    changes = np.flatnonzero((np.diff(table.variables, axis=0) != 0.0).any(axis=1)) + 1
    for rows in np.split(np.arange(len(joints)), changes):
        design = any_design.with_variables(table.variables[rows[0]].tolist())
        joints[rows] = inverse(design, table.position[rows], rotation[rows])
    return joints
