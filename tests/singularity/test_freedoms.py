"""Freedoms of singular poses, motions that change one margin, gaps and least turns."""

from __future__ import annotations

import math

import numpy as np
import pytest
from hypothesis import assume, given, strategies as st
from incidence import distance_of_lines
from numpy.testing import assert_allclose
from scipy.spatial.transform import Rotation
from strategies import EPSILON, Case, all_cases, ordinary_cases

from explorer import PRESETS, Configuration, Pose, inverse, margins
from explorer.mechanism.design import LENGTH_ROWS
from explorer.mechanism.kinematics import jacobian_factors
from explorer.mechanism.margins import ROUNDING
from explorer.numerics.arrays import FloatArray
from explorer.singularity.freedoms import (
    UNCOUPLED,
    FlagGaps,
    Freedoms,
    FreeTurn,
    flag_gaps,
    freedoms,
    least_turns,
)
from explorer.singularity.nearest_stratum import nearest_in_stratum
from explorer.singularity.strata import GENERIC, STRATA, conditions, incidences

DESIGN = PRESETS["paper-optimal"]
SINGULAR = [w for w in STRATA if w != GENERIC]
# Essential conditions of the strata: a1 on the line b2b3, b4 on the guide, lines that coincide.
A1_ON_LINE, B4_ON_GUIDE, SAME_LINE = (1, 2, 1), (2, 1, 1), (2, 2, 2)


def poses_in(stratum: tuple[int, ...], count: int = 4) -> list[Pose]:
    rng = np.random.default_rng(5)
    starts = (
        Pose.of_yaw_pitch_roll(rng.uniform(-8.0, 15.0, 3), rng.uniform(-80.0, 80.0, 3))
        for _ in range(count)
    )
    return [nearest_in_stratum(DESIGN, start, stratum).pose for start in starts]


def joint_change(turn: FreeTurn, pose: Pose, angle: float) -> FloatArray:
    after = turn.move(pose, angle)
    return inverse(DESIGN, after.position, after.rotation) - inverse(
        DESIGN, pose.position, pose.rotation
    )


@pytest.mark.parametrize("stratum", SINGULAR)
def test_turn_changes_joints_by_the_square_of_its_angle_or_not_at_all(
    stratum: tuple[int, ...],
) -> None:
    for pose in poses_in(stratum):
        found = freedoms(Configuration.at(DESIGN, pose))
        assert 1 <= len(found.turns) <= found.count
        for turn in found.turns:
            assert turn.incidence in incidences(stratum)
            whole, half = (np.abs(joint_change(turn, pose, a)).max() for a in (2e-3, 1e-3))
            if turn.is_finite:
                for angle in (0.1, 1.0, -2.5):
                    assert np.abs(joint_change(turn, pose, angle)).max() < 1e-9 * DESIGN.reach
            else:
                assert whole == pytest.approx(4.0 * half, rel=1e-2)
                # A joint that changes at first order would change by some 1e-4 of the reach.
                assert whole < 1e-5 * DESIGN.reach


@pytest.mark.parametrize(
    ("stratum", "line"),
    [((3, 4, 2, 1), "b2b3"), ((4, 2, 3, 1), "a1b4"), ((4, 3, 1, 2), "guide")],
)
def test_one_incidence_leaves_one_turn_about_its_own_line_through_its_points(
    stratum: tuple[int, ...], line: str
) -> None:
    for pose in poses_in(stratum):
        found = freedoms(Configuration.at(DESIGN, pose))
        (turn,) = found.turns
        assert found.count == 1
        assert turn.line_name.endswith(line)
        assert not turn.is_finite
        on_line = {
            "b2b3": np.array(pose.position) + DESIGN.b3 * pose.rotation[:, 0],
            "a1b4": np.array(pose.position),
            "guide": np.array([1.0, 0.0, 0.0]),
        }[line]
        for point in (np.array(pose.position) if line == "b2b3" else np.zeros(3), on_line):
            assert_allclose(np.cross(point - turn.point, turn.direction), 0.0, atol=1e-9)
        # The fold that was flat is the only one that it changes.
        after = turn.move(pose, 0.1)
        change = margins(after.position, after.rotation) - margins(pose.position, pose.rotation)
        assert np.flatnonzero(np.abs(change) > 1e-9).tolist() == [turn.incidence - 1]


