"""The least clearance of each pair of legs in a workspace, by branch and bound.

At a fixed orientation the ends of legs move no farther than the position does, so the distance
of two legs is Lipschitz in position with constant 1. In a cell of positions it is therefore
bounded from below by its value at the centre less half the cell's diagonal. Cells are divided
into eight until that bound is within the tolerance of the least distance attained.
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

# Tolerance of a least clearance, over the reach.
DEFAULT_TOLERANCE = 1e-4
# Number of cells on each axis at first, and the largest number of cells that a pair may have
# left to divide; beyond that, the bound of the pair is the least bound of those cells.
FIRST_CELLS = 8
MOST_CELLS = 10_000

# Distance, over the reach, at which axes count as crossing; also the tolerance of a limit.
CROSSING = 1e-9

CORNERS = np.array(list(itertools.product((-0.5, 0.5), repeat=3)))


class LeastClearances(NamedTuple):
    """The least clearance of each pair of legs in a workspace, in the order of `PAIRS`.

    The clearance is inf for a pair that shares a joint, and for every pair if no position
    within the limits is found, as in a workspace without volume.

    Attributes:
        clearance: Least clearance attained, in design units, shape (6,); negative in
            collision.
        bound: Certified lower bound of the clearance in the workspace, in design units,
            shape (6,).
        position: Positions of b4 in the base frame at which the clearances are attained, in
            design units, shape (6, 3); NaN where the clearance is infinite.
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
    """Return the least clearances in the constant-orientation workspace.

    Args:
        design: The manipulator; the radii of the legs are those of its limits.
        rotation: Rotation from platform to base, shape (3, 3); that of the home pose if None.
        tolerance: Largest difference between a clearance and its bound, in design units; a
            10,000th of the reach if None. It is exceeded where too many cells are left.
        only_least: Whether to resolve the least of the six alone, which takes far less time;
            the other clearances and bounds still hold, but may differ by more.

    Raises:
        InputError: not a rotation.
    """
    r = home_rotation(design) if rotation is None else checked_rotation(rotation)
    finest = tolerance or DEFAULT_TOLERANCE * design.reach
    limits = constraints(design, r)
    radii, joined = radii_of_pairs(design), joined_pairs(design)
    best = np.full(len(PAIRS), math.inf)
    places = np.full((len(PAIRS), 3), math.nan)
    # The least bound of the cells of each pair that are not divided any further.
    bounded = np.full(len(PAIRS), math.inf)
    lows, highs = bounds(region_of(limits))
    if any(isinstance(limit, Never) for limit in limits) or not (lows < highs).all():
        return LeastClearances(best, bounded, places)
    # Legs 2 and 3 are perpendicular to the guide: the planes of both keep their distance.
    floor = np.zeros(len(PAIRS))
    floor[PAIRS.index((2, 3))] = abs((design.b3 - design.b2) * float(r[0, 0]))
    size = (highs - lows) / FIRST_CELLS
    middles = lows + size * (
        np.stack(np.meshgrid(*[np.arange(FIRST_CELLS)] * 3, indexing="ij"), axis=-1) + 0.5
    ).reshape(-1, 3)
    # Pairs whose bounds can still be raised.
    is_open = ~joined
    while len(middles):
        half = 0.5 * float(np.linalg.norm(size))
        slack = np.stack([_distance_within(limit, middles) for limit in limits], axis=-1)
        near = np.asarray((slack >= -half).all(axis=-1))
        middles, slack = middles[near], slack[near]
        distance = leg_clearances(design, middles, r).distance
        inside = np.flatnonzero((slack >= 0.0).all(axis=-1))
        if len(inside):
            least = inside[distance[inside].argmin(axis=0)]
            attained = distance[least, np.arange(len(PAIRS))]
            better = ~joined & (attained < best)
            best[better], places[better] = attained[better], middles[least[better]]
            if only_least:
                # The lower the least clearance so far, the more cells are ruled out by it.
                pair = int((best - radii).argmin())
                if better[pair] and best[pair] > floor[pair]:
                    best[pair], places[pair] = _descend(
                        design, r, limits, pair, best[pair], places[pair]
                    )
                    if best[pair] <= CROSSING * design.reach:
                        best[pair] = 0.0
        low = np.maximum(distance - half, floor)
        top = (best - radii).min() + radii if only_least else best
        divides = is_open & (low < top - finest)
        is_open = is_open & (divides.sum(axis=0) <= MOST_CELLS)
        divides = divides & is_open
        bounded = np.minimum(bounded, np.where(divides, math.inf, low).min(axis=0, initial=np.inf))
        size = 0.5 * size
        divided = divides.any(axis=-1)
        middles = (middles[divided][:, None, :] + size * CORNERS).reshape(-1, 3)
    if not only_least:
        for pair in np.flatnonzero(np.isfinite(best) & (best > floor)).tolist():
            best[pair], places[pair] = _descend(design, r, limits, pair, best[pair], places[pair])
    best[best <= CROSSING * design.reach] = 0.0
    places[np.abs(places) <= CROSSING * design.reach] = 0.0
    bound = np.where(joined, math.inf, np.minimum(bounded, best))
    return LeastClearances(best - radii, bound - radii, places)


def _distance_within(limit: Constraint, p: FloatArray) -> FloatArray:
    """Return signed distances of positions (..., 3) within a limit, or upper bounds of them."""
    if isinstance(limit, HalfSpace):
        return limit.slack(p) / float(np.linalg.norm(limit.normal))
    slack = limit.slack(p)
    # The slack of a cone is an angle, not a distance; only its sign is used.
    return np.where(slack >= 0.0, math.inf, -0.0) if isinstance(limit, Cone) else slack


def _descend(
    design: Design,
    rotation: FloatArray,
    limits: tuple[Constraint, ...],
    pair: int,
    least: float,
    place: FloatArray,
) -> tuple[float, FloatArray]:
    """Return the least distance near a place within the limits, and where it is attained."""
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
