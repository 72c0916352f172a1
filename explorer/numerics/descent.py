"""Descent to the nearest least of a function of a few numbers, within limits."""

from __future__ import annotations

from collections.abc import Callable
from typing import Any

import numpy as np

from explorer.numerics.arrays import FloatArray


def descend(
    value: Callable[[FloatArray], tuple[float, FloatArray]],
    kept: Callable[[FloatArray], FloatArray],
    start: FloatArray,
) -> FloatArray | None:
    """Return where SciPy's SLSQP ends, shape (n,), None if nowhere finite.

    All numbers are to be of the order of one. Whether it is less, and within, is for the
    caller to see.

    Args:
        value: Of a place (n,), with its gradient (n,).
        kept: What must not be negative there, shape (m,).
        start: Shape (n,).
    """
    from scipy import optimize

    untyped: Any = optimize
    found = untyped.minimize(
        value,
        start,
        jac=True,
        method="SLSQP",
        constraints={"type": "ineq", "fun": kept},
        options={"maxiter": 60, "ftol": 1e-14},
    )
    at = np.asarray(found.x, dtype=np.float64)
    return at if np.isfinite(at).all() else None
