"""Time laws: when the platform is where on a path of straight moves, from rest to rest.

A law keeps the geometry of its path, so that it stops at every corner, which only infinite
accelerations would pass. So it is the sequence of its moves, whose times add up. A move consists of
intervals, in each of which one leader has a constant acceleration: an actuator, or the platform,
whose travel is in proportion to the share of the move. In the law at a speed the fastest actuator
leads everywhere, and the speed of the leader over time is a trapezoid in closed form. A pause at a
corner is an interval without a way.
"""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import dataclass, field, replace
from functools import cached_property
from typing import NamedTuple

import numpy as np

from explorer.errors import InputError
from explorer.legs.moves import StraightMoves
from explorer.mechanism.design import Design
from explorer.mechanism.kinematics import inverse
from explorer.motion.rates import joint_accelerations, joint_rates
from explorer.numerics.arrays import BoolArray, FloatArray, IntArray
from explorer.numerics.roots import find_roots

MOST_MOVES = 10_000
# Intervals of the grid of a move as long as the reach, and the fewest and the most of any move.
INTERVALS, FEWEST_INTERVALS, MOST_INTERVALS = 200, 24, 1000
# The platform as a leader, after the six joints, and its travel over a move, as a share of the
# move's length. It leads where all actuators are nearly at rest, as in some singular poses.
PLATFORM, PLATFORM_TRAVEL = 6, 1e-6
# Halvings of intervals in which the leader changes, and the share of its speed by which another one
# has to be faster.
HALVINGS, FASTER = 28, 1e-11
# Tolerance of roots over the way of the leader, and the way, over the value of its joint, below
# which the tolerance is no smaller, because the value is rounded.
ROOT_ERROR, SHORT_WAY = 1e-10, 1e-5


class Motion(NamedTuple):
    """The motion along a path at some times.

    Attributes:
        time: Times in seconds, shape (n,).
        number: Number of the move, shape (n,).
        share: Share of it, from 0 to 1, shape (n,).
        rate: Rate of the share in 1/s, shape (n,).
        change: Rate of this rate in 1/s², shape (n,).
        slope, curvature: Derivatives of the joints by the share, in design units, (n, 6) each.
    """

    time: FloatArray
    number: IntArray
    share: FloatArray
    rate: FloatArray
    change: FloatArray
    slope: FloatArray
    curvature: FloatArray


class LedIntervals(NamedTuple):
    """Intervals of moves with their leaders.

    Attributes:
        number: Number of the move, shape (n,).
        leader: Index of the joint that leads, or `PLATFORM`, shape (n,).
        share: Shares of the move at both ends, shape (n, 2).
    """

    number: IntArray
    leader: IntArray
    share: FloatArray

    @staticmethod
    def between(number: IntArray, leader: IntArray, share: FloatArray) -> LedIntervals:
        """Return the intervals from points of moves, (n,) each, to the next; the last have none."""
        last = np.maximum(share, np.append(share[1:], 0.0))
        return LedIntervals(number, leader, np.stack([share, last], axis=1))

    def select(self, index: IntArray | BoolArray) -> LedIntervals:
        """Return the intervals at an index (k,), or where it is true."""
        return LedIntervals(self.number[index], self.leader[index], self.share[index])


