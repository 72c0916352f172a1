"""What limits cannot give is known before a search: no design within the bounds proves it wrong."""

from __future__ import annotations

from collections import Counter
from typing import Any

import msgspec
import numpy as np
import pytest
from limited_designs import limited

from explorer import InputError, workspace_volume
from explorer.measures.clearance import CERTAIN, clearance_beyond
from explorer.mechanism.design import Design, DesignError, Limits
from explorer.mechanism.design_file import PRESETS
from explorer.mechanism.pose import Pose
from explorer.optimise.defaults import make_problem
from explorer.optimise.problem import Problem, Variable
from explorer.optimise.refutation.most_volume import (
    LONGEST_LEG,
    ceilings,
)
from explorer.optimise.refutation.ranges import Ranges
from explorer.optimise.refutation.refutation import (
    PAPER_BOX,
    paper_box,
    refutations,
    with_box,
    words_of,
)
from explorer.optimise.search.model import Model
from explorer.optimise.search.trail import MET
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
        leg_radii=(0.1, 0.2, 0.3, 0.0),
    )
    start = msgspec.structs.replace(OPTIMAL, limits=limits, home=home)
    names = ["a3x", "a3y", "b1x", "b1y", "b2", "b3"]
    width = float(rng.choice([0.0, 0.5, 3.0]))
    values = dict(zip(names, start.variables, strict=True))
    bounds = [Variable(name, values[name] - width, values[name] + width) for name in names]
    required = maybe(box((9.0, 3.0, 7.0), 5.0))
    free = ["yaw"] if rng.random() < 0.3 else []
    if required is not None and rng.random() < 0.5:
        free.append("shift-x")
    if rng.random() < 0.2:
        free.append("reach")
    return make_problem(
        start,
        "match-volume" if free or rng.random() < 0.7 else "largest-margin",
        volume=float(10.0 ** rng.uniform(1.5, 4.3)),
        reach=maybe(float(rng.uniform(12.0, 30.0))),
        clearance=maybe(float(rng.uniform(0.05, 3.0))),
        least=0.1,
        stroke_ratio=maybe(float(rng.uniform(1.5, 4.0)), 0.2),
        required_box=required,
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
    demands = problem.demands
    model = Model(problem, values)
    at = model.at(model.start)
    if np.abs(at.values[model.equalities]).max(initial=0.0) > MET:
        return False
    if not (at.state.volume > 0.0 and model.worst(at)[0] >= -MET):
        return False
    # The optimiser measures clearances at some positions first, and in between at its end.
    clearance, _ = clearance_beyond(at.state.design, demands.clearance_margin)
    wanted = demands.clearance or 0.0
    return clearance is None or clearance >= wanted - CERTAIN * at.state.design.reach


@pytest.mark.parametrize("count", [20, pytest.param(100, marks=pytest.mark.long)])
def test_refutations_of_random_problems_are_never_contradicted(count: int) -> None:
    rng = np.random.default_rng(15)
    refuted, nearest = Counter[str](), 0.0
    for _ in range(count):
        try:
            problem = random_problem(rng)
        except InputError:
            continue
        found = refutations(problem)
        refuted.update(each.limit for each in found)
        bounds = list(ceilings(Ranges(problem)))
        demanded = problem.demands.reach
        for values in random_designs(rng, problem):
            try:
                design = problem.design_at(values)
            except DesignError:
                continue
            is_long = demanded is not None and problem.objective == "match-volume"
            reach = dict(zip(problem.names, values, strict=True)).get("reach", design.reach)
            if not (is_long and demanded is not None and reach > demanded):
                volume = workspace_volume(design, explain=False).volume
                for bound in bounds:
                    assert volume <= bound.volume * (1.0 + 1e-9), (problem, values, bound)
                    nearest = max(nearest, volume / bound.volume if bound.volume else 0.0)
            # A volume is matched by none of them: any would do that the limits leave room for.
            larger = replace_volume(problem, workspace_volume(design, explain=False).volume)
            if larger is not None and refutations(larger):
                assert not meets(larger, values), (larger, values, refutations(larger))
    # The bounds are worth something, and of many problems every kind of limit has its turn.
    assert nearest > 0.9
    kinds = {"box", LONGEST_LEG, "l1 maximum", "guide", "required box", "margin", "gap |d1 − d3|"}
    assert len(kinds & {*refuted}) >= (len(kinds) if count == 100 else 3)


def replace_volume(problem: Problem, volume: float) -> Problem | None:
    if volume <= 0.0:
        return None
    demands = msgspec.structs.replace(problem.demands, volume=volume)
    return msgspec.structs.replace(problem, demands=demands)


def paper_problem(start: Design = INITIAL, volume: float = 8000.0, **demands: Any) -> Problem:
    return make_problem(start, "match-volume", volume=volume, **demands)


def limits_of(problem: Problem) -> list[str]:
    return [each.limit for each in refutations(problem)]


def test_box_of_the_paper_start_is_too_small_and_the_paper_box_is_enough() -> None:
    problem = paper_problem(clearance=0.2)
    assert (
        words_of(refutations(problem))
        == "the box holds at most 2,499 of the 8,000 units³ asked for"
    )
    assert paper_box(problem) == PAPER_BOX == OPTIMAL.limits.box
    outcome = optimise_design(paper_problem(with_box(INITIAL, PAPER_BOX), clearance=0.2))
    assert outcome.converged
    assert outcome.best.value <= 1e-9
    # Of what the paper's box does not hold either nobody is told to take it.
    assert paper_box(paper_problem(volume=12_300.0)) is None
    assert paper_box(paper_problem(volume=12_200.0)) == PAPER_BOX
    assert refutations(paper_problem(volume=2400.0)) == ()
    assert refutations(paper_problem(OPTIMAL)) == ()


@pytest.mark.parametrize(
    ("limits", "demands", "words"),
    [
        ({}, {"reach": 14.0}, "a longest leg of at most 14 units leaves room for at most 5,747"),
        ({"l1": (0.0, 12.0)}, {}, "l1 of at most 12 units leaves room for at most 3,619"),
        (
            {"guide": (0.0, 5.0), "box": None},
            {"reach": 25.0},
            "a guide from 0 to 5 units leaves room for at most 4,909 of the 8,000 units³ asked for",
        ),
        ({"guide": (0.0, 5.0)}, {}, "the box holds at most 6,473 of the 8,000 units³ asked for"),
        ({"margin": 9.0}, {}, "the box holds at most 5,844 of the 8,000 units³ asked for, wh"),
        ({"gap": 30.0}, {}, "the carriages are at most 11.15 units apart within the b"),
        ({}, {"clearance": 12.0}, "legs 2 and 3 keep at most 11.15 of the clearance of 12"),
        (
            {},
            {"required_box": ((8.0, 3.0, 7.0), (12.0, 7.0, 19.0))},
            "the required box lies beyond the box along z: from 7 to 19 units, and the box fr",
        ),
        (
            {"box": None},
            {"required_box": ((8.0, 3.0, -7.0), (12.0, 7.0, 9.0))},
            "a margin of at most −7 units on the home's side, and the limits demand 0 units",
        ),
    ],
)
def test_refutation_names_the_limit_and_the_most_that_it_allows(
    limits: dict[str, Any], demands: dict[str, Any], words: str
) -> None:
    assert words in words_of(refutations(paper_problem(limited(OPTIMAL, **limits), **demands)))


def test_free_yaw_refutes_nothing_that_another_yaw_gives() -> None:
    # The margins of a tilted platform turn with it: those of one yaw cut off most of the box.
    tilted = Pose.of_yaw_pitch_roll((10.0, 5.0, 9.0), (-73.0, 60.0, 0.0))
    start = msgspec.structs.replace(limited(OPTIMAL, margin=7.0), home=tilted)
    assert "box" in limits_of(paper_problem(start, 5000.0))
    assert limits_of(paper_problem(start, 5000.0, free=("yaw",))) == []
