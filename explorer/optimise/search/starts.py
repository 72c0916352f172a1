"""The designs that searches start from: out of a low-discrepancy sequence, or opened ones.

An empty workspace has no volume to increase. But a position breaks each limit by some amount, so
it is opened by a search for a position and a design together, as near to the start as possible,
with a ball of some radius around the position within all limits.
"""

from __future__ import annotations

from collections.abc import Callable, Iterator

import numpy as np

from explorer.errors import DesignError, InputError
from explorer.numerics.arrays import FloatArray
from explorer.optimise.problem import Problem, distances_of
from explorer.optimise.search.demands import side_demands
from explorer.optimise.search.model import MISSED, SearchModel
from explorer.optimise.search.sqp import Point, slsqp
from explorer.optimise.search.state import UNBOUNDED, SearchState, bounds_of
from explorer.workspace.limits.constraints import HalfSpace

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


# Number of positions on each axis among which the search begins at the least broken one.
SEARCHED = 13
# Radius of the ball in an open workspace, over the edge of a cube of the demanded volume or over
# the size of the start.
ROOM = 0.1
# Cost of moving the position, relative to that of changing the design.
COST_OF_PLACE = 0.01
MOST_ITERATIONS = 60


def open_workspace(
    problem: Problem, start: FloatArray, *, see: Callable[[SearchState, str], None]
) -> FloatArray | None:
    """Return scaled variables at which a ball fits into the workspace, or None without success.

    Each iterate is seen with the limit that it breaks most.
    """
    here, size, n = SearchState(problem, start), problem.size, len(start)
    volume = problem.demands.volume
    radius = ROOM * (size if volume is None else volume ** (1.0 / 3.0))
    sides = side_demands(here)
    names = [*here.regions]
    labels = [*names, *(name for side in sides for name in side.names)]
    first = np.concatenate([start, _least_broken(here) / size])
    costs = np.concatenate([np.ones(n), np.full(3, COST_OF_PLACE)])

    def evaluate(x: FloatArray) -> Point:
        state = SearchState(problem, x[:n])
        # A limit that is not there is one that no position keeps.
        values, rows = np.full(len(labels), -MISSED), np.zeros((len(labels), len(x)))
        for index, name in enumerate(names):
            if limit := state.regions.get(name):
                slack, by_u, by_p = state.slack(limit, x[None, n:] * size)
                norm = float(np.linalg.norm(limit.normal)) if isinstance(limit, HalfSpace) else 1.0
                values[index] = (float(slack[0]) / norm - radius) / size
                rows[index] = np.concatenate([by_u[0] / size, by_p[0]]) / norm
        index = len(names)
        for side in sides:
            end = index + len(side.names)
            values[index:end], rows[index:end, :n] = side.measure(state)
            index = end
        return 0.5 * float(costs @ (x - first) ** 2), costs * (x - first), values, rows

    end = slsqp(
        evaluate,
        lambda x, values: see(SearchState(problem, x[:n]), labels[int(values.argmin())]),
        first,
        np.vstack([bounds_of(problem), [UNBOUNDED] * 3]),
        np.zeros(len(labels), dtype=bool),
        most=MOST_ITERATIONS,
        precision=1e-8,
    )
    u = end[:n]
    return u if SearchState(problem, u).volume > 0.0 else None


def _least_broken(state: SearchState) -> FloatArray:
    """Return the position on a grid that breaks its limits the least, shape (3,)."""
    reach = state.longest_leg[0]
    lows, highs = state.design.limits.box or ((-reach,) * 3, (reach,) * 3)
    # Not the ends themselves, where a limit is just met.
    shares = np.linspace(0.0, 1.0, SEARCHED + 2)[1:-1]
    axes = [low + (high - low) * shares for low, high in zip(lows, highs, strict=True)]
    grid = np.stack(np.meshgrid(*axes, indexing="ij"), axis=-1).reshape(-1, 3)
    slack = [limit.slack(grid) for limit in state.regions.values()]
    return grid[int(np.min(slack, axis=0).argmax())]