class Travel(NamedTuple):
    """The travel of the six joints and of the platform along straight moves, in design units."""

    design: Design
    moves: StraightMoves

    def derivatives(self, number: IntArray, share: FloatArray) -> tuple[FloatArray, FloatArray]:
        """Return first and second derivatives of these seven by the share of moves, (n, 7) each."""
        p, r = self.moves.poses(number, share)
        twist, bend = self.moves.slopes(number, r)
        platform = self.of_platform(number)[:, None]
        slopes = joint_rates(self.design, p, r, twist), platform
        curvatures = joint_accelerations(self.design, p, r, twist, bend), 0.0 * platform
        return np.concatenate(slopes, axis=1), np.concatenate(curvatures, axis=1)

    def of_platform(self, number: IntArray) -> FloatArray:
        """Return the travel of the platform over moves by number (...), of the same shape."""
        return PLATFORM_TRAVEL * self.moves.lengths(self.design.reach, number)

    def ways(self, intervals: LedIntervals) -> FloatArray:
        """Return how far the leader goes in each interval, shape (n,)."""
        start, end = (self._led(intervals, at) for at in intervals.share.T)
        return np.abs(end - start)

    def shares_after(self, intervals: LedIntervals, part: FloatArray) -> FloatArray:
        """Return the shares at which leaders have gone a part, 0 to 1, of their ways, (n,)."""
        first, last = intervals.share[:, 0], intervals.share[:, 1]
        start, whole = self._led(intervals, first), self.ways(intervals)
        scale = np.maximum(whole, SHORT_WAY * np.abs(start))

        def beyond(at: FloatArray) -> FloatArray:
            gone = np.abs(self._led(intervals, first + at * (last - first)) - start)
            return (gone - part * whole) / scale

        at = find_roots(beyond, -part * whole / scale, (1.0 - part) * whole / scale, ROOT_ERROR)
        return np.where(part < 1.0, first + at * (last - first), last)

    def _led(self, intervals: LedIntervals, share: FloatArray) -> FloatArray:
        """Return the travel of the leaders at shares of their moves, shape (n,)."""
        joints = inverse(self.design, *self.moves.poses(intervals.number, share))
        platform = (self.of_platform(intervals.number) * share)[:, None]
        return _pick(np.concatenate([joints, platform], axis=1), intervals.leader)

    def grid(self, fewest: int) -> tuple[IntArray, FloatArray]:
        """Return number and share of grid points of all moves with a length, shape (n,) each.

        They are denser towards both ends of a move, which a motion from rest to rest passes slowly.
        Every move has at least the fewest intervals that are given.

        Raises:
            InputError: No move has a length, or there are too many.
        """
        lengths, reach = self.moves.lengths(self.design.reach), self.design.reach
        moving = np.flatnonzero(self.moves.have_length(reach))
        if not len(moving):
            raise InputError("the path has no length: it needs two poses that differ")
        if len(lengths) > MOST_MOVES:
            raise InputError(
                f"a path has at most {MOST_MOVES} moves; got {len(lengths)}: leave corners out"
            )
        intervals = np.ceil(INTERVALS * lengths[moving] / reach)
        counts = np.clip(intervals, fewest, MOST_INTERVALS).astype(np.int64)
        even = [np.linspace(0.0, 1.0, count + 1, dtype=np.float64) for count in counts]
        return np.repeat(moving, counts + 1), np.sin(0.5 * math.pi * np.concatenate(even)) ** 2

    def led_intervals(self) -> LedIntervals:
        """Return intervals of a grid, each led by the fastest of the seven; errors are its own."""
        number, share = self.grid(FEWEST_INTERVALS)
        leader, is_needed = self._fastest(number, share), np.ones(len(number), dtype=np.bool_)
        for _ in range(HALVINGS):
            at = np.flatnonzero((number[1:] == number[:-1]) & (leader[1:] != leader[:-1]))
            of, middle = number[at], 0.5 * (share[at] + share[at + 1])
            leader = np.insert(leader, at + 1, self._fastest(of, middle))
            number, share = np.insert(number, at + 1, of), np.insert(share, at + 1, middle)
            is_needed = np.insert(is_needed, at + 1, False)
        # Of the points between those of the grid only those at which the leader changes.
        is_needed[1:] |= leader[1:] != leader[:-1]
        return LedIntervals.between(
            number[is_needed], leader[is_needed] % (PLATFORM + 1), share[is_needed]
        )

    def _fastest(self, number: IntArray, share: FloatArray) -> IntArray:
        """Return the index of the fastest, with 7 more for a joint whose value falls, (n,)."""
        slopes, _ = self.derivatives(number, share)
        speeds = np.concatenate([slopes, -slopes[:, :PLATFORM]], axis=1)
        # Of those that are equally fast, as d1 and d3 without a turn, the first.
        return np.argmax(speeds > (1.0 - FASTER) * speeds.max(axis=1)[:, None], axis=1)


def _pick(values: FloatArray, index: IntArray) -> FloatArray:
    """Return values (n, k) by index, shape (n,)."""
    return np.take_along_axis(values, index[:, None], axis=1)[:, 0]


