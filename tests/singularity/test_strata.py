"""The 24 strata of two flags: permutations, ranks and the closure order."""

from __future__ import annotations

import itertools
import math

import numpy as np
import pytest
from differences import moved
from hypothesis import assume, example, given, strategies as st
from incidence import permutation_of_flags
from numpy.testing import assert_array_equal
from scipy.spatial.transform import Rotation
from strategies import QUARTER_TURNS, WAYS, Case, ordinary_cases, ordinary_designs, singular_cases

from explorer import PRESETS, InputError, margins, rotation_from_quaternion, stratum
from explorer.numerics.arrays import FloatArray
from explorer.singularity.strata import GENERIC, STRATA, inversions

ALL = tuple(itertools.permutations((1, 2, 3, 4)))
IncidentPose = tuple[FloatArray, FloatArray]


def is_below(lower: tuple[int, ...], upper: tuple[int, ...]) -> bool:
    """Return the Bruhat order by the tableau criterion: sorted beginnings, entry by entry."""
    return all(
        a <= b
        for i in range(1, 5)
        for a, b in zip(sorted(lower[:i]), sorted(upper[:i]), strict=True)
    )


def seen(position: FloatArray, rotation: FloatArray) -> tuple[int, ...]:
    return tuple(stratum(position, rotation).tolist())


def is_clear_cut(case: Case, length: float | None = None) -> bool:
    """Return whether each distance and angle is either rounding or far above the tolerance.

    In between, the tolerance decides, and incidences that imply others need not agree.
    Distances are compared with a length, that of a1 from b4 if None.
    """
    p = case.position / (distance_of(case) if length is None else length)
    r = case.rotation
    measures = np.abs([*r.ravel(), *p, *(r.T @ p), *np.cross(r[:, 0], p), *margins(p, r)])
    return not ((measures > 1e-13) & (measures < 1e-6)).any()


def distance_of(case: Case) -> float:
    """Return how far a1 is from b4, in whatever unit; one if not at all."""
    return math.hypot(*case.position) or 1.0


def special_poses() -> list[IncidentPose]:
    """Return poses with incidences of every kind, built from turns and directions.

    Turns about z keep the planes parallel, those about x the lines; z then x keeps b2b3
    along the base plane, x then z keeps a1a2 along the platform plane.
    """
    turns = [
        Rotation.from_euler(axes, angles).as_matrix()
        for axes, angles in (
            ("z", [0.0]),
            ("Z", [0.7]),
            ("X", [0.6]),
            ("Y", [0.5]),
            ("ZX", [0.7, 0.6]),
            ("XZ", [0.6, 0.7]),
            ("ZYX", [0.7, 0.5, -0.6]),
        )
    ]
    x, y, z = np.eye(3)
    return [
        (np.asarray(position, dtype=np.float64), rotation)
        for rotation in turns
        for u, v, n in (rotation.T,)
        for position in (
            0.0 * x,
            2.0 * x,
            2.0 * u,
            2.0 * x + 3.0 * u,
            2.0 * x + 3.0 * y,
            2.0 * u + 3.0 * v,
            3.0 * np.cross(z, n),
            2.0 * x + 3.0 * y + 5.0 * z,
        )
    ]


def representatives() -> dict[tuple[int, ...], IncidentPose]:
    """Return a pose in each stratum, as told by the ranks of homogeneous coordinates."""
    return {permutation_of_flags(*pose): pose for pose in special_poses()}


REPRESENTATIVES = representatives()


def test_there_are_24_strata_in_order_of_dimension() -> None:
    assert sorted(STRATA) == sorted(ALL)
    dimensions = [inversions(w) for w in STRATA]
    assert dimensions == sorted(dimensions)
    # The dimensions of the cells of the flag manifold of projective space.
    assert [dimensions.count(d) for d in range(7)] == [1, 3, 5, 6, 5, 3, 1]


@pytest.mark.parametrize("w", ALL)
def test_inversions_are_the_swaps_of_neighbours_that_sort(w: tuple[int, ...]) -> None:
    entries, swaps = list(w), 0
    while entries != sorted(entries):
        i = next(i for i in range(3) if entries[i] > entries[i + 1])
        entries[i], entries[i + 1] = entries[i + 1], entries[i]
        swaps += 1
    assert inversions(w) == swaps


def test_the_special_poses_reach_every_stratum() -> None:
    assert sorted(REPRESENTATIVES) == sorted(ALL)


@pytest.mark.parametrize("w", ALL)
def test_a_pose_built_in_each_stratum_is_seen_in_it(w: tuple[int, ...]) -> None:
    assert seen(*REPRESENTATIVES[w]) == w


def test_every_special_pose_agrees_with_the_ranks_of_homogeneous_coordinates() -> None:
    for pose in special_poses():
        assert seen(*pose) == permutation_of_flags(*pose)


@given(
    st.tuples(*[st.integers(-2, 2)] * 3),
    st.tuples(*[st.integers(-1, 1)] * 4).filter(any),
)
def test_integer_poses_agree_with_the_ranks_of_homogeneous_coordinates(
    place: tuple[int, ...], quaternion: tuple[int, ...]
) -> None:
    position = np.array(place, dtype=np.float64)
    rotation = rotation_from_quaternion(quaternion)
    assert seen(position, rotation) == permutation_of_flags(position, rotation)


