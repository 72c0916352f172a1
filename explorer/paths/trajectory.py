"""Paths over time: when the platform is where, with the joints that it takes.

The actuator that moves most moves at a given speed all along, so no other is faster. Samples are
evenly spaced in time and lie on the path exactly; their joints are those of their poses.
"""

from __future__ import annotations

import itertools
import math
from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

from explorer.errors import InputError
from explorer.legs.moves import poses_between
from explorer.mechanism.design import Design
from explorer.mechanism.kinematics import inverse
from explorer.mechanism.pose import Pose, quaternion_from_rotation
from explorer.numerics.arrays import FloatArray

# Of the reach, per second: the speed of the fastest actuator unless told otherwise.
DEFAULT_SPEED = 0.1
DEFAULT_SAMPLES = 201
MOST_SAMPLES = 100_000
# Of each move, to measure how far the actuators go on it.
STEPS = 32


@dataclass(frozen=True)
class Trajectory:
    """A path over time.

    Attributes:
        time: In seconds, from 0, evenly spaced, shape (n,).
        joints: (l1, d1, d2, d3, d4, l4), shape (n, 6).
        position: b4 in the base frame, shape (n, 3).
        quaternion: (w, x, y, z), each on the same side as the one before, shape (n, 4).
        at: The number of the path's move and the share of it added, shape (n,).
    """

    time: FloatArray
    joints: FloatArray
    position: FloatArray
    quaternion: FloatArray
    at: FloatArray

    @property
    def duration(self) -> float:
        """The seconds that it takes."""
        return float(self.time[-1])

    def pose(self, seconds: float) -> Pose:
        """Return the pose of the sample that is nearest in time."""
        index = int(np.abs(self.time - seconds).argmin())
        x, y, z = self.position[index].tolist()
        w, i, j, k = self.quaternion[index].tolist()
        return Pose((x, y, z), (w, i, j, k))


def trajectory(
    design: Design,
    poses: Sequence[Pose],
    *,
    speed: float | None = None,
    samples: int = DEFAULT_SAMPLES,
) -> Trajectory:
    """Return a path of straight moves over time.

    Args:
        design: The manipulator.
        poses: The corners of the path, two or more.
        speed: Of the fastest actuator, in design units a second; by default a tenth of the
            reach.
        samples: How many, both ends included.

    Raises:
        InputError: too few poses, too few or too many samples, or a speed not above zero.
    """
    if len(poses) < 2:
        raise InputError("a trajectory needs a path of two poses at least")
    if not 2 <= samples <= MOST_SAMPLES:
        raise InputError(f"a trajectory has 2 to {MOST_SAMPLES} samples; got {samples}")
    fastest = DEFAULT_SPEED * design.reach if speed is None else speed
    if not (math.isfinite(fastest) and fastest > 0.0):
        raise InputError(f"the speed must be above zero; got {fastest:g}")
    moves = list(itertools.pairwise(poses))
    shares = np.linspace(0.0, 1.0, STEPS + 1, dtype=np.float64)
    time: list[FloatArray] = [np.zeros(1)]
    for start, end in moves:
        joints = inverse(design, *poses_between(start, end, shares))
        ways = np.abs(np.diff(joints, axis=0)).max(axis=-1)
        time.append(time[-1][-1] + np.cumsum(ways) / fastest)
    known = np.concatenate(time)
    wanted = np.linspace(0.0, float(known[-1]), samples, dtype=np.float64)
    # Where nothing moves no time passes: a path that stays has all its samples at its start.
    at = np.interp(wanted, known, np.arange(len(known)) / STEPS)
    at[-1] = len(moves)
    number = np.minimum(at.astype(np.int64), len(moves) - 1)
    position, rotation = np.empty((samples, 3)), np.empty((samples, 3, 3))
    for index, (start, end) in enumerate(moves):
        own = number == index
        position[own], rotation[own] = poses_between(start, end, at[own] - index)
    quaternion = quaternion_from_rotation(rotation)
    turns = (quaternion[1:] * quaternion[:-1]).sum(axis=-1) < 0.0
    signs = np.cumprod(np.where(np.concatenate([[False], turns]), -1.0, 1.0))
    return Trajectory(
        time=wanted,
        joints=inverse(design, position, rotation),
        position=position,
        quaternion=quaternion * signs[:, None],
        at=at,
    )
