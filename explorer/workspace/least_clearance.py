"""How close each pair of legs comes anywhere in a workspace, by branch and bound.

At a fixed orientation a base or platform end moves as the position does, or less, so the
distance of two legs changes by no more than the position. A cell of positions has thus a
bound, its middle's distance less half its diagonal, and is cut in eight until the least
distance found is certain to the tolerance.
"""

from __future__ import annotations

import itertools
import math
from typing import NamedTuple

import numpy as np
from numpy.typing import ArrayLike

from explorer.legs.clearance import (
    PAIRS,
    distance_gradients,
    joined_pairs,
    leg_clearances,
    radii_of_pairs,
)
from explorer.mechanism.design import Design
from explorer.mechanism.pose import checked_rotation
from explorer.numerics.arrays import FloatArray
from explorer.numerics.descent import descend
from explorer.workspace.limits.constraints import Cone, Constraint, HalfSpace, Never, constraints
from explorer.workspace.limits.region import region_of
from explorer.workspace.slices.volume import bounds, home_rotation

# Of the reach.
DEFAULT_TOLERANCE = 1e-4
# Cells an axis at first, and the most that wait for a pair; beyond, its bound is theirs.
FIRST_CELLS = 8
MOST_CELLS = 10_000

# Axes so near, a share of the reach, cross; a limit broken by less is kept.
CROSSING = 1e-9

CORNERS = np.array(list(itertools.product((-0.5, 0.5), repeat=3)))


class LeastClearances(NamedTuple):
    """The least clearance of each pair over a workspace, in the order of `PAIRS`.

    A pair that shares a joint has the clearance inf, and so has every pair if no position
    within the limits is found.

    Attributes:
        clearance: Attained at `position`, shape (6,); below zero in collision.
        bound: Not undercut anywhere in the workspace, shape (6,).
        position: Shape (6, 3); NaN where the clearance is infinite.
    """

    clearance: FloatArray
    bound: FloatArray
    position: FloatArray


def least_clearances(
    design: Design,
    rotation: ArrayLike | None = None,
    tolerance: float | None = None,
    *,
    only_least: bool = False,
) -> LeastClearances:
    """Return the least clearances over the constant-orientation workspace.

    Args:
        design: The manipulator; the radii are those of its limits.
        rotation: Platform to base, shape (3, 3); that of the home pose if None.
        tolerance: To which they are to be certain, in design units; a 10,000th of the
            reach if None. Where too many positions come as close, the bound is lower.
        only_least: Whether only the least of all six is wanted, which takes far less time;
            the others are then attained, and their bounds hold, but may lie far apart.

    Raises:
        InputError: not a rotation.
    """
    r = home_rotation(design) if rotation is None else checked_rotation(rotation)
    finest = tolerance or DEFAULT_TOLERANCE * design.reach
    limits = constraints(design, r)
    radii, joined = radii_of_pairs(design), joined_pairs(design)
    best = np.full(len(PAIRS), math.inf)
    places = np.full((len(PAIRS), 3), math.nan)
    settled = np.full(len(PAIRS), math.inf)
    lows, highs = bounds(region_of(limits))
    if any(isinstance(each, Never) for each in limits) or not (lows < highs).all():
        return LeastClearances(best, settled, places)
    # Legs 2 and 3 stand upright on the guide, in planes that keep their distance.
    floor = np.zeros(len(PAIRS))
    floor[PAIRS.index((2, 3))] = abs((design.b3 - design.b2) * float(r[0, 0]))
    size = (highs - lows) / FIRST_CELLS
    middles = lows + size * (
        np.stack(np.meshgrid(*[np.arange(FIRST_CELLS)] * 3, indexing="ij"), axis=-1) + 0.5
    ).reshape(-1, 3)
    # The pairs whose bounds still rise.
    asked = ~joined
    while len(middles):
        half = 0.5 * float(np.linalg.norm(size))
        slack = np.stack([_reach_of(limit, middles) for limit in limits], axis=-1)
        near = np.asarray((slack >= -half).all(axis=-1))
        middles, slack = middles[near], slack[near]
        distance = leg_clearances(design, middles, r).distance
        inside = np.flatnonzero((slack >= 0.0).all(axis=-1))
        if len(inside):
            least = inside[distance[inside].argmin(axis=0)]
            found = distance[least, np.arange(len(PAIRS))]
            better = ~joined & (found < best)
            best[better], places[better] = found[better], middles[least[better]]
            if only_least:
                # What is least already spares all cells that cannot undercut it.
                pair = int((best - radii).argmin())
                if better[pair] and best[pair] > floor[pair]:
                    best[pair], places[pair] = _polished(
                        design, r, limits, pair, best[pair], places[pair]
                    )
                    if best[pair] <= CROSSING * design.reach:
                        best[pair] = 0.0
        low = np.maximum(distance - half, floor)
        top = (best - radii).min() + radii if only_least else best
        goes_on = asked & (low < top - finest)
        asked = asked & (goes_on.sum(axis=0) <= MOST_CELLS)
        goes_on = goes_on & asked
        settled = np.minimum(settled, np.where(goes_on, math.inf, low).min(axis=0, initial=np.inf))
        size = 0.5 * size
        again = goes_on.any(axis=-1)
        middles = (middles[again][:, None, :] + size * CORNERS).reshape(-1, 3)
    if not only_least:
        for pair in np.flatnonzero(np.isfinite(best) & (best > floor)).tolist():
            best[pair], places[pair] = _polished(design, r, limits, pair, best[pair], places[pair])
    best[best <= CROSSING * design.reach] = 0.0
    places[np.abs(places) <= CROSSING * design.reach] = 0.0
    bound = np.where(joined, math.inf, np.minimum(settled, best))
    return LeastClearances(best - radii, bound - radii, places)


def _reach_of(limit: Constraint, p: FloatArray) -> FloatArray:
    """Return how far positions (..., 3) are within a limit, or at the least beyond it."""
    if isinstance(limit, HalfSpace):
        return limit.slack(p) / float(np.linalg.norm(limit.normal))
    slack = limit.slack(p)
    # The angle of a cone tells no distance, only on which side a position is.
    return np.where(slack >= 0.0, math.inf, -0.0) if isinstance(limit, Cone) else slack


def _polished(
    design: Design,
    rotation: FloatArray,
    limits: tuple[Constraint, ...],
    pair: int,
    least: float,
    place: FloatArray,
) -> tuple[float, FloatArray]:
    """Return the local least near a place, if there is less within the limits."""
    reach = design.reach

    def distance(p: FloatArray) -> tuple[float, FloatArray]:
        found = leg_clearances(design, p * reach, rotation)
        gradient = distance_gradients(design, p * reach, rotation, found)
        return float(found.distance[pair]) / reach, gradient[pair]

    def kept(p: FloatArray) -> FloatArray:
        return np.array([float(limit.slack(p * reach)) for limit in limits]) / reach

    at = descend(distance, kept, place / reach)
    if at is not None and (kept(at) >= -CROSSING).all():
        value = distance(at)[0] * reach
        if value < least:
            return value, at * reach
    return least, place
