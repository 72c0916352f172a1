"""The order of the 24 strata: which one borders on which, and what each is in words.

One stratum lies in the closure of another where each of its intersections r_ij is at least
as large (the Bruhat order of permutations). Of the conditions r_ij that cut a closure out,
those that follow from a neighbouring one are left out (Fulton's essential set); what is left
is what the stratum is in words.
"""

from __future__ import annotations

from collections.abc import Mapping
from functools import cache
from types import MappingProxyType
from typing import TypeAlias

from explorer.numerics.arrays import IntArray
from explorer.singularity.strata import GENERIC, STRATA, inversions, ranks

Stratum: TypeAlias = tuple[int, ...]
Condition: TypeAlias = tuple[int, int, int]

OF_INCIDENCES: tuple[Stratum, ...] = ((3, 4, 2, 1), (4, 2, 3, 1), (4, 3, 1, 2))
"""The strata in which κ1, κ2 or κ3 alone vanishes: those of codimension one."""

WORDS: Mapping[Condition, str] = MappingProxyType(
    {
        (1, 3, 1): "a1 on the platform plane",
        (2, 2, 1): "lines a1a2 and b2b3 meeting",
        (3, 1, 1): "b4 on the base plane",
        (1, 2, 1): "a1 on the line b2b3",
        (2, 1, 1): "b4 on the guide",
        (2, 3, 2): "the guide on the platform plane",
        (3, 2, 2): "the line b2b3 on the base plane",
        (1, 1, 1): "a1 and b4 coinciding",
        (2, 2, 2): "the lines coinciding",
        (3, 3, 3): "the planes coinciding",
    }
)
"""What r_ij being at least r means, by (i, j, r); the first three are κ1, κ2 and κ3 = 0."""


def codimension(stratum: Stratum) -> int:
    """Return by how much a stratum's dimension falls short of the generic one's."""
    return inversions(GENERIC) - inversions(stratum)


def is_below(lower: Stratum, upper: Stratum) -> bool:
    """Return whether a stratum lies in the closure of another, or is the same."""
    return bool((ranks(lower) >= ranks(upper)).all())


def conditions(stratum: Stratum) -> tuple[Condition, ...]:
    """Return the essential conditions (i, j, r): r_ij is at least r; none if generic."""
    r = _all_ranks(stratum)

    def follows(i: int, j: int) -> bool:
        value = r[i][j]
        return (
            value == max(0, i + j - 4)
            or value in (r[i - 1][j], r[i][j - 1])
            or value + 1 in (r[i + 1][j], r[i][j + 1])
        )

    return tuple((i, j, r[i][j]) for i in (1, 2, 3) for j in (1, 2, 3) if not follows(i, j))


def words(stratum: Stratum) -> str:
    """Return what a stratum is, such as "a1 on the platform plane"; "generic" if nothing."""
    return ", ".join(WORDS[each] for each in conditions(stratum)) or "generic"


@cache
def incidences(stratum: Stratum) -> tuple[int, ...]:
    """Return which of κ1, κ2 and κ3 vanish in a stratum, as 1, 2 and 3."""
    return tuple(
        index for index, closure in enumerate(OF_INCIDENCES, 1) if is_below(stratum, closure)
    )


def _all_ranks(stratum: Stratum) -> list[list[int]]:
    """Return r_ij for i and j from 0 to 4."""
    inner: IntArray = ranks(stratum)
    return [
        [0, 0, 0, 0, 0],
        *([0, *inner[i - 1].tolist(), i] for i in (1, 2, 3)),
        [0, 1, 2, 3, 4],
    ]


def _covered() -> dict[Stratum, tuple[Stratum, ...]]:
    return {
        upper: tuple(
            lower
            for lower in STRATA
            if inversions(lower) == inversions(upper) - 1 and is_below(lower, upper)
        )
        for upper in STRATA
    }


COVERED: Mapping[Stratum, tuple[Stratum, ...]] = MappingProxyType(_covered())
"""By stratum, those of one dimension less in its closure: the edges of the diagram."""

COVERING: Mapping[Stratum, tuple[Stratum, ...]] = MappingProxyType(
    {lower: tuple(upper for upper in STRATA if lower in COVERED[upper]) for lower in STRATA}
)
"""By stratum, those of one dimension more whose closure it lies in."""
