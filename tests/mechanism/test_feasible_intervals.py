"""Exact intervals of the joints beside dense samples, and the ranges that limits leave."""

from __future__ import annotations

import math
from typing import Any

import msgspec
import numpy as np
import pytest
from hypothesis import assume, given, strategies as st
from refusals import refusal
from strategies import (
    Case,
    amplification,
    cases,
    designs,
    ordinary_cases,
    ordinary_designs,
    singular_cases,
)

from explorer import JOINTS, PRESETS, Design, forward, inverse
from explorer.mechanism.design import LENGTHS, Limits
from explorer.mechanism.feasible_intervals import (
    Interval,
    feasible_intervals,
    nearest_feasible,
    possible_ranges,
)
from explorer.mechanism.kinematics import discriminants
from explorer.mechanism.pose import Pose
from explorer.numerics.arrays import BoolArray, FloatArray

joint_indices = st.integers(0, 5)
some_designs = designs(sizes=(10.0, 1e-4, 1e5), nearness=(1.0,))
seeds = st.integers(0, 2**32 - 1)
SAMPLES = 400


def with_values(joints: FloatArray, joint: int, values: FloatArray) -> FloatArray:
    """Return rows of joints of which one takes the values."""
    rows = np.repeat(joints[None, :], len(values), axis=0)
    rows[:, joint] = values
    return rows


def inside(intervals: tuple[Interval, ...], values: FloatArray, slack: float) -> BoolArray:
    """Return which values lie in an interval, with its ends moved outwards by the slack."""
    result = np.zeros(values.shape, dtype=np.bool_)
    for low, high in intervals:
        result |= (values >= low - slack) & (values <= high + slack)
    return result


def check_by_samples(design: Design, joints: FloatArray, joint: int, size: float) -> None:
    """Check the intervals of a joint by values far beyond those that close, and its own."""
    intervals = feasible_intervals(design, joints)[joint]
    lowest, own = (0.0 if JOINTS[joint] in LENGTHS else -6.0 * size), float(joints[joint])
    narrow = np.linspace(own - 0.3 * size, own + 0.3 * size, SAMPLES)
    values = np.append(np.linspace(lowest, 8.0 * size, SAMPLES), narrow[narrow >= lowest])
    closes = forward(design, with_values(joints, joint, values)).feasible
    slack = 1e-6 * size
    # In a singular pose the interval may be the present value alone, which has no length.
    alone = np.abs(values - own) <= slack if forward(design, joints).feasible else False
    assert (inside(intervals, values, slack) | alone)[closes].all()
    assert closes[inside(intervals, values, -slack)].all()


@given(cases(some_designs) | singular_cases(among=some_designs), joint_indices)
def test_intervals_of_closing_joints_are_where_samples_close(case: Case, joint: int) -> None:
    check_by_samples(case.design, case.joints, joint, case.size)


@given(ordinary_designs(), seeds, joint_indices)
def test_intervals_of_joints_that_do_not_close_are_where_samples_close(
    design: Design, seed: int, joint: int
) -> None:
    rng = np.random.default_rng(seed)
    joints = rng.uniform(0.0, 20.0, 6)
    joints[3] = joints[1] + rng.uniform(-1.5, 1.5) * (design.b3 - design.b2)
    size = float(max(*np.abs(joints).tolist(), *map(abs, design.variables)))
    check_by_samples(design, joints, joint, size)


@given(cases(designs(nearness=(1.0, 1e-3))))
def test_joints_of_a_regular_pose_lie_in_their_intervals_and_are_their_nearest(case: Case) -> None:
    assume(case.regularity > 1e-3)
    for joint, intervals in enumerate(feasible_intervals(case.design, case.joints)):
        assert inside(intervals, case.joints[joint : joint + 1], 1e-9 * case.size).all()
        value = nearest_feasible(case.design, case.joints, joint, intervals)
        if amplification(case) < 1e3 and case.regularity > 1e-2:
            assert value == pytest.approx(case.joints[joint], rel=0, abs=1e-12 * case.size)


