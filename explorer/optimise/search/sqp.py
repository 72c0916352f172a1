"""SciPy's SLSQP: on plain functions, and on a model with every accepted iterate seen.

SLSQP asks for gradients only at iterates that it accepts, which is how they are told from
the trial points of its line searches.
"""

from __future__ import annotations

from collections.abc import Callable
from typing import Any, NamedTuple

import numpy as np

from explorer.errors import DesignError
from explorer.numerics.arrays import BoolArray, FloatArray
from explorer.optimise.search.model import Evaluation, Model

# The objective has to stand still to this before SLSQP gives up by itself.
PRECISION = 1e-14
# What a design that cannot exist counts for in a line search.
NO_DESIGN = 1e3
# The exit of SLSQP when its iterations ended.
OUT_OF_ITERATIONS = 9

Values = Callable[[FloatArray], FloatArray]


class Stop(Exception):  # noqa: N818 - a signal, not an error
    """Raised by whoever watches, to end the solver where it is."""


class Ended(NamedTuple):
    """How a solver ended: the last place, its steps, and whether they were too few."""

    last: Evaluation
    steps: int
    out_of_iterations: bool


def slsqp(
    objective: Callable[[FloatArray], float],
    slope: Values,
    start: FloatArray,
    bounds: FloatArray,
    demands: list[tuple[str, Values, Values]],
    *,
    most: int,
    precision: float,
) -> tuple[FloatArray, int]:
    """Return where SLSQP ends, within the bounds, and its exit mode.

    Args:
        objective: To minimise, of n variables.
        slope: Its derivatives, shape (n,).
        start: Shape (n,).
        bounds: Lows and highs, shape (n, 2); infinite for none.
        demands: ("eq" or "ineq", values (m,), gradients (m, n)): zero, or at least zero.
        most: The most iterations.
        precision: Of the objective.
    """
    from scipy import optimize

    minimize: Any = optimize.minimize
    lows, highs = bounds.T
    result = minimize(
        objective,
        np.clip(start, lows, highs),
        jac=slope,
        method="SLSQP",
        bounds=bounds,
        constraints=[{"type": kind, "fun": f, "jac": jac} for kind, f, jac in demands],
        options={"maxiter": most, "ftol": precision},
    )
    return np.clip(np.asarray(result.x, dtype=np.float64), lows, highs), int(result.status)


def solve(
    model: Model,
    start: FloatArray,
    *,
    see: Callable[[Evaluation], None],
    most: int,
) -> Ended:
    """Run SLSQP on a model, to the end or until `Stop` is raised.

    Args:
        model: What to minimise.
        start: Scaled variables, shape (n,), of a design that can exist.
        see: Called with each accepted iterate, the start among them; may raise `Stop`.
        most: The most iterations.
    """
    seen: list[Evaluation] = []

    def at(u: FloatArray) -> Evaluation | None:
        try:
            return model.at(u)
        except DesignError:
            return None

    def objective(u: FloatArray) -> float:
        found = at(u)
        return found.objective if found else NO_DESIGN

    def slope(u: FloatArray) -> FloatArray:
        found = at(u)
        if found is None:
            return np.zeros(len(u))
        if not (seen and np.array_equal(seen[-1].u, found.u)):
            seen.append(found)
            see(found)
        return found.slope

    def part(kind: str, which: BoolArray) -> tuple[str, Values, Values]:
        count = int(which.sum())

        def values(u: FloatArray) -> FloatArray:
            found = at(u)
            return found.values[which] if found else np.full(count, -NO_DESIGN)

        def gradients(u: FloatArray) -> FloatArray:
            found = at(u)
            return found.gradients[which] if found else np.zeros((count, len(u)))

        return kind, values, gradients

    equal = model.equalities
    demands = [part(kind, each) for kind, each in (("eq", equal), ("ineq", ~equal)) if each.any()]
    exit_mode = 0
    try:
        u, exit_mode = slsqp(
            objective, slope, start, model.bounds, demands, most=most, precision=PRECISION
        )
        last = at(u)
        if last is not None and not np.array_equal(seen[-1].u, last.u):
            seen.append(last)
            see(last)
    except Stop:
        pass
    return Ended(seen[-1], len(seen) - 1, exit_mode == OUT_OF_ITERATIONS)
