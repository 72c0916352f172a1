"""The nearest singular poses, and those of each stratum: in it, and globally nearest."""

from __future__ import annotations

import math

import numpy as np
import pytest
from hypothesis import assume, example, given, settings, strategies as st
from incidence import REPRESENTATIVES, is_clear_cut
from multistart import searched_distance, searched_least
from numpy.testing import assert_allclose
from scipy.spatial.transform import Rotation
from strategies import (
    EPSILON,
    QUARTER_TURNS,
    Case,
    all_cases,
    cases,
    designs,
    ordinary_cases,
    positions,
    rotations,
    singular_cases,
)

from explorer import PRESETS, Design, InputError, Pose, margins, nearest_singularities
from explorer.mechanism.configuration import Configuration
from explorer.numerics.arrays import FloatArray
from explorer.numerics.compiled import MANY_ROWS
from explorer.singularity.nearest import PlatformPoints, displacement, nearest_singular_poses
from explorer.singularity.nearest_stratum import nearest_in_strata, nearest_in_stratum
from explorer.singularity.strata import (
    COVERED,
    GENERIC,
    OF_INCIDENCES,
    STRATA,
    Stratum,
    conditions,
    is_below,
    stratum_of,
)

OPTIMAL = PRESETS["paper-optimal"]


def random_poses(seed: int, count: int) -> tuple[FloatArray, FloatArray]:
    rng = np.random.default_rng(seed)
    return rng.uniform(-12.0, 12.0, (count, 3)), Rotation.random(count, rng=rng).as_matrix()


@pytest.mark.parametrize("seed", range(2))
def test_nearest_poses_are_as_near_as_those_of_slsqp_from_many_starts(seed: int) -> None:
    rng = np.random.default_rng(seed)
    a3x, a3y, b1x, b1y, b2, span = (
        rng.uniform(0.3, 1.0, 6) * rng.choice([-1.0, 1.0], 6) * 10.0
    ).tolist()
    design = Design(a3=(a3x, a3y), b1=(b1x, b1y), b2=b2, b3=b2 + span)
    position, rotation = (each[0] for each in random_poses(seed, 1))
    nearest = nearest_singular_poses(Configuration(design, position, rotation))
    for incidence in (1, 2, 3):
        searched = searched_distance(design, position, rotation, incidence, starts=8)
        assert nearest.distance[incidence - 1] == pytest.approx(searched, abs=1e-8)
        assert nearest.distance[incidence - 1] <= searched + 1e-8


@given(all_cases())
@example(Case(OPTIMAL, np.zeros(3), np.eye(3)))
def test_nearest_poses_lie_on_the_singular_set_at_their_distance(case: Case) -> None:
    nearest = nearest_singular_poses(case.at)
    span = max(case.size, float(np.abs(nearest.position).max()))
    gram = nearest.rotation @ np.swapaxes(nearest.rotation, -1, -2)
    assert_allclose(gram, np.broadcast_to(np.eye(3), (3, 3, 3)), atol=1e-12)
    for index, distance in enumerate(nearest.distance):
        p, r = nearest.position[index], nearest.rotation[index]
        assert abs(margins(p, r)[index]) <= 1e-14 * span
        moved = displacement(case.design, case.position, case.rotation, p, r)
        assert distance == pytest.approx(float(moved), abs=8 * EPSILON * span)
        # From there it is at no distance.
        assert (
            nearest_singular_poses(Configuration(case.design, p, r)).distance[index] <= 1e-12 * span
        )
    # They are no farther than a translation.
    margin = np.abs(case.margins)
    margin[1] /= max(math.hypot(case.rotation[1, 0], case.rotation[2, 0]), 1e-300)
    assert (nearest.distance <= margin * (1.0 + 1e-9) + 1e-13 * case.size).all()


@pytest.mark.parametrize("b1y", [-3.8858, 0.3, 1e-3, 20.0])
def test_bounds_of_many_poses_are_close_to_the_distances(b1y: float) -> None:
    # Platforms from wide to nearly collinear, and positions from near to far.
    design = OPTIMAL.with_variable("b1y", b1y)
    positions, rotations = random_poses(1, MANY_ROWS)
    positions[::2] *= 30.0
    nearest = nearest_singular_poses(Configuration(design, positions, rotations))
    length = PlatformPoints.of(design).length
    assert (nearest.bound <= nearest.distance).all()
    # The tolerance of the bound is one of squares, where the two lines do not nearly coincide.
    apart = np.hypot(positions[:, 1], positions[:, 2]) > 0.2 * length
    gap = nearest.distance**2 - nearest.bound**2
    assert (gap <= 2e-8 * nearest.distance**2 + 1e-12 * length**2)[apart].all()


@given(singular_cases())
def test_nearest_pose_of_a_singular_pose_is_itself(case: Case) -> None:
    nearest = nearest_singular_poses(case.at)
    vanishing = np.abs(case.margins) <= 8.0 * EPSILON * case.size
    length = PlatformPoints.of(case.design).length
    assert vanishing.any()
    assert np.isfinite(nearest.position).all()
    # δ2 is a distance times a sine, and vanishes by rounding where both are small.
    sine = math.hypot(case.rotation[1, 0], case.rotation[2, 0])
    vanishing[1] &= sine > 0.01 or case.margins[1] == 0.0
    assume(vanishing.any())
    assert nearest.distance[vanishing].max() <= 1e-12 * max(case.size, length)


def test_nearest_singularity_at_a_distance_of_zero_is_the_pose_itself() -> None:
    pose = Pose((3.0, 4.0, 0.0), OPTIMAL.home_pose.quaternion)
    nearest = nearest_singularities(OPTIMAL, pose)
    # Level and at the height of the base: a1 is on the platform plane, b4 on the base's.
    assert [each.distance == 0.0 for each in nearest] == [True, True, True]
    assert all(each.pose is pose for each in nearest)
    assert nearest[0].name == "a1 on the platform plane"


