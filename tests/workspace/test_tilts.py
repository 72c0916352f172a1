"""Tilts of a position against single poses on dense turns, and the angles against SciPy's."""

from __future__ import annotations

import decimal
import math
from collections.abc import Callable
from typing import Any
from unittest.mock import Mock

import numpy as np
import pytest
from limited_designs import limited, ordinary_case, troubled_case
from scipy.spatial.transform import Rotation

from explorer import PRESETS, Design, InputError, evaluate, home_pose, inverse
from explorer.mechanism.design import Swing
from explorer.mechanism.pose import Pose
from explorer.numerics.arrays import FloatArray
from explorer.workspace.limits.constraints import CARRIAGE_ORDER
from explorer.workspace.orientations.connected import is_connected
from explorer.workspace.orientations.share import orientations_within
from explorer.workspace.orientations.tilts import greatest_tilt, greatest_tilts, tilt_map
from explorer.workspace.orientations.torsions import (
    TorsionRange,
    tilt_by_torsion,
    torsion_range,
)
from explorer.workspace.orientations.turn_polynomials import START_IS_INVALID, nearer_linear_end

pytestmark = pytest.mark.usefixtures("warm_kernels")

STEP = 0.05


def tilted(azimuth: float, tilts: FloatArray, torsion: float) -> FloatArray:
    """Return the rotations of tilts, by SciPy's Euler angles."""
    angles = [(azimuth, tilt, torsion - azimuth) for tilt in tilts.tolist()]
    return Rotation.from_euler("ZYZ", angles, degrees=True).as_matrix()


def sampled_tilt(design: Design, position: Any, azimuth: float, torsion: float) -> float:
    """Return the last of many tilts up to which all poses are allowed; NaN if none is."""
    tilts = np.arange(0.0, 180.0 + 0.5 * STEP, STEP)
    within = orientations_within(design, position, tilted(azimuth, tilts, torsion))
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
    home = home_pose(design)
    if seed % 2:
        names = rng.choice(["a1", "a3", "b1", "b2", "b3", "b4"], 3, replace=False).tolist()
        design = limited(design, swing=Swing(**{n: float(rng.uniform(10, 170)) for n in names}))
    position = np.array(home.position) + rng.normal(scale=0.02 * design.reach, size=3)
    r = home.rotation
    torsion = math.degrees(math.atan2(r[1, 0] - r[0, 1], r[0, 0] + r[1, 1]))
    return design, position, torsion


@pytest.mark.parametrize("seed", range(40))
def test_tilt_map_agrees_with_dense_turns(seed: int) -> None:
    design, position, torsion = case_of(seed)
    found = tilt_map(design, position, torsion, 12)
    for azimuth, tilt, limit in zip(found.azimuths, found.tilts, found.limits, strict=True):
        expected = sampled_tilt(design, position, float(azimuth), torsion)
        if math.isnan(expected):
            assert math.isnan(tilt)
            assert limit is not None
        else:
            assert expected - 1e-6 <= tilt <= expected + STEP + 1e-6


@pytest.mark.parametrize("seed", range(40))
def test_tilt_map_names_the_limit_that_is_violated_beyond(seed: int) -> None:
    design, position, torsion = case_of(seed)
    found = tilt_map(design, position, torsion, 12)
    for azimuth, tilt, limit in zip(found.azimuths, found.tilts, found.limits, strict=True):
        if limit is None:
            assert tilt == 180.0
            continue
        beyond = 0.0 if math.isnan(tilt) else float(tilt) + 1e-3
        rotation = tilted(float(azimuth), np.array([beyond]), torsion)[0]
        broken = {each.limit for each in evaluate(design, Pose.of(position, rotation)).violations}
        names = {limit, limit.removesuffix(" minimum").removesuffix(" maximum")}
        assert names & broken, (limit, broken)


def test_tilt_map_of_the_paper_ends_at_margins_and_the_carriage_order() -> None:
    design = PRESETS["paper-optimal"]
    found = tilt_map(design, home_pose(design).position)
    assert len(found.tilts) == 72
    assert {"margin δ1", "margin δ2", CARRIAGE_ORDER} == set(found.limits)
    # Towards the azimuth zero the carriages meet where b3 - b2 is upright.
    assert found.tilts[0] == pytest.approx(90.0, abs=1e-6)