@given(ordinary_cases(), st.sampled_from([1e-7, 1e-3, 1e3, 1e4]))
def test_intervals_are_disjoint_end_at_singular_joints_or_zero_and_scale_with_the_design(
    case: Case, scale: float
) -> None:
    assume(case.regularity > 1e-2)
    larger = feasible_intervals(case.scaled(scale).design, case.joints * scale)
    for joint, intervals in enumerate(feasible_intervals(case.design, case.joints)):
        # At a double root an interval may be divided, so only the outer ends are compared.
        outer = np.array([larger[joint][0][0], larger[joint][-1][1]]) / scale
        ends_here = [intervals[0][0], intervals[-1][1]]
        np.testing.assert_allclose(outer, ends_here, rtol=0, atol=1e-6 * case.size)
        ends = [end for interval in intervals for end in interval]
        assert len(ends) >= 2
        assert ends == sorted(ends)
        assert all(low < high for low, high in intervals)
        if JOINTS[joint] in LENGTHS:
            assert ends[0] >= 0.0
            ends = [end for end in ends if end != 0.0]
        least = discriminants(case.design, with_values(case.joints, joint, np.array(ends)))
        size = np.maximum(case.size, np.abs(ends))
        assert (np.abs(least.min(axis=1)) <= 1e-7 * size**2).all()


def nearest(design: Design, joints: FloatArray, joint: int) -> float | None:
    return nearest_feasible(design, joints, joint, feasible_intervals(design, joints)[joint])


@given(ordinary_cases(), joint_indices, st.floats(-3.0, 3.0))
def test_nearest_feasible_value_closes_and_no_nearer_one_does(
    case: Case, joint: int, share: float
) -> None:
    assume(case.regularity > 1e-2)
    joints, is_length = case.joints, JOINTS[joint] in LENGTHS
    joints[joint] += share * case.size
    if is_length:
        joints[joint] = abs(joints[joint])
    value = nearest(case.design, joints, joint)
    assert value is not None
    assert forward(case.design, with_values(joints, joint, np.array([value]))).feasible.all()
    gap = abs(value - float(joints[joint]))
    nearer = joints[joint] + np.linspace(-1.0, 1.0, SAMPLES) * (gap - 1e-6 * case.size)
    nearer = nearer[nearer >= 0.0] if is_length else nearer
    if gap > 1e-5 * case.size:
        assert not forward(case.design, with_values(joints, joint, nearer)).feasible.any()


@given(singular_cases(among=some_designs), joint_indices)
def test_nearest_feasible_value_at_a_singular_pose_closes_or_is_none(
    case: Case, joint: int
) -> None:
    value = nearest(case.design, case.joints, joint)
    if value is not None:
        rows = with_values(case.joints, joint, np.array([value]))
        assert forward(case.design, rows).feasible.all()


def test_nearest_feasible_value_is_none_if_no_value_closes() -> None:
    design = PRESETS["paper-initial"]
    # The carriages are farther apart than b2 and b3, at any lengths.
    joints = np.array([9.0, 0.0, 8.0, 50.0, 7.0, 6.0])
    intervals = feasible_intervals(design, joints)
    for joint in (0, 2, 4, 5):
        assert intervals[joint] == ()
        assert nearest_feasible(design, joints, joint, intervals[joint]) is None


@given(designs(), seeds)
def test_intervals_of_any_design_and_joints_are_finite(design: Design, seed: int) -> None:
    joints = np.random.default_rng(seed).uniform(0.0, 2.0, 6) * max(map(abs, design.variables))
    for intervals in feasible_intervals(design, joints):
        assert all(np.isfinite(end) for interval in intervals for end in interval)
    assert len(feasible_intervals(design, np.zeros(6))) == 6
    assert len(feasible_intervals(design, joints * (1e6 / joints.max()))) == 6


