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
from explorer.workspace.orientations.share import (
    orientation_capability,
    orientation_share,
    orientations_within,
)
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
    home = home_pose(design)
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
    return design, position + home_pose(design).rotation @ tool, torsion, tool


@pytest.mark.parametrize("seed", range(12))
def test_orientations_of_the_tool_are_those_of_its_poses(seed: int) -> None:
    design, position, _, tool = tool_case_of(seed, 0.3)
    rng = np.random.default_rng(seed)
    turns = Rotation.from_rotvec(rng.normal(scale=0.3, size=(150, 3))).as_matrix()
    rotations = turns @ home_pose(design).rotation
    poses = [Pose.of(position - r @ tool, r) for r in rotations]
    expected = [not evaluate(design, pose).violations for pose in poses]
    assert orientations_within(design, position, rotations, tool).tolist() == expected
    share = orientation_capability(design, position, rotations, tool)
    assert share == pytest.approx(np.mean(expected))


@pytest.mark.parametrize("seed", range(0, 12, 4))
def test_orientation_share_of_the_tool_is_that_of_random_orientations(seed: int) -> None:
    design, position, _, tool = tool_case_of(seed, 0.1)
    found = orientation_share(design, position, 200_000, tool=tool)
    rotations = Rotation.random(200_000, random_state=np.random.default_rng(1)).as_matrix()
    expected = orientations_within(design, position, rotations, tool).mean()
    error = math.sqrt(expected * (1.0 - expected) / 200_000)
    assert found.share == pytest.approx(expected, abs=5.0 * error + 5.0 * found.standard_error)
    assert found.share > 0.0


@pytest.mark.parametrize("seed", range(12))
def test_orientations_of_a_tool_at_b4_are_those_of_b4(seed: int) -> None:
    design, position, torsion = case_of(seed)
    zero = np.zeros(3)
    one, other = (tilt_map(design, position, torsion, 24, t) for t in (None, zero))
    np.testing.assert_array_equal(one.tilts, other.tilts)
    assert greatest_tilts(design, position, torsion, tool=zero) == pytest.approx(
        greatest_tilts(design, position, torsion), nan_ok=True, abs=0.0
    )
    shares = [orientation_share(design, position, 5000, tool=t) for t in (None, zero)]
    assert shares[0] == shares[1]


@pytest.mark.parametrize("share", [0.0, 0.3])
@pytest.mark.parametrize("seed", range(40))
def test_tilt_map_agrees_with_dense_turns(seed: int, share: float) -> None:
    design, position, torsion, tool = tool_case_of(seed, share)
    found = tilt_map(design, position, torsion, 12, tool)
    for azimuth, tilt, limit in zip(found.azimuths, found.tilts, found.limits, strict=True):
        expected = sampled_tilt(design, position, float(azimuth), torsion, tool)
        if math.isnan(expected):
            assert math.isnan(tilt)
            assert limit is not None
        else:
            assert expected - 1e-6 <= tilt <= expected + STEP + 1e-6


@pytest.mark.parametrize("share", [0.0, 0.3])
@pytest.mark.parametrize("seed", range(40))
def test_tilt_map_names_the_limit_that_is_violated_beyond(seed: int, share: float) -> None:
    design, position, torsion, tool = tool_case_of(seed, share)
    found = tilt_map(design, position, torsion, 12, tool)
    for azimuth, tilt, limit in zip(found.azimuths, found.tilts, found.limits, strict=True):
        if limit is None:
            assert tilt == 180.0
            continue
        beyond = 0.0 if math.isnan(tilt) else float(tilt) + 1e-3
        rotation = tilted(float(azimuth), np.array([beyond]), torsion)[0]
        pose = Pose.of(position - rotation @ tool, rotation)
        broken = {each.limit for each in evaluate(design, pose).violations}
        names = {limit, limit.removesuffix(" minimum").removesuffix(" maximum")}
        assert names & broken, (limit, broken)


