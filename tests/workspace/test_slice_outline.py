"""Outlines of slices and of fields on grids: areas, edges on the limits, and levels."""

from __future__ import annotations

import math

import numpy as np
import pytest
from limited_designs import limited, ordinary_case, reference_case

import explorer
from explorer.mechanism.design import Swing
from explorer.numerics.arrays import FloatArray
from explorer.workspace.limits.constraints import slacks
from explorer.workspace.limits.region import region_of
from explorer.workspace.slices.outline import Edge, Outline, slice_outline
from explorer.workspace.slices.volume import workspace_volume
from explorer.workspace.workspace import Workspace

OPTIMAL = explorer.PRESETS["paper-optimal"]
LEVELS = 60


def along(edge: Edge, shares: FloatArray) -> FloatArray:
    """Return points of an edge, shape (n, 2)."""
    start, end = np.array(edge.start), np.array(edge.end)
    if edge.centre is None:
        return start + shares[:, None] * (end - start)
    first = math.atan2(*(start - edge.centre)[::-1])
    angle = first + shares * edge.turn
    return np.array(edge.centre) + edge.radius * np.stack([np.cos(angle), np.sin(angle)], axis=-1)


def area_of(outline: Outline) -> float:
    """Return the area of a slice by Green's theorem, ½ ∮ (u dv − v du)."""
    area = 0.0
    for edge in (edge for loop in outline for edge in loop):
        (u0, v0), (u1, v1), (u, v) = edge.start, edge.end, edge.centre or (0.0, 0.0)
        flat = u * (v1 - v0) - v * (u1 - u0) if edge.centre else u0 * v1 - u1 * v0
        area += 0.5 * (edge.radius**2 * edge.turn + flat)
    return area


def in_space(axis: str, level: float, points: FloatArray) -> FloatArray:
    """Return points of a slice as positions, shape (n, 3)."""
    return np.insert(points, "xyz".index(axis), level, axis=1)


def extent(design: explorer.Design, rotation: FloatArray, axis: str) -> tuple[float, float]:
    lows, highs = region_of(Workspace(design, rotation).limits).ends
    return float(lows["xyz".index(axis)]), float(highs["xyz".index(axis)])


@pytest.mark.parametrize(("seed", "axis"), [(0, "x"), (1, "y"), (2, "z"), (3, "x")])
def test_outline_areas_over_levels_integrate_to_the_exact_volume(seed: int, axis: str) -> None:
    # Even: reference workspaces with minimum lengths, hence holes; odd: every kind of limit.
    design, rotation = reference_case(seed)[:2] if seed % 2 == 0 else ordinary_case(seed)
    low, high = extent(design, rotation, axis)
    step = (high - low) / LEVELS
    outlines = [
        slice_outline(Workspace(design, rotation), axis, low + (k + 0.5) * step)
        for k in range(LEVELS)
    ]
    areas = [area_of(outline) for outline in outlines if outline is not None]
    assert len(areas) == LEVELS
    volume = workspace_volume(design, rotation).volume
    # The midpoint rule: an area as smooth as a root at its ends is good to step^1.5.
    assert step * sum(areas) == pytest.approx(volume, rel=1e-2)


@pytest.mark.parametrize(("seed", "axis"), [(0, "x"), (1, "y"), (2, "z")])
def test_outline_edges_lie_on_their_limits_and_close(seed: int, axis: str) -> None:
    design, rotation = ordinary_case(100 + seed)
    limits = Workspace(design, rotation).limits
    low, high = extent(design, rotation, axis)
    shares = np.linspace(0.0, 1.0, 7)
    seen = 0
    for level in np.linspace(low, high, 13)[1:-1].tolist():
        outline = slice_outline(Workspace(design, rotation), axis, level)
        assert outline is not None
        for loop in outline:
            for edge, after in zip(loop, (*loop[1:], loop[0]), strict=True):
                seen += 1
                assert math.dist(edge.end, after.start) <= 1e-6 * design.reach
                points = in_space(axis, level, along(edge, shares))
                assert float(slacks(limits, points).min()) >= -1e-8 * design.reach
                # All of an edge lies on the surface of one limit.
                off = min(float(limit.distance(points).max()) for limit in limits)
                assert off <= 1e-8 * design.reach
    assert seen > 10


@pytest.mark.parametrize("seed", range(2))
def test_outline_edges_have_the_slice_on_their_left(seed: int) -> None:
    design, rotation = ordinary_case(200 + seed)
    limits = Workspace(design, rotation).limits
    level = design.home.position[2] if design.home else 0.0
    outline = slice_outline(Workspace(design, rotation), "z", level)
    assert outline is not None
    assert outline
    for edge in (edge for loop in outline for edge in loop):
        before, middle, after = along(edge, np.array([0.499, 0.5, 0.501]))
        forward = (after - before) / np.linalg.norm(after - before)
        left = np.array([-forward[1], forward[0]]) * 1e-6 * design.reach
        sides = in_space("z", level, np.array([middle + left, middle - left]))
        inside = (slacks(limits, sides) >= 0.0).all(axis=-1)
        assert inside.tolist() == [True, False]


def test_outline_outside_a_workspace_has_no_loops() -> None:
    rotation = OPTIMAL.home_pose.rotation
    for r, level in ((rotation, 30.0), (rotation, -0.1), (np.eye(3), 9.0)):
        assert slice_outline(Workspace(OPTIMAL, r), "z", level) == ()


def test_outline_with_cones_is_none() -> None:
    swung = limited(OPTIMAL, swing=Swing(a1=60.0))
    rotation = OPTIMAL.home_pose.rotation
    assert slice_outline(Workspace(swung, rotation), "z", 9.0) is None
