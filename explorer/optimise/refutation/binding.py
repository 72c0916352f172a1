"""The limit that keeps the workspace of a design from a volume: without it alone it has that."""

from __future__ import annotations

from collections.abc import Iterator
from typing import NamedTuple

import msgspec

from explorer.mechanism.design import LENGTHS, Design, Limits
from explorer.mechanism.home import home_pose
from explorer.optimise.refutation.refutation import BOX_LIMIT
from explorer.workspace.slices.volume import workspace_volume

# A maximum length that bounds nothing, as a multiple of the reach.
UNBOUNDED = 1e3


class Binding(NamedTuple):
    """The limit that binds.

    Attributes:
        limit: Its name, such as "box".
        volume: Of the workspace without it, in cubed design units.
    """

    limit: str
    volume: float


def binding(design: Design, volume: float) -> Binding | None:
    """Return the limit without which a design has a volume; None if no single one is in the way.

    Of several the one without which it has the most.

    Args:
        design: That has less.
        volume: In cubed design units.
    """
    start = msgspec.structs.replace(design, home=home_pose(design))
    found: list[Binding] = []
    for name, limits in _without_one(design):
        freed = msgspec.structs.replace(start, limits=limits)
        found.append(Binding(name, workspace_volume(freed, explain=False).volume))
    enough = [each for each in found if each.volume >= volume]
    return max(enough, key=lambda each: each.volume, default=None)


def _without_one(design: Design) -> Iterator[tuple[str, Limits]]:
    """Yield the limits without one of them, and its name, for each that can be lifted."""
    limits = design.limits
    if limits.box is not None:
        yield BOX_LIMIT, msgspec.structs.replace(limits, box=None)
    if limits.guide is not None:
        yield "guide", msgspec.structs.replace(limits, guide=None)
    if limits.margin:
        yield "margin", msgspec.structs.replace(limits, margin=0.0)
    for name in LENGTHS:
        least, most = getattr(limits, name)
        if least > 0.0:
            yield f"{name} minimum", msgspec.structs.replace(limits, **{name: (0.0, most)})
        if most is not None:
            free = (least, UNBOUNDED * design.reach)
            yield f"{name} maximum", msgspec.structs.replace(limits, **{name: free})
