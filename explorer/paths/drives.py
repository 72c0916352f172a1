"""Drives: what a path asks of the six actuators in time, and the least motor that holds it.

Speeds, accelerations and forces are those of a time law, at the start, the middle and the end of
each interval of its grid: between two intervals the acceleration jumps. A force is that of the
joint, so gears, screws and the inertia of rotors are left out. Mean power is the mean of its size,
because most drives turn the power of a brake into heat.
"""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import dataclass
from functools import cached_property
from typing import Literal, NamedTuple

import numpy as np

from explorer.errors import InputError
from explorer.legs.moves import StraightMoves
from explorer.measures.blocks import block
from explorer.mechanism.configuration import Configuration
from explorer.mechanism.design import JOINTS, Design
from explorer.mechanism.machine import or_infinite
from explorer.numerics.arrays import FloatArray
from explorer.paths.time_law import JointMotion, TimeLaw
from explorer.statics.weights import MovingBodies
from explorer.workspace.limits.valid_moves import moves_are_valid
from explorer.workspace.limits.valid_poses import violations

LimitName = Literal["speed", "acceleration", "push", "pull", "continuous force"]
LIMITS: tuple[LimitName, ...] = ("speed", "acceleration", "push", "pull")
"""Limits that a motion uses at a time; that of the continuous force holds for the whole motion."""

# Share of a limit from which it counts as exceeded, rather than used up to rounding.
BEYOND = 1.0 + 1e-6
# Places in an interval, and their weights in its mean by Simpson's rule. The end stays within it.
PLACES, WEIGHTS = (0.0, 0.5, 1.0 - 1e-9), (1.0 / 6.0, 4.0 / 6.0, 1.0 / 6.0)


class Binding(NamedTuple):
    """The limit of an actuator of which a motion uses the largest share.

    Attributes:
        limit: Its name.
        share: Share of it that is used, above 1 beyond it.
        time: Time of the largest share in seconds; None for the continuous force.
    """

    limit: LimitName
    share: float
    time: float | None


class LeastMotor(NamedTuple):
    """Peak and continuous force in N, speed in mm/s and power in W that the six need at least."""

    peak_force: float
    continuous_force: float
    speed: float
    power: float


@dataclass(frozen=True)
class Drives:
    """Speeds, accelerations and forces of the six actuators along a path in time.

    Attributes:
        design: The manipulator.
        law: Time law of the path.
        time: Times in seconds, three for each interval of the law, shape (n,).
        speed: Speeds of the joints in mm/s, shape (n, 6).
        acceleration: Their accelerations in mm/s², shape (n, 6).
        force: Forces of the actuators in N, shape (n, 6); f > 0 pushes the joint's value up.
    """

    design: Design
    law: TimeLaw
    time: FloatArray
    speed: FloatArray
    acceleration: FloatArray
    force: FloatArray

    @staticmethod
    def along(design: Design, moves: StraightMoves, law: TimeLaw, bodies: MovingBodies) -> Drives:
        """Return what moves with a time law ask of the actuators, given the masses that move.

        Raises:
            InputError: The path has no length.
            NoAnswerError: The path is singular.
        """
        if not law.duration > 0.0:
            raise InputError("the path has no length: all its poses are the same")
        steps = np.diff(law.time)
        moving = steps > 0.0
        time = (law.time[:-1][moving, None] + steps[moving, None] * np.array(PLACES)).ravel()
        at, rate, change = law.places(time)
        # The move of an interval, by its middle: to rounding its ends may be in another one.
        middle = 0.5 * (law.at[:-1] + law.at[1:])[moving]
        number = np.repeat(middle.astype(np.int64), len(PLACES))
        motion = JointMotion.along(design, moves, number, at - number, bodies)
        u, x = change[:, None], rate[:, None] ** 2
        speed = design.unit_mm * rate[:, None] * motion.slope
        acceleration = design.unit_mm * (u * motion.slope + x * motion.bend)
        force = motion.held + u * motion.by_u + x * motion.by_x
        return Drives(design, law, time, speed, acceleration, force)

    @property
    def duration(self) -> float:
        """Duration in seconds."""
        return self.law.duration

    @property
    def power(self) -> FloatArray:
        """Mechanical powers of the actuators in W, below zero while they brake, shape (n, 6)."""
        return 1e-3 * self.force * self.speed

    @property
    def peak_speed(self) -> FloatArray:
        """Largest speed of each actuator to either side in mm/s, shape (6,)."""
        return np.abs(self.speed).max(axis=0)

    @property
    def peak_force(self) -> FloatArray:
        """Largest force of each actuator to either side in N, shape (6,)."""
        return np.abs(self.force).max(axis=0)

    @cached_property
    def rms_force(self) -> FloatArray:
        """Root-mean-square force of each actuator in N, shape (6,)."""
        return np.sqrt(self.mean(self.force**2))

    @property
    def peak_power(self) -> FloatArray:
        """Largest power of each actuator, driving or braking, in W, shape (6,)."""
        return np.abs(self.power).max(axis=0)

    @property
    def mean_power(self) -> FloatArray:
        """Mean of the size of each actuator's power in W, shape (6,)."""
        return self.mean(np.abs(self.power))

    def mean(self, values: FloatArray) -> FloatArray:
        """Return means over time of values at the times, of shape (n, ...)."""
        intervals = np.diff(self.law.time)
        weights = np.outer(intervals[intervals > 0.0], WEIGHTS).ravel()
        return weights @ values / self.duration

    @cached_property
    def binding(self) -> tuple[Binding | None, ...]:
        """For each actuator the limit of which it uses the most; None for one without limits."""
        limits = self.design.actuators
        speed, acceleration, continuous = map(
            or_infinite, (limits.speed_mm_s, limits.acceleration_mm_s2, limits.continuous_n)
        )
        push, pull = limits.limits
        shares = np.stack(
            [
                np.abs(self.speed) / speed,
                np.abs(self.acceleration) / acceleration,
                self.force / push,
                -self.force / pull,
            ]
        )
        times = self.time[shares.argmax(axis=1)]
        most, steady = shares.max(axis=1), self.rms_force / continuous
        found: list[Binding | None] = []
        for joint in range(6):
            used = [
                *map(Binding, LIMITS, most[:, joint].tolist(), times[:, joint].tolist()),
                Binding("continuous force", float(steady[joint]), None),
            ]
            largest = max(used, key=lambda each: each.share)
            found.append(largest if largest.share > 0.0 else None)
        return tuple(found)

    @property
    def least_motor(self) -> LeastMotor:
        """The least that one motor for all six actuators has to hold."""
        each = self.peak_force, self.rms_force, self.peak_speed, self.peak_power
        return LeastMotor(*(float(six.max()) for six in each))


