"""The carried region: the part of a workspace in which the machine carries a load, and its solid.

Its volume is that of columns (`explorer.workspace.slices.column_volume`). For the solid each limit
of a part of the machine is a surface of its own, which is smooth where it bounds the workspace. A
grid of positions finds it, and each of its vertices is moved onto the true surface, so that only
the flatness of the faces between vertices is approximate. Booleans cut one surface after the other
out of the workspace, so that creases between limits and parts that are thinner than a cell of the
grid are kept.
"""

from __future__ import annotations

import math
from collections.abc import Callable, Iterator
from dataclasses import dataclass, field, replace
from functools import cached_property, partial
from typing import NamedTuple

import numpy as np

from explorer.mechanism.design import Design
from explorer.mechanism.machine import NO_LOAD
from explorer.motion.inverse_jacobian import load_array
from explorer.numerics.arrays import BoolArray, FloatArray, IntArray
from explorer.numerics.computed_once import computed_once
from explorer.statics import load_cases
from explorer.statics.reactions import PART_NAMES
from explorer.workspace.accessible.nodes import Grid, make_grid
from explorer.workspace.limits.constraints import Cone, HalfSpace
from explorer.workspace.slices.column_volume import ColumnVolume, volume_of_columns
from explorer.workspace.slices.volume import volume_of
from explorer.workspace.solids.solid import Solid, Surface, carved_solid, cut_solid
from explorer.workspace.solids.solids import whole_solid
from explorer.workspace.workspace import Workspace

# Least number of nodes on each axis of the last grid in the box about the part, and number of
# nodes beyond it on either side.
NODES = 20
BEYOND = 2
# Nodes on each axis of the grid on which the best position is sought at first.
COARSE = 20
# To find the best position: numbers of starts, of steps of that grid between them, of nodes on each
# axis of the grids about one, and of these grids.
STARTS, APART, FOLLOWING, ROUNDS = 12, 2.5, 5, 30
# Least share of a limit of which the factor of a load that it allows is told.
LEAST_SHARE = 1e-3
# Growth of the box of the part to each side, and on a side on which the part goes on, over its
# size.
AROUND, GROWTH = 0.1, 0.25
# Digits of its values by which the function of a limit is that of another.
SAME_DIGITS = 12
# Factor of the number of nodes on an axis of the next grid, the largest number, and the difference
# of the volume of the mesh from that of columns, over the latter, after which there is none.
FINER, FINEST, SETTLED = 1.6, 72, 1.5e-3
# Largest error of the volume, over the volume.
VOLUME_ERROR = 1e-3
# Names in a solid of the sides of a box, by its ends and axes.
SIDES = {
    (end, axis): f"side {end} of the box on axis {axis}" for end in (0, 1) for axis in range(3)
}


@dataclass(frozen=True)
class CarriedRegion:
    """The part of a constant-orientation workspace in which the machine carries a load.

    Attributes:
        volume: Exact volume of the workspace with the signs of home, in cubed design units.
        held_volume: Volume of the part, in cubed design units.
        error: Estimate of the largest error of that, without thin pieces between columns.
        find_solid: Function that computes the solid.
        best: If the part is empty, the position found with the least share of a limit, shape (3,).
        factor: The factor of the load, the payload's weight and its force that this position
            holds, 0 to 1; above 1 if the positions that hold them are too few for a volume.
    """

    volume: float
    held_volume: float
    error: float
    find_solid: Callable[[], Solid] = field(repr=False)
    best: FloatArray | None = None
    factor: float | None = None

    @cached_property
    def solid(self) -> Solid:
        """The part as a mesh, computed when it is first asked for."""
        return self.find_solid()


def part_names(design: Design) -> tuple[str, ...]:
    """Return the names of the parts of `explorer.statics.reactions.part_limits`, ten of them.

    A strut and the guide take the same moment; the one with the smaller limit has the name.
    """
    guide = design.guide.moment_nm
    is_of_guide = guide is not None and guide < design.struts.largest_moment
    moments = PART_NAMES[10:] if is_of_guide else PART_NAMES[6:8]
    return (*PART_NAMES[:6], *moments, *PART_NAMES[8:10])


