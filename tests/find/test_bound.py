"""The bounds of all machines: no place of a3 has a shorter leg 4, and some place one as short."""

from __future__ import annotations

import itertools
import math
from typing import Any

import msgspec
import numpy as np
import pytest
from hypothesis import given, strategies as st
from needs import NEEDS, requirement_of
from scipy.spatial.transform import Rotation
from statics_cases import random_poses

from explorer import PRESETS, Tool, actuator_forces, compliance, worst_error
from explorer.find.bound import impossible_demands, least_longest_mm
from explorer.find.find import find_designs
from explorer.find.requirement import RequiredLegs, RequiredLoad, RequiredMotion, Requirement
from explorer.numerics.arrays import FloatArray, dot, lengths_of

# Share by which a bound is below the least longest leg at most.
LOOSE = 0.015


def required(**fields: Any) -> Requirement:
    """Return a requirement whose legs have the fields that are theirs."""
    own = {key: fields.pop(key) for key in [*fields] if key in RequiredLegs.__struct_fields__}
    fields.setdefault("box_mm", (200.0, 150.0, 100.0))
    return Requirement(**fields, legs=RequiredLegs(**own))


def least_cosines(legs: FloatArray, homes: FloatArray, tilt: float) -> FloatArray:
    """Return the least R v · w over tilts R of a size about all axes in the base plane, (...)."""
    part = math.sin(tilt), 1.0 - math.cos(tilt)
    even = math.cos(tilt) * dot(legs, homes)
    even += 0.5 * part[1] * dot(legs[..., :2], homes[..., :2])
    once = part[0] * np.cross(legs, homes)[..., :2]
    x, y, u, v = legs[..., 0], legs[..., 1], homes[..., 0], homes[..., 1]
    twice = 0.5 * part[1] * np.stack(np.broadcast_arrays(x * u - y * v, x * v + y * u), axis=-1)
    # A sum of waves of the azimuth and of twice the azimuth.
    sums = [
        (k, c, each[..., j]) for k, each in ((1, once), (2, twice)) for j, c in ((0, 0.0), (1, 0.5))
    ]

    def waves(azimuth: FloatArray, derivative: int) -> FloatArray:
        turned = 0.5 * math.pi * derivative
        rows = [k**derivative * a * np.cos(k * azimuth - math.pi * c + turned) for k, c, a in sums]
        return np.sum(rows, axis=0)

    # By Newton's method from a dozen azimuths.
    azimuth = np.linspace(-math.pi, math.pi, 13)[:-1, None, None]
    for _ in range(5):
        step = waves(azimuth, 1) / np.maximum(np.abs(waves(azimuth, 2)), 1e-9)
        azimuth = azimuth - np.clip(step, -0.3, 0.3)
    return even + waves(azimuth, 0).min(axis=0)


def longest_legs(centres: FloatArray, requirement: Requirement) -> FloatArray:
    """Return the longest length of leg 4 for centres of the box as seen from a3; inf if missed."""
    half = 0.5 * np.array(requirement.box_mm)
    corners = half * np.array([*itertools.product((-1.0, 1.0), repeat=3)])
    legs = centres[:, None] + corners
    longest = lengths_of(legs).max(axis=1)
    shortest = lengths_of(np.maximum(np.abs(centres) - half, 0.0))
    kept = np.abs(centres[:, 2]) >= half[2] + requirement.least_margin_mm
    kept &= longest / (requirement.legs.ratio or math.inf) <= shortest
    if requirement.swing_deg is not None:
        tilt = 0.0 if "tool" in requirement.free else math.radians(requirement.tilt_deg)
        homes = centres[kept, None]
        sizes = lengths_of(legs[kept]) * lengths_of(homes)
        cosines = least_cosines(legs[kept], homes, tilt) / sizes
        kept[kept] = (cosines >= math.cos(math.radians(requirement.swing_deg))).all(axis=1)
    return np.where(kept, longest, np.inf)


def search_longest(requirement: Requirement, seed: int) -> tuple[float, FloatArray]:
    """Return the shortest of many legs 4, and all of them, from a random search over a3."""
    rng, size = np.random.default_rng(seed), requirement.diagonal_mm + requirement.least_margin_mm
    centres = rng.normal(size=(4000, 3))
    centres *= (size * np.exp(rng.uniform(-0.5, 6.0, 4000)) / lengths_of(centres))[:, None]
    lengths = longest_legs(centres, requirement)
    best = centres[np.argsort(lengths)[::20][:8]]
    found, step = [lengths], 0.5
    for _ in range(20):
        centres = best[:, None] * np.exp(step * rng.normal(size=(1, 60, 1)))
        centres += step * lengths_of(best)[:, None, None] * rng.normal(size=(8, 60, 3))
        centres[:, 0] = best
        lengths = longest_legs(centres.reshape(-1, 3), requirement)
        found.append(lengths)
        best, step = centres[np.arange(8), lengths.reshape(8, 60).argmin(axis=1)], 0.75 * step
    every = np.concatenate(found)
    return float(every.min()), every


