"""The constant-orientation workspace: its exact volume with gradient, and the paper's node count.

The volume is integrated from exact slice areas (`explorer.workspace.slices.integration`). Its error
is that of rounding, which is larger for a thin shell, and is returned with it. Within the cones of
swings the volume is integrated over columns, good to `COLUMN_ERROR`. The paper counts the grid
nodes at multiples of a step, boundary included, times the cube of the step; such a node volume
exceeds the true volume by an amount that is proportional to the surface.
"""

from __future__ import annotations

import math
from collections.abc import Collection, Sequence
from dataclasses import dataclass, replace

import numpy as np
from numpy.typing import ArrayLike

from explorer.errors import InputError
from explorer.mechanism.design import Design
from explorer.numerics.arrays import FloatArray
from explorer.numerics.checks import positive
from explorer.numerics.computed_once import computed_once
from explorer.workspace.limits.constraints import BallOrCylinder, Constraint
from explorer.workspace.limits.region import Region, mark_nodes, region_of
from explorer.workspace.slices.integration import volume_of_slices
from explorer.workspace.workspace import Workspace

COLUMN_ERROR = 1e-4
"""Largest error of the volume within cones, whose slices are not bounded by circles, over it."""
# Such an error with which it is decided whether there is a volume.
COARSE_ERROR = 0.1
# The radius of a ball around all limits, over the largest distance of a limit from the origin.
SURROUNDINGS = 4.0
# The most nodes that are counted.
MOST_NODES = 50_000_000
# The default step of the grid is the reach over this.
STEPS_IN_REACH = 15.0


@dataclass(frozen=True)
class Volume:
    """The volume of a workspace, in cubed design units.

    Attributes:
        volume: Volume, exact to `error`.
        error: Estimate of the absolute error of quadrature and rounding. It is that of rounding
            alone unless cones bound the workspace.
        gradient: Derivatives by parameter: the design variables, "yaw" (radians), and the limits
            that bound the workspace, such as "l1 maximum". Empty if cones bound it.
        empty_because: Names of the limits that empty the workspace, see `find_emptying_limits`; ()
            if it is not empty.
    """

    volume: float
    error: float
    gradient: dict[str, float]
    empty_because: tuple[str, ...]


@dataclass(frozen=True)
class NodeCount:
    """The paper's measure of a workspace.

    Attributes:
        step: Step of the grid, in design units.
        count: Number of nodes in the workspace.
        volume: Count times step³, in cubed design units.
        extent: (lows, highs) of the counted nodes, None if none is counted.
    """

    step: float
    count: int
    volume: float
    extent: tuple[tuple[float, float, float], tuple[float, float, float]] | None


def workspace_volume(design: Design, rotation: ArrayLike | None = None) -> Volume:
    """Return the volume of the constant-orientation workspace, and its gradient.

    It is exact to rounding unless cones of swings bound it, see `Volume.error`. The rotation is
    from platform to base, shape (3, 3); that of the home pose if None.

    Raises:
        InputError: Not a rotation.
    """
    return volume_of(Workspace(design, rotation))


@computed_once
def volume_of(workspace: Workspace) -> Volume:
    """Return the volume of a workspace, its gradient, and the limits that empty an empty one."""
    plain = unexplained_volume(workspace)
    if plain.volume > 0.0:
        return plain
    return replace(plain, empty_because=find_emptying_limits(workspace.limits))


@computed_once
def unexplained_volume(workspace: Workspace) -> Volume:
    """Return the volume of a workspace, without the limits that empty an empty one."""
    return Volume(*region_volume(workspace.region), ())


def region_volume(
    region: Region, column_error: float = COLUMN_ERROR
) -> tuple[float, float, dict[str, float]]:
    """Return the volume of a region, its error, and its derivatives by parameter.

    With cones it is that of columns, to an error over the volume, without derivatives.
    """
    if not len(region.cones):
        volume, error, gradient = volume_of_slices(region)
        return max(0.0, volume), error, gradient
    # Few designs have cones, and columns load a kernel.
    from explorer.workspace.slices.column_volume import volume_of_columns

    found = volume_of_columns(region, column_error)
    return found.volume, found.error, {}


