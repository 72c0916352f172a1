"""The accessible workspace: positions that a collision-free move from home leads to.

A connected component of a grid of nodes and certified steps tells on which side of the
collisions the home lies. The solid of the limits, exact where they bound it, is cut along the
surface at which legs begin to collide; the accessible workspace is the part that holds the home.

That surface is interpolated between the nodes of a grid and projected onto the true one. Legs
without a radius collide only where their axes cross: on a surface with free positions on both
sides, so that a signed distance is needed to tell the sides apart.
"""

from __future__ import annotations

from dataclasses import dataclass
from functools import cached_property, partial
from typing import Any

import numpy as np
from numpy.typing import ArrayLike

from explorer.legs.clearance import (
    PAIRS,
    leg_axes,
    leg_clearances,
    pair_name,
    point_rates,
    radii_of_pairs,
)
from explorer.mechanism.design import Design
from explorer.mechanism.pose import Triple
from explorer.numerics import checks
from explorer.numerics.arrays import BoolArray, FloatArray, IntArray, dot, position_array, triple
from explorer.numerics.computed_once import computed_once
from explorer.numerics.search import Stages, Watch, ignore_stage
from explorer.workspace.accessible.nodes import (
    ALL_PAIRS,
    SLACK,
    Survey,
    check_start,
    count_nodes,
    make_grid,
    survey,
)
from explorer.workspace.least_clearance import least_clearances
from explorer.workspace.slices.volume import node_step_of, volume_of
from explorer.workspace.solids.solid import Solid, Surface, carved_solid
from explorer.workspace.solids.solids import whole_solid
from explorer.workspace.workspace import Workspace

# Newton steps onto the surface, and the largest step as a share of a cell.
STEPS = 6
SHARE = 0.3
# Strides of the search for a first collision, and its tolerance as a share of a cell.
STRIDES = 16
NEAR = 0.05
# The least slope of clearance over position that a Newton step divides by.
LEAST_SLOPE = 0.02
# Numbers of nodes on each axis of the workspace's extent, and beyond it on either side.
DEFAULT_NODES = 40
FEWEST_NODES, MOST_NODES = 8, 160
BEYOND = 2
# Offset, over the reach, of the collision surface of legs without radii beyond their crossing,
# where it might coincide with a limit.
TOUCHING = 1e-4
# Number of stages of the computation besides those of single pairs.
FIXED_STAGES = 5
CUBE = np.ones((3, 3, 3), dtype=np.bool_)
PAIR_NAMES = tuple(f"legs {pair_name(pair)}" for pair in PAIRS)
"""Names of the faces at which a pair of legs begins to collide."""


@dataclass(frozen=True)
class PairCost:
    """The least clearance of one pair of legs in a workspace, and the volume that it blocks.

    Attributes:
        legs: Numbers of the two legs, such as (1, 2).
        clearance: Least clearance within the limits, in design units; inf with a common joint.
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
        step: Step of the paper's grid of nodes, see `explorer.workspace.slices.volume.NodeCount`.
        node_count: Number of its nodes within the limits; None if not counted.
        accessible_node_count: Number of those that its clear steps lead to; None likewise.
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
        node_step: Step of the paper's grid of nodes, as in `node_count_of`.
        most_nodes: Largest number of nodes of that grid to count; the counts of a finer one are
            None. If this is None, too fine a grid is refused.
        tolerance: Tolerance of the solid where limits bound it, see `explorer.workspace_solid`.
        watch: Called before each stage.

    Raises:
        InputError: Not a rotation, a start that collides or breaks a limit (unless the workspace
            is empty), or a number out of range.
    """
    return accessible_part(
        Workspace(design, rotation),
        None if start is None else triple(position_array("start", start)),
        nodes=nodes,
        node_step=node_step,
        most_nodes=most_nodes,
        tolerance=tolerance,
        watch=watch,
    )


