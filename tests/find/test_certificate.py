"""Proofs over a box and all tilts: no pose exceeds what is proven, and worst poses are attained."""

from __future__ import annotations

import math
from typing import Any

import numpy as np
import pytest

from explorer import Configuration, Design, Tool, inverse, leg_clearances, margins
from explorer.find import machine_values as m
from explorer.find.certificate import certify
from explorer.find.demands import demands_of, limits_of
from explorer.find.improvement import STEP, Improvement
from explorer.find.machine_values import HOME
from explorer.find.over_poses import ends_of, prove_demand, sample_demand
from explorer.find.over_tilts import prove_limits
from explorer.find.requirement import (
    RequiredLegs,
    RequiredLoad,
    RequiredMotion,
    Requirement,
)
from explorer.find.terms import Terms, design_of, row_of
from explorer.measures.snapshot import PoseIndices
from explorer.motion.inverse_jacobian import twists_of_actuators
from explorer.numerics.affine import Affine, largest_norm
from explorer.numerics.arrays import FloatArray

EVERYTHING = Requirement(
    box_mm=(200.0, 150.0, 100.0),
    tilt_deg=15.0,
    payload=RequiredLoad(2.0, (0.0, 0.0, 30.0), 5.0),
    legs=RequiredLegs(
        ratio=1.8,
        push_n=300.0,
        pull_n=200.0,
        speed_mm_s=500.0,
        diameter_mm=16.0,
        apart_mm=5.0,
        stiffness_n_mm=100.0,
        error_mm=0.05,
    ),
    swing_deg=45.0,
    tool=RequiredMotion(100.0, 30.0),
    transmission=0.01,
    error_mm=50.0,
    deflection_mm=5.0,
)


def random_machine(random: np.random.Generator, *, tool: bool) -> FloatArray:
    """Return a machine that no limit bounds, with the box above the base."""
    x = np.ones(m.VARIABLES)
    x[: m.HX] = 1.5 * random.normal(size=6)
    x[m.HX : m.BOX_YAW] = *0.3 * random.normal(size=2), 1.5 + random.random()
    x[m.BOX_YAW : m.TX] = random.normal(size=4) * [0.6, 0.6, 0.2, 0.2]
    x[m.TX : m.TILT] = 0.2 * random.normal(size=3) if tool else 0.0
    return x


def random_poses(random: np.random.Generator, terms: Terms, count: int) -> FloatArray:
    """Return poses over the box, a part of them at the ends of their ranges, shape (n, 5)."""
    lows, highs = ends_of(terms)
    places = random.uniform(lows, highs, (count, 5))
    at_ends = random.random(places.shape) < 0.3
    return np.where(at_ends, np.where(places > 0.5 * (lows + highs), highs, lows), places)


@pytest.mark.parametrize("seed", range(6))
def test_machine_values_are_those_of_configurations(seed: int) -> None:
    random = np.random.default_rng(seed)
    terms = Terms.of(EVERYTHING)
    x = random_machine(random, tool=seed % 2 == 0)
    at = terms.values(x, random_poses(random, terms, 20))
    design = Design(
        a3=(x[0], x[1]), b1=(x[2], x[3]), b2=x[4], b3=x[5], tool=Tool(tuple(x[m.TX : m.TILT]))
    )
    axes = [np.stack(np.broadcast_arrays(*each), axis=-1) for each in (at.u, at.v, at.w)]
    rotation = np.stack(axes, axis=-1)
    p = np.stack(np.broadcast_arrays(*at.p), axis=-1)
    pose = Configuration(design, p, rotation, design.tool.position)
    joints = inverse(design, p, rotation)
    assert np.stack(at.lengths, axis=-1) == pytest.approx(joints[:, [0, 2, 4, 5]], rel=1e-12)
    assert np.stack(at.margins, axis=-1) == pytest.approx(margins(p, rotation), abs=1e-12)
    distances = np.stack(at.distances, axis=-1)
    assert distances == pytest.approx(leg_clearances(pose).distance, abs=1e-9)
    twists = twists_of_actuators(pose)
    moves = [np.stack(np.broadcast_arrays(*v), axis=-1) for v in at.velocities]
    turns = [np.stack(np.broadcast_arrays(*w), axis=-1) for w in at.turnings]
    own = np.concatenate([np.stack(moves, axis=-1), np.stack(turns, axis=-1)], axis=1)
    size = np.abs(twists).max(axis=(1, 2), keepdims=True)
    assert own / size == pytest.approx(twists / size, abs=1e-11)
    indices = PoseIndices(design, p, rotation).transmissions
    assert np.stack(at.transmissions, axis=-1) == pytest.approx(indices, rel=1e-9)


