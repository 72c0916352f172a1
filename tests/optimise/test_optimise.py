"""The optimiser finds what it claims, proves it, and says so plainly when it does not."""

from __future__ import annotations

import math
import pickle
from functools import partial
from typing import Any, cast

import msgspec
import numpy as np
import pytest
from limited_designs import limited
from long_cases import long_after
from refusals import refusal
from threadpoolctl import (  # pyright: ignore[reportMissingTypeStubs]
    threadpool_info,
    threadpool_limits,
)

from explorer import (
    PRESETS,
    Design,
    InputError,
    leg_clearances,
    make_problem,
    margins,
    optimise_design,
    workspace_volume,
)
from explorer.errors import DesignError
from explorer.measures.measure import Case
from explorer.mechanism.configuration import Configuration
from explorer.mechanism.design import LENGTHS
from explorer.optimise.defaults import paper_problem, paper_start, reach_problem
from explorer.optimise.outcome import (
    Iterate,
    Outcome,
    Settings,
    decode_record,
    encode_record,
    record_of,
)
from explorer.optimise.problem import (
    ObjectiveName,
    Problem,
    Variable,
    distances_of,
)
from explorer.optimise.search.model import SearchModel
from explorer.optimise.search.sqp import optimality
from explorer.optimise.search.starts import more_starts
from explorer.workspace.limits.constraints import slacks
from explorer.workspace.workspace import Workspace

OPTIMAL = PRESETS["paper-optimal"]


def started_at(problem: Problem, values: tuple[float, ...]) -> Problem:
    return msgspec.structs.replace(problem, start=problem.design_at(values))


