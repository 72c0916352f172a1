"""The reachable workspace: what the home pose leads to without a collision of legs.

A component of a grid of nodes and certified steps tells on which side of the collisions
the home lies; the solid is that of the limits, exact where they bound it, carved along the
collision surface. See section 7 of design.md.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from functools import cached_property, partial
from typing import Any

import numpy as np
from numpy.typing import ArrayLike

from explorer.errors import InputError
from explorer.legs.clearance import PAIRS, radii_of_pairs
from explorer.mechanism.design import Design
from explorer.mechanism.home import home_pose
from explorer.mechanism.pose import checked_rotation
from explorer.numerics.arrays import BoolArray, FloatArray, IntArray
from explorer.numerics.stages import Stages, Watch, unwatched
from explorer.workspace.accessible.collision_surface import nearest_pair, settle
from explorer.workspace.accessible.nodes import (
    ALL_PAIRS,
    SLACK,
    Grid,
    Survey,
    grid_over,
    survey,
)
from explorer.workspace.accessible.start import check_start, troubles
from explorer.workspace.least_clearance import LeastClearances, least_clearances
from explorer.workspace.limits.constraints import Constraint, constraints
from explorer.workspace.limits.region import region_of
from explorer.workspace.slices.volume import (
    check_node_count,
    home_rotation,
    node_range,
    node_step_of,
    workspace_volume,
)
from explorer.workspace.solids.solid import Solid
from explorer.workspace.solids.solids import Surface, carved_solid, workspace_solid

# Nodes on each axis of the workspace's extent, and of the grid beyond it on either side.
DEFAULT_NODES = 40
FEWEST_NODES, MOST_NODES = 8, 160
BEYOND = 2
# Where legs without radii merely touch, the surface is put this share of the reach beyond,
# since it may coincide with a limit.
TOUCHING = 1e-4
# Nodes of the paper's grid, whose steps are all looked at.
MOST_PAPER_NODES = 2_000_000
# Stages of the computation besides those of single pairs.
FIXED_STAGES = 5
CUBE = np.ones((3, 3, 3), dtype=np.bool_)
PAIR_NAMES = tuple(f"legs {first}–{second}" for first, second in PAIRS)
"""What the faces come from that lie where a pair begins to collide."""


@dataclass(frozen=True)
class PairCost:
    """What one pair of legs means for a workspace.

    Attributes:
        legs: Such as (1, 2).
        clearance: The least within the limits, in design units; below zero in collision,
            inf for a pair that shares a joint.
        bound: Certified not to be undercut there.
        blocked_volume: What this pair alone takes from the workspace, in cubed design
            units: where it collides, and what it cuts off from the home pose.
    """

    legs: tuple[int, int]
    clearance: float
    bound: float
    blocked_volume: float


@dataclass(frozen=True)
class ReachableWorkspace:
    """A constant-orientation workspace within the limits, and what of it can be reached.

    Attributes:
        volume: Within the limits, exact, in cubed design units.
        reachable_volume: Of what can be reached.
        solid: What can be reached.
        step: Of the paper's grid of nodes, see `explorer.workspace.slices.volume.NodeCount`.
        node_count: How many of its nodes lie within the limits; None if not counted.
        reachable_node_count: How many of these can be reached by steps of the grid; None
            if not counted.
        pairs: In the order of `PAIRS`.
    """

    volume: float
    reachable_volume: float
    solid: Solid
    step: float
    node_count: int | None
    reachable_node_count: int | None
    pairs: tuple[PairCost, ...]

    @property
    def harmless_radius(self) -> float:
        """By how much all radii may grow before any two legs collide, 0 if some touch."""
        return max(0.0, 0.5 * min(pair.clearance for pair in self.pairs))


def reachable_workspace(
    design: Design,
    rotation: ArrayLike | None = None,
    *,
    start: ArrayLike | None = None,
    nodes: int = DEFAULT_NODES,
    node_step: float | None = None,
    most_nodes: int | None = None,
    tolerance: float | None = None,
    watch: Watch = unwatched,
) -> ReachableWorkspace:
    """Return what can be reached at one orientation without a collision of legs.

    Args:
        design: The manipulator; the radii are those of its limits.
        rotation: Platform to base, shape (3, 3); that of the home pose if None.
        start: The position that is to be connected, shape (3,); that of the home if None.
        nodes: Of the grid, on each axis of the workspace's extent.
        node_step: Of the paper's grid of nodes, as of `explorer.workspace_nodes`.
        most_nodes: The most nodes of the paper's grid that are counted; the counts of a
            finer grid are None. If this is None, too fine a grid is refused.
        tolerance: Of the solid where limits bound it, as of `explorer.workspace_solid`.
            Where collisions do, faces are as long as the step of the grid.
        watch: Called before each stage.

    Raises:
        InputError: the start collides or breaks a limit, or a number is out of range.
    """
    r = home_rotation(design) if rotation is None else checked_rotation(rotation)
    p = np.array(home_pose(design).position) if start is None else np.array(start, dtype=float)
    if not FEWEST_NODES <= nodes <= MOST_NODES:
        raise InputError(
            f"the nodes on an axis must be from {FEWEST_NODES} to {MOST_NODES}; got {nodes}"
        )
    limits = constraints(design, r)
    stages = Stages(watch, FIXED_STAGES + len(ALL_PAIRS))
    stages.begin("solid of the limits")
    exact = workspace_volume(design, r, explain=False)
    whole = workspace_solid(design, r, tolerance, volume=exact)
    step = node_step_of(design, node_step)
    stages.begin("least clearances")
    least = least_clearances(design, r)
    if whole.is_empty:
        # A workspace without volume, such as a part of a plane, may hold nodes of the grid.
        counts = _paper_nodes(design, r, limits, p, step, most_nodes)
        pairs = (_cost(pair, least, 0.0) for pair in ALL_PAIRS)
        return ReachableWorkspace(0.0, 0.0, whole, step, *counts, tuple(pairs))
    check_start(design, r, p)
    volume = exact.volume
    stages.begin("grid of positions")
    carver = _Carver(design, r, p, whole, volume, nodes)
    blocking = [pair for pair in ALL_PAIRS if least.bound[pair] <= 0.0 and carver.blocks(pair)]
    alone = blocking if len(blocking) > 1 else []
    stages.count = FIXED_STAGES + len(alone)
    stages.begin("collisions of all legs")
    solid, reachable = carver.carved(blocking)
    blocked = dict.fromkeys(blocking, volume - reachable)
    for pair in alone:
        stages.begin(f"collisions of {PAIR_NAMES[pair]}")
        blocked[pair] = max(0.0, volume - carver.carved([pair])[1])
    costs = [_cost(pair, least, blocked.get(pair, 0.0)) for pair in ALL_PAIRS]
    stages.begin("nodes of the grid")
    counts = _paper_nodes(design, r, limits, p, step, most_nodes)
    return ReachableWorkspace(volume, reachable, solid, step, *counts, tuple(costs))


def _cost(pair: int, least: LeastClearances, blocked: float) -> PairCost:
    clearance, bound = float(least.clearance[pair]), float(least.bound[pair])
    return PairCost(PAIRS[pair], clearance, bound, blocked)


def _paper_nodes(
    design: Design,
    rotation: FloatArray,
    limits: tuple[Constraint, ...],
    start: FloatArray,
    step: float,
    most: int | None,
) -> tuple[int, int] | tuple[None, None]:
    """Return how many nodes of the paper's grid are within the limits, and are reached.

    None for both if the grid has more nodes than a given number.
    """
    first, many = node_range(region_of(limits), step)
    with np.errstate(over="ignore"):
        is_fine = most is not None and not float(np.prod(many)) <= most
    if is_fine:
        return None, None
    check_node_count(many, step, MOST_PAPER_NODES)
    if not many.all():
        return 0, 0
    x, y, z = many.astype(int).tolist()
    found = survey(design, rotation, Grid(first * step, np.full(3, step), (x, y, z)))
    accessible = 0 if troubles(design, rotation, start) else int(found.reached(start).sum())
    return int(found.within.sum()), accessible


class _Carver:
    """Carves the workspace within the limits along the collisions of chosen pairs.

    Args:
        design: The manipulator.
        rotation: Platform to base, shape (3, 3).
        start: A position without trouble, shape (3,).
        whole: The workspace within the limits.
        volume: Its exact volume.
        nodes: On each axis.
    """

    def __init__(
        self,
        design: Design,
        rotation: FloatArray,
        start: FloatArray,
        whole: Solid,
        volume: float,
        nodes: int,
    ) -> None:
        self.design, self.rotation, self.start = design, rotation, start
        self.whole, self.volume, self.nodes = whole, volume, nodes
        self.radii = radii_of_pairs(design)

    @cached_property
    def survey(self) -> Survey:
        """The grid; made only if some pair may collide at all."""
        lows, highs = self.whole.vertices.min(axis=0), self.whole.vertices.max(axis=0)
        grid = grid_over(lows, highs, self.nodes, BEYOND)
        return survey(self.design, self.rotation, grid)

    def blocks(self, pair: int) -> bool:
        """Whether a pair that may collide takes any volume.

        Legs without radii take none where they cross, but for what they cut off.
        """
        if self.radii[pair] > 0.0:
            return True
        found = self.survey
        cut = found.reached(self.start, ()) & ~found.reached(self.start, [pair])
        return bool((cut & (found.clearance[..., pair] > SLACK * self.design.reach)).any())

    def carved(self, pairs: Sequence[int]) -> tuple[Solid, float]:
        """Return the part with the start where none of these pairs collides, and its volume."""
        surface = self._surface(pairs) if pairs else None
        solid = carved_solid(self.whole, surface, self.start)
        # What facets lack at the limits they lack of both, so the difference is exact there.
        return solid, max(0.0, self.volume - max(0.0, self.whole.volume - solid.volume))

    def _thin(self, flooded: BoolArray, clearance: FloatArray, pairs: Sequence[int]) -> IntArray:
        """Return the nodes nearest to legs' collisions that lie between two reached nodes.

        Legs thinner than a step may collide between nodes of which none collides. With one
        of the two cut out the surface has a place to settle on either side.
        """
        found = self.survey
        thick = [pair for pair in pairs if self.radii[pair] > 0.0]
        hit = ~found.clear[:, thick].all(axis=1)
        first, second = found.first[hit], found.second[hit]
        free = flooded.ravel()
        between = free[first] & free[second]
        first, second = first[between], second[between]
        least = clearance.ravel()
        return np.where(least[first] < least[second], first, second)

    def _surface(self, pairs: Sequence[int]) -> Surface:
        from scipy.ndimage import binary_dilation

        found, (design, rotation) = self.survey, (self.design, self.rotation)
        reached = found.reached(self.start, pairs)
        flooded = found.flooded(reached, pairs)
        clearance = np.minimum(found.clearance[..., list(pairs)].min(axis=-1), design.reach)
        # Beyond a wall that has no thickness the distance from it counts as negative.
        values = clearance * np.where(flooded, 1.0, -np.sign(clearance))
        touching = TOUCHING * design.reach
        if not self.radii[list(pairs)].all():
            values = values + touching
        values.ravel()[self._thin(flooded, clearance, pairs)] = -touching
        # Far from what is within the limits there is nothing to cut.
        near: Any = binary_dilation(found.within, CUBE)
        values[~near] = np.abs(values[~near])

        def name_of(points: FloatArray) -> IntArray:
            return nearest_pair(design, rotation, pairs, points)

        return Surface(
            values,
            found.grid.lows,
            found.grid.step,
            partial(settle, design, rotation, pairs, touching, found.grid.step),
            PAIR_NAMES,
            name_of,
        )
