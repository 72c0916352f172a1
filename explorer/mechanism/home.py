"""The home pose of a design whose file states none: the best of a grid of poses.

Its orientation is that of the constant-orientation workspace, and its sign triple is the home
mode. At the identity orientation the lines a1a2 and b2b3 are parallel, so every candidate is
yawed.
"""

from __future__ import annotations

import itertools
import math
from functools import lru_cache

import numpy as np

from explorer.mechanism.margins import margins
from explorer.mechanism.points import Variables, joints_of, points_of
from explorer.mechanism.pose import Pose, Triple, rotation_from_yaw_pitch_roll
from explorer.numerics.arrays import lengths_of

Ranges = tuple[tuple[float, float], ...]
"""(Lowest, highest) value of each joint, infinite for no limit."""

# Yaw that reproduces the paper's Table 1 in our reading, and its mirror images, in degrees.
YAWS = (-73.1, 73.1, -106.9, 106.9)
# Number of grid positions on each axis.
STEPS = 9


@lru_cache(64)
def best_home(variables: Variables, ranges: Ranges, box: tuple[Triple, Triple] | None) -> Pose:
    """Return the best pose of a grid.

    The grid spans the box (lows, highs) of b4, or the reach, with the platform level and yawed. The
    best pose has the largest smallest margin of those within the ranges of the joints; if none is,
    it is the pose that exceeds these the least.
    """
    reach = math.hypot(variables[0], variables[1])
    rotations = rotation_from_yaw_pitch_roll([(yaw, 0.0, 0.0) for yaw in YAWS])
    lows, highs = box or ((-reach, -reach, 0.0), (reach, reach, reach))
    # The ends are left out: there a margin or the distance to a limit is zero.
    steps = np.linspace(0.0, 1.0, STEPS + 2)[1:-1]
    axes = [low + (high - low) * steps for low, high in zip(lows, highs, strict=True)]
    positions = np.array(list(itertools.product(*axes)))
    p, r = positions[None, :, :], rotations[:, None, :, :]
    least_margin = np.abs(margins(p, r)).min(axis=-1)
    points = points_of(variables, reach, p, r)
    joints = joints_of(points, lengths_of(points.legs()))
    lows, highs = np.array(ranges).T
    excess = (np.maximum(0.0, lows - joints) + np.maximum(0.0, joints - highs)).sum(axis=-1)
    excess = np.asarray(np.round(excess / reach, 12), dtype=np.float64)
    order = np.lexsort((-least_margin.ravel(), excess.ravel()))
    rotation, position = divmod(int(order[0]), len(positions))
    return Pose.of(positions[position], rotations[rotation])
