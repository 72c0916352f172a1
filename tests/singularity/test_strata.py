"""The 24 strata of two flags, their closure order and their words, by independent definitions."""

from __future__ import annotations

import itertools
import math

import numpy as np
import pytest
from differences import moved
from hypothesis import assume, given
from incidence import (
    REPRESENTATIVES,
    is_below as is_below_by_tableaux,
    is_clear_cut,
    permutation_of_flags,
    special_poses,
)
from scipy.spatial.transform import Rotation
from strategies import QUARTER_TURNS, Case, ordinary_cases, ordinary_designs, singular_cases

from explorer import margins, stratum
from explorer.numerics.arrays import FloatArray
from explorer.singularity.strata import (
    COVERED,
    GENERIC,
    STRATA,
    WORDS,
    Stratum,
    conditions,
    describe_stratum,
    incidences,
    inversions,
    is_below,
)


def seen(position: FloatArray, rotation: FloatArray) -> tuple[int, ...]:
    return tuple(stratum(position, rotation).tolist())


def test_strata_are_24_in_order_of_dimension() -> None:
    assert sorted(STRATA) == sorted(itertools.permutations((1, 2, 3, 4)))
    dimensions = [inversions(w) for w in STRATA]
    assert dimensions == sorted(dimensions)
    # Inversions are the swaps of neighbours that sort.
    for w in STRATA:
        swaps = [(*w[:i], w[i + 1], w[i], *w[i + 2 :]) for i in range(3) if w[i] > w[i + 1]]
        assert all(inversions(w) == inversions(v) + 1 for v in swaps)
        assert bool(swaps) == (inversions(w) > 0)
    # The dimensions of the cells of the flag manifold of projective space.
    assert [dimensions.count(d) for d in range(7)] == [1, 3, 5, 6, 5, 3, 1]


def test_stratum_of_special_poses_is_that_of_their_ranks() -> None:
    assert sorted(REPRESENTATIVES) == sorted(STRATA)
    positions, rotations = (np.array(part) for part in zip(*special_poses(), strict=True))
    for pose, w in zip(special_poses(), stratum(positions, rotations).tolist(), strict=True):
        assert tuple(w) == permutation_of_flags(*pose)


def test_stratum_of_quarter_turns_is_that_of_their_ranks() -> None:
    for rotation in QUARTER_TURNS:
        for place in itertools.product((0.0, 1.0), repeat=3):
            assert seen(np.array(place), rotation) == permutation_of_flags(
                np.array(place), rotation
            )


@given(ordinary_cases() | singular_cases(among=ordinary_designs()))
def test_stratum_of_clear_cut_poses_is_that_of_their_ranks(
    case: Case,
) -> None:
    assume(is_clear_cut(case))
    margin = np.abs(case.margins)
    found = seen(case.position, case.rotation)
    distance = math.hypot(*case.position) or 1.0
    assert found == permutation_of_flags(case.position / distance, case.rotation, 1e-9)
    assert (found == GENERIC) == bool(margin.min() > 1e-6 * distance)


@given(singular_cases(among=ordinary_designs()))
def test_margin_vanishes_exactly_in_the_closure_of_its_stratum(case: Case) -> None:
    assume(is_clear_cut(case))
    found, margin = seen(case.position, case.rotation), np.abs(case.margins) / case.size
    for closure, value in zip(((3, 4, 2, 1), (4, 2, 3, 1), (4, 3, 1, 2)), margin, strict=True):
        if value < 1e-13:
            assert is_below(found, closure)
        elif value > 1e-6:
            assert not is_below(found, closure)
        if value < 1e-13 and np.sort(margin)[1] > 1e-6:
            assert found == closure


@pytest.mark.parametrize("w", STRATA)
def test_small_move_leads_only_to_strata_whose_closure_contains_the_first(
    w: tuple[int, ...],
) -> None:
    position, rotation = REPRESENTATIVES[w]
    rng = np.random.default_rng(sum(v * 5**i for i, v in enumerate(w)))
    # Of each twist only some components, so that some moves stay in the stratum; of the last all.
    twists = rng.uniform(-1e-4, 1e-4, (20, 6)) * rng.integers(0, 2, (20, 6))
    twists[-1] = np.array([3.1, -2.3, 4.7, 2.9, 3.7, -5.3]) * 1e-4
    for twist in twists:
        after = seen(*moved(position, rotation, twist))
        assert is_below(w, after)
        assert inversions(after) > inversions(w) or after == w
    assert seen(*moved(position, rotation, twists[-1])) == GENERIC


@pytest.mark.parametrize("w", STRATA)
def test_stratum_in_another_unit_is_the_same_and_of_exchanged_flags_the_inverse(
    w: tuple[int, ...],
) -> None:
    position, rotation = REPRESENTATIVES[w]
    for scale in (1e-6, 1e6):
        assert seen(scale * position, rotation) == w
    inverse = tuple(w.index(value) + 1 for value in (1, 2, 3, 4))
    assert seen(-rotation.T @ position, rotation.T) == inverse


def test_tolerance_of_incidences_is_a_billionth_of_the_length() -> None:
    rotation = Rotation.from_euler("ZYX", [0.7, 0.5, -0.6]).as_matrix()
    near = np.array([1.0, 2.0, 3.0]) * 1e-11
    assert seen(near, rotation) == GENERIC
    assert stratum(near, rotation, 1.0)[0] == 1
    assert tuple(stratum(near * 1e4, rotation, 1.0).tolist()) == GENERIC


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
