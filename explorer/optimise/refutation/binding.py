"""The limit that alone keeps the workspace of a design from a volume."""

from __future__ import annotations

from collections.abc import Iterator
from typing import NamedTuple

import msgspec

from explorer.mechanism.design import LENGTHS, Design, Limits
from explorer.mechanism.home import home_pose
from explorer.optimise.refutation.refutation import BOX_LIMIT
from explorer.workspace.slices.volume import workspace_volume

# Maximum length that bounds nothing, as a multiple of the reach.
UNBOUNDED = 1e3


class BindingLimit(NamedTuple):
    """A limit that alone keeps a workspace from a volume.

    Attributes:
        limit: Name of the limit, such as "box".
        volume: Volume of the workspace without it, in cubed design units.
    """

    limit: str
    volume: float


def find_binding_limit(design: Design, volume: float) -> BindingLimit | None:
    """Return the one limit without which a design has a volume; None if no limit alone does it.

    Of several such limits it is the one without which the volume is the largest.

    Args:
        design: The manipulator, of a smaller volume.
        volume: The volume, in cubed design units.
    """
    start = msgspec.structs.replace(design, home=home_pose(design))
    lifted: list[BindingLimit] = []
    for name, limits in _without_one(design):
        freed = msgspec.structs.replace(start, limits=limits)
        lifted.append(BindingLimit(name, workspace_volume(freed, explain=False).volume))
    enough = [binding for binding in lifted if binding.volume >= volume]
    return max(enough, key=lambda binding: binding.volume, default=None)


def _without_one(design: Design) -> Iterator[tuple[str, Limits]]:
    """Yield the name of each limit that can be lifted, and the limits without it."""
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
