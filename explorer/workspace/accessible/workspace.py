"""The accessible workspace: positions that a collision-free move from home leads to.

A connected component of a grid of nodes and certified steps tells on which side of the
collisions the home lies. The solid of the limits, exact where they bound it, is cut along the
collision surface; the accessible workspace is the part that holds the home.
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
from explorer.mechanism.pose import checked_rotation
from explorer.numerics.arrays import BoolArray, FloatArray, IntArray
from explorer.numerics.search import Stages, Watch, ignore_stage
from explorer.workspace.accessible.collision_surface import nearest_pair, project_onto_collisions
from explorer.workspace.accessible.nodes import (
    ALL_PAIRS,
    SLACK,
    Grid,
    Survey,
    check_start,
    make_grid,
    start_faults,
    survey,
)
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
from explorer.workspace.solids.booleans import Surface, carved_solid
from explorer.workspace.solids.solid import Solid
from explorer.workspace.solids.solids import workspace_solid

# Numbers of nodes on each axis of the workspace's extent, and beyond it on either side.
DEFAULT_NODES = 40
FEWEST_NODES, MOST_NODES = 8, 160
BEYOND = 2
# Offset, over the reach, of the collision surface of legs without radii beyond their crossing,
# where it might coincide with a limit.
TOUCHING = 1e-4
# Largest number of nodes of the paper's grid, all steps of which are checked.
MOST_PAPER_NODES = 2_000_000
# Number of stages of the computation besides those of single pairs.
FIXED_STAGES = 5
CUBE = np.ones((3, 3, 3), dtype=np.bool_)
PAIR_NAMES = tuple(f"legs {first}–{second}" for first, second in PAIRS)
"""Names of the faces at which a pair of legs begins to collide."""


@dataclass(frozen=True)
class PairCost:
    """The least clearance of one pair of legs in a workspace, and the volume that it blocks.

    Attributes:
        legs: Numbers of the two legs, such as (1, 2).
        clearance: Least clearance within the limits, in design units; negative in
            collision, inf for a pair that shares a joint.
        bound: Certified lower bound of the clearance within the limits.
        blocked_volume: Volume that this pair alone takes from the workspace, in cubed design
            units: positions at which it collides, and those that it cuts off from the home.
    """

    legs: tuple[int, int]
    clearance: float
    bound: float
    blocked_volume: float


@dataclass(frozen=True)
class AccessibleWorkspace:
    """A constant-orientation workspace within the limits, and its accessible part.

    Attributes:
        volume: Exact volume within the limits, in cubed design units.
        accessible_volume: Volume of the accessible part, in cubed design units.
        solid: The accessible part.
        step: Step of the paper's grid of nodes, as in
            `explorer.workspace.slices.volume.NodeCount`.
        node_count: Number of nodes of that grid within the limits; None if not counted.
        accessible_node_count: Number of its nodes that clear steps of the grid lead to; None if not
            counted.
        pairs: The six pairs of legs, in the order of `PAIRS`.
    """

    volume: float
    accessible_volume: float
    solid: Solid
    step: float
    node_count: int | None
    accessible_node_count: int | None
    pairs: tuple[PairCost, ...]

    @property
    def harmless_radius(self) -> float:
        """The largest increase of all radii with which no two legs collide, 0 if two touch."""
        return max(0.0, 0.5 * min(pair.clearance for pair in self.pairs))


def accessible_workspace(
    design: Design,
    rotation: ArrayLike | None = None,
    *,
    start: ArrayLike | None = None,
    nodes: int = DEFAULT_NODES,
    node_step: float | None = None,
    most_nodes: int | None = None,
    tolerance: float | None = None,
    watch: Watch = ignore_stage,
) -> AccessibleWorkspace:
    """Compute the accessible workspace at one orientation.

    Args:
        design: The manipulator; the radii of the legs are those of its limits.
        rotation: Rotation from platform to base, shape (3, 3); that of the home pose if None.
        start: Position from which moves start, shape (3,); that of the home pose if None.
        nodes: Number of nodes of the grid on each axis of the workspace's extent.
        node_step: Step of the paper's grid of nodes, as in `workspace_nodes`.
        most_nodes: Largest number of nodes of the paper's grid to count; the counts of a
            finer grid are None. If this is None, too fine a grid is refused.
        tolerance: Tolerance of the solid where limits bound it, as in
            `explorer.workspace_solid`. Where collisions do, faces are as long as a step.
        watch: Called before each stage.

    Raises:
        InputError: Not a rotation, the start collides or breaks a limit, or a number is out
            of range. An empty workspace has no start to check.
    """
    r = home_rotation(design) if rotation is None else checked_rotation(rotation)
    p = np.array(design.home_pose.position) if start is None else np.array(start, dtype=float)
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
        return AccessibleWorkspace(0.0, 0.0, whole, step, *counts, tuple(pairs))
    check_start(design, r, p)
    volume = exact.volume
    stages.begin("grid of positions")
    carver = _Carver(design, r, p, whole, volume, nodes)
    blocking = [pair for pair in ALL_PAIRS if least.bound[pair] <= 0.0 and carver.blocks(pair)]
    single_pairs = blocking if len(blocking) > 1 else []
    stages.count = FIXED_STAGES + len(single_pairs)
    stages.begin("collisions of all legs")
    solid, accessible = carver.carve(blocking)
    blocked = dict.fromkeys(blocking, volume - accessible)
    for pair in single_pairs:
        stages.begin(f"collisions of {PAIR_NAMES[pair]}")
        blocked[pair] = max(0.0, volume - carver.carve([pair])[1])
    costs = [_cost(pair, least, blocked.get(pair, 0.0)) for pair in ALL_PAIRS]
    stages.begin("nodes of the grid")
    counts = _paper_nodes(design, r, limits, p, step, most_nodes)
    return AccessibleWorkspace(volume, accessible, solid, step, *counts, tuple(costs))


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
    """Count the nodes of the paper's grid within the limits, and the accessible ones.

    Both counts are None if the grid has more nodes than `most`.
    """
    first, counts = node_range(region_of(limits), step)
    if most is not None and float(np.prod(counts)) > most:
        return None, None
    check_node_count(counts, step, MOST_PAPER_NODES)
    if not counts.all():
        return 0, 0
    x, y, z = counts.astype(int).tolist()
    surveyed = survey(design, rotation, Grid(first * step, np.full(3, step), (x, y, z)))
    accessible = (
        0 if start_faults(design, rotation, start) else int(surveyed.accessible_from(start).sum())
    )
    return int(surveyed.within.sum()), accessible


@dataclass(frozen=True)
class _Carver:
    """A cutter of the workspace within the limits, of known volume, along collisions of legs."""

    design: Design
    rotation: FloatArray
    start: FloatArray
    whole: Solid
    volume: float
    nodes: int

    @cached_property
    def radii(self) -> FloatArray:
        """Sums of the radii of the pairs, shape (6,)."""
        return radii_of_pairs(self.design)

    @cached_property
    def survey(self) -> Survey:
        """The survey of the grid, needed only if a pair may collide."""
        grid = make_grid(*self.whole.ends, self.nodes, BEYOND)
        return survey(self.design, self.rotation, grid)

    def blocks(self, pair: int) -> bool:
        """Return whether a pair that may collide blocks any volume.

        Legs without radii block none where they cross, only what they cut off.
        """
        if self.radii[pair] > 0.0:
            return True
        surveyed = self.survey
        cut = surveyed.accessible_from(self.start, ()) & ~surveyed.accessible_from(
            self.start, [pair]
        )
        return bool((cut & (surveyed.clearance[..., pair] > SLACK * self.design.reach)).any())

    def carve(self, pairs: Sequence[int]) -> tuple[Solid, float]:
        """Cut out collisions of some pairs; return the part with the start, and its volume."""
        surfaces = [self._surface(pairs)] if pairs else []
        solid = carved_solid(self.whole, surfaces, self.start)
        # Both meshes lack the same volume at the limits, so it cancels in their difference.
        return solid, max(0.0, self.volume - max(0.0, self.whole.volume - solid.volume))

    def _thin_walls(
        self, extended: BoolArray, clearance: FloatArray, pairs: Sequence[int]
    ) -> IntArray:
        """Return a node of each step whose ends are free although legs collide between them.

        This happens with legs thinner than a step. The node is the end nearer to the collision;
        once it is cut out, the surface passes on either side of it.
        """
        surveyed = self.survey
        thick = [pair for pair in pairs if self.radii[pair] > 0.0]
        collides = ~surveyed.clear[:, thick].all(axis=1)
        first, second = surveyed.first[collides], surveyed.second[collides]
        free = extended.ravel()
        between = free[first] & free[second]
        first, second = first[between], second[between]
        least = clearance.ravel()
        return np.where(least[first] < least[second], first, second)

    def _surface(self, pairs: Sequence[int]) -> Surface:
        from scipy.ndimage import binary_dilation

        surveyed, (design, rotation) = self.survey, (self.design, self.rotation)
        extended = surveyed.extend(surveyed.accessible_from(self.start, pairs), pairs)
        clearance = np.minimum(surveyed.clearance[..., list(pairs)].min(axis=-1), design.reach)
        # Beyond a wall without thickness the distance from it counts as negative.
        values = clearance * np.where(extended, 1.0, -np.sign(clearance))
        touching = TOUCHING * design.reach
        if not self.radii[list(pairs)].all():
            values = values + touching
        values.ravel()[self._thin_walls(extended, clearance, pairs)] = -touching
        # Far from all nodes within the limits there is nothing to cut.
        near: Any = binary_dilation(surveyed.within, CUBE)
        values[~near] = np.abs(values[~near])

        def name_of(points: FloatArray) -> IntArray:
            return nearest_pair(design, rotation, pairs, points)

        return Surface(
            values,
            surveyed.grid.lows,
            surveyed.grid.step,
            partial(project_onto_collisions, design, rotation, pairs, touching, surveyed.grid.step),
            PAIR_NAMES,
            name_of,
        )
