"""Measures of a workspace at the nodes of a grid: its extent, margins and clearances.

The nodes are the centres of the cells of a box about the constant-orientation workspace, so
that none lies on its surface. A least value at the nodes is an upper bound of the least value
in the workspace; `explorer.least_clearances` certifies a lower bound too.
"""

from __future__ import annotations

import math
from dataclasses import dataclass

import numpy as np
from numpy.typing import ArrayLike

from explorer.errors import InputError
from explorer.legs.clearance import PAIRS, joined_pairs, radii_of_pairs
from explorer.legs.segments import closest_shares, square_at
from explorer.mechanism.design import Design
from explorer.mechanism.margins import margins_at
from explorer.mechanism.pose import checked_rotation
from explorer.numerics.arrays import BoolArray, FloatArray
from explorer.numerics.compiled import kernel
from explorer.numerics.vectors import minus, vector
from explorer.workspace.limits.constraints import constraints
from explorer.workspace.limits.quantities import RADII, write_ends
from explorer.workspace.limits.region import region_of
from explorer.workspace.slices.nodes import is_within
from explorer.workspace.slices.volume import home_rotation

# Number of nodes on each axis: default, least and largest.
DEFAULT_NODES = 20
FEWEST_NODES, MOST_NODES = 2, 200

# Indices of the results of `measure_nodes`, and their number.
COUNT, LOWS, HIGHS, LEAST = 0, 1, 4, 7
MEAN, OFF_PLANES, CLEAR, DISTANCES, RESULTS = 10, 11, 12, 13, 19


@dataclass(frozen=True)
class NodeMeasures:
    """Measures of a workspace at the nodes of a grid, in design units.

    Without any nodes, lengths are NaN and clearances infinite.

    Attributes:
        positions: Nodes within the limits, shape (n, 3).
        extent: Distance between the lowest and the highest of them on each axis, shape (3,).
        margins: Least |δ1|, |δ2|, |δ3| at the nodes, shape (3,).
        mean_margin: Mean over the nodes of the smallest of |δ1|, |δ2|, |δ3|.
        clearances: Least clearances at the nodes with every |δ| at least `clearance_margin`,
            shape (6,), in the order of `PAIRS`; inf for a pair that shares a joint.
        clear_share: Share of the nodes at which no legs collide; NaN without any nodes.
    """

    positions: FloatArray
    extent: FloatArray
    margins: FloatArray
    mean_margin: float
    clearances: FloatArray
    clear_share: float


def node_measures(
    design: Design,
    rotation: ArrayLike | None = None,
    *,
    nodes: int = DEFAULT_NODES,
    clearance_margin: float = 0.0,
) -> NodeMeasures:
    """Measure the constant-orientation workspace at the nodes of a grid.

    Args:
        design: The manipulator; the radii of the legs are those of its limits.
        rotation: Rotation from platform to base, shape (3, 3); that of the home pose if None.
        nodes: Number of nodes on each axis of a box about the workspace.
        clearance_margin: Least |δ|, in design units, of nodes at which clearances count;
            nearer to a singularity legs may have to meet.

    Raises:
        InputError: not a rotation, or too few or too many nodes.
    """
    if not FEWEST_NODES <= nodes <= MOST_NODES:
        raise InputError(
            f"the nodes on an axis must be from {FEWEST_NODES} to {MOST_NODES}; got {nodes}"
        )
    r = home_rotation(design) if rotation is None else checked_rotation(rotation)
    region = region_of(constraints(design, r))
    box = region.box
    lows, highs = box or (np.zeros(3), np.zeros(3))
    results, within = np.zeros(RESULTS), np.zeros((nodes, nodes, nodes), dtype=np.bool_)
    step = (highs - lows) / nodes
    if box is not None:
        row = np.zeros(RADII)
        row[:] = design.variables
        radii = np.where(joined_pairs(design), -math.inf, radii_of_pairs(design))
        grid, pose = (lows + 0.5 * step, step), (row, np.array(r))
        rows = region.rows
        measure_nodes(nodes**3, *rows, *grid, *pose, radii, clearance_margin, within, results)
    count = float(results[COUNT])
    return NodeMeasures(
        positions=lows + (np.argwhere(within) + 0.5) * step if count else np.zeros((0, 3)),
        extent=(results[HIGHS:LEAST] - results[LOWS:HIGHS]) * step if count else np.full(3, np.nan),
        margins=results[LEAST:MEAN].copy() if count else np.full(3, np.nan),
        mean_margin=float(results[MEAN]) / count if count else math.nan,
        clearances=results[DISTANCES:] if results[OFF_PLANES] else np.full(len(PAIRS), math.inf),
        clear_share=float(results[CLEAR]) / count if count else math.nan,
    )