def test_intervals_at_the_identity_orientation_are_empty_for_the_radii_alone() -> None:
    design = PRESETS["paper-initial"]
    intervals = feasible_intervals(design, inverse(design, [5.0, 3.0, 5.0], np.eye(3)))
    # With the lines parallel d2 = d4, so neither can move without the other.
    empty = [name for name, some in zip(JOINTS, intervals, strict=True) if not some]
    assert empty == ["d2", "d4"]


@pytest.mark.parametrize(
    "joints", [np.zeros(5), np.full(6, np.nan), np.full(6, -1.0), np.full(6, 1e300)]
)
def test_intervals_of_unusable_joints_are_refused(joints: FloatArray) -> None:
    refusal(feasible_intervals, PRESETS["paper-initial"], joints)


shares = st.floats(0.0, 1.0) | st.just(0.0)


@st.composite
def allowed_cases(draw: st.DrawFn) -> Case:
    """Draw a design in a pose that its limits allow, often at one of them."""
    case: Case = draw(cases())
    size = max(case.size, float(np.abs(case.joints).max()))

    def around(value: float, least: float = -math.inf) -> tuple[float, float]:
        low, high = (draw(shares) * size for _ in range(2))
        return max(least, value - low), value + high

    joints = dict(zip(JOINTS, case.joints.tolist(), strict=True))
    lengths: dict[str, Any] = {name: around(joints[name], 0.0) for name in LENGTHS}
    ends = around(0.0)
    guide = (min(joints["d1"], joints["d3"]) + ends[0], max(joints["d1"], joints["d3"]) + ends[1])
    x, y, z = (around(value) for value in case.position.tolist())
    box = (x[0], y[0], z[0]), (x[1], y[1], z[1])
    limits = Limits(
        **lengths,
        guide=draw(st.sampled_from((None, guide))),
        box=draw(st.sampled_from((None, box))),
        margin=draw(st.sampled_from((None, 0.0, abs(float(case.margins[2]))))),
    )
    design = msgspec.structs.replace(case.design, limits=limits, home=case.pose)
    return Case(design, case.position, case.rotation)


@given(allowed_cases())
def test_joints_and_position_within_the_limits_lie_within_the_possible_ranges(case: Case) -> None:
    ranges = possible_ranges(case.design)
    # Limits themselves are kept up to rounding.
    slack = 1e-9 * max(case.size, float(np.abs(case.joints).max()))
    low, high = np.array((*ranges.joints, *ranges.position)).T
    values = np.array([*case.joints, *case.position])
    assert (low - slack <= values).all()
    assert (values <= high + slack).all()
    # Without a limit the ranges are no narrower.
    for free in (case.design.with_limits(box=None), case.design.with_limits(guide=None)):
        wider = possible_ranges(free)
        lowest, highest = np.array((*wider.joints, *wider.position)).T
        assert (lowest <= low).all()
        assert (high <= highest).all()


def test_ranges_of_the_papers_optimum_are_its_box_and_its_lengths() -> None:
    design = PRESETS["paper-optimal"]
    ranges = possible_ranges(design)
    assert ranges.position == ((0.0, 20.0), (-12.0, 22.0), (0.0, 18.0))
    for name in LENGTHS:
        low, high = ranges.joints[JOINTS.index(name)]
        assert (low, high) == (0.0, design.reach)
    # From the box, and as far beyond as the platform's points are from b4.
    assert ranges.joints[1] == (-design.b2, 20.0 + design.b2)


def test_ranges_of_a_home_below_the_base_have_heights_below_it() -> None:
    design = PRESETS["paper-optimal"].with_limits(box=None)
    assert design.home is not None
    x, y, z = design.home.position
    below = msgspec.structs.replace(design, home=Pose((x, y, -z), design.home.quaternion))
    low, high = possible_ranges(below).position[2]
    assert low < 0.0
    assert high == 0.0
