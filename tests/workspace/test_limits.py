"""Violations of limits are those of a plain comparison, and a pose on a limit violates none."""

from __future__ import annotations

import math
from typing import Any

import msgspec
import numpy as np
import pytest
from hypothesis import given, strategies as st
from limited_designs import (
    limited as with_limits,
    ordinary_case,
    shell_case,
    thin_case,
    troubled_case,
)
from scipy.spatial.transform import Rotation
from strategies import Case, ordinary_cases

from explorer import JOINTS, PRESETS, Design, Limits, inverse, margins
from explorer.mechanism.configuration import Configuration
from explorer.mechanism.design import LENGTHS, Swing
from explorer.mechanism.margins import signs_of
from explorer.numerics.arrays import FloatArray
from explorer.workspace.limits.constraints import Cone, constraints, slacks
from explorer.workspace.limits.valid_poses import Rules, Violation, poses_are_valid, violations

Signs = tuple[int, int, int]
ANY: dict[str, Any] = dict.fromkeys(LENGTHS, (0.0, 1e6))
FREE = Limits(**ANY, carriage_order="any", margin=None)


def limited(design: Design, **limits: Any) -> Design:
    """Return the design with these limits and no others."""
    return msgspec.structs.replace(design, limits=msgspec.structs.replace(FREE, **limits))


def broken(
    design: Design, position: FloatArray, rotation: FloatArray, signs: Signs | None = None
) -> tuple[Violation, ...]:
    (found,) = violations(Configuration(design, position, rotation), signs)
    return found


def ranges(low: float, high: float) -> st.SearchStrategy[tuple[float, float]]:
    ends = st.tuples(st.floats(low, high), st.floats(low, high))
    return ends.map(lambda pair: (min(pair), max(pair)))


@given(
    ordinary_cases(),
    st.tuples(*[ranges(0.0, 20.0)] * 4),
    ranges(-20.0, 50.0),
    st.tuples(*[ranges(-30.0, 30.0)] * 3),
)
def test_length_carriage_or_coordinate_outside_its_range_is_a_violation(
    case: Case,
    lengths: tuple[tuple[float, float], ...],
    guide: tuple[float, float],
    sides: tuple[tuple[float, float], ...],
) -> None:
    lows, highs = zip(*sides, strict=True)
    limits: dict[str, Any] = dict(zip(LENGTHS, lengths, strict=True))
    design = limited(case.design, **limits, guide=guide, box=(lows, highs))
    joints = dict(zip(JOINTS, inverse(design, case.position, case.rotation).tolist(), strict=True))
    found = {v.limit: v for v in broken(design, case.position, case.rotation)}
    values = joints | dict(zip(("box x", "box y", "box z"), case.position.tolist(), strict=True))
    for name, (low, high) in zip(
        (*LENGTHS, "d1", "d3", "box x", "box y", "box z"),
        (*lengths, guide, guide, *sides),
        strict=True,
    ):
        value = values[name]
        if not low - 1e-9 <= value <= high + 1e-9:
            above = value > high
            violation = found[name]
            assert (violation.value, violation.above) == (pytest.approx(value), above)
            assert violation.bound == (high if above else low)
        elif low <= value <= high:
            assert name not in found


@given(ordinary_cases())
def test_maximum_of_none_is_the_reach_and_a_margin_of_none_demands_nothing(case: Case) -> None:
    design = limited(case.design, l1=(0.0, None))
    reach = math.hypot(*case.design.a3)
    l1 = float(inverse(design, case.position, case.rotation)[0])
    found = broken(design, case.position, case.rotation)
    assert [v.limit for v in found] == (["l1"] if l1 > reach * (1.0 + 1e-12) else [])
    assert all(v.bound == reach for v in found)


@given(ordinary_cases(), st.floats(0.0, 20.0))
def test_carriages_closer_than_the_gap_are_a_violation(case: Case, gap: float) -> None:
    design = limited(case.design, gap=gap)
    joints = inverse(design, case.position, case.rotation)
    apart = abs(float(joints[1]) - float(joints[3]))
    found = broken(design, case.position, case.rotation)
    if apart < gap - 1e-9:
        (violation,) = found
        assert violation.limit.startswith("gap")
        assert not violation.above
    elif apart >= gap:
        assert found == ()


@given(ordinary_cases(), st.floats(0.0, 10.0), st.integers(0, 7))
def test_margin_of_another_sign_or_too_small_is_a_violation(
    case: Case, least: float, mode: int
) -> None:
    design = limited(case.design, margin=least)
    signs = signs_of(mode)
    found = {v.limit: v for v in broken(design, case.position, case.rotation, signs)}
    margin = margins(case.position, case.rotation).tolist()
    for index, (value, sign) in enumerate(zip(margin, signs, strict=True), 1):
        name = f"margin δ{index}"
        if sign * value < least - 1e-9:
            violation = found[name]
            assert (violation.value, violation.above) == (pytest.approx(value), sign < 0)
            assert violation.bound == sign * least
        elif sign * value >= least:
            assert name not in found


def test_violations_are_in_the_order_of_the_design_file() -> None:
    design = limited(
        PRESETS["paper-initial"],
        **dict.fromkeys(LENGTHS, (0.0, 0.0)),
        guide=(100.0, 101.0),
        gap=50.0,
        box=((100.0, 100.0, 100.0), (101.0, 101.0, 101.0)),
        margin=100.0,
    )
    found = broken(design, np.array([3.0, 4.0, 5.0]), np.eye(3), (1, -1, 1))
    assert [v.limit for v in found] == [
        *LENGTHS,
        *("d1", "d3", "gap |d1 − d3|"),
        *("box x", "box y", "box z"),
        *("margin δ1", "margin δ2", "margin δ3"),
    ]


@given(st.integers(0, 2**32))
def test_violated_limits_are_those_of_the_solids_and_of_validity(seed: int) -> None:
    rng = np.random.default_rng(seed)
    case = (ordinary_case, shell_case, thin_case, troubled_case)[seed % 4]
    design = case(seed)[0]
    angles = {name: float(rng.uniform(1.0, 180.0)) for name in ("a1", "a3", "b2", "b4")}
    design = with_limits(design, swing=Swing(**angles), gap=0.1 * design.reach)
    home = design.home_pose
    spread = float(rng.choice([1e-9, 1e-3, 0.1, 1.0]))
    turn = Rotation.from_rotvec(spread * rng.normal(size=3)).as_matrix()
    rotation = turn @ home.rotation
    position = np.array(home.position) + spread * design.reach * rng.normal(size=3)
    solids = constraints(design, rotation)
    slack, size = slacks(solids, position), max(design.reach, float(np.abs(position).max()))
    # Close to a surface rounding decides.
    if (np.abs(slack) <= 1e-9 * np.where([isinstance(s, Cone) for s in solids], 1.0, size)).any():
        return
    beyond = {solid.name for solid, value in zip(solids, slack, strict=True) if value < 0.0}
    found = broken(design, position, rotation)
    assert {violation.demand.end_names()[int(violation.above)] for violation in found} == beyond
    rules = Rules.of(design).without_clearances()
    assert poses_are_valid(design, position, rotation, rules=rules) == (not found)
