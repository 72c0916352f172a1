"""The six motions that change one margin each, and the least turns to the incidences."""

from __future__ import annotations

import math

import numpy as np
import pytest
from hypothesis import assume, given, strategies as st
from numpy.testing import assert_allclose
from scipy.spatial.transform import Rotation
from strategies import Case, all_cases, ordinary_cases

from explorer import PRESETS, Pose, inverse, margins
from explorer.mechanism.design import LENGTH_ROWS
from explorer.mechanism.kinematics import jacobian_factors
from explorer.numerics.arrays import FloatArray
from explorer.singularity.freedoms import UNCOUPLED
from explorer.singularity.gaps import least_turns

DESIGN = PRESETS["paper-optimal"]


GENERIC = Pose((3.0, 4.0, 5.0), (0.8, 0.3, -0.4, 0.2))


def margins_of(pose: Pose) -> FloatArray:
    return margins(pose.position, pose.rotation)


def test_motions_change_one_margin_each_and_two_share_it() -> None:
    assert len({motion.name for motion in UNCOUPLED}) == 6
    for motion, index in zip(UNCOUPLED, (0, 1, 2, 0, 1, 2), strict=True):
        change = margins_of(motion.move(GENERIC, 0.1)) - margins_of(GENERIC)
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
    turned = UNCOUPLED[5].move(GENERIC, 0.7)
    before, after = (inverse(DESIGN, each.position, each.rotation) for each in (GENERIC, turned))
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
