"""The 24 strata of the relative position of two flags in projective space, and their closure order.

The base flag is the point a1, the line a1a2 and the base plane; the platform flag is the point
b4, the line b2b3 and the platform plane. Their relative position is a permutation w of
(1, 2, 3, 4), which is a Schubert cell; its number of inversions is the stratum's dimension. The
closure of a stratum is defined by lower bounds of r_ij, the dimension of the intersection of
the i-th subspace of one flag with the j-th of the other.

A stratum lies in the closure of another if each of its r_ij is at least as large (the Bruhat order
of permutations). Conditions that follow from a neighbouring one are redundant; the others, the
essential set of W. Fulton (1992), describe the stratum.
"""

from __future__ import annotations

import itertools
from collections.abc import Mapping
from functools import cache

import numpy as np
from numpy.typing import ArrayLike

from explorer.mechanism.configuration import Configuration
from explorer.mechanism.margins import INCIDENCES, INCIDENT
from explorer.mechanism.pose import rotation_array
from explorer.numerics.arrays import (
    FloatArray,
    IntArray,
    batch_shape,
    dot,
    lengths_of,
    position_array,
)

GENERIC = (4, 3, 2, 1)


def inversions(permutation: tuple[int, ...]) -> int:
    """Return the number of inversions of a permutation, the dimension of its stratum."""
    return sum(a > b for a, b in itertools.combinations(permutation, 2))


def ranks(permutation: tuple[int, ...]) -> IntArray:
    """Return r_ij, (5, 5), i and j from 0: how many of the first i entries are at most j."""
    return np.array([[sum(v <= j for v in permutation[:i]) for j in range(5)] for i in range(5)])


STRATA: tuple[tuple[int, ...], ...] = tuple(
    sorted(itertools.permutations((1, 2, 3, 4)), key=lambda w: (inversions(w), w))
)
"""The 24 permutations by dimension, from both flags coinciding to the generic one."""

_RANKS_OF_STRATA = np.stack([ranks(w)[1:4, 1:4].ravel() for w in STRATA])


def stratum(position: ArrayLike, rotation: ArrayLike, length: float | None = None) -> IntArray:
    """Return the stratum of a pose, shape (..., 4): a permutation of (1, 2, 3, 4).

    (4, 3, 2, 1) is generic; only δ1, δ2 or δ3 vanishes in (3, 4, 2, 1), (4, 2, 3, 1) or
    (4, 3, 1, 2). The result is the smallest stratum whose closure contains the pose to a
    relative tolerance of 1e-9.

    Args:
        position: b4 in the base frame, shape (..., 3).
        rotation: Platform to base, shape (..., 3, 3).
        length: Length to which the tolerance of distances is relative, in the unit of the
            position; None for |p|, so that a1 and b4 coincide only if p is exactly zero.

    Raises:
        InputError: The position is not finite, or the rotation is not one.
    """
    p = position_array("position", position)
    r = rotation_array(rotation)
    batch_shape((p, 1), (r, 2))
    ranks = np.stack(np.broadcast_arrays(*_ranks_of_pose(p, r, length)), axis=-1)
    holds = (ranks[..., None, :] >= _RANKS_OF_STRATA).all(axis=-1)
    return np.array(STRATA)[np.argmax(holds, axis=-1)]


def stratum_of(configuration: Configuration) -> Stratum:
    """Return the stratum of one pose, with a tolerance relative to the design's reach."""
    c = configuration
    return tuple(stratum(c.position, c.rotation, c.design.reach).tolist())


