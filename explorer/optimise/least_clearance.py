"""The least clearance of the legs over a whole workspace, with a proof.

As p moves, the distance of two legs changes no faster than p itself. So a cell of positions
keeps the distance at its centre less half its diagonal, and cells are cut until what is
left is below the tolerance.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import ArrayLike

from explorer.arrays import FloatArray
from explorer.clearance import PAIRS, leg_clearances
from explorer.constraints import HalfSpace, constraints
from explorer.design import Design
from explorer.pose import checked_rotation
from explorer.region import region_of
from explorer.singularity import margins
from explorer.workspace import bounds, home_rotation

# Cells along the longest side of the first cut, and how many are looked at, at the most.
FIRST_CELLS = 12
MOST_CELLS = 400_000
# Half-diagonal of the smallest cells, as a share of the reach.
TOLERANCE = 1e-3


@dataclass(frozen=True)
class LeastClearance:
    """The least clearances over a workspace, in the order of `PAIRS`.

    Attributes:
        bound: What no position undercuts, shape (6,); inf where there is no position.
        clearance: What is attained at `positions`, shape (6,); inf if nowhere.
        positions: Shape (6, 3).
    """

    bound: FloatArray
    clearance: FloatArray
    positions: FloatArray


def least_clearance(
    design: Design,
    rotation: ArrayLike | None = None,
    *,
    margin: float,
    enough: float | None = None,
    tolerance: float | None = None,
) -> LeastClearance:
    """Return the least clearance of each pair over the positions within all limits.

    Args:
        design: The manipulator.
        rotation: Platform to base, shape (3, 3); that of the home pose if None.
        margin: Only positions whose margins are all at least this large count.
        enough: A clearance above which it is not told apart how large it is.
        tolerance: Half-diagonal of the smallest cells; 1e-3 of the reach if None.

    Raises:
        InputError: not a rotation.
    """
    r = home_rotation(design) if rotation is None else checked_rotation(rotation)
    limits = constraints(design, r)
    scale = np.array(
        [float(np.linalg.norm(c.normal)) if isinstance(c, HalfSpace) else 1.0 for c in limits]
    )
    finest = TOLERANCE * design.reach if tolerance is None else tolerance
    count = len(PAIRS)
    bound, attained = np.full(count, np.inf), np.full(count, np.inf)
    places = np.zeros((count, 3))
    region = region_of(limits)
    if region.is_empty:
        return LeastClearance(bound, attained, places)
    lows, highs = bounds(region)
    if not (lows < highs).all():
        return LeastClearance(bound, attained, places)
    side = float((highs - lows).max()) / FIRST_CELLS
    many = np.maximum(1, np.ceil((highs - lows) / side)).astype(int)
    half = 0.5 * (highs - lows) / many
    grid = np.indices(tuple(many.tolist())).reshape(3, -1).T
    centres = lows + half * (2.0 * grid + 1.0)
    looked = 0
    while len(centres):
        looked += len(centres)
        radius = float(np.linalg.norm(half))
        slack = np.column_stack([limit.slack(centres) for limit in limits]) / scale
        near = np.abs(margins(centres, r)) - margin
        inside = np.minimum(slack.min(axis=1), near.min(axis=1))
        centres, inside = centres[inside > -radius], inside[inside > -radius]
        if not len(centres):
            break
        found = leg_clearances(design, centres, r).clearance
        within = found[inside >= 0.0]
        if len(within):
            at = within.argmin(axis=0)
            better = within[at, range(count)] < attained
            attained = np.where(better, within[at, range(count)], attained)
            places[better] = centres[inside >= 0.0][at[better]]
        # What a cell may still hide matters if it is below all that is known or wanted.
        goal = attained if enough is None else np.minimum(attained, enough)
        hidden = found - radius
        open_cells = (hidden < goal - finest).any(axis=1)
        last = radius <= finest or looked + 8 * int(open_cells.sum()) > MOST_CELLS
        closed = hidden if last else hidden[~open_cells]
        if len(closed):
            bound = np.minimum(bound, closed.min(axis=0))
        if last:
            break
        half = 0.5 * half
        corners = np.array([[(-1, 1)[c >> a & 1] for a in range(3)] for c in range(8)])
        centres = (centres[open_cells][:, None, :] + half * corners).reshape(-1, 3)
    return LeastClearance(np.minimum(bound, attained), attained, places)
