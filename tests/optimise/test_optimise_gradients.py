"""Every objective and every demand has the gradient that central differences show."""

from __future__ import annotations

from collections.abc import Iterator

import msgspec
import numpy as np
import pytest
from hypothesis import settings
from limited_designs import limited
from numpy.testing import assert_allclose

from explorer import PRESETS, Design, make_problem
from explorer.errors import DesignError
from explorer.mechanism.design import Range
from explorer.mechanism.pose import Pose
from explorer.numerics.arrays import FloatArray
from explorer.numerics.compiled import warm
from explorer.optimise.problem import OBJECTIVES, ObjectiveName, Problem
from explorer.optimise.search.model import Evaluation, SearchModel

# Places at which gradients are compared: one each day, twelve with all tests.
POINTS = settings().max_examples // 25
STEP = 1e-6
# Of a gradient's largest entry, or of one if that is less.
TOLERANCE = 1e-5

OPTIMAL = PRESETS["paper-optimal"]


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


DESIGNS = {
    "paper-optimal": OPTIMAL,
    "many limits": many_limits(),
    "tilted": tilted(),
}


def problems(name: str) -> Iterator[Problem]:
    """Yield problems with every demand there is, the maximum of lengths tied and free."""
    for free in (("yaw",), ("yaw", "reach")):
        yield make_problem(
            DESIGNS[name], "largest-volume", volume=7000.0, reach=20.0, clearance=0.2, free=free
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
        assert kinds >= {"volume", "longest", "distance", "clearance"}
        assert ("gap" in kinds) == (name == "many limits")
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
    problem = make_problem(DESIGNS[name], objective, volume=7000.0, free=["yaw"])
    model = SearchModel(problem, problem.start_values)
    for u in points(model, POINTS, 5):
        slope = [(a.objective - b.objective) / (2.0 * STEP) for a, b in around(model, u)]
        assert_allclose(model.at(u).slope, slope, rtol=0, atol=TOLERANCE)
