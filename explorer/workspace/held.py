"""The part of a workspace where a load is held within the limits of the machine, as a solid.

Its new faces lie on the surface where one part takes its limit. A grid of positions finds them,
and each of their vertices is moved onto the true surface, so that only the flatness of the faces
between vertices is approximate.
"""

from __future__ import annotations

from dataclasses import dataclass, replace
from typing import NamedTuple

import msgspec
import numpy as np
from numpy.typing import ArrayLike

from explorer.errors import InputError
from explorer.mechanism.design import JOINTS, Design
from explorer.mechanism.pose import checked_rotation
from explorer.numerics.arrays import FloatArray, IntArray, finite_array
from explorer.statics.held import HIGHEST, held_load, held_values, settle_on_limit
from explorer.workspace.accessible.nodes import Grid, make_grid
from explorer.workspace.limits.constraints import Constraint, HalfSpace, constraints, slacks
from explorer.workspace.slices.volume import home_rotation, workspace_volume
from explorer.workspace.solids.solid import Solid
from explorer.workspace.solids.solids import Surface, carved_solid, cut_solid, workspace_solid

# Numbers of nodes on each axis of the workspace's extent, and beyond it on either side.
DEFAULT_NODES = 28
FEWEST_NODES, MOST_NODES = 8, 160
BEYOND = 2
# Nodes on each axis of the grid that finds the box of the part.
COARSE = 20
# To find the best position: numbers of starts, of steps of that grid between them, of nodes on each
# axis of the grids about one, and of these grids.
STARTS, APART, FOLLOWING, ROUNDS = 12, 2.5, 5, 30
NEAR = "near the load's limit"

PART_NAMES = (
    *(f"force of {joint}" for joint in JOINTS),
    *("bending of strut 2", "bending of strut 3"),
    *("force of carriage 2 on the guide", "force of carriage 3 on the guide"),
)
"""Names of the faces at which a part takes its limit."""


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
    the legs count as weightless. Parts that are smaller on all axes than a 20th of the workspace's
    extents may be missed.

    Args:
        design: The manipulator, with its payload and its limits.
        rotation: Platform to base, shape (3, 3); that of the home pose if None.
        load: (F; M) on the platform at the tool point, base axes, shape (6,), in N and N × unit.
        nodes: Number of nodes of the grid on each axis of the workspace's extent.
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
    held = held_load(design, r, w)
    limits = constraints(design, r)
    near = _part_near(whole, held, r, limits)
    solid = near if near.is_empty else _carve(near, held, r, nodes)
    if solid.is_empty:
        best = _best_within(whole, held, r, limits)
        factor = max(0.0, 1.0 + best.value)
        return HeldWorkspace(
            exact.volume, 0.0, replace(solid, empty_because=(best.part,)), best.position, factor
        )
    # The mesh of the whole lacks a share of the exact volume, and so does its part.
    return HeldWorkspace(exact.volume, solid.volume * exact.volume / whole.volume, solid)


class _Best(NamedTuple):
    """The position where the largest share of a limit is least, of those that were tried.

    Attributes:
        position: b4 in the base frame, shape (3,).
        value: Value there of the function of `explorer.statics.held`.
        part: Name of the part of the machine with that share.
    """

    position: FloatArray
    value: float
    part: str


def _carve(near: Solid, held: FloatArray, r: FloatArray, nodes: int) -> Solid:
    """Return the positions of a solid that hold a load, by a grid of nodes on each axis."""
    lows, highs = near.vertices.min(axis=0), near.vertices.max(axis=0)
    grid = make_grid(lows, highs, nodes, BEYOND)
    values = held_values(held, r, grid.positions.reshape(-1, 3))[0].reshape(grid.counts)
    # The surface of what is cut out is closed beyond the workspace.
    for axis in range(3):
        np.moveaxis(values, axis, 0)[[0, -1]] = HIGHEST

    def settle(points: FloatArray, beside: FloatArray) -> FloatArray:
        return settle_on_limit(held, r, points, beside, grid.step)

    def part_at(points: FloatArray) -> IntArray:
        return held_values(held, r, points)[1]

    surface = Surface(values, grid.lows, grid.step, settle, PART_NAMES, part_at)
    return carved_solid(near, surface)


def _part_near(
    whole: Solid, held: FloatArray, r: FloatArray, limits: tuple[Constraint, ...]
) -> Solid:
    """Return the part of a workspace near the nodes of a coarse grid that hold the load.

    It is a box that extends beyond them by a step. If no node holds the load, the best position
    within the limits counts; the part is empty if that does not hold it either.
    """
    grid = _coarse_grid(whole)
    positions = np.vstack([grid.positions.reshape(-1, 3), whole.vertices])
    kept = positions[held_values(held, r, positions)[0] >= 0.0]
    if not len(kept):
        best = _best_within(whole, held, r, limits)
        if best.value < 0.0:
            return replace(whole, vertices=kept, faces=whole.faces[:0])
        kept = best.position[None]
    lows, highs = kept.min(axis=0) - grid.step, kept.max(axis=0) + grid.step
    for axis, unit in enumerate(np.eye(3)):
        whole = cut_solid(whole, HalfSpace(NEAR, unit, float(highs[axis])))
        whole = cut_solid(whole, HalfSpace(NEAR, -unit, -float(lows[axis])))
    return whole


def _best_within(
    whole: Solid, held: FloatArray, r: FloatArray, limits: tuple[Constraint, ...]
) -> _Best:
    """Return the best position found within the limits.

    Grids about the best nodes of the coarse grid that lie apart follow the largest values, and
    shrink where none is larger.
    """
    grid = _coarse_grid(whole)
    nodes = grid.positions.reshape(-1, 3)
    at = np.vstack([whole.vertices, nodes[(slacks(limits, nodes) >= 0.0).all(axis=-1)]])
    values, parts = held_values(held, r, at)
    cube = np.stack(np.meshgrid(*[np.linspace(-1.0, 1.0, FOLLOWING)] * 3), axis=-1).reshape(-1, 3)
    best, left = _Best(at[0], -np.inf, PART_NAMES[0]), np.argsort(values)[::-1]
    for _ in range(STARTS):
        if not len(left):
            break
        first = int(left[0])
        here = _Best(at[first], float(values[first]), PART_NAMES[int(parts[first])])
        left = left[(np.abs(at[left] - here.position) > APART * grid.step).any(axis=1)]
        size = 1.0
        for _ in range(ROUNDS):
            near = here.position + size * grid.step * cube
            near = near[(slacks(limits, near) >= 0.0).all(axis=-1)]
            found, of = held_values(held, r, near)
            if len(near) and found.max() > here.value:
                index = int(found.argmax())
                here = _Best(near[index], float(found[index]), PART_NAMES[int(of[index])])
            else:
                size *= 0.5
        best = max(best, here, key=lambda each: each.value)
    return best


def _coarse_grid(whole: Solid) -> Grid:
    return make_grid(whole.vertices.min(axis=0), whole.vertices.max(axis=0), COARSE, 0)
