"""Time laws: when the platform is where on a path of straight moves, from rest to rest.

A law keeps the geometry of its path, so that it stops at every corner, which only infinite
accelerations would pass. It has the rate of the share of a move at grid points, between which the
second derivative of the share is constant.

With x the squared rate and u the change of the rate, speeds bound x, and accelerations and forces
bound sums a u + b x. These bounds hold at both ends of every interval between grid points, in which
x changes by 2 u times its length. What holds the path at rest is assumed to be within the limits,
so that x may be anything from zero to a greatest value, which toppra finds (Pham and Pham, "A New
Approach to Time-Optimal Path Parameterization Based on Reachability Analysis", 2018). Last, the law
is slowed down until it exceeds no limit on a grid ten times finer.
"""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import dataclass
from types import SimpleNamespace
from typing import NamedTuple

import numpy as np

from explorer.errors import InputError, NoAnswerError
from explorer.files.extras import load_extra
from explorer.legs.moves import StraightMoves
from explorer.mechanism.configuration import Configuration
from explorer.mechanism.design import JOINTS, Design
from explorer.mechanism.machine import or_infinite
from explorer.numerics.arrays import FloatArray, IntArray
from explorer.statics.forces import forces_of
from explorer.statics.motion import joint_accelerations, joint_rates
from explorer.statics.weights import MovingBodies, carry

# Points of the grid over the whole path, and the most moves of a path.
POINTS, MOST_MOVES = 200, 10_000
# Least intervals of a move, and steps of an interval after which limits are checked.
LEAST_INTERVALS, STEPS = 16, 10
SINGULAR = "the path is singular, so that no forces move the platform along it"
# A squared rate that no path reaches, in the unit in which they are about one; toppra fails at 1e5.
UNBOUNDED = 1e4


@dataclass(frozen=True)
class TimeLaw:
    """The place on a path over time; between grid points its second derivative is constant.

    Attributes:
        time: Time in seconds, from 0, shape (n,).
        at: Place on the path: number of the move plus the share of it, shape (n,).
        rate: Rate of the place, in 1/s, zero at every corner, shape (n,).
    """

    time: FloatArray
    at: FloatArray
    rate: FloatArray

    @staticmethod
    def of(rates: FloatArray) -> TimeLaw:
        """Return the law with some rates at evenly spaced shares of moves, shape (moves, n)."""
        count, points = rates.shape
        rate = np.append(rates[:, :-1], 0.0)
        at = np.linspace(0.0, count, len(rate), dtype=np.float64)
        sums, steps = rate[1:] + rate[:-1], np.full(len(rate) - 1, 2.0 / (points - 1))
        # A move without a length takes no time.
        steps = np.divide(steps, sums, out=np.zeros(len(steps)), where=sums > 0.0)
        return TimeLaw(np.append(0.0, np.cumsum(steps)), at, rate)

    @property
    def duration(self) -> float:
        """Duration in seconds."""
        return float(self.time[-1])

    def lasting(self, duration: float) -> TimeLaw:
        """Return this law with another duration in seconds.

        Raises:
            InputError: The duration is not above zero.
        """
        if not 0.0 < duration < math.inf:
            raise InputError(f"the duration must be above zero; got {duration:g} s")
        slower = duration / self.duration
        return TimeLaw(slower * self.time, self.at, self.rate / slower)

    def places(self, time: FloatArray) -> tuple[FloatArray, FloatArray, FloatArray]:
        """Return place, its rate and its second derivative at times (n,), each of shape (n,)."""
        index = np.clip(np.searchsorted(self.time, time, "right") - 1, 0, len(self.time) - 2)
        since, rate = time - self.time[index], self.rate[index]
        change = np.diff(self.rate**2) / (2.0 * np.diff(self.at))
        at = self.at[index] + rate * since + 0.5 * change[index] * since**2
        ends = self.at[index], self.at[index + 1]
        return np.clip(at, *ends), rate + change[index] * since, change[index]

    def within_intervals(
        self, parts: Sequence[float]
    ) -> tuple[FloatArray, IntArray, FloatArray, FloatArray, FloatArray]:
        """Return times, moves, shares of them, their rates and second derivatives, (n,) each.

        They are those after some parts, from 0 to below 1, of each interval that takes time.
        """
        steps = np.diff(self.time)[:, None]
        time = (self.time[:-1, None] + steps * np.array(parts))[steps[:, 0] > 0.0].ravel()
        at, rate, change = self.places(time)
        # To rounding the end of an interval may be in the next move.
        middles = 0.5 * (self.at[:-1] + self.at[1:])[steps[:, 0] > 0.0]
        number = np.repeat(middles.astype(np.int64), len(parts))
        return time, number, at - number, rate, change


