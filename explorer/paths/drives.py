"""Drives: what a path with a time law asks of the six actuators, and of one motor for all.

Speeds, accelerations and forces are those of a time law, at the start, the middle and the end of
each of its intervals: between two intervals the acceleration jumps. A force is that of the joint,
so gears, screws and the inertia of rotors are left out. Mean power is the mean of its size, because
most drives turn the power of a brake into heat.
"""

from __future__ import annotations

from collections.abc import Iterator, Mapping, Sequence
from dataclasses import dataclass
from functools import cached_property
from typing import NamedTuple

import numpy as np

from explorer.errors import InputError, NoAnswerError
from explorer.legs.moves import StraightMoves
from explorer.measures.blocks import block
from explorer.mechanism.configuration import Configuration
from explorer.mechanism.design import JOINTS, Design
from explorer.mechanism.machine import or_infinite
from explorer.mechanism.pose import Pose, Triple
from explorer.motion.dynamics import forces_in_motion
from explorer.motion.masses import DENSITY, bar_masses, moving_bodies
from explorer.motion.weights import MovingBodies
from explorer.numerics.arrays import FloatArray
from explorer.paths.shortest_time import SINGULAR, law_of_shortest_time
from explorer.paths.time_law import Motion, TimeLaw, law_at_speed
from explorer.workspace.limits.valid_moves import LARGEST_TURN, moves_are_valid
from explorer.workspace.limits.valid_poses import violations

# Utilisation from which a limit counts as exceeded, rather than used up to rounding.
BEYOND = 1.0 + 1e-6
# Utilisation from which a limit binds.
BINDING = 1.0 - 1e-3
# Parts of an interval, and their weights in its mean by Simpson's rule.
PARTS, WEIGHTS = (0.0, 0.5, 1.0), (1.0 / 6.0, 4.0 / 6.0, 1.0 / 6.0)


class TimedPath(NamedTuple):
    """A path of straight moves with rest at every corner, its time, and what moves along it.

    Attributes:
        poses: Corners of the path, two or more.
        duration: Duration in seconds with all pauses, in which the fastest actuator accelerates
            over one half of each move and brakes over the other, always by the same; None for the
            shortest time within the limits of the actuators, which needs the extra `timing`.
        tool: Point that moves straight in the platform frame, in design units; None for b4.
        density: Density of legs and platform in kg/m³, as bars with the legs' radii.
        law: Time law of the path, in place of a duration and pauses.
        pauses: Pauses at the corners in seconds, one for each; none if empty.
    """

    poses: Sequence[Pose]
    duration: float | None = None
    tool: Triple | None = None
    density: float = DENSITY
    law: TimeLaw | None = None
    pauses: Sequence[float] = ()


class Binding(NamedTuple):
    """A limit of an actuator that a motion uses up, or else the one of which it uses the most.

    Attributes:
        limit: Its name.
        share: Largest utilisation of it, above 1 beyond it.
        time: Time of that in seconds; None for the continuous force.
    """

    limit: str
    share: float
    time: float | None


