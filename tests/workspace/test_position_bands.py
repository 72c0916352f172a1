"""Bands of what a load asks of the machine, against reactions of each position."""

from __future__ import annotations

from typing import Any

import msgspec
import numpy as np
import pytest
from machines import FULL

from explorer import (
    PRESETS,
    Design,
    limit_shares,
    reactions,
)
from explorer.export.report.drawings.slices import Slices
from explorer.mechanism.design import Limits
from explorer.mechanism.home import home_pose
from explorer.mechanism.pose import rotation_from_yaw_pitch_roll
from explorer.numerics.arrays import FloatArray
from explorer.singularity.ellipsoids import planes_of_singularity
from explorer.statics.weights import design_weights
from explorer.workspace.position_bands import (
    LOAD_WORDS,
    SHARES,
    STEPS,
    PositionMeasure,
    position_bands,
)

MEASURES: tuple[PositionMeasure, ...] = tuple(LOAD_WORDS)

OPTIMAL = PRESETS["paper-optimal"]
LOADED = msgspec.structs.replace(
    FULL,
    unit_mm=8.0,
    # Singular planes pass through a workspace in which any signs of the margins are allowed.
    limits=Limits(box=((0.0, -12.0, -10.0), (20.0, 22.0, 18.0)), margin=None),
)
LOAD = np.array([4.0, -3.0, -6.0, 5.0, 10.0, -5.0])
ORIENTATIONS = [
    home_pose(OPTIMAL).rotation,
    *(rotation_from_yaw_pitch_roll(angles) for angles in ((-40, 25, 10), (-120, -35, 60))),
]


def near_planes(rotation: FloatArray, count: int) -> FloatArray:
    """Return random positions, of which most are near a singular plane, some within rounding."""
    random = np.random.default_rng(5)
    points = random.uniform((0.0, -12.0, -10.0), (20.0, 22.0, 18.0), (count, 3))
    for k, normal in enumerate(planes_of_singularity(rotation)):
        size = float(np.linalg.norm(normal))
        some = slice(k, None, 4)
        off = 10.0 ** random.uniform(-12.0, 0.0, len(points[some]))
        points[some] -= np.outer(points[some] @ normal / size - off, normal / size)
    return points


def asked(design: Design, points: FloatArray, rotation: FloatArray, measure: str) -> FloatArray:
    """Return what the load asks at positions (n, 3), by reactions."""
    tool, weights = design.tool.position, design_weights(design)
    held = reactions(design, points, rotation, LOAD, tool, weights)
    if measure == "share":
        return np.asarray(limit_shares(design, held).max(axis=-1))
    if measure == "force":
        return np.asarray((np.abs(held.actuators) + held.spread[..., :6]).max(axis=-1))
    bending = (held.bending + held.spread[..., 6:8]).max(axis=-1)
    return np.asarray(bending * design.unit_mm * 1e-3)


@pytest.mark.parametrize("measure", MEASURES)
@pytest.mark.parametrize("rotation", ORIENTATIONS)
def test_values_are_reciprocal_to_what_reactions_ask(
    measure: PositionMeasure, rotation: FloatArray
) -> None:
    bands = position_bands(LOADED, rotation, measure, warn_below=1.0, load=LOAD)
    points = near_planes(rotation, 4000)
    expected = asked(LOADED, points, rotation, measure)
    assert (expected > 1e6).any()
    highest, lowest = bands.levels[1], bands.levels[-1]
    values = bands.values(points)
    np.testing.assert_allclose(
        values, highest / np.maximum(expected, 0.5 * lowest), rtol=1e-7, atol=1e-12
    )
    # Each position is in the band between the levels of its edges.
    index = np.searchsorted(bands.edges, values, side="right") - 1
    levels = np.array((*bands.levels, 0.0))
    assert (expected <= levels[index] * (1.0 + 1e-7)).all()
    assert (expected >= levels[index + 1] * (1.0 - 1e-7)).all()


@pytest.mark.parametrize("measure", MEASURES)
def test_value_is_zero_on_a_singular_plane(measure: PositionMeasure) -> None:
    rotation = ORIENTATIONS[1]
    bands = position_bands(LOADED, rotation, measure, warn_below=1.0, load=LOAD)
    for normal in planes_of_singularity(rotation):
        point = np.array([10.0, 5.0, 9.0])
        on_plane = point - (point @ normal) / (normal @ normal) * normal
        assert bands.values(on_plane[None])[0] == pytest.approx(0.0, abs=1e-9)


