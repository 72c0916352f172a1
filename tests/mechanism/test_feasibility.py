"""Exact intervals of the joints, against dense sampling of the forward kinematics."""

from __future__ import annotations

import numpy as np
import pytest
from hypothesis import assume, given, strategies as st
from strategies import (
    Case,
    cases,
    designs,
    ordinary_cases,
    ordinary_designs,
    singular_cases,
)

from explorer import (
    JOINTS,
    PRESETS,
    Design,
    InputError,
    discriminants,
    forward,
    inverse,
    margins,
    rotation_from_yaw_pitch_roll,
)
from explorer.mechanism.design import LENGTHS
from explorer.mechanism.feasible_intervals import Interval, feasible_intervals, nearest_feasible
from explorer.numerics.arrays import BoolArray, FloatArray

joint_indices = st.integers(0, 5)
SAMPLES = 400


def with_values(joints: FloatArray, joint: int, values: FloatArray) -> FloatArray:
    """Return rows of joints of which one takes the values."""
    rows = np.repeat(joints[None, :], len(values), axis=0)
    rows[:, joint] = values
    return rows


def inside(intervals: tuple[Interval, ...], values: FloatArray, slack: float) -> BoolArray:
    """Return which values lie in an interval, with its ends moved out by the slack."""
    found = np.zeros(values.shape, dtype=np.bool_)
    for low, high in intervals:
        found |= (values >= low - slack) & (values <= high + slack)
    return found


def sampled(joint: int, joints: FloatArray, size: float) -> FloatArray:
    """Return values of a joint far beyond where it closes, with its own among them."""
    lowest = 0.0 if JOINTS[joint] in LENGTHS else -6.0 * size
    own = float(joints[joint])
    wide = np.linspace(lowest, 8.0 * size, SAMPLES)
    narrow = np.linspace(own - 0.3 * size, own + 0.3 * size, SAMPLES)
    return np.concatenate([wide, narrow[narrow >= lowest]])


@given(ordinary_cases() | singular_cases(among=ordinary_designs()), joint_indices)
def test_intervals_are_where_dense_samples_close(case: Case, joint: int) -> None:
    joints = inverse(case.design, case.position, case.rotation)
    intervals = feasible_intervals(case.design, joints)[joint]
    values = sampled(joint, joints, case.size)
    closes = forward(case.design, with_values(joints, joint, values)).feasible
    slack = 1e-6 * case.size
    # In a singular pose the interval may be the present value alone, which has no length.
    alone = np.abs(values - joints[joint]) <= slack
    assert (inside(intervals, values, slack) | alone)[closes].all()
    assert closes[inside(intervals, values, -slack)].all()


@given(designs(sizes=(10.0,), nearness=(1.0,)), st.integers(0, 2**32 - 1), joint_indices)
def test_intervals_of_joints_that_do_not_close_are_where_samples_close(
    design: Design, seed: int, joint: int
) -> None:
    rng = np.random.default_rng(seed)
    joints = rng.uniform(0.0, 20.0, 6)
    joints[3] = joints[1] + rng.uniform(-1.5, 1.5) * (design.b3 - design.b2)
    size = float(max(*np.abs(joints).tolist(), *map(abs, design.variables)))
    intervals = feasible_intervals(design, joints)[joint]
    values = sampled(joint, joints, size)
    closes = forward(design, with_values(joints, joint, values)).feasible
    slack = 1e-6 * size
    assert inside(intervals, values, slack)[closes].all()
    assert closes[inside(intervals, values, -slack)].all()


def test_random_joints_have_no_interval_some_and_several() -> None:
    design = PRESETS["paper-optimal"]
    rng = np.random.default_rng(2)
    counts: set[int] = set()
    for _ in range(60):
        joints = rng.uniform(0.0, 20.0, 6)
        joints[3] = joints[1] + rng.uniform(-1.0, 1.0) * (design.b3 - design.b2)
        counts |= {len(found) for found in feasible_intervals(design, joints)}
        pose = rng.uniform(-15.0, 15.0, 3)
        angles = rng.uniform(-180.0, 180.0, 3)
        joints = inverse(design, pose, rotation_from_yaw_pitch_roll(angles))
        counts |= {len(found) for found in feasible_intervals(design, joints)}
    assert {0, 1, 2} <= counts


@given(cases(designs(nearness=(1.0, 1e-3))))
def test_the_present_joints_lie_in_their_own_intervals(case: Case) -> None:
    margin = np.abs(margins(case.position, case.rotation))
    assume(margin.min() > 1e-3 * case.size)
    joints = inverse(case.design, case.position, case.rotation)
    for joint, intervals in enumerate(feasible_intervals(case.design, joints)):
        value = joints[joint : joint + 1]
        assert inside(intervals, value, 1e-9 * case.size).all()


@given(ordinary_cases())
def test_intervals_are_disjoint_ascending_and_of_lengths_not_negative(case: Case) -> None:
    joints = inverse(case.design, case.position, case.rotation)
    found = feasible_intervals(case.design, joints)
    assert len(found) == 6
    for name, intervals in zip(JOINTS, found, strict=True):
        ends = [end for interval in intervals for end in interval]
        assert ends == sorted(ends)
        assert all(low < high for low, high in intervals)
        if name in LENGTHS:
            assert all(low >= 0.0 for low, _ in intervals)


