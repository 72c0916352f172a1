"""Tables of what was measured of a machine: the joints that its encoders read, and the values.

A line has the columns of the joints, and bar, gauge, t1_x to t3_z, or position and orientation, of
which the first that are there count; `sigma_mm` is the standard deviation of its lengths.
"""

from __future__ import annotations

from dataclasses import replace

import numpy as np
from scipy.spatial.transform import Rotation

from explorer.calibration.measurement import Kind, Measurement
from explorer.export.pose_tables import SIGMA, TARGETS, PoseTable, read_joints, read_poses
from explorer.export.tables import length_heads
from explorer.mechanism.configuration import Configuration
from explorer.mechanism.design import JOINTS, Design
from explorer.numerics.arrays import FloatArray


def read_measured(
    table: PoseTable, design: Design, setup: Measurement
) -> tuple[FloatArray, Measurement]:
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


def joints_table(poses: Configuration) -> str:
    """Return the joints of poses (n,), as a table to which what is measured is added."""
    head = ["line", *length_heads(JOINTS, poses.design.unit_mm)]
    rows = (f"{1 + k},{','.join(map(repr, row))}" for k, row in enumerate(poses.joints.tolist()))
    return "\n".join([",".join(head), *rows, ""])


def kind_of(table: PoseTable) -> Kind:
    """Return what a table has the values of."""
    kinds: dict[str, Kind] = {"bar": "bar", "gauge": "gauge", TARGETS[0]: "targets"}
    there: list[Kind] = [kind for name, kind in kinds.items() if name in table.columns]
    return there[0] if there else "poses"