@computed_once
def accessible_part(
    workspace: Workspace,
    start: Triple | None = None,
    *,
    nodes: int = DEFAULT_NODES,
    node_step: float | None = None,
    most_nodes: int | None = None,
    tolerance: float | None = None,
    watch: Watch = ignore_stage,
) -> AccessibleWorkspace:
    """Compute the accessible part of a workspace, as `accessible_workspace` does."""
    p = np.array(workspace.design.home_pose.position if start is None else start)
    checks.whole("the number of nodes on an axis", nodes, FEWEST_NODES, MOST_NODES)
    stages = Stages(watch, FIXED_STAGES + len(ALL_PAIRS))
    stages.begin("solid of the limits")
    whole, step = whole_solid(workspace, tolerance), node_step_of(workspace.design, node_step)
    stages.begin("least clearances")
    least = least_clearances(workspace)
    # A workspace without volume, such as a part of a plane, may hold nodes of the grid.
    volume, solid, accessible, blocked = 0.0, whole, 0.0, dict[int, float]()
    if not whole.is_empty:
        check_start(workspace, p)
        volume = volume_of(workspace).volume
        stages.begin("grid of positions")
        carver = _Carver(workspace, p, whole, nodes)
        blocking = [pair for pair in ALL_PAIRS if least.bound[pair] <= 0.0 and carver.blocks(pair)]
        single_pairs = blocking if len(blocking) > 1 else []
        stages.count = FIXED_STAGES + len(single_pairs)
        stages.begin("collisions of all legs")
        solid, accessible = carver.carve(blocking)
        blocked = dict.fromkeys(blocking, volume - accessible)
        for pair in single_pairs:
            stages.begin(f"collisions of {PAIR_NAMES[pair]}")
            blocked[pair] = max(0.0, volume - carver.carve([pair])[1])
        stages.begin("nodes of the grid")
    rows = zip(PAIRS, least.clearance.tolist(), least.bound.tolist(), strict=True)
    costs = [PairCost(*row, blocked.get(pair, 0.0)) for pair, row in enumerate(rows)]
    counts = count_nodes(workspace, p, step, most_nodes)
    return AccessibleWorkspace(volume, accessible, solid, step, *counts, tuple(costs))