class ActuatorSummary(NamedTuple):
    """Peaks and means of the six actuators along a path, each of shape (6,).

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


@dataclass(frozen=True, eq=False)
class ActuatorMotion:
    """Speeds, accelerations and forces of the six actuators at some times.

    Attributes:
        time: Times in seconds, shape (n,).
        speed: Speeds of the joints in mm/s, shape (n, 6).
        acceleration: Their accelerations in mm/s², shape (n, 6).
        force: Forces of the actuators in N, shape (n, 6); f > 0 pushes the joint's value up.
    """

    time: FloatArray
    speed: FloatArray
    acceleration: FloatArray
    force: FloatArray

    @staticmethod
    def of(design: Design, law: TimeLaw, motion: Motion, bodies: MovingBodies) -> ActuatorMotion:
        """Return speeds, forces and powers of the actuators along timed moves, given the masses.

        Raises:
            NoAnswerError: The path is singular.
        """
        moves = law.travel.moves
        c = Configuration(design, *moves.poses(motion.number, motion.share))
        twist, bend = moves.slopes(motion.number, c.rotation)
        rate, change = motion.rate[:, None], motion.change[:, None]
        acceleration = change * twist + rate**2 * bend
        force = forces_in_motion(c, bodies, rate * twist, acceleration)
        if not np.isfinite(force).all():
            raise NoAnswerError(SINGULAR)
        return ActuatorMotion(
            motion.time,
            design.unit_mm * rate * motion.slope,
            design.unit_mm * (change * motion.slope + rate**2 * motion.curvature),
            force,
        )

    @property
    def power(self) -> FloatArray:
        """Mechanical powers of the actuators in W, below zero while they brake, shape (n, 6)."""
        return 1e-3 * self.force * self.speed


@dataclass(frozen=True, eq=False)
class PathDrives(ActuatorMotion):
    """The motion of the actuators along a path, at three times in each interval of its law.

    Attributes:
        design: The manipulator.
        law: Time law of the path.
        bodies: The masses that move.
    """

    design: Design
    law: TimeLaw
    bodies: MovingBodies

    @staticmethod
    def along(design: Design, law: TimeLaw, bodies: MovingBodies) -> PathDrives:
        """Return the actuators' motion under a time law; arguments and errors as in `of`."""
        # One part after the other, because a path of many moves has a million intervals.
        found = [
            ActuatorMotion.of(design, law, law.within_intervals([part]), bodies) for part in PARTS
        ]
        parts = zip(*((m.time, m.speed, m.acceleration, m.force) for m in found), strict=True)
        time, speed, acceleration, force = (
            np.stack(each, axis=1).reshape(-1, *each[0].shape[1:]) for each in parts
        )
        return PathDrives(time, speed, acceleration, force, design, law, bodies)

    def at(self, time: FloatArray) -> ActuatorMotion:
        """Return the motion of the actuators at times (n,)."""
        return self.of(self.design, self.law, self.law.at(time), self.bodies)

    @cached_property
    def summary(self) -> ActuatorSummary:
        """Peaks and means of each actuator."""
        force, power = np.abs(self.force), np.abs(self.power)
        return ActuatorSummary(
            peak_speed=np.abs(self.speed).max(axis=0),
            peak_force=force.max(axis=0),
            rms_force=np.sqrt(self.mean(force**2)),
            peak_power=power.max(axis=0),
            mean_power=self.mean(power),
        )

    @property
    def least_motor(self) -> Mapping[str, float]:
        """The least motor for this law: the largest of the six actuators, in each number."""
        return {name: float(six.max()) for name, six in self.summary._asdict().items()}

    def mean(self, values: FloatArray) -> FloatArray:
        """Return means over time of values at the times, of shape (n, ...)."""
        return np.outer(self.law.steps, WEIGHTS).ravel() @ values / self.law.duration

    @cached_property
    def binding(self) -> tuple[tuple[Binding, ...], ...]:
        """The limits that bind of each actuator, or the nearest to it; none without limits."""
        limits, (push, pull) = self.design.actuators, self.design.actuators.limits
        shares = {
            "speed": np.abs(self.speed) / or_infinite(limits.speed_mm_s),
            "acceleration": np.abs(self.acceleration) / or_infinite(limits.acceleration_mm_s2),
            "push": self.force / push,
            "pull": -self.force / pull,
            "continuous force": self.summary.rms_force[None] / or_infinite(limits.continuous_n),
        }

        def limits_of(joint: int) -> Iterator[Binding]:
            largest = max(each[:, joint].max() for each in shares.values())
            for name, each in shares.items():
                used = each[:, joint]
                if used.max() >= min(largest, BINDING) > 0.0:
                    time = float(self.time[used.argmax()]) if len(used) > 1 else None
                    yield Binding(name, float(used.max()), time)

        return tuple(tuple(limits_of(joint)) for joint in range(6))


def drives_along(design: Design, path: TimedPath) -> PathDrives:
    """Return speeds, forces and powers of the actuators along a path within a design's limits.

    Raises:
        InputError: The path leaves the limits, or as in `law_of_path`.
        MissingExtraError: toppra is not installed.
        NoAnswerError: As in `law_of_path`.
    """
    check_limits(design, StraightMoves.along(path.poses, path.tool))
    # With a limit of the margins no path within the limits is singular.
    if design.limits.margin is None:
        from explorer.paths.crossings import path_margins

        singular = path_margins(path.poses, path.tool)
        if singular.crossings or singular.lies_in:
            raise NoAnswerError(SINGULAR)
    bodies = moving_bodies(design, bar_masses(design, path.density))
    return PathDrives.along(design, law_of_path(design, path), bodies)


