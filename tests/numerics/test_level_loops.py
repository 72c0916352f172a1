"""Outlines of fields on grids: areas, nodes within, and levels."""

from __future__ import annotations

import numpy as np
import pytest
from hypothesis import given, strategies as st

from explorer.numerics.arrays import FloatArray, IntArray
from explorer.numerics.level_loops import level_loops


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
