"""Singularities: margins are incidences, and the Jacobian is singular where one vanishes."""

from __future__ import annotations

import math

import numpy as np
import pytest
from differences import assert_is_jacobian
from hypothesis import assume, given, strategies as st
from incidence import distance_of_lines, distance_to_plane, tetrahedron_volume
from numpy.testing import assert_allclose, assert_array_equal
from scipy.spatial.transform import Rotation
from strategies import (
    EPSILON,
    Case,
    all_cases,
    cases,
    collapsed_cases,
    ordinary_cases,
    ordinary_designs,
    singular_cases,
)

from explorer import PRESETS, Design, evaluate, inverse, jacobian, margins, rotation_from_quaternion
from explorer.mechanism.kinematics import determinant, tetrahedron_volumes
from explorer.mechanism.margins import TETRAHEDRA, mode_of, planes_of_singularity, signs_of
from explorer.mechanism.pose import Pose
from explorer.numerics.arrays import FloatArray


def shortest_length(case: Case) -> float:
    return float(case.joints[[0, 2, 4, 5]].min())


def condition_of(case: Case) -> float:
    return float(case.at.inverse_condition)


def determinant_of(case: Case) -> float:
    return float(determinant(case.design, case.joints, case.margins))


def incidence_distances(case: Case) -> FloatArray:
    """Return |δ1|, |δ2| and |δ3| from the pose's points alone."""
    points = case.at.points
    sine = math.hypot(case.rotation[1, 0], case.rotation[2, 0])
    return np.array(
        [
            distance_to_plane(points.a1, (points.b1, points.b2, points.b3)),
            # δ2 is the distance of the lines times the sine between them.
            distance_of_lines((points.a1, points.a2), (points.b2, points.b3)) * sine,
            distance_to_plane(points.b4, (points.a1, points.a2, points.a3)),
        ]
    )


@given(ordinary_cases())
def test_jacobian_is_the_derivative_of_inverse(case: Case) -> None:
    assume(shortest_length(case) > 0.05 * case.size)
    p, r = case.position, case.rotation
    assert_is_jacobian(
        lambda p, r: inverse(case.design, p, r), case.at.jacobian, p, r, case.size, tolerance=1e-6
    )


@given(ordinary_cases(), st.tuples(*[st.floats(-1.0, 1.0)] * 3))
def test_jacobian_at_the_tool_is_the_derivative_of_inverse_by_its_twists(
    case: Case, direction: tuple[float, float, float]
) -> None:
    assume(shortest_length(case) > 0.05 * case.size)
    p, r = case.position, case.rotation
    tool = case.size * np.array(direction)

    def joints_of(point: FloatArray, rotation: FloatArray) -> FloatArray:
        return inverse(case.design, point - rotation @ tool, rotation)

    matrix = jacobian(case.design, p, r, tool)
    assert_is_jacobian(joints_of, matrix, p + r @ tool, r, case.size, tolerance=2e-6)
    at_b4 = case.at.jacobian
    # The rows are forces at b4 and their moments about the tool; the moments alone differ.
    assert_array_equal(matrix[:, :3], at_b4[:, :3])
    # In a singular pose there is no logarithm of the determinant.
    assume(condition_of(case) > 1e-6)
    values = np.linalg.slogdet(at_b4), np.linalg.slogdet(matrix)
    assert values[1][0] == values[0][0]
    assert values[1][1] == pytest.approx(values[0][1], abs=1e-6)


@given(ordinary_cases())
def test_margins_have_their_closed_form_derivatives(case: Case) -> None:
    p, r = case.position, case.rotation
    u, n = r[:, 0], r[:, 2]
    x, z = np.eye(3)[0], np.eye(3)[2]
    # δ1 = -n·p, δ2 = (x̂ × u)·p = u·(p × x̂), δ3 = ẑ·p, with u' = ω × u and n' = ω × n.
    derivative = np.array(
        [
            [*(-n), *np.cross(p, n)],
            [*np.cross(x, u), *np.cross(u, np.cross(p, x))],
            [*z, 0.0, 0.0, 0.0],
        ]
    )
    assert_is_jacobian(margins, derivative, p, r, case.size, tolerance=1e-8)


@given(cases())
def test_determinant_is_that_of_the_jacobian_by_lu(case: Case) -> None:
    size = case.size
    assume(shortest_length(case) > 1e-3 * size)
    # Divided by the size, so that LU has numbers near one.
    lengths = np.array([1.0, 1.0, 1.0, size, size, size])
    expected = float(np.linalg.det(case.at.jacobian / lengths))
    error = 1000.0 * EPSILON * (size / shortest_length(case))
    assert_allclose(determinant_of(case) / size**3, expected, rtol=1e-9, atol=error)


@given(singular_cases(among=ordinary_designs()))
def test_jacobian_where_margins_vanish_is_singular(case: Case) -> None:
    vanishing = np.abs(case.margins) <= 4.0 * EPSILON * case.size
    assert vanishing.any()
    assert condition_of(case) < 1e-13
    if shortest_length(case) > 0.01 * case.size:
        assert abs(determinant_of(case)) < 1e-11 * case.size**3
    # Each of these margins is an incidence.
    assert (incidence_distances(case)[vanishing] <= 1e-11 * case.size).all()


