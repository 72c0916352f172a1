"""Whether a place is an optimum, checked from the conditions themselves.

At one the slope of the objective is a sum of the gradients of the demands and bounds that
are just met, those of inequalities with a factor of at least zero (Karush, Kuhn and
Tucker). SciPy's own verdict only says that its steps became small.
"""

from __future__ import annotations

from typing import NamedTuple

import numpy as np

from explorer.arrays import FloatArray
from explorer.optimise.model import Evaluation, Model

# A demand or bound within this of being met exactly takes part.
ACTIVE = 1e-6


class Optimality(NamedTuple):
    """How nearly the conditions hold.

    Attributes:
        residual: What no sum makes up, over the slope of the objective.
        holding: The demand or bound with the largest factor, "" if none has one.
    """

    residual: float
    holding: str


def optimality(model: Model, at: Evaluation) -> Optimality:
    """Return how nearly a place that meets all demands is an optimum."""
    from scipy.optimize import nnls

    rows: list[FloatArray] = []
    names: list[str] = []
    # An equality may pull either way.
    for index, (value, name) in enumerate(zip(at.values.tolist(), model.names, strict=True)):
        gradient = at.gradients[index]
        if model.equalities[index]:
            rows += [gradient, -gradient]
            names += [name, name]
        elif value <= ACTIVE:
            rows.append(gradient)
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
    if not rows:
        return Optimality(1.0, "")
    columns = np.array(rows).T
    factors, left = nnls(columns, at.slope)
    pulls = factors * np.linalg.norm(columns, axis=0)
    strongest = int(pulls.argmax())
    return Optimality(left / steepness, names[strongest] if pulls[strongest] > 0.0 else "")
