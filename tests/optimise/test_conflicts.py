"""Conflicts of volumes with limits: no design within the bounds shows that one is none."""

from __future__ import annotations

from collections import Counter
from typing import Any

import msgspec
import numpy as np
import pytest
from limited_designs import limited

from explorer import InputError, workspace_volume
from explorer.mechanism.design import Design, DesignError, Limits
from explorer.mechanism.design_file import PRESETS
from explorer.mechanism.pose import Pose
from explorer.optimise.conflicts import PAPER_BOX, find_conflicts, paper_box, volume_bounds
from explorer.optimise.defaults import make_problem
from explorer.optimise.problem import Problem, Variable, with_box
from explorer.optimise.search.model import SearchModel
from explorer.optimise.search.sqp import MET
from explorer.optimise.solver import optimise_design

pytestmark = pytest.mark.usefixtures("warm_kernels")

INITIAL, OPTIMAL = PRESETS["paper-initial"], PRESETS["paper-optimal"]
DESIGNS = 4


def random_problem(rng: np.random.Generator) -> Problem:
    """Return a problem with limits, bounds and demands that are met, just so, or never."""

    def maybe(value: Any, share: float = 0.4) -> Any:
        return value if rng.random() < share else None

    def box(middle: tuple[float, float, float], most: float) -> Any:
        half = rng.uniform(0.1, most, 3)
        return tuple((middle - half).tolist()), tuple((middle + half).tolist())

    level = rng.random() < 0.5
    tilt = (0.0, 0.0) if level else rng.uniform(-25.0, 25.0, 2).tolist()
    home = Pose.of_yaw_pitch_roll(rng.uniform((5, 0, 4), (12, 6, 10)), (-73.0, *tilt))
    lengths: dict[str, Any] = {
        name: (float(maybe(rng.uniform(1.0, 8.0)) or 0.0), maybe(float(rng.uniform(9.0, 25.0))))
        for name in ("l1", "d2", "d4", "l4")
    }
    limits = Limits(
        **lengths,
        guide=maybe((float(rng.uniform(-20.0, 5.0)), float(rng.uniform(5.0, 30.0)))),
        gap=maybe(float(rng.uniform(0.0, 4.0))) or 0.0,
        box=maybe(box((9.0, 3.0, 7.0), 14.0), 0.6),
        margin=maybe(float(rng.choice([0.0, 1.0, 4.0])), 0.8),
    )
    start = msgspec.structs.replace(OPTIMAL, limits=limits, home=home)
    names = ["a3x", "a3y", "b1x", "b1y", "b2", "b3"]
    width = float(rng.choice([0.0, 0.5, 3.0]))
    values = dict(zip(names, start.variables, strict=True))
    bounds = [Variable(name, values[name] - width, values[name] + width) for name in names]
    free = ["yaw"] if rng.random() < 0.3 else []
    if rng.random() < 0.2:
        free.append("reach")
    return make_problem(
        start,
        "match-volume",
        volume=float(10.0 ** rng.uniform(2.5, 4.7)),
        reach=maybe(float(rng.uniform(12.0, 30.0))),
        least=0.1,
        free=free,
        bounds=bounds,
    )


def random_designs(rng: np.random.Generator, problem: Problem) -> list[tuple[float, ...]]:
    lows = np.array([each.low for each in problem.variables])
    highs = np.array([each.high for each in problem.variables])
    shares = rng.random((DESIGNS, len(lows)))
    # Bounds are where the largest of all lie.
    shares[1::2] = np.round(shares[1::2])
    return [tuple(each) for each in (lows + (highs - lows) * shares).tolist()]


def meets(problem: Problem, values: tuple[float, ...]) -> bool:
    """Whether a design meets all demands, by the optimiser's own measure of them."""
    model = SearchModel(problem, values)
    at = model.at(model.start)
    if np.abs(at.values[model.equalities]).max(initial=0.0) > MET:
        return False
    return at.state.volume > 0.0 and model.worst(at)[0] >= -MET


