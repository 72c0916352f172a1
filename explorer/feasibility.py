"""For which values of each joint, the others held, the lengths can close: exact intervals.

Each of the three discriminants of `explorer.trilateration` is a polynomial of degree at
most four in a carriage position or in the square of a length. Their real roots bound the
intervals, so nothing is sampled.
"""

from __future__ import annotations

import math
from collections.abc import Sequence

import numpy as np

from explorer.arrays import FloatArray
from explorer.design import JOINTS, LENGTHS, Design
from explorer.kinematics import checked_joints, forward

Interval = tuple[float, float]

_IS_LENGTH = tuple(name in LENGTHS for name in JOINTS)


def feasible_intervals(design: Design, joints: FloatArray) -> tuple[tuple[Interval, ...], ...]:
    """Return, per joint, the disjoint ascending intervals in which the lengths close.

    Args:
        design: The manipulator.
        joints: (l1, d1, d2, d3, d4, l4), shape (6,); for each joint the other five count.
    """
    held = checked_joints(design, joints)
    # Dividing by the largest length keeps the roots near one, whatever the units.
    scale = max(map(abs, (*design.variables, *held.tolist())))
    polynomials = _discriminants(design, held / scale, scale)
    roots = _real_roots(polynomials)
    return tuple(
        tuple((_unscaled(j, low, scale), _unscaled(j, high, scale)) for low, high in found)
        for j in range(len(JOINTS))
        for found in [_where_positive(polynomials[:, j], roots[j], _IS_LENGTH[j])]
    )


def nearest_feasible(
    design: Design, joints: FloatArray, joint: int, intervals: Sequence[Interval]
) -> float | None:
    """Return the value of one joint nearest to the present one that closes; None if none.

    Args:
        design: The manipulator.
        joints: Shape (6,).
        joint: Its index in `JOINTS`.
        intervals: What `feasible_intervals` gives for it.
    """
    value = float(joints[joint])
    ends = [(min(max(value, low), high), low, high) for low, high in intervals]
    if not ends:
        return None
    nearest, low, high = min(ends, key=lambda end: abs(end[0] - value))
    # The last bits of a root may lie outside: step inwards until the lengths do close.
    towards = 0.5 * (low + high)
    for share in (0.0, *(10.0**-k for k in range(15, 2, -1))):
        candidate = nearest + share * (towards - nearest)
        trial = joints.copy()
        trial[joint] = candidate
        if forward(design, trial).feasible:
            return candidate
    return None


def _unscaled(joint: int, unknown: float, scale: float) -> float:
    return (math.sqrt(unknown) if _IS_LENGTH[joint] else unknown) * scale


def _discriminants(design: Design, joints: FloatArray, scale: float) -> FloatArray:
    """Return κ1², κ2², κ3² and 1 - c² over scale², shape (4, 6, 5).

    Row j of the middle axis has the joint j (or its square) left as the unknown; the last
    axis holds ascending coefficients. The algebra is that of `trilateration.solve_rows`.
    The fourth is there because two negative factors of κ2² would pass for closing.
    """
    values, squares = np.zeros((6, 6, 3)), np.zeros((6, 6, 3))
    values[:, :, 0], squares[:, :, 0] = joints[:, None], joints[:, None] ** 2
    for joint, is_length in enumerate(_IS_LENGTH):
        unknown = (squares if is_length else values)[joint, joint]
        unknown[:] = (0.0, 1.0, 0.0)
    d1, d3 = values[1], values[3]
    l1_2, d2_2, d4_2, l4_2 = squares[0], squares[2], squares[4], squares[5]
    a3x, a3y, b1x, b1y, b2, b3 = (v / scale for v in design.variables)
    one = np.array([1.0, 0.0, 0.0])

    span = b3 - b2
    c = (d3 - d1) / span
    px = d1 - b2 * c
    s2 = one - _product(c, c)[:, :3]
    t = -b2 / span
    r2 = (1.0 - t) * d2_2 + t * d4_2 - t * (1.0 - t) * span * span * s2
    w = (d4_2 - d2_2 - (b3 + b2) * span * s2) / (2.0 * span)
    from_a3 = px - a3x * one
    py = (_product(from_a3, from_a3)[:, :3] + r2 + a3y * a3y * one - l4_2) / (2.0 * a3y)
    p2 = _product(px, px)[:, :3] + r2
    along = _product(c, px)[:, :3] + w
    across = (l1_2 - p2 - (b1x * b1x + b1y * b1y) * one - 2.0 * b1x * along) / (2.0 * b1y)
    room = ((0, 0), (0, 2))
    return np.stack(
        [
            np.pad(p2, room) - _product(along, along) - _product(across, across),
            _product(s2, r2) - _product(w, w),
            np.pad(r2, room) - _product(py, py),
            np.pad(s2, room),
        ]
    )


def _product(a: FloatArray, b: FloatArray) -> FloatArray:
    """Return the products of quadratics (n, 3), shape (n, 5)."""
    out = np.zeros((len(a), 5))
    for power in range(3):
        out[:, power : power + 3] += a[:, power, None] * b
    return out


def _real_roots(polynomials: FloatArray) -> list[list[float]]:
    """Return the real roots of the polynomials (4, 6, 5), sorted, for each of the six."""
    found: list[list[float]] = [[] for _ in JOINTS]
    rows = polynomials.reshape(-1, 5)
    # Coefficients that are rounding noise beside the largest have no say in the degree.
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
        # A double root comes back as a close complex pair; a needless break does no harm.
        real = np.abs(values.imag) <= 1e-6 * (1.0 + np.abs(values))
        for row, roots, keep in zip(chosen.tolist(), values.real, real, strict=True):
            found[row % len(JOINTS)].extend(roots[keep].tolist())
    return [sorted(roots) for roots in found]


def _where_positive(polynomials: FloatArray, roots: list[float], is_length: bool) -> list[Interval]:
    """Return the intervals between roots in which all polynomials (4, 5) are positive.

    |d1 - d3| and with it every length is bounded, so none reaches beyond the roots.
    """
    breaks = [0.0, *(root for root in roots if root > 0.0)] if is_length else roots
    if len(breaks) < 2:
        return []
    ends = np.array(breaks)
    middles = 0.5 * (ends[:-1] + ends[1:])
    powers = middles[:, None] ** np.arange(5)
    positive = (powers @ polynomials.T >= 0.0).all(axis=1) & (ends[1:] > ends[:-1])
    found: list[Interval] = []
    for low, high, inside in zip(breaks[:-1], breaks[1:], positive.tolist(), strict=True):
        if not inside:
            continue
        if found and found[-1][1] == low:
            found[-1] = (found[-1][0], high)
        else:
            found.append((low, high))
    return found
