"""A required box on or across a singular plane, where no unique forces hold a load."""

from __future__ import annotations

import math
import warnings
from collections.abc import Iterator
from typing import Any

import msgspec
import numpy as np
import pytest
from machines import same_for_all

from explorer import Actuators, Design, Payload, Struts
from explorer.measures.catalogue import measure_design
from explorer.measures.measure import Case
from explorer.mechanism.design import Triple
from explorer.mechanism.design_file import PRESETS
from explorer.mechanism.margins import margins
from explorer.mechanism.pose import Pose
from explorer.numerics.arrays import FloatArray
from explorer.optimise.conflicts import find_conflicts
from explorer.optimise.defaults import make_problem
from explorer.optimise.outcome import Outcome
from explorer.optimise.problem import (
    OF_THE_MACHINE,
    OVER_BOX,
    SHIFTS,
    Box,
    ObjectiveName,
    Problem,
    Variable,
)
from explorer.optimise.solver import optimise_design

pytestmark = pytest.mark.usefixtures("warm_kernels")

OPTIMAL = PRESETS["paper-optimal"]
DEMANDS: tuple[dict[str, Any], ...] = (
    {"held": True},
    {"error": 0.01},
    {"deflection": 0.05},
    {"acceleration": 2.0},
)
# Places of the near face of a box, beyond a plane where they are negative.
BESIDE = (-0.5, -1e-3, -1e-9, 0.0, 1e-9, 1e-3)
# Orientations by yaw, pitch and roll; where the platform is level, all planes are the same.
TURNS = ((-73.1, 0.0, 0.0), (-70.0, 12.0, -8.0), (35.0, -20.0, 25.0))


def machine(turn: Triple = TURNS[0], margin: float | None = None, source: Any = None) -> Design:
    """Return a design with a load, limits, errors and stiffness, at an orientation."""
    start = OPTIMAL if source is None else source
    return msgspec.structs.replace(
        start,
        home=Pose.of_yaw_pitch_roll((10.0, 5.0, 9.0), turn),
        limits=msgspec.structs.replace(start.limits, box=None, margin=margin),
        payload=Payload(1.0, force_n=10.0),
        actuators=Actuators(
            push_n=same_for_all(150.0),
            error_mm=same_for_all(0.02),
            stiffness_n_mm=same_for_all(900.0),
        ),
        struts=Struts(outer_mm=12.0),
    )


def planes(rotation: FloatArray) -> FloatArray:
    """Return the gradients of the margins by the position, which is linear, in rows."""
    return margins(np.eye(3), rotation).T


def least_over(box: Box, rotation: FloatArray) -> FloatArray:
    """Return the least |δ| over a box by its middle and its half edges, shape (3,)."""
    lows, highs = np.array(box)
    normals = planes(rotation)
    away = np.abs(normals @ (0.5 * (lows + highs))) - np.abs(normals) @ (0.5 * (highs - lows))
    return np.maximum(0.0, away)


def boxes_at(design: Design, index: int, place: float) -> Box:
    """Return a box whose worst corner has a margin, on the home's side of a plane or beyond."""
    rotation = design.home_pose.rotation
    normal = planes(rotation)[index]
    # Far along the plane of each margin, so that the box touches no other.
    middle = np.array([10.0, 5.0, 9.0])
    side = math.copysign(1.0, float(normal @ middle))
    half = np.array([0.8, 0.6, 1.0])
    wanted = place + float(np.abs(normal) @ half)
    middle = middle + normal * (side * wanted - normal @ middle) / float(normal @ normal)
    low, high = (middle - half).tolist(), (middle + half).tolist()
    return (low[0], low[1], low[2]), (high[0], high[1], high[2])


def problem_of(
    design: Design, box: Box, objective: ObjectiveName, free: tuple[str, ...] = (), **demands: Any
) -> Problem:
    """Return a problem over a required box."""
    needs_volume = objective in ("match-volume", "smallest-reach")
    if objective == "largest-margin" and not free:
        free = ("yaw",)
    return make_problem(
        design,
        objective,
        volume=3000.0 if needs_volume else None,
        reach=25.0 if objective == "largest-volume" else None,
        required_box=box,
        free=free,
        **demands,
    )


