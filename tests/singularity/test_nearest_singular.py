"""The nearest singular poses: singular, globally nearest, and finite in degenerate cases."""

from __future__ import annotations

import math

import numpy as np
import pytest
from hypothesis import assume, example, given, strategies as st
from multistart import searched_distance
from numpy.testing import assert_allclose
from scipy.spatial.transform import Rotation
from strategies import (
    EPSILON,
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
from explorer.singularity.nearest_lines import Constants, bound_over, value_at

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
    nearest = nearest_singular_poses(design, position, rotation)
    for incidence in (1, 2, 3):
        searched = searched_distance(design, position, rotation, incidence, starts=8)
        assert nearest.distance[incidence - 1] == pytest.approx(searched, abs=1e-8)
        assert nearest.distance[incidence - 1] <= searched + 1e-8


@given(all_cases())
@example(Case(OPTIMAL, np.zeros(3), np.eye(3)))
def test_nearest_poses_lie_on_the_singular_set_at_their_distance(case: Case) -> None:
    nearest = nearest_singular_poses(case.design, case.position, case.rotation)
    span = max(case.size, float(np.abs(nearest.position).max()))
    gram = nearest.rotation @ np.swapaxes(nearest.rotation, -1, -2)
    assert_allclose(gram, np.broadcast_to(np.eye(3), (3, 3, 3)), atol=1e-12)
    for index, distance in enumerate(nearest.distance):
        p, r = nearest.position[index], nearest.rotation[index]
        assert abs(margins(p, r)[index]) <= 1e-14 * span
        moved = displacement(case.design, case.position, case.rotation, p, r)
        assert distance == pytest.approx(float(moved), abs=8 * EPSILON * span)
        # From there it is at no distance.
        assert nearest_singular_poses(case.design, p, r).distance[index] <= 1e-12 * span
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
    nearest = nearest_singular_poses(design, positions, rotations)
    length = PlatformPoints.of(design).length
    assert (nearest.bound <= nearest.distance).all()
    # The tolerance of the bound is one of squares, where the two lines do not nearly coincide.
    apart = np.hypot(positions[:, 1], positions[:, 2]) > 0.2 * length
    gap = nearest.distance**2 - nearest.bound**2
    assert (gap <= 2e-8 * nearest.distance**2 + 1e-12 * length**2)[apart].all()


@given(st.data())
def test_bound_of_a_box_is_below_its_values(data: st.DataObject) -> None:
    number = st.floats(-1.0, 1.0)
    values = [data.draw(number) for _ in range(9)]
    far = data.draw(st.sampled_from((0.1, 1.0, 10.0)))
    values[6:8] = far * values[6], far * values[7]
    k = Constants._make([*values, 2.0])
    phi, sigma = data.draw(st.floats(0.0, math.pi)), data.draw(st.floats(0.0, 2 * math.pi))
    alpha, beta = (data.draw(st.sampled_from((1.0, 0.1, 1e-3))) for _ in range(2))
    bound = bound_over(phi, sigma, alpha, beta, k)
    steps = np.linspace(-1.0, 1.0, 9)
    values = [value_at(phi + i * alpha, sigma + j * beta, k) for i in steps for j in steps]
    assert min(values) >= bound - 1e-12 * (1.0 + float(np.square(k).sum()))
    # To second order it is the value itself.
    assert value_at(phi, sigma, k) - bound <= 100.0 * (1.0 + float(np.square(k).sum())) * max(
        alpha, beta
    )


@given(singular_cases())
def test_nearest_pose_of_a_singular_pose_is_itself(case: Case) -> None:
    nearest = nearest_singular_poses(case.design, case.position, case.rotation)
    vanishing = np.abs(case.margins) <= 8.0 * EPSILON * case.size
    length = PlatformPoints.of(case.design).length
    assert vanishing.any()
    assert np.isfinite(nearest.position).all()
    assert nearest.distance[vanishing].max() <= 1e-12 * max(case.size, length)


def test_nearest_singularity_at_a_distance_of_zero_is_the_pose_itself() -> None:
    pose = Pose((3.0, 4.0, 0.0), home_pose(OPTIMAL).quaternion)
    nearest = nearest_singularities(OPTIMAL, pose)
    # Level and at the height of the base: a1 is on the platform plane, b4 on the base's.
    assert [each.distance == 0.0 for each in nearest] == [True, True, True]
    assert all(each.pose is pose for each in nearest)
    assert nearest[0].name == "a1 on the platform plane"


def test_nearest_pose_lies_in_the_stratum_of_its_incidence() -> None:
    p, r = random_poses(10, MANY_ROWS)
    nearest = nearest_singular_poses(OPTIMAL, p, r)
    for index, closure in enumerate(((3, 4, 2, 1), (4, 2, 3, 1), (4, 3, 1, 2))):
        seen = stratum(nearest.position[:, index], nearest.rotation[:, index], OPTIMAL.reach)
        assert (seen == closure).all()


@given(ordinary_cases())
def test_distances_of_mirror_images_and_turns_about_the_guide_are_equal(case: Case) -> None:
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


def test_nearest_pose_of_two_equally_near_ones_is_one_of_them() -> None:
    # The centroid straight above a1, farther than a tilt would take: both tilts are best.
    platform = PlatformPoints.of(OPTIMAL)
    smaller = float(np.linalg.eigvalsh(platform.scatter)[1])
    for height in np.sqrt(smaller) * np.array([0.5, 0.9, 1.0, 1.1, 2.0, 50.0]):
        position = np.array([0.0, 0.0, height]) - platform.centroid
        nearest = nearest_singular_poses(OPTIMAL, position, np.eye(3))
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
    nearest = nearest_singular_poses(design, position, small)
    assert np.isfinite(nearest.position).all()
    assert nearest.distance[1] <= 20.0 * share
    assert (nearest.bound <= nearest.distance).all()


def test_nearest_poses_of_a_compiled_batch_equal_interpreted_ones() -> None:
    p, r = random_poses(4, MANY_ROWS)
    many = nearest_singular_poses(OPTIMAL, p.reshape(-1, 4, 3), r.reshape(-1, 4, 3, 3))
    assert many.distance.shape == (MANY_ROWS // 4, 4, 3)
    assert many.position.shape == (MANY_ROWS // 4, 4, 3, 3)
    assert many.rotation.shape == (MANY_ROWS // 4, 4, 3, 3, 3)
    for index in range(0, MANY_ROWS, 61):
        alone = nearest_singularities(OPTIMAL, Pose.of(p[index], r[index]))
        assert [each.incidence for each in alone] == [1, 2, 3]
        distances = [each.distance for each in alone]
        assert_allclose(distances, many.distance.reshape(-1, 3)[index], atol=1e-12)
