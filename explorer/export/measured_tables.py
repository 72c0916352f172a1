"""Tables of what was measured of a machine: the joints that its encoders read, and the values.

A line has the columns of the joints, and bar, gauge, t1_x to t3_z, or position and orientation, of
which the first that are there count; `sigma_mm` is the standard deviation of its lengths, and
`plane` the number of the plane of a gauge.
"""

from __future__ import annotations

from dataclasses import replace

import numpy as np
from scipy.spatial.transform import Rotation

from explorer.calibration.measurement import Kind, Measurement
from explorer.errors import InputError
from explorer.export.pose_tables import PLANE, SIGMA, TARGETS, PoseTable, read_joints, read_poses
from explorer.export.tables import csv_text, length_heads
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
        if not table.has_orientations:
            raise InputError(
                f"{table.file} has no orientations, such as qw, qx, qy and qz; the positions of "
                "one point are those of a target, t1_x, t1_y and t1_z"
            )
        poses = read_poses(table, design, design.home_pose.rotation)
        turns = Rotation.from_matrix(poses.rotations).as_rotvec()
        values = np.concatenate([poses.positions, turns], axis=1)
    else:
        targets = TARGETS[: setup.points.size] if setup.kind == "targets" else (setup.kind,)
        values = table.numbers(*targets, blank=np.nan)
    sigma = np.broadcast_to(setup.sigma, values.shape).copy()
    if SIGMA in table.columns:
        sigma[:, : 3 if setup.kind == "poses" else None] = stated = table.numbers(SIGMA)
        if (stated <= 0.0).any():
            table.refuse(int(stated.argmin()), SIGMA, "a number above zero is needed")
    plane = setup.plane
    if PLANE in table.columns:
        plane = table.numbers(PLANE)[:, 0].astype(np.int64) - 1
        for index in np.flatnonzero((plane < 0) | (plane >= max(1, len(setup.base))))[:1].tolist():
            table.refuse(index, PLANE, f"the number of a plane, 1 to {len(setup.base)}, is needed")
    return read_joints(table), replace(setup, values=values, sigma=sigma, plane=plane)


def joints_table(poses: Configuration, setup: Measurement) -> str:
    """Return the joints of poses (n,), as a table to which what is measured is added.

    Planes of a gauge, if they are several, have their numbers.
    """
    head = ["line", *length_heads(JOINTS, poses.design.unit_mm)]
    rows = [[k, *row] for k, row in enumerate(poses.joints.tolist(), 1)]
    if len(setup.base) > 1:
        planes = 1 + np.resize(setup.plane, len(rows))
        head, rows = [*head, PLANE], [[*row, k] for row, k in zip(rows, planes, strict=True)]
    return csv_text(head, rows)


def kind_of(table: PoseTable) -> Kind:
    """Return what a table has the values of."""
    kinds: dict[str, Kind] = {"bar": "bar", "gauge": "gauge", TARGETS[0]: "targets"}
    there: list[Kind] = [kind for name, kind in kinds.items() if name in table.columns]
    return there[0] if there else "poses"
