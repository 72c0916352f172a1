"""The part of a workspace where a load is held within the limits of the machine, as a solid.

Its new faces lie on the surface where one part takes its limit. A grid of positions finds them,
and each of their vertices is moved onto the true surface, so that only the flatness of the faces
between vertices is approximate.
"""

from __future__ import annotations

import math
from dataclasses import dataclass, replace
from typing import NamedTuple

import msgspec
import numpy as np
from numpy.typing import ArrayLike

from explorer.errors import InputError
from explorer.mechanism.design import Design
from explorer.mechanism.pose import checked_rotation
from explorer.numerics.arrays import BoolArray, FloatArray, IntArray, finite_array
from explorer.statics.held import HIGHEST, held_load, held_values, settle_on_limit
from explorer.statics.reactions import PART_NAMES
from explorer.workspace.accessible.nodes import Grid, make_grid
from explorer.workspace.limits.constraints import Constraint, HalfSpace, constraints, slacks
from explorer.workspace.slices.volume import home_rotation, workspace_volume
from explorer.workspace.solids.solid import Solid
from explorer.workspace.solids.solids import Surface, carved_solid, cut_solid, workspace_solid

# Numbers of nodes on each axis of the box about the part, and beyond it on either side.
DEFAULT_NODES = 28
FEWEST_NODES, MOST_NODES = 8, 160
BEYOND = 2
# Nodes on each axis of the grid that finds the box of the part.
COARSE = 20
# To find the best position: numbers of starts, of steps of that grid between them, of nodes on each
# axis of the grids about one, and of these grids.
STARTS, APART, FOLLOWING, ROUNDS = 12, 2.5, 5, 30
# Growth of the box of the part on a side on which the part goes on, over its size.
GROWTH = 0.25
# Volume that a grid may miss, over that of the part; factor of the number of nodes on an axis of
# the next grid, and the largest number.
MISSED, FINER, FINEST = 2e-3, 1.6, 100


@dataclass(frozen=True)
class HeldWorkspace:
    """The part of a constant-orientation workspace where a load is held.

    Attributes:
        volume: Exact volume of the workspace with the signs of home, in cubed design units.
        held_volume: Volume of the part, in cubed design units.
        solid: The part.
        best: If the part is empty, the position found with the least share of a limit, shape (3,).
        factor: The factor of the load, the payload's weight and its force that this position
            holds, 0 to 1; above 1 if the positions that hold them are too few for a solid.
    """

    volume: float
    held_volume: float
    solid: Solid
    best: FloatArray | None = None
    factor: float | None = None


def part_names(design: Design) -> tuple[str, ...]:
    """Return the names of the parts of `explorer.statics.reactions.part_limits`, ten of them.

    A strut and the guide take the same moment; the one with the smaller limit has the name.
    """
    guide = design.guide.moment_nm
    is_of_guide = guide is not None and guide < design.struts.largest_moment
    moments = PART_NAMES[10:] if is_of_guide else PART_NAMES[6:8]
    return (*PART_NAMES[:6], *moments, *PART_NAMES[8:10])


def held_workspace(
    design: Design,
    rotation: ArrayLike | None = None,
    load: ArrayLike = (0.0,) * 6,
    *,
    nodes: int = DEFAULT_NODES,
    tolerance: float | None = None,
) -> HeldWorkspace:
    """Return the positions at which a load is held within the limits of actuators and machine.

    Beyond a singular plane no load is held on the way, so that only positions with home's signs of
    the margins count. The payload's weight and its force of any direction act besides the load;
    the legs count as weightless. The volume is off by about half a percent at most, that of a part
    below a thousandth of the workspace by a few percent. Pieces apart from the others are missed
    if they contain no node of a grid of 20 nodes on each axis of the workspace's extent and lie
    beyond the box about the others, and so are pieces or tips that contain neither nodes nor
    centres of cells of the last grid within the box.

    Args:
        design: The manipulator, with its payload and its limits.
        rotation: Platform to base, shape (3, 3); that of the home pose if None.
        load: (F; M) on the platform at the tool point, base axes, shape (6,), in N and N × unit.
        nodes: Number of nodes on each axis of the first grid within the box about the part.
        tolerance: Tolerance of the solid where other limits bound it, as in
            `explorer.workspace_solid`.

    Raises:
        InputError: Not a rotation, a load that is not finite, or a number out of range.
        ExplorerError: A boolean fails.
    """
    r = home_rotation(design) if rotation is None else checked_rotation(rotation)
    w = finite_array("load (FX FY FZ MX MY MZ)", load, (6,))
    if not FEWEST_NODES <= nodes <= MOST_NODES:
        raise InputError(
            f"the nodes on an axis must be from {FEWEST_NODES} to {MOST_NODES}; got {nodes}"
        )
    if design.limits.margin is None:
        limits = msgspec.structs.replace(design.limits, margin=0.0)
        design = msgspec.structs.replace(design, limits=limits)
    exact = workspace_volume(design, r)
    whole = workspace_solid(design, r, tolerance, volume=exact)
    if whole.is_empty:
        return HeldWorkspace(exact.volume, 0.0, whole)
    load_here = _LoadHere(held_load(design, r, w), r, constraints(design, r), part_names(design))
    solid = _held_part(whole, load_here, nodes)
    if solid.is_empty:
        best = _best_within(whole, load_here)
        factor = max(0.0, 1.0 + best.value)
        empty = replace(solid, empty_because=(load_here.part_names[best.part],))
        return HeldWorkspace(exact.volume, 0.0, empty, best.position, factor)
    # The mesh of the whole lacks a share of the exact volume, and so does its part.
    return HeldWorkspace(exact.volume, solid.volume * exact.volume / whole.volume, solid)


