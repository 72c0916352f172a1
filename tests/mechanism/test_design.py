"""Designs in Python: every value is usable or refused with one line; presets and homes."""

from __future__ import annotations

import math
from typing import Any

import msgspec
import numpy as np
import pytest
from drawn_designs import limits
from hypothesis import given
from numpy.testing import assert_allclose
from refusals import refusal
from strategies import designs

from explorer import PRESETS, Design, Limits, evaluate, load_design, margins
from explorer.errors import DesignError
from explorer.mechanism.design import LENGTHS
from explorer.numerics.checks import MOST

NUMBERS: dict[str, Any] = {"a3": (8.0, 5.0), "b1": (3.0, -2.5), "b2": 2.0, "b3": 5.0}
HUGE = 10**5000


@pytest.mark.parametrize(
    "changed",
    [
        *({"b2": value} for value in (math.nan, HUGE, "2.0", "2\n3", np.zeros(2))),
        *({"b3": value} for value in (None, True, 1j, object())),
        *({"a3": value} for value in (HUGE, "12", b"12", {1.0, 2.0}, {1.0: 2.0, 3.0: 4.0}, ())),
        *({"a3": value} for value in (np.zeros((3, 3)), np.zeros((2, 2)))),
        *({"a3": (value, 1.0)} for value in (math.inf, HUGE)),
        {"b1": (1.0, -math.inf)},
        {"name": 5},
        {"schema": 3},
        {"limits": None},
        {"limits": {"gap": 1}},
        {"home": "home"},
    ],
    ids=lambda changed: next(iter(changed)),
)
def test_design_of_unusable_arguments_is_refused(changed: dict[str, Any]) -> None:
    refusal(lambda: Design(**{**NUMBERS, **changed}), kind=DesignError)


def test_design_with_other_variables_keeps_the_rest() -> None:
    design = PRESETS["paper-optimal"]
    refusal(design.with_variables, [1.0, 2.0], kind=DesignError)
    refusal(design.with_variable, "a9", 1.0, kind=DesignError)
    assert design.with_variable("b2", 1.25).b2 == 1.25
    values = (1.0, 2.0, 3.0, 4.0, 5.0, 6.0)
    assert design.with_variables(values).variables == values
    assert design.with_variables(values).limits == design.limits


def test_a2_is_drawn_at_the_end_of_the_guide_and_never_on_a1() -> None:
    base = Design(**NUMBERS)
    assert base.a2x == base.reach
    for guide, end in (((-3.0, 12.0), 12.0), ((-3.0, 0.0), -3.0), ((0.0, 0.0), base.reach)):
        assert msgspec.structs.replace(base, limits=Limits(guide=guide)).a2x == end


REACH = math.hypot(10.0, 4.0)


@pytest.mark.parametrize(
    ("name", "variables", "step", "box"),
    [
        (
            "paper-initial",
            (10.0, 4.0, 4.0, -1.0, 3.0, 1.5),
            None,
            ((0.0, -REACH, 0.0), (REACH, REACH, REACH)),
        ),
        (
            "paper-optimal",
            (19.1829, 7.0062, 4.2892, -3.8858, 2.6067, 4.9094),
            2.0,
            ((0.0, -12.0, 0.0), (20.0, 22.0, 18.0)),
        ),
    ],
)
def test_preset_is_a_row_of_table_1_with_its_home_within_all_limits(
    name: str, variables: tuple[float, ...], step: float | None, box: tuple[tuple[float, ...], ...]
) -> None:
    design = load_design(name)
    assert design is PRESETS[name]
    assert (design.name, design.variables) == (name, variables)
    assert (design.node_step, design.unit_mm) == (step, 10.0)
    assert (design.limits.box, design.limits.guide) == (box, None)
    assert all(design.length_range(leg) == (0.0, design.reach) for leg in LENGTHS)
    assert design.home is not None
    assert design.home_pose == design.home
    snapshot = evaluate(design, design.home)
    assert snapshot.violations == ()
    assert snapshot.proximity > 0.05
    c, s = math.cos(math.radians(-73.1)), math.sin(math.radians(-73.1))
    assert_allclose(snapshot.rotation, [[c, -s, 0], [s, c, 0], [0, 0, 1]], atol=1e-6)


@given(designs())
def test_home_of_a_design_without_one_is_regular(design: Design) -> None:
    assert design.home is None
    pose = design.home_pose
    assert np.abs(margins(pose.position, pose.rotation)).min() > 1e-3 * design.reach
    snapshot = evaluate(design, pose)
    assert snapshot.stratum == (4, 3, 2, 1)
    assert not any(each.limit.startswith("margin") for each in snapshot.violations)


def test_design_without_limits_equals_that_of_arrays_and_has_its_reach_for_lengths() -> None:
    b1, b2 = list(NUMBERS["b1"]), np.float64(2.0)
    arrays: dict[str, Any] = {"a3": np.array(NUMBERS["a3"]), "b1": b1, "b2": b2, "b3": 5}
    design = Design(**NUMBERS)
    assert Design(**arrays) == design
    assert hash(Design(**arrays)) == hash(design)
    assert design.reach == math.hypot(8.0, 5.0)
    assert all(design.length_range(name) == (0.0, design.reach) for name in LENGTHS)


@given(designs(), limits())
def test_home_of_any_limits_is_finite(design: Design, within: Limits) -> None:
    pose = msgspec.structs.replace(design, limits=within).home_pose
    assert np.isfinite(pose.position).all()
    assert max(map(abs, pose.position)) <= MOST
