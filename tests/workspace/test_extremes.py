"""Extents and least margins: proofs by branch and bound, scaling, coincident and tangent limits."""

from __future__ import annotations

import itertools
import json
import math
from collections.abc import Callable, Iterable
from typing import Any

import msgspec
import numpy as np
import pytest
from limited_designs import (
    limited,
    ordinary_case,
    reference_case,
    scaled_design,
    shell_case,
    thin_case,
    troubled_case,
)
from long_cases import long_after
from reference import read_reference
from scipy.spatial.transform import Rotation

from explorer import Design, Limits, Pose
from explorer.measures.measure import Case
from explorer.mechanism.design import LENGTHS, Swing
from explorer.mechanism.design_file import decode_design
from explorer.mechanism.margins import planes_of_singularity
from explorer.numerics.arrays import BoolArray, FloatArray
from explorer.workspace.extremes import extent_of, extremes_of, least_margins
from explorer.workspace.limits.constraints import (
    BallOrCylinder,
    Cone,
    Constraint,
    HalfSpace,
    slacks,
)
from explorer.workspace.limits.region import region_of
from explorer.workspace.workspace import Workspace

CORNERS = np.array([*itertools.product((-0.5, 0.5), repeat=3)])
STALLING = [
    (decode_design(json.dumps(row["design"]).encode(), "defects_extent.json"), row["lowest_z"])
    for row in read_reference("defects_extent")["workspaces"]
]


def at_home(design: Design, rotation: FloatArray | None) -> tuple[Design, FloatArray]:
    """Return a design whose home has a rotation, if there is one, and the home's rotation."""
    if rotation is None:
        return design, design.home_pose.rotation
    home = Pose.of(design.home_pose.position, rotation)
    return msgspec.structs.replace(design, home=home), home.rotation


def with_swings(design: Design, seed: int) -> Design:
    """Return a design some of whose joints swing by random or by round angles."""
    rng = np.random.default_rng([99, seed])
    names = rng.choice(["a1", "a3", "b1", "b2", "b3", "b4"], int(rng.integers(1, 7)), replace=False)
    angles = rng.choice([20.0, 50.0, 90.0, 130.0, *rng.uniform(10.0, 150.0, 4)], len(names))
    return limited(design, swing=Swing(**dict(zip(names.tolist(), angles.tolist(), strict=True))))


def cone_case(seed: int) -> tuple[Design, FloatArray]:
    """Return a design with cones, without a box and guide for odd seeds, and a rotation."""
    design, rotation = ordinary_case(seed)
    design = with_swings(design, seed)
    return limited(design, box=None, guide=None, margin=0.0) if seed % 2 else design, rotation


def whole_case(seed: int) -> tuple[Design, FloatArray]:
    """Return a design of whole numbers, whose limits often touch or coincide, and a rotation."""
    rng = np.random.default_rng([5, seed])

    def whole(low: int, high: int) -> float:
        return float(rng.integers(low, high + 1))

    def away(most: int) -> float:
        return float(rng.choice([-1.0, 1.0])) * whole(1, most)

    limits: dict[str, Any] = {"margin": (None, 0.0, 1.0)[int(rng.integers(3))]}
    for name in LENGTHS:
        high = whole(3, 13)
        limits[name] = (whole(1, int(high) - 1) if rng.random() < 0.5 else 0.0, high)
    if rng.random() < 0.5:
        limits["guide"] = (-whole(0, 8), whole(1, 8))
    if rng.random() < 0.5:
        lows = tuple(-whole(0, 6) for _ in range(3))
        limits["box"] = (lows, tuple(whole(1, 6) for _ in range(3)))
    b2 = whole(-4, 4)
    turns = Rotation.from_euler("ZYX", 0.5 * math.pi * rng.integers(0, 4, 3))
    rotation = (
        np.round(turns.as_matrix()) + 0.0,
        np.round(turns.as_matrix()) @ [[0.6, -0.8, 0.0], [0.8, 0.6, 0.0], [0.0, 0.0, 1.0]],
        # Both cylinders have the guide as their axis.
        Rotation.from_euler("X", float(rng.uniform(-3.0, 3.0))).as_matrix(),
        Rotation.from_euler("ZYX", 30.0 * rng.integers(0, 12, 3), degrees=True).as_matrix(),
    )[seed % 4]
    design = Design(
        a3=(whole(-6, 6), away(6)),
        b1=(whole(-4, 4), away(4)),
        b2=b2,
        b3=b2 + away(4),
        limits=Limits(**limits),
        home=Pose.of((whole(-3, 5), whole(-3, 5), whole(1, 6)), rotation),
    )
    return with_swings(design, seed) if seed % 3 == 0 else design, rotation