@st.composite
def requirements(draw: st.DrawFn) -> Requirement:
    """Draw a requirement that leg 4 can keep."""
    tilt = draw(st.sampled_from([0.0, 1.0]) | st.floats(0.0, 50.0))
    swing = draw(st.none() | st.floats(min(tilt + 3.0, 80.0), 85.0))
    ratio = draw(st.none() | st.floats(1.05, 4.0))
    box = draw(st.tuples(*[st.floats(20.0, 300.0) | st.just(0.01)] * 3))
    free = draw(st.sampled_from([("orientation",), ("tool",)]))
    margin = draw(st.none() | st.floats(0.0, 100.0))
    return required(
        box_mm=box, tilt_deg=tilt, swing_deg=swing, ratio=ratio, free=free, margin_mm=margin
    )


def test_least_cosines_are_those_of_many_tilts() -> None:
    rng = np.random.default_rng(0)
    legs, homes = rng.normal(size=(50, 8, 3)), rng.normal(size=(50, 1, 3))
    azimuths = np.radians(np.arange(0.0, 360.0, 0.5))
    axes = np.stack([np.cos(azimuths), np.sin(azimuths), 0.0 * azimuths], axis=-1)
    turned = legs @ Rotation.from_rotvec(0.7 * axes).as_matrix()[:, None]
    many = dot(turned, homes).min(axis=0)
    least = least_cosines(legs, homes, 0.7)
    assert (least <= many + 1e-6).all()
    assert np.allclose(least, many, atol=1e-3)


@given(requirements(), st.integers(0, 2**31))
def test_least_longest_leg_is_that_of_a_random_search(requirement: Requirement, seed: int) -> None:
    bound, shortest = least_longest_mm(requirement), math.inf
    # A search ends at times beside the shortest leg.
    for again in range(8):
        if shortest > bound * (1.0 + LOOSE) + 1e-6:
            found, every = search_longest(requirement, seed + again)
            assert (every >= bound).all()
            shortest = min(shortest, found)
    assert math.isfinite(shortest)
    assert shortest <= bound * (1.0 + LOOSE) + 1e-6


@pytest.mark.parametrize("need", NEEDS, ids=[need["name"] for need in NEEDS])
def test_least_longest_leg_is_near_that_of_a_grid_and_below_found_machines(
    need: dict[str, Any],
) -> None:
    bound = least_longest_mm(requirement_of(need))
    # The grid knew nothing of the base plane, which b4 cannot pass.
    assert 0.98 * need["pilot"]["bound_mm"] <= bound <= 1.06 * need["pilot"]["bound_mm"]
    assert bound <= need["pilot"]["longest_after_8_s_mm"]
    assert least_longest_mm(requirement_of(need, free=("tool",))) <= 1.003 * bound


@given(requirements(), st.floats(1.0, 1.5))
def test_least_longest_leg_grows_with_demands(requirement: Requirement, factor: float) -> None:
    legs, box = requirement.legs, requirement.box_mm
    bound = least_longest_mm(requirement)

    def harder(**fields: Any) -> float:
        return least_longest_mm(required(**asked | fields)) * 1.004

    asked = {
        "box_mm": box,
        "tilt_deg": requirement.tilt_deg,
        "swing_deg": requirement.swing_deg,
        "margin_mm": requirement.least_margin_mm,
        "free": requirement.free,
        "ratio": legs.ratio,
    }
    for axis in range(3):
        larger = [edge * (factor if axis == i else 1.0) for i, edge in enumerate(box)]
        assert harder(box_mm=tuple(larger)) >= bound
    assert harder(tilt_deg=min(60.0, requirement.tilt_deg * factor)) >= bound
    if requirement.swing_deg is not None:
        assert harder(swing_deg=requirement.swing_deg / factor) >= bound
    if legs.ratio is not None:
        assert harder(ratio=1.0 + (legs.ratio - 1.0) / factor) >= bound
        assert bound >= 0.996 * min(box) * legs.ratio / (legs.ratio - 1.0)
    assert harder(margin_mm=requirement.least_margin_mm * factor) >= bound
    all_larger = tuple(factor * edge for edge in box)
    assert harder(box_mm=all_larger, margin_mm=requirement.least_margin_mm * factor) == (
        pytest.approx(1.004 * factor * bound)
    )


def test_least_longest_leg_is_finite_just_where_leg_4_can_swing() -> None:
    for free, least in ((("orientation",), 15.0), (("tool",), 7.5)):
        bounds = [
            least_longest_mm(required(tilt_deg=15.0, swing_deg=least + more, free=free))
            for more in (1e-4, 0.01, 0.1, 1.0)
        ]
        assert np.isfinite(bounds).all()
        assert (np.diff(bounds) < 0.0).all()
        swings = required(tilt_deg=15.0, swing_deg=least, free=free)
        assert math.isinf(least_longest_mm(swings))
        assert any("swing" in clause for clause in impossible_demands(swings))


