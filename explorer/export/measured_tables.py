"""Tables of what was measured of a machine: the joints that its encoders read, and the values.

A line has the columns of the joints, and bar, gauge, t1_x to t3_z, or position and orientation, of
which the first that are there count; `sigma_mm` is the standard deviation of its lengths.
"""

from __future__ import annotations

from dataclasses import replace

import numpy as np
from scipy.spatial.transform import Rotation

from explorer.calibration.measured import Kind, Measured
from explorer.errors import InputError
from explorer.export.pose_tables import (
    SIGMA,
    TARGETS,
    PoseTable,
    read_joints,
    read_poses,
)
from explorer.mechanism.design import Design
from explorer.numerics.arrays import FloatArray


def read_measured(table: PoseTable, design: Design, setup: Measured) -> tuple[FloatArray, Measured]:
    """Return the joints that were read, shape (n, 6), and what was measured, in a setup.

    The setup's values do not count; its standard deviations do if the table states none.

    Raises:
        InputError: A column is missing, or a cell is faulty.
    """
    if setup.kind == "poses":
        poses = read_poses(table, design, design.home_pose.rotation)
        turns = Rotation.from_matrix(poses.rotations).as_rotvec()
        values = np.concatenate([poses.positions, turns], axis=1)
    else:
        targets = TARGETS[: setup.points.size] if setup.kind == "targets" else (setup.kind,)
        values = table.numbers(*targets)
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


def setup_of(
    design: Design,
    kind: Kind,
    targets: PoseTable | None,
    sigma_mm: float,
    sigma_deg: float,
    base: FloatArray | None = None,
) -> Measured:
    """Return the setup of a measurement, without values, whose points are about right.

    The table has points of the platform; of bar and gauge the tool is one. The base has the ball
    (1, 3), or planes (p, 4): normals of any length, and distances.

    Raises:
        InputError: A normal is zero, or targets have no table.
    """
    points, lengths = np.array([design.tool.position]), np.full(3, sigma_mm / design.unit_mm)
    if targets is not None:
        points = targets.numbers(*"xyz")[:3]
    elif kind == "targets":
        raise InputError("targets need a table of where they are (--targets): columns x, y, z")
    base = np.zeros((0, 3)) if base is None else base
    if kind == "gauge":
        sizes = np.linalg.norm(base[:, :3], axis=1, keepdims=True)
        if not sizes.all():
            raise InputError("the normal of a plane must not be all zeros")
        base = np.hstack([base[:, :3] / sizes, base[:, 3:]])
    if kind == "poses":
        sigma = np.concatenate([lengths, np.full(3, np.radians(sigma_deg))])
        return Measured(kind, np.empty((0, 6)), sigma)
    return Measured(
        kind, np.empty((0, 1)), lengths[0], points, base=base, plane=np.arange(len(base) or 1)
    )
