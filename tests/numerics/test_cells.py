"""The search over cells: bounds hold, values are attained, and what is above enough is exact."""

from __future__ import annotations

import numpy as np
import pytest

from explorer.numerics.arrays import FloatArray
from explorer.numerics.cells import CellValues, largest_values


def waves(rng: np.random.Generator, axes: int) -> tuple[FloatArray, FloatArray]:
    """Return three functions Σ a sin(k·x), each with its a (4,) and its k (4, axes)."""
    return rng.normal(size=(3, 4)), 3.0 * rng.normal(size=(3, 4, axes))


@pytest.mark.parametrize("axes", [1, 2, 3])
@pytest.mark.parametrize("enough", [-10.0, 1.0])
@pytest.mark.parametrize("along_one", [False, True])
def test_largest_values_lie_between_what_is_attained_and_the_bound(
    axes: int, enough: float, *, along_one: bool
) -> None:
    rng = np.random.default_rng(axes)
    size, wave = waves(rng, axes)

    def values_at(x: FloatArray) -> FloatArray:
        return (size * np.sin(np.einsum("mka,...a->...mk", wave, x))).sum(axis=-1)

    bend = (np.abs(size) * (wave * wave).sum(axis=-1)).sum(axis=-1)

    def measure(lows: FloatArray, highs: FloatArray) -> CellValues:
        middles, half = 0.5 * (lows + highs), 0.5 * (highs - lows)
        values = values_at(middles)
        cosines = size * np.cos(np.einsum("mka,na->nmk", wave, middles))
        slopes = np.abs(np.einsum("nmk,mka->nma", cosines, wave))
        bounds = values + np.einsum("nma,na->nm", slopes, half)
        bounds += 0.5 * (half * half).sum(axis=1)[:, None] * bend
        return CellValues(values, np.repeat(middles[:, None], 3, axis=1), bounds)

    lows, highs = np.full(axes, -1.0), np.ones(axes)
    found = largest_values(measure, lows, highs, enough, along_one=along_one)
    sampled = values_at(rng.uniform(lows, highs, (200_000, axes))).max(axis=0)
    assert (found.bounds >= sampled).all()
    assert found.values == pytest.approx(np.diagonal(values_at(found.places)), abs=1e-12)
    is_above = found.values > enough
    assert (found.bounds[~is_above] <= enough).all()
    excess = found.values - enough
    assert (found.bounds - enough)[is_above] == pytest.approx(excess[is_above], rel=1e-3)


def test_bound_of_a_point_is_what_was_computed() -> None:
    def measure(lows: FloatArray, highs: FloatArray) -> CellValues:
        values = lows + highs
        return CellValues(values, lows[:, None], values + np.inf)

    found = largest_values(measure, np.ones(1), np.ones(1))
    assert (found.values, found.bounds) == (2.0, np.inf)
