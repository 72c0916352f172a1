"""The constant-orientation workspace: its exact volume with gradient, and the paper's node count.

The volume is integrated from exact slice areas (`explorer.workspace.slices.integration`). Its error
is that of rounding, which is larger for a thin shell, and is returned with it. The paper counts the
grid nodes at multiples of a step, boundary included, times the cube of the step; such a node volume
exceeds the true volume by an amount that is proportional to the surface.
"""

from __future__ import annotations

import math
from collections.abc import Collection, Sequence
from dataclasses import dataclass
from functools import cache

import numpy as np
from numpy.typing import ArrayLike

from explorer.errors import InputError
from explorer.mechanism.design import Design
from explorer.mechanism.pose import checked_rotation
from explorer.numerics.arrays import FloatArray
from explorer.numerics.checks import positive
from explorer.workspace.limits.constraints import BallOrCylinder, Constraint, HalfSpace, constraints
from explorer.workspace.limits.region import Region, region_of
from explorer.workspace.slices import nodes
from explorer.workspace.slices.integration import (
    AREA_AT_HIGH,
    AREA_AT_LOW,
    MOST_SURFACES,
    RESULTS,
    TOTAL,
    TOTAL_ERROR,
    integrate_slices,
)

# Gauss-Legendre nodes per piece; with fewer nodes more pieces have to be halved.
NODES = 20
# Columns per axis for workspaces with cones, whose slices are not bounded by circles.
COLUMNS = 400
# Columns per axis that are enough to decide whether there is a volume.
COARSE_COLUMNS = 80
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


def home_rotation(design: Design) -> FloatArray:
    """Return the orientation of a design's constant-orientation workspace, shape (3, 3)."""
    return design.home_pose.rotation


def workspace_volume(
    design: Design, rotation: ArrayLike | None = None, *, explain: bool = True
) -> Volume:
    """Return the exact volume of the constant-orientation workspace, and its gradient.

    Args:
        design: The manipulator.
        rotation: Platform to base, shape (3, 3); that of the home pose if None.
        explain: Whether to find the limits that empty an empty workspace, which takes longer.

    Raises:
        InputError: Not a rotation.
    """
    r = home_rotation(design) if rotation is None else checked_rotation(rotation)
    limits = constraints(design, r)
    region = region_of(limits)
    if len(region.cones):
        volume, error, gradient = *_volume_of_columns(region), {}
    else:
        volume, error, gradient = _volume_of_slices(region)
    because = find_emptying_limits(limits) if explain and volume <= 0.0 else ()
    return Volume(max(0.0, volume), error, gradient, because)


def volume_within(region: Region, columns: int = COLUMNS) -> tuple[float, float]:
    """Return the volume of a region and its error; with cones, of a number of columns per axis."""
    if len(region.cones):
        return _volume_of_columns(region, columns)
    volume, error, _ = _volume_of_slices(region)
    return max(0.0, volume), error


def workspace_nodes(
    design: Design, rotation: ArrayLike | None = None, step: float | None = None
) -> NodeCount:
    """Return the node count of the constant-orientation workspace.

    The rotation is that of the home pose if None, and the step that of `node_step_of`.

    Raises:
        InputError: Not a rotation, a step that is not positive, or a grid of too many nodes.
    """
    r = home_rotation(design) if rotation is None else checked_rotation(rotation)
    width = node_step_of(design, step)
    region = region_of(constraints(design, r))
    empty = NodeCount(width, 0, 0.0, None)
    first, number = node_range(region, width)
    check_node_count(number, width, MOST_NODES)
    within = np.zeros(number.astype(np.int64), dtype=np.bool_)
    slack, steps = design.tolerance, np.full(3, width)
    nodes.mark_nodes(within.size, *region.rows, first * width, steps, slack, within)
    # Planes across x are no rows of the region.
    x = (first[0] + np.arange(len(within))) * width
    within[(x < region.low - slack) | (x > region.high + slack)] = False
    count = int(np.count_nonzero(within))
    if not count:
        return empty
    others = ((1, 2), (0, 2), (0, 1))
    taken = [np.flatnonzero(within.any(axis=other)) for other in others]
    low_x, low_y, low_z = (
        float((start + index[0]) * width) for start, index in zip(first, taken, strict=True)
    )
    high_x, high_y, high_z = (
        float((start + index[-1]) * width) for start, index in zip(first, taken, strict=True)
    )
    extent = (low_x, low_y, low_z), (high_x, high_y, high_z)
    return NodeCount(width, count, count * width**3, extent)


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


@cache
def quadrature() -> FloatArray:
    """Return the quadrature as `integrate_slices` takes it, shape (10, NODES)."""
    abscissae, weights = np.polynomial.legendre.leggauss(NODES)
    # The middle node comes first: a piece that is empty there is empty everywhere.
    order = np.argsort(np.abs(abscissae), kind="stable")
    abscissae, weights = abscissae[order], weights[order]
    degrees = np.arange(NODES - 8, NODES)
    values = (2.0 * degrees + 1.0) * np.polynomial.legendre.legvander(abscissae, NODES - 1)[:, -8:]
    return np.stack([0.5 * (abscissae + 1.0), 0.5 * weights, *values.T])


def _volume_of_slices(region: Region) -> tuple[float, float, dict[str, float]]:
    if region.box is None:
        return 0.0, 0.0, {}
    surfaces = (*region.circle_limits, *region.plane_limits)
    if len(surfaces) > MOST_SURFACES:
        raise InputError(
            f"a volume takes at most {MOST_SURFACES} surfaces; the region has {len(surfaces)}"
        )
    result, rates = np.zeros(RESULTS), np.zeros((len(surfaces), 4))
    ends = region.low, region.high
    integrate_slices(1, region.circles, region.planes, *ends, quadrature(), result, rates)
    gradient: dict[str, float] = {}
    surface_rates: list[tuple[BallOrCylinder | HalfSpace, FloatArray]] = [
        *zip(surfaces, rates, strict=True)
    ]
    # An end that moves by dx sweeps the area of its slice; its normal is along x.
    for end, area in (
        (region.low_limit, result[AREA_AT_LOW]),
        (region.high_limit, result[AREA_AT_HIGH]),
    ):
        if end is not None:
            surface_rates.append((end, np.array([0.0, 0.0, 0.0, area / abs(float(end.normal[0]))])))
    for limit, volume_rate in surface_rates:
        for name, rate in limit.rates.items():
            gradient[name] = gradient.get(name, 0.0) + float(volume_rate @ rate)
    return float(result[TOTAL]), float(result[TOTAL_ERROR]), gradient


def _volume_of_columns(region: Region, columns: int = COLUMNS) -> tuple[float, float]:
    box = region.box
    if box is None:
        return 0.0, 0.0
    lows, highs = box
    volumes: list[float] = []
    for per_axis in (columns // 2, columns):
        total = np.zeros(1)
        nodes.column_lengths(per_axis * per_axis, *region.rows, lows, highs, per_axis, total)
        cell = (highs[0] - lows[0]) * (highs[1] - lows[1]) / (per_axis * per_axis)
        volumes.append(float(total[0]) * float(cell))
    return volumes[1], abs(volumes[1] - volumes[0])


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
        return volume_within(region_of(rest), COARSE_COLUMNS)[0] <= 0.0

    sufficient = tuple(name for name in names if not is_empty({*names} - {name}))
    if sufficient:
        return sufficient
    needed = {*names}
    for name in names:
        if is_empty(needed - {name}):
            needed.remove(name)
    return tuple(name for name in names if name in needed)
