"""The optimiser: searches from one start or several, every iterate recorded."""

from __future__ import annotations

import time
from collections.abc import Callable, Sequence

from explorer.errors import InputError
from explorer.numerics.compiled import warm_in_background
from explorer.numerics.search import one_thread
from explorer.optimise.outcome import Iterate, Outcome, Run
from explorer.optimise.problem import Problem
from explorer.optimise.search.search import Search
from explorer.optimise.search.sqp import Trail
from explorer.optimise.search.starts import check_starts, more_starts

MOST_ITERATIONS = 300


def optimise_design(
    problem: Problem,
    *,
    starts: int = 1,
    seed: int = 0,
    iterations: int = MOST_ITERATIONS,
    watch: Callable[[Iterate], None] | None = None,
    stop: Callable[[], bool] | None = None,
) -> Outcome:
    """Search for the best design.

    Until the kernels are compiled the search runs interpreted, so its last digits are
    reproducible only after `explorer.numerics.compiled.warm`.

    Args:
        problem: The problem.
        starts: Number of designs to start from: the start of the problem, and others from a
            low-discrepancy sequence within the bounds. Once a volume is matched no further
            start is tried.
        seed: Seed of that sequence.
        iterations: Most steps of the solver from each start.
        watch: Called with every iterate.
        stop: Called before each evaluation, some milliseconds apart; True ends the search.

    Raises:
        InputError: No start, or no iterations.
    """
    check_starts(starts)
    if iterations < 1:
        raise InputError(f"the number of iterations must be at least 1; got {iterations}")
    # The first evaluations need not wait: kernels take over once they are compiled.
    warm_in_background()
    began = time.perf_counter()
    trail = Trail(problem, watch, stop)
    runs: list[Run] = []
    with one_thread():
        for values in (problem.start_values, *more_starts(problem, starts - 1, seed)):
            trail.run = len(runs)
            best = runs[_best(runs, trail)] if runs else None
            to_beat = trail.history[best.best] if best and best.status == "converged" else None
            runs.append(Search(problem, values, iterations, trail, to_beat).run())
            done = problem.objective == "match-volume" and runs[-1].status == "converged"
            if done or trail.is_cancelled:
                break

    return Outcome(
        problem=problem,
        runs=tuple(runs),
        chosen=_best(runs, trail),
        history=tuple(trail.history),
        seconds=time.perf_counter() - began,
    )


def _best(runs: Sequence[Run], trail: Trail) -> int:
    """Return the index of the best run: a converged one, then the one with the best iterate.

    Of runs with the same objective to six digits the first one counts.
    """

    def rank(index: int) -> tuple[object, ...]:
        run = runs[index]
        is_empty, missed, value = trail.rank(trail.history[run.best])
        return run.status != "converged", is_empty, missed, float(f"{value:.6g}")

    return min(range(len(runs)), key=rank)
