"""Measures of a workspace at the nodes of a grid: its extent, margins and clearances.

The nodes are the centres of the cells of a box about the constant-orientation workspace, so
that none lies on its surface. A least value at the nodes is an upper bound of the least value
in the workspace; `explorer.workspace.least_clearance` certifies a lower bound too.
"""

from __future__ import annotations

import math
from dataclasses import dataclass

import numpy as np
from numpy.typing import ArrayLike

from explorer.errors import InputError
from explorer.legs.clearance import PAIRS
from explorer.mechanism.design import Design
from explorer.mechanism.margins import margins
from explorer.mechanism.pose import checked_rotation
from explorer.numerics.arrays import FloatArray, for_kernel
from explorer.numerics.compiled import kernel
from explorer.workspace.limits.constraints import constraints
from explorer.workspace.limits.quantities import RADII, write_ends
from explorer.workspace.limits.region import region_of
from explorer.workspace.limits.valid_poses import Rules, square_between
from explorer.workspace.slices.nodes import mark_nodes
from explorer.workspace.slices.volume import home_rotation

# Number of nodes on each axis: default, least and largest.
DEFAULT_NODES = 20
FEWEST_NODES, MOST_NODES = 2, 200


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
        InputError: Not a rotation, or too few or too many nodes.
    """
    if not FEWEST_NODES <= nodes <= MOST_NODES:
        raise InputError(
            f"the nodes on an axis must be from {FEWEST_NODES} to {MOST_NODES}; got {nodes}"
        )
    r = home_rotation(design) if rotation is None else checked_rotation(rotation)
    region = region_of(constraints(design, r))
    lows, highs = region.box or (np.zeros(3), np.zeros(3))
    step, within = (highs - lows) / nodes, np.zeros((nodes,) * 3, dtype=np.bool_)
    if region.box is not None:
        mark_nodes(nodes**3, *region.rows, lows + 0.5 * step, step, 0.0, within)
    indices = np.argwhere(within)
    if not len(indices):
        none = np.full(3, np.nan)
        clearances = np.full(len(PAIRS), math.inf)
        return NodeMeasures(np.zeros((0, 3)), none, none, math.nan, clearances, math.nan)
    positions = for_kernel(lows + (indices + 0.5) * step)
    sizes = np.abs(margins(positions, r))
    smallest = sizes.min(axis=1)
    clearance, rules = np.empty((len(positions), len(PAIRS))), Rules.of(design)
    clearance_rows(len(positions), rules.row, positions, for_kernel(r), clearance)
    off_planes = clearance[smallest >= clearance_margin]
    return NodeMeasures(
        positions=positions,
        extent=np.ptp(indices, axis=0) * step,
        margins=sizes.min(axis=0),
        mean_margin=float(smallest.mean()),
        clearances=off_planes.min(axis=0, initial=math.inf),
        clear_share=float((clearance > 0.0).all(axis=1).mean()),
    )


@kernel("void(f8[::1], f8[:,::1], f8[:,::1], f8[:,::1])")
def clearance_rows(
    row: FloatArray, positions: FloatArray, r: FloatArray, clearances: FloatArray
) -> None:
    """Write the clearances of pairs of legs at n positions, (n, 6); infinite without a demand."""
    base, ends = np.zeros((4, 3)), np.zeros((4, 3))
    for index in range(positions.shape[0]):
        write_ends(row, positions[index], r, base, ends)
        pair = 0
        for i in range(3):
            for j in range(i + 1, 4):
                clearances[index, pair] = math.inf
                radius = row[RADII + pair]
                if radius >= 0.0:
                    clearance = math.sqrt(square_between(i, j, base, ends)) - radius
                    clearances[index, pair] = clearance
                pair += 1
