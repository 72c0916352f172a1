"""The home pose: the one in the design file, or a sensible one found for it.

Its orientation is that of the constant-orientation workspace, its sign triple the home
mode. At the identity orientation the two lines are parallel, so home is always yawed.
"""

from __future__ import annotations

import itertools
from functools import lru_cache

import numpy as np

from explorer.mechanism.design import JOINTS, LENGTHS, Design
from explorer.mechanism.kinematics import inverse
from explorer.mechanism.margins import margins
from explorer.mechanism.pose import Pose, rotation_from_yaw_pitch_roll
from explorer.numerics.arrays import FloatArray

# The yaw that reproduces Table 1 (degrees), and its mirror images.
YAWS = (-73.1, 73.1, -106.9, 106.9)
# Shares of the reach, or of the box, between which home is looked for on each axis.
STEPS = 9


def home_pose(design: Design) -> Pose:
    """Return the design's home, else the level pose that is farthest from any trouble.

    Sought on a grid over the box (or the reach) with the platform level and yawed: of
    those within the limits the one with the largest smallest margin, or where none is,
    the one that exceeds its lengths the least.
    """
    return design.home or _sought(design)


@lru_cache(64)
def _sought(design: Design) -> Pose:
    rotations = rotation_from_yaw_pitch_roll([(yaw, 0.0, 0.0) for yaw in YAWS])
    positions = _candidates(design)
    p, r = positions[None, :, :], rotations[:, None, :, :]
    nearness = np.abs(margins(p, r)).min(axis=-1)
    joints = inverse(design, p, r)
    excess = np.zeros(nearness.shape)
    for name in LENGTHS:
        low, high = design.length_range(name)
        value = joints[..., JOINTS.index(name)]
        excess += np.maximum(0.0, low - value) + np.maximum(0.0, value - high)
    if design.limits.guide is not None:
        low, high = design.limits.guide
        for name in ("d1", "d3"):
            value = joints[..., JOINTS.index(name)]
            excess += np.maximum(0.0, low - value) + np.maximum(0.0, value - high)
    order = np.lexsort((-nearness.ravel(), np.round(excess / design.reach, 12).ravel()))
    yaw, place = divmod(int(order[0]), len(positions))
    return Pose.of(positions[place], rotations[yaw])


def _candidates(design: Design) -> FloatArray:
    reach = design.reach
    lows, highs = design.limits.box or ((-reach, -reach, 0.0), (reach, reach, reach))
    # Ends are left out: there a margin or a limit is nothing.
    shares = np.linspace(0.0, 1.0, STEPS + 2)[1:-1]
    axes = [low + (high - low) * shares for low, high in zip(lows, highs, strict=True)]
    return np.array(list(itertools.product(*axes)))