def test_quarter_turns_on_a_grid_agree_with_ranks_and_fill_many_strata() -> None:
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
def test_any_clear_cut_pose_agrees_with_ranks_and_is_generic_without_incidence(
    case: Case,
) -> None:
    assume(is_clear_cut(case))
    margin = np.abs(margins(case.position, case.rotation))
    found = seen(case.position, case.rotation)
    distance = distance_of(case)
    assert found == permutation_of_flags(case.position / distance, case.rotation, 1e-9)
    assert (found == GENERIC) == bool(margin.min() > 1e-6 * distance)


@pytest.mark.parametrize(
    ("way", "w"), [((1,), (3, 4, 2, 1)), ((2,), (4, 2, 3, 1)), ((3,), (4, 3, 1, 2))]
)
def test_where_one_margin_vanishes_is_its_stratum_of_dimension_five(
    way: tuple[int, ...], w: tuple[int, ...]
) -> None:
    assert inversions(w) == 5

    @given(singular_cases(way, ordinary_designs()))
    def law(case: Case) -> None:
        assume(is_clear_cut(case))
        found = seen(case.position, case.rotation)
        assert is_below(found, w)
        margin = np.abs(margins(case.position, case.rotation)) / case.size
        if np.sort(margin)[1] > 1e-6:
            assert found == w

    law()


@pytest.mark.parametrize("way", WAYS)
def test_a_margin_vanishes_exactly_in_the_closure_of_its_stratum(way: tuple[int, ...]) -> None:
    closures = ((3, 4, 2, 1), (4, 2, 3, 1), (4, 3, 1, 2))

    @given(singular_cases(way, ordinary_designs()))
    def law(case: Case) -> None:
        assume(is_clear_cut(case))
        found = seen(case.position, case.rotation)
        margin = np.abs(margins(case.position, case.rotation)) / case.size
        for index, closure in enumerate(closures):
            if margin[index] < 1e-13:
                assert is_below(found, closure)
            elif margin[index] > 1e-6:
                assert not is_below(found, closure)

    law()


def test_both_flags_coincide_at_no_motion_only() -> None:
    assert seen(np.zeros(3), np.eye(3)) == (1, 2, 3, 4)
    assert seen(np.zeros(3), np.diag([1.0, -1.0, -1.0])) == (1, 2, 3, 4)
    assert seen(np.zeros(3), np.diag([-1.0, 1.0, -1.0])) == (1, 2, 3, 4)
    assert seen(np.array([1.0, 0.0, 0.0]), np.eye(3)) != (1, 2, 3, 4)


@pytest.mark.parametrize("w", ALL)
def test_a_small_move_leaves_a_stratum_only_for_one_whose_closure_holds_it(
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


@pytest.mark.parametrize("w", ALL)
def test_a_random_small_move_leads_to_the_generic_stratum(w: tuple[int, ...]) -> None:
    position, rotation = REPRESENTATIVES[w]
    twist = np.array([3.1, -2.3, 4.7, 2.9, 3.7, -5.3]) * 1e-4
    assert seen(*moved(position, rotation, twist)) == GENERIC


@pytest.mark.parametrize("w", ALL)
@pytest.mark.parametrize("scale", [1e-200, 1e-20, 1e-6, 1e6, 1e20, 1e200])
def test_strata_do_not_depend_on_the_unit(w: tuple[int, ...], scale: float) -> None:
    position, rotation = REPRESENTATIVES[w]
    assert seen(scale * position, rotation) == w


@pytest.mark.parametrize("w", ALL)
def test_exchanging_the_flags_inverts_the_permutation(w: tuple[int, ...]) -> None:
    position, rotation = REPRESENTATIVES[w]
    inverse = tuple(w.index(value) + 1 for value in (1, 2, 3, 4))
    assert seen(-rotation.T @ position, rotation.T) == inverse


def test_incidences_hold_to_a_billionth_of_the_given_length() -> None:
    rotation = Rotation.from_euler("ZYX", [0.7, 0.5, -0.6]).as_matrix()
    near = np.array([1.0, 2.0, 3.0]) * 1e-11
    assert seen(near, rotation) == GENERIC
    assert stratum(near, rotation, 1.0)[0] == 1
    assert tuple(stratum(near * 1e4, rotation, 1.0).tolist()) == GENERIC


def test_batches_equal_single_calls() -> None:
    poses = special_poses()
    positions, rotations = (np.array(part) for part in zip(*poses, strict=True))
    found = stratum(positions.reshape(7, -1, 3), rotations.reshape(7, -1, 3, 3))
    assert found.shape == (7, len(poses) // 7, 4)
    assert_array_equal(found.reshape(-1, 4), [seen(*pose) for pose in poses])
    assert stratum(np.empty((0, 3)), np.empty((0, 3, 3))).shape == (0, 4)
    assert stratum(np.zeros((2, 1, 3)), np.broadcast_to(np.eye(3), (3, 3, 3))).shape == (2, 3, 4)


def test_unusable_poses_are_refused() -> None:
    with pytest.raises(InputError):
        stratum([0.0, math.inf, 0.0], np.eye(3))
    with pytest.raises(InputError):
        stratum([0.0, 0.0, 0.0], np.zeros((3, 3)))