def check_limits(design: Design, moves: StraightMoves) -> None:
    """Check that moves keep the limits and clearances of a design.

    Raises:
        InputError: They leave them; the message says where.
    """
    numbers, ends = np.arange(len(moves.step)), np.array([0.0, 1.0])
    p, r = moves.poses(np.tile(numbers[:, None], 2), np.tile(ends, (len(numbers), 1)))
    valid = moves_are_valid(design, p[:, 0], r[:, 0], p[:, 1], r[:, 1], tool=moves.tool)
    for move in np.flatnonzero(~valid).tolist():
        which = "the path" if len(numbers) == 1 else f"move {move + 1} of the path"
        share = np.linspace(0.0, 1.0, 101, dtype=np.float64)
        c = Configuration(design, *moves.poses(np.full(len(share), move), share))
        for percent, broken in enumerate(violations(c)):
            if broken:
                raise InputError(
                    f"{which} leaves the limits at {percent} % of its way: {broken[0]}"
                )
        raise InputError(f"{which} does not keep the margins or clearances of the legs")


def drive_blocks(drives: Drives) -> Iterator[block.Block]:
    """Yield what a path asks of the actuators, and the least motor."""
    motor, used = drives.least_motor, [*map(_binding_words, drives.binding)]
    yield block.Statement(
        "Least motor",
        (
            *("A motor that holds all this needs at least ", block.Number(motor.peak_force, " N")),
            *(" peak, ", block.Number(motor.continuous_force, " N"), " continuous, "),
            *(block.Number(motor.speed, " mm/s"), " and ", block.Number(motor.power, " W.")),
        ),
        hint="The largest of the six actuators, in each number",
    )
    yield block.Table(
        f"Actuators along the path, {drives.duration:.4g} s",
        (
            block.Names("actuator", JOINTS),
            block.Column("peak speed, mm/s", drives.peak_speed.tolist(), digits=4),
            block.Column("peak force, N", drives.peak_force.tolist(), digits=4),
            block.Column("RMS force, N", drives.rms_force.tolist(), digits=4),
            block.Column("peak power, W", drives.peak_power.tolist(), digits=3),
            block.Column("mean power, W", drives.mean_power.tolist(), digits=3),
            *((block.Names("most used limit", used),) if any(drives.binding) else ()),
        ),
        "Mean power is the mean of its size: a brake's power counts too.",
        ["beyond" if each and each.share > BEYOND else None for each in drives.binding],
    )


def _binding_words(binding: Binding | None) -> block.Words:
    if binding is None:
        return "none is given"
    at = "" if binding.time is None else f" at {binding.time:.3f} s"
    share = binding.share if binding.share > BEYOND else min(binding.share, 1.0)
    return f"{binding.limit} ", block.Share(share), at