@pytest.mark.parametrize("factor", [1e-6, 1.0, 3e4])
def test_levels_of_forces_are_round_numbers_that_suit_the_load(factor: float) -> None:
    rotation = ORIENTATIONS[0]
    bands = position_bands(OPTIMAL, rotation, "force", warn_below=1.0, load=factor * LOAD)
    assert np.isinf(bands.levels[0])
    levels = bands.levels[:0:-1]
    assert len(bands.colours) == len(bands.edges) == len(levels) + 1
    for level in levels:
        first_digit = level / 10.0 ** np.floor(np.log10(level) + 1e-9)
        assert np.abs(np.array(STEPS) - first_digit).min() < 1e-9
    at_home = asked_force(factor, rotation)
    assert levels[0] / 5.0 < at_home < levels[-1]


def asked_force(factor: float, rotation: FloatArray) -> float:
    held = reactions(OPTIMAL, home_pose(OPTIMAL).position, rotation, factor * LOAD)
    return float(np.abs(held.actuators).max())


def test_bands_of_shares_end_at_round_shares_for_any_load() -> None:
    for load in (np.zeros(6), LOAD, 1e6 * LOAD):
        bands = position_bands(LOADED, ORIENTATIONS[0], "share", warn_below=1.0, load=load)
        assert bands.levels[:0:-1] == SHARES


def test_nothing_is_asked_where_nothing_loads() -> None:
    rotation = ORIENTATIONS[0]
    for measure in MEASURES:
        bands = position_bands(OPTIMAL, rotation, measure, warn_below=1.0)
        values = bands.values(np.array([[10.0, 5.0, 9.0], [12.0, -3.0, 4.0]]))
        assert (values > bands.edges[-1]).all()


def is_within(polygons: list[Any], points: FloatArray) -> FloatArray:
    """Return whether points (n, 2) are within polygons by the even-odd rule, shape (n,)."""
    crossings = np.zeros(len(points), dtype=np.int64)
    for polygon in polygons:
        start, end = polygon, np.roll(polygon, -1, axis=0)
        for (u0, v0), (u1, v1) in zip(start, end, strict=True):
            spans = (v0 > points[:, 1]) != (v1 > points[:, 1])
            if not spans.any():
                continue
            across = u0 + (points[spans, 1] - v0) / (v1 - v0) * (u1 - u0)
            crossings[spans] += points[spans, 0] < across
    return crossings % 2 == 1


@pytest.mark.parametrize("axis", ["x", "y", "z"])
@pytest.mark.parametrize("rotation", ORIENTATIONS)
@pytest.mark.parametrize("measure", MEASURES)
def test_map_holds_positions_in_the_bands_of_what_is_asked(
    measure: PositionMeasure, rotation: FloatArray, axis: str
) -> None:
    """Also near the singular planes, where bands are narrower than the cells of the grid."""
    bands = position_bands(LOADED, rotation, measure, warn_below=1.0, load=LOAD)
    extent = np.array([0.0, -12.0, -10.0]), np.array([20.0, 22.0, 18.0])
    slices = Slices(LOADED, rotation, *extent, bands)
    index = "xyz".index(axis)
    level = (9.0, 4.0, 6.0)[index]
    points = near_planes(rotation, 4000)
    points[:, index] = level
    points = np.clip(points, extent[0] + 1e-9, extent[1] - 1e-9)
    expected = asked(LOADED, points, rotation, measure)
    beyond = slices.beyond(axis, level)
    in_plane = [k for k in range(3) if k != index]
    wrong = total = 0
    for edge, end in zip(bands.edges[1:], bands.levels[1:], strict=True):
        within = is_within(list(beyond(edge)), points[:, in_plane])
        # Between the corners of a polygon its sides are straight.
        is_clear = np.abs(expected / end - 1.0) > 0.02
        wrong += int((within != (expected <= end))[is_clear].sum())
        total += int(is_clear.sum())
    assert total > 5000
    assert wrong / total < 1e-3