CASES: dict[str, Callable[[int], tuple[Design, FloatArray | None]]] = {
    "ordinary": ordinary_case,
    "shells": shell_case,
    "thin": thin_case,
    "troubled": troubled_case,
    "cones": cone_case,
    "whole": whole_case,
    "reference": lambda index: reference_case(index)[:2],
}
# A case of "whole" numbers needs far more boxes than the others.
SEEDS = long_after(14, [(name, seed) for seed in (1, 4, 0, 2, 3, 5, 6, 7) for name in CASES])


def cells_may_hold(limit: Constraint, centres: FloatArray, half: FloatArray) -> BoolArray:
    """Return whether boxes with centres (n, 3) and half edges (3,) may meet a limit's solid."""
    match limit:
        case BallOrCylinder():
            start = 0 if limit.is_ball else 1
            off = np.abs(centres - limit.centre)[:, start:]
            if limit.inside:
                nearest = np.linalg.norm(np.maximum(off - half[start:], 0.0), axis=1)
                return np.asarray(nearest <= limit.radius)
            return np.asarray(np.linalg.norm(off + half[start:], axis=1) >= limit.radius)
        case HalfSpace():
            return centres @ limit.normal - half @ np.abs(limit.normal) <= limit.offset
        case Cone():
            leg = (centres - limit.apex) * ([0.0, 1.0, 1.0] if limit.flat else 1.0)
            beyond = np.clip(-limit.slack(centres), 0.0, 0.5 * math.pi)
            return np.linalg.norm(leg, axis=1) * np.sin(beyond) <= np.linalg.norm(half)
        case _:
            return np.zeros(len(centres), dtype=np.bool_)


def is_proven_empty(limits: Iterable[Constraint], resolution: float) -> bool:
    """Return whether division into ever smaller boxes proves that no position meets all limits."""
    limits = [*limits]
    lows, highs = region_of(limits).ends
    for limit in limits:
        if isinstance(limit, HalfSpace):
            axis = int(np.abs(limit.normal).argmax())
            slope, rest = float(limit.normal[axis]), np.delete(limit.normal, axis)
            if np.abs(rest).max() <= 1e-12 * abs(slope):
                end = limit.offset / slope
                if slope > 0.0:
                    highs[axis] = min(highs[axis], end + resolution)
                else:
                    lows[axis] = max(lows[axis], end - resolution)
    if not (lows < highs).all():
        return True
    centres, half = (0.5 * (lows + highs))[None], 0.5 * (highs - lows)
    while len(centres) < 500_000 and half.max() > resolution:
        half = 0.5 * half
        centres = (centres[:, None] + 2.0 * half * CORNERS).reshape(-1, 3)
        for limit in limits:
            centres = centres[cells_may_hold(limit, centres, half)]
        if not len(centres):
            return True
    return False


def size_of(limits: tuple[Constraint, ...]) -> float:
    lows, highs = region_of(limits).ends
    return float(np.linalg.norm(highs - lows))


@pytest.mark.parametrize("case", SEEDS)
def test_extent_is_reached_and_nothing_lies_beyond(case: tuple[str, int]) -> None:
    design, rotation = at_home(*CASES[case[0]](case[1]))
    limits = Workspace(design, rotation).limits
    ends = extent_of(Workspace(design, rotation))
    if ends is None:
        assert is_proven_empty(limits, 1e-5 * size_of(limits))
        return
    size = size_of(limits)
    points = extremes_of(limits, region_of(limits), design.reach)
    units = [1.0 if isinstance(limit, Cone) else size for limit in limits]
    assert (slacks(limits, points) >= -1e-10 * np.array(units)).all()
    for axis, end in ((axis, end) for axis in range(3) for end in (0, 1)):
        side, level = (-1.0, 1.0)[end], float(ends[end][axis])
        assert level in points[:, axis]
        beyond = HalfSpace("beyond", -side * np.eye(3)[axis], -side * level - 1e-4 * size)
        assert is_proven_empty([*limits, beyond], 1e-6 * size), "xyz"[axis]


@pytest.mark.parametrize("case", SEEDS)
def test_least_margins_are_reached_and_none_is_less(case: tuple[str, int]) -> None:
    design, rotation = at_home(*CASES[case[0]](case[1]))
    design = limited(design, margin=None if case[1] % 2 else design.limits.margin)
    limits, gradients = Workspace(design, rotation).limits, planes_of_singularity(rotation)
    least = least_margins(Workspace(design, rotation))
    assert (least is None) == (extent_of(Workspace(design, rotation)) is None)
    if least is None:
        return
    size = size_of(limits)
    points = extremes_of(limits, region_of(limits), design.reach, gradients)
    reached = np.abs(points @ gradients.T).min(axis=0)
    np.testing.assert_allclose(least, reached, atol=1e-10 * design.reach)
    demanded = design.limits.margin or 0.0
    for gradient, value in zip(gradients, least.tolist(), strict=True):
        assert value >= demanded * (1.0 - 1e-9)
        less = value - 1e-4 * size * float(np.linalg.norm(gradient))
        if less > demanded:
            near = [HalfSpace("near", side * gradient, less) for side in (-1.0, 1.0)]
            assert is_proven_empty([*limits, *near], 1e-6 * size)


