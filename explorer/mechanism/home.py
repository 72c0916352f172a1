"""The home pose: the one in the design file, or the best of a grid of poses.

Its orientation is that of the constant-orientation workspace, and its sign triple is the home
mode. At the identity orientation the lines a1a2 and b2b3 are parallel, so every candidate is
yawed.
"""

from __future__ import annotations

import itertools
from functools import lru_cache

import numpy as np

from explorer.mechanism.design import JOINTS, LENGTHS, Design
from explorer.mechanism.kinematics import inverse
from explorer.mechanism.margins import margins, mode_of, signs_of
from explorer.mechanism.pose import Pose, rotation_from_yaw_pitch_roll
from explorer.numerics.arrays import FloatArray

# Yaw that reproduces the paper's Table 1 in our reading, and its mirror images, in degrees.
YAWS = (-73.1, 73.1, -106.9, 106.9)
# Number of grid positions on each axis.
STEPS = 9


def home_pose(design: Design) -> Pose:
    """Return the design's home pose, or the best pose of a grid if the design has none.

    The grid spans the box (or the reach) with the platform level and yawed. The best pose has
    the largest smallest margin of those within the limits of the lengths and the guide; if
    none is, it is the pose that exceeds these limits the least.
    """
    return design.home or _search_grid(design)


def home_signs(design: Design) -> tuple[int, int, int]:
    """Return the sign triple of the design's home pose, in its own orientation."""
    return _signs_at(home_pose(design))


@lru_cache(64)
def _signs_at(pose: Pose) -> tuple[int, int, int]:
    return signs_of(int(mode_of(margins(pose.position, pose.rotation))))


@lru_cache(64)
def _search_grid(design: Design) -> Pose:
    rotations = rotation_from_yaw_pitch_roll([(yaw, 0.0, 0.0) for yaw in YAWS])
    positions = _candidates(design)
    p, r = positions[None, :, :], rotations[:, None, :, :]
    least_margin = np.abs(margins(p, r)).min(axis=-1)
    joints = inverse(design, p, r)
    ranges = {name: design.length_range(name) for name in LENGTHS}
    if design.limits.guide is not None:
        ranges |= dict.fromkeys(("d1", "d3"), design.limits.guide)
    excess = np.zeros(least_margin.shape)
    for name, (low, high) in ranges.items():
        value = joints[..., JOINTS.index(name)]
        excess += np.maximum(0.0, low - value) + np.maximum(0.0, value - high)
    order = np.lexsort((-least_margin.ravel(), np.round(excess / design.reach, 12).ravel()))
    rotation, position = divmod(int(order[0]), len(positions))
    return Pose.of(positions[position], rotations[rotation])


def _candidates(design: Design) -> FloatArray:
    """Return the positions of the grid, shape (n, 3), in design units."""
    reach = design.reach
    lows, highs = design.limits.box or ((-reach, -reach, 0.0), (reach, reach, reach))
    # The ends are left out: there a margin or the distance to a limit is zero.
    shares = np.linspace(0.0, 1.0, STEPS + 2)[1:-1]
    axes = [low + (high - low) * shares for low, high in zip(lows, highs, strict=True)]
    return np.array(list(itertools.product(*axes)))