@given(ordinary_cases())
def test_distances_of_mirror_images_and_turns_about_the_guide_are_equal(case: Case) -> None:
    assume(case.design.b2 * case.design.b3 != 0.0)
    here = nearest_singular_poses(case.at).distance
    # Mirrored in the plane y = 0, platform too: b1 comes to the other side of its x-axis.
    mirror = np.diag([1.0, -1.0, 1.0])
    x = case.design.variables
    mirrored = case.design.with_variables([x[0], -x[1], x[2], -x[3], x[4], x[5]])
    there = nearest_singular_poses(
        Configuration(mirrored, mirror @ case.position, mirror @ case.rotation @ mirror)
    ).distance
    assert_allclose(there, here, atol=1e-9 * case.size)
    turn = Rotation.from_euler("x", 0.7).as_matrix()
    turned = nearest_singular_poses(
        Configuration(case.design, turn @ case.position, turn @ case.rotation)
    )
    assert_allclose(turned.distance[:2], here[:2], atol=1e-9 * case.size)


def test_nearest_pose_of_two_equally_near_ones_is_one_of_them() -> None:
    # The centroid straight above a1, farther than a tilt would take: both tilts are best.
    platform = PlatformPoints.of(OPTIMAL)
    smaller = float(np.linalg.eigvalsh(platform.scatter)[1])
    for height in np.sqrt(smaller) * np.array([0.5, 0.9, 1.0, 1.1, 2.0, 50.0]):
        position = np.array([0.0, 0.0, height]) - platform.centroid
        nearest = nearest_singular_poses(Configuration(OPTIMAL, position, np.eye(3)))
        # The tilt about the longer axis with cos θ = λ₂ / height², where there is one.
        cosine = min(1.0, smaller / height**2)
        square = 2.0 * smaller * (1.0 - cosine) + (height * cosine) ** 2
        assert nearest.distance[0] ** 2 == pytest.approx(square, rel=1e-12)


@given(designs(sizes=(10.0,)), positions(), rotations(), st.sampled_from((1e-3, 1e-7, 1e-12)))
def test_poses_with_nearly_coinciding_lines_are_nearly_singular(
    design: Design, shift: FloatArray, turn: FloatArray, share: float
) -> None:
    small = Rotation.from_rotvec(share * Rotation.from_matrix(turn).as_rotvec()).as_matrix()
    position = np.array([5.0, 0.0, 0.0]) + share * shift
    nearest = nearest_singular_poses(Configuration(design, position, small))
    assert np.isfinite(nearest.position).all()
    assert nearest.distance[1] <= 20.0 * share
    assert (nearest.bound <= nearest.distance).all()


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
        seen = stratum_of(Configuration.at(case.design, found.pose))
        place = Case(case.design, np.array(found.pose.position), found.pose.rotation)
        if not is_below(seen, w):
            # At the tolerance other incidences hold as well, which need not agree.
            assert not is_clear_cut(place, reach)
            assert_allclose(vanishing(w, place.position / reach, place.rotation), 0.0, atol=1e-9)
        assert found.distance == pytest.approx(way(case, case.pose, found.pose), abs=1e-12)
        for lower in COVERED[w]:
            assert nearest[lower].distance >= found.distance - 1e-9 * case.size


@given(cases())
@settings(max_examples=FEW)
def test_nearest_poses_of_designs_of_any_size_are_finite_and_in_the_closures(case: Case) -> None:
    for w, found in nearest_in_strata(case.design, case.pose).items():
        assert np.isfinite(found.distance)
        place = np.array(found.pose.position) / case.design.reach
        assert_allclose(vanishing(w, place, found.pose.rotation), 0.0, atol=1e-9)


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
    p, n = np.array(found.pose.position), found.pose.rotation[:, 2]
    assert_allclose([p[1], p[2], n[0], n @ p], 0.0, atol=1e-14)


def test_nearest_pose_of_a_pose_in_the_closure_is_itself_and_of_one_outside_is_not() -> None:
    for w, (position, rotation) in REPRESENTATIVES.items():
        pose = Pose.of(position, rotation)
        for upper in (v for v in STRATA if is_below(w, v)):
            found = nearest_in_stratum(OPTIMAL, pose, upper)
            assert found.pose is pose
            assert found.distance == 0.0
        for lower in COVERED[w]:
            assert nearest_in_stratum(OPTIMAL, pose, lower).distance > 1e-3


def test_nearest_poses_of_home_are_the_nearest_singular_ones_or_have_closed_forms() -> None:
    home = OPTIMAL.home_pose
    for w, nearest in zip(OF_INCIDENCES, nearest_singularities(OPTIMAL, home), strict=True):
        found = nearest_in_stratum(OPTIMAL, home, w)
        assert (found.pose, found.distance) == (nearest.pose, nearest.distance)
    found = nearest_in_strata(OPTIMAL, home)
    assert found[GENERIC].pose is home
    # A level platform comes down to the base.
    assert found[3, 2, 1, 4].distance == pytest.approx(home.position[2], abs=1e-12)
    assert_allclose(found[1, 2, 3, 4].pose.position, 0.0, atol=1e-15)


@pytest.mark.parametrize("w", [(1, 2, 3), (1, 1, 2, 3), (5, 4, 3, 2)])
def test_permutation_that_is_no_stratum_is_refused(w: Stratum) -> None:
    with pytest.raises(InputError, match="permutation"):
        nearest_in_stratum(OPTIMAL, OPTIMAL.home_pose, w)
