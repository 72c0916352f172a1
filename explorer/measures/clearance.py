"""The least clearance of the legs over the part of a workspace that is off the singular planes."""

from __future__ import annotations

import msgspec
import numpy as np

from explorer.legs.clearance import PAIRS
from explorer.mechanism.design import Design
from explorer.numerics.arrays import FloatArray
from explorer.workspace.least_clearance import least_clearances
from explorer.workspace.slices.volume import workspace_volume

CERTAIN = 1e-3
"""Accuracy of the least clearance, as a share of the reach."""

MARGIN_OF_CLEARANCE = 0.05
"""Least |δ| of the positions at which clearances count by default, as a share of the reach."""


def clearance_margin_of(design: Design) -> float:
    """Return the least |δ| at which clearances count by default, in design units."""
    return MARGIN_OF_CLEARANCE * design.reach


def clearance_beyond(
    design: Design, margin: float, rotation: FloatArray | None = None
) -> tuple[float, tuple[int, int]] | tuple[None, None]:
    """Return the least clearance where every |δ| is at least some length, and its two legs.

    The clearance is accurate to a thousandth of the reach. Both are None where the
    constant-orientation workspace has no such position, or no volume: the positions left may
    then all lie on a surface.

    Args:
        design: The manipulator; nearer to a singularity its legs may have to meet.
        margin: The least |δ|, in design units.
        rotation: Platform to base, shape (3, 3); that of the home pose if None.
    """
    r = design.home_pose.rotation if rotation is None else rotation
    if workspace_volume(design, r, explain=False).volume <= 0.0:
        return None, None
    own_margin = design.limits.margin or 0.0
    limits = msgspec.structs.replace(design.limits, margin=max(own_margin, margin))
    clearances = least_clearances(
        msgspec.structs.replace(design, limits=limits),
        r,
        CERTAIN * design.reach,
        only_least=True,
    ).clearance
    pair = int(clearances.argmin())
    return (float(clearances[pair]), PAIRS[pair]) if np.isfinite(clearances[pair]) else (None, None)
