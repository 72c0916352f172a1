"""Drives: what a path asks of the six actuators in time, and the least motor that holds it.

Speeds, accelerations and forces are those of a time law, at the start, the middle and the end of
each interval of its grid: between two intervals the acceleration jumps. A force is that of the
joint, so gears, screws and the inertia of rotors are left out. Mean power is the mean of its size,
because most drives turn the power of a brake into heat.
"""

from __future__ import annotations

from collections.abc import Iterator, Mapping
from dataclasses import dataclass
from functools import cached_property
from typing import NamedTuple

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

    limit: str
    share: float
    time: float | None


class Figures(NamedTuple):
    """Numbers of the six actuators along a path, each of shape (6,).

    Attributes:
        peak_speed: Largest speeds to either side, in mm/s.
        peak_force: Largest forces to either side, in N.
        rms_force: Root-mean-square forces, in N.
        peak_power: Largest powers, driving or braking, in W.
        mean_power: Means of the size of the power, in W.
    """

    peak_speed: FloatArray
    peak_force: FloatArray
    rms_force: FloatArray
    peak_power: FloatArray
    mean_power: FloatArray


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
            NoAnswerError: The path is singular.
        """
        time, number, share, rate, change = law.within_intervals(PLACES)
        motion = JointMotion.along(design, moves, number, share, bodies)
        u, x = change[:, None], rate[:, None] ** 2
        speed = design.unit_mm * rate[:, None] * motion.slope
        acceleration = design.unit_mm * (u * motion.slope + x * motion.bend)
        force = motion.held + u * motion.by_u + x * motion.by_x
        return Drives(design, law, time, speed, acceleration, force)

    @property
    def power(self) -> FloatArray:
        """Mechanical powers of the actuators in W, below zero while they brake, shape (n, 6)."""
        return 1e-3 * self.force * self.speed

    @cached_property
    def figures(self) -> Figures:
        """Peaks and means of each actuator."""
        speed, force, power = (np.abs(each) for each in (self.speed, self.force, self.power))
        rms_force, mean_power = np.sqrt(self.mean(force**2)), self.mean(power)
        peaks = (each.max(axis=0) for each in (speed, force, power))
        return Figures(next(peaks), next(peaks), rms_force, next(peaks), mean_power)

    @property
    def least_motor(self) -> Mapping[str, float]:
        """The least that one motor for all six has to hold: the largest of each of the figures."""
        return {name: float(six.max()) for name, six in self.figures._asdict().items()}

    def mean(self, values: FloatArray) -> FloatArray:
        """Return means over time of values at the times, of shape (n, ...)."""
        intervals = np.diff(self.law.time)
        weights = np.outer(intervals[intervals > 0.0], WEIGHTS).ravel()
        return weights @ values / self.law.duration

    @cached_property
    def binding(self) -> tuple[Binding | None, ...]:
        """For each actuator the limit of which it uses the most; None for one without limits."""
        limits, (push, pull) = self.design.actuators, self.design.actuators.limits
        shares = {
            "speed": np.abs(self.speed) / or_infinite(limits.speed_mm_s),
            "acceleration": np.abs(self.acceleration) / or_infinite(limits.acceleration_mm_s2),
            "push": self.force / push,
            "pull": -self.force / pull,
            "continuous force": self.figures.rms_force[None] / or_infinite(limits.continuous_n),
        }
        found: list[Binding | None] = []
        for joint in range(6):
            name, used = max(
                ((name, each[:, joint]) for name, each in shares.items()),
                key=lambda named: float(named[1].max()),
            )
            time = float(self.time[used.argmax()]) if len(used) > 1 else None
            share = float(used.max())
            found.append(Binding(name, share, time) if share > 0.0 else None)
        return tuple(found)


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
    units = (" mm/s", " N", " N", " W.")
    speed, force, steady, power = map(block.Number, [*drives.least_motor.values()][:4], units)
    words = ("A motor that holds all this needs at least ", force, " peak, ", steady)
    yield block.Statement(
        "Least motor",
        (*words, " continuous, ", speed, " and ", power),
        hint="The largest of the six actuators, in each number",
    )
    used = [*map(_binding_words, drives.binding)]
    titles = "peak speed, mm/s", "peak force, N", "RMS force, N", "peak power, W", "mean power, W"
    yield block.Table(
        f"Actuators along the path, {drives.law.duration:.4g} s",
        (
            block.Names("actuator", JOINTS),
            *(
                block.Column(title, six.tolist(), digits=4)
                for title, six in zip(titles, drives.figures, strict=True)
            ),
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
