"""How near each incidence is, as the scene shows it: gaps, flags and tetrahedra agree on this.

An incidence is shown from twice its warning value on, and fully at the warning value and below:
first lines and planes reach out, and once they have arrived the gap between them is drawn. The row
of its margin shows it too, while a pointer rests there.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from explorer.app.features.feature import Services
from explorer.app.features.mechanism.hovered import HoveredRow
from explorer.app.scene.placing import Placed
from explorer.numerics.arrays import FloatArray

HOVER = "margins.hover"
# Level, in warning values, from which on an incidence fades in.
FADE_FROM = 2.0
# Presence at which lines and planes have reached the ends of the gap.
ARRIVED = 0.5
# Farthest that an end of a gap may be from its flag's point, and the longest gap, in reaches.
FARTHEST = 2.0
# Length of a gap, as a share of the reach, up to which its ends are one point to the eye.
CLOSED = 1e-6


@dataclass(frozen=True)
class Approach:
    """How near one incidence is.

    Attributes:
        level: Its level, see `explorer.measures.verdict`.
        presence: How much of it is shown: 0 where it is far, 1 at the warning value and below.
        is_hovered: Whether a pointer rests on the row of its margin.
        is_filled: Whether its tetrahedron is filled: that of the row that is pointed at, otherwise
            the nearest one, once it fades in.
        is_touching: Whether the incidence holds and its gap is closed; parallel lines leave one.
        ends: Ends of its gap on the base flag and on the platform flag, in the scene, shape (2, 3);
            None if they are too far away to be drawn.
    """

    level: float
    presence: float
    is_hovered: bool
    is_filled: bool
    is_touching: bool
    ends: FloatArray | None

    @property
    def arrival(self) -> float:
        """The share of the way to the ends of the gap that lines and planes have reached out."""
        return min(1.0, self.presence / ARRIVED)

    @property
    def has_gap(self) -> bool:
        """Whether the gap is shown."""
        return self.presence >= ARRIVED

    @property
    def has_label(self) -> bool:
        """Whether the gap has a label, in place of the name of the tetrahedron."""
        return self.has_gap and (self.is_filled or self.level < 1.0)


class HoveredMargin(HoveredRow):
    """The margin, 1 to 3, on whose row a pointer rests; the scene shows its incidence."""

    def __init__(self, services: Services) -> None:
        super().__init__(services, HOVER, range(1, 4))


def approaches(placed: Placed, hovered: int | None) -> tuple[Approach, Approach, Approach]:
    """Return how near the three incidences are.

    Args:
        placed: The frame that is drawn.
        hovered: Number 1 to 3 of the margin on whose row a pointer rests, if any.
    """
    levels, snapshot = placed.frame.verdict.levels, placed.frame.snapshot
    nearest = min(range(3), key=levels.__getitem__)
    if hovered is not None:
        filled = hovered - 1
    else:
        filled = nearest if levels[nearest] < FADE_FROM else None
    gaps, reach = snapshot.gaps, snapshot.design.reach
    ends = placed.scale * np.stack([gaps.base, gaps.platform], axis=1)
    ways = np.stack([gaps.base, gaps.platform - snapshot.points.b4, gaps.platform - gaps.base])
    farthest = np.abs(ways).max(axis=(0, 2)).tolist()

    def approach(index: int) -> Approach:
        level, is_hovered = levels[index], index + 1 == hovered
        faded_in = min(1.0, max(0.0, (FADE_FROM - level) / (FADE_FROM - 1.0)))
        return Approach(
            level,
            1.0 if is_hovered else faded_in,
            is_hovered,
            index == filled,
            level == 0.0 and gaps.lengths[index] <= CLOSED * reach,
            ends[index] if farthest[index] <= FARTHEST * reach else None,
        )

    return approach(0), approach(1), approach(2)


def is_shown(placed: Placed, index: int, approach: Approach) -> bool:
    """Whether the tetrahedron of a margin and its gap are shown at all."""
    # Like the flags, they would stand among parts that are drawn apart.
    if placed.is_apart:
        return False
    return placed.frame.state.view.tetrahedra[index] or approach.is_hovered
