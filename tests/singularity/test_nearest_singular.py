"""The nearest singular poses: singular, globally nearest, and finite where degenerate."""

from __future__ import annotations

import math

import numpy as np
import pytest
from hypothesis import assume, example, given, settings, strategies as st
from multistart import searched_distance
from numpy.testing import assert_allclose
from scipy.spatial.transform import Rotation
from strategies import (
    EPSILON,
    WAYS,
    Case,
    all_cases,
    designs,
    ordinary_cases,
    positions,
    rotations,
    singular_cases,
)

from explorer import (
    PRESETS,
    Design,
    InputError,
    Pose,
    home_pose,
    margins,
    nearest_singular_poses,
    nearest_singularities,
    stratum,
)
from explorer.mechanism.displacement import PlatformPoints, displacement
from explorer.numerics.arrays import FloatArray
from explorer.numerics.compiled import MANY_ROWS
from explorer.singularity.nearest_lines import bound_over, value_at

OPTIMAL = PRESETS["paper-optimal"]
CLOSURES = ((3, 4, 2, 1), (4, 2, 3, 1), (4, 3, 1, 2))


def way(case: Case, position: FloatArray, rotation: FloatArray) -> float:
    return float(displacement(case.design, case.position, case.rotation, position, rotation))


def random_poses(seed: int, count: int) -> tuple[FloatArray, FloatArray]:
    rng = np.random.default_rng(seed)
    return rng.uniform(-12.0, 12.0, (count, 3)), Rotation.random(count, rng=rng).as_matrix()


@pytest.mark.parametrize("seed", range(4))
def test_nearest_poses_are_as_near_as_slsqp_from_many_starts(seed: int) -> None:
    rng = np.random.default_rng(seed)
    a3x, a3y, b1x, b1y, b2, span = (
        rng.uniform(0.3, 1.0, 6) * rng.choice([-1.0, 1.0], 6) * 10.0
    ).tolist()
    design = Design(a3=(a3x, a3y), b1=(b1x, b1y), b2=b2, b3=b2 + span)
    position, rotation = (each[0] for each in random_poses(seed, 1))
    found = nearest_singular_poses(design, position, rotation)
    for incidence in (1, 2, 3):
        searched = searched_distance(design, position, rotation, incidence, starts=8)
        assert found.distance[incidence - 1] == pytest.approx(searched, abs=1e-8)
        assert found.distance[incidence - 1] <= searched + 1e-8


@given(all_cases())
def test_the_nearest_poses_lie_on_the_singular_set_at_their_distance(case: Case) -> None:
    found = nearest_singular_poses(case.design, case.position, case.rotation)
    span = max(case.size, float(np.abs(found.position).max()))
    assert_allclose(
        found.rotation @ np.swapaxes(found.rotation, -1, -2),
        np.broadcast_to(np.eye(3), (3, 3, 3)),
        atol=1e-12,
    )
    for index in range(3):
        margin = margins(found.position[index], found.rotation[index])[index]
        assert abs(margin) <= 1e-14 * span
        distance = way(case, found.position[index], found.rotation[index])
        assert found.distance[index] == pytest.approx(distance, abs=8 * EPSILON * span)


@given(all_cases())
def test_nearest_poses_are_no_farther_than_a_translation(case: Case) -> None:
    margin = np.abs(margins(case.position, case.rotation))
    margin[1] /= max(math.hypot(case.rotation[1, 0], case.rotation[2, 0]), 1e-300)
    found = nearest_singular_poses(case.design, case.position, case.rotation)
    assert (found.distance <= margin * (1.0 + 1e-9) + 1e-13 * case.size).all()


@given(ordinary_cases(), positions(), rotations(), st.sampled_from((1.0, 1e-2, 1e-5)))
def test_a_distance_changes_no_more_than_the_platform_moves(
    case: Case, shift: FloatArray, turn: FloatArray, share: float
) -> None:
    turned = Rotation.from_rotvec(share * Rotation.from_matrix(turn).as_rotvec()).as_matrix()
    moved_p, moved_r = case.position + share * shift, turned @ case.rotation
    here = nearest_singular_poses(case.design, case.position, case.rotation).distance
    there = nearest_singular_poses(case.design, moved_p, moved_r).distance
    moved = way(case, moved_p, moved_r)
    assert (np.abs(here - there) <= moved + 1e-9 * case.size).all()


