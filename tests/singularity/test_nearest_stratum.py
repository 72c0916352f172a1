"""The nearest pose in each stratum, which is in its closure and globally nearest."""

from __future__ import annotations

import numpy as np
import pytest
from hypothesis import example, given, settings, strategies as st
from incidence import REPRESENTATIVES, is_clear_cut
from multistart import searched_least
from numpy.testing import assert_allclose
from scipy.spatial.transform import Rotation
from strategies import QUARTER_TURNS, Case, designs, ordinary_cases, positions, rotations

from explorer import PRESETS, Design, InputError, Pose, home_pose, nearest_singularities
from explorer.mechanism.displacement import displacement
from explorer.numerics.arrays import FloatArray
from explorer.singularity.bruhat import COVERED, OF_INCIDENCES, Stratum, conditions, is_below
from explorer.singularity.nearest_stratum import nearest_in_strata, nearest_in_stratum, seen_stratum
from explorer.singularity.strata import GENERIC, STRATA

OPTIMAL = PRESETS["paper-optimal"]
SQUARE = Design(a3=(10.0, 10.0), b1=(0.0, 10.0), b2=0.0, b3=10.0)
# Each example searches in all strata.
FEW = settings().max_examples // 5
# Strata with as many conditions as their codimension, which SLSQP needs.
SEARCHED = ((3, 4, 1, 2), (4, 2, 1, 3), (2, 1, 4, 3))
OTHERS = ((2, 4, 3, 1), (4, 1, 3, 2), (3, 2, 4, 1), (1, 4, 3, 2), (3, 2, 1, 4), (2, 3, 4, 1))


def way(case: Case, one: Pose, other: Pose) -> float:
    return float(
        displacement(case.design, one.position, one.rotation, other.position, other.rotation)
    )


def vanishing(w: Stratum, p: FloatArray, r: FloatArray) -> list[float]:
    """Return the values that vanish in the closure of a stratum, each once."""
    u, v, n = r.T
    meanings = {
        (1, 3, 1): {"np": n @ p},
        (2, 2, 1): {"cross": u[1] * p[2] - u[2] * p[1]},
        (3, 1, 1): {"z": p[2]},
        (1, 2, 1): {"np": n @ p, "vp": v @ p},
        (2, 1, 1): {"y": p[1], "z": p[2]},
        (2, 3, 2): {"np": n @ p, "nx": n[0]},
        (3, 2, 2): {"z": p[2], "uz": u[2]},
        (1, 1, 1): {"x": p[0], "y": p[1], "z": p[2]},
        (2, 2, 2): {"uy": u[1], "uz": u[2], "y": p[1], "z": p[2]},
        (3, 3, 3): {"nx": n[0], "ny": n[1], "z": p[2]},
    }
    found: dict[str, float] = {}
    for each in conditions(w):
        found |= {name: float(value) for name, value in meanings[each].items()}
    return list(found.values())


@given(ordinary_cases())
@example(Case(SQUARE, np.array([0.0, 0.0, 1e-4]), np.eye(3)[[0, 2, 1]] * [-1.0, 1.0, 1.0]))
@example(Case(SQUARE, np.array([25.0, 30.0, 0.0]), np.eye(3)))
@settings(max_examples=FEW)
def test_nearest_pose_in_a_closure_lies_in_it_and_no_nearer_than_in_the_closures_around(
    case: Case,
) -> None:
    reach, nearest = case.design.reach, nearest_in_strata(case.design, case.pose)
    for w, found in nearest.items():
        assert found.stratum == w
        seen = seen_stratum(case.design, found.pose)
        place = Case(case.design, np.array(found.pose.position), found.pose.rotation)
        if is_below(seen, w) or is_clear_cut(place, reach):
            assert found.seen == seen
        else:
            # At the tolerance other incidences hold as well, which need not agree.
            assert found.seen == w
            assert_allclose(vanishing(w, place.position / reach, place.rotation), 0.0, atol=1e-9)
        assert is_below(found.seen, w)
        assert found.distance == pytest.approx(way(case, case.pose, found.pose), abs=1e-12)
        for lower in COVERED[w]:
            assert nearest[lower].distance >= found.distance - 1e-9 * case.size


