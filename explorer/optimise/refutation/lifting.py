"""Designs without one of their limits."""

from __future__ import annotations

import msgspec

from explorer.mechanism.design import LENGTHS, Design, Limits, Swing
from explorer.workspace.limits.constraints import GAP

BOX_LIMIT = "box"
"""Name of the limit that the commands and the page offer to lift."""

SWING_LIMIT, MAXIMA = "swing", "maximum lengths"
"""Names of the limits on the swing of all legs, and of all four maximum lengths."""


def without_one(limits: Limits, most: float | None = None) -> dict[str, Limits]:
    """Return the limits without one that is in force, by its name, such as "l1 maximum".

    Args:
        limits: The limits.
        most: Maximum of a length whose maximum is lifted, in design units; None for the reach.
    """
    replace = msgspec.structs.replace
    lifted: dict[str, Limits] = {}
    if limits.box is not None:
        lifted[BOX_LIMIT] = replace(limits, box=None)
    if limits.guide is not None:
        lifted["guide"] = replace(limits, guide=None)
    if limits.margin:
        lifted["margin"] = replace(limits, margin=0.0)
    if limits.gap:
        lifted[GAP] = replace(limits, gap=0.0)
    for name in LENGTHS:
        low, high = getattr(limits, name)
        if low > 0.0:
            lifted[f"{name} minimum"] = replace(limits, **{name: (0.0, high)})
        if high is not None:
            lifted[f"{name} maximum"] = replace(limits, **{name: (low, most)})
    return lifted


def lift(design: Design, limit: str) -> Design | None:
    """Return a design without one limit; None if it has no such limit.

    A maximum length that is lifted becomes the reach. The home pose stays where it was.

    Args:
        design: The manipulator.
        limit: Name of the limit: one of `without_one`, `SWING_LIMIT` or `MAXIMA`.
    """
    limits = design.limits
    if limit == SWING_LIMIT:
        lifted = msgspec.structs.replace(limits, swing=Swing())
    elif limit == MAXIMA:
        tied = {name: (getattr(limits, name)[0], None) for name in LENGTHS}
        lifted = msgspec.structs.replace(limits, **tied)
    else:
        lifted = without_one(limits).get(limit, limits)
    if lifted == limits:
        return None
    return msgspec.structs.replace(design, limits=lifted, home=design.home_pose)