@pytest.mark.parametrize("factor", [1e-3, 0.5, 1.0, 1e3])
@pytest.mark.parametrize(("design", "lowest"), STALLING)
def test_extents_and_least_margins_of_scaled_designs_are_exact(
    design: Design, lowest: float, factor: float
) -> None:
    """On the meshes of these designs a descent stalls before it is at the lowest position."""
    case = Case(scaled_design(design, factor))
    lows, highs = np.array(extent_of(Workspace(design, design.home_pose.rotation)))
    assert lows[2] == pytest.approx(lowest, abs=2e-8 * design.reach)
    near = 1e-9 * design.reach
    np.testing.assert_allclose(case.extent / factor, highs - lows, atol=near)
    least, more = (least_margins(Workspace(each, case.rotation)) for each in (design, case.design))
    assert least is not None
    assert more is not None
    np.testing.assert_allclose(more / factor, least, rtol=0.0, atol=near)


def test_extent_of_ball_cut_at_its_top_is_that_of_the_cut() -> None:
    """The box touches the ball of l4, leaves a sliver of it, or cuts it in the middle."""
    design = Design(
        a3=(0.0, 5.0), b1=(1.0, 1.0), b2=1.0, b3=2.0, limits=Limits(l4=(0.0, 1.0), margin=None)
    )
    quarter = np.array([[0.0, -1.0, 0.0], [1.0, 0.0, 0.0], [0.0, 0.0, 1.0]])
    for height in (1e-9, 1e-6, 1e-3, 0.5, 1.0):
        cut = limited(
            design,
            l1=(0.0, 9.0),
            d2=(0.0, 9.0),
            d4=(0.0, 9.0),
            box=((-2.0, 3.0, 1.0 - height), (2.0, 7.0, 2.0)),
        )
        ends = extent_of(Workspace(cut, quarter))
        assert ends is not None
        wide = math.sqrt(height * (2.0 - height))
        np.testing.assert_allclose(ends[0], [-wide, 5.0 - wide, 1.0 - height], atol=1e-8)
        np.testing.assert_allclose(ends[1], [wide, 5.0 + wide, 1.0], atol=1e-8)
    assert (
        extent_of(Workspace(limited(design, box=((-2.0, 3.0, 1.1), (2.0, 7.0, 2.0))), quarter))
        is None
    )


@pytest.mark.parametrize(("platform", "shortest"), [(100.0, 0.0), (140.0, 250.0), (60.0, 250.0)])
def test_extremes_of_balls_that_meet_by_symmetry_are_found(
    platform: float, shortest: float
) -> None:
    # The balls of an octahedral table: six centres in a plane, and extremes on three of them.
    longest, corners = 400.0, 2.0 * math.pi / 3.0 * np.array([0, 1, 1, 2, 2, 0])
    tips = math.pi / 3.0 * np.array([1, 1, 3, 3, 5, 5])
    centres = 200.0 * np.exp(1j * corners) - platform * np.exp(1j * tips)
    limits = [
        BallOrCylinder(f"{k} {inside}", np.array([c.real, c.imag, 0.0]), radius, True, inside)
        for k, c in enumerate(centres.tolist())
        for radius, inside in ((longest, True), (shortest, False))
        if radius
    ]
    points = extremes_of(limits, region_of(limits), longest)
    assert slacks(limits, points).min() >= -1e-6
    # On the axis all six legs are longest.
    highest = math.sqrt(longest**2 - abs(centres[0]) ** 2)
    assert points[:, 2].max() == pytest.approx(highest, rel=1e-12)
    assert points[:, 2].min() == pytest.approx(-highest, rel=1e-12)
    random = np.random.default_rng(0).uniform(-longest, longest, (1_000_000, 3))
    kept = random[(slacks(limits, random) >= 0.0).all(axis=1)]
    beyond = np.maximum(
        kept.max(axis=0) - points.max(axis=0), points.min(axis=0) - kept.min(axis=0)
    )
    assert beyond.max() <= 0.0
    # Nor are they far beyond it.
    assert (np.ptp(kept, axis=0) >= 0.95 * np.ptp(points, axis=0)).all()
