"""The values that joints can have: exact intervals with the others fixed, and bounds by limits.

Each of the three discriminants of `explorer.mechanism.kinematics` is a polynomial of degree at most
four in a carriage position or in the square of a length. Their real roots bound the intervals, and
one trial between two neighbouring roots shows whether the joints close there.

Of the limits, legs 1 and 4 keep b4 in two balls, legs 2 and 3 near the guide, and the bounds of the
guide near its ends. The bounds are those of the boxes around these bodies, in any orientation.
"""

from __future__ import annotations

import functools
import itertools
import math
from collections.abc import Sequence
from typing import NamedTuple

import numpy as np

from explorer.mechanism.design import JOINTS, LENGTHS, Design, Pair
from explorer.mechanism.kinematics import forward, joint_array
from explorer.numerics.arrays import FloatArray
from explorer.numerics.checks import MOST

Interval = tuple[float, float]

_IS_LENGTH = tuple(name in LENGTHS for name in JOINTS)

# Largest joint that can have a meaning.
LARGEST_JOINT = 10.0 * MOST


def feasible_intervals(design: Design, joints: FloatArray) -> tuple[tuple[Interval, ...], ...]:
    """Return, for each joint, the disjoint ascending intervals in which the joints close.

    They are (low, high) in design units; those of a joint depend on the other five.

    Raises:
        InputError: The joints are not usable, see `joint_array`.
    """
    q = joint_array(joints)
    # Dividing by the largest length keeps the roots near one, whatever the units.
    scale = max(map(abs, (*design.variables, *q.tolist())))
    polynomials, joint_of = _discriminants(design, q / scale, scale)
    breaks = [
        _breaks(offset + slope * np.array(roots), scale, is_length)
        for roots, (offset, slope), is_length in zip(
            _real_roots(polynomials), joint_of.tolist(), _IS_LENGTH, strict=True
        )
    ]
    return _closing_intervals(design, q, breaks)


def nearest_feasible(
    design: Design, joints: FloatArray, joint: int, intervals: Sequence[Interval]
) -> float | None:
    """Return the nearest value of one joint at which the joints close; None if there is none.

    The joint is an index in `JOINTS`, with its intervals from `feasible_intervals`.
    """
    value = float(joints[joint])
    if not intervals:
        return None
    candidates = [(min(max(value, low), high), low, high) for low, high in intervals]
    nearest, low, high = min(candidates, key=lambda candidate: abs(candidate[0] - value))
    # The last bits of a root may lie outside: step inwards until the joints close.
    middle = 0.5 * (low + high)
    for share in (0.0, *(10.0**-k for k in range(15, 2, -1))):
        inner = nearest + share * (middle - nearest)
        trial = joints.copy()
        trial[joint] = inner
        if forward(design, trial).feasible:
            return inner
    return None