@given(ordinary_cases())
def test_an_end_of_an_interval_is_singular_or_a_length_of_zero(case: Case) -> None:
    joints = inverse(case.design, case.position, case.rotation)
    assume(np.abs(margins(case.position, case.rotation)).min() > 1e-2 * case.size)
    ends = 0
    for joint, intervals in enumerate(feasible_intervals(case.design, joints)):
        for end in (end for interval in intervals for end in interval):
            ends += 1
            rows = with_values(joints, joint, np.array([end]))
            if end == 0.0 and JOINTS[joint] in LENGTHS:
                continue
            least = float(discriminants(case.design, rows)[0].min())
            scale = max(case.size, abs(end))
            assert abs(least) <= 1e-7 * scale**2
    assert ends >= 12


@given(ordinary_cases(), st.sampled_from([1e-20, 1e-6, 1e6, 1e20]))
def test_intervals_scale_with_the_design(case: Case, scale: float) -> None:
    assume(np.abs(margins(case.position, case.rotation)).min() > 1e-2 * case.size)
    joints = inverse(case.design, case.position, case.rotation)
    larger = case.design.with_variables([v * scale for v in case.design.variables])
    one = feasible_intervals(case.design, joints)
    other = feasible_intervals(larger, joints * scale)
    # A break inside an interval may appear at a double root, so only the outer ends count.
    for few, many in zip(one, other, strict=True):
        assert few
        assert many
        tolerance = 1e-6 * scale * case.size
        assert abs(few[0][0] * scale - many[0][0]) <= tolerance
        assert abs(few[-1][1] * scale - many[-1][1]) <= tolerance


def nearest(design: Design, joints: FloatArray, joint: int) -> float | None:
    return nearest_feasible(design, joints, joint, feasible_intervals(design, joints)[joint])


@given(ordinary_cases(), joint_indices, st.floats(-3.0, 3.0))
def test_the_nearest_feasible_value_closes_and_nothing_nearer_does(
    case: Case, joint: int, share: float
) -> None:
    assume(np.abs(margins(case.position, case.rotation)).min() > 1e-2 * case.size)
    joints = inverse(case.design, case.position, case.rotation)
    joints[joint] += share * case.size
    if JOINTS[joint] in LENGTHS:
        joints[joint] = abs(joints[joint])
    asked = float(joints[joint])
    found = nearest(case.design, joints, joint)
    assert found is not None
    assert forward(case.design, with_values(joints, joint, np.array([found]))).feasible.all()

    gap = abs(found - asked)
    nearer = asked + np.linspace(-1.0, 1.0, SAMPLES) * (gap - 1e-6 * case.size)
    nearer = nearer[nearer >= 0.0] if JOINTS[joint] in LENGTHS else nearer
    if gap > 1e-5 * case.size:
        assert not forward(case.design, with_values(joints, joint, nearer)).feasible.any()


@given(ordinary_cases(), joint_indices)
def test_nearest_feasible_value_of_closing_joints_is_the_present_one(
    case: Case, joint: int
) -> None:
    assume(np.abs(margins(case.position, case.rotation)).min() > 1e-2 * case.size)
    joints = inverse(case.design, case.position, case.rotation)
    found = nearest(case.design, joints, joint)
    assert found is not None
    assert abs(found - joints[joint]) <= 1e-12 * case.size


@given(singular_cases(among=designs(sizes=(10.0, 1e-6, 1e6), nearness=(1.0,))), joint_indices)
def test_at_a_singular_pose_the_nearest_value_is_near_or_there_is_none(
    case: Case, joint: int
) -> None:
    joints = inverse(case.design, case.position, case.rotation)
    found = nearest(case.design, joints, joint)
    if found is not None:
        rows = with_values(joints, joint, np.array([found]))
        assert forward(case.design, rows).feasible.all()


def test_nearest_feasible_value_is_none_if_no_value_closes() -> None:
    design = PRESETS["paper-initial"]
    # The carriages are farther apart than b2 and b3, whatever the lengths.
    joints = np.array([9.0, 0.0, 8.0, 50.0, 7.0, 6.0])
    found = feasible_intervals(design, joints)
    for joint in (0, 2, 4, 5):
        assert found[joint] == ()
        assert nearest_feasible(design, joints, joint, found[joint]) is None


@given(designs(), st.integers(0, 2**32 - 1))
def test_any_design_and_joints_give_finite_intervals(design: Design, seed: int) -> None:
    rng = np.random.default_rng(seed)
    size = max(map(abs, design.variables))
    joints = rng.uniform(0.0, 2.0, 6) * size
    for intervals in feasible_intervals(design, joints):
        assert all(np.isfinite(end) for interval in intervals for end in interval)
    assert len(feasible_intervals(design, np.zeros(6))) == 6
    assert len(feasible_intervals(design, joints * 4e14)) == 6


def test_intervals_at_the_identity_orientation_are_empty_for_the_radii_alone() -> None:
    design = PRESETS["paper-initial"]
    joints = inverse(design, [5.0, 3.0, 5.0], np.eye(3))
    found = feasible_intervals(design, joints)
    # With the lines parallel d2 = d4, so that neither can move without the other.
    assert [name for name, intervals in zip(JOINTS, found, strict=True) if not intervals] == [
        "d2",
        "d4",
    ]


@pytest.mark.parametrize(
    "joints", [np.zeros(5), np.full(6, np.nan), np.full(6, -1.0), np.full(6, 1e300)]
)
def test_unusable_joints_are_refused(joints: FloatArray) -> None:
    with pytest.raises(InputError):
        feasible_intervals(PRESETS["paper-initial"], joints)