class JointMotion(NamedTuple):
    """Motions of the joints and forces of the actuators at places of a path, (..., 6) each.

    With x the squared rate of the share of a move and u the change of the rate, the speeds are
    slope √x, the accelerations slope u + curvature x, and the forces at_rest + by_u u + by_x x, in
    design units, seconds and newtons.
    """

    slope: FloatArray
    curvature: FloatArray
    at_rest: FloatArray
    by_u: FloatArray
    by_x: FloatArray

    @staticmethod
    def along(
        design: Design,
        moves: StraightMoves,
        number: IntArray,
        share: FloatArray,
        bodies: MovingBodies,
    ) -> JointMotion:
        """Return the motions and forces at shares of moves by number, shape (...) each."""
        c = Configuration(design, *moves.poses(number, share))
        place, rest = (design, c.position, c.rotation), np.zeros(6)
        twist, change = moves.slopes(number, c.rotation)
        at_rest, with_u, with_x = (
            forces_of(c, carry(c, bodies, *motion).wrench)
            for motion in ((rest, rest), (rest, twist), (twist, change))
        )
        if not np.isfinite(at_rest).all():
            raise NoAnswerError(SINGULAR)
        return JointMotion(
            joint_rates(*place, twist),
            joint_accelerations(*place, twist, change),
            at_rest,
            with_u - at_rest,
            with_x - at_rest,
        )


class Bounds(NamedTuple):
    """What the limits of the actuators demand at places of a path: a u + b x ≤ most, x ≤ square.

    Attributes:
        a, b, most: Bounds of accelerations and forces to either side, shape (..., 24) each.
        square: Largest x by the speeds, shape (...).
    """

    a: FloatArray
    b: FloatArray
    most: FloatArray
    square: FloatArray

    @staticmethod
    def of(design: Design, motion: JointMotion) -> Bounds:
        """Return the bounds by the limits of a design."""
        limits, (slope, curvature, at_rest, by_u, by_x) = design.actuators, motion
        speed = or_infinite(limits.speed_mm_s) / design.unit_mm
        acceleration = or_infinite(limits.acceleration_mm_s2) / design.unit_mm
        push, pull = limits.limits
        share = np.maximum(at_rest / push, -at_rest / pull)
        if share.max(initial=0.0) >= 1.0:
            place = np.unravel_index(share.argmax(), share.shape)
            force = abs(at_rest[place])
            raise NoAnswerError(
                f"the platform cannot rest everywhere on the path: at rest the actuator of "
                f"{JOINTS[int(place[-1])]} needs {force:.4g} N, and its limit is "
                f"{force / share[place]:.4g} N"
            )
        even = np.broadcast_to(acceleration, slope.shape)
        most = np.concatenate([even, push - at_rest, even, pull + at_rest], axis=-1)
        a, b = (np.concatenate(each, axis=-1) for each in ((slope, by_u), (curvature, by_x)))
        fastest = np.divide(
            speed, np.abs(slope), out=np.full(slope.shape, np.inf), where=slope != 0
        )
        a, b = (np.concatenate([each, -each], axis=-1) for each in (a, b))
        return Bounds(a, b, most, fastest.min(axis=-1) ** 2)


def law_at_speed(
    design: Design, moves: StraightMoves, speed: float = math.inf, acceleration: float = 1.0
) -> TimeLaw:
    """Return the law by which the travel of the fastest actuator over each move is a trapezoid.

    It reaches the speed with the acceleration and stops with it, in design units and seconds. With
    no largest speed it brakes from the middle of its travel on.

    Raises:
        InputError: The path has no length, or speed or acceleration is not above zero.
    """
    if not (speed > 0.0 and 0.0 < acceleration < math.inf):
        raise InputError(
            f"speed and acceleration must be above zero; got {speed:g} and {acceleration:g}"
        )
    number, share = _grid(moves)
    p, r = moves.poses(number, share)
    slopes = np.abs(joint_rates(design, p, r, moves.slopes(number, r)[0])).max(axis=-1)
    travel = np.zeros_like(slopes)
    travel[:, 1:] = np.cumsum(slopes[:, 1:] + slopes[:, :-1], axis=1) / (2.0 * (len(share[0]) - 1))
    rest = 2.0 * acceleration * np.minimum(travel, travel[:, -1:] - travel)
    speeds = np.sqrt(np.clip(rest, 0.0, speed**2))
    return TimeLaw.of(np.divide(speeds, slopes, out=np.zeros_like(slopes), where=slopes > 0.0))