def counting(design: Design, box: Box) -> Iterator[Problem]:
    """Yield a problem with each objective, and each demand, that counts forces or errors."""
    for objective in OF_THE_MACHINE:
        yield problem_of(design, box, objective)
    for demand in DEMANDS:
        yield problem_of(design, box, "largest-volume", **demand)


def search(problem: Problem, iterations: int) -> Outcome:
    """Return the outcome of a search that may not warn."""
    with warnings.catch_warnings():
        warnings.simplefilter("error")
        return optimise_design(problem, iterations=iterations)


@pytest.mark.parametrize("seed", range(2))
def test_margin_over_a_box_is_the_least_over_all_of_it(seed: int) -> None:
    rng = np.random.default_rng(seed)
    for _ in range(12):
        design = machine(tuple(rng.uniform(-180.0, 180.0, 3).tolist()))
        index, place = int(rng.integers(3)), float(rng.choice(BESIDE))
        box = boxes_at(design, index, place)
        case = Case(design, box=box)
        least = least_over(box, case.rotation)
        names = ("box_margin", "load_share", "worst_error", "deflection")
        measured = measure_design(case, names)
        assert measured["box_margin"] == pytest.approx(least.min(), abs=1e-13)
        inner = rng.uniform(box[0], box[1], (200, 3))
        assert (measured["box_margin"] or 0.0) <= np.abs(margins(inner, case.rotation)).min()
        on_plane = bool((least <= 1e-12).any())
        assert measured.infinite == (names[1:] if on_plane else ())


@pytest.mark.parametrize("index", range(3))
def test_box_on_or_across_a_plane_is_refused_where_forces_or_errors_count(index: int) -> None:
    design = machine(TURNS[index], (None, 0.0, None)[index])
    for place in BESIDE:
        box = boxes_at(design, index, place)
        is_singular = bool((least_over(box, design.home_pose.rotation) <= 1e-12).any())
        assert is_singular or place > 0.0
        for problem in counting(design, box):
            found = [each for each in find_conflicts(problem) if each.limit == "singular plane"]
            assert bool(found) == is_singular, (problem.objective, problem.demands, place)


@pytest.mark.parametrize(
    ("index", "objective"), list(enumerate([*OVER_BOX, "smallest-reach", "largest-volume"]))
)
def test_search_over_a_singular_box_never_converges_where_forces_or_errors_count(
    index: int, objective: ObjectiveName
) -> None:
    rng = np.random.default_rng(index)
    for place in (-0.5, 0.0):
        demand = DEMANDS[int(rng.integers(len(DEMANDS)))]
        own = np.array(OPTIMAL.variables) * rng.uniform(0.8, 1.25, 6)
        design = machine(
            TURNS[int(rng.integers(3))],
            [None, 0.0][int(rng.integers(2))],
            OPTIMAL.with_variables(own.tolist()),
        )
        box = boxes_at(design, index % 3, place)
        problem = problem_of(design, box, objective, **demand)
        outcome = search(problem, 6)
        measured = measure_design(
            Case(outcome.design, box=problem.required_box_at(outcome.best.values)), ["worst_error"]
        )
        assert outcome.converged <= (measured["worst_error"] is not None)
        assert all(each.objective is not None or each.spare < 0.0 for each in outcome.history)
        if objective in OF_THE_MACHINE:
            assert outcome.best.objective is None
            assert "infinite" in outcome.message


@pytest.mark.parametrize(("objective", "turn"), list(zip(OF_THE_MACHINE, TURNS, strict=True)))
def test_search_moves_a_box_off_a_singular_plane_where_it_may(
    objective: ObjectiveName, turn: Triple
) -> None:
    design = machine(turn)
    problem = make_problem(
        design,
        objective,
        required_box=boxes_at(design, 2, 0.0),
        bounds=[Variable(name, -8.0, 8.0) for name in SHIFTS],
    )
    shifts = tuple(each for each in problem.variables if each.name in SHIFTS)
    problem = msgspec.structs.replace(problem, variables=shifts)
    assert not find_conflicts(problem)
    best = search(problem, 80).best
    assert best.objective is not None
    assert math.isfinite(best.objective)
    box = problem.required_box_at(best.values)
    assert least_over(box, best.design.home_pose.rotation).min() > 0.0
    assert best.spare >= 0.0