def test_machine_values_with_an_imaginary_step_are_derivatives() -> None:
    random = np.random.default_rng(3)
    terms = Terms.of(EVERYTHING)
    x = random_machine(random, tool=True)
    poses = random_poses(random, terms, 5)

    def values(machine: Any) -> Any:
        at = terms.values(machine, poses)
        rows = [*at.lengths, *at.margins, *at.distances, *at.tool_speeds, *at.transmissions]
        rows += [*at.swings, *at.along_home]
        return np.stack([np.broadcast_to(row, (5,)) for row in rows])

    for index in range(len(x)):
        step = np.zeros(len(x))
        step[index] = 1e-6
        slope = values(x + 1j * STEP / 1e-6 * step).imag / STEP
        difference = (values(x + step) - values(x - step)) / 2e-6
        assert slope == pytest.approx(difference, rel=1e-4, abs=1e-5 * np.abs(slope).max() + 1e-7)


@pytest.mark.parametrize("seed", range(8))
def test_limits_over_tilts_exceed_no_bound_and_are_attained(seed: int) -> None:
    random = np.random.default_rng(seed)
    terms = Terms.of(EVERYTHING)
    x = random_machine(random, tool=seed % 2 == 0)
    poses = random_poses(random, terms, 4000)
    at = terms.values(x, poses)
    lengths = np.array(at.lengths)
    ranges = np.column_stack([lengths.min(axis=1), lengths.max(axis=1)])
    found = prove_limits(x, terms, ranges)
    legs = np.array([at.lengths[i] for i in (0, 3, 0, 1, 2, 3)])
    missed = [*(lengths - ranges[:, 1:]), *(ranges[:, :1] - lengths)]
    sides = np.ravel(at.sides)
    missed += [terms.margin - side * each for side, each in zip(sides, at.margins, strict=False)]
    missed.append(-sides[3] * np.broadcast_to(at.order, lengths[0].shape))
    at_home = np.array([at.home.lengths[i] for i in (0, 3, 0, 1, 2, 3)])
    missed += [*((math.cos(terms.swing) - np.array(at.swings)) * legs / at_home)]
    largest = np.array([each.max() for each in missed])
    assert (largest <= found.bounds + 1e-12).all()
    assert (found.values <= found.bounds + 1e-12).all()
    # What is missed is known well, with the pose where.
    over = found.values > 0.0
    assert found.bounds[over] == pytest.approx(found.values[over], rel=2e-3, abs=1e-9)
    worst = terms.values(x, found.places)
    over_poses = np.array(worst.lengths).T
    for index in range(8):
        length = over_poses[index, index % 4]
        attained = length - ranges[index, 1] if index < 4 else ranges[index - 4, 0] - length
        assert attained == pytest.approx(found.values[index], abs=1e-9)
    rows = np.concatenate([each.missed_rows(worst) for each in limits_of(terms)], axis=1)
    assert np.diag(rows[8:]) == pytest.approx(found.values[8:], abs=1e-9)


@pytest.mark.parametrize("seed", range(6))
def test_demands_over_cells_exceed_no_bound(seed: int) -> None:
    random = np.random.default_rng(seed)
    terms = Terms.of(EVERYTHING)
    x = random_machine(random, tool=seed % 2 == 0)
    at = terms.values(x, random_poses(random, terms, 4000))
    is_looked_at = False
    for demand in demands_of(terms):
        with np.errstate(all="ignore"):
            found = prove_demand(demand, x, terms, 3000)
            worst = demand.missed_rows(at).max(axis=0)
        within = found.values <= 0.0
        assert (worst <= found.bounds + 1e-9)[within].all(), demand.name
        is_looked_at |= bool(within.any())
    assert is_looked_at