@kernel(
    "void(f8[:,::1], f8[:,::1], f8[:,::1], f8[::1], f8[::1], f8[::1], f8[:,::1], f8[::1], f8, "
    "b1[:,:,::1], f8[::1])"
)
def measure_nodes(  # noqa: PLR0917 - a compiled loop takes plain values
    circles: FloatArray,
    planes: FloatArray,
    cones: FloatArray,
    first: FloatArray,
    step: FloatArray,
    row: FloatArray,
    r: FloatArray,
    radii: FloatArray,
    margin: float,
    within: BoolArray,
    results: FloatArray,
) -> None:
    """Write whether each node is in a region, shape (n, n, n), and measures of those that are.

    Args:
        circles: Balls and cylinders of the region, shape (n, 6).
        planes: Planes of the region, shape (m, 4).
        cones: Cones of the region, shape (k, 8).
        first: Position of the first node, shape (3,).
        step: Distance between nodes on each axis, shape (3,).
        row: Design variables, shape (6,).
        r: Rotation from platform to base, shape (3, 3).
        radii: Sum of the two radii of each pair, shape (6,); -inf for a pair to leave out.
        margin: Least |δ| of nodes at which clearances count.
        within: Written: whether a node is in the region.
        results: Written, see `COUNT`: number of nodes, lowest and highest indices, least margins,
            sum of the smallest, numbers off the singular planes and with clear legs, clearances.
    """
    p, base, ends = np.zeros(3), np.zeros((4, 3)), np.zeros((4, 3))
    results[:] = 0.0
    results[LOWS:MEAN] = np.inf
    results[HIGHS:LEAST] = -1.0
    results[DISTANCES:] = np.inf
    for i in range(within.shape[0]):
        p[0] = first[0] + i * step[0]
        for j in range(within.shape[1]):
            p[1] = first[1] + j * step[1]
            for k in range(within.shape[2]):
                p[2] = first[2] + k * step[2]
                within[i, j, k] = is_within(p[0], p[1], p[2], circles, planes, cones, 0.0)
                if not within[i, j, k]:
                    continue
                results[COUNT] += 1.0
                for axis in range(3):
                    index = float(i if axis == 0 else (j if axis == 1 else k))
                    results[LOWS + axis] = min(results[LOWS + axis], index)
                    results[HIGHS + axis] = max(results[HIGHS + axis], index)
                smallest = math.inf
                for index, delta in enumerate(margins_at(p, r)):
                    results[LEAST + index] = min(results[LEAST + index], abs(delta))
                    smallest = min(smallest, abs(delta))
                results[MEAN] += smallest
                is_off_planes = smallest >= margin
                if is_off_planes:
                    results[OFF_PLANES] += 1.0
                write_ends(row, p, r, base, ends)
                pair, is_clear = DISTANCES, True
                for one in range(3):
                    for other in range(one + 1, 4):
                        radius = radii[pair - DISTANCES]
                        if radius >= 0.0:
                            first_base, second_base = vector(base, one), vector(base, other)
                            u, v = (
                                minus(vector(ends, one), first_base),
                                minus(vector(ends, other), second_base),
                            )
                            w = minus(first_base, second_base)
                            s, t = closest_shares(u, v, w)
                            clearance = math.sqrt(square_at(s, t, u, v, w)) - radius
                            is_clear = is_clear and clearance > 0.0
                            if is_off_planes:
                                results[pair] = min(results[pair], clearance)
                        pair += 1
                if is_clear:
                    results[CLEAR] += 1.0