@pytest.mark.parametrize("b1y", [-3.8858, 0.3, 1e-3, 20.0])
@pytest.mark.parametrize("spread", [1.0, 30.0])
def test_bounds_of_many_poses_are_close_to_the_distances(b1y: float, spread: float) -> None:
    # Platforms from wide to nearly a line, and from near by to far off.
    design = OPTIMAL.with_variable("b1y", b1y)
    positions, rotations = random_poses(1, 500)
    found = nearest_singular_poses(design, spread * positions, rotations)
    square = PlatformPoints.of(design).length ** 2
    assert (found.bound <= found.distance).all()
    # A proof is one of squares: these are what it is good to.
    gap = found.distance**2 - found.bound**2
    assert (gap <= 2e-8 * found.distance**2 + 1e-12 * square).all()


@given(st.data())
def test_bound_of_a_box_is_below_its_values(data: st.DataObject) -> None:
    number = st.floats(-1.0, 1.0)
    k = np.array([data.draw(number) for _ in range(9)] + [2.0])
    k[4:6] *= data.draw(st.sampled_from((0.1, 1.0, 10.0)))
    phi, sigma = data.draw(st.floats(0.0, math.pi)), data.draw(st.floats(0.0, 2 * math.pi))
    alpha, beta = (data.draw(st.sampled_from((1.0, 0.1, 1e-3))) for _ in range(2))
    bound = bound_over(phi, sigma, alpha, beta, k)
    steps = np.linspace(-1.0, 1.0, 9)
    values = [value_at(phi + i * alpha, sigma + j * beta, k) for i in steps for j in steps]
    assert min(values) >= bound - 1e-12 * (1.0 + float((k**2).sum()))
    # To second order it is the value itself.
    assert value_at(phi, sigma, k) - bound <= 100.0 * (1.0 + float((k**2).sum())) * max(alpha, beta)


@pytest.mark.parametrize("way_of_being_singular", WAYS)
def test_a_singular_pose_is_its_own_nearest(way_of_being_singular: tuple[int, ...]) -> None:
    @given(singular_cases(way_of_being_singular))
    @settings(max_examples=30)
    def law(case: Case) -> None:
        found = nearest_singular_poses(case.design, case.position, case.rotation)
        length = PlatformPoints.of(case.design).length
        assert np.isfinite(found.position).all()
        for incidence in way_of_being_singular:
            assert found.distance[incidence - 1] <= 1e-12 * max(case.size, length)

    law()


def test_on_the_singular_set_the_pose_itself_is_returned() -> None:
    pose = Pose((3.0, 4.0, 0.0), home_pose(OPTIMAL).quaternion)
    found = nearest_singularities(OPTIMAL, pose)
    # Level and at the height of the base: a1 is on the platform plane, b4 on the base's.
    assert [each.distance == 0.0 for each in found] == [True, True, True]
    assert all(each.pose is pose for each in found)
    assert found[0].name == "a1 on the platform plane"


@given(all_cases())
@example(Case(OPTIMAL, np.zeros(3), np.eye(3)))
def test_nearest_pose_of_a_nearest_pose_is_itself(case: Case) -> None:
    found = nearest_singular_poses(case.design, case.position, case.rotation)
    for index in range(3):
        again = nearest_singular_poses(case.design, found.position[index], found.rotation[index])
        span = max(case.size, float(np.abs(found.position).max()))
        assert again.distance[index] <= 1e-12 * span


@pytest.mark.parametrize("seed", range(3))
def test_the_nearest_pose_is_seen_in_the_stratum_of_its_incidence(seed: int) -> None:
    p, r = random_poses(10 + seed, 50)
    found = nearest_singular_poses(OPTIMAL, p, r)
    for index, closure in enumerate(CLOSURES):
        seen = stratum(found.position[:, index], found.rotation[:, index], OPTIMAL.reach)
        assert (seen == closure).all()