@pytest.mark.parametrize("count", [20, pytest.param(100, marks=pytest.mark.long)])
def test_conflicts_of_random_problems_are_never_contradicted(count: int) -> None:
    rng = np.random.default_rng(15)
    limits, nearest = Counter[str](), 0.0
    for _ in range(count):
        try:
            problem = random_problem(rng)
        except InputError:
            continue
        limits.update(limits_of(problem))
        bounds = list(volume_bounds(problem))
        demanded = problem.demands.reach
        for values in random_designs(rng, problem):
            try:
                design = problem.design_at(values)
            except DesignError:
                continue
            volume = workspace_volume(design).volume
            reach = dict(zip(problem.names, values, strict=True)).get("reach", design.reach)
            # The bounds are those of a problem whose demand of a reach is met.
            if demanded is None or reach <= demanded:
                for limit, _, most in bounds:
                    assert volume <= most * (1.0 + 1e-8), (problem, values, limit)
                    nearest = max(nearest, volume / most if most else 0.0)
            # A volume is matched by none of them: any would do that the limits leave room for.
            larger = replace_volume(problem, volume)
            if larger is not None and find_conflicts(larger):
                assert not meets(larger, values), (larger, values, find_conflicts(larger))
    # The bounds are worth something, and of many problems every kind of limit has its turn.
    assert nearest > 0.9
    kinds = {"box", "longest leg", "l1 maximum", "guide"}
    assert len(kinds & {*limits}) >= (len(kinds) if count == 100 else 3)


def replace_volume(problem: Problem, volume: float) -> Problem | None:
    if volume <= 0.0:
        return None
    demands = msgspec.structs.replace(problem.demands, volume=volume)
    return msgspec.structs.replace(problem, demands=demands)


def paper_problem(start: Design = INITIAL, volume: float = 8000.0, **demands: Any) -> Problem:
    return make_problem(start, "match-volume", volume=volume, **demands)


def limits_of(problem: Problem) -> list[str]:
    return [each.limit for each in find_conflicts(problem)]


def words_of(problem: Problem) -> str:
    return "; ".join(each.message for each in find_conflicts(problem))


def test_box_of_the_paper_start_is_too_small_and_the_paper_box_is_enough() -> None:
    problem = paper_problem(clearance=0.2)
    assert words_of(problem) == "the box holds at most 2,499 of the 8,000 units³ asked for"
    assert paper_box(problem) == PAPER_BOX == OPTIMAL.limits.box
    outcome = optimise_design(paper_problem(with_box(INITIAL, PAPER_BOX), clearance=0.2))
    assert outcome.converged
    assert outcome.best.objective <= 1e-9
    # Of what the paper's box does not hold either nobody is told to take it.
    assert paper_box(paper_problem(volume=12_300.0)) is None
    assert paper_box(paper_problem(volume=12_200.0)) == PAPER_BOX
    assert find_conflicts(paper_problem(volume=2400.0)) == ()
    assert find_conflicts(paper_problem(OPTIMAL)) == ()


@pytest.mark.parametrize(
    ("limits", "demands", "words"),
    [
        ({}, {"reach": 14.0}, "the longest leg of 14 units leaves room for at most 5,747"),
        ({"l1": (0.0, 12.0)}, {}, "the l1 maximum of 12 units leaves room for at most 3,619"),
        (
            {"guide": (0.0, 5.0), "box": None},
            {"reach": 25.0},
            "a guide from 0 to 5 units leaves room for at most 4,909 of the 8,000 units³ asked for",
        ),
    ],
)
def test_conflict_names_the_limit_and_the_most_that_it_allows(
    limits: dict[str, Any], demands: dict[str, Any], words: str
) -> None:
    assert words in words_of(paper_problem(limited(OPTIMAL, **limits), **demands))
