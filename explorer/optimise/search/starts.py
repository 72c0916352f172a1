"""The designs that searches start from, out of a low-discrepancy sequence."""

from __future__ import annotations

from collections.abc import Callable, Iterator

import numpy as np

from explorer.errors import DesignError, InputError
from explorer.optimise.problem import Problem, distances_of
from explorer.optimise.search.model import SearchModel

# Designs tried for each start, before the bounds are taken to allow no more.
TRIES = 64
MOST_STARTS = 10_000
# Number of designs compared by what they miss.
CANDIDATES = 64


def check_starts(starts: int) -> None:
    """Raise an `InputError` if a number of starts is less than one or more than `MOST_STARTS`."""
    if not 1 <= starts <= MOST_STARTS:
        raise InputError(f"the number of starts must lie within 1 to {MOST_STARTS}; got {starts}")


def more_starts(problem: Problem, count: int, seed: int) -> Iterator[tuple[float, ...]]:
    """Yield values of the variables, spread evenly within their bounds (Sobol, scrambled).

    Designs nearer to a degenerate one than is allowed are left out.
    """
    if count <= 0:
        return
    from scipy.stats import qmc

    lows, highs = np.array([(variable.low, variable.high) for variable in problem.variables]).T
    sequence = qmc.Sobol(len(lows), rng=seed)
    for _ in range(TRIES * count):
        values = tuple((lows + (highs - lows) * sequence.random(1)[0]).tolist())
        try:
            design = problem.design_at(values)
        except DesignError:
            continue
        if min(map(abs, distances_of(design).values())) >= problem.demands.least:
            yield values
            count -= 1
            if count == 0:
                return


def promising_starts(
    problem: Problem, seed: int, before_each: Callable[[], None]
) -> Iterator[tuple[float, ...]]:
    """Yield values of the variables that miss the demands by little, the best first.

    They are taken from the sequence with a seed. `before_each` is called before each evaluation,
    and may raise.
    """

    def miss_of(values: tuple[float, ...]) -> float:
        model = SearchModel(problem, values, before_each)
        at = model.at(model.start)
        return float(np.abs(at.values[model.equalities]).sum()) - min(0.0, model.worst(at)[0])

    yield from sorted(more_starts(problem, CANDIDATES, seed), key=miss_of)