@dataclass(frozen=True)
class _Carver:
    """A cutter of the solid of a workspace along collisions of legs."""

    workspace: Workspace
    start: FloatArray
    whole: Solid
    nodes: int

    @cached_property
    def radii(self) -> FloatArray:
        """Sums of the radii of the pairs, shape (6,)."""
        return radii_of_pairs(self.workspace.design)

    @property
    def touching(self) -> float:
        """Clearance that counts as touching, see `TOUCHING`, in design units."""
        return TOUCHING * self.workspace.design.reach

    @cached_property
    def survey(self) -> Survey:
        """The survey of the grid, needed only if a pair may collide."""
        grid = make_grid(*self.whole.ends, self.nodes, BEYOND)
        return survey(self.workspace, grid)

    def blocks(self, pair: int) -> bool:
        """Return whether a pair that may collide blocks any volume.

        Legs without radii block none where they cross, only what they cut off.
        """
        if self.radii[pair] > 0.0:
            return True
        surveyed, slack = self.survey, SLACK * self.workspace.design.reach
        reached = surveyed.accessible_from(self.start, [pair])
        cut = surveyed.accessible_from(self.start, ()) & ~reached
        return bool((cut & (surveyed.clearance[..., pair] > slack)).any())

    def carve(self, pairs: list[int]) -> tuple[Solid, float]:
        """Cut out collisions of some pairs; return the part with the start, and its volume."""
        surfaces = [self._surface(pairs)] if pairs else []
        solid = carved_solid(self.whole, surfaces, self.start)
        # Both meshes lack the same volume at the limits, so it cancels in their difference.
        removed = max(0.0, self.whole.volume - solid.volume)
        return solid, max(0.0, volume_of(self.workspace).volume - removed)

    def _surface(self, pairs: list[int]) -> Surface:
        from scipy.ndimage import binary_dilation

        surveyed, reach = self.survey, self.workspace.design.reach
        extended = surveyed.extend(surveyed.accessible_from(self.start, pairs), pairs)
        clearance = np.minimum(surveyed.clearance[..., pairs].min(axis=-1), reach)
        # Beyond a wall without thickness the distance from it counts as negative.
        values = clearance * np.where(extended, 1.0, -np.sign(clearance))
        if not self.radii[pairs].all():
            values = values + self.touching
        # Legs thinner than a step may collide between two free nodes. The node nearer to the
        # collision is cut out, so that the surface passes on either side of it.
        free, least = extended.ravel(), clearance.ravel()
        thick = [pair for pair in pairs if self.radii[pair] > 0.0]
        first, second = surveyed.first, surveyed.second
        between = ~surveyed.clear[:, thick].all(axis=1) & free[first] & free[second]
        first, second = first[between], second[between]
        values.ravel()[np.where(least[first] < least[second], first, second)] = -self.touching
        # Far from all nodes within the limits there is nothing to cut.
        near: Any = binary_dilation(surveyed.within, CUBE)
        values[~near] = np.abs(values[~near])
        grid, project = surveyed.grid, partial(self._project, pairs)

        def name_of(points: FloatArray) -> IntArray:
            return self._nearest_pairs(pairs, points)[1]

        return Surface(values, grid.lows, grid.step, project, PAIR_NAMES, name_of)

    def _project(self, pairs: list[int], points: FloatArray, beside: FloatArray) -> FloatArray:
        """Project points (n, 3) onto the surface at which the nearest pair of legs collides.

        For pairs without radii that surface is `touching` beyond a crossing of axes. Beside each
        point is a free position on the near side of the surface, shape (n, 3). A point that
        diverges is returned as it is.
        """
        if not len(points):
            return points
        step = self.survey.grid.step
        # On the way from `beside` to a point the legs may pass through one another. A stride as
        # long as the clearance is free, since clearance changes no faster than position.
        segment = points - beside
        length = np.linalg.norm(segment, axis=1)
        covered, collision = np.zeros(len(points)), beside
        clearance, pair = self._nearest_pairs(pairs, beside)
        for _ in range(STRIDES):
            covered = np.minimum(length, covered + np.maximum(clearance, 0.0))
            collision = beside + (covered / np.maximum(length, 1e-300))[:, None] * segment
            clearance, pair = self._nearest_pairs(pairs, collision)
        collides = covered < length - NEAR * float(step.min())
        side = np.sign(self._signed_distances(pair, beside)[3])
        is_signed = self._signed_distances(pair, points)[2]
        radii = self.radii[pair]
        target = np.where(radii > 0.0, 0.0, -self.touching)
        projected = np.where((collides & ~is_signed)[:, None], collision, points)
        for _ in range(STEPS):
            value, gradient, has_side, _ = self._signed_distances(pair, projected)
            direction = np.where(has_side, side, 1.0)
            excess, gradient = target - value * direction + radii, gradient * direction[:, None]
            square = dot(gradient, gradient)
            ratio = np.where(square > LEAST_SLOPE**2, excess / np.maximum(square, 1e-300), 0.0)
            move = ratio[:, None] * gradient
            cells = np.abs(move / step).max(axis=1)
            projected += move * np.minimum(1.0, SHARE / np.maximum(cells, 1e-300))[:, None]
        astray = np.abs((projected - points) / step).max(axis=1) > 1.0
        projected[astray] = np.where(collides[:, None], collision, points)[astray]
        return projected

    def _nearest_pairs(self, pairs: list[int], points: FloatArray) -> tuple[FloatArray, IntArray]:
        """Return the least clearance of some pairs at positions (n, 3), and its pair, (n,) each."""
        clearance = leg_clearances(self.workspace.at(points)).clearance[:, pairs]
        return clearance.min(axis=1), np.array(pairs, dtype=np.int64)[clearance.argmin(axis=1)]

    def _signed_distances(
        self, pair: IntArray, at: FloatArray
    ) -> tuple[FloatArray, FloatArray, BoolArray, FloatArray]:
        """Return distances (n,) of the axes of a pair of legs at each position, signed if possible.

        Where the closest points lie between the ends of the legs, the distance is that of the two
        lines, and its sign tells on which side of each other they are. Returned are also the
        gradients in position, (n, 3), which distances are signed, and the signed ones of the lines
        in any case.
        """
        poses = self.workspace.at(at)
        clearances, axes = leg_clearances(poses), leg_axes(poses)
        rows, ends = np.arange(len(at)), np.array(PAIRS)[pair] - 1
        one, two = axes[rows, ends[:, 0]], axes[rows, ends[:, 1]]
        u, v = one[:, 1] - one[:, 0], two[:, 1] - two[:, 0]
        normal = np.cross(u, v)
        length = np.linalg.norm(normal, axis=-1)
        scale = np.linalg.norm(u, axis=-1) * np.linalg.norm(v, axis=-1)
        normal = normal / np.where(length > 0.0, length, 1.0)[:, None]
        signed, distance = dot(one[:, 0] - two[:, 0], normal), clearances.distance[rows, pair]
        is_of_lines = np.abs(np.abs(signed) - distance) <= 1e-9 * self.workspace.design.reach
        has_side = (length > 1e-6 * scale) & is_of_lines
        off = clearances.points[rows, pair, 0] - clearances.points[rows, pair, 1]
        outward = off / np.where(distance > 0.0, distance, 1.0)[:, None]
        rates = point_rates(axes, clearances.points)[rows, pair]
        gradient = np.where(has_side[:, None], normal, outward) * rates
        return np.where(has_side, signed, distance), gradient, has_side, signed
