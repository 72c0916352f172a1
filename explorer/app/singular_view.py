"""How singularities are shown: diagram, arrows and arcs, ghost, ellipsoid and ball."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Literal

Ghost = Literal["none", "κ1 = 0", "κ2 = 0", "κ3 = 0", "nearest"]
Arrows = Literal["one in use", "all six", "none"]
Gain = Literal["none", "speed", "force"]


@dataclass(frozen=True)
class SingularView:
    """How singularities are shown.

    Attributes:
        ghost: Which of the nearest singular poses is drawn.
        strata: Whether the diagram of the strata is drawn.
        arrows: Which of the six uncoupled motions are drawn.
        ellipsoid: Which of them is drawn at b4, of speeds or of forces.
        ball: Whether the largest ball without singular positions is drawn.
    """

    ghost: Ghost = "none"
    strata: bool = False
    arrows: Arrows = "one in use"
    ellipsoid: Gain = "none"
    ball: bool = False