def law_of_path(design: Design, path: TimedPath) -> TimeLaw:
    """Return the one time law of a path: that of its duration, or of the shortest time.

    Raises:
        InputError: The path has no length, the platform has no mass, nothing limits the time, or
            the pauses take all of it.
        MissingExtraError: toppra is not installed.
        NoAnswerError: The path is singular, or a weight exceeds the largest force at rest.
    """
    if path.law is not None:
        return path.law
    moves, pauses = StraightMoves.along(path.poses, path.tool), path.pauses
    pauses = pauses or [0.0] * len(path.poses)
    if path.duration is not None:
        law = law_at_speed(design, moves, acceleration=1.0)
        return law.with_pauses(pauses).lasting(path.duration)
    bodies = moving_bodies(design, bar_masses(design, path.density))
    return law_of_shortest_time(design, moves, bodies).with_pauses(pauses)


def check_limits(design: Design, moves: StraightMoves) -> None:
    """Check that moves keep the limits and clearances of a design.

    Raises:
        InputError: They leave them; the message says where.
    """
    numbers, ends = np.arange(len(moves.step)), np.array([0.0, 1.0])
    p, r = moves.poses(np.tile(numbers[:, None], 2), np.tile(ends, (len(numbers), 1)))
    valid = moves_are_valid(design, p[:, 0], r[:, 0], p[:, 1], r[:, 1], tool=moves.tool)
    if valid.all():
        return
    move = int(valid.argmin())
    which = "the path" if len(numbers) == 1 else f"move {move + 1} of the path"
    if np.linalg.norm(moves.turn[move]) >= LARGEST_TURN:
        raise InputError(f"{which} turns by half a turn, for which neither way is the shorter one")
    share = np.linspace(0.0, 1.0, 101, dtype=np.float64)
    c = Configuration(design, *moves.poses(np.full(len(share), move), share))
    for percent, broken in enumerate(violations(c)):
        if broken:
            raise InputError(f"{which} leaves the limits at {percent} % of its way: {broken[0]}")
    raise InputError(f"{which} is not proved to keep the margins and clearances all along")


def drive_blocks(drives: PathDrives) -> Iterator[block.Block]:
    """Yield the demands of a path on the actuators, and on one motor for all six."""
    units = (" mm/s,", " N peak force,", " N continuous force (RMS) and", " W peak power.")
    speed, force, steady, power = map(block.Number, [*drives.least_motor.values()][:4], units)
    used = [*map(_binding_words, drives.binding)]
    yield block.Statement(
        "Least motor for this time law",
        ("One motor for all six needs at least ", speed, " ", force, " ", steady, " ", power),
        hint="The largest of the six actuators, in each number; in the same time another law may "
        "need less of one of them",
    )
    titles = "peak speed, mm/s", "peak force, N", "RMS force, N", "peak power, W", "mean power, W"
    yield block.Table(
        f"Actuators along the path, {drives.law.duration:.4g} s",
        (
            block.Names("actuator", JOINTS),
            *(
                block.Column(title, six.tolist(), digits=4)
                for title, six in zip(titles, drives.summary, strict=True)
            ),
            *((block.Names("most used limit", used),) if any(drives.binding) else ()),
        ),
        "Mean power is the mean of its size: a brake's power counts too.",
        ["beyond" if any(b.share > BEYOND for b in each) else None for each in drives.binding],
    )


def _binding_words(binding: Sequence[Binding]) -> block.Words:
    words: list[str | block.Number | block.Share] = []
    for limit, used, time in binding:
        share = used if used > BEYOND else min(used, 1.0)
        at = "" if time is None else f" at {time:.3f} s"
        words += [", "] * bool(words) + [block.Share(share), f" of {limit}{at}"]
    return tuple(words) or "no limit"
