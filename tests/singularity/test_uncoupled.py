"""The six motions that change one margin each: rates and travel."""

from __future__ import annotations

import math

import numpy as np
import pytest
from hypothesis import example, given, strategies as st
from numpy.testing import assert_allclose
from scipy.spatial.transform import Rotation
from strategies import Case, all_cases, ordinary_cases

from explorer import PRESETS, InputError, Pose, forward, home_pose, inverse, margins
from explorer.numerics.arrays import FloatArray
from explorer.singularity.uncoupled import UNCOUPLED, Travel, UncoupledMotion, travels

HOME = home_pose(PRESETS["paper-optimal"])
each_motion = pytest.mark.parametrize("motion", UNCOUPLED, ids=lambda motion: motion.name)


def pose_of(case: Case) -> Pose:
    return Pose.of(case.position, case.rotation)


def margins_of(pose: Pose) -> FloatArray:
    return margins(pose.position, pose.rotation)


def test_there_are_two_motions_for_each_margin() -> None:
    assert [motion.incidence for motion in UNCOUPLED] == [1, 2, 3, 1, 2, 3]
    assert len({motion.name for motion in UNCOUPLED}) == 6


@each_motion
def test_a_motion_moves_its_margin_and_no_other(motion: UncoupledMotion) -> None:
    @given(ordinary_cases(), st.floats(-3.0, 3.0))
    def law(case: Case, amount: float) -> None:
        pose = pose_of(case)
        length = case.size if motion.kind == "translation" else 1.0
        before, after = margins_of(pose), margins_of(motion.moved(pose, amount * length))
        others = np.arange(3) != motion.incidence - 1
        assert_allclose(after[others], before[others], atol=1e-13 * case.size)

    law()


@each_motion
def test_motion_of_a_generic_pose_changes_its_margin(motion: UncoupledMotion) -> None:
    pose = Pose((3.0, 4.0, 5.0), (0.8, 0.3, -0.4, 0.2))
    change = margins_of(motion.moved(pose, 0.1)) - margins_of(pose)
    assert abs(change[motion.incidence - 1]) > 1e-3


@each_motion
def test_a_motion_is_one_about_or_along_its_line(motion: UncoupledMotion) -> None:
    @given(ordinary_cases(), st.floats(-3.0, 3.0))
    def law(case: Case, amount: float) -> None:
        pose = pose_of(case)
        moved = motion.moved(pose, amount)
        point, direction = motion.line(pose)
        step = moved.rotation @ pose.rotation.T
        shift = np.array(moved.position) - step @ np.array(pose.position)
        if motion.kind == "translation":
            assert_allclose(step, np.eye(3), atol=1e-14)
            assert_allclose(shift, amount * direction, atol=1e-13 * case.size)
        else:
            assert_allclose(step, Rotation.from_rotvec(amount * direction).as_matrix(), atol=1e-14)
            assert_allclose(step @ point + shift, point, atol=1e-13 * case.size)
        assert_allclose(margins_of(motion.moved(moved, -amount)), margins_of(pose), atol=1e-11)

    law()


@each_motion
def test_the_rate_is_the_derivative_of_the_margin(motion: UncoupledMotion) -> None:
    @given(ordinary_cases())
    def law(case: Case) -> None:
        pose = pose_of(case)
        ahead, behind = (margins_of(motion.moved(pose, s)) for s in (1e-5, -1e-5))
        difference = (ahead - behind)[motion.incidence - 1] / 2e-5
        assert motion.rate(pose) == pytest.approx(float(difference), abs=1e-7 * case.size)

    law()


@each_motion
def test_travel_ends_on_the_singular_set_and_not_before(motion: UncoupledMotion) -> None:
    index = motion.incidence - 1

    @given(all_cases())
    def law(case: Case) -> None:
        pose = pose_of(case)
        before = float(margins_of(pose)[index])
        travel = motion.travel(pose)
        assert travel.low <= 0.0 <= travel.high
        for end in (travel.low, travel.high):
            # Beyond a thousand times the size rounding of the way itself shows.
            if abs(end) > (1e3 * case.size if motion.kind == "translation" else 4.0):
                continue
            span = case.size + (abs(end) if motion.kind == "translation" else 0.0)
            assert abs(margins_of(motion.moved(pose, end))[index]) <= 1e-14 * span
            for share in (0.1, 0.5, 0.9):
                between = float(margins_of(motion.moved(pose, share * end))[index])
                if abs(before) > 1e-9 * case.size:
                    assert between * before > 0.0

    law()


@given(all_cases())
@example(Case(PRESETS["paper-optimal"], np.array([1.0, 0.0, 0.0]), np.eye(3)))
def test_rotations_reach_the_singular_set_within_half_a_turn(case: Case) -> None:
    pose = pose_of(case)
    for motion in UNCOUPLED:
        travel = motion.travel(pose)
        assert travel.low <= 0.0 <= travel.high
        if motion.kind == "rotation" and travel != Travel(0.0, 0.0):
            assert travel.high - travel.low == pytest.approx(math.pi, abs=1e-15)


@given(all_cases())
def test_all_travels_at_once_are_the_travels_of_each(case: Case) -> None:
    pose = pose_of(case)
    assert travels(pose) == tuple(motion.travel(pose) for motion in UNCOUPLED)


def test_a_level_platform_never_reaches_the_base_along_its_line() -> None:
    found = {motion.name: motion.travel(HOME) for motion in UNCOUPLED}
    assert found["along the platform's x"] == Travel(-math.inf, math.inf)
    assert found["along the base's x"] == Travel(-math.inf, math.inf)
    assert math.isfinite(found["about the platform's z"].high)


def test_travel_of_a_level_platform_in_another_mode_is_never_in_spite_of_rounding() -> None:
    """The modes are computed, so that a level platform is level but for rounding."""
    design = PRESETS["paper-optimal"]
    start = Pose.of_yaw_pitch_roll((14.0, -2.0, 6.0), (-40.0, 0.0, 0.0))
    position, rotation, _ = forward(design, inverse(design, start.position, start.rotation))
    found = [
        motion.travel(Pose.of(position[mode], rotation[mode]))
        for mode in range(8)
        for motion in UNCOUPLED
        if motion.kind == "translation"
    ]
    never = Travel(-math.inf, math.inf)
    assert never in found
    for travel in found:
        ends = [end for end in (travel.low, travel.high) if math.isfinite(end)]
        assert travel == never or max(map(abs, ends)) < 1e6 * design.reach


def test_travel_on_the_singular_set_is_zero() -> None:
    pose = Pose((3.0, 4.0, 0.0), HOME.quaternion)
    for motion in UNCOUPLED:
        if motion.incidence == 3:
            assert motion.travel(pose) == Travel(0.0, 0.0)


def test_motions_on_the_bases_axes_keep_what_the_fixed_flag_sees() -> None:
    """About the base's x neither l1 changes nor what the legs on the guide measure."""
    pose = Pose((3.0, 4.0, 5.0), (0.8, 0.3, -0.4, 0.2))
    turned = next(m for m in UNCOUPLED if m.name == "about the base's x").moved(pose, 0.7)
    before, after = (
        inverse(PRESETS["paper-optimal"], each.position, each.rotation) for each in (pose, turned)
    )
    assert_allclose(after[:5], before[:5], atol=1e-12)
    assert abs(after[5] - before[5]) > 0.1


@pytest.mark.parametrize("amount", [math.nan, math.inf])
def test_motion_by_an_infinite_amount_is_refused(amount: float) -> None:
    with pytest.raises(InputError, match="finite amount"):
        UNCOUPLED[0].moved(HOME, amount)
