"""The volume of the accessible workspace as a function of one radius of all legs.

A position is accessible up to a largest radius: half the bottleneck clearance of the widest path
from the start. A maximum spanning tree of a grid gives these paths to all nodes at once (T. C. Hu,
"The Maximum Capacity Route Problem", Operations Research 9, 1961).
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from explorer.legs.clearance import PAIRS, leg_clearances
from explorer.legs.moves import move_clearances
from explorer.mechanism.design import Design
from explorer.numerics.arrays import FloatArray, IntArray
from explorer.numerics.computed_once import computed_once
from explorer.workspace.accessible.nodes import Survey, check_start, make_cell_grid, survey
from explorer.workspace.least_clearance import LeastClearances, least_clearances
from explorer.workspace.slices.volume import volume_of
from explorer.workspace.solids.solids import whole_solid
from explorer.workspace.workspace import Workspace

DEFAULT_CELLS = 40
POINTS = 60
# Tolerance of the least distance of legs over a step, over the reach.
TOLERANCE = 1e-4
# Relative tolerance of a radius at which a cell is still accessible.
SAME = 1e-9


@dataclass(frozen=True)
class RadiusCurve:
    """The volume of the accessible workspace against one radius of all four legs.

    Attributes:
        radii: Radii in design units, shape (n,), from 0 to the largest at which anything is
            accessible; that one comes twice, with its volume and with 0.
        volumes: Accessible volumes in cubed design units, shape (n,): shares counted in the
            cells of a grid, times the exact volume within the limits.
        least: Least clearances within the limits of legs without radii.
    """

    radii: FloatArray
    volumes: FloatArray
    least: LeastClearances

    @property
    def harmless(self) -> float:
        """The largest radius with which no two legs collide within the limits; 0 without one."""
        return 0.0 if self.closest_legs is None else 0.5 * float(self.least.clearance.min())

    @property
    def harmless_bound(self) -> float:
        """A certified lower bound of `harmless`."""
        return 0.0 if self.closest_legs is None else 0.5 * max(0.0, float(self.least.bound.min()))

    @property
    def closest_legs(self) -> tuple[int, int] | None:
        """The pair of legs that comes closest, None if the workspace is empty."""
        closest = self.least.clearance.argmin()
        return PAIRS[closest] if np.isfinite(self.least.clearance[closest]) else None

    @property
    def closest_position(self) -> FloatArray:
        """The position at which that pair comes closest, shape (3,); NaN if there is none."""
        return self.least.position[self.least.clearance.argmin()]


@computed_once
def radius_curve(workspace: Workspace, *, cells: int = DEFAULT_CELLS) -> RadiusCurve:
    """Compute the accessible volume against one radius of all legs, whatever the design's own are.

    The grid has a number of cells on each axis of the workspace's extent.

    Raises:
        InputError: Home breaks a limit, or legs cross there.
    """
    design = workspace.design
    p = np.array(design.home_pose.position)
    thin = Workspace(with_radius(design, 0.0), workspace.rotation)
    whole = whole_solid(thin)
    if whole.is_empty:
        return RadiusCurve(np.zeros(1), np.zeros(1), least_clearances(thin))
    check_start(thin, p)
    least = least_clearances(thin)
    surveyed = survey(thin, make_cell_grid(*whole.ends, cells))
    widest = 0.5 * _bottleneck_clearances(surveyed, p)[surveyed.within]
    radii = np.linspace(0.0, float(widest.max(initial=0.0)), POINTS)
    # A cell is accessible with radii up to its own, to rounding.
    accessible_counts = len(widest) - np.searchsorted(np.sort(widest), (1.0 - SAME) * radii)
    shares = np.append(accessible_counts / max(1, len(widest)), 0.0)
    return RadiusCurve(np.append(radii, radii[-1]), shares * volume_of(thin).volume, least)


def with_radius(design: Design, radius: float) -> Design:
    """Return a design whose four legs have one radius, in design units."""
    return design.with_limits(leg_radii=(radius,) * 4)


def _bottleneck_clearances(surveyed: Survey, start: FloatArray) -> FloatArray:
    """Return the least distance of legs on the widest path to each node, −1 without a path."""
    from scipy.sparse import coo_array
    from scipy.sparse.csgraph import breadth_first_order, minimum_spanning_tree

    allowed = surveyed.within.ravel()
    node_count = len(allowed)
    distance = surveyed.clearance.reshape(node_count, -1).min(axis=1)
    steps = allowed[surveyed.first] & allowed[surveyed.second] & surveyed.clear.all(axis=1)
    first, second = surveyed.first[steps], surveyed.second[steps]
    near_start = np.flatnonzero(surveyed.nodes_near(start))
    at_start = float(leg_clearances(surveyed.workspace.at(start)).clearance.min())
    # The start is one more node.
    first = np.append(first, np.full(len(near_start), node_count))
    second = np.append(second, near_start)
    distance = np.append(distance, at_start)
    positions = np.vstack([surveyed.grid.positions.reshape(-1, 3), start])
    width = _step_clearances(surveyed, positions, distance, first, second)
    # The tree of least weight has the widest paths; a weight of zero would be no edge.
    weight = 1.0 + width.max(initial=0.0) - width
    graph = coo_array((weight, (first, second)), shape=(node_count + 1, node_count + 1)).tocsr()
    tree = minimum_spanning_tree(graph)
    order, predecessors = breadth_first_order(tree, node_count, directed=False)
    links = (tree + tree.T).tocsr()
    others = order[1:]
    weights: FloatArray = np.asarray(links[others, predecessors[others]], dtype=np.float64).ravel()
    widths = 1.0 + width.max(initial=0.0) - weights
    best: list[float] = [-1.0] * (node_count + 1)
    best[node_count] = at_start
    previous: list[int] = predecessors[others].tolist()
    for node, predecessor, step in zip(others.tolist(), previous, widths.tolist(), strict=True):
        best[node] = min(best[predecessor], step)
    return np.array(best[:node_count]).reshape(surveyed.within.shape)


def _step_clearances(
    surveyed: Survey, positions: FloatArray, distance: FloatArray, first: IntArray, second: IntArray
) -> FloatArray:
    """Return the least distance of legs over each step.

    Far from collisions it is bounded by the distance at an end; near them it is computed.
    """
    width = np.minimum(distance[first], distance[second])
    length = np.linalg.norm(positions[second] - positions[first], axis=1)
    near = np.flatnonzero(width < length)
    design, r = surveyed.workspace.design, surveyed.workspace.rotation
    a, b = positions[first[near]], positions[second[near]]
    exact = move_clearances(design, a, r, b, r, tolerance=TOLERANCE * design.reach)
    width[near] = np.maximum(0.0, np.minimum(width[near], exact.clearance.min(axis=-1)))
    return width
