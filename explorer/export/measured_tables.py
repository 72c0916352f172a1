"""Tables of what was measured of a machine: the joints that its encoders read, and the values.

A line has the columns of the joints, and bar, gauge, t1_x to t3_z, or position and orientation, of
which the first that are there count; `sigma_mm` is the standard deviation of its lengths.
"""

from __future__ import annotations

from dataclasses import replace

import numpy as np
from scipy.spatial.transform import Rotation

from explorer.calibration.measured import Kind, Measured
from explorer.export.pose_tables import SIGMA, TARGETS, PoseTable, read_joints, read_poses
from explorer.mechanism.design import Design
from explorer.numerics.arrays import FloatArray


def read_measured(table: PoseTable, design: Design, setup: Measured) -> tuple[FloatArray, Measured]:
    """Return the joints that were read, shape (n, 6), and what was measured, in a setup.

    The setup's values do not count; its standard deviations do if the table states none. Cells of
    distances and targets that are blank were not measured.

    Raises:
        InputError: A column is missing, or a cell is faulty.
    """
    if setup.kind == "poses":
        poses = read_poses(table, design, design.home_pose.rotation)
        turns = Rotation.from_matrix(poses.rotations).as_rotvec()
        values = np.concatenate([poses.positions, turns], axis=1)
    else:
        targets = TARGETS[: setup.points.size] if setup.kind == "targets" else (setup.kind,)
        values = table.numbers(*targets, blank=np.nan)
    sigma = np.broadcast_to(setup.sigma, values.shape).copy()
    if SIGMA in table.columns:
        sigma[:, : 3 if setup.kind == "poses" else None] = table.numbers(SIGMA)
    return read_joints(table), replace(setup, values=values, sigma=sigma)


def kind_of(table: PoseTable) -> Kind:
    """Return what a table has the values of."""
    columns: dict[str, Kind] = {"bar": "bar", "gauge": "gauge", TARGETS[0]: "targets"}
    for name, kind in columns.items():
        if name in table.columns:
            return kind
    return "poses"
