"""Inverse and forward kinematics: round trips, the eight modes, an independent solution."""

from __future__ import annotations

import itertools
import math
from collections.abc import Iterator
from typing import Any

import numpy as np
import pytest
from hypothesis import assume, given, strategies as st
from numpy.testing import assert_allclose, assert_array_equal
from reference import read_reference
from refusals import refusal
from strategies import (
    EPSILON,
    QUARTER_TURNS,
    Case,
    all_cases,
    amplification,
    cases,
    isolation,
    ordinary_cases,
    ordinary_designs,
    span_amplification,
)

from explorer import PRESETS, Design, forward, inverse, margins, rotation_from_quaternion, stratum
from explorer.mechanism.kinematics import (
    ForwardKinematics,
    determinant,
    discriminants,
    joint_array,
    solve_rows,
)
from explorer.mechanism.margins import mode_of, signs_of
from explorer.numerics.arrays import FloatArray
from explorer.singularity.strata import inversions

REFERENCE: list[dict[str, Any]] = read_reference("kinematics")["cases"]

# Largest number of roundings of some fifty operations, over many thousands of cases.
ROUNDINGS = 100.0


def squared_margin_error(case: Case) -> float:
    """Return the tolerance of the difference between a discriminant and the squared margin."""
    return ROUNDINGS * EPSILON * amplification(case) * case.size**2


def clipping(case: Case) -> float:
    """Return the factor by which errors of the modes grow near two incidences, at least one.

    A margin that is a square root of rounding has half the digits. One such margin does not
    affect the joints, which are stationary in it, but two at once do.
    """
    return 1.0 / max(math.sqrt(EPSILON), isolation(case))


def closing_error(case: Case) -> float:
    """Return the tolerance of the joints of a mode."""
    return ROUNDINGS * EPSILON * span_amplification(case) * case.size * clipping(case)


def random_rows(design: Design, count: int, seed: int) -> FloatArray:
    """Return joints (count, 6), alternately those of a pose and some of which few close."""
    rng = np.random.default_rng(seed)
    size = max(map(abs, design.variables))
    joints = rng.uniform(0.0, 2.0, (count, 6)) * size
    joints[:, 3] = joints[:, 1] + rng.uniform(-1.2, 1.2, count) * (design.b3 - design.b2)
    positions = rng.uniform(-2.0, 2.0, (count, 3)) * size
    rotations = rotation_from_quaternion(rng.normal(size=(count, 4)))
    joints[::2] = inverse(design, positions, rotations)[::2]
    return joints


@pytest.fixture(scope="module")
def compiled() -> None:
    """Compile the kernel, so that each of thousands of small calls is quick."""
    solve_rows.compile()


def test_reference_cases_have_their_joints_modes_margins_determinant_and_stratum(
    compiled: None,
) -> None:
    assert len(REFERENCE) == 200
    assert {int(mode_of(np.array(case["margins"]))) for case in REFERENCE} == set(range(8))
    for case in REFERENCE:
        design = Design(**case["design"])
        position, rotation = np.array(case["position"]), np.array(case["rotation"])
        size = max(*map(abs, design.variables), float(np.abs(position).max()))
        joints, margin = inverse(design, position, rotation), margins(position, rotation)
        assert_allclose(joints, case["joints"], rtol=1e-12, atol=1e-12 * size)
        assert_allclose(margin, case["margins"], rtol=1e-11, atol=1e-11 * size)
        product = determinant(design, joints, margin)
        assert_allclose(product, case["jacobian_determinant"], rtol=1e-10)
        flags = tuple(stratum(position, rotation).tolist())
        assert flags == tuple(case["stratum"])
        assert inversions(flags) == case["stratum_dimension"]
        solved = forward(design, case["joints"])
        assert solved.feasible
        modes = {int(mode_of(np.array(mode["margins"]))): mode for mode in case["assembly_modes"]}
        assert {*modes} == {*range(8)}
        for k, mode in modes.items():
            assert_allclose(solved.position[k], mode["position"], rtol=0, atol=1e-9 * size)
            assert_allclose(solved.rotation[k], mode["rotation"], rtol=0, atol=1e-9)


