"""The constant-orientation workspace: exact volume, its gradient, and the paper's nodes.

The volume is integrated from exact slice areas (`explorer.workspace.slices.integration`) and good
to
rounding, which a thin shell magnifies: its error stands beside it. Node counting is how the
paper measured: grid nodes at multiples of a step, boundary included, times the cube of the
step; it overstates a volume by its surface.
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
from explorer.mechanism.home import home_pose
from explorer.mechanism.pose import checked_rotation
from explorer.numerics.arrays import FloatArray
from explorer.workspace.limits.constraints import (
    Cone,
    Constraint,
    HalfSpace,
    Never,
    Round,
    constraints,
)
from explorer.workspace.limits.region import Region, region_of
from explorer.workspace.slices.integration import integrate_slices
from explorer.workspace.slices.nodes import column_lengths, count_nodes

# Gauss-Legendre nodes a piece: with fewer, more pieces have to be halved.
NODES = 20
# Columns an axis for workspaces with cones, whose slices are no circles.
COLUMNS = 400
# As many are enough to see that there is a volume.
COARSE_COLUMNS = 80
# Radius of a ball around all limits, as a multiple of the farthest of them.
SURROUNDINGS = 4.0
# The most nodes that are counted.
MOST_NODES = 50_000_000
# A grid has its nodes at multiples of reach / 15 unless the design says otherwise.
STEPS_IN_REACH = 15.0


@dataclass(frozen=True)
class Volume:
    """The volume of a workspace, in cubed design units.

    Attributes:
        volume: Exact to `error`, which is that of rounding unless cones bound it.
        error: An estimate of the absolute error: what the quadrature misses, and what the
            rounding of lengths comes to in a volume that is small beside its surface.
        gradient: Derivatives by parameter: the design variables, "yaw" (radians), and
            the limits that bound it, such as "l1 maximum". Empty where cones bound it.
        empty_because: The limits that empty it, see `what_empties`; () if it is not empty.
    """

    volume: float
    error: float
    gradient: dict[str, float]
    empty_because: tuple[str, ...]


@dataclass(frozen=True)
class NodeCount:
    """The paper's measure of a workspace.

    Attributes:
        step: Of the grid, in design units.
        count: How many nodes lie within.
        volume: Their number times step³, in cubed design units.
        extent: (lows, highs) of the counted nodes, None if there is none.
    """

    step: float
    count: int
    volume: float
    extent: tuple[tuple[float, float, float], tuple[float, float, float]] | None


def home_rotation(design: Design) -> FloatArray:
    """Return the orientation of a design's constant-orientation workspace, shape (3, 3)."""
    return home_pose(design).rotation


def workspace_volume(
    design: Design, rotation: ArrayLike | None = None, *, explain: bool = True
) -> Volume:
    """Return the exact volume of the constant-orientation workspace, and its gradient.

    Args:
        design: The manipulator.
        rotation: Platform to base, shape (3, 3); that of the home pose if None.
        explain: Whether to find out what empties an empty workspace, which takes longer.

    Raises:
        InputError: not a rotation.
    """
    r = home_rotation(design) if rotation is None else checked_rotation(rotation)
    limits = constraints(design, r)
    region = region_of(limits)
    if len(region.cones):
        volume, error, gradient = *_volume_of_columns(region), {}
    else:
        volume, error, gradient = _volume_of_slices(region)
    because = what_empties(limits) if explain and volume <= 0.0 else ()
    return Volume(max(0.0, volume), error, gradient, because)


def volume_within(region: Region, columns: int = COLUMNS) -> tuple[float, float]:
    """Return the volume of a region and its error, as of `Volume`.

    Args:
        region: The intersection of limits.
        columns: An axis, for regions with cones.
    """
    if len(region.cones):
        return _volume_of_columns(region, columns)
    volume, error, _ = _volume_of_slices(region)
    return max(0.0, volume), error


