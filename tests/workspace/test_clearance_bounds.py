"""Lower bounds of the distances of legs over cells of positions."""

from __future__ import annotations

from typing import Any

import numpy as np
import pytest
from hypothesis import given, strategies as st
from limited_designs import limited, ordinary_case, troubled_case
from long_cases import long_after
from scipy.optimize import linprog

from explorer import PRESETS, Design
from explorer.legs.clearance import joined_pairs, leg_axes, leg_clearances
from explorer.mechanism.configuration import Configuration
from explorer.mechanism.design import Swing
from explorer.mechanism.margins import margins
from explorer.numerics.arrays import FloatArray
from explorer.workspace.clearance_bounds import (
    LEGS_OF_PAIRS,
    bound_slacks,
    least_in_workspace,
    raise_bounds,
)
from explorer.workspace.least_clearance import least_clearances
from explorer.workspace.limits.constraints import Cone, Constraint, slacks
from explorer.workspace.workspace import Workspace

OPTIMAL = PRESETS["paper-optimal"]


def bounds_of(
    design: Design,
    r: FloatArray,
    limits: tuple[Constraint, ...],
    middles: FloatArray,
    half: FloatArray,
) -> FloatArray:
    at = Configuration(design, middles, r)
    low = np.full((len(middles), 6), -np.inf)
    raise_bounds(
        len(low),
        np.ones(low.shape, dtype=np.bool_),
        LEGS_OF_PAIRS,
        leg_axes(at),
        half,
        *bound_slacks(limits, middles, half),
        low,
    )
    return low


@pytest.mark.parametrize("seed", long_after(8, range(60)))
def test_no_position_in_a_cell_and_the_limits_is_below_the_bounds(seed: int) -> None:
    rng = np.random.default_rng(seed)
    design, rotation = ordinary_case(seed) if seed % 2 else troubled_case(seed)
    r = design.home_pose.rotation if rotation is None else rotation
    limits, apart = Workspace(design, r).limits, ~joined_pairs(design)
    middles = design.reach * rng.uniform(-1.0, 1.0, (300, 3))
    half = design.reach * 10.0 ** rng.uniform(-3.0, -0.5) * rng.uniform(0.2, 1.0, 3)
    low = bounds_of(design, r, limits, middles, half)
    largest = bound_slacks(limits, middles, half).largest(half)
    offsets = rng.uniform(-1.0, 1.0, (100, 3))
    # Corners and faces have the least values.
    offsets = half * np.where(rng.random((100, 3)) < 0.4, np.sign(offsets), offsets)
    positions = middles[:, None] + offsets
    slack = slacks(limits, positions)
    rounding = 1e-12 * design.reach
    of_cone = np.array([isinstance(limit, Cone) for limit in limits])
    most = np.where(of_cone & (slack >= 0.0), 0.0, np.where(of_cone, -np.inf, slack))
    assert (most.max(axis=1, initial=-np.inf) <= largest + rounding).all()
    distance = leg_clearances(Configuration(design, positions, r)).distance
    is_within = (slack >= 0.0).all(axis=-1)
    distance[~is_within] = np.inf
    assert (low <= distance.min(axis=1) + rounding)[:, apart].all()


def test_error_of_the_bounds_falls_with_the_square_of_the_cell() -> None:
    rng = np.random.default_rng(3)
    r = OPTIMAL.home_pose.rotation
    middles = np.array([10.0, 5.0, 9.0]) + rng.uniform(-3.0, 3.0, (200, 3))
    corners = 2.0 * np.indices((2, 2, 2)).reshape(3, -1).T - 1.0
    gaps: list[float] = []
    for half in (0.2, 0.1):
        low = bounds_of(OPTIMAL, r, (), middles, np.full(3, half))
        at = Configuration(OPTIMAL, middles[:, None] + half * corners, r)
        gaps.append(float((leg_clearances(at).distance.min(axis=1) - low).mean()))
    assert gaps[0] / gaps[1] == pytest.approx(4.0, abs=0.6)


def test_bound_at_a_limit_that_holds_a_distance_is_nearly_the_distance() -> None:
    # Legs 3 and 4 come nearest where δ2, or the box, lets them go no farther.
    design, r = limited(OPTIMAL, margin=0.5), OPTIMAL.home_pose.rotation
    least = least_clearances(Workspace(design), tolerance=1e-6)
    limits, half = Workspace(design, r).limits, np.full(3, 1e-3)
    held = bounds_of(design, r, limits, least.position, half)
    free = bounds_of(design, r, (), least.position, half)
    distance = least.clearance
    assert (np.diagonal(free)[:3] < distance[:3] - 1e-4).all()
    assert (np.diagonal(held) > distance - 1e-5).all()


def test_least_clearances_are_certain_where_joints_bound_the_swing_of_legs() -> None:
    swing = Swing(a1=30.0, b2=45.0, b3=35.0, b4=35.0)
    least = least_clearances(Workspace(limited(OPTIMAL, margin=0.5, swing=swing)))
    assert (least.clearance - least.bound <= 1e-4 * OPTIMAL.reach).all()


@given(st.integers(0, 2**32 - 1), st.integers(0, 4))
def test_bound_by_duality_is_below_the_least_value_of_a_linear_programme(
    seed: int, count: int
) -> None:
    rng = np.random.default_rng(seed)
    value, slope, half = rng.normal(), rng.normal(size=3), rng.uniform(0.1, 2.0, 3)
    slack, slopes = rng.normal(size=count) + 0.5, rng.normal(size=(count, 3))
    slopes[rng.random((count, 3)) < 0.2] = 0.0
    x, y, z = slope.tolist()
    bound = least_in_workspace(value, (x, y, z), half, slack, slopes)
    assert bound >= value - np.abs(slope) @ half - 1e-12
    # The slacks are not negative in the workspace.
    limits: dict[str, Any] = {"A_ub": -slopes, "b_ub": slack} if count else {}
    solve: Any = linprog
    least = solve(slope, **limits, bounds=np.stack([-half, half], axis=-1))
    if least.status == 0:
        assert bound <= value + least.fun + 1e-9
        if count <= 1:
            assert bound == pytest.approx(value + least.fun, abs=1e-9)


@pytest.mark.parametrize("seed", long_after(4, range(12)))
def test_least_clearances_off_singular_planes_are_those_of_a_design_with_that_margin(
    seed: int,
) -> None:
    design, rotation = ordinary_case(seed)
    margin, tolerance, below = (share * design.reach for share in (0.05, 1e-3, 0.1))
    free = Workspace(limited(design, margin=0.0), rotation)
    found = least_clearances(free, tolerance, margin=margin)
    demanded = least_clearances(Workspace(limited(design, margin=margin), rotation), tolerance)
    assert found.clearance == pytest.approx(demanded.clearance, abs=tolerance)
    near = least_clearances(free, tolerance, margin=margin, below=below)
    is_near = np.isfinite(near.clearance)
    assert (is_near == (demanded.clearance < below)).all()
    assert near.clearance[is_near] == pytest.approx(demanded.clearance[is_near], abs=tolerance)
    for position in (found.position, near.position[is_near]):
        sizes = np.abs(margins(position, rotation))
        assert (sizes >= margin * (1.0 - 1e-6)).all()
