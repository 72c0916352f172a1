"""The 24 strata of two flags against the ranks of homogeneous coordinates."""

from __future__ import annotations

import itertools
import math

import numpy as np
import pytest
from differences import moved
from hypothesis import assume, example, given, strategies as st
from incidence import (
    REPRESENTATIVES,
    is_below,
    is_clear_cut,
    permutation_of_flags,
    special_poses,
)
from scipy.spatial.transform import Rotation
from strategies import QUARTER_TURNS, WAYS, Case, ordinary_cases, ordinary_designs, singular_cases

from explorer import PRESETS, rotation_from_quaternion, stratum
from explorer.numerics.arrays import FloatArray
from explorer.singularity.strata import GENERIC, STRATA, inversions


def seen(position: FloatArray, rotation: FloatArray) -> tuple[int, ...]:
    return tuple(stratum(position, rotation).tolist())


def test_strata_are_24_in_order_of_dimension() -> None:
    assert sorted(STRATA) == sorted(itertools.permutations((1, 2, 3, 4)))
    dimensions = [inversions(w) for w in STRATA]
    assert dimensions == sorted(dimensions)
    # The dimensions of the cells of the flag manifold of projective space.
    assert [dimensions.count(d) for d in range(7)] == [1, 3, 5, 6, 5, 3, 1]


@pytest.mark.parametrize("w", STRATA)
def test_inversions_are_the_swaps_of_neighbours_that_sort(w: tuple[int, ...]) -> None:
    entries, swaps = list(w), 0
    while entries != sorted(entries):
        i = next(i for i in range(3) if entries[i] > entries[i + 1])
        entries[i], entries[i + 1] = entries[i + 1], entries[i]
        swaps += 1
    assert inversions(w) == swaps


def test_stratum_of_special_poses_is_that_of_their_ranks() -> None:
    assert sorted(REPRESENTATIVES) == sorted(STRATA)
    positions, rotations = (np.array(part) for part in zip(*special_poses(), strict=True))
    for pose, w in zip(special_poses(), stratum(positions, rotations).tolist(), strict=True):
        assert tuple(w) == permutation_of_flags(*pose)


@given(
    st.tuples(*[st.integers(-2, 2)] * 3),
    st.tuples(*[st.integers(-1, 1)] * 4).filter(any),
)
def test_stratum_of_integer_poses_is_that_of_their_ranks(
    place: tuple[int, ...], quaternion: tuple[int, ...]
) -> None:
    position = np.array(place, dtype=np.float64)
    rotation = rotation_from_quaternion(quaternion)
    assert seen(position, rotation) == permutation_of_flags(position, rotation)


def test_stratum_of_quarter_turns_is_that_of_their_ranks() -> None:
    found: set[tuple[int, ...]] = set()
    for rotation in QUARTER_TURNS:
        for place in itertools.product((0.0, 1.0), repeat=3):
            position = np.array(place)
            w = permutation_of_flags(position, rotation)
            assert seen(position, rotation) == w
            found.add(w)
    assert len(found) >= 12


@given(ordinary_cases() | singular_cases(among=ordinary_designs()))
@example(Case(PRESETS["paper-optimal"], np.array([0.0, 0.0, 9.8e-202]), np.eye(3)))
@example(Case(PRESETS["paper-optimal"], np.array([9.8e-202, 0.0, 0.0]), np.eye(3)))
def test_stratum_of_clear_cut_poses_is_that_of_their_ranks(
    case: Case,
) -> None:
    assume(is_clear_cut(case))
    margin = np.abs(case.margins)
    found = seen(case.position, case.rotation)
    distance = math.hypot(*case.position) or 1.0
    assert found == permutation_of_flags(case.position / distance, case.rotation, 1e-9)
    assert (found == GENERIC) == bool(margin.min() > 1e-6 * distance)


@pytest.mark.parametrize("way", WAYS)
def test_margin_vanishes_exactly_in_the_closure_of_its_stratum(way: tuple[int, ...]) -> None:
    closures = ((3, 4, 2, 1), (4, 2, 3, 1), (4, 3, 1, 2))

    @given(singular_cases(way, ordinary_designs()))
    def law(case: Case) -> None:
        assume(is_clear_cut(case))
        found = seen(case.position, case.rotation)
        margin = np.abs(case.margins) / case.size
        for index, closure in enumerate(closures):
            if margin[index] < 1e-13:
                assert is_below(found, closure)
            elif margin[index] > 1e-6:
                assert not is_below(found, closure)
        if len(way) == 1 and np.sort(margin)[1] > 1e-6:
            assert found == closures[way[0] - 1]

    law()


def test_stratum_of_coinciding_flags_is_the_identity() -> None:
    assert seen(np.zeros(3), np.eye(3)) == (1, 2, 3, 4)
    assert seen(np.zeros(3), np.diag([1.0, -1.0, -1.0])) == (1, 2, 3, 4)
    assert seen(np.zeros(3), np.diag([-1.0, 1.0, -1.0])) == (1, 2, 3, 4)
    assert seen(np.array([1.0, 0.0, 0.0]), np.eye(3)) != (1, 2, 3, 4)


@pytest.mark.parametrize("w", STRATA)
def test_small_move_leads_only_to_strata_whose_closure_contains_the_first(
    w: tuple[int, ...],
) -> None:
    position, rotation = REPRESENTATIVES[w]
    rng = np.random.default_rng(sum(v * 5**i for i, v in enumerate(w)))
    left = 0
    for _ in range(50):
        # Of each twist only some components, so that some moves stay in the stratum.
        twist = rng.uniform(-1e-4, 1e-4, 6) * rng.integers(0, 2, 6)
        after = seen(*moved(position, rotation, twist))
        assert is_below(w, after)
        assert inversions(after) > inversions(w) or after == w
        left += after != w
    assert (left > 0) == (w != GENERIC)


@pytest.mark.parametrize("w", STRATA)
def test_random_small_move_leads_to_the_generic_stratum(w: tuple[int, ...]) -> None:
    position, rotation = REPRESENTATIVES[w]
    twist = np.array([3.1, -2.3, 4.7, 2.9, 3.7, -5.3]) * 1e-4
    assert seen(*moved(position, rotation, twist)) == GENERIC


@pytest.mark.parametrize("w", STRATA)
@pytest.mark.parametrize("scale", [1e-200, 1e-20, 1e-6, 1e6, 1e20, 1e200])
def test_stratum_in_another_unit_is_the_same(w: tuple[int, ...], scale: float) -> None:
    position, rotation = REPRESENTATIVES[w]
    assert seen(scale * position, rotation) == w


@pytest.mark.parametrize("w", STRATA)
def test_stratum_of_exchanged_flags_is_the_inverse_permutation(w: tuple[int, ...]) -> None:
    position, rotation = REPRESENTATIVES[w]
    inverse = tuple(w.index(value) + 1 for value in (1, 2, 3, 4))
    assert seen(-rotation.T @ position, rotation.T) == inverse


def test_tolerance_of_incidences_is_a_billionth_of_the_length() -> None:
    rotation = Rotation.from_euler("ZYX", [0.7, 0.5, -0.6]).as_matrix()
    near = np.array([1.0, 2.0, 3.0]) * 1e-11
    assert seen(near, rotation) == GENERIC
    assert stratum(near, rotation, 1.0)[0] == 1
    assert tuple(stratum(near * 1e4, rotation, 1.0).tolist()) == GENERIC