@given(ordinary_cases(), st.integers(0, 2**32 - 1))
def test_errors_and_loads_grow_at_most_by_the_smallest_singular_value(
    case: Case, seed: int
) -> None:
    assume(case.regularity > 1e-2)
    snapshot = evaluate(case.design, Pose.of(case.position, case.rotation))
    least, size = snapshot.smallest_singular_value, case.design.reach
    scale = np.array([1.0, 1.0, 1.0, size, size, size])
    j, changes = case.at.jacobian, np.random.default_rng(seed).normal(size=6)
    length = np.linalg.norm(changes) * (1.0 + 1e-6)
    assert np.linalg.norm(scale * np.linalg.solve(j, changes)) <= length / least
    assert np.linalg.norm(np.linalg.solve(j.T, scale * changes)) <= length / least
    # The bound is attained.
    most = np.linalg.norm(np.linalg.inv(j / scale), 2)
    assert least * most == pytest.approx(1.0, rel=1e-6)
    assert 1e-9 < snapshot.inverse_condition <= least
    assert snapshot.determinant != 0.0


def test_determinant_where_a_margin_is_zero_is_exactly_zero() -> None:
    design = PRESETS["paper-optimal"]
    assert margins([3.0, -5.0, 7.0], np.eye(3))[1] == 0.0
    rotation = rotation_from_quaternion([0.8, 0.3, -0.2, 0.5])
    joints = inverse(design, [3.0, 4.0, 0.0], rotation)
    assert determinant(design, joints, margins([3.0, 4.0, 0.0], rotation)) == 0.0
    assert determinant(design, joints, np.array([0.0, 1.0, 1.0])) == 0.0
    assert determinant(design, joints, np.array([1.0, 1.0, 1.0])) != 0.0


@given(all_cases())
def test_volumes_are_those_of_the_four_points(case: Case) -> None:
    points = case.at.points._asdict()
    size = max(case.size, case.design.a2x)
    volumes = tetrahedron_volumes(case.design, case.margins).tolist()
    for names, volume in zip(TETRAHEDRA, volumes, strict=True):
        a, b, c, d = (points[name] for name in names)
        assert_allclose(volume, tetrahedron_volume(a, b, c, d), rtol=1e-9, atol=1e-13 * size**3)


@given(ordinary_cases())
def test_margins_are_the_incidence_distances(case: Case) -> None:
    assume(math.hypot(case.rotation[1, 0], case.rotation[2, 0]) > 1e-3)
    margin, expected = np.abs(case.margins), incidence_distances(case)
    assert_allclose(margin, expected, rtol=1e-8, atol=1e-10 * case.size)


@given(all_cases())
def test_snapshot_of_any_pose_equals_its_parts(case: Case) -> None:
    snapshot, p, r = evaluate(case.design, case.pose), case.position, case.pose.rotation
    joints, margin = inverse(case.design, p, r), margins(p, r)
    assert_array_equal(snapshot.joints, joints)
    assert_array_equal(snapshot.margins, margin)
    assert_array_equal(snapshot.volumes, tetrahedron_volumes(case.design, margin))
    assert snapshot.mode == int(mode_of(margin))
    assert snapshot.signs == signs_of(snapshot.mode)
    assert snapshot.proximity == np.abs(margin).min() / case.design.reach
    assert snapshot.determinant == float(determinant(case.design, joints, margin))
    assert snapshot.modes.joints.shape == (8, 6)
    assert snapshot.stratum_dimension in range(7)


@given(all_cases() | collapsed_cases())
def test_jacobian_of_any_pose_is_finite_with_a_condition_from_zero_to_one(case: Case) -> None:
    assert np.isfinite(case.at.jacobian).all()
    assert np.isfinite(determinant_of(case))
    assert np.isfinite(tetrahedron_volumes(case.design, case.margins)).all()
    assert 0.0 <= condition_of(case) <= 1.0


@pytest.mark.parametrize(
    ("position", "row"),
    [([-4.0, 1.0, 0.0], 0), ([-3.0, 0.0, 0.0], 2), ([-1.5, 0.0, 0.0], 4), ([10.0, 4.0, 0.0], 5)],
)
def test_jacobian_row_of_a_leg_of_no_length_is_zero(position: list[float], row: int) -> None:
    case = Case(PRESETS["paper-initial"], np.array(position), np.eye(3))
    assert case.joints[row] == 0.0
    assert_array_equal(case.at.jacobian[row], 0.0)
    assert condition_of(case) == 0.0
    assert determinant_of(case) == 0.0


# Pairs of the planes of δ1, δ2 and δ3.
PAIRS = ((0, 1), (1, 2), (0, 2))


# The guide parallel to the platform plane, b2b3 parallel to the base plane, both, and neither.
@pytest.mark.parametrize(
    ("axes", "coincident"),
    [("XZ", {(0, 1)}), ("ZX", {(1, 2)}), ("Z", set(PAIRS)), ("XYZ", set[tuple[int, int]]())],
)
@given(st.lists(st.floats(0.2, 1.3), min_size=3, max_size=3))
def test_singular_planes_coincide_where_a_line_of_one_flag_is_parallel_to_the_plane_of_the_other(
    axes: str, coincident: set[tuple[int, int]], angles: list[float]
) -> None:
    rotation = Rotation.from_euler(axes, angles[: len(axes)]).as_matrix()
    planes = planes_of_singularity(rotation)
    units = planes / np.linalg.norm(planes, axis=-1, keepdims=True)
    found = {pair for pair in PAIRS if np.linalg.norm(np.cross(*units[list(pair)])) < 1e-12}
    assert found == coincident


@pytest.mark.parametrize("design", PRESETS.values(), ids=PRESETS.keys())
def test_singular_positions_at_the_papers_home_are_one_plane(design: Design) -> None:
    assert np.linalg.matrix_rank(planes_of_singularity(design.home_pose.rotation)) == 1