@pytest.mark.parametrize("stratum", [w for w in SINGULAR if SAME_LINE not in conditions(w)])
def test_freedoms_are_as_many_as_finite_differences_of_the_joints_lose_in_rank(
    stratum: tuple[int, ...],
) -> None:
    step = 1e-5
    for pose in poses_in(stratum, 2):
        p, r = np.array(pose.position), pose.rotation
        columns: list[FloatArray] = []
        for axis in np.eye(3):
            shifts = [inverse(DESIGN, p + s * step * DESIGN.reach * axis, r) for s in (1.0, -1.0)]
            turned = [pose.turn(p, s * step * axis) for s in (1.0, -1.0)]
            turns = [inverse(DESIGN, each.position, each.rotation) for each in turned]
            columns += [
                (one - other) / (2.0 * step * DESIGN.reach) for one, other in (shifts, turns)
            ]
        rank = np.linalg.matrix_rank(np.array(columns), 1e-6)
        assert freedoms(Configuration.at(DESIGN, pose)).count == 6 - rank


def test_turn_is_finite_where_a_point_of_one_flag_lies_on_the_line_of_the_other() -> None:
    for stratum in SINGULAR:
        described = set(conditions(stratum))
        for pose in poses_in(stratum, 1):
            is_finite = {
                turn.incidence: turn.is_finite
                for turn in freedoms(Configuration.at(DESIGN, pose)).turns
            }
            if described == {A1_ON_LINE}:
                assert is_finite == {1: True}
            elif described == {B4_ON_GUIDE}:
                assert is_finite == {3: True}
            elif SAME_LINE in described:
                assert is_finite == {1: True}


@pytest.mark.parametrize(
    ("end", "held"),
    [
        ((*DESIGN.b1, 0.0), (0.0, 0.0, 0.0)),
        ((DESIGN.b2, 0.0, 0.0), (7.0, 0.0, 0.0)),
        ((0.0, 0.0, 0.0), (*DESIGN.a3, 0.0)),
    ],
)
def test_leg_without_length_holds_its_end_and_leaves_no_freedom(
    end: tuple[float, ...], held: tuple[float, ...]
) -> None:
    rotation = Pose.of_yaw_pitch_roll((0.0, 0.0, 0.0), (40.0, 30.0, 20.0)).rotation
    pose = Pose.of(np.array(held) - rotation @ np.array(end), rotation)
    assert np.abs(inverse(DESIGN, pose.position, pose.rotation)).min() < 1e-12
    assert freedoms(Configuration.at(DESIGN, pose)) == Freedoms(0, ())


@given(all_cases())
def test_any_pose_has_freedoms_only_if_it_is_singular_and_turns_about_unit_vectors(
    case: Case,
) -> None:
    found = freedoms(case.at)
    assert len(found.turns) <= found.count <= 6
    if case.regularity > 1e-6:
        assert found.count == 0
    for turn in found.turns:
        assert np.linalg.norm(turn.direction) == pytest.approx(1.0)
        assert np.isfinite(turn.point).all()


START = Pose((3.0, 4.0, 5.0), (0.8, 0.3, -0.4, 0.2))


def margins_of(pose: Pose) -> FloatArray:
    return margins(pose.position, pose.rotation)


def test_motions_change_one_margin_each_and_two_share_it() -> None:
    assert len({motion.name for motion in UNCOUPLED}) == 6
    for motion, index in zip(UNCOUPLED, (0, 1, 2, 0, 1, 2), strict=True):
        change = margins_of(motion.move(START, 0.1)) - margins_of(START)
        assert np.flatnonzero(np.abs(change) > 1e-3).tolist() == [index] == [motion.incidence - 1]