@given(ordinary_cases(), st.sampled_from((1e-15, 1e-3, 1e7)))
def test_distances_scale_with_the_design(case: Case, factor: float) -> None:
    scaled = case.design.with_variables([factor * x for x in case.design.variables])
    here = nearest_singular_poses(case.design, case.position, case.rotation).distance
    there = nearest_singular_poses(scaled, factor * case.position, case.rotation).distance
    assert_allclose(there / factor, here, atol=1e-9 * case.size)


@given(ordinary_cases())
def test_mirror_images_and_turns_about_the_guide_are_as_far(case: Case) -> None:
    assume(case.design.b2 * case.design.b3 != 0.0)
    here = nearest_singular_poses(case.design, case.position, case.rotation).distance
    # Mirrored in the plane y = 0, platform too: b1 comes to the other side of its x-axis.
    mirror = np.diag([1.0, -1.0, 1.0])
    x = case.design.variables
    mirrored = case.design.with_variables([x[0], -x[1], x[2], -x[3], x[4], x[5]])
    there = nearest_singular_poses(
        mirrored, mirror @ case.position, mirror @ case.rotation @ mirror
    ).distance
    assert_allclose(there, here, atol=1e-9 * case.size)
    turn = Rotation.from_euler("x", 0.7).as_matrix()
    turned = nearest_singular_poses(case.design, turn @ case.position, turn @ case.rotation)
    assert_allclose(turned.distance[:2], here[:2], atol=1e-9 * case.size)


def test_where_two_poses_are_equally_near_one_of_them_is_found() -> None:
    # The centroid straight above a1, farther than a tilt would take: both tilts are best.
    platform = PlatformPoints.of(OPTIMAL)
    smaller = float(np.linalg.eigvalsh(platform.scatter)[1])
    for height in np.sqrt(smaller) * np.array([0.5, 0.9, 1.0, 1.1, 2.0, 50.0]):
        position = np.array([0.0, 0.0, height]) - platform.centroid
        found = nearest_singular_poses(OPTIMAL, position, np.eye(3))
        # The tilt about the longer axis with cos θ = λ₂ / height², where there is one.
        cosine = min(1.0, smaller / height**2)
        square = 2.0 * smaller * (1.0 - cosine) + (height * cosine) ** 2
        assert found.distance[0] ** 2 == pytest.approx(square, rel=1e-12)


@given(designs(sizes=(10.0,)), positions(), rotations(), st.sampled_from((1e-3, 1e-7, 1e-12)))
def test_nearly_coinciding_lines_are_nearly_singular(
    design: Design, shift: FloatArray, turn: FloatArray, share: float
) -> None:
    small = Rotation.from_rotvec(share * Rotation.from_matrix(turn).as_rotvec()).as_matrix()
    position = np.array([5.0, 0.0, 0.0]) + share * shift
    found = nearest_singular_poses(design, position, small)
    assert np.isfinite(found.position).all()
    assert found.distance[1] <= 20.0 * share
    assert (found.bound <= found.distance).all()


def test_a_batch_is_that_of_its_poses_interpreted_or_compiled() -> None:
    p, r = random_poses(4, MANY_ROWS)
    many = nearest_singular_poses(OPTIMAL, p.reshape(-1, 4, 3), r.reshape(-1, 4, 3, 3))
    assert many.distance.shape == (MANY_ROWS // 4, 4, 3)
    assert many.position.shape == (MANY_ROWS // 4, 4, 3, 3)
    assert many.rotation.shape == (MANY_ROWS // 4, 4, 3, 3, 3)
    for index in range(0, MANY_ROWS, 37):
        alone = nearest_singularities(OPTIMAL, Pose.of(p[index], r[index]))
        assert [each.incidence for each in alone] == [1, 2, 3]
        distances = [each.distance for each in alone]
        assert_allclose(distances, many.distance.reshape(-1, 3)[index], atol=1e-12)


def test_unusable_poses_are_refused() -> None:
    with pytest.raises(InputError, match="position"):
        nearest_singular_poses(OPTIMAL, [0.0, math.nan, 1.0], np.eye(3))
    with pytest.raises(InputError, match="rotation"):
        nearest_singular_poses(OPTIMAL, [0.0, 0.0, 1.0], 2.0 * np.eye(3))
