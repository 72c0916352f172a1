"""Tilts of a position against single poses on dense turns, and the angles against SciPy's."""

from __future__ import annotations

import math
from collections.abc import Callable
from typing import Any

import numpy as np
import pytest
from limited_designs import limited, ordinary_case, troubled_case
from long_cases import long_after
from scipy.spatial.transform import Rotation

from explorer import PRESETS, Design, InputError, evaluate
from explorer.mechanism.design import Swing
from explorer.mechanism.pose import Pose
from explorer.numerics.arrays import FloatArray
from explorer.workspace.limits.table import CARRIAGE_ORDER
from explorer.workspace.orientations.share import orientations_within
from explorer.workspace.orientations.tilts import (
    greatest_tilt,
    greatest_tilts,
    is_connected,
    tilt_by_torsion,
    tilt_map,
    torsion_range,
)

pytestmark = pytest.mark.usefixtures("warm_kernels")

STEP = 0.05


def tilted(azimuth: float, tilts: FloatArray, torsion: float) -> FloatArray:
    """Return the rotations of tilts, by SciPy's Euler angles."""
    angles = [(azimuth, tilt, torsion - azimuth) for tilt in tilts.tolist()]
    return Rotation.from_euler("ZYZ", angles, degrees=True).as_matrix()


def sampled_tilt(
    design: Design, position: Any, azimuth: float, torsion: float, tool: FloatArray
) -> float:
    """Return the last of many tilts up to which all poses are allowed; NaN if none is."""
    tilts = np.arange(0.0, 180.0 + 0.5 * STEP, STEP)
    within = orientations_within(design, position, tilted(azimuth, tilts, torsion), tool)
    if not within[0]:
        return math.nan
    return float(tilts[-1] if within.all() else tilts[within.argmin() - 1])


