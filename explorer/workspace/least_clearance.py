"""The least clearance of each pair of legs in a workspace, by branch and bound.

At a fixed orientation the ends of legs move no farther than the position does, so the distance
of two legs is Lipschitz in position with constant 1. In a cell of positions it is therefore
bounded from below by its value at the centre less half the cell's diagonal. Where that does not
suffice, `explorer.workspace.clearance_bounds` has a bound of second order. Cells are divided into
eight until the bound is within the tolerance of the least distance attained.

Measures at the nodes of a grid, the centres of the cells of a box about the workspace, take less
time: its extent, margins and clearances. A least value at the nodes is an upper bound.
"""

from __future__ import annotations

import math
from dataclasses import dataclass
from typing import NamedTuple

import numpy as np

from explorer.legs.clearance import (
    PAIRS,
    distance_gradients,
    joined_pairs,
    leg_axes,
    leg_clearances,
    radii_of_pairs,
)
from explorer.mechanism.margins import margins, planes_of_singularity
from explorer.numerics.arrays import BoolArray, FloatArray
from explorer.numerics.checks import whole
from explorer.numerics.computed_once import computed_once
from explorer.numerics.search import descend
from explorer.workspace.clearance_bounds import (
    LEGS_OF_PAIRS,
    SlackBounds,
    bound_slacks,
    raise_bounds,
)
from explorer.workspace.limits.region import Region, mark_nodes
from explorer.workspace.workspace import Workspace

# Tolerance of a least clearance, over the reach.
DEFAULT_TOLERANCE = 1e-4
# Number of cells on each axis at first, and the most that a pair may have left to divide.
FIRST_CELLS = 8
MOST_CELLS = 10_000
# Largest number of cells whose clearances are computed at once.
BATCH = 10_000

# Distance, over the reach, at which axes count as crossing; also the tolerance of a limit.
CROSSING = 1e-9

CORNERS = np.indices((2, 2, 2)).reshape(3, -1).T - 0.5


class LeastClearances(NamedTuple):
    """The least clearance of each pair of legs in a workspace, in the order of `PAIRS`.

    The clearance is inf for a pair that shares a joint, and for every pair if no position
    within the limits is found, as in a workspace without volume.

    Attributes:
        clearance: Least clearance attained, in design units, shape (6,); negative in collision.
        bound: Certified lower bound of the clearance in the workspace, shape (6,).
        position: Positions of b4 at which they are attained, (6, 3); NaN if infinite.
    """

    clearance: FloatArray
    bound: FloatArray
    position: FloatArray