def _discriminants(
    design: Design, joints: FloatArray, scale: float
) -> tuple[FloatArray, FloatArray]:
    """Return δ1², δ2², δ3² over scale², shape (3, 6, 5), and the joints, shape (6, 2).

    The polynomials of index j on the middle axis have joint j as their variable, by way of an
    unknown of moderate size; the last axis holds ascending coefficients. Joint j over scale, or its
    square for a length, is offset + slope × unknown, row j of the joints. The algebra is that of
    `solve_rows`.
    """
    values, squares = np.zeros((6, 6, 3)), np.zeros((6, 6, 3))
    values[:, :, 0], squares[:, :, 0] = joints[:, None], joints[:, None] ** 2
    a3x, a3y, b1x, b1y, b2, b3 = (v / scale for v in design.variables)
    one, unknown = np.eye(3)[:2]

    # |d1 - d3| and |d2 - d4| do not exceed |b3 - b2|, so these unknowns are moderate.
    span = b3 - b2
    values[1, 1] = values[3, 1] - span * unknown
    values[3, 3] = values[1, 3] + span * unknown
    squares[2, 2] = squares[4, 2] + span * unknown
    squares[4, 4] = squares[2, 4] + span * unknown
    d1, d3 = values[1], values[3]
    l1_2, d2_2, d4_2, l4_2 = squares[0], squares[2], squares[4], squares[5]
    c = (d3 - d1) / span
    px = d1 - b2 * c
    s2 = one - _product(c, c)[:, :3]
    t = -b2 / span
    r2 = (1.0 - t) * d2_2 + t * d4_2 - t * (1.0 - t) * span * span * s2
    w = (d4_2 - d2_2 - (b3 + b2) * span * s2) / (2.0 * span)
    from_a3 = px - a3x * one
    l4_2_at_0 = _product(from_a3, from_a3)[:, :3] + r2 + a3y * a3y * one
    py = (l4_2_at_0 - l4_2) / (2.0 * a3y)
    py[5] = unknown
    p2 = _product(px, px)[:, :3] + r2
    along = _product(c, px)[:, :3] + w
    l1_2_at_0 = p2 + (b1x * b1x + b1y * b1y) * one + 2.0 * b1x * along
    across = (l1_2 - l1_2_at_0) / (2.0 * b1y)
    across[0] = unknown
    joint_of = np.stack(
        [
            l1_2_at_0[0] + 2.0 * b1y * unknown,
            d1[1],
            d2_2[2],
            d3[3],
            d4_2[4],
            l4_2_at_0[5] - 2.0 * a3y * unknown,
        ]
    )
    to_degree_four = ((0, 0), (0, 2))
    polynomials = np.stack(
        [
            np.pad(p2, to_degree_four) - _product(along, along) - _product(across, across),
            _product(s2, r2) - _product(w, w),
            np.pad(r2, to_degree_four) - _product(py, py),
        ]
    )
    return polynomials, joint_of[:, :2]


def _product(a: FloatArray, b: FloatArray) -> FloatArray:
    """Return the products of quadratics, shape (n, 5), from coefficients (n, 3)."""
    out = np.zeros((len(a), 5))
    for power in range(3):
        out[:, power : power + 3] += a[:, power, None] * b
    return out


def _real_roots(polynomials: FloatArray) -> list[list[float]]:
    """Return the real roots of polynomials (3, 6, 5) for each of the six joints."""
    roots_of_joint: list[list[float]] = [[] for _ in JOINTS]
    rows = polynomials.reshape(-1, 5)
    # Coefficients that are rounding noise beside the largest do not count for the degree.
    significant = np.abs(rows) > 1e-14 * np.abs(rows).max(axis=1, keepdims=True)
    degrees = np.where(significant, np.arange(5), 0).max(axis=1)
    for degree in range(1, 5):
        (chosen,) = np.nonzero(degrees == degree)
        if not len(chosen):
            continue
        companion = np.zeros((len(chosen), degree, degree))
        companion[:, range(1, degree), range(degree - 1)] = 1.0
        companion[:, :, -1] = -rows[chosen, :degree] / rows[chosen, degree, None]
        values = np.linalg.eigvals(companion)
        # A double root may be computed as a close complex pair; a needless break is harmless.
        real = np.abs(values.imag) <= 1e-6 * (1.0 + np.abs(values))
        for row, roots, keep in zip(chosen.tolist(), values.real, real, strict=True):
            roots_of_joint[row % len(JOINTS)].extend(roots[keep].tolist())
    return roots_of_joint


def _breaks(roots: FloatArray, scale: float, is_length: bool) -> list[float]:
    """Return the ascending values of one joint at which the joints may cease to close.

    No joints close beyond the outer ones, since |d1 - d3| is bounded, and with it every length. A
    value above `LARGEST_JOINT` belongs to a vanishing term.
    """
    values = np.sort(roots)
    if is_length:
        values = np.sqrt(np.append(0.0, values[values > 0.0]))
    values = values * scale
    return values[np.abs(values) <= LARGEST_JOINT].tolist()


