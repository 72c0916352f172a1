"""Division of triangles along the line where a function of position equals a level.

Triangles share their vertices before and after: each edge that the line crosses gets one vertex.
"""

from __future__ import annotations

from collections.abc import Callable
from typing import NamedTuple

import numpy as np

from explorer.numerics.arrays import BoolArray, FloatArray, IntArray

# Most steps of the search for a root on an edge.
STEPS = 12


class Division(NamedTuple):
    """Triangles divided along a line.

    Attributes:
        ends: Ends of the edges that the line crosses, the one below the level first, shape (k, 2).
            The i-th of them gets the vertex n + i, where n is the number of vertices so far.
        faces: Faces after the division, shape (m, 3).
        is_high: Whether each of these faces is above the level, shape (m,).
        origin: Face that each of them is a part of, shape (m,).
    """

    ends: IntArray
    faces: IntArray
    is_high: BoolArray
    origin: IntArray


def divide(faces: IntArray, high: BoolArray) -> Division:
    """Divide the faces (m, 3) with vertices on either side of a level, high for n vertices."""
    count = len(high)
    sides = high[faces]
    number = sides[:, 0].astype(np.int64) + sides[:, 1] + sides[:, 2]
    mixed = np.flatnonzero((number == 1) | (number == 2))
    whole = np.flatnonzero((number == 0) | (number == 3))
    if not len(mixed):
        return Division(np.zeros((0, 2), dtype=np.int64), faces, number == 3, np.arange(len(faces)))
    # The corner that is alone on its side comes first.
    lone_is_high = number[mixed] == 1
    lone = np.argmax(sides[mixed] == lone_is_high[:, None], axis=1)
    corners = np.take_along_axis(faces[mixed], (lone[:, None] + np.arange(3)) % 3, axis=1)
    a, b, c = corners.T
    crossed = np.concatenate([np.stack([a, b], axis=1), np.stack([a, c], axis=1)])
    flip = np.concatenate([lone_is_high, lone_is_high])
    crossed[flip] = crossed[flip][:, ::-1]
    keys, inverse = np.unique(crossed[:, 0] * count + crossed[:, 1], return_inverse=True)
    ends = np.stack([keys // count, keys % count], axis=1)
    on_ab, on_ac = count + inverse[: len(mixed)], count + inverse[len(mixed) :]
    divided = [faces[whole]] + [
        np.stack(triple, axis=1) for triple in ((a, on_ab, on_ac), (on_ab, b, c), (on_ab, c, on_ac))
    ]
    return Division(
        ends,
        np.concatenate(divided),
        np.concatenate([number[whole] == 3, lone_is_high, ~lone_is_high, ~lone_is_high]),
        np.concatenate([whole, mixed, mixed, mixed]),
    )


def find_roots(
    value: Callable[[FloatArray], FloatArray], low: FloatArray, high: FloatArray, tolerance: float
) -> FloatArray:
    """Return where n functions of a parameter from 0 to 1 are zero, shape (n,).

    They are negative at 0 and not negative at 1. Their roots are found to a tolerance of their
    values by the method of false position in the Illinois variant, which keeps the root between two
    ends.
    """
    start, end = np.zeros(len(low)), np.ones(len(low))
    at = -low / (high - low)
    if not len(low):
        return at
    last = np.zeros(len(low), dtype=np.int64)
    for _ in range(STEPS):
        here = value(at)
        if float(np.abs(here).max()) <= tolerance:
            break
        below = here < 0.0
        side = np.where(below, -1, 1)
        # An end that stays for the second time counts half.
        again = side == last
        low = np.where(below, here, np.where(again, 0.5 * low, low))
        high = np.where(below, np.where(again, 0.5 * high, high), here)
        start, end = np.where(below, at, start), np.where(below, end, at)
        last = side
        at = start + (end - start) * (-low / (high - low))
    return at