def case_of(seed: int) -> tuple[Design, FloatArray, float]:
    """Return a design, a position near its home, and a torsion."""
    rng = np.random.default_rng([3, seed])
    if seed % 4 == 0:
        design = PRESETS[("paper-initial", "paper-optimal")[seed // 4 % 2]]
    else:
        design = (ordinary_case if seed % 4 < 3 else troubled_case)(seed)[0]
    home = design.home_pose
    if seed % 2:
        names = rng.choice(["a1", "a3", "b1", "b2", "b3", "b4"], 3, replace=False).tolist()
        design = limited(design, swing=Swing(**{n: float(rng.uniform(10, 170)) for n in names}))
    position = np.array(home.position) + rng.normal(scale=0.02 * design.reach, size=3)
    r = home.rotation
    torsion = math.degrees(math.atan2(r[1, 0] - r[0, 1], r[0, 0] + r[1, 1]))
    return design, position, torsion


def tool_case_of(seed: int, share: float) -> tuple[Design, FloatArray, float, FloatArray]:
    """Return a case with a tool at a share of the reach from b4, and the position of the tool."""
    design, position, torsion = case_of(seed)
    direction = np.random.default_rng([4, seed]).normal(size=3)
    tool = share * design.reach * direction / np.linalg.norm(direction)
    return design, position + design.home_pose.rotation @ tool, torsion, tool


@pytest.mark.parametrize("seed", long_after(9, range(40)))
def test_tilt_map_agrees_with_dense_turns_and_names_the_limit(seed: int) -> None:
    design, position, torsion, tool = tool_case_of(seed, (0.0, 0.3, 0.3)[seed % 3])
    found = tilt_map(design, position, torsion, 12, tool)
    for azimuth, tilt, limit in zip(found.azimuths, found.tilts, found.limits, strict=True):
        expected = sampled_tilt(design, position, float(azimuth), torsion, tool)
        if math.isnan(expected):
            assert math.isnan(tilt)
            assert limit is not None
        else:
            assert expected - 1e-6 <= tilt <= expected + STEP + 1e-6
        if limit is None:
            assert tilt == 180.0
            continue
        # The limit is violated just beyond.
        beyond = 0.0 if math.isnan(tilt) else float(tilt) + 1e-3
        rotation = tilted(float(azimuth), np.array([beyond]), torsion)[0]
        pose = Pose.of(position - rotation @ tool, rotation)
        broken = {each.limit for each in evaluate(design, pose).violations}
        names = {limit, limit.removesuffix(" minimum").removesuffix(" maximum")}
        assert names & broken, (limit, broken)


def test_tilt_map_of_the_paper_ends_at_margins_and_the_carriage_order() -> None:
    design = PRESETS["paper-optimal"]
    found = tilt_map(design, design.home_pose.position)
    assert len(found.tilts) == 72
    assert {"margin δ1", "margin δ2", CARRIAGE_ORDER} == set(found.limits)
    # Towards the azimuth zero the carriages meet where b3 - b2 is upright.
    assert found.tilts[0] == pytest.approx(90.0, abs=1e-6)


@pytest.mark.parametrize("seed", range(6))
def test_greatest_tilt_is_the_least_of_a_fine_map(seed: int) -> None:
    design, position, torsion, tool = tool_case_of(seed, (0.0, 0.2, 0.2)[seed % 3])
    found = greatest_tilt(design, position, torsion, tool)
    fine = tilt_map(design, position, torsion, 7200, tool)
    if math.isnan(found.tilt):
        assert np.isnan(fine.tilts).all()
        return
    assert found.tilt <= fine.tilts.min() + 1e-9
    assert found.tilt >= fine.tilts.min() - 0.02
    if found.limit is not None:
        there = tilt_map(design, position, torsion, [found.azimuth], tool)
        assert there.tilts[0] == pytest.approx(found.tilt, abs=1e-6)
        assert there.limits[0] == found.limit


@pytest.mark.parametrize("seed", range(4))
def test_tilt_by_torsion_is_that_of_each_torsion_and_its_best_the_largest(seed: int) -> None:
    design, position, _ = case_of(seed)
    found = tilt_by_torsion(design, position, 24)
    np.testing.assert_allclose(np.diff(found.torsions), 15.0)
    each = [greatest_tilt(design, position, sigma).tilt for sigma in found.torsions]
    np.testing.assert_allclose(found.tilts, each, atol=1e-3)
    if np.isnan(found.tilts).all():
        assert math.isnan(found.best.tilt)
        assert found.best.limit is not None
        return
    assert found.best.tilt >= np.nanmax(found.tilts)
    there = greatest_tilt(design, position, found.best.torsion)
    assert there.tilt == pytest.approx(found.best.tilt, abs=1e-9)
    fine = found.best.torsion + np.linspace(-14.0, 14.0, 141)
    assert found.best.tilt >= np.nanmax(greatest_tilts(design, position, fine)) - 1e-3


def test_greatest_tilts_take_torsions_beside_positions() -> None:
    design, position, torsion = case_of(4)
    spread = 0.2 * design.reach
    positions = position + np.random.default_rng(0).normal(scale=spread, size=(12, 1, 3))
    torsions = torsion + np.array([-10.0, 0.0, 10.0, 180.0])
    found = greatest_tilts(design, positions, torsions)
    each = [[greatest_tilt(design, p[0], s).tilt for s in torsions] for p in positions]
    np.testing.assert_allclose(found, each, atol=1e-6)
    assert 0 < np.isnan(found).sum() < found.size
    assert greatest_tilts(design, np.zeros((0, 3))).shape == (0,)
    with pytest.raises(InputError, match="do not broadcast"):
        greatest_tilts(design, positions[:, 0], torsions)


@pytest.mark.parametrize("seed", range(6))
def test_torsion_range_agrees_with_dense_turns(seed: int) -> None:
    design, position, torsion, tool = tool_case_of(seed, (0.0, 0.2, 0.2)[seed % 3])
    for azimuth, tilt in ((0.0, 0.0), (40.0, 15.0)):
        found = torsion_range(design, position, torsion, azimuth, tilt, tool)
        turns = np.arange(0.0, 360.0, STEP)
        angles = [
            np.array([[azimuth, tilt, s - azimuth] for s in torsion + k * turns]) for k in (-1, 1)
        ]
        down, up = (
            orientations_within(
                design, position, Rotation.from_euler("ZYZ", each, degrees=True).as_matrix(), tool
            )
            for each in angles
        )
        if not down[0]:
            assert math.isnan(found.low)
            assert found.low_limit == found.high_limit is not None
        elif up.all():
            assert (found.low, found.high) == (torsion - 180.0, torsion + 180.0)
            assert found.low_limit is found.high_limit is None
        else:
            for within, end in ((down, torsion - found.low), (up, found.high - torsion)):
                last = float(turns[within.argmin() - 1])
                assert last - 1e-6 <= end <= last + STEP + 1e-6


@pytest.mark.parametrize("seed", range(4))
def test_orientation_is_connected_to_tilt_zero_up_to_the_tilt_of_the_map(seed: int) -> None:
    design, position, torsion, tool = tool_case_of(seed, (0.0, 0.2, 0.2)[seed % 3])
    found = tilt_map(design, position, torsion, 8, tool)
    for azimuth, tilt in zip(found.azimuths.tolist(), found.tilts.tolist(), strict=True):
        if math.isnan(tilt):
            start = tilted(azimuth, np.zeros(1), torsion)[0]
            assert not is_connected(design, position, start, tool=tool)
            continue
        inside, outside = tilted(azimuth, np.array([0.99 * tilt, tilt + 0.01]), torsion)
        assert is_connected(design, position, inside, tool=tool)
        if tilt < 179.9:
            assert not is_connected(design, position, outside, tool=tool)


@pytest.mark.parametrize(
    ("words", "measure", "arguments"),
    [
        *(("number of azimuths", tilt_map, {"azimuths": n}) for n in (0, 10**9)),
        *(("azimuths must be a whole", tilt_map, {"azimuths": n}) for n in (3.5, "many", True)),
        ("number of azimuths", greatest_tilts, {"azimuths": 2}),
        *(("number of torsions", tilt_by_torsion, {"torsions": n}) for n in (2, 3.5)),
        ("azimuths must be", tilt_map, {"azimuths": [[1.0]]}),
        ("torsion", tilt_map, {"torsion": math.nan}),
        ("one torsion", tilt_map, {"torsion": [1.0, 2.0]}),
        ("one azimuth", torsion_range, {"azimuth": [1.0, 2.0]}),
        ("one tilt", torsion_range, {"tilt": [1.0, 2.0]}),
        ("tilt must be finite", torsion_range, {"tilt": math.nan}),
        ("rotation", is_connected, {"rotation": np.zeros((3, 3))}),
        ("one tool point", greatest_tilt, {"tool": [(0.0, 0.0, 1.0)]}),
        ("tool must be finite", tilt_map, {"tool": (0.0, 0.0, math.nan)}),
        ("one position", tilt_map, {"position": [(1.0, 2.0, 3.0)]}),
    ],
)
def test_tilts_with_unusable_input_are_refused(
    words: str, measure: Callable[..., object], arguments: dict[str, Any]
) -> None:
    design = PRESETS["paper-optimal"]
    with pytest.raises(InputError, match=words):
        measure(design, **({"position": design.home_pose.position} | arguments))


def test_tilt_zero_that_violates_a_limit_has_no_tilt() -> None:
    design = PRESETS["paper-optimal"]
    found = tilt_map(design, [30.0, 5.0, 9.0], azimuths=3)
    assert np.isnan(found.tilts).all()
    least = greatest_tilt(design, [30.0, 5.0, 9.0])
    assert math.isnan(least.tilt)
    assert math.isnan(least.azimuth)
    assert least.limit == found.limits[0] is not None


def tool_dips() -> list[tuple[Design, FloatArray, FloatArray]]:
    """Return designs, positions and tools at which one limit leaves out a narrow range."""
    design = PRESETS["paper-optimal"]
    wide: dict[str, Any] = dict.fromkeys(("l1", "d2", "d4", "l4"), (0.0, 500.0))
    free = limited(design, margin=None, carriage_order="any", box=None, **wide)
    c, small = np.array(design.home_pose.position), 1.0 - 3e-4
    cases: list[tuple[Design, FloatArray, FloatArray]] = []
    for tool in ((0.0, 0.3, 3.0), (1.5, -1.0, 2.0)):
        t = np.array(tool)
        arm, far = float(np.linalg.norm(t)), float(np.linalg.norm(c - [*design.a3, 0.0]))
        to_b1, to_b2, to_b3 = (
            float(np.linalg.norm(np.array(b) - t))
            for b in ((*design.b1, 0.0), (design.b2, 0.0, 0.0), (design.b3, 0.0, 0.0))
        )
        distance, radius = float(np.linalg.norm(c)), math.hypot(c[1], c[2])
        sides: list[dict[str, Any]] = [
            {"l4": (0.0, far + arm * small)},
            {"l4": (far - arm * small, 500.0)},
            {"l1": (0.0, distance + to_b1 * small)},
            {"l1": (distance - to_b1 * small, 500.0)},
            {"d2": (0.0, radius + to_b2 * small)},
            {"d4": (radius - to_b3 * small, 500.0)},
            {"guide": (-1e3, float(c[0]) + max(to_b2, to_b3) * small)},
        ]
        high, low = float(c[0]) + arm * small, float(c[1]) - arm * small
        sides += [{"box": ((-99.0,) * 3, (high, 99.0, 99.0))}]
        sides += [{"box": ((-99.0, low, -99.0), (99.0,) * 3)}]
        cases += [(limited(free, **side), c, t) for side in sides]
    return cases


@pytest.mark.parametrize("index", range(0, len(tool_dips()), 3))
def test_greatest_tilt_finds_a_dip_between_azimuths(index: int) -> None:
    design, position, tool = tool_dips()[index]
    fine = tilt_map(design, position, -40.0, 14_400, tool)
    least = fine.tilts.min()
    assert least < 179.0
    # The dip is narrow: most azimuths are free.
    assert (fine.tilts == 180.0).sum() > 13_000
    for azimuths in (5, 36, 72):
        found = float(greatest_tilts(design, position, -40.0, azimuths, tool))
        assert least - 0.05 <= found <= least + 1e-6
    assert greatest_tilt(design, position, -40.0, tool).tilt == pytest.approx(least, abs=0.05)
