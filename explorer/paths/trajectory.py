"""Trajectories: paths over time, with the joints.

The path has a time law of `explorer.paths.time_law`: if none is given, the fastest actuator has a
speed all along, so that no other is faster. Samples are evenly spaced in time, or at given times,
and lie on the path exactly; their joints come from inverse kinematics.
"""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
from numpy.typing import ArrayLike

from explorer.errors import InputError
from explorer.legs.moves import StraightMoves
from explorer.mechanism.configuration import tool_offset
from explorer.mechanism.design import Design
from explorer.mechanism.kinematics import inverse
from explorer.mechanism.pose import Pose, quaternion_from_rotation
from explorer.numerics.arrays import FloatArray
from explorer.paths.time_law import TimeLaw, law_at_speed

# The default speed of the fastest actuator, as a share of the reach per second.
DEFAULT_SPEED = 0.1
DEFAULT_SAMPLES = 201
MOST_SAMPLES = 100_000


@dataclass(frozen=True)
class Trajectory:
    """A path over time.

    Attributes:
        time: Time in seconds, from 0, ascending, shape (n,).
        joints: (l1, d1, d2, d3, d4, l4), in design units, shape (n, 6).
        position: b4 in the base frame, in design units, shape (n, 3).
        quaternion: (w, x, y, z), without changes of sign between samples, shape (n, 4).
        at: Place on the path: number of the move plus the share of it, shape (n,).
        unit_mm: Millimetres in one design unit.
        tool_position: Tool point in the base frame, in design units, shape (n, 3); None if b4
            moves straight.
    """

    time: FloatArray
    joints: FloatArray
    position: FloatArray
    quaternion: FloatArray
    at: FloatArray
    unit_mm: float
    tool_position: FloatArray | None = None

    @property
    def duration(self) -> float:
        """Duration in seconds."""
        return float(self.time[-1])


def trajectory(
    design: Design,
    poses: Sequence[Pose],
    *,
    speed: float | None = None,
    samples: int = DEFAULT_SAMPLES,
    tool: ArrayLike | None = None,
    law: TimeLaw | None = None,
    times: FloatArray | None = None,
) -> Trajectory:
    """Return the trajectory along a path of straight moves.

    Args:
        design: The manipulator.
        poses: Corners of the path, two or more.
        speed: Speed of the fastest actuator, in design units per second; by default a tenth
            of the reach.
        samples: Number of samples, evenly spaced in time, both ends included.
        tool: Point that moves straight in the platform frame, shape (3,), in design units; None
            for b4.
        law: Time law of the path, in place of a speed; None for the speed from start to end.
        times: Times of the samples in seconds, both ends included, ascending, shape (n,); None to
            space them evenly.

    Raises:
        InputError: There are too few poses, too few or too many samples, the path has no length,
            the speed is not positive or given beside a law, or the tool is not finite.
    """
    if len(poses) < 2:
        raise InputError("a trajectory needs a path of at least two poses")
    if not 2 <= samples <= MOST_SAMPLES:
        raise InputError(f"a trajectory has 2 to {MOST_SAMPLES} samples; got {samples}")
    if speed is not None and law is not None:
        raise InputError("give a trajectory either a speed or a time law")
    actuator_speed = DEFAULT_SPEED * design.reach if speed is None else speed
    if not (math.isfinite(actuator_speed) and actuator_speed > 0.0):
        raise InputError(f"the speed must be above zero; got {actuator_speed:g}")
    moves, count = StraightMoves.along(poses, tool), len(poses) - 1
    law = law or law_at_speed(design, moves, actuator_speed)
    if times is None:
        times = np.linspace(0.0, law.duration, samples, dtype=np.float64)
    at = law.places_at(times)
    # Moves without a length at either end take no time.
    at[0], at[-1] = 0.0, count
    number = np.minimum(at.astype(np.int64), count - 1)
    position, rotation = moves.poses(number, at - number)
    quaternion = quaternion_from_rotation(rotation)
    flips = (quaternion[1:] * quaternion[:-1]).sum(axis=-1) < 0.0
    signs = np.cumprod(np.where(np.concatenate([[False], flips]), -1.0, 1.0))
    joints = inverse(design, position, rotation)
    of_tool = None if tool is None else position + tool_offset(rotation, tool)
    quaternion *= signs[:, None]
    return Trajectory(times, joints, position, quaternion, at, design.unit_mm, of_tool)
