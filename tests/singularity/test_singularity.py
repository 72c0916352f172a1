"""Singularities: margins are incidences, and the Jacobian is singular where one vanishes."""

from __future__ import annotations

import math

import msgspec
import numpy as np
import pytest
from differences import assert_is_jacobian
from hypothesis import assume, given, strategies as st
from incidence import distance_of_lines, distance_to_plane, tetrahedron_volume
from numpy.testing import assert_allclose, assert_array_equal
from strategies import (
    EPSILON,
    WAYS,
    Case,
    all_cases,
    cases,
    collapsed_cases,
    ordinary_cases,
    ordinary_designs,
    rotations,
    singular_cases,
)

from explorer import (
    PRESETS,
    Design,
    InputError,
    attachment_points,
    evaluate,
    inverse,
    jacobian,
    margins,
    rotation_from_quaternion,
)
from explorer.mechanism.margins import INCIDENCES, TETRAHEDRA, mode_name, mode_of, signs_of
from explorer.mechanism.pose import Pose
from explorer.numerics.arrays import FloatArray
from explorer.singularity.jacobian import determinant, inverse_condition, tetrahedron_volumes


def shortest_length(case: Case) -> float:
    joints = inverse(case.design, case.position, case.rotation)
    return float(joints[[0, 2, 4, 5]].min())


def distances(case: Case) -> list[float]:
    """Return the three incidence distances of the pose, from its points alone."""
    points = attachment_points(case.design, case.position, case.rotation)
    return [
        distance_to_plane(points.a1, (points.b1, points.b2, points.b3)),
        distance_of_lines((points.a1, points.a2), (points.b2, points.b3)),
        distance_to_plane(points.b4, (points.a1, points.a2, points.a3)),
    ]


@given(ordinary_cases())
def test_jacobian_is_the_derivative_of_inverse(case: Case) -> None:
    assume(shortest_length(case) > 0.05 * case.size)
    assert_is_jacobian(
        lambda p, r: inverse(case.design, p, r),
        jacobian(case.design, case.position, case.rotation),
        case.position,
        case.rotation,
        case.size,
        tolerance=1e-6,
    )


@given(ordinary_cases())
def test_margins_have_the_derivative_that_their_planes_say(case: Case) -> None:
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
def test_determinant_identity_holds_against_lu(case: Case) -> None:
    design, size = case.design, case.size
    assume(shortest_length(case) > 1e-3 * size)
    joints = inverse(design, case.position, case.rotation)
    margin = margins(case.position, case.rotation)
    claimed = float(determinant(design, joints, margin))
    # Divided by the size, so that LU meets numbers near one.
    lengths = np.array([1.0, 1.0, 1.0, size, size, size])
    found = float(np.linalg.det(jacobian(design, case.position, case.rotation) / lengths))
    error = 1000.0 * EPSILON * (size / shortest_length(case))
    assert_allclose(claimed / size**3, found, rtol=1e-9, atol=error)


@given(ordinary_cases())
def test_determinant_times_lengths_is_the_product_of_margins(case: Case) -> None:
    design = case.design
    joints = inverse(design, case.position, case.rotation)
    assume(shortest_length(case) > 0.01 * case.size)
    left = np.linalg.det(jacobian(design, case.position, case.rotation)) * math.prod(
        joints[[0, 2, 4, 5]].tolist()
    )
    margin = margins(case.position, case.rotation)
    right = design.b1[1] * design.a3[1] * (design.b3 - design.b2) ** 2 * math.prod(margin.tolist())
    assert_allclose(left, -right, rtol=1e-8, atol=1e-11 * case.size**7)


@pytest.mark.parametrize("way", WAYS)
def test_jacobian_is_singular_where_margins_vanish(way: tuple[int, ...]) -> None:
    @given(singular_cases(way, ordinary_designs()))
    def law(case: Case) -> None:
        margin = margins(case.position, case.rotation)
        for index in way:
            assert abs(margin[index - 1]) <= 4.0 * EPSILON * case.size
        matrix = jacobian(case.design, case.position, case.rotation)
        assert inverse_condition(matrix, case.design.reach) < 1e-13
        joints = inverse(case.design, case.position, case.rotation)
        shortest = shortest_length(case)
        if shortest > 0.01 * case.size:
            assert abs(float(determinant(case.design, joints, margin))) < 1e-11 * case.size**3

    law()


