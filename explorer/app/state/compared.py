"""What is compared with the live design, and how: a part of the state, frozen as all of it."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Literal, TypeAlias

import msgspec

from explorer.mechanism.design import Design

SLOTS = ("A", "B", "C")
"""What people call the places for pinned designs."""

Pinned: TypeAlias = tuple[Design | None, Design | None, Design | None]


@dataclass(frozen=True)
class Look:
    """How designs are compared.

    Attributes:
        shows: Whether figures stand in a table or are drawn as bars.
        millimetres: Whether lengths are told in millimetres, or in units of the live design.
        overlay: Whether the workspaces are drawn over one another.
        at_pose: Whether that of the live design is drawn at its present orientation, rather
            than at that of its home.
        outlines: Whether the pinned designs are outlined in their home poses.
    """

    shows: Literal["table", "bars"] = "table"
    millimetres: bool = False
    overlay: bool = False
    at_pose: bool = False
    outlines: bool = False


@dataclass(frozen=True)
class Compared:
    """What the live design is compared with.

    Attributes:
        pinned: Copies of designs, in the order of `SLOTS`; None where a place is free.
        look: How they are compared.
    """

    pinned: Pinned = (None, None, None)
    look: Look = Look()

    @property
    def is_empty(self) -> bool:
        """Whether nothing is pinned."""
        return not any(self.pinned)

    def slot_of(self, design: Design) -> int | None:
        """Return where a design is pinned, by whatever name; None if it is not."""
        plain = unnamed(design)
        found = (slot for slot, each in enumerate(self.pinned) if each and unnamed(each) == plain)
        return next(found, None)


def unnamed(design: Design) -> Design:
    """Return a design without its name, on which nothing else depends."""
    return msgspec.structs.replace(design, name="")
