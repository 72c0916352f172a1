"""Outlines of slices and of fields on grids: areas, edges on the limits, and levels."""

from __future__ import annotations

import math

import numpy as np
import pytest
from hypothesis import given, strategies as st
from limited_designs import limited, ordinary_case, reference_case

import explorer
from explorer.mechanism.design import Swing
from explorer.numerics.arrays import FloatArray, IntArray
from explorer.workspace.limits.constraints import slacks
from explorer.workspace.limits.region import region_of
from explorer.workspace.slices.outline import Edge, Outline, level_loops, slice_outline
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


def area(polygon: FloatArray) -> float:
    x, y = polygon.T
    return 0.5 * float((x * np.roll(y, -1) - np.roll(x, -1) * y).sum())


def winding(polygons: list[FloatArray], points: FloatArray) -> IntArray:
    """Return how often polygons wind around points (n, 2), counter-clockwise, shape (n,)."""
    turns = np.zeros(len(points))
    for polygon in polygons:
        off = polygon[None] - points[:, None]
        angles = np.arctan2(off[..., 1], off[..., 0])
        steps = np.diff(np.concatenate([angles, angles[:, :1]], axis=1), axis=1)
        turns += ((steps + np.pi) % (2.0 * np.pi) - np.pi).sum(axis=1)
    return np.rint(turns / (2.0 * np.pi)).astype(int)


GRIDS = st.tuples(st.integers(2, 7), st.integers(2, 7), st.integers(0, 2**31))


@given(GRIDS)
def test_outlines_enclose_the_nodes_above_the_level_once_and_no_others(
    grid: tuple[int, int, int],
) -> None:
    """Also over saddles, where four nodes of a cell alternate."""
    many, tall, seed = grid
    rng = np.random.default_rng(seed)
    columns, rows = (np.cumsum(rng.uniform(0.2, 2.0, n)) for n in (many, tall))
    # No four of these add up to the level, so that no saddle is undecided.
    values = rng.choice([-2.0, -1.1, 1.0, 3.3], (tall, many))
    loops = level_loops(columns, rows, values, 0.0)
    # At an end of the grid the outline runs through the nodes: those inside are tested.
    nodes = np.array([(u, v) for v in rows[1:-1] for u in columns[1:-1]]).reshape(-1, 2)
    if len(nodes):
        expected = (values[1:-1, 1:-1] >= 0.0).ravel().astype(int)
        np.testing.assert_array_equal(winding(loops, nodes), expected)
    everything = float((columns[-1] - columns[0]) * (rows[-1] - rows[0]))
    below = level_loops(columns, rows, -values, 0.0)
    # What is above and what is below make up the grid.
    assert sum(map(area, loops)) + sum(map(area, below)) == pytest.approx(everything)


@given(st.floats(0.3, 0.9), st.floats(-0.3, 0.3))
def test_outline_of_a_ring_has_its_area_to_the_square_of_the_step(radius: float, u: float) -> None:
    areas: list[float] = []
    for steps in (40, 80):
        x = np.linspace(-1.5, 1.5, steps + 1)
        away = np.hypot(x[None, :] - u, x[:, None])
        outer, hole = sorted(level_loops(x, x, -np.abs(away - radius), -0.15), key=area)[::-1]
        assert area(hole) < 0.0 < area(outer)
        areas.append(area(outer) + area(hole))
    exact = np.pi * ((radius + 0.15) ** 2 - (radius - 0.15) ** 2)
    assert areas[0] == pytest.approx(exact, rel=4e-2)
    assert areas[1] == pytest.approx(exact, rel=1.2e-2)


def test_outline_lies_at_the_level_and_on_the_ends_of_the_grid() -> None:
    x, y = np.linspace(-1.0, 2.0, 13), np.linspace(0.0, 1.0, 5)
    slope = 2.0 * x[None, :] - 3.0 * y[:, None]
    (polygon,) = level_loops(x, y, slope, 0.5)
    off = np.abs(2.0 * polygon[:, 0] - 3.0 * polygon[:, 1] - 0.5)
    at_end = np.isin(polygon[:, 0], x[[0, -1]]) | np.isin(polygon[:, 1], y[[0, -1]])
    assert ((off < 1e-12) | at_end).all()


def test_field_beyond_the_level_everywhere_is_the_grid_and_one_below_it_nothing() -> None:
    x, y = np.array([1.0, 2.0, 4.0]), np.array([0.0, 3.0])
    ones = np.ones((2, 3))
    (polygon,) = level_loops(x, y, ones, 0.5)
    assert area(polygon) == pytest.approx(9.0)
    assert level_loops(x, y, ones, 1.5) == []


@given(st.floats(1e-3, 0.2), st.floats(-0.4, 0.4), st.floats(0.0, 3.0))
def test_corners_have_the_level_of_a_field_that_is_known_between_nodes(
    half: float, off: float, angle: float
) -> None:
    """Also beside a strip that is narrower than a cell, and in which the field has a fold."""
    x = np.linspace(-1.0, 1.0, 9)
    normal = np.array([np.cos(angle), np.sin(angle)])

    def field_at(points: FloatArray) -> FloatArray:
        distance = points @ normal - off
        return distance + np.maximum(0.0, 7.0 * (distance - 2.0 * half))

    nodes = np.stack(np.meshgrid(x, x), axis=-1)
    values = field_at(nodes.reshape(-1, 2)).reshape(9, 9)
    (polygon,) = level_loops(x, x, values, half, field_at)
    inner = (np.abs(polygon) < 1.0).all(axis=1)
    assert inner.any()
    np.testing.assert_allclose(polygon[inner] @ normal - off, half, rtol=2e-4)
