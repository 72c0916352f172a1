"""The closure order of the 24 strata, and their description by incidences.

A stratum lies in the closure of another if each of its dimensions r_ij is at least as large (the
Bruhat order of permutations). A closure is defined by conditions on the r_ij; those that follow
from a neighbouring condition are redundant. The others, the essential set of W. Fulton (1992),
describe the stratum.
"""

from __future__ import annotations

from collections.abc import Mapping
from functools import cache
from types import MappingProxyType
from typing import TypeAlias

from explorer.mechanism.margins import INCIDENCES
from explorer.singularity.strata import GENERIC, STRATA, inversions, ranks

Stratum: TypeAlias = tuple[int, ...]
Condition: TypeAlias = tuple[int, int, int]

OF_INCIDENCES: tuple[Stratum, ...] = ((3, 4, 2, 1), (4, 2, 3, 1), (4, 3, 1, 2))
"""The strata of codimension one, in which δ1, δ2 or δ3 alone vanishes."""

WORDS: Mapping[Condition, str] = MappingProxyType(
    {
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
)
"""The incidence at which r_ij is at least r, by (i, j, r)."""


def codimension(stratum: Stratum) -> int:
    """Return the dimension of the generic stratum less that of a stratum."""
    return inversions(GENERIC) - inversions(stratum)


def is_below(lower: Stratum, upper: Stratum) -> bool:
    """Return whether a stratum lies in the closure of another, or is the same one."""
    return bool((ranks(lower) >= ranks(upper)).all())


def conditions(stratum: Stratum) -> tuple[Condition, ...]:
    """Return the essential conditions (i, j, r), r_ij ≥ r, of a stratum; none if it is generic."""
    r = _all_ranks(stratum)

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
    """Return the indices 1, 2 and 3 of those of δ1, δ2 and δ3 that vanish in a stratum."""
    return tuple(
        index for index, closure in enumerate(OF_INCIDENCES, 1) if is_below(stratum, closure)
    )


def _all_ranks(stratum: Stratum) -> list[list[int]]:
    """Return r_ij, shape (5, 5), for i and j from 0 to 4."""
    return [[sum(v <= j for v in stratum[:i]) for j in range(5)] for i in range(5)]


COVERED: Mapping[Stratum, tuple[Stratum, ...]] = MappingProxyType(
    {
        upper: tuple(
            lower
            for lower in STRATA
            if inversions(lower) == inversions(upper) - 1 and is_below(lower, upper)
        )
        for upper in STRATA
    }
)
"""The strata of one dimension less in the closure of each: the edges of the Hasse diagram."""