def law_of_shortest_time(design: Design, moves: StraightMoves, bodies: MovingBodies) -> TimeLaw:
    """Return the law of the shortest time within speeds, accelerations and forces of the actuators.

    Needs the extra `timing`. The forces hold and accelerate bodies.

    Raises:
        InputError: The path has no length, or no limit bounds the acceleration.
        MissingExtraError: toppra is not installed.
        NoAnswerError: A weight exceeds the largest force of an actuator at rest, or the path is
            singular.
    """
    number, share = _grid(moves)
    bounds = Bounds.of(design, JointMotion.along(design, moves, number, share, bodies))
    sides = np.sign(bounds.a) * np.isfinite(bounds.most)
    if not ((sides.max(axis=-1) > 0.0) & (sides.min(axis=-1) < 0.0))[moves.have_length].all():
        raise InputError(
            "nothing limits the acceleration along the path: give the design a limit such as "
            "actuators.acceleration_mm_s2, or actuators.push_n and masses to move; or choose a "
            "duration"
        )
    squares = np.zeros(share.shape)
    for move in np.flatnonzero(moves.have_length):
        squares[move] = _greatest_squares(Bounds(*(each[move] for each in bounds)))
    law = TimeLaw.of(np.sqrt(squares))
    # Between grid points a limit may be exceeded by a little.
    _, number, share, rate, change = law.within_intervals([i / STEPS for i in range(STEPS)])
    finer = Bounds.of(design, JointMotion.along(design, moves, number, share, bodies))
    asked = (finer.a * change[:, None] + finer.b * rate[:, None] ** 2) / finer.most
    excess = max(1.0, asked.max(), (rate**2 / finer.square).max())
    return law.lasting(law.duration * math.sqrt(excess))


def _grid(moves: StraightMoves) -> tuple[IntArray, FloatArray]:
    """Return number and share of grid points of moves, shape (moves, n) each."""
    count = len(moves.step)
    if not moves.have_length.any():
        raise InputError("the path has no length: it needs two poses that differ")
    if count > MOST_MOVES:
        raise InputError(f"a path has at most {MOST_MOVES} moves; got {count}: leave corners out")
    intervals = max(LEAST_INTERVALS, math.ceil(POINTS / count))
    share = np.linspace(0.0, 1.0, intervals + 1, dtype=np.float64)
    return np.repeat(np.arange(count)[:, None], len(share), axis=1), np.tile(share, (count, 1))


def _greatest_squares(bounds: Bounds) -> FloatArray:
    """Return the greatest squared rates at evenly spaced shares of a move, shape (n,).

    They start and end at zero.
    """
    algorithm, constraint = load_extra("timing", "toppra.algorithm", "toppra.constraint")
    shares = np.linspace(0.0, 1.0, len(bounds.square), dtype=np.float64)
    is_bounded = np.isfinite(bounds.most).all(axis=0)
    a, b, most = (each[:, is_bounded] for each in (bounds.a, bounds.b, bounds.most))
    # The tolerances of toppra are absolute, so it gets squared rates of about one.
    start = np.divide(most, np.abs(a), out=np.full(a.shape, np.inf), where=a != 0.0).min(axis=1)
    unit = float(np.median(np.minimum(start, bounds.square)))
    rows, ones = (unit * a / most, unit * b / most, np.zeros(a.shape)), np.ones(a.shape[1])
    square = np.minimum(bounds.square / unit, UNBOUNDED)
    span = np.stack([np.zeros(len(shares)), square], axis=1)
    # Each bound holds at both ends of every interval.
    at_both_ends = constraint.canlinear_colloc_to_interpolate(
        *rows, np.diag(ones), ones, None, None, shares, identical=True
    )

    def numbers_of(*_: object) -> tuple[object, ...]:
        return (*at_both_ends[:5], None, span)

    limits, path = constraint.LinearConstraint(), SimpleNamespace(path_interval=(0.0, 1.0))
    limits.identical, limits.compute_constraint_params = True, numbers_of
    search = algorithm.TOPPRA([limits], path, gridpoints=shares, solver_wrapper="seidel")
    search.compute_parameterization(0.0, 0.0)
    rates = search.problem_data.sd_vec
    if rates is None or not np.isfinite(rates).all():
        raise NoAnswerError("toppra finds no law of the shortest time along the path")
    return unit * rates**2