@given(cases())
def test_forward_of_inverse_is_the_pose_in_the_mode_of_its_sign_triple(case: Case) -> None:
    assume(case.regularity > 0.0)
    # How far the pose moves and turns for a rounding of its squared margins.
    moved = squared_margin_error(case) / case.size / case.regularity
    turned = moved / case.size / case.regularity
    assume(turned < 0.01)
    if amplification(case) < 1e3 and case.regularity > 1e-2:
        moved, turned = min(moved, 1e-10 * case.size), min(turned, 1e-10)
    solved = forward(case.design, case.joints)
    mode = int(mode_of(case.margins))
    assert solved.feasible
    assert_allclose(solved.position[mode], case.position, rtol=0, atol=moved)
    assert_allclose(solved.rotation[mode], case.rotation, rtol=0, atol=turned)


def trilaterate(centres: FloatArray, radii: tuple[float, float, float], side: int) -> FloatArray:
    """Return the point at distances from three centres (3, 3), on one side of their plane."""
    edges: FloatArray = centres[1:] - centres[0]
    normal = np.cross(edges[0], edges[1])
    squares: FloatArray = np.array(radii) ** 2
    along: FloatArray = 0.5 * (squares[0] - squares[1:] + (edges**2).sum(axis=1))
    foot = np.asarray(np.linalg.solve(edges @ edges.T, along) @ edges, dtype=np.float64)
    height = math.sqrt(max(0.0, float(squares[0] - foot @ foot)))
    return centres[0] + foot + side * height * normal / float(np.linalg.norm(normal))


def modes_of_the_twin(
    design: Design, joints: FloatArray, a2x: float
) -> Iterator[tuple[FloatArray, FloatArray]]:
    """Yield the eight poses by three trilaterations of the 6-4 twin, as in the paper's Figure 1."""
    l1, d1, d2, d3, d4, l4 = joints.tolist()
    b1, b2, b3 = (*design.b1, 0.0), (design.b2, 0.0, 0.0), (design.b3, 0.0, 0.0)
    (a3x, a3y), b4 = design.a3, np.zeros(3)
    for one, two, three in itertools.product((1, -1), repeat=3):
        a1 = trilaterate(np.array([b1, b2, b3]), (l1, math.hypot(d1, d2), math.hypot(d3, d4)), one)
        to_a2 = abs(a2x), math.hypot(d1 - a2x, d2), math.hypot(d3 - a2x, d4)
        a2 = trilaterate(np.array([a1, b2, b3]), to_a2, two)
        to_a3 = l4, math.hypot(a3x, a3y), math.hypot(a3x - a2x, a3y)
        a3 = trilaterate(np.array([b4, a1, a2]), to_a3, three)
        x = (a2 - a1) / a2x
        y = (a3 - a1 - a3x * x) / a3y
        rotation = np.array([x, y, np.cross(x, y)])
        yield -rotation @ a1, rotation


@given(ordinary_cases(), st.sampled_from([7.0, 23.0, 0.9, 11.0, 13.0, -17.0]))
def test_modes_equal_those_of_the_6_4_twin_for_any_a2(case: Case, a2x: float) -> None:
    assume(case.regularity > 2e-2)
    solved, seen = forward(case.design, case.joints), set[int]()
    for position, rotation in modes_of_the_twin(case.design, case.joints, a2x):
        mode = int(mode_of(margins(position, rotation)))
        seen.add(mode)
        assert_allclose(solved.position[mode], position, rtol=0, atol=1e-7 * case.size)
        assert_allclose(solved.rotation[mode], rotation, rtol=0, atol=1e-7)
    assert seen == {*range(8)}


@given(ordinary_cases(), st.sampled_from([1e-7, 1e-3, 1e3, 1e4]))
def test_forward_in_another_unit_scales_positions_and_keeps_rotations(
    case: Case, scale: float
) -> None:
    assume(case.regularity > 1e-2)
    larger, joints = case.scaled(scale).design, case.joints
    one, other = forward(case.design, joints), forward(larger, joints * scale)
    assert other.feasible
    assert_allclose(other.position / scale, one.position, rtol=0, atol=1e-9 * case.size)
    assert_allclose(other.rotation, one.rotation, rtol=0, atol=1e-9)
    squares = discriminants(larger, joints * scale) / scale**2
    assert_allclose(squares, discriminants(case.design, joints), atol=1e-12 * case.size**2)