def _closing_intervals(
    design: Design, joints: FloatArray, breaks: list[list[float]]
) -> tuple[tuple[Interval, ...], ...]:
    """Return, for each joint, the intervals between breaks in whose middle the joints close.

    The forward kinematics decides, so that both agree where a discriminant is zero but for
    rounding, as in every singular pose.
    """
    gaps = [
        (joint, low, high)
        for joint, values in enumerate(breaks)
        for low, high in itertools.pairwise(values)
        if low < high
    ]
    trials = np.repeat(joints[None, :], len(gaps), axis=0)
    for trial, (joint, low, high) in zip(trials, gaps, strict=True):
        trial[joint] = 0.5 * (low + high)
    intervals: list[list[Interval]] = [[] for _ in JOINTS]
    closes = forward(design, trials).feasible.tolist()
    for joint, low, high in itertools.compress(gaps, closes):
        adjoins = intervals[joint] and intervals[joint][-1][1] == low
        intervals[joint].append((intervals[joint].pop()[0] if adjoins else low, high))
    return tuple(map(tuple, intervals))


class PossibleRanges(NamedTuple):
    """Outer bounds (low, high) of the joints, as in `JOINTS`, and of x, y and z of b4 in the base.

    They are in design units; low exceeds high where limits contradict.
    """

    joints: tuple[Pair, Pair, Pair, Pair, Pair, Pair]
    position: tuple[Pair, Pair, Pair]


@functools.lru_cache(64)
def possible_ranges(design: Design) -> PossibleRanges:
    """Return outer bounds of what the limits of a design allow, in any orientation."""
    limits = design.limits
    (l1, d2, d4, l4) = (design.length_range(name) for name in ("l1", "d2", "d4", "l4"))
    b1, b2, b3 = math.hypot(*design.b1), abs(design.b2), abs(design.b3)
    (a3x, a3y), box = design.a3, limits.box or ((-math.inf,) * 3, (math.inf,) * 3)
    # |p + R b1| is at most the longest l1, and |p - a3| the longest l4.
    about_a1 = l1[1] + b1
    from_guide = min(d2[1] + b2, d4[1] + b3)
    guide = limits.guide or (-math.inf, math.inf)
    x = _within(
        (-about_a1, about_a1),
        (a3x - l4[1], a3x + l4[1]),
        (guide[0] - b2, guide[1] + b2),
        (guide[0] - b3, guide[1] + b3),
        (box[0][0], box[1][0]),
    )
    across = min(about_a1, from_guide)
    y = _within((-across, across), (a3y - l4[1], a3y + l4[1]), (box[0][1], box[1][1]))
    height = min(across, l4[1])
    z = _within((-height, height), _side(design), (box[0][2], box[1][2]))
    farthest = (_farthest(x), _farthest(y), _farthest(z))
    from_a1 = min(math.hypot(*farthest), about_a1)
    from_axis = math.hypot(*farthest[1:])
    carriages = [
        _within(
            (x[0] - abs(b), x[1] + abs(b)),
            # The point of the platform is as far from b1, which leg 1 holds, at every pose.
            (-l1[1] - apart, l1[1] + apart),
            guide,
        )
        for b in (design.b2, design.b3)
        for apart in (math.dist(design.b1, (b, 0.0)),)
    ]
    from_a3 = math.hypot(_farthest(x, a3x), _farthest(y, a3y), farthest[2])
    joints = (
        (l1[0], min(l1[1], from_a1 + b1)),
        carriages[0],
        (d2[0], min(d2[1], from_axis + b2)),
        carriages[1],
        (d4[0], min(d4[1], from_axis + b3)),
        (l4[0], min(l4[1], from_a3)),
    )
    return PossibleRanges(joints, (x, y, z))


def _farthest(ends: Pair, point: float = 0.0) -> float:
    return max(abs(end - point) for end in ends)


def _within(*ranges: Pair) -> Pair:
    return max(low for low, _ in ranges), min(high for _, high in ranges)


def _side(design: Design) -> Pair:
    """Return the range of z that the smallest margin leaves; δ3 is z."""
    margin = design.limits.margin
    if margin is None:
        return -math.inf, math.inf
    return (margin, math.inf) if design.home_pose.position[2] > 0.0 else (-math.inf, -margin)