@pytest.mark.parametrize("seed", range(12))
def test_greatest_tilt_is_the_least_of_a_fine_map(seed: int) -> None:
    design, position, torsion = case_of(seed)
    found = greatest_tilt(design, position, torsion)
    fine = tilt_map(design, position, torsion, 7200)
    if math.isnan(found.tilt):
        assert np.isnan(fine.tilts).all()
        return
    assert found.tilt <= fine.tilts.min() + 1e-9
    assert found.tilt >= fine.tilts.min() - 0.02
    if found.limit is not None:
        there = tilt_map(design, position, torsion, [found.azimuth])
        assert there.tilts[0] == pytest.approx(found.tilt, abs=1e-6)
        assert there.limits[0] == found.limit


@pytest.mark.parametrize("seed", range(12))
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
    fine = found.best.torsion + np.linspace(-14.0, 14.0, 561)
    assert found.best.tilt >= np.nanmax(greatest_tilts(design, position, fine)) - 1e-3


def test_greatest_tilts_take_torsions_beside_positions() -> None:
    design, position, torsion = case_of(4)
    positions = position + np.random.default_rng(1).normal(scale=0.1, size=(3, 1, 3))
    torsions = torsion + np.array([-10.0, 0.0, 10.0, 180.0])
    found = greatest_tilts(design, positions, torsions)
    each = [[greatest_tilt(design, p[0], s).tilt for s in torsions] for p in positions]
    np.testing.assert_allclose(found, each, atol=1e-6)
    with pytest.raises(InputError, match="do not go with torsions"):
        greatest_tilts(design, positions[:, 0], torsions)


def test_greatest_tilts_of_many_positions_are_those_of_each() -> None:
    design, position, torsion = case_of(4)
    rng = np.random.default_rng(0)
    positions = position + rng.normal(scale=0.2 * design.reach, size=(3, 20, 3))
    found = greatest_tilts(design, positions, torsion)
    each = [[greatest_tilt(design, p, torsion).tilt for p in row] for row in positions]
    np.testing.assert_allclose(found, each, atol=1e-6)
    assert 0 < np.isnan(found).sum() < found.size
    assert greatest_tilts(design, np.zeros((0, 3))).shape == (0,)


