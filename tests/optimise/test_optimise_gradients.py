"""Every objective and every demand has the gradient that central differences show."""

from __future__ import annotations

from collections.abc import Iterator

import msgspec
import numpy as np
import pytest
from hypothesis import settings
from limited_designs import limited
from numpy.testing import assert_allclose

from explorer import PRESETS, Actuators, Design, Guide, Payload, Struts, Tool, make_problem
from explorer.errors import DesignError
from explorer.mechanism.design import Range
from explorer.mechanism.pose import Pose
from explorer.numerics.arrays import FloatArray
from explorer.numerics.compiled import warm
from explorer.optimise.problem import OBJECTIVES, OVER_BOX, ObjectiveName, Problem
from explorer.optimise.search.model import Evaluation, SearchModel

# Places at which gradients are compared: one each day, twelve with all tests.
POINTS = settings().max_examples // 25
STEP = 1e-6
# Of a gradient's largest entry, or of one if that is less.
TOLERANCE = 1e-5

OPTIMAL = PRESETS["paper-optimal"]
REQUIRED = ((8.0, 4.0, 6.0), (12.0, 8.0, 10.0))


def many_limits() -> Design:
    """Return a design with every limit there is a gradient for."""
    lengths: dict[str, Range] = {"l1": (6.0, None), "d2": (2.0, None), "l4": (3.0, None)}
    return limited(
        OPTIMAL, **lengths, guide=(-5.0, 25.0), gap=0.2, margin=0.5, leg_radii=(0.1, 0.2, 0.1, 0.3)
    )


def tilted() -> Design:
    """Return a design whose platform is not level."""
    return msgspec.structs.replace(
        OPTIMAL, home=Pose.of_yaw_pitch_roll((10.0, 5.0, 9.0), (-70.0, 12.0, 8.0))
    )


def loaded(design: Design) -> Design:
    """Return a design with a load, limits of all its parts, and errors."""
    return msgspec.structs.replace(
        design,
        tool=Tool((1.0, -1.0, 2.0)),
        payload=Payload(2.0, (1.0, 2.0, 3.0), 7.0),
        gravity=(0.1, -0.2, -1.0),
        actuators=Actuators(
            push_n=(60.0, 50.0, 40.0, 50.0, 45.0, 70.0),
            pull_n=(30.0, 40.0, 50.0, 60.0, 70.0, 80.0),
            error_mm=(0.01, 0.02, 0.01, 0.02, 0.03, 0.02),
            stiffness_n_mm=(900.0, 1100.0, 700.0, 1300.0, 800.0, 1000.0),
        ),
        struts=Struts(outer_mm=10.0, moment_nm=2.0),
        guide=Guide(force_n=70.0, moment_nm=1.9),
    )


DESIGNS = {
    "paper-optimal": loaded(OPTIMAL),
    "many limits": loaded(many_limits()),
    "tilted": loaded(tilted()),
}
FREE = (("yaw", "shift-x", "shift-y", "shift-z"), ("yaw", "reach", "shift-z"))


def problems(name: str) -> Iterator[Problem]:
    """Yield problems with every demand there is."""
    for free, ratio in zip(FREE, (6.0, None), strict=True):
        yield make_problem(
            DESIGNS[name],
            "largest-margin",
            volume=7000.0,
            reach=20.0,
            clearance=0.2,
            stroke_ratio=ratio,
            required_box=REQUIRED,
            held=True,
            error=0.01,
            acceleration=5.0,
            # It has hundreds of conditions, which one of the problems shows.
            tilt=12.0 if "reach" in free else None,
            free=free,
        )


def points(model: SearchModel, count: int, seed: int) -> Iterator[FloatArray]:
    """Yield random places around the start, none of them degenerate."""
    random = np.random.default_rng(seed)
    while count:
        u = model.start + 0.06 * random.normal(size=len(model.start))
        try:
            model.at(u)
        except DesignError:
            continue
        yield u
        count -= 1


def around(model: SearchModel, u: FloatArray) -> list[tuple[Evaluation, Evaluation]]:
    """Return the evaluations one step ahead and behind of each variable."""
    return [(model.at(u + STEP * unit), model.at(u - STEP * unit)) for unit in np.eye(len(u))]


@pytest.mark.parametrize("name", list(DESIGNS))
def test_gradients_of_demands_match_central_differences(name: str) -> None:
    warm()
    for seed, problem in enumerate(problems(name)):
        model = SearchModel(problem, problem.start_values)
        kinds = {name.split(" ")[0] for name in model.names}
        assert kinds >= {
            "volume",
            "longest",
            "distance",
            "required",
            "margin",
            "load",
            "error",
            "acceleration",
        }
        for u in points(model, POINTS, seed):
            rows = [(a.values - b.values) / (2.0 * STEP) for a, b in around(model, u)]
            found = np.column_stack(rows)
            size = np.maximum(1.0, np.abs(found).max(axis=1, keepdims=True))
            assert_allclose(model.at(u).gradients / size, found / size, rtol=0, atol=TOLERANCE)


@pytest.mark.parametrize("name", list(DESIGNS))
@pytest.mark.parametrize("objective", OBJECTIVES)
def test_slopes_of_objectives_match_central_differences(
    objective: ObjectiveName, name: str
) -> None:
    problem = make_problem(
        DESIGNS[name],
        objective,
        volume=7000.0,
        required_box=REQUIRED if objective in OVER_BOX else None,
        free=["yaw"],
    )
    model = SearchModel(problem, problem.start_values)
    for u in points(model, POINTS, 5):
        slope = [(a.objective - b.objective) / (2.0 * STEP) for a, b in around(model, u)]
        assert_allclose(model.at(u).slope, slope, rtol=0, atol=TOLERANCE)


def test_required_box_demand_agrees_with_all_positions_of_the_box() -> None:
    random = np.random.default_rng(3)
    design = limited(OPTIMAL, l1=(8.0, None), d4=(3.0, None), box=None)
    verdicts: set[bool] = set()
    for _ in range(15):
        middle = np.array([8.0, 4.0, 8.0]) + 5.0 * random.normal(size=3)
        half = random.uniform(0.5, 3.0, size=3)
        box = (tuple((middle - half).tolist()), tuple((middle + half).tolist()))
        problem = make_problem(design, "smallest-reach", volume=1.0, required_box=box)
        model = SearchModel(problem, problem.start_values)
        at = model.at(model.start)
        boxed = np.array([name.startswith("required box") for name in model.names])
        shares = np.indices((13, 13, 13)).reshape(3, -1).T / 12.0
        inside = middle - half + 2.0 * half * shares
        least = min(float(limit.slack(inside).min()) for limit in at.state.workspace.limits)
        if abs(least) < 0.05:
            # Between the positions that are looked at here the box may come nearer.
            continue
        verdicts.add(least > 0.0)
        assert bool((at.values[boxed] >= 0.0).all()) == (least > 0.0)
    assert verdicts == {True, False}
