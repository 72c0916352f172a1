"""How the reachable workspace shrinks as all legs grow thicker.

Every position has a radius up to which it can be reached from the start: that of the way
there whose narrowest place is widest. One spanning tree of a grid tells all of them, and so
the whole curve at once.
"""

from __future__ import annotations

from dataclasses import dataclass

import msgspec
import numpy as np
from numpy.typing import ArrayLike

from explorer.legs.clearance import PAIRS, leg_clearances
from explorer.legs.moves import move_clearances
from explorer.mechanism.design import Design
from explorer.mechanism.home import home_pose
from explorer.mechanism.pose import checked_rotation
from explorer.numerics.arrays import FloatArray, IntArray
from explorer.numerics.stages import Stages, Watch, unwatched
from explorer.workspace.accessible.nodes import Survey, middles_over, survey
from explorer.workspace.accessible.start import check_start
from explorer.workspace.least_clearance import LeastClearances, least_clearances
from explorer.workspace.slices.volume import home_rotation, workspace_volume
from explorer.workspace.solids.solids import workspace_solid

DEFAULT_CELLS = 40
POINTS = 60
# Of the narrowest place of a step, as a share of the reach.
TOLERANCE = 1e-4
# Stages of the computation.
STAGES = 4
# Radii that differ by less than this share are one.
SAME = 1e-9


@dataclass(frozen=True)
class RadiusCurve:
    """Reachable volume against one radius of all four legs, in design units.

    Attributes:
        radii: From 0 to the radius beyond which nothing is left, which comes twice, shape
            (n,).
        volumes: Reachable with them, shape (n,), in cubed design units; counted in cells
            of a grid as shares of the exact volume within the limits.
        least: How close legs without radii come within the limits.
    """

    radii: FloatArray
    volumes: FloatArray
    least: LeastClearances

    @property
    def harmless(self) -> float:
        """The largest radius with which no two legs collide anywhere within the limits.

        0 if some touch without a radius, or if there is nothing within the limits.
        """
        return 0.0 if self.closest_legs is None else 0.5 * float(self.least.clearance.min())

    @property
    def harmless_bound(self) -> float:
        """Certified not to exceed `harmless`."""
        return 0.0 if self.closest_legs is None else 0.5 * max(0.0, float(self.least.bound.min()))

    @property
    def closest_legs(self) -> tuple[int, int] | None:
        """The pair that comes closest, None if there is nothing within the limits."""
        closest = self.least.clearance.argmin()
        return PAIRS[closest] if np.isfinite(self.least.clearance[closest]) else None

    @property
    def closest_position(self) -> FloatArray:
        """Where that pair comes closest, shape (3,); NaN if there is none."""
        return self.least.position[self.least.clearance.argmin()]

    def radius_at(self, share: float) -> float:
        """Return the radius at which this share of the first volume is left."""
        at = np.interp(-share * float(self.volumes[0]), -self.volumes, self.radii)
        return float(at)


def radius_curve(
    design: Design,
    rotation: ArrayLike | None = None,
    *,
    start: ArrayLike | None = None,
    cells: int = DEFAULT_CELLS,
    watch: Watch = unwatched,
) -> RadiusCurve:
    """Return the reachable volume against the radius of all legs; the design's count not.

    Args:
        design: The manipulator.
        rotation: Platform to base, shape (3, 3); that of the home pose if None.
        start: The position that is to be connected, shape (3,); that of the home if None.
        cells: Of the grid, on each axis of the workspace's extent.
        watch: Called before each stage.

    Raises:
        InputError: the start breaks a limit, or legs cross there.
    """
    r = home_rotation(design) if rotation is None else checked_rotation(rotation)
    p = np.array(home_pose(design).position) if start is None else np.array(start, dtype=float)
    thin = with_radius(design, 0.0)
    stages = Stages(watch, STAGES)
    stages.begin("solid of the limits")
    exact = workspace_volume(thin, r, explain=False)
    whole = workspace_solid(thin, r, volume=exact)
    if whole.is_empty:
        return RadiusCurve(np.zeros(1), np.zeros(1), least_clearances(thin, r))
    check_start(thin, r, p)
    stages.begin("least clearances")
    least = least_clearances(thin, r)
    stages.begin("grid of positions")
    lows, highs = whole.vertices.min(axis=0), whole.vertices.max(axis=0)
    found = survey(thin, r, middles_over(lows, highs, cells))
    stages.begin("widest ways")
    widest = 0.5 * _widest(found, p)[found.within]
    radii = np.linspace(0.0, float(widest.max(initial=0.0)), POINTS)
    # A cell is reached with radii up to its own, to rounding.
    left = len(widest) - np.searchsorted(np.sort(widest), (1.0 - SAME) * radii)
    shares = np.append(left / max(1, len(widest)), 0.0)
    return RadiusCurve(np.append(radii, radii[-1]), shares * exact.volume, least)


def with_radius(design: Design, radius: float) -> Design:
    """Return a design whose four legs have one radius."""
    limits = msgspec.structs.replace(design.limits, leg_radii=(radius,) * 4)
    return msgspec.structs.replace(design, limits=limits)


def _widest(found: Survey, start: FloatArray) -> FloatArray:
    """Return the least distance of legs on the best way to each node, −1 if there is none."""
    from scipy.sparse import coo_array
    from scipy.sparse.csgraph import breadth_first_order, minimum_spanning_tree

    allowed = found.within.ravel()
    many = len(allowed)
    distance = found.clearance.reshape(many, -1).min(axis=1)
    steps = allowed[found.first] & allowed[found.second] & found.clear.all(axis=1)
    first, second = found.first[steps], found.second[steps]
    linked = np.flatnonzero(found.linked(start))
    at_start = float(leg_clearances(found.design, start, found.rotation).clearance.min())
    # The start is one node more.
    first = np.append(first, np.full(len(linked), many))
    second = np.append(second, linked)
    distance = np.append(distance, at_start)
    positions = np.vstack([found.grid.positions.reshape(-1, 3), start])
    width = _narrowest(found, positions, distance, first, second)
    # The tree of least weight has the widest ways; a weight of zero would be no step.
    weight = 1.0 + width.max(initial=0.0) - width
    graph = coo_array((weight, (first, second)), shape=(many + 1, many + 1)).tocsr()
    tree = minimum_spanning_tree(graph)
    order, before = breadth_first_order(tree, many, directed=False)
    both = (tree + tree.T).tocsr()
    after = order[1:]
    weights: FloatArray = np.asarray(both[after, before[after]], dtype=np.float64).ravel()
    widths = 1.0 + width.max(initial=0.0) - weights
    best: list[float] = [-1.0] * (many + 1)
    best[many] = at_start
    preceding: list[int] = before[after].tolist()
    for node, one_before, step in zip(after.tolist(), preceding, widths.tolist(), strict=True):
        best[node] = min(best[one_before], step)
    return np.array(best[:many]).reshape(found.within.shape)


def _narrowest(
    found: Survey, positions: FloatArray, distance: FloatArray, first: IntArray, second: IntArray
) -> FloatArray:
    """Return the least distance of legs over each step.

    It is that of one of the ends, but for steps near a crossing, which are looked at.
    """
    width = np.minimum(distance[first], distance[second])
    length = np.linalg.norm(positions[second] - positions[first], axis=1)
    near = np.flatnonzero(width < length)
    design, r = found.design, found.rotation
    a, b = positions[first[near]], positions[second[near]]
    looked = move_clearances(design, a, r, b, r, tolerance=TOLERANCE * design.reach)
    width[near] = np.maximum(0.0, np.minimum(width[near], looked.clearance.min(axis=-1)))
    return width
