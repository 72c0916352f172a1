"""Designs that are compared with the live one, and how: a part of the state."""

from __future__ import annotations

from dataclasses import dataclass
from typing import TypeAlias

from explorer.app.state.geometry import without_name
from explorer.app.state.parts import FeaturePart
from explorer.mechanism.design import Design

SLOTS = ("A", "B", "C")
"""Names of the places for pinned designs."""

Pinned: TypeAlias = tuple[Design | None, Design | None, Design | None]


@dataclass(frozen=True)
class CompareView:
    """How designs are compared in the scene: by their workspaces over one another, by outlines."""

    overlay: bool = False
    outlines: bool = False


@dataclass(frozen=True)
class Compared(FeaturePart, name="compared"):
    """The designs that the live one is compared with, and how.

    Copies of designs are pinned in the order of `SLOTS`; None where a place is free.
    """

    pinned: Pinned = (None, None, None)
    look: CompareView = CompareView()

    @property
    def is_empty(self) -> bool:
        """Whether nothing is pinned."""
        return not any(self.pinned)

    def slot_of(self, design: Design) -> int | None:
        """Return the index of the place of a design under any name; None if it is not pinned."""
        plain = without_name(design)
        slots = (
            i for i, pinned in enumerate(self.pinned) if pinned and without_name(pinned) == plain
        )
        return next(slots, None)
