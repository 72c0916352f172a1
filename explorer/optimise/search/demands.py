"""The demands of a problem as smooth functions with their exact gradients.

Each demand is dimensionless and of about unit size: at least zero where it is met, or
exactly zero for an equality. All are measured at a `SearchState`.
"""

from __future__ import annotations

from abc import ABC, abstractmethod
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


class Measured(NamedTuple):
    """The values (m,) of m demands and their derivatives (m, n) by the n scaled variables."""

    values: FloatArray
    gradients: FloatArray


class SearchDemand(ABC):
    """One or several conditions of one kind.

    Attributes:
        names: Name of each condition.
        is_equality: Whether the values must be zero, rather than at least zero.
        is_limit: Whether it is a limit of the design, with the tolerance of all limits.
    """

    names: tuple[str, ...] = ()
    is_equality = False
    is_limit = False

    @abstractmethod
    def measure(self, state: SearchState) -> Measured:
        """Return the values and their derivatives."""


class VolumeDemand(SearchDemand):
    """The volume of the workspace, exactly or at least, by its nearly linear cube root."""

    def __init__(self, volume: float, *, is_equality: bool) -> None:
        self.volume, self.is_equality = volume, is_equality
        self.names = (CATALOGUE["volume"].label,)

    def measure(self, state: SearchState) -> Measured:
        """Return (V / V′)^⅓ − 1."""
        root, gradient = state.volume_root(self.volume)
        return Measured(np.array([root - 1.0]), gradient[None, :])


class ReachDemand(SearchDemand):
    """A longest leg of at most some length."""

    def __init__(self, reach: float) -> None:
        self.reach = reach
        self.names = (CATALOGUE["longest_leg"].label,)

    def measure(self, state: SearchState) -> Measured:
        """Return 1 − reach / largest."""
        value, gradient = state.longest_leg
        return Measured(np.array([1.0 - value / self.reach]), -gradient[None, :] / self.reach)


class DegenerateDemand(SearchDemand):
    """The distances from degenerate designs, on the side where a run starts.

    They are linear, so no step of the solver breaks them after a start that keeps them.
    """

    names = ("distance from a3y = 0", "distance from b1y = 0", "distance from b2 = b3")

    def __init__(self, least: float, start: SearchState) -> None:
        self.least = least
        self.signs = np.sign(_distances(start))

    def measure(self, state: SearchState) -> Measured:
        """Return sign · distance − least, over the size of the start."""
        size = state.problem.size
        rows = state.rows(("a3y", "b1y", "b3"))
        rows[2] -= state.rows(("b2",))[0]
        values = self.signs * _distances(state) - self.least
        return Measured(values / size, self.signs[:, None] * rows / size)


def _distances(state: SearchState) -> FloatArray:
    return np.array([*distances_of(state.design).values()])


class GapDemand(SearchDemand):
    """The smallest gap of the carriages, in the order that they have where a run starts.

    The order itself is no demand: each design keeps that of its own home pose.
    """

    is_limit = True
    names = (GAP,)

    def __init__(self, start: SearchState) -> None:
        self.sign = 1.0 if _gap(start) >= 0.0 else -1.0

    def measure(self, state: SearchState) -> Measured:
        """Return sign · (d3 − d1) − gap, over the size of the start."""
        size, u = state.problem.size, state.rotation[:, 0]
        span = state.design.b3 - state.design.b2
        slope = state.along({"b3": float(u[0]), "b2": -float(u[0]), YAW: -span * float(u[1])})
        value = self.sign * _gap(state) - state.design.limits.gap
        return Measured(np.array([value / size]), self.sign * slope[None, :] / size)


def _gap(state: SearchState) -> float:
    return (state.design.b3 - state.design.b2) * float(state.rotation[0, 0])