@given(ordinary_cases(), st.floats(-3.0, 3.0))
def test_motions_change_no_other_margin_and_move_along_or_about_their_lines(
    case: Case, amount: float
) -> None:
    pose, size = case.pose, case.size
    for motion in UNCOUPLED:
        after = motion.move(pose, amount)
        point, direction = motion.line(pose)
        turn = after.rotation @ pose.rotation.T
        shift = np.array(after.position) - turn @ np.array(pose.position)
        if motion.kind == "translation":
            assert_allclose(turn, np.eye(3), atol=1e-14)
            assert_allclose(shift, amount * direction, atol=1e-13 * size)
        else:
            assert_allclose(turn, Rotation.from_rotvec(amount * direction).as_matrix(), atol=1e-14)
            assert_allclose(turn @ point + shift, point, atol=1e-13 * size)
        others = np.arange(3) != motion.incidence - 1
        assert_allclose(margins_of(after)[others], case.margins[others], atol=1e-13 * size)
        assert_allclose(margins_of(motion.move(after, -amount)), margins_of(pose), atol=1e-11)


def test_rotation_about_the_guide_changes_l4_alone() -> None:
    turned = UNCOUPLED[5].move(START, 0.7)
    before, after = (inverse(DESIGN, each.position, each.rotation) for each in (START, turned))
    assert_allclose(after[:5], before[:5], atol=1e-12)
    assert abs(after[5] - before[5]) > 0.1


def random_poses(count: int) -> tuple[FloatArray, FloatArray]:
    rng = np.random.default_rng(4)
    return rng.uniform(-10.0, 10.0, (count, 3)), Rotation.random(count, random_state=4).as_matrix()


def turned(
    p: FloatArray, r: FloatArray, vector: FloatArray, *, about_a1: bool
) -> tuple[FloatArray, FloatArray]:
    turn = Rotation.from_rotvec(vector).as_matrix()
    return (np.einsum("nij,nj->ni", turn, p) if about_a1 else p), turn @ r


@pytest.mark.parametrize("about_a1", [False, True])
def test_no_shorter_turn_about_b4_or_a1_changes_a_sign(*, about_a1: bool) -> None:
    p, r = random_poses(3000)
    rng = np.random.default_rng(1)
    axes = rng.normal(size=p.shape)
    axes /= np.linalg.norm(axes, axis=1, keepdims=True)
    signs = np.sign(margins(p, r))
    for index, angle in enumerate(least_turns(p, r).T):
        q, s = turned(p, r, 0.999 * angle[:, None] * axes, about_a1=about_a1)
        assert (np.sign(margins(q, s))[:, index] == signs[:, index]).all()


def test_a_turn_of_that_size_reaches_the_incidence() -> None:
    p, r = random_poses(300)
    x, z = np.broadcast_to([1.0, 0.0, 0.0], p.shape), np.broadcast_to([0.0, 0.0, 1.0], p.shape)
    turns = least_turns(p, r)
    # About b4 or a1, an axis along both the moved line or normal and what it must turn to.
    ways = {
        0: [(np.cross(r[:, :, 2], p), False)],
        1: [
            (np.cross(r[:, :, 0], np.cross(p, x)), False),
            (np.cross(x, np.cross(r[:, :, 0], p)), True),
        ],
        2: [(np.cross(z, p), True)],
    }
    for index, axes in ways.items():
        best = np.full(len(p), math.inf)
        for axis, about_a1 in axes:
            unit = axis / np.linalg.norm(axis, axis=1, keepdims=True)
            for sign in (1.0, -1.0):
                vector = sign * turns[:, index, None] * unit
                q, s = turned(p, r, vector, about_a1=about_a1)
                best = np.minimum(best, np.abs(margins(q, s))[:, index])
        assert best.max() < 1e-12


