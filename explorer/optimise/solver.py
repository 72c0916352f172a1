"""The optimiser: searches from one start or several, every iterate recorded."""

from __future__ import annotations

import time
from collections.abc import Callable, Sequence

from explorer.errors import InputError
from explorer.optimise.outcome import Iterate, Outcome, Run
from explorer.optimise.problem import Problem
from explorer.optimise.search import MET, Search
from explorer.optimise.starts import more_starts

MOST_ITERATIONS = 200
MOST_STARTS = 10_000

Watch = Callable[[Iterate], None]


def optimise_design(
    problem: Problem,
    *,
    starts: int = 1,
    seed: int = 0,
    iterations: int = MOST_ITERATIONS,
    watch: Watch | None = None,
    stop: Callable[[], bool] | None = None,
) -> Outcome:
    """Look for the best design.

    Args:
        problem: What to look for.
        starts: From how many designs: the start of the problem, and others out of a
            low-discrepancy sequence within the bounds. Once a volume is matched no further
            start is tried.
        seed: Of that sequence.
        iterations: The most steps of the solver from each start.
        watch: Called with every iterate as it is found.
        stop: Asked before each evaluation, some milliseconds apart, whether to end here.

    Raises:
        InputError: no start, or no iterations.
    """
    if not 1 <= starts <= MOST_STARTS:
        raise InputError(f"the number of starts must lie within 1 to {MOST_STARTS}; got {starts}")
    if iterations < 1:
        raise InputError(f"the number of iterations must be at least 1; got {iterations}")
    began = time.perf_counter()
    history: list[Iterate] = []

    def record(iterate: Iterate) -> None:
        history.append(iterate)
        if watch is not None:
            watch(iterate)

    runs: list[Run] = []
    for values in (problem.start_values, *more_starts(problem, starts - 1, seed)):
        search = Search(problem, len(runs), values, iterations, history, record, stop)
        runs.append(search.run())
        done = problem.objective == "match-volume" and runs[-1].status == "converged"
        if done or runs[-1].status == "cancelled":
            break
    return Outcome(
        problem, tuple(runs), _best(problem, runs), tuple(history), time.perf_counter() - began
    )


def _best(problem: Problem, runs: Sequence[Run]) -> int:
    """Return the index of the best run: those that converged first, then by what they found."""
    larger = problem.objective in ("largest-volume", "largest-margin")

    def rank(index: int) -> tuple[bool, float, float, int]:
        best = runs[index].best
        objective = -best.objective if larger else best.objective
        if runs[index].status == "converged" and problem.objective == "match-volume":
            objective = 0.0
        missed = max(0.0, -best.spare)
        return runs[index].status != "converged", missed > MET, objective, index

    return min(range(len(runs)), key=rank)
