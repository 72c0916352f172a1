"""The designs that searches start from, out of a low-discrepancy sequence."""

from __future__ import annotations

from collections.abc import Callable, Iterator

import numpy as np

from explorer.errors import DesignError, InputError
from explorer.optimise.problem import DISTANCES, Problem, distance_of
from explorer.optimise.search.model import Model

# Designs tried for each start, before the bounds are taken to allow no more.
TRIES = 64
MOST_STARTS = 10_000
# Number of designs compared by what they miss.
CANDIDATES = 64


def check_starts(starts: int) -> None:
    """Refuse a number of starts that no search has.

    Raises:
        InputError: it is less than one, or more than `MOST_STARTS`.
    """
    if not 1 <= starts <= MOST_STARTS:
        raise InputError(f"the number of starts must lie within 1 to {MOST_STARTS}; got {starts}")


def more_starts(problem: Problem, count: int, seed: int) -> Iterator[tuple[float, ...]]:
    """Yield values of the variables, spread evenly within their bounds (Sobol, scrambled).

    Designs nearer to a degenerate one than is allowed are left out.
    """
    if count <= 0:
        return
    from scipy.stats import qmc

    lows = np.array([variable.low for variable in problem.variables])
    highs = np.array([variable.high for variable in problem.variables])
    sequence = qmc.Sobol(len(lows), rng=seed)
    yielded = 0
    for _ in range(TRIES * count):
        values = tuple((lows + (highs - lows) * sequence.random(1)[0]).tolist())
        try:
            design = problem.design_at(values)
        except DesignError:
            continue
        if all(abs(distance_of(design, name)) >= problem.demands.least for name in DISTANCES):
            yield values
            yielded += 1
            if yielded == count:
                return


def promising_starts(
    problem: Problem, seed: int, before_each: Callable[[], None]
) -> Iterator[tuple[float, ...]]:
    """Yield values of the variables that miss the demands by little, the best first.

    Args:
        problem: The problem.
        seed: Seed of the sequence that the values are taken from.
        before_each: Called before each evaluation; may raise.
    """
    candidates = list(more_starts(problem, CANDIDATES, seed))
    missed: list[float] = []
    for values in candidates:
        model = Model(problem, values, before_each)
        at = model.at(model.start)
        missed.append(
            float(np.abs(at.values[model.equalities]).sum()) - min(0.0, model.worst(at)[0])
        )
    for index in np.argsort(missed):
        yield candidates[index]