@given(all_cases())
def test_turns_do_not_depend_on_the_unit_and_no_uncoupled_rotation_is_shorter(case: Case) -> None:
    turns = least_turns(case.position, case.rotation)
    assert ((turns >= 0.0) & (turns <= 0.5 * math.pi)).all()
    smaller = case.scaled(0.1)
    np.testing.assert_allclose(least_turns(smaller.position, smaller.rotation), turns, atol=1e-7)
    for motion in UNCOUPLED:
        if motion.kind == "rotation":
            # Its margin is δ cos θ + δ' sin θ, with δ' that after a quarter turn.
            index, quarter = motion.incidence - 1, motion.move(case.pose, 0.5 * math.pi)
            zero_at = math.atan2(abs(case.margins[index]), abs(margins_of(quarter)[index]))
            assert turns[index] <= zero_at + 1e-6


@given(all_cases())
def test_product_of_the_jacobian_factors_is_that_of_the_singular_values(case: Case) -> None:
    # The direction of a leg whose length is rounding is arbitrary.
    assume(case.joints[LENGTH_ROWS].min() > 1e-9 * case.size)
    values = case.at.singular_values
    # Rounding of the determinant is that of its largest terms.
    size = float(np.prod(values[:5])) * values[0]
    product = np.prod(jacobian_factors(case.design, case.joints, case.margins))
    # Products of the smallest numbers underflow.
    assert abs(np.prod(values) - product) <= 1e-9 * size + 1e-150


def sine_of(case: Case) -> float:
    return math.hypot(case.rotation[1, 0], case.rotation[2, 0])


def misses(case: Case, gaps: FlagGaps) -> FloatArray:
    """Return how far each end is from its element, shape (3, 2), as computed from the axes."""
    local = (gaps.platform - case.position) @ case.rotation
    return np.array(
        [
            [math.hypot(*gaps.base[0]), abs(local[0, 2])],
            [math.hypot(*gaps.base[1, 1:]), math.hypot(*local[1, 1:])],
            [abs(gaps.base[2, 2]), math.hypot(*local[2])],
        ],
        dtype=np.float64,
    )


@given(all_cases())
def test_gaps_end_on_the_flags_and_have_the_lengths_of_the_margins(case: Case) -> None:
    gaps = flag_gaps(case.position, case.rotation)
    # Where lines are nearly parallel, rounding moves their closest points along them.
    sizes = case.size * np.array([1.0, 1.0 / max(sine_of(case), 1e-14), 1.0])
    if sine_of(case) <= ROUNDING:
        sizes[1] = case.size
    assert (misses(case, gaps) <= 32.0 * EPSILON * sizes[:, None]).all()
    spans = np.linalg.norm(gaps.platform - gaps.base, axis=1)
    assert_allclose(spans, gaps.lengths, rtol=1e-12, atol=32.0 * EPSILON * case.size)
    first, second, third = gaps.lengths
    delta1, delta2, delta3 = np.abs(case.margins).tolist()
    assert_allclose((first, third), (delta1, delta3), rtol=1e-12, atol=8.0 * EPSILON * case.size)
    assert_allclose(second * sine_of(case), delta2, rtol=1e-9, atol=1e-13 * case.size)
    # The gap of an incidence is closed.
    holding = np.abs(case.margins) <= 8.0 * EPSILON * case.size
    for index in np.flatnonzero(holding):
        assert gaps.lengths[index] <= 1e-13 * case.size or (index == 1 and sine_of(case) < 0.1)


@pytest.mark.parametrize("angle", [0.0, math.pi])
def test_parallel_lines_have_the_gap_through_b4(angle: float) -> None:
    c, s = math.cos(angle), math.sin(angle)
    # Of a turn about z by half a turn, sin π is a rounding error.
    rotation = np.array([[c, -s, 0.0], [s, c, 0.0], [0.0, 0.0, 1.0]])
    position = np.array([7.0, 3.0, 4.0])
    gaps = flag_gaps(position, rotation)
    assert gaps.lengths[1] == 5.0
    assert gaps.base[1].tolist() == [7.0, 0.0, 0.0]
    assert gaps.platform[1].tolist() == position.tolist()
    points = Configuration(PRESETS["paper-optimal"], position, rotation).points
    lines = (points.a1, points.a2), (points.b2, points.b3)
    assert distance_of_lines(*lines) == pytest.approx(5.0)