@dataclass(frozen=True, eq=False)
class TimeLaw:
    """The moves of a path in time, one after the other, as intervals with their leaders.

    Attributes:
        travel: The moves of the path, and what may lead along them.
        intervals: The n intervals, by ascending time. A move without a length has none, and takes
            no time.
        speed: Speeds of the leader at both ends, in design units per second, shape (n, 2).
        acceleration: Acceleration of the leader, below zero while it brakes, shape (n,).
        pause: Times in seconds of intervals without a way, zero of the others, shape (n,); those of
            a law without pauses if there are none.
    """

    travel: Travel
    intervals: LedIntervals
    speed: FloatArray
    acceleration: FloatArray
    pause: FloatArray = field(default_factory=lambda: np.zeros(0))

    @cached_property
    def steps(self) -> FloatArray:
        """Times that the intervals take in seconds, shape (n,)."""
        if not len(self.pause):
            return 2.0 * self._ways / self.speed.sum(axis=1)
        steps, moves = self.pause.copy(), self.pause == 0.0
        steps[moves] = 2.0 * self._ways[moves] / self.speed[moves].sum(axis=1)
        return steps

    @cached_property
    def _ways(self) -> FloatArray:
        """How far the leader goes in each interval, shape (n,)."""
        return self.travel.ways(self.intervals)

    @cached_property
    def time(self) -> FloatArray:
        """Times of the ends of the intervals in seconds, from 0, shape (n + 1,)."""
        return np.append(0.0, np.cumsum(self.steps))

    @property
    def duration(self) -> float:
        """Duration in seconds."""
        return float(self.time[-1])

    def lasting(self, duration: float) -> TimeLaw:
        """Return this law with another duration in seconds; pauses stay as long as they are.

        Raises:
            InputError: The duration is not above zero, or pauses take all of it.
        """
        if not 0.0 < duration < math.inf:
            raise InputError(f"the duration must be above zero; got {duration:g} s")
        pauses = float(self.pause.sum())
        if not pauses < duration:
            raise InputError(
                f"the pauses take {pauses:g} s of the {duration:g} s: choose a longer duration or "
                "shorter pauses"
            )
        times = (duration - pauses) / (self.duration - pauses)
        return replace(self, speed=self.speed / times, acceleration=self.acceleration / times**2)

    def with_pauses(self, pauses: Sequence[float]) -> TimeLaw:
        """Return this law, which has none, with a pause in seconds at each corner of the path.

        Raises:
            InputError: There are not as many as corners, or one is below zero.
        """
        count, given = len(self.travel.moves.step) + 1, np.array(pauses, dtype=np.float64)
        if given.shape != (count,) or not ((given >= 0.0) & np.isfinite(given)).all():
            raise InputError(f"a path of {count} poses needs as many pauses, none below 0 s")
        corners = np.flatnonzero(given)
        if not len(corners):
            return self
        # The pause at a corner stands before the first interval of what follows it.
        led, index = self.intervals, np.searchsorted(self.intervals.number, corners)
        is_last = index == len(led.number)
        number = led.number[index - is_last]
        share = np.repeat(np.where(is_last, 1.0, 0.0)[:, None], 2, axis=1)
        intervals = LedIntervals(
            np.insert(led.number, index, number),
            np.insert(led.leader, index, PLATFORM),
            np.insert(led.share, index, share, axis=0),
        )
        return replace(
            self,
            intervals=intervals,
            speed=np.insert(self.speed, index, 0.0, axis=0),
            acceleration=np.insert(self.acceleration, index, 0.0),
            pause=np.insert(np.zeros(len(led.number)), index, given[corners]),
        )

    def at(self, time: FloatArray) -> Motion:
        """Return the motion at times (n,); at a corner, that with which the next move starts."""
        return self._motion(*self._within(time))

    def places_at(self, time: FloatArray) -> FloatArray:
        """Return the places at times (n,): the number of the move plus the share of it, (n,)."""
        index, part = self._within(time)
        return self.intervals.number[index] + self._shares(index, part)

    def times_at(self, place: FloatArray) -> FloatArray:
        """Return the times at places (n,), shape (n,); at a corner, that of the arrival there."""
        led = self.intervals
        index = np.searchsorted(led.number + led.share[:, 1], place)
        index = np.clip(index, 0, len(self.speed) - 1)
        led, (start, end) = led.select(index), self.speed[index].T
        share = np.clip(place - led.number, *led.share.T)
        gone = self.travel.ways(led._replace(share=np.stack([led.share[:, 0], share], axis=1)))
        # Pauses have no way, and no speed at their ends.
        way = np.where(self._ways > 0.0, self._ways, 1.0)[index]
        square = start**2 + (end**2 - start**2) * np.minimum(gone / way, 1.0)
        sums = start + np.sqrt(square)
        return self.time[index] + 2.0 * gone / np.where(sums > 0.0, sums, 1.0)

    def sample_times(self, samples: int) -> FloatArray:
        """Return times with so many even intervals in each move, and one in each pause, (n,)."""
        pause = self.pause if len(self.pause) else np.zeros(len(self.speed))
        key = np.stack([self.intervals.number, pause > 0.0])
        first = np.flatnonzero(np.diff(key, axis=1, prepend=-1).any(axis=0))
        ends = self.time[np.append(first, len(pause))]
        counts = np.where(pause[first] > 0.0, 1, samples)
        parts = [
            np.linspace(start, end, count, endpoint=False, dtype=np.float64)
            for start, end, count in zip(ends[:-1], ends[1:], counts.tolist(), strict=True)
        ]
        return np.append(np.concatenate(parts), self.duration)

    def within_intervals(self, parts: Sequence[float]) -> Motion:
        """Return the motion after parts, from 0 to 1, of the time of each interval, all in turn.

        At the ends of an interval, where accelerations jump, it is the motion within it.
        """
        index = np.repeat(np.arange(len(self.speed)), len(parts))
        return self._motion(index, np.tile(np.array(parts), len(self.speed)))

    def _motion(self, index: IntArray, part: FloatArray) -> Motion:
        """Return the motion after parts of the time of intervals by index, shape (n,) each."""
        time = self.time[index] + part * self.steps[index]
        led, (start, end) = self.intervals.select(index), self.speed[index].T
        speed, share = start + part * (end - start), self._shares(index, part)
        slopes, curvatures = self.travel.derivatives(led.number, share)
        slope, curvature = (_pick(each, led.leader) for each in (slopes, curvatures))
        rate = speed / np.abs(slope)
        change = (self.acceleration[index] - np.sign(slope) * curvature * rate**2) / np.abs(slope)
        joints = slopes[:, :PLATFORM], curvatures[:, :PLATFORM]
        return Motion(time, led.number, share, rate, change, *joints)

    def _within(self, time: FloatArray) -> tuple[IntArray, FloatArray]:
        """Return the index of the interval at times (n,), and the part of its time, (n,) each."""
        index = np.clip(np.searchsorted(self.time, time, "right") - 1, 0, len(self.speed) - 1)
        return index, np.clip((time - self.time[index]) / self.steps[index], 0.0, 1.0)

    def _shares(self, index: IntArray, part: FloatArray) -> FloatArray:
        """Return the shares of moves after parts of intervals by index, shape (n,)."""
        led, (start, end) = self.intervals.select(index), self.speed[index].T
        share, moves = led.share[:, 0].copy(), np.flatnonzero(start + end)
        gone = (part * (2.0 * start + part * (end - start)))[moves] / (start + end)[moves]
        share[moves] = self.travel.shares_after(led.select(moves), gone)
        return share