def test_search_from_a_design_with_a_tool_beside_b4_is_not_refused_for_b4() -> None:
    requirement = required(tilt_deg=15.0, swing_deg=10.0)
    start = PRESETS["paper-optimal"]
    beside = msgspec.structs.replace(start, tool=Tool((0.0, 0.0, 3.0)))
    found = [find_designs(requirement, design=each, stop=lambda: True) for each in (start, beside)]
    assert [each.status for each in found] == ["impossible", "cancelled"]
    assert math.isinf(found[0].bound_mm)
    assert math.isfinite(found[1].bound_mm)


def test_least_longest_leg_of_parts_has_its_dead_length() -> None:
    free = required(ratio=3.0)
    built = required(ratio=3.0, buildable=True)
    thick = required(ratio=3.0, buildable=True, diameter_mm=30.0)
    bounds = [least_longest_mm(each) for each in (free, required(ratio=2.0), built, thick)]
    assert bounds == sorted(bounds)
    assert bounds[3] > 1.2 * bounds[1]


def impossible(legs: dict[str, Any], **fields: Any) -> tuple[str, ...]:
    """Return the clauses on a requirement for a box of 200 × 150 × 100 mm."""
    whole = Requirement(box_mm=(200.0, 150.0, 100.0), legs=RequiredLegs(**legs), **fields)
    return impossible_demands(whole)


PUSHED, BENT = RequiredLoad(force_n=48.3), RequiredLoad(force_n=10.0)
# Legs and fields of a requirement that no machine keeps, and those of one that is not refused.
IMPOSSIBLE: list[tuple[dict[str, Any], dict[str, Any], dict[str, Any], dict[str, Any]]] = [
    ({"ratio": 1.8, "longest_mm": 287.0}, {}, {"ratio": 1.8, "longest_mm": 290.0}, {}),
    ({"diameter_mm": 2.3}, {"buildable": True}, {"diameter_mm": 2.4}, {"buildable": True}),
    ({"push_n": 10.0}, {"payload": PUSHED}, {"push_n": 10.1}, {"payload": PUSHED}),
    (
        {"speed_mm_s": 99.0},
        {"tool": RequiredMotion(100.0)},
        {"speed_mm_s": 100.0},
        {"tool": RequiredMotion(100.0)},
    ),
    ({"speed_mm_s": 150.0}, {"move_s": 0.99}, {"speed_mm_s": 150.0}, {"move_s": 1.01}),
    (
        {"acceleration_mm_s2": 600.0},
        {"move_s": 0.99},
        {"acceleration_mm_s2": 600.0},
        {"move_s": 1.01},
    ),
    ({"error_mm": 0.02}, {"error_mm": 0.019}, {"error_mm": 0.02}, {"error_mm": 0.02}),
    (
        {"stiffness_n_mm": 100.0},
        {"payload": BENT, "deflection_mm": 0.049},
        {"stiffness_n_mm": 100.0},
        {"payload": BENT, "deflection_mm": 0.051},
    ),
    ({}, {"hull_mm": 199.0}, {}, {"hull_mm": 201.0}),
]


@pytest.mark.parametrize(("legs", "fields", "other_legs", "other_fields"), IMPOSSIBLE)
def test_impossible_demands_are_told_up_to_their_bounds(
    legs: dict[str, Any],
    fields: dict[str, Any],
    other_legs: dict[str, Any],
    other_fields: dict[str, Any],
) -> None:
    assert len(impossible(legs, **fields)) == 1
    # What follows from other clauses is told whatever these are.
    assert impossible(legs, **fields | {"swing_deg": 1.0, "tilt_deg": 15.0, "hull_mm": 600.0})
    assert impossible(other_legs, **other_fields) == ()


def test_bounds_of_forces_errors_and_deflections_hold_in_random_poses() -> None:
    """No pose is better than what the clauses of impossible demands say of all machines."""
    design = PRESETS["paper-optimal"]
    positions, rotations = random_poses(design, 2000)
    rng = np.random.default_rng(1)
    directions = rng.normal(size=(2000, 3))
    loads = np.concatenate([directions / lengths_of(directions)[:, None], np.zeros((2000, 3))], 1)
    forces = np.abs(actuator_forces(design, positions, rotations, loads)).max(axis=-1)
    assert (forces * (2.0 + math.sqrt(8.0)) >= 1.0).all()
    errors, _ = worst_error(design, positions, rotations, np.ones(6))
    assert (errors >= 1.0 - 1e-9).all()
    soft = compliance(design, positions, rotations, np.ones(6))[:, :3, :3]
    assert (np.linalg.eigvalsh(soft)[:, -1] >= 0.5 - 1e-9).all()
