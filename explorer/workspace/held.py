"""The part of a workspace where a load is held within the limits of the machine, as a solid.

Its new faces lie on the surface where one part takes its limit. A grid of positions finds them,
and each of their vertices is moved onto the true surface, so that only the flatness of the faces
between vertices is approximate.
"""

from __future__ import annotations

from dataclasses import dataclass, replace

import msgspec
import numpy as np
from numpy.typing import ArrayLike

from explorer.errors import InputError
from explorer.mechanism.design import JOINTS, Design
from explorer.mechanism.pose import checked_rotation
from explorer.numerics.arrays import FloatArray, IntArray, finite_array
from explorer.statics.held import HIGHEST, held_load, held_values, settle_on_limit
from explorer.workspace.accessible.nodes import make_grid
from explorer.workspace.limits.constraints import HalfSpace
from explorer.workspace.slices.volume import home_rotation, workspace_volume
from explorer.workspace.solids.solid import Solid
from explorer.workspace.solids.solids import Surface, carved_solid, cut_solid, workspace_solid

# Numbers of nodes on each axis of the workspace's extent, and beyond it on either side.
DEFAULT_NODES = 28
FEWEST_NODES, MOST_NODES = 8, 160
BEYOND = 2
# Nodes on each axis of the grid that finds the box of the part.
COARSE = 20
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
    """

    volume: float
    held_volume: float
    solid: Solid


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
    near, best = _part_near(whole, held, r)
    if near.is_empty:
        return HeldWorkspace(exact.volume, 0.0, replace(near, empty_because=(best,)))
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
    solid = carved_solid(near, surface)
    if solid.is_empty:
        return HeldWorkspace(exact.volume, 0.0, replace(solid, empty_because=(best,)))
    # The mesh of the whole lacks a share of the exact volume, and so does its part.
    return HeldWorkspace(exact.volume, solid.volume * exact.volume / whole.volume, solid)


def _part_near(whole: Solid, held: FloatArray, r: FloatArray) -> tuple[Solid, str]:
    """Return the part of a workspace near the nodes of a coarse grid that hold the load.

    It is a box that extends beyond them by a step, empty if there are none. The second value is
    the name of the part of the machine with the largest share where that is least.
    """
    grid = make_grid(whole.vertices.min(axis=0), whole.vertices.max(axis=0), COARSE, 0)
    positions = np.vstack([grid.positions.reshape(-1, 3), whole.vertices])
    values, parts = held_values(held, r, positions)
    best = PART_NAMES[int(parts[values.argmax()])]
    kept = positions[values >= 0.0]
    if not len(kept):
        return replace(whole, vertices=kept, faces=whole.faces[:0]), best
    lows, highs = kept.min(axis=0) - grid.step, kept.max(axis=0) + grid.step
    for axis, unit in enumerate(np.eye(3)):
        whole = cut_solid(whole, HalfSpace(NEAR, unit, float(highs[axis])))
        whole = cut_solid(whole, HalfSpace(NEAR, -unit, -float(lows[axis])))
    return whole, best
