"""The test of an optimum by its own conditions, and the step to the nearest place that meets all.

At an optimum the slope of the objective is a sum of the gradients of the demands and bounds that
are just met, those of inequalities with a factor of at least zero (Karush, Kuhn and
Tucker). SciPy's own verdict only says that its steps became small.

Volumes have kinks where two limits become the same surface, and optima like to lie there:
the workspace is largest for its reach where the balls of legs 1 and 4 are one. There the
gradients all around take part, each as if it were one more demand (J. V. Burke, A. S.
Lewis, M. L. Overton, "A robust gradient sampling algorithm", 2005).

A solver that lowers an objective ends where rounding keeps it from lowering both that and the
misses, which are then larger than the tolerance of limits. From there each step is the shortest
that meets the demands to first order, found by least distance programming (C. L. Lawson, R. J.
Hanson, "Solving Least Squares Problems", 1974, chapter 23).
"""

from __future__ import annotations

from typing import NamedTuple

import numpy as np

from explorer.errors import DesignError
from explorer.numerics.arrays import FloatArray
from explorer.optimise.search.model import Evaluation, Model

# A demand or bound with less than this to spare takes part.
ACTIVE = 1e-6
# An optimum's conditions hold if their residual is below this.
OPTIMAL = 1e-5
# Distance at which gradients about a possible kink are sampled, and how many for each variable.
AROUND = 1e-5
SAMPLES = 6


class Optimality(NamedTuple):
    """How nearly the conditions hold.

    Attributes:
        residual: Remainder of the slope that no such sum makes up, as a share of the slope.
        holding: The demand or bound with the largest factor, "" if none has one.
    """

    residual: float
    holding: str

    @property
    def is_optimal(self) -> bool:
        """Whether the conditions hold."""
        return self.residual <= OPTIMAL


def optimality(model: Model, at: Evaluation, *, kinks: bool = True) -> Optimality:
    """Return how nearly a place that meets all demands is an optimum.

    To see an optimum in a kink takes many evaluations.
    """
    smooth = _conditions(model, at, [at])
    if smooth.is_optimal or not kinks or model.problem.objective == "match-volume":
        return smooth
    return min(smooth, _conditions(model, at, [at, *_sample_nearby(model, at)]))


def _sample_nearby(model: Model, at: Evaluation) -> list[Evaluation]:
    """Return the problem at places close by, within the bounds."""
    lows, highs = model.bounds.T
    random = np.random.default_rng(0)
    nearby: list[Evaluation] = []
    for _ in range(SAMPLES * len(at.u)):
        step = random.normal(size=len(at.u))
        step *= AROUND / float(np.linalg.norm(step))
        try:
            nearby.append(model.at(np.clip(at.u + step, lows, highs)))
        except DesignError:
            continue
    return nearby


def _conditions(model: Model, at: Evaluation, around: list[Evaluation]) -> Optimality:
    """Return how nearly the conditions hold with the gradients at some places."""
    from scipy.optimize import nnls

    rows: list[FloatArray] = []
    names: list[str] = []
    for index, (value, name) in enumerate(zip(at.values.tolist(), model.names, strict=True)):
        if not (model.equalities[index] or value <= ACTIVE):
            continue
        for place in around:
            rows.append(place.gradients[index])
            names.append(name)
            if model.equalities[index]:
                # An equality may pull either way.
                rows.append(-place.gradients[index])
                names.append(name)
    lows, highs = model.bounds.T
    for index, variable in enumerate(model.problem.names):
        unit = np.zeros(len(at.u))
        unit[index] = 1.0
        if at.u[index] <= lows[index] + ACTIVE:
            rows.append(unit)
            names.append(f"lower bound of {variable}")
        if at.u[index] >= highs[index] - ACTIVE:
            rows.append(-unit)
            names.append(f"upper bound of {variable}")
    steepness = float(np.linalg.norm(at.slope))
    if steepness == 0.0:
        return Optimality(0.0, "")
    slopes = np.array([place.slope for place in around]).T
    # Some mean of the slopes less some sum of the gradients is to be nothing; the last row
    # makes it a mean.
    demands = np.array(rows).reshape(-1, len(at.u)).T
    columns = np.vstack(
        [
            np.hstack([slopes, -demands]) / steepness,
            np.hstack([np.ones(slopes.shape[1]), np.zeros(len(rows))]),
        ]
    )
    goal = np.zeros(len(at.u) + 1)
    goal[-1] = 1.0
    factors, residual = nnls(columns, goal)
    pulls = factors[len(around) :] * np.linalg.norm(demands, axis=0)
    if not len(pulls) or not pulls.max() > 0.0:
        return Optimality(float(residual), "")
    return Optimality(float(residual), names[int(pulls.argmax())])


# Demands that are missed by more than this, dimensionless, are not missed by little.
NEARLY = 1e-6
# Each step squares the misses.
MOST_STEPS = 4
# Below this residual no step meets the demands to first order.
CONTRADICTION = 1e-9
# Cap on what a demand has to spare, over the worst miss.
FAR = 1e3


def nearest_feasible(model: Model, at: Evaluation) -> Evaluation | None:
    """Return the nearest evaluation that meets all demands; None if no step leads to one."""
    lows, highs = model.bounds.T
    for _ in range(MOST_STEPS):
        spare = model.worst(at)[0]
        if spare >= 0.0:
            break
        missed = np.abs(at.values[model.equalities]).max(initial=-spare)
        if not missed <= NEARLY:
            return None
        step = _shortest(model, at)
        if step is None:
            return None
        try:
            at = model.at(np.clip(at.u + step, lows, highs))
        except DesignError:
            return None
    return at if model.worst(at)[0] >= 0.0 else None


def _shortest(model: Model, at: Evaluation) -> FloatArray | None:
    """Return the shortest step that meets all demands and bounds to first order."""
    from scipy.optimize import nnls

    lows, highs = model.bounds.T
    equal, identity = model.equalities, np.eye(len(at.u))
    low, high = np.isfinite(lows), np.isfinite(highs)
    # The step is to make rows · step at least what is missing.
    rows = np.vstack([at.gradients, -at.gradients[equal], identity[low], -identity[high]])
    missing = np.concatenate(
        [-at.values, at.values[equal], (lows - at.u)[low], (at.u - highs)[high]]
    )
    # The step is proportional to the misses, so these may be in units of the worst one.
    unit = missing.max()
    goal = np.zeros(len(at.u) + 1)
    goal[-1] = 1.0
    matrix = np.vstack([rows.T, np.maximum(missing / unit, -FAR)])
    factors, norm = nnls(matrix, goal)
    if norm <= CONTRADICTION:
        return None
    residual = matrix @ factors - goal
    return -unit * residual[:-1] / residual[-1]
