"""The law of the shortest time within the speeds, accelerations and forces of the actuators.

In it the platform leads, from each grid point to the next. With x the squared rate of the share of
a move and u the change of the rate, speeds bound x, and accelerations and forces bound sums
a u + b x. These bounds hold at both ends of every interval between grid points, in which x changes
by 2 u times its length. What holds the path at rest is assumed to be within the limits, so that x
may be anything from zero to a greatest value, which toppra finds (Pham and Pham, "A New Approach to
Time-Optimal Path Parameterization Based on Reachability Analysis", 2018). Last, each move is slowed
down until it exceeds no limit on a grid ten times finer.
"""

from __future__ import annotations

import math
from types import SimpleNamespace
from typing import NamedTuple

import numpy as np

from explorer.errors import InputError, NoAnswerError
from explorer.files.extras import load_extra
from explorer.legs.moves import StraightMoves
from explorer.mechanism.configuration import Configuration
from explorer.mechanism.design import JOINTS, Design
from explorer.mechanism.machine import or_infinite
from explorer.motion.dynamics import forces_in_motion
from explorer.motion.weights import MovingBodies
from explorer.numerics.arrays import FloatArray, IntArray
from explorer.numerics.number_text import format_apart
from explorer.paths.time_law import PLATFORM, LedIntervals, TimeLaw, Travel

# Modules that find the law, which take seconds to load.
TIMING = "toppra.algorithm", "toppra.constraint"
# Fewest intervals of a move, and steps of an interval after which limits are checked.
FEWEST_INTERVALS, STEPS = 64, 10
SINGULAR = "the path is singular, so that no forces move the platform along it"
# A squared rate that no path reaches, in the unit in which they are about one; toppra fails at 1e5.
UNBOUNDED = 1e4


class RateBounds(NamedTuple):
    """The demands of the actuators' limits at places of a path: a u + b x ≤ most, x ≤ square.

    Attributes:
        a, b, most: Bounds of accelerations and forces to either side, shape (n, 24) each.
        square: Largest x by the speeds, shape (n,).
    """

    a: FloatArray
    b: FloatArray
    most: FloatArray
    square: FloatArray

    @staticmethod
    def along(
        travel: Travel, number: IntArray, share: FloatArray, bodies: MovingBodies
    ) -> RateBounds:
        """Return the bounds by the limits of the design at shares of moves, shape (n,) each.

        Raises:
            NoAnswerError: The path is singular, or a weight exceeds the largest force at rest.
        """
        design, moves = travel
        c, rest = Configuration(design, *moves.poses(number, share)), np.zeros(6)
        twist, bend = moves.slopes(number, c.rotation)
        at_rest, with_u, with_x = (
            forces_in_motion(c, bodies, *motion)
            for motion in ((rest, rest), (rest, twist), (twist, bend))
        )
        if not np.isfinite(at_rest).all():
            raise NoAnswerError(SINGULAR)
        limits = design.actuators
        speed = or_infinite(limits.speed_mm_s) / design.unit_mm
        acceleration = or_infinite(limits.acceleration_mm_s2) / design.unit_mm
        push, pull = limits.limits
        used = np.maximum(at_rest / push, -at_rest / pull)
        if used.max(initial=0.0) >= 1.0:
            place = np.unravel_index(used.argmax(), used.shape)
            force = abs(float(at_rest[place]))
            needed, limit = format_apart((force, force / float(used[place])), 4)
            raise NoAnswerError(
                "the platform cannot rest everywhere on the path: at rest the actuator of "
                f"{JOINTS[int(place[-1])]} needs {needed} N, and its limit is {limit} N"
            )
        slope, curvature = (each[:, :PLATFORM] for each in travel.derivatives(number, share))
        even = np.broadcast_to(acceleration, slope.shape)
        most = np.concatenate([even, push - at_rest, even, pull + at_rest], axis=-1)
        a = np.concatenate([slope, with_u - at_rest], axis=-1)
        b = np.concatenate([curvature, with_x - at_rest], axis=-1)
        a, b = (np.concatenate([each, -each], axis=-1) for each in (a, b))
        unmoved = np.full(slope.shape, np.inf)
        fastest = np.divide(speed, np.abs(slope), out=unmoved, where=slope != 0.0)
        return RateBounds(a, b, most, fastest.min(axis=-1) ** 2)


