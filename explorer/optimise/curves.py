"""Curves of a search over its iterates: objective, volume and worst demand."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from types import MappingProxyType
from typing import Literal

import numpy as np

from explorer.measures.catalogue import CATALOGUE
from explorer.numerics.arrays import FloatArray
from explorer.optimise.outcome import Iterate
from explorer.optimise.problem import ObjectiveName, Problem
from explorer.optimise.record import Step

GOALS: Mapping[ObjectiveName, str] = MappingProxyType(
    {
        "match-volume": "volume",
        "smallest-reach": "longest_leg",
        "largest-volume": "volume",
        "largest-margin": "box_margin",
        "smallest-load": "load_share",
        "smallest-error": "worst_error",
        "smallest-deflection": "deflection",
    }
)
"""The name in the catalogue of the measure that each objective improves."""

CALLED: Mapping[ObjectiveName, str] = MappingProxyType(
    {
        objective: "F" if objective == "match-volume" else CATALOGUE[name].label
        for objective, name in GOALS.items()
    }
)
"""The name of the value of each objective: F, or the label of the measure in the catalogue."""

# Value drawn for an objective of zero, which has no logarithm.
LEAST = 1e-16


@dataclass(frozen=True)
class Curve:
    """Values of the iterates of one start.

    Attributes:
        kind: Quantity of the values.
        values: Value of each iterate, shape (n,); NaN for an infinite one.
        level: Value to compare the others with, or None.
        powers: Whether the values are exponents of ten.
    """

    kind: Literal["objective", "volume", "spare"]
    values: FloatArray
    level: float | None
    powers: bool = False


def curves_of(problem: Problem, iterates: Sequence[Iterate] | Sequence[Step]) -> list[Curve]:
    """Return the curves of one start of a search.

    Args:
        problem: The problem.
        iterates: Iterates in their order; not empty.
    """
    objective = np.array([iterate.objective for iterate in iterates], dtype=np.float64)
    curves: list[Curve] = []
    if problem.objective == "match-volume":
        powers = np.log10(np.maximum(objective, LEAST))
        curves.append(Curve("objective", powers, None, powers=True))
    elif problem.objective != "largest-volume":
        curves.append(Curve("objective", objective, None))
    volume = np.array([iterate.volume for iterate in iterates])
    curves.append(Curve("volume", volume, problem.demands.volume))
    if any(iterate.worst for iterate in iterates):
        curves.append(Curve("spare", np.array([iterate.spare for iterate in iterates]), 0.0))
    return curves