def workspace_nodes(
    design: Design, rotation: ArrayLike | None = None, step: float | None = None
) -> NodeCount:
    """Return the node count of the constant-orientation workspace.

    Args:
        design: The manipulator.
        rotation: Platform to base, shape (3, 3); that of the home pose if None.
        step: Of the grid, in design units; that of the design, else reach / 15, if None.

    Raises:
        InputError: not a rotation, a step that is not positive, or too fine a grid.
    """
    r = home_rotation(design) if rotation is None else checked_rotation(rotation)
    width = node_step_of(design, step)
    region = region_of(constraints(design, r))
    empty = NodeCount(width, 0, 0.0, None)
    first, many = node_range(region, width)
    check_node_count(many, width, MOST_NODES)
    counts = many.astype(np.int64)
    if not counts.all():
        return empty
    found = np.zeros(7, dtype=np.int64)
    slack = design.tolerance
    ends = np.array([region.low - slack, region.high + slack])
    count_nodes(
        int(counts.prod()),
        region.rounds,
        region.planes,
        region.cones,
        ends,
        slack,
        first,
        counts,
        width,
        found,
    )
    if found[0] == 0:
        return empty
    low_x, low_y, low_z, high_x, high_y, high_z = (found[1:] * width).tolist()
    return NodeCount(
        width,
        int(found[0]),
        int(found[0]) * width**3,
        ((low_x, low_y, low_z), (high_x, high_y, high_z)),
    )


def node_step_of(design: Design, step: float | None = None) -> float:
    """Return the step of the paper's grid: as asked, or the design's, or reach / 15.

    Raises:
        InputError: it is not positive.
    """
    width = step if step is not None else design.node_step or design.reach / STEPS_IN_REACH
    if not (math.isfinite(width) and width > 0.0):
        raise InputError(f"the node step must be positive; got {width:g}")
    return width


def node_range(region: Region, step: float) -> tuple[FloatArray, FloatArray]:
    """Return the first index and the number of the nodes around a region, each (3,)."""
    lows, highs = _around(region)
    # Nodes on a boundary count, so the grid may not lose one to rounding.
    # A tiny step leads beyond all numbers; such a count is refused.
    with np.errstate(over="ignore", invalid="ignore"):
        first = np.ceil(lows / step - 1e-9)
        return first, np.maximum(0.0, np.floor(highs / step + 1e-9) - first + 1.0)


def check_node_count(many: FloatArray, step: float, most: int) -> None:
    """Raise an `InputError` if a grid with so many nodes an axis has too many."""
    with np.errstate(over="ignore"):
        count = float(np.prod(many))
    if not math.isfinite(count):
        raise InputError(f"a node step of {step:g} is too small for any grid; leave it out")
    if count > most:
        coarsest = step * (count / most) ** (1.0 / 3.0)
        raise InputError(
            f"a node step of {step:g} makes {count:.3g} nodes; at most {most:,} are counted, "
            f"so from about {coarsest:.2g} on"
        )


def bounds(region: Region) -> tuple[FloatArray, FloatArray]:
    """Return (lows, highs) of a box that holds a region, each (3,); not the tightest one.

    Of a region without volume some low may be above its high.
    """
    lows, highs = _around(region)
    return (lows, np.full(3, -math.inf)) if region.is_flat else (lows, highs)


def _around(region: Region) -> tuple[FloatArray, FloatArray]:
    """Return (lows, highs) of a box that holds a region, even if that is a mere surface."""
    lows = np.array([region.low, -math.inf, -math.inf])
    highs = np.array([region.high, math.inf, math.inf])
    for x, y, z, radius, is_ball, side in region.rounds:
        if side > 0.0:
            start = 0 if is_ball else 1
            centre = np.array([x, y, z])
            lows[start:] = np.maximum(lows[start:], centre[start:] - radius)
            highs[start:] = np.minimum(highs[start:], centre[start:] + radius)
    for row in region.planes:
        for axis in (1, 2):
            if row[0] == 0.0 and row[3 - axis] == 0.0:
                end = float(row[3] / row[axis])
                if row[axis] > 0.0:
                    highs[axis] = min(float(highs[axis]), end)
                else:
                    lows[axis] = max(float(lows[axis]), end)
    return lows, highs


