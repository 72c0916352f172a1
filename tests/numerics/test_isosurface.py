"""The surface around negative values, which is closed and oriented for any values."""

from __future__ import annotations

import math

import numpy as np
from hypothesis import given, strategies as st

from explorer.numerics.arrays import FloatArray
from explorer.numerics.isosurface import surface_below_zero
from explorer.workspace.solids.solid import Solid


def solid_of(values: FloatArray) -> Solid:
    vertices, faces = surface_below_zero(values)
    origin = np.zeros(len(faces), dtype=np.int64)
    return Solid(vertices, faces.astype(np.int32), origin, ("values",), 0.0)


@given(st.integers(0, 2**32), st.tuples(*[st.integers(4, 9)] * 3), st.floats(0.0, 1.0))
def test_surface_of_any_values_is_closed_around_negative_ones(
    seed: int, shape: tuple[int, int, int], zeros: float
) -> None:
    rng = np.random.default_rng(seed)
    values = rng.normal(size=shape)
    values[rng.random(shape) < zeros] = 0.0
    inner = np.zeros(shape, dtype=np.bool_)
    inner[1:-1, 1:-1, 1:-1] = True
    values[~inner] = rng.uniform(0.0, 1.0, int((~inner).sum()))
    values[2, 2, 2] = -1.0
    solid = solid_of(values)
    assert solid.is_watertight
    for node in np.argwhere(np.abs(values) > 0.05)[::3]:
        winding = solid.winding(node.astype(np.float64))
        assert round(winding) == (1 if values[tuple(node)] < 0.0 else 0)


def test_surface_of_a_ball_has_its_radius_and_volume() -> None:
    grid = np.stack(np.meshgrid(*[np.arange(30)] * 3, indexing="ij"), axis=-1)
    centre, radius = np.array([14.2, 13.9, 14.6]), 9.3
    solid = solid_of(np.linalg.norm(grid - centre, axis=-1) - radius)
    off = np.linalg.norm(solid.vertices - centre, axis=1) - radius
    # Linear interpolation over an edge of length √3 falls short by its square over 8 r.
    assert np.abs(off).max() < 3.0 / (8.0 * radius) + 1e-3
    assert 0.98 < solid.volume / (4.0 / 3.0 * math.pi * radius**3) < 1.0