@given(all_cases())
def test_modes_have_the_given_joints(case: Case) -> None:
    joints = case.joints
    solved = forward(case.design, joints)
    again = inverse(case.design, solved.position, solved.rotation)
    assert solved.feasible
    # Near zero a length is a square root, so it is its square that is accurate.
    error = np.minimum(np.abs(again - joints), np.abs(again**2 - joints**2) / case.size)
    assert error.max() <= closing_error(case)


@given(all_cases())
def test_mode_k_has_the_sign_triple_of_the_bits_of_k(case: Case) -> None:
    solved = forward(case.design, case.joints)
    margin = margins(solved.position, solved.rotation)
    noise = math.sqrt(squared_margin_error(case))
    for mode in range(8):
        signs = tuple(1 if mode & bit else -1 for bit in (0b100, 0b010, 0b001))
        assert signs_of(mode) == signs
        assert (margin[mode] * signs >= -noise).all()


@given(all_cases())
def test_modes_share_the_squared_margins_that_are_the_discriminants(case: Case) -> None:
    squares = discriminants(case.design, case.joints)
    error = squared_margin_error(case)
    assert_allclose(squares, case.margins**2, rtol=0, atol=error)
    solved = forward(case.design, case.joints)
    of_modes = margins(solved.position, solved.rotation) ** 2
    error *= clipping(case)
    assert_allclose(of_modes, np.broadcast_to(squares, (8, 3)), rtol=0, atol=error)


@given(ordinary_designs(), st.integers(0, 2**32 - 1))
def test_joints_close_in_all_eight_modes_or_in_none(
    compiled: None, design: Design, seed: int
) -> None:
    joints = random_rows(design, 64, seed)
    size = float(np.abs(joints).max())
    solved = forward(design, joints)
    again = inverse(design, solved.position, solved.rotation)
    misses = np.abs(again - joints[:, None, :]).max(axis=-1) / size
    clear = np.abs(discriminants(design, joints)).min(axis=-1) > 1e-6 * size**2
    assert solved.feasible[::2].all()
    assert not solved.feasible.all()
    assert (misses[solved.feasible & clear] < 1e-9).all()
    assert (misses[~solved.feasible & clear] > 1e-9).all()


@given(ordinary_cases(), st.floats(1.0, 100.0))
def test_kinematics_with_another_guide_and_a2_are_unchanged(case: Case, end: float) -> None:
    longer = case.design.with_limits(guide=(-end, 2.0 * end))
    assert longer.a2x == 2.0 * end
    joints = inverse(longer, case.position, case.rotation)
    assert_array_equal(case.joints, joints)
    for one, other in zip(forward(case.design, joints), forward(longer, joints), strict=True):
        assert_array_equal(one, other)


@pytest.mark.parametrize("shape", [(), (1,), (2, 1, 2), (3, 0)])
def test_forward_of_a_batch_equals_single_calls(compiled: None, shape: tuple[int, ...]) -> None:
    design = PRESETS["paper-optimal"]
    count = math.prod(shape)
    joints = random_rows(design, max(count, 1), 3)[:count].reshape(*shape, 6)
    solved = forward(design, joints)
    squares = discriminants(design, joints)
    assert solved.position.shape == (*shape, 8, 3)
    assert solved.rotation.shape == (*shape, 8, 3, 3)
    assert solved.feasible.shape == shape
    assert squares.shape == (*shape, 3)
    for index in np.ndindex(*shape):
        single = forward(design, joints[index])
        assert_array_equal(solved.position[index], single.position)
        assert_array_equal(solved.rotation[index], single.rotation)
        assert bool(solved.feasible[index]) == bool(single.feasible)
        assert_array_equal(squares[index], discriminants(design, joints[index]))


