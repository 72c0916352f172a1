"""Exact outlines of slices: their areas integrate to the volume, their edges lie on the limits."""

from __future__ import annotations

import math

import numpy as np
import pytest
from limited_designs import limited, ordinary_case, reference_case

import explorer
from explorer.mechanism.design import Swing
from explorer.numerics.arrays import FloatArray
from explorer.workspace.limits.constraints import constraints, slacks
from explorer.workspace.limits.region import region_of
from explorer.workspace.slices.outline import Edge, slice_outline
from explorer.workspace.slices.volume import workspace_volume

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


def in_space(axis: str, level: float, points: FloatArray) -> FloatArray:
    """Return points of a slice as positions, shape (n, 3)."""
    return np.insert(points, "xyz".index(axis), level, axis=1)


def extent(design: explorer.Design, rotation: FloatArray, axis: str) -> tuple[float, float]:
    lows, highs = region_of(constraints(design, rotation)).ends
    return float(lows["xyz".index(axis)]), float(highs["xyz".index(axis)])


@pytest.mark.parametrize(("seed", "axis"), [(0, "x"), (1, "y"), (2, "z"), (3, "x")])
def test_outline_areas_over_levels_integrate_to_the_exact_volume(seed: int, axis: str) -> None:
    # Even: reference workspaces with minimum lengths, hence holes; odd: every kind of limit.
    design, rotation = reference_case(seed)[:2] if seed % 2 == 0 else ordinary_case(seed)
    low, high = extent(design, rotation, axis)
    step = (high - low) / LEVELS
    outlines = [
        slice_outline(design, rotation, axis, low + (k + 0.5) * step) for k in range(LEVELS)
    ]
    areas = [outline.area for outline in outlines if outline is not None]
    assert len(areas) == LEVELS
    volume = workspace_volume(design, rotation).volume
    # The midpoint rule: an area as smooth as a root at its ends is good to step^1.5.
    assert step * sum(areas) == pytest.approx(volume, rel=1e-2)


@pytest.mark.parametrize(("seed", "axis"), [(0, "x"), (1, "y"), (2, "z")])
def test_outline_edges_lie_on_their_limits_and_close(seed: int, axis: str) -> None:
    design, rotation = ordinary_case(100 + seed)
    limits = constraints(design, rotation)
    low, high = extent(design, rotation, axis)
    shares = np.linspace(0.0, 1.0, 7)
    seen = 0
    for level in np.linspace(low, high, 13)[1:-1].tolist():
        outline = slice_outline(design, rotation, axis, level)
        assert outline is not None
        for loop in outline.loops:
            for edge, after in zip(loop, (*loop[1:], loop[0]), strict=True):
                seen += 1
                assert math.dist(edge.end, after.start) <= 1e-6 * design.reach
                points = in_space(axis, level, along(edge, shares))
                assert float(slacks(limits, points).min()) >= -1e-8 * design.reach
                own = [limit for limit in limits if limit.name == edge.limit]
                off = np.min([limit.distance(points) for limit in own], axis=0)
                assert float(off.max()) <= 1e-8 * design.reach
    assert seen > 10


@pytest.mark.parametrize("seed", range(2))
def test_outline_edges_have_the_slice_on_their_left(seed: int) -> None:
    design, rotation = ordinary_case(200 + seed)
    limits = constraints(design, rotation)
    level = design.home.position[2] if design.home else 0.0
    outline = slice_outline(design, rotation, "z", level)
    assert outline is not None
    assert outline.loops
    for edge in (edge for loop in outline.loops for edge in loop):
        before, middle, after = along(edge, np.array([0.499, 0.5, 0.501]))
        forward = (after - before) / np.linalg.norm(after - before)
        left = np.array([-forward[1], forward[0]]) * 1e-6 * design.reach
        sides = in_space("z", level, np.array([middle + left, middle - left]))
        inside = (slacks(limits, sides) >= 0.0).all(axis=-1)
        assert inside.tolist() == [True, False]


@pytest.mark.parametrize("size", [1e-3, 1e4])
def test_outline_of_a_scaled_design_scales(size: float) -> None:
    rotation = OPTIMAL.home_pose.rotation
    plain = limited(OPTIMAL, box=None)
    scaled = limited(plain.with_variables([size * x for x in plain.variables]))
    one = slice_outline(plain, rotation, "y", 3.0)
    other = slice_outline(scaled, rotation, "y", 3.0 * size)
    assert one is not None
    assert other is not None
    assert [len(loop) for loop in one.loops] == [len(loop) for loop in other.loops]
    assert other.area == pytest.approx(one.area * size**2, rel=1e-9)


def test_outline_outside_a_workspace_has_no_loops() -> None:
    rotation = OPTIMAL.home_pose.rotation
    for r, level in ((rotation, 30.0), (rotation, -0.1), (np.eye(3), 9.0)):
        outline = slice_outline(OPTIMAL, r, "z", level)
        assert outline is not None
        assert (outline.loops, outline.area) == ((), 0.0)


def test_outline_with_cones_is_none_and_unknown_axes_are_refused() -> None:
    swung = limited(OPTIMAL, swing=Swing(a1=60.0))
    rotation = OPTIMAL.home_pose.rotation
    assert slice_outline(swung, rotation, "z", 9.0) is None
    for axis in ("w", "", "xy"):
        with pytest.raises(explorer.InputError, match="x, y or z"):
            slice_outline(OPTIMAL, rotation, axis, 9.0)