@computed_once
def carried_region(
    workspace: Workspace, load: tuple[float, ...] = NO_LOAD, *, tolerance: float | None = None
) -> CarriedRegion:
    """Return the positions at which the machine carries a load within its limits.

    On a singular plane no unique forces hold a load, so that only positions with the signs of
    the margins count that the home pose has in its own orientation. The payload's weight and its
    force of any direction act besides the load; the legs count as weightless. Pieces are missed
    that lie between 65² columns along x, see `explorer.workspace.slices.column_volume`.

    Args:
        workspace: The workspace of a design with its payload and its limits.
        load: (F; M) on the platform at the tool point, base axes, shape (6,), in N and N × unit.
        tolerance: Tolerance of the solid where other limits bound it, as in
            `explorer.workspace_solid`.

    Raises:
        InputError: A load that is not finite, or no usable tolerance.
        ExplorerError: A boolean fails.
    """
    design, r, w = workspace.design, workspace.rotation, load_array(load)
    if design.limits.margin is None:
        return carried_region(
            Workspace(design.with_limits(margin=0.0), r), load, tolerance=tolerance
        )
    volume = volume_of(workspace).volume
    local = _LocalLoad(workspace, load_cases.load_case(design, r, w), part_names(design))
    found = volume_of_columns(workspace.region, VOLUME_ERROR, local.case, r)
    if found.volume == 0.0:
        whole = whole_solid(workspace, tolerance)
        if whole.is_empty:
            return CarriedRegion(volume, 0.0, 0.0, partial(whole_solid, workspace, tolerance))
        best = local.best_within(whole)
        if best.share <= 1.0:
            near = best.position
            found = volume_of_columns(workspace.region, VOLUME_ERROR, local.case, r, about=near)
        if found.volume == 0.0:
            factor = 1.0 / max(best.share, LEAST_SHARE)
            empty = partial(_empty_part, local, tolerance, best.part)
            return CarriedRegion(volume, 0.0, 0.0, empty, best.position, factor)
    find_solid = partial(_carried_part, local, tolerance, found)
    return CarriedRegion(volume, found.volume, found.error, find_solid)


class Best(NamedTuple):
    """A position where the largest share of a limit is least, of those that were tried.

    Attributes:
        position: b4 in the base frame, shape (3,).
        share: The share.
        part: Index of the part of the machine with that share.
    """

    position: FloatArray
    share: float
    part: int


@dataclass(frozen=True)
class _LocalLoad:
    """A load in a workspace, as `load_case` returns it, with the names of the parts under it."""

    workspace: Workspace
    case: FloatArray
    part_names: tuple[str, ...]

    def shares(self, positions: FloatArray) -> tuple[FloatArray, IntArray]:
        """Return the largest shares of a limit at positions (n, 3), and the parts, (n,) each."""
        return load_cases.largest_shares(self.case, self.workspace.rotation, positions)

    def is_near(self, positions: FloatArray, distance: float) -> BoolArray:
        """Return which positions (n, 3) may be nearer to the workspace than a distance, (n,)."""
        # The slack of a cone is an angle.
        is_length = [not isinstance(limit, Cone) for limit in self.workspace.limits]
        slacks = self.workspace.slacks(positions)[..., is_length]
        return np.asarray((slacks >= -distance).all(axis=-1))

    def best_within(self, whole: Solid) -> Best:
        """Return the best position found within the limits."""
        grid = make_grid(*whole.ends, COARSE, 0)
        tried = np.vstack([whole.vertices, positions_within(whole, grid, self.workspace.contains)])
        found = best_positions(tried, grid.step, self.shares, self.workspace.contains)
        return min(found, key=lambda best: best.share)


def _empty_part(load: _LocalLoad, tolerance: float | None, part: int) -> Solid:
    """Return the empty part of a workspace, because of a part of the machine by its index."""
    whole = whole_solid(load.workspace, tolerance)
    none = replace(whole, vertices=whole.vertices[:0], faces=whole.faces[:0])
    return replace(
        none, limit_of_face=whole.limit_of_face[:0], empty_because=(load.part_names[part],)
    )


def _carried_part(load: _LocalLoad, tolerance: float | None, found: ColumnVolume) -> Solid:
    """Return the part of a workspace that holds a load, whose volume and box are known.

    It is carved out of the box, which grows on each side on which the part goes on beyond it, by a
    grid that becomes finer until the volume is the known one.
    """
    whole = whole_solid(load.workspace, tolerance)
    if whole.is_empty:
        return whole
    size = found.box[1] - found.box[0]
    box, count = found.box + AROUND * np.array([-size, size]), NODES
    while True:
        near, ends = whole, whole.ends
        for (end, axis), name in SIDES.items():
            sign, level = (-1.0, 1.0)[end], float(box[end, axis])
            if sign * level < sign * ends[end][axis]:
                near = cut_solid(near, HalfSpace(name, sign * np.eye(3)[axis], sign * level))
        part = near if near.is_empty else _carve(near, load, count)
        indices: list[int] = np.unique(part.limit_of_face).tolist()
        bounding = {part.limits[index] for index in indices}
        cut = [side for side, name in SIDES.items() if name in bounding]
        growth = GROWTH * np.array([box[0] - box[1], box[1] - box[0]])
        for side in cut:
            box[side] += growth[side]
        if cut:
            continue
        is_settled = abs(part.volume - found.volume) <= SETTLED * found.volume
        if is_settled or part.is_empty or count >= FINEST:
            kept = [k for k, name in enumerate(part.limits) if name not in SIDES.values()]
            new = np.searchsorted(kept, part.limit_of_face)
            return replace(part, limit_of_face=new, limits=tuple(part.limits[k] for k in kept))
        count = min(FINEST, math.ceil(FINER * count))