@computed_once
def least_clearances(
    workspace: Workspace,
    tolerance: float | None = None,
    *,
    only_least: bool = False,
    below: float = math.inf,
    margin: float = 0.0,
) -> LeastClearances:
    """Return the least clearances in the constant-orientation workspace.

    Args:
        workspace: The workspace; the radii of the legs are those of its design's limits.
        tolerance: Largest difference between a clearance and its bound, in design units; a
            10,000th of the reach if None. It is exceeded where too many cells are left.
        only_least: Whether to resolve the least of the six alone, which takes far less time;
            the other clearances and bounds still hold, but may differ by more.
        below: Clearance, in design units, from which on none is resolved. A pair that is nowhere
            closer has the clearance inf, and that is proven without a tolerance; other pairs have
            positions strictly within limits.
        margin: Least |δ| of the positions that count, in design units.
    """
    design, r = workspace.design, workspace.rotation
    resolution = tolerance or DEFAULT_TOLERANCE * design.reach
    domain = _Domain(workspace, margin)
    radii, joined = radii_of_pairs(design), joined_pairs(design)
    best = np.where(joined, math.inf, below + radii)
    positions = np.full((len(PAIRS), 3), math.nan)
    # The least bound of the cells of each pair that are not divided any further.
    settled = np.full(len(PAIRS), math.inf)
    box = workspace.region.box
    if box is None:
        return LeastClearances(settled, settled, positions)
    # Legs 2 and 3 lie in planes across the guide, whose distance is the same at every position.
    plane_distance = np.zeros(len(PAIRS))
    plane_distance[PAIRS.index((2, 3))] = abs((design.b3 - design.b2) * float(r[0, 0]))
    lows, size = box[0], (box[1] - box[0]) / FIRST_CELLS
    middles = lows + size * (np.indices((FIRST_CELLS,) * 3).reshape(3, -1).T + 0.5)
    # Pairs whose bounds can still be raised.
    is_open = ~joined

    def sought() -> FloatArray:
        """Return the distance of each pair below which a cell is divided, shape (6,)."""
        if only_least:
            return np.asarray((best - radii).min() + radii - resolution)
        # It is proven of a pair that is nowhere too close without a tolerance.
        is_too_close = ~np.isnan(positions[:, 0]) | math.isinf(below)
        return np.asarray(best - np.where(is_too_close, resolution, 0.0))

    def settle(low: FloatArray, divides: BoolArray) -> None:
        """Keep the least bounds (n, 6) of cells that are not divided for a pair."""
        least = np.where(divides, math.inf, low).min(axis=0, initial=math.inf)
        settled[:] = np.minimum(settled, least)

    while len(middles):
        half = 0.5 * size
        kept = [(np.zeros((0, 3)), np.zeros((0, len(PAIRS))))]
        for part in np.array_split(middles, 1 + len(middles) // BATCH):
            slack = domain.bound_slacks(part, half)
            is_near = slack.largest(half).min(axis=-1, initial=math.inf) >= 0.0
            at, slack = workspace.at(part[is_near]), slack.of(is_near)
            distance, inside = leg_clearances(at).distance, domain.contains(at.position)
            better = np.zeros(len(PAIRS), dtype=np.bool_)
            if inside.any():
                least = np.where(inside[:, None], distance, math.inf).argmin(axis=0)
                attained = distance[least, np.arange(len(PAIRS))]
                better = attained < best
                best[better], positions[better] = attained[better], at.position[least[better]]
            # The lower a least distance so far, the more cells are ruled out by it.
            falls = better & (best > plane_distance) & math.isinf(below)
            if only_least:
                falls &= np.arange(len(PAIRS)) == (best - radii).argmin()
            for pair in np.flatnonzero(falls).tolist():
                best[pair], positions[pair] = domain.descend(pair, best[pair], positions[pair])
            best[best <= CROSSING * design.reach] = 0.0
            low = np.maximum(distance - float(np.linalg.norm(half)), plane_distance)
            needed = is_open & (low < sought())
            raise_bounds(len(low), needed, LEGS_OF_PAIRS, leg_axes(at), half, *slack, low)
            divides = is_open & (low < sought())
            settle(low, divides)
            divided = divides.any(axis=-1)
            kept.append((at.position[divided], low[divided]))
        middles, low = (np.concatenate(each) for each in zip(*kept, strict=True))
        divides = is_open & (low < sought())
        is_open = is_open & (divides.sum(axis=0) <= MOST_CELLS)
        divides = divides & is_open
        settle(low, divides)
        size = half
        middles = middles[divides.any(axis=-1)]
        middles = (middles[:, None, :] + size * CORNERS).reshape(-1, 3)
    is_attained = ~np.isnan(positions[:, 0])
    best[~is_attained] = math.inf
    positions[np.abs(positions) <= CROSSING * design.reach] = 0.0
    bound = np.where(joined, math.inf, np.minimum(settled, best))
    return LeastClearances(best - radii, bound - radii, positions)


@dataclass(frozen=True)
class _Domain:
    """The positions that count: those within the limits and off the singular planes."""

    workspace: Workspace
    margin: float

    def contains(self, p: FloatArray) -> BoolArray:
        """Return whether positions (..., 3) are in the domain."""
        is_within = (self._spare_margins(p) >= 0.0).all(axis=-1)
        return np.asarray(is_within & self.workspace.contains(p))

    def bound_slacks(self, middles: FloatArray, half: FloatArray) -> SlackBounds:
        """Return bounds of the slacks in cells with middles (n, 3) and half edges (3,)."""
        bounds = bound_slacks(self.workspace.limits, middles, half)
        if not self.margin:
            return bounds
        planes = planes_of_singularity(self.workspace.rotation)
        sizes, change = middles @ planes.T, np.abs(planes) @ half
        # On one side of its plane |δ| is linear.
        is_beside = np.abs(sizes) >= change
        values = np.abs(sizes) + np.where(is_beside, 0.0, change) - self.margin
        slopes = np.where(is_beside, np.sign(sizes), 0.0)[..., None] * planes
        return SlackBounds(np.hstack([bounds.values, values]), np.hstack([bounds.slopes, slopes]))

    def descend(self, pair: int, least: float, position: FloatArray) -> tuple[float, FloatArray]:
        """Return the least distance near a position in the domain, and where it is attained."""
        reach = self.workspace.design.reach

        def distance(p: FloatArray) -> tuple[float, FloatArray]:
            at = self.workspace.at(p * reach)
            return float(leg_clearances(at).distance[pair]) / reach, distance_gradients(at)[pair]

        def slacks(p: FloatArray) -> FloatArray:
            of_limits = self.workspace.slacks(p * reach)
            return np.concatenate([of_limits, self._spare_margins(p * reach)]) / reach

        optimum = descend(distance, slacks, position / reach)
        if optimum is None or not (slacks(optimum) >= -CROSSING).all():
            return least, position
        value = distance(optimum)[0] * reach
        return (value, optimum * reach) if value < least else (least, position)

    def _spare_margins(self, p: FloatArray) -> FloatArray:
        """Return |δ| less the margin at positions (..., 3), shape (..., 3); (..., 0) if it is 0."""
        if not self.margin:
            return np.zeros((*p.shape[:-1], 0))
        return np.abs(margins(p, self.workspace.rotation)) - self.margin


# Number of nodes on each axis: default, least and largest.
DEFAULT_NODES = 20
FEWEST_NODES, MOST_NODES = 2, 200


@dataclass(frozen=True)
class NodeMeasures:
    """Measures of a workspace at the nodes of a grid, in design units.

    Without any nodes, lengths are NaN and clearances infinite.

    Attributes:
        positions: Nodes within the limits, shape (n, 3).
        extent: Distance between the lowest and the highest of them on each axis, shape (3,).
        margins: Least |δ1|, |δ2|, |δ3| at the nodes, shape (3,).
        mean_margin: Mean over the nodes of the smallest of |δ1|, |δ2|, |δ3|.
        clearances: Least clearances at the nodes with every |δ| at least `clearance_margin`,
            shape (6,), in the order of `PAIRS`; inf for a pair that shares a joint.
        clear_share: Share of the nodes at which no legs collide; NaN without any nodes.
    """

    positions: FloatArray
    extent: FloatArray
    margins: FloatArray
    mean_margin: float
    clearances: FloatArray
    clear_share: float


@computed_once
def node_measures(
    workspace: Workspace, *, nodes: int = DEFAULT_NODES, clearance_margin: float = 0.0
) -> NodeMeasures:
    """Measure a workspace at the nodes of a grid, so many on each axis of a box about it.

    Clearances count at nodes with every |δ| at least `clearance_margin`, in design units: nearer to
    a singularity legs may have to meet.

    Raises:
        InputError: Too few or too many nodes.
    """
    positions = nodes_of(workspace.region, nodes)
    if not len(positions):
        none = np.full(3, np.nan)
        clearances = np.full(len(PAIRS), math.inf)
        return NodeMeasures(positions, none, none, math.nan, clearances, math.nan)
    at = workspace.at(positions)
    sizes, clearance = np.abs(at.margins), leg_clearances(at).clearance
    smallest = sizes.min(axis=1)
    off_planes = clearance[smallest >= clearance_margin]
    return NodeMeasures(
        positions=at.position,
        extent=np.ptp(positions, axis=0),
        margins=sizes.min(axis=0),
        mean_margin=float(smallest.mean()),
        clearances=off_planes.min(axis=0, initial=math.inf),
        clear_share=float((clearance > 0.0).all(axis=1).mean()),
    )


def nodes_of(
    region: Region, nodes: int = DEFAULT_NODES, box: tuple[FloatArray, FloatArray] | None = None
) -> FloatArray:
    """Return the nodes in a region of a grid of so many on each axis of a box, shape (n, 3).

    The box is (lows, highs), that of the region if None.

    Raises:
        InputError: Too few or too many nodes.
    """
    whole("the number of nodes on an axis", nodes, FEWEST_NODES, MOST_NODES)
    box = box or region.box
    if box is None:
        return np.zeros((0, 3))
    lows, highs = box
    step, within = (highs - lows) / nodes, np.zeros((nodes,) * 3, dtype=np.bool_)
    mark_nodes(nodes**3, *region.rows, lows + 0.5 * step, step, 0.0, within)
    return lows + (np.argwhere(within) + 0.5) * step
