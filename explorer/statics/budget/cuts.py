"""The least Σ c_i / x_i within linear bounds, by an interior-point solver of cone programs."""

from __future__ import annotations

import importlib
from typing import Any

import numpy as np

from explorer.numerics.arrays import FloatArray

# Least share of its bound that a variable is given.
LEAST = 1e-15


class Cuts:
    """Linear bounds A x ≤ 1 with A ≥ 0 of variables from 0 to 1, and the least Σ c_i / x_i.

    Args:
        costs: The costs c, shape (m,), positive.
    """

    def __init__(self, costs: FloatArray) -> None:
        self.least = float(costs.sum())
        """Lower bound of Σ c_i / x_i, from the multipliers of the bounds so far."""
        self._costs = costs
        self._rows: list[FloatArray] = []
        self._guess = np.sqrt(costs) / np.sqrt(costs).sum()

    def effort(self, x: FloatArray) -> float:
        """Return Σ c_i / x_i."""
        return float((self._costs / x).sum())

    def add(self, row: FloatArray, right: float) -> None:
        """Add the bound row · x ≤ right, with right > 0."""
        self._rows.append(row / right)

    def solve(self) -> FloatArray:
        """Return the x of least Σ c_i / x_i, shape (m,), and improve the lower bound.

        With u_i ≥ 1 / x_i, that is |(2, x_i − u_i)| ≤ x_i + u_i, the sum is linear in u. All x
        are taken over the last ones, so that they are near 1 whatever the range of the costs.
        """
        from scipy import sparse

        # The solver has no types.
        clarabel: Any = importlib.import_module("clarabel")

        m, k = len(self._costs), len(self._rows)
        costs = self._costs / self._guess
        size = float(costs.max())
        costs = costs / size
        one, none = sparse.eye_array(m), sparse.csc_array((m, m))
        # Rows x + u, 2 and x − u of all cones, then in the order of the cones.
        halves = sparse.block_array([[-one, -one], [none, none], [-one, one]], format="csr")
        order = np.arange(3 * m).reshape(3, m).T.ravel()
        rows = np.array(self._rows) * self._guess
        bounds = sparse.block_array(
            [[sparse.csr_array(rows), sparse.csr_array((k, m))], [one, none]]
        )
        matrix = sparse.vstack([bounds, halves[order]], format="csc")
        rights = np.concatenate([np.ones(k), 1.0 / self._guess, np.tile([0.0, 2.0, 0.0], m)])
        settings = clarabel.DefaultSettings()
        settings.verbose = False
        settings.tol_gap_rel = settings.tol_gap_abs = settings.tol_feas = 1e-11
        cones = [clarabel.NonnegativeConeT(k + m), *(clarabel.SecondOrderConeT(3),) * m]
        solution = clarabel.DefaultSolver(
            sparse.csc_array((2 * m, 2 * m)),
            np.concatenate([np.zeros(m), costs]),
            matrix,
            rights,
            cones,
            settings,
        ).solve()
        multipliers = np.maximum(np.array(solution.z)[: k + m], 0.0)
        # The dual function bounds the sum from below for any multipliers.
        slopes = rows.T @ multipliers[:k] + multipliers[k:]
        bound = 2.0 * np.sqrt(costs * slopes).sum() - multipliers @ rights[: k + m]
        self.least = max(self.least, size * float(bound))
        x = np.clip(np.array(solution.x)[:m] * self._guess, LEAST, 1.0)
        if np.isfinite(x).all():
            self._guess = x
        return x