@dataclass(frozen=True)
class _LoadHere:
    """A load at one orientation, with the limits of the workspace there.

    Attributes:
        held: What `explorer.statics.held.held_load` returns.
        rotation: Platform to base, shape (3, 3).
        limits: Limits of positions.
        part_names: Names of the parts that may give way.
    """

    held: FloatArray
    rotation: FloatArray
    limits: tuple[Constraint, ...]
    part_names: tuple[str, ...]

    def values(self, positions: FloatArray) -> tuple[FloatArray, IntArray]:
        """Return what `explorer.statics.held.held_values` does at positions (n, 3)."""
        return held_values(self.held, self.rotation, positions)

    def holds(self, positions: FloatArray) -> BoolArray:
        """Return at which positions (n, 3) the parts hold the load, shape (n,)."""
        return self.values(positions)[0] >= 0.0

    def allows(self, positions: FloatArray) -> BoolArray:
        """Return which positions (n, 3) keep the limits of the workspace, shape (n,)."""
        return np.asarray((slacks(self.limits, positions) >= 0.0).all(axis=-1))


class _Best(NamedTuple):
    """The position where the largest share of a limit is least, of those that were tried.

    Attributes:
        position: b4 in the base frame, shape (3,).
        value: Value there of the function of `explorer.statics.held`.
        part: Index of the part of the machine with that share.
    """

    position: FloatArray
    value: float
    part: int


def _held_part(whole: Solid, load: _LoadHere, nodes: int) -> Solid:
    """Return the part of a workspace that holds a load.

    It is carved out of a box about the nodes of a coarse grid that hold the load, which grows on
    each side on which the part goes on beyond it. The grid within the box becomes finer while it
    misses too much of the part. If no node holds the load, the best position
    within the limits counts; the part is empty if that does not hold it either.
    """
    grid = _coarse_grid(whole)
    positions = np.vstack([grid.positions.reshape(-1, 3), whole.vertices])
    kept = positions[load.holds(positions)]
    if not len(kept):
        best = _best_within(whole, load)
        if best.value < 0.0:
            return replace(whole, vertices=kept, faces=whole.faces[:0])
        kept = best.position[None]
    box = np.array([kept.min(axis=0) - grid.step, kept.max(axis=0) + grid.step])
    while True:
        near, side_of_limit = _crop(whole, box)
        if near.is_empty:
            return _without_limits(near, set(side_of_limit))
        part, missed = _carve(near, load, nodes)
        bounding = {side_of_limit.get(limit) for limit in np.unique(part.limit_of_face).tolist()}
        open_sides = [side for side in bounding if side is not None]
        if open_sides:
            size = box[1] - box[0]
            for end, axis in open_sides:
                box[end, axis] += (-GROWTH, GROWTH)[end] * size[axis]
            continue
        if missed.volume <= MISSED * part.volume or nodes >= FINEST:
            return _without_limits(part, set(side_of_limit))
        nodes = min(FINEST, math.ceil(FINER * nodes))
        seen = np.vstack([part.vertices, missed.positions])
        box[0] = np.maximum(box[0], seen.min(axis=0) - missed.step)
        box[1] = np.minimum(box[1], seen.max(axis=0) + missed.step)


