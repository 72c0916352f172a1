"""Where in a workspace a clearance is not kept: found, or proven to be nowhere.

As p moves, the distance of two legs changes no faster than p itself. So a cell of positions
keeps the distance at its middle less half its diagonal, and is cut in eight until that
settles it. What is left open by cells of a tenth of the clearance, or of a pair by too many
cells, counts as kept.
"""

from __future__ import annotations

from collections.abc import Callable

import numpy as np

from explorer.legs.clearance import PAIRS, leg_clearances, radii_of_pairs
from explorer.mechanism.design import Design
from explorer.mechanism.margins import margins
from explorer.numerics.arrays import FloatArray
from explorer.workspace.limits.constraints import HalfSpace, constraints
from explorer.workspace.limits.region import region_of
from explorer.workspace.slices.volume import bounds

# Cells along the longest side at first.
FIRST_CELLS = 12
# Half-diagonal of the smallest cells, as a share of the clearance.
FINEST = 0.1
# Cells of one size that are cut for a pair, at the most.
MOST_CELLS = 12_000
# Cells that are looked at in one go.
AT_ONCE = 10_000

HALVES = np.array([[(-1.0, 1.0)[c >> a & 1] for a in range(3)] for c in range(8)])


def crossings(
    design: Design,
    rotation: FloatArray,
    clearance: float,
    margin: float,
    before_each: Callable[[], None],
) -> FloatArray:
    """Return the positions at which each pair of legs comes nearest, if nearer than allowed.

    Args:
        design: The manipulator.
        rotation: Platform to base, shape (3, 3).
        clearance: What every pair is to keep.
        margin: Only positions whose margins are all at least this large count.
        before_each: Called now and then; may raise.

    Returns:
        Shape (k, 3), one position for each pair that does not keep it.
    """
    limits = constraints(design, rotation)
    scale = np.array(
        [float(np.linalg.norm(c.normal)) if isinstance(c, HalfSpace) else 1.0 for c in limits]
    )
    least, places = np.full(len(PAIRS), clearance), np.zeros((len(PAIRS), 3))
    region = region_of(limits)
    lows, highs = bounds(region)
    if region.is_empty or not (lows < highs).all():
        return places[:0]
    many = np.maximum(1, np.ceil((highs - lows) / (highs - lows).max() * FIRST_CELLS)).astype(int)
    half = 0.5 * (highs - lows) / many
    middles = lows + half * (2.0 * np.indices(tuple(many.tolist())).reshape(3, -1).T + 1.0)
    # Legs 2 and 3 stand upright on the guide, in planes that keep their distance.
    upright = abs((design.b3 - design.b2) * float(rotation[0, 0])) - radii_of_pairs(design)
    asked = np.array([pair != (2, 3) for pair in PAIRS]) | (upright < clearance)
    while len(middles) and asked.any():
        radius = float(np.linalg.norm(half))
        near = (np.abs(margins(middles, rotation)) - margin).min(axis=1)
        slack = np.column_stack([limit.slack(middles) for limit in limits]) / scale
        inside = np.minimum(slack.min(axis=1), near)
        middles, inside = middles[inside > -radius], inside[inside > -radius]
        found = np.zeros((0, len(PAIRS)))
        for part in np.array_split(middles, 1 + len(middles) // AT_ONCE):
            before_each()
            found = np.vstack([found, leg_clearances(design, part, rotation).clearance])
        counted, at = found[inside >= 0.0], middles[inside >= 0.0]
        if len(counted):
            nearest = counted.argmin(axis=0)
            value = counted[nearest, range(len(PAIRS))]
            places = np.where((value < least)[:, None], at[nearest], places)
            least = np.minimum(value, least)
        if radius <= FINEST * clearance:
            break
        half = 0.5 * half
        # Only what may hide less than is known already, and pairs that it tells much about.
        hides = found - radius < least
        asked &= hides.sum(axis=0) <= MOST_CELLS
        middles = middles[hides[:, asked].any(axis=1)]
        middles = (middles[:, None, :] + half * HALVES).reshape(-1, 3)
    return places[least < clearance]
