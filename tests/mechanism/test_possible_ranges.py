"""Bounds of joints and position: nothing that a design's limits allow lies outside them."""

from __future__ import annotations

import math
from typing import Any

import msgspec
import numpy as np
from hypothesis import given, strategies as st
from strategies import Case, cases

from explorer.mechanism.design import JOINTS, LENGTHS, Limits
from explorer.mechanism.design_file import PRESETS
from explorer.mechanism.pose import Pose
from explorer.mechanism.possible_ranges import possible_ranges, without_box, without_guide

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
    for free in (without_box(case.design), without_guide(case.design)):
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
    design = without_box(PRESETS["paper-optimal"])
    assert design.home is not None
    x, y, z = design.home.position
    below = msgspec.structs.replace(design, home=Pose((x, y, -z), design.home.quaternion))
    low, high = possible_ranges(below).position[2]
    assert low < 0.0
    assert high == 0.0