def _crop(whole: Solid, box: FloatArray) -> tuple[Solid, dict[int, tuple[int, int]]]:
    """Return the part of a solid within a box, shape (2, 3), and what sides of it cut.

    The end and the axis of each side are found by the index of its limit in the part.
    """
    part, sides = whole, dict[int, tuple[int, int]]()
    ends = whole.vertices.min(axis=0), whole.vertices.max(axis=0)
    for axis, unit in enumerate(np.eye(3)):
        for end, sign in enumerate((-1.0, 1.0)):
            level = float(box[end, axis])
            if sign * level < sign * ends[end][axis] and not part.is_empty:
                sides[len(part.limits)] = end, axis
                name = f"side {end} of the box on axis {axis}"
                part = cut_solid(part, HalfSpace(name, sign * unit, sign * level))
    return part, sides


def _without_limits(solid: Solid, dropped: set[int]) -> Solid:
    """Return a solid without some limits, given by their indices, on which no face lies."""
    kept = [index for index in range(len(solid.limits)) if index not in dropped]
    new = np.searchsorted(kept, solid.limit_of_face)
    return replace(solid, limit_of_face=new, limits=tuple(solid.limits[index] for index in kept))


class _Missed(NamedTuple):
    """What a grid misses of a part: centres of cells that hold the load though no corner does.

    Attributes:
        positions: The centres, shape (n, 3).
        step: Size of a cell on each axis, shape (3,).
    """

    positions: FloatArray
    step: FloatArray

    @property
    def volume(self) -> float:
        """Volume of these cells."""
        return len(self.positions) * float(np.prod(self.step))


def _carve(near: Solid, load: _LoadHere, nodes: int) -> tuple[Solid, _Missed]:
    """Return the positions of a solid that hold a load, by a grid, and what that misses."""
    lows, highs = near.vertices.min(axis=0), near.vertices.max(axis=0)
    grid = make_grid(lows, highs, nodes, BEYOND)
    values = load.values(grid.positions.reshape(-1, 3))[0].reshape(grid.counts)
    highest = values
    for axis in range(3):
        beside = np.moveaxis(highest, axis, 0)
        highest = np.moveaxis(np.maximum(beside[1:], beside[:-1]), 0, axis)
    centres = grid.positions[:-1, :-1, :-1][highest < 0.0] + 0.5 * grid.step
    centres = centres[load.holds(centres)]
    centres = centres[load.allows(centres)]
    # The surface of what is cut out is closed beyond the workspace.
    for axis in range(3):
        np.moveaxis(values, axis, 0)[[0, -1]] = HIGHEST

    def settle(points: FloatArray, beside: FloatArray) -> FloatArray:
        return settle_on_limit(load.held, load.rotation, points, beside, grid.step)

    def part_at(points: FloatArray) -> IntArray:
        return load.values(points)[1]

    surface = Surface(values, grid.lows, grid.step, settle, load.part_names, part_at)
    return carved_solid(near, surface), _Missed(centres, grid.step)


def _best_within(whole: Solid, load: _LoadHere) -> _Best:
    """Return the best position found within the limits.

    Grids about the best nodes of the coarse grid that lie apart follow the largest values, and
    shrink where none is larger.
    """
    grid = _coarse_grid(whole)
    nodes = grid.positions.reshape(-1, 3)
    at = np.vstack([whole.vertices, nodes[load.allows(nodes)]])
    values, parts = load.values(at)
    cube = np.stack(np.meshgrid(*[np.linspace(-1.0, 1.0, FOLLOWING)] * 3), axis=-1).reshape(-1, 3)
    best, left = _Best(at[0], -np.inf, 0), np.argsort(values)[::-1]
    for _ in range(STARTS):
        if not len(left):
            break
        first = int(left[0])
        here = _Best(at[first], float(values[first]), int(parts[first]))
        left = left[(np.abs(at[left] - here.position) > APART * grid.step).any(axis=1)]
        size = 1.0
        for _ in range(ROUNDS):
            near = here.position + size * grid.step * cube
            near = near[load.allows(near)]
            found, of = load.values(near)
            if len(near) and found.max() > here.value:
                index = int(found.argmax())
                here = _Best(near[index], float(found[index]), int(of[index]))
            else:
                size *= 0.5
        best = max(best, here, key=lambda each: each.value)
    return best


def _coarse_grid(whole: Solid) -> Grid:
    return make_grid(whole.vertices.min(axis=0), whole.vertices.max(axis=0), COARSE, 0)