def least_clearance_by_sampling(design: Design, margin: float, count: int) -> float:
    """Return the least clearance over random positions, those at the lowest height among them."""
    random = np.random.default_rng(0)
    rotation = design.home_pose.rotation
    lows, highs = np.array(design.limits.box)
    p = lows + (highs - lows) * random.random((count, 3))
    p[: count // 2, 2] = margin * (1.0 + 0.05 * random.random(count // 2))
    inside = slacks(Workspace(design, rotation).limits, p).min(axis=-1) >= 0.0
    inside &= np.abs(margins(p, rotation)).min(axis=-1) >= margin
    return float(leg_clearances(Configuration(design, p[inside], rotation)).clearance.min())


def assert_is_sound(outcome: Outcome) -> None:
    """Check what holds of every outcome, whatever became of it."""
    problem, best = outcome.problem, outcome.best
    assert outcome.history[best.number] == best
    assert [each.number for each in outcome.history] == list(range(len(outcome.history)))
    assert outcome.design == problem.design_at(best.values)
    assert best.volume == workspace_volume(outcome.design).volume
    for value, variable in zip(best.values, problem.variables, strict=True):
        slack = 1e-12 * problem.size
        assert variable.low - slack <= value <= variable.high + slack
    least = problem.demands.least - 1e-6 * problem.size
    assert min(map(abs, distances_of(outcome.design).values())) >= least
    assert math.isfinite(best.objective)
    assert outcome.message
    assert "\n" not in outcome.message


# Matching a volume


@pytest.mark.parametrize("clearance", [None, 0.2])
def test_search_for_paper_volume_matches_it_to_rounding(clearance: float | None) -> None:
    outcome = optimise_design(paper_problem(clearance))
    assert_is_sound(outcome)
    assert outcome.converged
    assert outcome.iterations <= 15
    assert abs(1.0 - workspace_volume(outcome.design).volume / 8000.0) <= 1e-9
    assert outcome.design.limits == OPTIMAL.limits
    assert outcome.design.home_pose.quaternion == OPTIMAL.home_pose.quaternion


def test_optimum_keeps_clearance_between_the_positions_of_the_solver() -> None:
    clearance = 0.5
    problem = paper_problem(clearance)
    outcome = optimise_design(problem)
    margin = problem.demands.clearance_margin
    assert least_clearance_by_sampling(problem.start, margin, 40_000) < clearance
    assert least_clearance_by_sampling(outcome.design, margin, 40_000) >= 0.999 * clearance
    found = Case(outcome.design, demanded_margin=margin).demanded_clearance[0]
    assert found is not None
    assert found >= 0.98 * clearance


def test_search_enclosed_by_crossing_legs_restarts_elsewhere() -> None:
    problem = paper_problem(0.2)
    tried = [optimise_design(started_at(problem, v)) for v in more_starts(problem, 2, seed=1)]
    assert any(outcome.run.attempts > 1 for outcome in tried)
    assert all(outcome.converged for outcome in tried)


def test_search_for_impossible_volume_names_the_largest_found() -> None:
    bounds = [Variable("a3x", 5.0, 12.0), Variable("a3y", 1.0, 6.0)]
    problem = make_problem(paper_start(), "match-volume", volume=8000.0, bounds=bounds)
    outcome = optimise_design(problem)
    assert_is_sound(outcome)
    assert outcome.status == "infeasible"
    assert "no design within the bounds was found with a volume of 8,000" in outcome.message
    told = float(outcome.message.rsplit(" ", 2)[1].replace(",", ""))
    # More than the paper's designs have, and than random ones within the bounds.
    largest = max(
        workspace_volume(problem.design_at(values)).volume
        for values in more_starts(problem, 30, seed=0)
    )
    assert largest < told < 8000.0
    assert outcome.best.volume == pytest.approx(told, rel=1e-3)


# Optima


def test_smallest_reach_for_the_paper_volume_is_optimal_and_below_17_90() -> None:
    outcome = optimise_design(reach_problem())
    assert_is_sound(outcome)
    assert outcome.converged
    assert outcome.design.reach <= 17.90
    assert workspace_volume(outcome.design).volume == pytest.approx(7053.044190625, rel=1e-8)
    best = SearchModel(outcome.problem, outcome.best.values)
    assert optimality(best, best.at(best.start)).is_optimal
    start = SearchModel(outcome.problem, outcome.problem.start_values)
    assert optimality(start, start.at(start.start)).residual > 0.01


def test_several_starts_reach_an_optimum_that_one_misses() -> None:
    problem = reach_problem()
    # The second start of the sequence ends in the worse optimum near 22.9.
    worse = started_at(problem, next(more_starts(problem, 1, seed=0)))
    alone = optimise_design(worse)
    assert alone.converged
    assert alone.design.reach == pytest.approx(22.87, abs=0.01)
    several = optimise_design(worse, starts=4)
    assert several.converged
    assert several.design.reach <= 17.90
    assert len(several.runs) == 4
    assert (
        several.best.objective
        <= min(several.history[run.best].objective for run in several.runs) + 1e-6
    )
    assert {each.run for each in several.history} == set(range(4))


def test_start_outdone_even_without_the_clearance_ends_there() -> None:
    problem = reach_problem(0.2)
    outcome = optimise_design(problem, starts=2)
    assert_is_sound(outcome)
    assert outcome.chosen == 0
    assert [run.status for run in outcome.runs] == ["converged", "outdone"]
    first, second = (outcome.history[run.best] for run in outcome.runs)
    margin = problem.demands.clearance_margin
    assert least_clearance_by_sampling(first.design, margin, 40_000) >= 0.2
    assert second.objective > first.objective
    # Its iterates say that the legs are too near.
    assert least_clearance_by_sampling(second.design, margin, 40_000) < 0.2
    assert second.spare < 0.0
    assert "clearance of legs" in second.worst


def test_optimum_in_a_kink_of_the_volume_converges() -> None:
    # With more room for b1 the balls of legs 1 and 4 become one: −R b1 = a3.
    outcome = optimise_design(make_problem(OPTIMAL, "smallest-reach"))
    assert outcome.converged
    design = outcome.design
    arm = design.home_pose.rotation @ np.array([*design.b1, 0.0])
    assert -arm[:2] == pytest.approx(design.a3, abs=1e-3)
    assert design.reach < 17.1


@pytest.mark.parametrize(
    "problem",
    [
        make_problem(OPTIMAL, "largest-volume"),
        pytest.param(
            make_problem(OPTIMAL, "largest-volume", reach=15.0, free=["yaw"]),
            marks=pytest.mark.long,
        ),
        make_problem(OPTIMAL, "smallest-reach", volume=5000.0, free=["yaw"]),
    ],
)
def test_designs_near_an_optimum_are_no_better(problem: Problem) -> None:
    outcome = optimise_design(problem)
    assert_is_sound(outcome)
    assert outcome.converged
    model = SearchModel(problem, outcome.best.values)
    best = model.at(model.start)
    lows, highs = model.bounds.T
    random = np.random.default_rng(0)
    compared = 0
    for _ in range(100):
        step = 10.0 ** random.uniform(-4.0, -1.5) * random.normal(size=len(model.start))
        try:
            near = model.at(np.clip(model.start + step, lows, highs))
        except DesignError:
            continue
        # What misses a demand a little may be better by as little.
        if model.worst(near)[0] >= -1e-9:
            assert near.objective >= best.objective - 1e-7
            compared += 1
    assert compared > 5


def test_reach_as_a_variable_sets_the_maximum_of_all_lengths() -> None:
    start = limited(OPTIMAL, **dict.fromkeys(LENGTHS, (0.0, 15.0)))
    outcome = optimise_design(make_problem(start, "smallest-reach", volume=3000.0, free=["reach"]))
    assert_is_sound(outcome)
    assert outcome.converged
    for low, high in (outcome.design.length_range(name) for name in LENGTHS):
        assert (low, high) == (0.0, outcome.best.objective)
        assert high < 15.0


@pytest.mark.parametrize(
    ("objective", "field", "others", "factor"),
    [
        ("smallest-reach", "reach", {"volume": 5000.0}, 0.98),
        pytest.param("largest-volume", "volume", {"reach": 20.0}, 1.02, marks=pytest.mark.long),
    ],
)
def test_demand_about_what_the_objective_improves_is_kept_too(
    objective: ObjectiveName, field: str, others: dict[str, Any], factor: float
) -> None:
    def search(**demands: Any) -> Outcome:
        return optimise_design(make_problem(limited(OPTIMAL, box=None), objective, **demands))

    free = search(**others)
    assert free.converged
    # A demand that the optimum keeps changes nothing; one that it misses is missed.
    kept = search(**others, **{field: free.best.objective / factor})
    assert kept.converged
    assert kept.best.objective == pytest.approx(free.best.objective, rel=1e-5)
    missed = search(**others, **{field: free.best.objective * factor})
    assert not missed.converged
    assert missed.best.spare < 0.0


# Empty workspaces


def test_search_from_an_empty_workspace_names_what_empties_it() -> None:
    outcome = optimise_design(make_problem(EMPTY, "match-volume", volume=10.0))
    assert outcome.status == "infeasible"
    assert "empty because of" in outcome.message
    assert outcome.run.holding in outcome.message
    assert outcome.design == outcome.problem.design_at(outcome.best.values)


# Ends other than convergence


def test_search_with_too_few_iterations_returns_the_best_so_far() -> None:
    outcome = optimise_design(reach_problem(), iterations=4)
    assert_is_sound(outcome)
    assert outcome.status == "not converged"
    assert outcome.iterations <= 5
    assert outcome.run.holding
    assert "allow more iterations" in outcome.message


@pytest.mark.parametrize("after", [0, 1, 40])
def test_search_that_stop_ends_is_cancelled(after: int) -> None:
    asked = 0

    def stop() -> bool:
        nonlocal asked
        asked += 1
        return asked > after

    problem = started_at(paper_problem(0.2), next(more_starts(paper_problem(), 1, seed=1)))
    outcome = optimise_design(problem, starts=3, stop=stop)
    assert_is_sound(outcome)
    assert outcome.status == "cancelled"
    assert len(outcome.runs) == 1
    # Not asked again once it has said so, but on the ways out.
    assert asked == after + 1
    sound = [each for each in outcome.history if each.spare >= -1e-8]
    if sound and sound[0].phase == "solving":
        assert outcome.best.spare >= -1e-8


def test_watch_receives_each_iterate_and_ends_the_search_if_it_raises() -> None:
    def fail(_: Iterate) -> None:
        raise RuntimeError("the pipe is gone")

    with pytest.raises(RuntimeError, match="the pipe is gone"):
        optimise_design(paper_problem(), watch=fail)
    seen: list[Iterate] = []
    outcome = optimise_design(reach_problem(), watch=seen.append)
    assert tuple(seen) == outcome.history
    for each in seen:
        assert each.volume == workspace_volume(each.design).volume


@pytest.mark.parametrize("seed", long_after(4, [1, 4, 5, 6, 0, 2, 3, *range(7, 12)]))
def test_search_from_random_design_of_any_size_ends_with_a_message(seed: int) -> None:
    random = np.random.default_rng(seed)
    size = float(random.choice([1e-3, 1.0, 1e3]))
    a3x, a3y, b1x, b1y, b2, b3 = (size * random.uniform(-1.0, 1.0, 6)).tolist()
    limits: dict[str, Any] = {
        "d4": (0.0, None if seed % 3 else size),
        "guide": None if seed % 2 else (-size, size),
        "margin": None if seed % 5 == 0 else 0.01 * size,
        "leg_radii": [0.01 * size] * 4,
    }
    design = Design(a3=(a3x, a3y), b1=(b1x, b1y), b2=b2, b3=b3)
    problem = make_problem(
        limited(design, **limits),
        "match-volume" if seed % 4 else "largest-volume",
        volume=0.1 * size**3,
        clearance=0.02 * size if seed % 2 else None,
        free=["yaw"] if seed % 3 else [],
    )
    outcome = optimise_design(problem, iterations=25)
    assert_is_sound(outcome)
    record = record_of(outcome, Settings())
    assert decode_record(encode_record(record), "here") == record


# Records


def test_record_read_back_repeats_the_search() -> None:
    settings = Settings(starts=2, seed=7)
    outcome = optimise_design(paper_problem(0.2), starts=settings.starts, seed=settings.seed)
    assert pickle.loads(pickle.dumps(outcome)) == outcome
    record = decode_record(encode_record(record_of(outcome, settings)), "here")
    assert record == record_of(outcome, settings)
    again = optimise_design(
        record.problem, starts=record.settings.starts, seed=record.settings.seed
    )
    assert again.design == outcome.design == record.design
    assert again.history == outcome.history
    assert again.runs == outcome.runs
    assert {"python", "numpy", "scipy", "numba", "flagged-explorer"} == set(record.versions)


def test_search_has_the_same_last_digits_with_any_number_of_threads() -> None:
    histories: list[tuple[Iterate, ...]] = []
    for count in (1, 2, 3):
        with threadpool_limits(count, "blas"):
            histories.append(optimise_design(paper_problem(0.2)).history)
            # The caller's threads are as they were.
            libraries = cast("list[dict[str, Any]]", threadpool_info())
            own = {each["num_threads"] for each in libraries if each["user_api"] == "blas"}
            assert own == {count}
    assert histories[0] == histories[1] == histories[2]


# Bad input


SWING = limited(OPTIMAL, swing=msgspec.convert({"a1": 40.0}, type(OPTIMAL.limits.swing)))
EMPTY = limited(OPTIMAL, guide=(100.0, 101.0))
VOLUME = {"volume": 9.0}


def make_from(start: Design = OPTIMAL, *, bound: Any = None, **arguments: Any) -> Problem:
    bounds = [] if bound is None else [Variable(*bound)]
    return make_problem(start, bounds=bounds, **arguments)


@pytest.mark.parametrize(
    ("arguments", "words"),
    [
        (VOLUME | {"bound": ("b2", 5.0, 3.0)}, "bounds of b2 cross: low 5, high 3"),
        (VOLUME | {"bound": ("b2", 5.0, 9.0)}, "b2 = 2.6067, outside its bounds"),
        (VOLUME | {"bound": ("b2", 0.0, math.inf)}, "b2 must be a finite number"),
        (VOLUME | {"bound": ("b4", 0.0, 1.0)}, "no variable 'b4'"),
        ({}, "match-volume needs a volume"),
        ({"volume": -1.0}, "the volume demanded must be positive; got -1"),
        (VOLUME | {"clearance": math.nan}, "clearance demanded must be a finite"),
        (VOLUME | {"clearance": 0.1, "clearance_margin": 0.0}, "positive clearance"),
        (VOLUME | {"least": 5.0}, "below the least allowed 5"),
        ({"objective": "smallest-load"}, 'the objective must be "match-volume" or'),
        (VOLUME | {"free": ["shift-x"]}, "no variable 'shift-x'"),
        (
            {"objective": "smallest-reach", "start": limited(OPTIMAL, l1=(0.0, 20.0))},
            "let the reach change",
        ),
        ({"objective": "largest-volume", "start": SWING}, "swing"),
        (
            {"objective": "smallest-reach", "start": EMPTY, "free": ["yaw"]},
            "the start has an empty workspace",
        ),
    ],
)
def test_make_problem_with_bad_input_says_what_would_work(
    arguments: dict[str, Any], words: str
) -> None:
    given: dict[str, Any] = {"objective": "match-volume", **arguments}
    assert words in refusal(partial(make_from, **given))


@pytest.mark.parametrize(("option", "value"), [("starts", 0), ("starts", 10**6), ("iterations", 0)])
def test_search_with_bad_settings_is_refused(option: str, value: int) -> None:
    options: dict[str, Any] = {option: value}
    with pytest.raises(InputError, match=option):
        optimise_design(paper_problem(), **options)
