"""Other designs to start from, for a search that found no solution."""

from __future__ import annotations

from collections.abc import Callable, Iterator

import numpy as np

from explorer.optimise.problem import Problem
from explorer.optimise.search.model import Model
from explorer.optimise.search.starts import more_starts

# Number of designs compared.
CANDIDATES = 64


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