def test_demands_sampled_find_the_worst_of_many_poses() -> None:
    random = np.random.default_rng(0)
    terms = Terms.of(EVERYTHING)
    x = random_machine(random, tool=True)
    at = terms.values(x, random_poses(random, terms, 20_000))
    for demand in demands_of(terms):
        found = sample_demand(demand, x, terms, 2000, HOME)
        worst = demand.missed_rows(at).max(axis=0)
        assert (found.values >= worst - 0.01 * np.abs(worst) - 1e-3).all()


def test_demands_tell_their_values_in_their_units() -> None:
    random = np.random.default_rng(4)
    terms = Terms.of(EVERYTHING)
    x, pose = random_machine(random, tool=False), random_poses(random, terms, 1)
    at = terms.values(x, pose)
    told = {
        demand.name: (demand.told(np.zeros(1)), demand.told(demand.missed_rows(at)[0]))
        for demand in (*limits_of(terms), *demands_of(terms))
    }
    size = terms.scale_mm
    limits = {name: float(limit[0]) for name, (limit, _) in told.items()}
    assert limits == pytest.approx(
        {
            "margin": EVERYTHING.least_margin_mm,
            "carriage order": 0.0,
            "swing": 45.0,
            "clearance": 5.0,
            "force": 200.0,
            "speed": 500.0,
            "transmission index": 0.01,
            "error": 50.0,
            "deflection": 5.0,
        }
    )
    assert told["margin"][1] == pytest.approx(size * np.ravel(at.sides)[:3] * np.ravel(at.margins))
    assert told["clearance"][1] == pytest.approx(size * np.ravel(at.distances) - 16.0)
    assert told["transmission index"][1] == pytest.approx(np.ravel(at.transmissions))
    error = 0.05 * np.abs(np.ravel(at.tool_speeds)).sum()
    assert 0.0 < told["error"][1][0] <= error


def test_affine_forms_bound_formulas_with_an_error_of_second_order() -> None:
    random = np.random.default_rng(1)
    centre, slopes = random.uniform(1.0, 2.0, (2, 50)), random.normal(size=(2, 50, 3))

    def width(size: float) -> float:
        x, y = (Affine(c, size * s, np.zeros(50)) for c, s in zip(centre, slopes, strict=True))
        form = (x * y - 2.0 * x + 1.0 / y) / (x * x + y * y).root()
        most = largest_norm(x, y, x - y)
        for _ in range(200):
            e = random.uniform(-1.0, 1.0, (50, 3))
            u, v = (c + size * (s * e).sum(axis=1) for c, s in zip(centre, slopes, strict=True))
            value = (u * v - 2.0 * u + 1.0 / v) / np.hypot(u, v)
            assert (value <= form.upper + 1e-12).all()
            assert (value >= form.lower - 1e-12).all()
            assert (np.sqrt(u * u + v * v + (u - v) ** 2) <= most + 1e-12).all()
        return float(form.rest.max())

    assert width(1e-2) < 0.02 * width(1e-1)


@pytest.mark.parametrize("tilt", [0.0, 12.0])
def test_row_of_a_design_is_the_machine_that_it_was_made_of(tilt: float) -> None:
    random = np.random.default_rng(5)
    terms = Terms.of(Requirement(box_mm=(120.0, 80.0, 5.0), tilt_deg=tilt, swing_deg=60.0))
    x = random_machine(random, tool=True)
    design = design_of(x, terms, np.tile([0.1, 9.0], (4, 1)), "machine")
    assert row_of(design, terms) == pytest.approx(x, rel=1e-9, abs=1e-9)
    certificate = certify(x, terms)
    assert (certificate.ranges[:, 0] < certificate.ranges[:, 1]).all()


def test_bounds_of_an_improvement_are_kept_at_its_start() -> None:
    random = np.random.default_rng(2)
    terms = Terms.of(EVERYTHING)
    x = random_machine(random, tool=False)
    assert math.isfinite(Improvement(terms, "balanced", x).cost(HOME))