@pytest.mark.parametrize(
    "w", [*SEARCHED, *(pytest.param(w, marks=pytest.mark.long) for w in OTHERS)]
)
def test_nearest_pose_is_as_near_as_that_of_slsqp_from_many_starts(w: Stratum) -> None:
    rng = np.random.default_rng(sum(10**i * x for i, x in enumerate(w)))
    position, rotation = rng.uniform(-8.0, 8.0, 3), Rotation.random(random_state=rng).as_matrix()
    found = nearest_in_stratum(OPTIMAL, Pose.of(position, rotation), w)
    searched = searched_least(
        OPTIMAL, position, rotation, lambda p, r: vanishing(w, p, r), starts=8
    )
    assert found.distance == pytest.approx(searched, abs=1e-8)
    assert found.distance <= searched + 1e-8


@given(ordinary_cases(), positions(), rotations(), st.sampled_from((1.0, 1e-2, 1e-5)))
@settings(max_examples=FEW)
def test_distances_change_no_more_than_the_platform_moves(
    case: Case, shift: FloatArray, turn: FloatArray, share: float
) -> None:
    turned = Rotation.from_rotvec(share * Rotation.from_matrix(turn).as_rotvec()).as_matrix()
    pose, other = case.pose, Pose.of(case.position + share * shift, turned @ case.rotation)
    moved = way(case, pose, other)
    here, there = (nearest_in_strata(case.design, each) for each in (pose, other))
    for w in STRATA:
        assert abs(here[w].distance - there[w].distance) <= moved + 1e-8 * case.size


def test_nearest_pose_at_the_tolerance_of_incidences_lies_in_the_requested_closure() -> None:
    # b4 comes so near to a1, and b2b3 to the guide, that a1 counts as on the line, too.
    design = Design(a3=(10.0, 10.0), b1=(0.0, 10.0), b2=0.0, b3=2.5)
    pose = Pose.of([0.0, 0.15625, 0.0], QUARTER_TURNS[4])
    found = nearest_in_stratum(design, pose, (3, 1, 4, 2))
    assert is_below(found.seen, (3, 1, 4, 2))
    p, n = np.array(found.pose.position), found.pose.rotation[:, 2]
    assert_allclose([p[1], p[2], n[0], n @ p], 0.0, atol=1e-14)


@given(designs(), positions(), rotations())
@settings(max_examples=FEW)
def test_nearest_poses_of_designs_of_any_size_are_finite(
    design: Design, place: FloatArray, rotation: FloatArray
) -> None:
    size = max(map(abs, design.variables))
    for w in STRATA:
        found = nearest_in_stratum(design, Pose.of(size * place, rotation), w)
        assert np.isfinite(found.distance)
        assert is_below(found.seen, w)


def test_nearest_pose_of_a_pose_in_the_closure_is_itself_and_of_one_outside_is_not() -> None:
    for w, (position, rotation) in REPRESENTATIVES.items():
        pose = Pose.of(position, rotation)
        for upper in (v for v in STRATA if is_below(w, v)):
            found = nearest_in_stratum(OPTIMAL, pose, upper)
            assert found.pose is pose
            assert (found.distance, found.seen) == (0.0, w)
        for lower in COVERED[w]:
            assert nearest_in_stratum(OPTIMAL, pose, lower).distance > 1e-3


def test_nearest_poses_of_home_are_the_nearest_singular_ones_or_have_closed_forms() -> None:
    home = home_pose(OPTIMAL)
    for w, nearest in zip(OF_INCIDENCES, nearest_singularities(OPTIMAL, home), strict=True):
        found = nearest_in_stratum(OPTIMAL, home, w)
        assert (found.pose, found.distance) == (nearest.pose, nearest.distance)
        assert found.seen == w
    found = nearest_in_strata(OPTIMAL, home)
    assert found[GENERIC].pose is home
    # A level platform comes down to the base.
    assert found[3, 2, 1, 4].distance == pytest.approx(home.position[2], abs=1e-12)
    assert_allclose(found[1, 2, 3, 4].pose.position, 0.0, atol=1e-15)


@pytest.mark.parametrize("w", [(1, 2, 3), (1, 1, 2, 3), (5, 4, 3, 2)])
def test_permutation_that_is_no_stratum_is_refused(w: Stratum) -> None:
    with pytest.raises(InputError, match="permutation"):
        nearest_in_stratum(OPTIMAL, home_pose(OPTIMAL), w)