def test_tilt_map_of_the_paper_ends_at_margins_and_the_carriage_order() -> None:
    design = PRESETS["paper-optimal"]
    found = tilt_map(design, home_pose(design).position)
    assert len(found.tilts) == 72
    assert {"margin δ1", "margin δ2", CARRIAGE_ORDER} == set(found.limits)
    # Towards the azimuth zero the carriages meet where b3 - b2 is upright.
    assert found.tilts[0] == pytest.approx(90.0, abs=1e-6)


@pytest.mark.parametrize("share", [0.0, 0.2])
@pytest.mark.parametrize("seed", range(12))
def test_greatest_tilt_is_the_least_of_a_fine_map(seed: int, share: float) -> None:
    design, position, torsion, tool = tool_case_of(seed, share)
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


@pytest.mark.parametrize("share", [0.0, 0.2])
@pytest.mark.parametrize("seed", range(16))
def test_torsion_range_agrees_with_dense_turns(seed: int, share: float) -> None:
    design, position, torsion, tool = tool_case_of(seed, share)
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


@pytest.mark.parametrize("share", [0.0, 0.2])
@pytest.mark.parametrize("seed", range(12))
def test_orientation_is_connected_to_tilt_zero_up_to_the_tilt_of_the_map(
    seed: int, share: float
) -> None:
    design, position, torsion, tool = tool_case_of(seed, share)
    found = tilt_map(design, position, torsion, 8, tool)
    for azimuth, tilt in zip(found.azimuths.tolist(), found.tilts.tolist(), strict=True):
        if math.isnan(tilt):
            start = tilted(azimuth, np.zeros(1), torsion)[0]
            assert not is_connected(design, position, start, tool=tool)
            continue
        inside, outside = tilted(azimuth, np.array([0.99 * tilt, tilt + 0.01]), torsion)
        level = tilted(0.0, np.zeros(1), torsion)[0]
        assert is_connected(design, position, inside, tool=tool)
        assert is_connected(design, position, inside, level, tool)
        if tilt < 179.9:
            assert not is_connected(design, position, outside, tool=tool)


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
    with pytest.raises(InputError, match="one tool point"):
        greatest_tilt(design, p, tool=[(0.0, 0.0, 1.0)])
    with pytest.raises(InputError, match="tool must be finite"):
        tilt_map(design, p, tool=(0.0, 0.0, math.nan))


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


def tool_dips() -> list[tuple[Design, FloatArray, FloatArray]]:
    """Return designs, positions and tools at which one limit leaves out a narrow range."""
    design = PRESETS["paper-optimal"]
    wide: dict[str, Any] = dict.fromkeys(("l1", "d2", "d4", "l4"), (0.0, 500.0))
    free = limited(design, margin=None, carriage_order="any", box=None, **wide)
    c, small = np.array(home_pose(design).position), 1.0 - 3e-4
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
        for axis in np.eye(3):
            high = np.where(axis > 0.0, c + arm * small, 99.0)
            low = np.where(axis > 0.0, c - arm * small, -99.0)
            sides += [{"box": ((-99.0,) * 3, (*high,))}, {"box": ((*low,), (99.0,) * 3)}]
        cases += [(limited(free, **side), c, t) for side in sides]
    return cases


@pytest.mark.parametrize("index", range(len(tool_dips())))
def test_greatest_tilt_of_the_tool_finds_a_dip_between_azimuths(index: int) -> None:
    design, position, tool = tool_dips()[index]
    fine = tilt_map(design, position, -40.0, 14_400, tool)
    least = fine.tilts.min()
    assert least < 179.0
    # The dip is narrow: most azimuths are free.
    assert (fine.tilts == 180.0).sum() > 13_000
    for azimuths in (5, 36, 72):
        found = float(greatest_tilts(design, position, -40.0, azimuths, tool))
        assert least - 0.05 <= found <= least + 1e-6


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
