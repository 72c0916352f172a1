"""What is drawn of a search: its objective, the volume and the worst demand, by iterates."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from types import MappingProxyType
from typing import Literal, Protocol

import numpy as np

from explorer.numerics.arrays import FloatArray
from explorer.optimise.problem import ObjectiveName, Problem

CALLED: Mapping[ObjectiveName, str] = MappingProxyType(
    {
        "match-volume": "F",
        "smallest-reach": "reach",
        "largest-volume": "volume",
        "largest-margin": "margin over the box",
    }
)
"""What people call the value of each objective."""

# What is drawn of an objective that is met exactly, since zero is no power of ten.
LEAST = 1e-16


class Measured(Protocol):
    """What an iterate and its step in a record have in common."""

    @property
    def objective(self) -> float:
        """The value of the objective."""
        ...

    @property
    def volume(self) -> float:
        """The exact volume."""
        ...

    @property
    def worst(self) -> str:
        """The demand that is missed most."""
        ...

    @property
    def spare(self) -> float:
        """Its value."""
        ...


@dataclass(frozen=True)
class Curve:
    """Values of the iterates of one start.

    Attributes:
        kind: What they are of.
        values: In their order, shape (n,).
        level: What they are compared with, or None.
        powers: Whether they are exponents of ten.
    """

    kind: Literal["objective", "volume", "spare"]
    values: FloatArray
    level: float | None
    powers: bool = False


def curves_of(problem: Problem, iterates: Sequence[Measured]) -> list[Curve]:
    """Return the curves of one start of a search.

    Args:
        problem: What is looked for.
        iterates: In the order in which they were found; not empty.
    """
    objective = np.array([each.objective for each in iterates])
    curves: list[Curve] = []
    if problem.objective == "match-volume":
        powers = np.log10(np.maximum(objective, LEAST))
        curves.append(Curve("objective", powers, None, powers=True))
    elif problem.objective != "largest-volume":
        curves.append(Curve("objective", objective, None))
    volume = np.array([each.volume for each in iterates])
    curves.append(Curve("volume", volume, problem.demands.volume))
    if any(each.worst for each in iterates):
        curves.append(Curve("spare", np.array([each.spare for each in iterates]), 0.0))
    return curves
