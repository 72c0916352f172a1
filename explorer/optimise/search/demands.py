"""The demands of a problem as smooth functions with their exact gradients.

Each demand is dimensionless and of about unit size: at least zero where it is met, or
exactly zero for an equality. All are measured at a `SearchState`.
"""

from __future__ import annotations

from collections.abc import Callable
from typing import NamedTuple

import numpy as np

from explorer.measures.catalogue import CATALOGUE
from explorer.numerics.arrays import FloatArray
from explorer.optimise.problem import distances_of
from explorer.optimise.search.state import SearchState
from explorer.workspace.limits.constraints import YAW
from explorer.workspace.limits.table import GAP

# Tolerance of a demand that is no limit, dimensionless.
MET = 1e-8
# What a demand over many poses must have to spare in those of them that a search looks at, so that
# their neighbours keep it too; dimensionless, and larger than the tolerance.
RESERVE = 3e-8


Measured = tuple[FloatArray, FloatArray]
"""The values (m,) of m demands and their derivatives (m, n) by the n scaled variables."""


class SearchDemand(NamedTuple):
    """One or several conditions of one kind.

    Attributes:
        names: Name of each condition.
        measure: Function that returns the values and their derivatives in a state.
        is_equality: Whether the values must be zero, rather than at least zero.
        is_limit: Whether it is a limit of the design, with the tolerance of all limits.
    """

    names: tuple[str, ...]
    measure: Callable[[SearchState], Measured]
    is_equality: bool = False
    is_limit: bool = False


def volume_demand(volume: float, *, is_equality: bool) -> SearchDemand:
    """Return (V / V′)^⅓ − 1 of the volume, exactly zero or at least: it is nearly linear."""

    def measure(state: SearchState) -> Measured:
        root, gradient = state.volume_root(volume)
        return np.array([root - 1.0]), gradient[None, :]

    return SearchDemand((CATALOGUE["volume"].label,), measure, is_equality=is_equality)


def reach_demand(reach: float) -> SearchDemand:
    """Return 1 − longest leg / reach."""

    def measure(state: SearchState) -> Measured:
        value, gradient = state.longest_leg
        return np.array([1.0 - value / reach]), -gradient[None, :] / reach

    return SearchDemand((CATALOGUE["longest_leg"].label,), measure)


def side_demands(start: SearchState) -> list[SearchDemand]:
    """Return the demands that a design lies on the same sides as a start, by some distance.

    They are the distances from degenerate designs, which are linear, so that no step of the solver
    breaks them after a start that keeps them; and the gap of the carriages. The order of these is
    no demand: each design keeps that of its own home pose.
    """
    least, size = start.problem.demands.least, start.problem.size
    signs, side = np.sign(_distances(start)), 1.0 if _gap(start) >= 0.0 else -1.0

    def measure_distances(state: SearchState) -> Measured:
        rows = state.rows(("a3y", "b1y", "b3"))
        rows[2] -= state.rows(("b2",))[0]
        values = signs * _distances(state) - least
        return values / size, signs[:, None] * rows / size

    def measure_gap(state: SearchState) -> Measured:
        u, span = state.rotation[:, 0], state.design.b3 - state.design.b2
        slope = state.along({"b3": float(u[0]), "b2": -float(u[0]), YAW: -span * float(u[1])})
        value = side * _gap(state) - state.design.limits.gap
        return np.array([value / size]), side * slope[None, :] / size

    found: list[SearchDemand] = []
    if least > 0.0:
        names = "distance from a3y = 0", "distance from b1y = 0", "distance from b2 = b3"
        found.append(SearchDemand(names, measure_distances))
    if start.design.limits.gap > 0.0:
        found.append(SearchDemand((GAP,), measure_gap, is_limit=True))
    return found


def _distances(state: SearchState) -> FloatArray:
    return np.array([*distances_of(state.design).values()])


def _gap(state: SearchState) -> float:
    return (state.design.b3 - state.design.b2) * float(state.rotation[0, 0])