def _carve(near: Solid, load: _LocalLoad, nodes: int) -> Solid:
    """Return the positions of a solid that hold a load, by a grid."""
    from scipy.ndimage import maximum_filter

    grid = make_grid(*near.ends, nodes, BEYOND)
    positions = grid.positions.reshape(-1, 3)
    limits = np.flatnonzero(np.isfinite(load.case[load_cases.LIMITS : load_cases.INWARD]))
    values = load_cases.limit_values(load.case, load.workspace.rotation, limits, positions)
    # Two limits may have the same surface, such as those of a part without a load of one direction.
    distinct = np.sort(np.unique(np.round(values, SAME_DIGITS), axis=0, return_index=True)[1])
    limits, values = limits[distinct], values[distinct].reshape(-1, *grid.counts)
    left = load.is_near(positions, float(np.linalg.norm(grid.step))).reshape(grid.counts)

    def project(limit: int, left: BoolArray, points: FloatArray, beside: FloatArray) -> FloatArray:
        """Move the points onto the limit that other limits have not yet removed."""
        nodes = np.rint((beside - grid.lows) / grid.step).astype(np.int64)
        chosen, projected = left[tuple(nodes.T)], points.copy()
        rows = points[chosen], beside[chosen], grid.step
        projected[chosen] = load_cases.settle_on_limit(
            load.case, load.workspace.rotation, limit, *rows
        )
        return projected

    def surfaces() -> Iterator[Surface]:
        remaining, waiting = left, set(range(len(limits)))
        while waiting:
            # What most nodes exceed comes first: less remains for the others.
            counts = {k: int(np.count_nonzero((values[k] < 0.0) & remaining)) for k in waiting}
            index = max(waiting, key=lambda k: counts[k])
            if not counts[index]:
                return
            waiting.remove(index)
            limit = int(limits[index])
            name = load.part_names[limit % load_cases.PARTS]
            own = partial(project, limit, remaining)
            yield Surface(values[index], grid.lows, grid.step, own, (name,))
            remaining = remaining & (maximum_filter(values[index], 3, mode="nearest") >= 0.0)

    return carved_solid(near, surfaces())


def positions_within(
    whole: Solid, grid: Grid, allows: Callable[[FloatArray], BoolArray]
) -> FloatArray:
    """Return allowed positions all over a workspace, shape (n, 3).

    They are nodes of a grid, and middles between vertices, which a thin workspace also has.
    """
    vertices = whole.vertices
    others = np.random.default_rng(0).permutation(len(vertices))
    middles = 0.5 * (vertices + vertices[others])
    tried = np.vstack([grid.positions.reshape(-1, 3), middles])
    return tried[allows(tried)]


def best_positions(
    tried: FloatArray,
    step: FloatArray,
    shares: Callable[[FloatArray], tuple[FloatArray, IntArray]],
    allows: Callable[[FloatArray], BoolArray],
    enough: float = 0.0,
) -> list[Best]:
    """Return positions where the largest share of a limit has a local minimum.

    Grids about the best of the allowed positions tried, (n, 3), that lie apart follow the least
    shares, and shrink where none is less. A search ends at a share that is enough. The positions
    are a step apart on each axis, shape (3,).
    """
    values, parts = shares(tried)
    cube = np.stack(np.meshgrid(*[np.linspace(-1.0, 1.0, FOLLOWING)] * 3), axis=-1).reshape(-1, 3)
    found: list[Best] = []
    left = np.argsort(values)
    while len(left) and len(found) < STARTS:
        first = int(left[0])
        best = Best(tried[first], float(values[first]), int(parts[first]))
        left = left[(np.abs(tried[left] - best.position) > APART * step).any(axis=1)]
        size = 1.0
        for _ in range(ROUNDS):
            if best.share <= enough:
                break
            near = best.position + size * step * cube
            near = np.vstack([best.position, near[allows(near)]])
            around, of = shares(near)
            index = int(around.argmin())
            # The best position itself comes first.
            size *= 1.0 if index else 0.5
            best = Best(near[index], float(around[index]), int(of[index]))
        found.append(best)
    return found