def _ranks_of_pose(p: FloatArray, r: FloatArray, length: float | None) -> list[IntArray]:
    """Return r_11, r_12, …, r_33 of poses, from distances and angles."""
    u, n = r[..., 0], r[..., 2]
    across = np.hypot(p[..., 1], p[..., 2])
    distance = np.hypot(p[..., 0], across)
    near = INCIDENT * (distance if length is None else length)

    point_on_point = distance <= near
    a1_on_line = lengths_of(np.cross(u, p)) <= near
    a1_on_plane = np.abs(dot(n, p)) <= near
    b4_on_line = across <= near
    b4_on_plane = np.abs(p[..., 2]) <= near
    lines_parallel = np.hypot(u[..., 1], u[..., 2]) <= INCIDENT
    lines_meet = np.abs(u[..., 1] * p[..., 2] - u[..., 2] * p[..., 1]) <= near
    base_line_along_plane = np.abs(n[..., 0]) <= INCIDENT
    line_along_base_plane = np.abs(u[..., 2]) <= INCIDENT
    planes_parallel = np.hypot(n[..., 0], n[..., 1]) <= INCIDENT

    def count(least: int, one_more: object) -> IntArray:
        return least + np.asarray(one_more, dtype=np.int64)

    return [
        count(0, point_on_point),
        count(0, a1_on_line),
        count(0, a1_on_plane),
        count(0, b4_on_line),
        count(0, lines_meet | lines_parallel) + (lines_parallel & b4_on_line),
        count(1, base_line_along_plane & a1_on_plane),
        count(0, b4_on_plane),
        count(1, line_along_base_plane & b4_on_plane),
        count(2, planes_parallel & b4_on_plane),
    ]


Stratum = tuple[int, ...]
Condition = tuple[int, int, int]

OF_INCIDENCES: tuple[Stratum, ...] = ((3, 4, 2, 1), (4, 2, 3, 1), (4, 3, 1, 2))
"""The strata of codimension one, in which δ1, δ2 or δ3 alone vanishes."""

WORDS: Mapping[Condition, str] = {
    (1, 3, 1): INCIDENCES[0],
    (2, 2, 1): INCIDENCES[1],
    (3, 1, 1): INCIDENCES[2],
    (1, 2, 1): "a1 on the line b2b3",
    (2, 1, 1): "b4 on the guide",
    (2, 3, 2): "the guide on the platform plane",
    (3, 2, 2): "the line b2b3 on the base plane",
    (1, 1, 1): "a1 and b4 coinciding",
    (2, 2, 2): "the lines coinciding",
    (3, 3, 3): "the planes coinciding",
}
"""The incidence at which r_ij is at least r, by (i, j, r)."""


def codimension(stratum: Stratum) -> int:
    """Return the dimension of the generic stratum less that of a stratum."""
    return inversions(GENERIC) - inversions(stratum)


def is_below(lower: Stratum, upper: Stratum) -> bool:
    """Return whether a stratum lies in the closure of another, or is the same one."""
    return bool((ranks(lower) >= ranks(upper)).all())


def conditions(stratum: Stratum) -> tuple[Condition, ...]:
    """Return the essential conditions (i, j, r), r_ij ≥ r, of a stratum; none if it is generic."""
    r: list[list[int]] = ranks(stratum).tolist()

    def is_redundant(i: int, j: int) -> bool:
        value = r[i][j]
        return (
            value == max(0, i + j - 4)
            or value in (r[i - 1][j], r[i][j - 1])
            or value + 1 in (r[i + 1][j], r[i][j + 1])
        )

    return tuple((i, j, r[i][j]) for i in (1, 2, 3) for j in (1, 2, 3) if not is_redundant(i, j))


def describe_stratum(stratum: Stratum) -> str:
    """Return a stratum's incidences, such as "a1 on the platform plane", or "generic"."""
    return ", ".join(WORDS[condition] for condition in conditions(stratum)) or "generic"


@cache
def incidences(stratum: Stratum) -> tuple[int, ...]:
    """Return the numbers 1, 2 and 3 of those of δ1, δ2 and δ3 that vanish in a stratum."""
    return tuple(
        index for index, closure in enumerate(OF_INCIDENCES, 1) if is_below(stratum, closure)
    )


COVERED: Mapping[Stratum, tuple[Stratum, ...]] = {
    upper: tuple(
        lower
        for lower in STRATA
        if inversions(lower) == inversions(upper) - 1 and is_below(lower, upper)
    )
    for upper in STRATA
}
"""The strata of one dimension less in the closure of each: the edges of the Hasse diagram."""