@given(ordinary_cases())
def test_jacobian_is_regular_where_no_margin_vanishes(case: Case) -> None:
    margin = np.abs(margins(case.position, case.rotation))
    assume(margin.min() > 1e-2 * case.size)
    joints = inverse(case.design, case.position, case.rotation)
    matrix = jacobian(case.design, case.position, case.rotation)
    assert inverse_condition(matrix, case.design.reach) > 1e-9
    assert float(determinant(case.design, joints, margin)) != 0.0


def test_determinant_is_exactly_zero_where_a_margin_is() -> None:
    design = PRESETS["paper-optimal"]
    rotation = rotation_from_quaternion([0.8, 0.3, -0.2, 0.5])
    joints = inverse(design, [3.0, 4.0, 0.0], rotation)
    assert determinant(design, joints, margins([3.0, 4.0, 0.0], rotation)) == 0.0
    assert determinant(design, joints, np.array([0.0, 1.0, 1.0])) == 0.0
    assert determinant(design, joints, np.array([1.0, 1.0, 1.0])) != 0.0


@given(ordinary_designs(), rotations())
def test_every_position_at_the_identity_orientation_is_singular(
    design: Design, rotation: FloatArray
) -> None:
    position = rotation @ np.array([3.0, -5.0, 7.0])
    assert margins(position, np.eye(3))[1] == 0.0
    assert inverse_condition(jacobian(design, position, np.eye(3)), design.reach) < 1e-13


@given(all_cases())
def test_volumes_are_those_of_the_four_points(case: Case) -> None:
    points = attachment_points(case.design, case.position, case.rotation)._asdict()
    claimed = tetrahedron_volumes(case.design, margins(case.position, case.rotation))
    size = max(case.size, case.design.a2x)
    for names, volume in zip(TETRAHEDRA, claimed.tolist(), strict=True):
        a, b, c, d = (points[name] for name in names)
        assert_allclose(volume, tetrahedron_volume(a, b, c, d), rtol=1e-9, atol=1e-13 * size**3)


@given(ordinary_cases())
def test_margins_are_the_incidence_distances(case: Case) -> None:
    u = case.rotation[:, 0]
    sine = math.hypot(u[1], u[2])
    assume(sine > 1e-3)
    margin = np.abs(margins(case.position, case.rotation))
    # δ2 is the distance of the lines times the sine between them.
    expected = np.array(distances(case)) * np.array([1.0, sine, 1.0])
    assert_allclose(margin, expected, rtol=1e-8, atol=1e-10 * case.size)


@given(singular_cases(among=ordinary_designs()))
def test_a_vanishing_margin_is_an_incidence(case: Case) -> None:
    u = case.rotation[:, 0]
    sine = math.hypot(u[1], u[2])
    found = np.array(distances(case)) * np.array([1.0, sine, 1.0])
    vanishing = np.abs(margins(case.position, case.rotation)) <= 1e-13 * case.size
    assert vanishing.any()
    assert (found[vanishing] <= 1e-11 * case.size).all()


@given(ordinary_cases(), st.sampled_from([1e-20, 1e-6, 1e-3, 1e3, 1e6, 1e20]))
def test_inverse_condition_is_unchanged_by_scaling_and_lies_in_the_unit_interval(
    case: Case, scale: float
) -> None:
    larger = case.design.with_variables([v * scale for v in case.design.variables])
    one = inverse_condition(jacobian(case.design, case.position, case.rotation), case.design.reach)
    other = inverse_condition(jacobian(larger, case.position * scale, case.rotation), larger.reach)
    assert 0.0 <= one <= 1.0
    assert_allclose(other, one, rtol=1e-9, atol=1e-14)


@given(all_cases())
def test_inverse_condition_lies_in_the_unit_interval_everywhere(case: Case) -> None:
    matrix = jacobian(case.design, case.position, case.rotation)
    assert 0.0 <= float(inverse_condition(matrix, case.design.reach)) <= 1.0


@given(collapsed_cases())
def test_zero_length_legs_give_no_nan(case: Case) -> None:
    matrix = jacobian(case.design, case.position, case.rotation)
    joints = inverse(case.design, case.position, case.rotation)
    margin = margins(case.position, case.rotation)
    assert np.isfinite(matrix).all()
    assert np.isfinite(determinant(case.design, joints, margin))
    assert np.isfinite(inverse_condition(matrix, case.design.reach))
    assert np.isfinite(tetrahedron_volumes(case.design, margin)).all()