def law_at_speed(
    design: Design,
    moves: StraightMoves,
    speed: float = math.inf,
    acceleration: float = math.inf,
) -> TimeLaw:
    """Return the law in which the speed of the fastest actuator is a trapezoid over each move.

    It reaches the speed with the acceleration and brakes with the same, in design units and
    seconds. Without a speed it brakes from the middle of its travel on, without an acceleration it
    has the speed all along, also at corners.

    Raises:
        InputError: The path has no length or too many moves; speed or acceleration is not above
            zero, or neither is finite.
    """
    if not (speed > 0.0 and acceleration > 0.0 and min(speed, acceleration) < math.inf):
        raise InputError(
            f"speed and acceleration must be above zero; got {speed:g} and {acceleration:g}"
        )
    travel = Travel(design, moves)
    led = travel.led_intervals()
    speeds, change = np.full(led.share.shape, speed), np.zeros(len(led.number))
    if math.isfinite(acceleration):
        # Travel since the start of the path: at the ends of intervals, of moves, and of ramps.
        ways = travel.ways(led)
        gone = np.append(0.0, np.cumsum(ways))
        starts = np.flatnonzero(np.diff(led.number, prepend=-1))
        begin, end = gone[starts], np.append(gone[starts[1:]], gone[-1])
        ramp = np.minimum(0.5 * speed**2 / acceleration, 0.5 * (end - begin))
        cuts = np.stack([begin + ramp, end - ramp], axis=1).ravel()
        index = np.searchsorted(gone, cuts, "right") - 1
        at = travel.shares_after(led.select(index), (cuts - gone[index]) / ways[index])
        # Divide the intervals in which a ramp ends.
        number, leader = (np.insert(each, index + 1, each[index]) for each in led[:2])
        first, gone = np.insert(led.share[:, 0], index + 1, at), np.insert(gone, index + 1, cuts)
        led = LedIntervals.between(number, leader, first)
        move = np.unique(number, return_inverse=True)[1]
        # Travel to the nearer end of the move, from both ends of each interval.
        gone = np.stack([gone[:-1], gone[1:]], axis=1)
        rest = np.minimum(gone - begin[move, None], end[move, None] - gone)
        speeds = np.sqrt(np.clip(2.0 * acceleration * rest, 0.0, speed**2))
        ramps = rest.mean(axis=1) < ramp[move]
        change = acceleration * np.where(ramps, np.sign(np.diff(rest)[:, 0]), 0.0)
    takes_time = (travel.ways(led) > 0.0) & (speeds.sum(axis=1) > 0.0)
    return TimeLaw(travel, led.select(takes_time), speeds[takes_time], change[takes_time])
