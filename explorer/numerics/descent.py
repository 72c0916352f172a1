"""Local minimisation of a function of a few variables under inequality constraints."""

from __future__ import annotations

from collections.abc import Callable
from typing import Any

import numpy as np

from explorer.numerics.arrays import FloatArray


def descend(
    objective: Callable[[FloatArray], tuple[float, FloatArray]],
    constraints: Callable[[FloatArray], FloatArray],
    start: FloatArray,
) -> FloatArray | None:
    """Return the last iterate of SciPy's SLSQP, shape (n,); None if it is not finite.

    Variables, objective and constraints must be scaled to the order of one. The caller checks
    whether the result is feasible and better than the start.

    Args:
        objective: Function from variables (n,) to the value and its gradient (n,).
        constraints: Function from variables (n,) to values (m,) that must not be negative.
        start: Initial variables, shape (n,).
    """
    from scipy import optimize

    untyped: Any = optimize
    result = untyped.minimize(
        objective,
        start,
        jac=True,
        method="SLSQP",
        constraints={"type": "ineq", "fun": constraints},
        options={"maxiter": 60, "ftol": 1e-14},
    )
    variables = np.asarray(result.x, dtype=np.float64)
    return variables if np.isfinite(variables).all() else None