@pytest.mark.parametrize("seed", range(16))
def test_torsion_range_agrees_with_dense_turns(seed: int) -> None:
    design, position, torsion = case_of(seed)
    for azimuth, tilt in ((0.0, 0.0), (40.0, 15.0)):
        found = torsion_range(design, position, torsion, azimuth, tilt)
        turns = np.arange(0.0, 360.0, STEP)
        angles = [
            np.array([[azimuth, tilt, s - azimuth] for s in torsion + k * turns]) for k in (-1, 1)
        ]
        down, up = (
            orientations_within(
                design, position, Rotation.from_euler("ZYZ", each, degrees=True).as_matrix()
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


@pytest.mark.parametrize("seed", range(12))
def test_orientation_is_connected_to_tilt_zero_up_to_the_tilt_of_the_map(seed: int) -> None:
    design, position, torsion = case_of(seed)
    found = tilt_map(design, position, torsion, 8)
    for azimuth, tilt in zip(found.azimuths.tolist(), found.tilts.tolist(), strict=True):
        if math.isnan(tilt):
            assert not is_connected(design, position, tilted(azimuth, np.zeros(1), torsion)[0])
            continue
        inside, outside = tilted(azimuth, np.array([0.99 * tilt, tilt + 0.01]), torsion)
        level = tilted(0.0, np.zeros(1), torsion)[0]
        assert is_connected(design, position, inside)
        assert is_connected(design, position, inside, level)
        if tilt < 179.9:
            assert not is_connected(design, position, outside)


def test_tilt_zero_that_violates_a_limit_has_no_tilt() -> None:
    design = PRESETS["paper-optimal"]
    found = tilt_map(design, [30.0, 5.0, 9.0], azimuths=3)
    assert np.isnan(found.tilts).all()
    least = greatest_tilt(design, [30.0, 5.0, 9.0])
    assert math.isnan(least.tilt)
    assert math.isnan(least.azimuth)
    assert least.limit == found.limits[0] is not None


def test_tilts_with_unusable_input_are_refused() -> None:
    design = PRESETS["paper-optimal"]
    p = home_pose(design).position
    for count in (0, -1, 10**9):
        with pytest.raises(InputError, match="number of azimuths"):
            tilt_map(design, p, azimuths=count)
    with pytest.raises(InputError, match="number of azimuths"):
        greatest_tilts(design, p, azimuths=2)
    with pytest.raises(InputError, match="number of torsions"):
        tilt_by_torsion(design, p, 2)
    with pytest.raises(InputError, match="azimuths must be"):
        tilt_map(design, p, azimuths=[[1.0]])
    with pytest.raises(InputError, match="one position"):
        tilt_map(design, [p])
    for torsion in (math.nan, math.inf):
        with pytest.raises(InputError, match="torsion"):
            tilt_map(design, p, torsion)
    with pytest.raises(InputError, match="rotation"):
        is_connected(design, p, np.zeros((3, 3)))


def dips() -> list[tuple[Design, float]]:
    """Return designs at whose home one limit leaves out a narrow range of azimuths."""
    design = PRESETS["paper-optimal"]
    free = limited(design, margin=None, carriage_order="any", box=None)
    p = np.array(home_pose(design).position)
    far, radius = float(np.linalg.norm(p)), math.hypot(p[1], p[2])
    arm, small = math.hypot(*design.b1), 3e-4
    return [
        (limited(free, l1=(0.0, (far + arm) * (1.0 - small))), -180.0),
        (limited(free, l1=((far - arm) * (1.0 + small), None)), 0.0),
        (limited(free, d2=(0.0, radius + design.b2 * (1.0 - small))), 83.0),
        (limited(free, d2=(radius - design.b2 * (1.0 - small), None)), -97.0),
        (limited(free, d4=(0.0, radius + design.b3 * (1.0 - small))), 83.0),
        (limited(free, guide=(p[0] - design.b3 * (1.0 - small), 1e3)), -75.0),
        (limited(free, guide=(-1e3, p[0] + design.b3 * (1.0 - small))), 103.0),
    ]


@pytest.mark.parametrize("index", range(len(dips())))
def test_greatest_tilt_finds_a_dip_between_azimuths(index: int) -> None:
    design, torsion = dips()[index]
    p = home_pose(design).position
    least = tilt_map(design, p, torsion, 14_400).tilts.min()
    assert least < 179.0
    for azimuths in (5, 36, 72):
        found = float(greatest_tilts(design, p, torsion, azimuths))
        assert least - 0.05 <= found <= least + 1e-6
    assert greatest_tilt(design, p, torsion).tilt == pytest.approx(least, abs=0.05)


def exact_place(a: float, b: float, c: float) -> float:
    """Return the first place where a (1 − u)² + b (1 − u) u + c u² is negative, to 700 digits."""
    with decimal.localcontext(prec=700):
        x, y, z = decimal.Decimal(a), decimal.Decimal(b), decimal.Decimal(c)
        square = y * y / 4 - x * z
        if (b >= 0.0 and c >= 0.0) or square < 0:
            return 1.0
        root = square.sqrt()
        roots = [(-y / 2 - root) / z, (-y / 2 + root) / z] if z else [-x / y]
        t = min(t for t in roots if t > 0 or (t == 0 and (b < 0.0 or b == 0.0 > c)))
        return float(t / (1 + t))


def test_nearer_linear_end_is_the_exact_root_however_small_the_start_is() -> None:
    assert nearer_linear_end(0.0, 1.0, -1.0, 1.0) == 0.5
    assert nearer_linear_end(0.0, 0.0, -1.0, 1.0) == 0.0
    assert nearer_linear_end(-1e-300, 1.0, 1.0, 1.0) == START_IS_INVALID
    rng = np.random.default_rng(0)
    for a in (0.0, 1e-300, 1e-30, 1e-16, 1e-9, 1e-3, 1.0, 1e3):
        for b, c in [(1.0, -1.0), (-1.0, 1.0), *rng.normal(size=(40, 2)).tolist()]:
            if b * b == 4.0 * a * c:
                continue
            expected = exact_place(a, b, c)
            assert nearer_linear_end(a, b, c, 1.0) == pytest.approx(expected, rel=1e-11, abs=1e-300)
            assert nearer_linear_end(a, b, c, 0.3) == min(0.3, nearer_linear_end(a, b, c, 1.0))


def test_orientations_of_two_torsions_are_connected_within_the_range_of_torsions() -> None:
    design = PRESETS["paper-optimal"]
    p = home_pose(design).position
    span = torsion_range(design, p)
    assert span.high - span.low < 359.0

    def turned_to(torsion: float) -> FloatArray:
        return tilted(0.0, np.zeros(1), torsion)[0]

    middle = turned_to(0.5 * (span.low + span.high))
    for torsion in (span.low, span.high):
        for beside in (-1e-14, -1e-9, 0.0, 1e-9, 1e-14):
            other = torsion + beside
            # The torsion itself may be a rounding error beyond its limit.
            if math.isnan(greatest_tilt(design, p, other).tilt):
                continue
            assert is_connected(design, p, middle, turned_to(other))
            assert is_connected(design, p, turned_to(other), middle)
    for torsion in np.linspace(span.low + 0.01, span.high - 0.01, 9).tolist():
        assert is_connected(design, p, middle, turned_to(torsion))
    for torsion in np.linspace(span.high + 0.01, span.low + 359.99, 9).tolist():
        assert not is_connected(design, p, middle, turned_to(torsion))


def test_torsion_at_the_end_of_the_range_is_connected_despite_rounding(
    monkeypatch: pytest.MonkeyPatch,
) -> None:
    design = PRESETS["paper-optimal"]
    p, here = home_pose(design).position, home_pose(design).rotation
    module = "explorer.workspace.orientations.connected.torsion_range"
    torsion = tilt_map(design, p).torsion
    for low, high, expected in (
        (torsion + 1e-9, torsion + 90.0, True),
        (torsion - 90.0, torsion - 1e-9, True),
        (torsion + 1e-3, torsion + 90.0, False),
        (torsion - 90.0, torsion - 1e-3, False),
        (math.nan, math.nan, False),
    ):
        span = TorsionRange(low, high, "gap", "gap")
        monkeypatch.setattr(module, Mock(return_value=span))
        assert is_connected(design, p, here, here) is expected


def test_torsion_range_whose_half_turn_ends_on_a_limit_has_both_ends() -> None:
    design = PRESETS["paper-optimal"]
    free = limited(design, margin=None, carriage_order="any", box=None)
    p = home_pose(design).position
    rng = np.random.default_rng(0)
    for torsion in rng.uniform(-180.0, 180.0, 60).tolist():
        longest = float(inverse(free, p, tilted(0.0, np.zeros(1), torsion + 180.0)[0])[0])
        for bound in longest + 1e-15 * longest * np.arange(-3, 4):
            found = torsion_range(limited(free, l1=(0.0, float(bound))), p, torsion)
            assert math.isnan(found.low) == math.isnan(found.high)
            if not math.isnan(found.low):
                assert torsion - 360.0 <= found.low <= torsion <= found.high <= torsion + 360.0
                assert found.high - found.low <= 360.0 + 1e-9
                assert (found.low_limit is None) == (found.high_limit is None)


def test_input_that_is_not_a_whole_number_or_not_one_angle_is_refused() -> None:
    design = PRESETS["paper-optimal"]
    p = home_pose(design).position
    for count in (math.nan, 3.5, math.inf, "many", None, True):
        with pytest.raises(InputError, match="number of azimuths must be a whole number"):
            tilt_map(design, p, azimuths=count)  # pyright: ignore[reportArgumentType]
    whole: Any = tilt_map(design, p, azimuths=5.0)  # pyright: ignore[reportArgumentType]
    assert len(whole.tilts) == 5
    refused: list[tuple[str, Callable[[Any], object], Any]] = [
        ("number of azimuths", lambda x: greatest_tilts(design, p, azimuths=x), 3.5),
        ("number of torsions", lambda x: tilt_by_torsion(design, p, x), 3.5),
        ("one torsion", lambda x: tilt_map(design, p, x), [1.0, 2.0]),
        ("one torsion", lambda x: greatest_tilt(design, p, x), [1.0]),
        ("one azimuth", lambda x: torsion_range(design, p, azimuth=x), [1.0, 2.0]),
        ("one tilt", lambda x: torsion_range(design, p, tilt=x), [1.0, 2.0]),
        ("tilt must be finite", lambda x: torsion_range(design, p, tilt=x), math.nan),
    ]
    for message, call, value in refused:
        with pytest.raises(InputError, match=message):
            call(value)


def test_azimuth_of_the_greatest_tilt_is_within_half_a_turn() -> None:
    design = PRESETS["paper-optimal"]
    found = greatest_tilt(design, home_pose(design).position)
    assert -180.0 <= found.azimuth < 0.0
