"""The closure order of the strata against other definitions, and their descriptions."""

from __future__ import annotations

import itertools

import numpy as np
import pytest
from incidence import REPRESENTATIVES, is_below as is_below_by_tableaux

from explorer import margins
from explorer.singularity.bruhat import (
    COVERED,
    OF_INCIDENCES,
    WORDS,
    Stratum,
    codimension,
    conditions,
    describe_stratum,
    incidences,
    is_below,
)
from explorer.singularity.strata import GENERIC, STRATA, inversions


def swaps(w: Stratum) -> set[Stratum]:
    """Return the permutations with one inversion less that a swap of two entries makes."""
    swapped = [tuple({a: b, b: a}.get(v, v) for v in w) for a, b in itertools.combinations(w, 2)]
    return {v for v in swapped if inversions(v) == inversions(w) - 1}


def test_order_is_that_of_tableaux_and_the_transitive_closure_of_its_edges() -> None:
    for lower, upper in itertools.product(STRATA, STRATA):
        assert is_below(lower, upper) == is_below_by_tableaux(lower, upper)
    assert {w: set(COVERED[w]) for w in STRATA} == {w: swaps(w) for w in STRATA}
    assert sum(map(len, COVERED.values())) == 58
    closures: dict[Stratum, set[Stratum]] = {}
    for w in sorted(STRATA, key=inversions):
        closures[w] = {w}.union(*(closures[each] for each in COVERED[w]))
        assert closures[w] == {lower for lower in STRATA if is_below(lower, w)}


def test_codimensions_count_from_the_generic_stratum() -> None:
    assert codimension(GENERIC) == 0
    assert COVERED[GENERIC] == tuple(sorted(OF_INCIDENCES))
    assert max(map(codimension, STRATA)) == codimension((1, 2, 3, 4)) == 6


@pytest.mark.parametrize("w", STRATA)
def test_essential_conditions_hold_in_the_closure_and_nowhere_else(w: Stratum) -> None:
    def holds(stratum: Stratum) -> bool:
        ranks = [[sum(v <= j for v in stratum[:i]) for j in range(5)] for i in range(5)]
        return all(ranks[i][j] >= least for i, j, least in conditions(w))

    assert {v for v in STRATA if holds(v)} == {v for v in STRATA if is_below(v, w)}
    assert all(each in WORDS for each in conditions(w))
    # The incidences are the margins that vanish.
    position, rotation = REPRESENTATIVES[w]
    zero = np.flatnonzero(np.abs(margins(position, rotation)) < 1e-12) + 1
    assert incidences(w) == tuple(zero.tolist())


def test_description_of_every_stratum_is_distinct() -> None:
    assert describe_stratum(GENERIC) == "generic"
    assert len({describe_stratum(w) for w in STRATA}) == 24
    assert describe_stratum((3, 4, 1, 2)) == "a1 on the platform plane, b4 on the base plane"