@given(ordinary_cases(), st.integers(0, 5))
def test_feasibility_changes_exactly_where_a_discriminant_changes_sign(
    compiled: None, case: Case, joint: int
) -> None:
    joints = case.joints
    inside, outside = float(joints[joint]), float(joints[joint]) + 10.0 * case.size

    def trial(value: float) -> FloatArray:
        return np.array([*joints[:joint], value, *joints[joint + 1 :]])

    assert forward(case.design, trial(inside)).feasible
    assert not forward(case.design, trial(outside)).feasible
    while abs(outside - inside) > 4.0 * EPSILON * case.size:
        middle = 0.5 * (inside + outside)
        if forward(case.design, trial(middle)).feasible:
            inside = middle
        else:
            outside = middle

    # Joints that close but for rounding are feasible, by a cautious bound of the rounding.
    error = 20.0 * squared_margin_error(case)
    at_change = discriminants(case.design, trial(0.5 * (inside + outside)))
    values = np.linspace(inside - 0.5 * case.size, inside + 0.5 * case.size, 41)
    values = np.abs(values) if joint in (0, 2, 4, 5) else values
    rows = np.array([trial(float(value)) for value in values])
    least = discriminants(case.design, rows).min(axis=1)
    feasible = forward(case.design, rows).feasible
    # If 1 - c² < 0 the discriminant is the smallest factor, so it is negative as well.
    assert abs(float(at_change.min())) <= error
    assert feasible[least > 0.0].all()
    assert not feasible[least < -error].any()


def check_finite_and_rigid(solved: ForwardKinematics) -> None:
    assert np.isfinite(solved.position).all()
    gram = solved.rotation @ np.swapaxes(solved.rotation, -1, -2)
    assert_allclose(gram, np.broadcast_to(np.eye(3), gram.shape), rtol=0, atol=1e-14)
    assert (np.linalg.det(solved.rotation) > 0.0).all()


@given(all_cases(), st.integers(0, 2**32 - 1))
def test_joints_that_do_not_close_give_finite_rigid_poses(
    compiled: None, case: Case, seed: int
) -> None:
    # Each joint across its limit by 1 to 2⁻⁶⁰ of the size, besides random joints.
    rng = np.random.default_rng(seed)
    joints = np.repeat(case.joints[None, :], 60, axis=0)
    shifts = rng.choice([-1.0, 1.0], 60) * case.size * 0.5 ** np.arange(60)
    joints[np.arange(60), rng.integers(0, 6, 60)] += shifts
    joints[:, [0, 2, 4, 5]] = np.abs(joints[:, [0, 2, 4, 5]])
    rows = np.vstack([joints, random_rows(case.design, 64, seed), np.zeros((1, 6))])
    solved = forward(case.design, rows)
    assert not solved.feasible.all()
    assert not solved.feasible[-1]
    check_finite_and_rigid(solved)
    assert np.isfinite(discriminants(case.design, rows)).all()


@given(st.sampled_from([*QUARTER_TURNS]), st.integers(40, 110))
def test_tilted_platforms_near_the_guide_give_rigid_poses(turn: FloatArray, exponent: int) -> None:
    design = PRESETS["paper-optimal"]
    near_guide = np.array([3.0, 3.0 * 10.0**-exponent, -4.0 * 10.0**-exponent])
    tilted = turn @ rotation_from_quaternion([0.8, 0.3, -0.2, 0.5])
    solved = forward(design, inverse(design, near_guide, tilted))
    assert solved.feasible
    check_finite_and_rigid(solved)


@pytest.mark.parametrize(
    ("joints", "words"),
    [
        ([1, 2, 3, 4, 5], "shape"),
        ([1, 2, 3, 4, 5, float("nan")], "finite"),
        ([1, 2, 3, 4, 5, float("inf")], "finite"),
        ([-1, 2, 3, 4, 5, 6], "l1 must not be negative"),
        ([1, 2, -3, 4, 5, 6], "d2 must not be negative"),
        ([1, 2, 3, 4, -5, 6], "d4 must not be negative"),
        ([1, 2, 3, 4, 5, -6], "l4 must not be negative"),
        ([1, 2, 3, 4, 5, 1e300], "must not exceed"),
        ("abcdef", "must be numbers"),
        (3.0, "shape"),
    ],
)
def test_unusable_joints_are_refused(joints: Any, words: str) -> None:
    design = PRESETS["paper-initial"]
    for function in (forward, discriminants):
        assert words in refusal(function, design, joints)
    assert joint_array([1, -2, 3, -4, 5, 6]).tolist()[1] == -2.0
