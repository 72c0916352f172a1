"""Local minimisation under constraints, and the stages that a long computation reports."""

from __future__ import annotations

import functools
import importlib
from collections.abc import Callable
from contextlib import AbstractContextManager
from typing import Any

import numpy as np

from explorer.numerics.arrays import FloatArray

Watch = Callable[[str, float], None]
"""Callback before each stage: it takes a description of the stage and the share of stages that
are done, at least 0 and below 1, and ends the computation by raising an exception."""


def ignore_stage(words: str, share: float) -> None:
    """Ignore the stage; the default callback."""


class Stages:
    """The stages of one computation, with a callback before each and a number, or a bound of it."""

    def __init__(self, watch: Watch, count: int) -> None:
        self.count = count
        self._watch = watch
        self._started = 0

    def begin(self, words: str) -> None:
        """Report to the callback that the next stage begins, and what it computes."""
        self._watch(words, self._started / max(self.count, self._started + 1))
        self._started += 1


def one_thread() -> AbstractContextManager[object]:
    """Keep linear algebra to one thread within a `with` block.

    SLSQP calls LAPACK, whose last digits depend on the number of threads, and so on the machine.
    """
    return _libraries().limit(limits=1, user_api="blas")


@functools.cache
def _libraries() -> Any:
    """Return the controller of the threads of the libraries of linear algebra."""
    from threadpoolctl import ThreadpoolController  # pyright: ignore[reportMissingTypeStubs]

    # It controls only libraries that are loaded.
    importlib.import_module("scipy.linalg")
    return ThreadpoolController()


def descend(
    objective: Callable[[FloatArray], tuple[float, FloatArray]],
    constraints: Callable[[FloatArray], FloatArray],
    start: FloatArray,
) -> FloatArray | None:
    """Return the last iterate of SciPy's SLSQP, shape (n,); None if it is not finite.

    The objective gives a value and its gradient (n,), the constraints values (m,) that must not be
    negative, all scaled to the order of one. The caller checks whether the result is feasible and
    better than the start.
    """
    from scipy import optimize

    untyped: Any = optimize
    with one_thread():
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
