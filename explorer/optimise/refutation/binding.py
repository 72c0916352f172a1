"""The limit that alone keeps the workspace of a design from a volume."""

from __future__ import annotations

from typing import NamedTuple

import msgspec

from explorer.mechanism.design import Design
from explorer.optimise.refutation.lifting import without_one
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
    start = msgspec.structs.replace(design, home=design.home_pose)
    lifted: list[BindingLimit] = []
    for name, limits in without_one(design.limits, UNBOUNDED * design.reach).items():
        freed = msgspec.structs.replace(start, limits=limits)
        lifted.append(BindingLimit(name, workspace_volume(freed, explain=False).volume))
    enough = [binding for binding in lifted if binding.volume >= volume]
    return max(enough, key=lambda binding: binding.volume, default=None)