@pytest.mark.parametrize(
    ("position", "row"),
    [([-4.0, 1.0, 0.0], 0), ([-3.0, 0.0, 0.0], 2), ([-1.5, 0.0, 0.0], 4), ([10.0, 4.0, 0.0], 5)],
)
def test_the_row_of_a_leg_of_exactly_no_length_is_zero(position: list[float], row: int) -> None:
    design = PRESETS["paper-initial"]
    joints = inverse(design, position, np.eye(3))
    assert joints[row] == 0.0
    matrix = jacobian(design, position, np.eye(3))
    assert_array_equal(matrix[row], 0.0)
    assert inverse_condition(matrix, design.reach) == 0.0
    assert determinant(design, joints, margins(position, np.eye(3))) == 0.0


@given(st.integers(0, 2**32 - 1))
def test_batches_equal_single_calls(seed: int) -> None:
    rng = np.random.default_rng(seed)
    design = PRESETS["paper-optimal"]
    p = rng.uniform(-10.0, 10.0, (2, 1, 3))
    r = rotation_from_quaternion(rng.normal(size=(3, 4)))
    margin, matrix = margins(p, r), jacobian(design, p, r)
    found = determinant(design, inverse(design, p, r), margin)
    condition = inverse_condition(matrix, design.reach)
    assert margin.shape == (2, 3, 3)
    assert matrix.shape == (2, 3, 6, 6)
    for i, j in np.ndindex(2, 3):
        one = jacobian(design, p[i, 0], r[j])
        assert_allclose(margin[i, j], margins(p[i, 0], r[j]), rtol=1e-13, atol=1e-13)
        assert_allclose(matrix[i, j], one, rtol=1e-13, atol=1e-13)
        assert_allclose(condition[i, j], inverse_condition(one, design.reach), rtol=1e-9)
        assert_allclose(found[i, j], np.linalg.det(one), rtol=1e-7, atol=1e-10)


def test_empty_batches_give_empty_results() -> None:
    p, r = np.empty((0, 3)), np.empty((0, 3, 3))
    design = PRESETS["paper-initial"]
    assert margins(p, r).shape == (0, 3)
    assert jacobian(design, p, r).shape == (0, 6, 6)
    assert inverse_condition(jacobian(design, p, r), 1.0).shape == (0,)


def test_modes_signs_and_names_agree() -> None:
    for mode in range(8):
        signs = signs_of(mode)
        assert int(mode_of(np.array(signs, dtype=np.float64))) == mode
        assert mode_name(mode) == " ".join("+" if sign > 0 else "−" for sign in signs)
    assert signs_of(0b100) == (1, -1, -1)
    assert signs_of(0b010) == (-1, 1, -1)
    assert signs_of(0b001) == (-1, -1, 1)


def test_there_is_one_incidence_and_one_tetrahedron_per_margin() -> None:
    assert len(INCIDENCES) == len(TETRAHEDRA) == 3


def test_unusable_poses_are_refused() -> None:
    with pytest.raises(InputError):
        margins([0.0, math.nan, 0.0], np.eye(3))
    with pytest.raises(InputError):
        jacobian(PRESETS["paper-initial"], [0.0, 0.0, 0.0], np.ones((3, 3)))


@given(all_cases())
def test_snapshot_equals_its_parts(case: Case) -> None:
    pose = Pose.of(case.position, case.rotation)
    seen = evaluate(case.design, pose)
    p, r = np.array(pose.position), pose.rotation
    joints, margin = inverse(case.design, p, r), margins(p, r)
    assert_array_equal(seen.joints, joints)
    assert_array_equal(seen.margins, margin)
    assert seen.mode == int(mode_of(margin))
    assert seen.signs == signs_of(seen.mode)
    assert seen.proximity == np.abs(margin).min() / case.design.reach
    assert seen.determinant == float(determinant(case.design, joints, margin))
    assert seen.stratum_dimension in range(7)
    assert seen.modes.feasible
    assert len(seen.intervals) == 6
    assert_array_equal(seen.volumes, tetrahedron_volumes(case.design, margin))


def test_volumes_grow_with_where_a2_is_drawn_and_nothing_else_does() -> None:
    design = PRESETS["paper-initial"]
    limits = msgspec.structs.replace(design.limits, guide=(0.0, 2.0 * design.a2x))
    longer = msgspec.structs.replace(design, limits=limits)
    margin = margins([1.0, 2.0, 3.0], rotation_from_quaternion([0.8, 0.3, -0.2, 0.5]))
    ratio = tetrahedron_volumes(longer, margin) / tetrahedron_volumes(design, margin)
    assert_allclose(ratio, [1.0, 2.0, 2.0])