def law_of_shortest_time(design: Design, moves: StraightMoves, bodies: MovingBodies) -> TimeLaw:
    """Return the law of the shortest time within speeds, accelerations and forces of the actuators.

    Needs the extra `timing`. The forces hold and accelerate bodies.

    Raises:
        InputError: The path has no length or too many moves, or no limit bounds the acceleration.
        MissingExtraError: toppra is not installed.
        NoAnswerError: A weight exceeds the largest force of an actuator at rest, or the path is
            singular.
    """
    travel = Travel(design, moves)
    number, share = travel.grid(FEWEST_INTERVALS)
    of_moves = np.split(np.arange(len(number)), np.flatnonzero(np.diff(number)) + 1)
    laws = [_law_of_move(travel, number[part], share[part], bodies) for part in of_moves]
    number, leader, share, speed, acceleration = map(
        np.concatenate,
        zip(*((*law.intervals, law.speed, law.acceleration) for law in laws), strict=True),
    )
    return TimeLaw(travel, LedIntervals(number, leader, share), speed, acceleration)


def _law_of_move(
    travel: Travel, number: IntArray, share: FloatArray, bodies: MovingBodies
) -> TimeLaw:
    """Return the law of one move, whose grid points have a number and shares, shape (n,)."""
    bounds = RateBounds.along(travel, number, share, bodies)
    sides = np.sign(bounds.a) * np.isfinite(bounds.most)
    if not ((sides.max(axis=1) > 0.0) & (sides.min(axis=1) < 0.0)).all():
        raise InputError(
            "nothing limits the acceleration along the path: give the design a limit such as "
            "actuators.acceleration_mm_s2, or actuators.push_n and masses to move; or choose a "
            "duration"
        )
    intervals = LedIntervals.between(number, np.full(len(number), PLATFORM), share)
    intervals = intervals.select(np.arange(len(number) - 1))
    speeds = travel.of_platform(number) * _fastest_rates(share, bounds)
    speed = np.stack([speeds[:-1], speeds[1:]], axis=1)
    acceleration = np.diff(speeds**2) / (2.0 * travel.ways(intervals))
    law = TimeLaw(travel, intervals, speed, acceleration)
    # Between grid points a limit may be exceeded by a little.
    motion = law.within_intervals([i / STEPS for i in range(STEPS)])
    finer = RateBounds.along(travel, motion.number, motion.share, bodies)
    squares = motion.rate**2
    used = (finer.a * motion.change[:, None] + finer.b * squares[:, None]) / finer.most
    excess = max(1.0, used.max(), (squares / finer.square).max())
    return law.lasting(math.sqrt(excess) * law.duration)


def _fastest_rates(share: FloatArray, bounds: RateBounds) -> FloatArray:
    """Return the greatest rates at shares of a move, shape (n,), which start and end at zero."""
    algorithm, constraint = load_extra("timing", *TIMING)
    is_bounded = np.isfinite(bounds.most).all(axis=0)
    a, b, most = (each[:, is_bounded] for each in (bounds.a, bounds.b, bounds.most))
    # The tolerances of toppra are absolute, so it gets squared rates of about one.
    start = np.divide(most, np.abs(a), out=np.full(a.shape, np.inf), where=a != 0.0).min(axis=1)
    unit = float(np.median(np.minimum(start, bounds.square)))
    rows, ones = (unit * a / most, unit * b / most, np.zeros(a.shape)), np.ones(a.shape[1])
    square = np.minimum(bounds.square / unit, UNBOUNDED)
    span = np.stack([np.zeros(len(share)), square], axis=1)
    # Each bound holds at both ends of every interval.
    at_both_ends = constraint.canlinear_colloc_to_interpolate(
        *rows, np.diag(ones), ones, None, None, share, identical=True
    )

    def numbers_of(*_: object) -> tuple[object, ...]:
        return (*at_both_ends[:5], None, span)

    limits, path = constraint.LinearConstraint(), SimpleNamespace(path_interval=(0.0, 1.0))
    limits.identical, limits.compute_constraint_params = True, numbers_of
    search = algorithm.TOPPRA([limits], path, gridpoints=share, solver_wrapper="seidel")
    search.compute_parameterization(0.0, 0.0)
    rates = search.problem_data.sd_vec
    if rates is None or not (rates[1:-1] > 0.0).all():
        raise NoAnswerError("toppra finds no law of the shortest time along the path")
    return math.sqrt(unit) * rates