@cache
def quadrature() -> FloatArray:
    """Return the quadrature as `integrate_slices` takes it, shape (10, NODES)."""
    nodes, weights = np.polynomial.legendre.leggauss(NODES)
    # The middle first: a piece that is empty there is empty everywhere.
    order = np.argsort(np.abs(nodes), kind="stable")
    nodes, weights = nodes[order], weights[order]
    degrees = np.arange(NODES - 8, NODES)
    values = (2.0 * degrees + 1.0) * np.polynomial.legendre.legvander(nodes, NODES - 1)[:, -8:]
    return np.stack([0.5 * (nodes + 1.0), 0.5 * weights, *values.T])


def _volume_of_slices(region: Region) -> tuple[float, float, dict[str, float]]:
    lows, highs = bounds(region)
    if region.is_empty or not (lows < highs).all():
        return 0.0, 0.0, {}
    result = np.zeros(6)
    by_round, by_plane = np.zeros((len(region.rounds), 4)), np.zeros((len(region.planes), 4))
    integrate_slices(
        1,
        region.rounds,
        region.planes,
        region.low,
        region.high,
        quadrature(),
        result,
        by_round,
        by_plane,
    )
    gradient: dict[str, float] = {}
    moving: list[tuple[Round | HalfSpace, FloatArray]] = [
        *zip(region.of_rounds, by_round, strict=True),
        *zip(region.of_planes, by_plane, strict=True),
    ]
    # An end that moves by dx sweeps the area of its slice; a normal here is (±1, 0, 0).
    for end, area in ((region.of_low, result[1]), (region.of_high, result[2])):
        if end is not None:
            moving.append((end, np.array([0.0, 0.0, 0.0, area / abs(float(end.normal[0]))])))
    for limit, derivative in moving:
        for name, rate in limit.rates.items():
            gradient[name] = gradient.get(name, 0.0) + float(derivative @ rate)
    return float(result[0]), float(result[5]), gradient


def _volume_of_columns(region: Region, columns: int = COLUMNS) -> tuple[float, float]:
    if region.is_empty:
        return 0.0, 0.0
    lows, highs = bounds(region)
    if not (lows < highs).all():
        return 0.0, 0.0
    volumes: list[float] = []
    for many in (columns // 2, columns):
        total = np.zeros(1)
        column_lengths(
            many * many, region.rounds, region.planes, region.cones, lows, highs, many, total
        )
        cell = (highs[0] - lows[0]) * (highs[1] - lows[1]) / (many * many)
        volumes.append(float(total[0]) * float(cell))
    return volumes[1], abs(volumes[1] - volumes[0])


def what_empties(limits: Sequence[Constraint]) -> tuple[str, ...]:
    """Return the limits that empty a workspace that is empty.

    Those without any one of which something would be left, or if there is none, limits
    that leave nothing together but of which each is needed for that.
    """
    names = tuple(dict.fromkeys(limit.name for limit in limits))
    around = _surroundings(limits)

    def is_empty(left: Collection[str]) -> bool:
        return not _has_volume([*(limit for limit in limits if limit.name in left), around])

    alone = tuple(name for name in names if not is_empty({*names} - {name}))
    if alone:
        return alone
    needed = {*names}
    for name in names:
        if is_empty(needed - {name}):
            needed.remove(name)
    return tuple(name for name in names if name in needed)


def _has_volume(limits: Sequence[Constraint]) -> bool:
    return volume_within(region_of(limits), COARSE_COLUMNS)[0] > 0.0


def _surroundings(limits: Sequence[Constraint]) -> Round:
    """Return a ball far around all limits, since a region has to have an end."""
    sizes = [1e-300]
    for limit in limits:
        match limit:
            case Round():
                sizes.append(limit.radius + float(np.abs(limit.centre).max()))
            case HalfSpace():
                sizes.append(abs(limit.offset) / float(np.linalg.norm(limit.normal)))
            case Cone():
                sizes.append(float(np.abs(limit.apex).max()))
            case Never():
                pass
    return Round("", np.zeros(3), SURROUNDINGS * max(sizes), is_ball=True, inside=True)