@computed_once
def node_count_of(workspace: Workspace, step: float | None = None) -> NodeCount:
    """Return the node count of a workspace, with the step of `node_step_of`.

    Raises:
        InputError: A step that is not positive, or a grid of too many nodes.
    """
    design, region = workspace.design, workspace.region
    width = node_step_of(design, step)
    first, number = node_range(region, width)
    check_node_count(number, width, MOST_NODES)
    within = np.zeros(number.astype(np.int64), dtype=np.bool_)
    slack, steps = design.tolerance, np.full(3, width)
    mark_nodes(within.size, *region.rows, first * width, steps, slack, within)
    # Planes across x are no rows of the region.
    x = (first[0] + np.arange(len(within))) * width
    within[(x < region.low - slack) | (x > region.high + slack)] = False
    count = int(np.count_nonzero(within))
    if not count:
        return NodeCount(width, 0, 0.0, None)
    taken = [
        start + np.flatnonzero(within.any(axis=others))[[0, -1]]
        for start, others in zip(first, ((1, 2), (0, 2), (0, 1)), strict=True)
    ]
    lows, highs = (width * np.array(taken)).T.tolist()
    return NodeCount(width, count, count * width**3, (tuple(lows), tuple(highs)))


def node_step_of(design: Design, step: float | None = None) -> float:
    """Return the step of the paper's grid, a positive one: given, the design's, or reach / 15."""
    if step is None:
        return design.node_step or design.reach / STEPS_IN_REACH
    return positive("the node step", step)


def node_range(region: Region, step: float) -> tuple[FloatArray, FloatArray]:
    """Return the index of the first node and the number of nodes around a region, each (3,)."""
    lows, highs = region.ends
    # Nodes on a boundary count, so the grid must not lose one to rounding.
    first = np.ceil(lows / step - 1e-9)
    return first, np.maximum(0.0, np.floor(highs / step + 1e-9) - first + 1.0)


def check_node_count(counts: FloatArray, step: float, most: int) -> None:
    """Raise an `InputError` if a grid, given by its nodes per axis (3,), has more than `most`."""
    count = float(np.prod(counts))
    if count > most:
        coarsest = step * (count / most) ** (1.0 / 3.0)
        raise InputError(
            f"a node step of {step:g} makes {count:.3g} nodes; at most {most:,} are counted, "
            f"which takes a step of about {coarsest:.2g} or more"
        )


def find_emptying_limits(limits: Sequence[Constraint]) -> tuple[str, ...]:
    """Return the names of the limits that empty an empty workspace.

    Each of them is such that the workspace without it would not be empty. If there is no such
    limit, they are a set that empties the workspace together, of which none can be left out.
    """
    names = tuple(dict.fromkeys(limit.name for limit in limits))
    # A region must be bounded; this ball is far around all limits.
    sizes = [float(limit.distance(np.zeros(3))) for limit in limits]
    sizes += [2.0 * limit.radius for limit in limits if isinstance(limit, BallOrCylinder)]
    radius = SURROUNDINGS * max(size for size in sizes if size < math.inf)
    surroundings = BallOrCylinder("", np.zeros(3), radius, is_ball=True, inside=True)

    def is_empty(chosen: Collection[str]) -> bool:
        rest = [*(limit for limit in limits if limit.name in chosen), surroundings]
        return region_volume(region_of(rest), COARSE_ERROR)[0] <= 0.0

    sufficient = tuple(name for name in names if not is_empty({*names} - {name}))
    if sufficient:
        return sufficient
    needed = {*names}
    for name in names:
        if is_empty(needed - {name}):
            needed.remove(name)
    return tuple(name for name in names if name in needed)
