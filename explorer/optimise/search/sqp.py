"""SciPy's SLSQP: on plain functions, and on a model with a call for every accepted iterate.

SLSQP evaluates gradients only at iterates that it accepts, which distinguishes them from the trial
points of its line searches.
"""

from __future__ import annotations

from collections.abc import Callable
from typing import Any, NamedTuple

import numpy as np

from explorer.errors import DesignError
from explorer.numerics.arrays import BoolArray, FloatArray
from explorer.optimise.search.model import MISSED, Evaluation, Model

# SLSQP stops by itself once the objective changes by less than this.
PRECISION = 1e-14

Values = Callable[[FloatArray], FloatArray]


class Stop(Exception):  # noqa: N818 - a signal, not an error
    """Raised by a callback to end the solver where it is."""


class Ended(NamedTuple):
    """End of a solver: the last evaluation and the number of steps."""

    last: Evaluation
    steps: int


def slsqp(
    objective: Callable[[FloatArray], float],
    slope: Values,
    start: FloatArray,
    bounds: FloatArray,
    demands: list[tuple[str, Values, Values]],
    *,
    most: int,
    precision: float,
) -> FloatArray:
    """Return the variables at which SLSQP ends, within the bounds, shape (n,).

    Args:
        objective: Function of n variables to minimise.
        slope: Derivatives of the objective, shape (n,).
        start: Variables to start from, shape (n,).
        bounds: Lows and highs, shape (n, 2); infinite for none.
        demands: ("eq" or "ineq", values (m,), gradients (m, n)): zero, or at least zero.
        most: Most iterations.
        precision: Precision of the objective.
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
    return np.clip(np.asarray(result.x, dtype=np.float64), lows, highs)


def solve(
    model: Model,
    start: FloatArray,
    *,
    see: Callable[[Evaluation], None],
    most: int,
) -> Ended:
    """Run SLSQP on a model, to the end or until `Stop` is raised.

    Args:
        model: The problem.
        start: Scaled variables, shape (n,), of a design that can exist.
        see: Called with each accepted iterate, the start among them; may raise `Stop`.
        most: Most iterations.
    """
    seen: list[Evaluation] = []

    def at(u: FloatArray) -> Evaluation | None:
        try:
            return model.at(u)
        except DesignError:
            return None

    def objective(u: FloatArray) -> float:
        evaluation = at(u)
        return evaluation.objective if evaluation else MISSED

    def slope(u: FloatArray) -> FloatArray:
        evaluation = at(u)
        if evaluation is None:
            return np.zeros(len(u))
        if not (seen and np.array_equal(seen[-1].u, evaluation.u)):
            seen.append(evaluation)
            see(evaluation)
        return evaluation.slope

    def demands_of(kind: str, which: BoolArray) -> tuple[str, Values, Values]:
        count = int(which.sum())

        def values(u: FloatArray) -> FloatArray:
            evaluation = at(u)
            return evaluation.values[which] if evaluation else np.full(count, -MISSED)

        def gradients(u: FloatArray) -> FloatArray:
            evaluation = at(u)
            return evaluation.gradients[which] if evaluation else np.zeros((count, len(u)))

        return kind, values, gradients

    equal = model.equalities
    kinds = (("eq", equal), ("ineq", ~equal))
    demands = [demands_of(kind, which) for kind, which in kinds if which.any()]
    try:
        u = slsqp(objective, slope, start, model.bounds, demands, most=most, precision=PRECISION)
        last = at(u)
        if last is not None and not np.array_equal(seen[-1].u, last.u):
            seen.append(last)
            see(last)
    except Stop:
        pass
    return Ended(seen[-1], len(seen) - 1)
