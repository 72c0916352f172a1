"""All figures of a design, to compare it with others: the one place where they are found.

All are of its home pose and of the constant-orientation workspace there. `FIGURES` says what
each of them is, in which unit, and whether more or less of it is better.
"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass
from typing import Literal

import numpy as np

from explorer.mechanism.design import VARIABLES, Design
from explorer.mechanism.home import home_pose
from explorer.mechanism.margins import margins
from explorer.mechanism.pose import yaw_pitch_roll_from_rotation
from explorer.numerics.arrays import FloatArray
from explorer.optimise.facts import clearance_beyond, clearance_margin_of, nodes_of, reach_of
from explorer.singularity.jacobian import inverse_condition, jacobian
from explorer.workspace.extremes import extent_of, least_margins
from explorer.workspace.node_measures import node_measures
from explorer.workspace.slices.volume import NodeCount, workspace_volume
from explorer.workspace.solids.solid import Solid
from explorer.workspace.solids.solids import workspace_solid

# Of the reach: the tolerance of the mesh from which the farthest positions are looked for.
MESH_TOLERANCE = 0.004
# Nodes on each axis of the grids over which means are taken; conditions take longer.
MEAN_NODES, CONDITION_NODES = 20, 12

Better = Literal["more", "less"]


@dataclass(frozen=True)
class Figures:
    """Measures of a design, in design units.

    What there is none of is None: most of an empty workspace, and nodes of too fine a grid.

    Attributes:
        design: The design.
        yaw, pitch, roll: Of its home, in degrees.
        volume: Of its workspace, exact.
        empty_because: The limits that empty it; () if it is not empty.
        nodes: The paper's measure of it.
        reach: |a3|, or the largest maximum length where that is larger.
        extent: From the lowest to the highest position on each axis, exact.
        worst_margin: The least of |κ1|, |κ2|, |κ3| anywhere in the workspace, exact.
        mean_margin: The mean of the smallest of the three over a grid of nodes.
        home_margin: The smallest of the three in the home pose.
        home_condition: The inverse condition of the Jacobian in the home pose.
        mean_condition: Its mean over a grid of nodes.
        clearance: The least over the workspace where every margin is at least
            `clearance_margin`, to a thousandth of the reach.
        clearance_margin: See above.
        nearest: The pair of legs that has it.
        clear_share: Which share of the nodes of a grid has no two legs that meet.
    """

    design: Design
    yaw: float
    pitch: float
    roll: float
    volume: float
    empty_because: tuple[str, ...]
    nodes: NodeCount | None
    reach: float
    extent: tuple[float, float, float] | None
    worst_margin: float | None
    mean_margin: float | None
    home_margin: float
    home_condition: float
    mean_condition: float | None
    clearance: float | None
    clearance_margin: float
    nearest: tuple[int, int] | None
    clear_share: float | None


@dataclass(frozen=True)
class Figure:
    """What one of the figures is.

    Attributes:
        name: Of it, a few words.
        hint: What it means, a sentence.
        of: Finds it among all of a design; None if there is none.
        power: Of a length that it is: 3 for volumes, 0 for what has no length in it.
        unit: Of what has no length in it.
        better: Which way it is better, where that is beyond doubt.
        is_whole: Whether it is a count.
    """

    name: str
    hint: str
    of: Callable[[Figures], float | None]
    power: int = 0
    unit: str = ""
    better: Better | None = None
    is_whole: bool = False


def figures_of(design: Design, solid: Solid | None = None) -> Figures:
    """Return all figures of a design.

    Args:
        design: The design.
        solid: Its workspace at home as a mesh, if there is one already, of any tolerance.

    Raises:
        ExplorerError: the mesh cannot be made.
    """
    home = home_pose(design)
    r = home.rotation
    yaw, pitch, roll = yaw_pitch_roll_from_rotation(r).tolist()
    volume = workspace_volume(design, r)
    margin = clearance_margin_of(design)
    clearance, nearest = clearance_beyond(design, margin)
    grid = node_measures(design, r, nodes=MEAN_NODES)
    inner = node_measures(design, r, nodes=CONDITION_NODES).positions
    extent = worst = None
    mesh = solid
    if mesh is None and volume.volume > 0.0:
        mesh = workspace_solid(design, r, MESH_TOLERANCE * design.reach, volume=volume)
    if mesh is not None and not mesh.is_empty:
        lows, highs = extent_of(design, r, mesh)
        x, y, z = (highs - lows).tolist()
        extent = (x, y, z)
        worst = float(least_margins(design, r, mesh).min())
    return Figures(
        design=design,
        yaw=yaw,
        pitch=pitch,
        roll=roll,
        volume=volume.volume,
        empty_because=volume.empty_because,
        nodes=nodes_of(design),
        reach=reach_of(design),
        extent=extent,
        worst_margin=worst,
        mean_margin=_known(grid.mean_margin),
        home_margin=float(np.abs(margins(home.position, r)).min()),
        home_condition=float(_conditions(design, np.array([home.position]), r)[0]),
        mean_condition=float(_conditions(design, inner, r).mean()) if len(inner) else None,
        clearance=clearance,
        clearance_margin=margin,
        nearest=nearest,
        clear_share=_known(grid.clear_share),
    )


def _conditions(design: Design, positions: FloatArray, rotation: FloatArray) -> FloatArray:
    return inverse_condition(jacobian(design, positions, rotation), design.reach)


def _known(value: float) -> float | None:
    return value if np.isfinite(value) else None


def _variable(index: int) -> Figure:
    name = VARIABLES[index]
    frame = "base" if index < 2 else "platform"
    return Figure(
        name,
        f"Design variable, in the frame of the {frame}",
        lambda found: found.design.variables[index],
        power=1,
    )


def _extent(axis: int) -> Figure:
    name = "xyz"[axis]
    return Figure(
        f"extent {name}",
        f"From the lowest to the highest {name} of b4 in the workspace, exact",
        lambda found: None if found.extent is None else found.extent[axis],
        power=1,
    )


FIGURES: tuple[Figure, ...] = (
    Figure(
        "volume",
        "Of the workspace at the orientation of home, exact",
        lambda found: found.volume,
        power=3,
        better="more",
    ),
    Figure(
        "volume / reach³",
        "How much workspace the design has for its size",
        lambda found: found.volume / found.reach**3,
        better="more",
    ),
    Figure(
        "nodes",
        "The paper's measure of the workspace: nodes of the design's own grid",
        lambda found: None if found.nodes is None else found.nodes.count,
        is_whole=True,
    ),
    Figure(
        "node volume",
        "Nodes times the cube of their step; it overstates the volume",
        lambda found: None if found.nodes is None else found.nodes.volume,
        power=3,
    ),
    Figure(
        "node step",
        "Of the design's own grid",
        lambda found: None if found.nodes is None else found.nodes.step,
        power=1,
    ),
    Figure(
        "reach",
        "|a3|, or the longest leg where that is longer",
        lambda found: found.reach,
        power=1,
        better="less",
    ),
    *map(_extent, range(3)),
    Figure(
        "worst margin",
        "The least |κ| anywhere in the workspace, exact; 0 where it goes up to a singularity",
        lambda found: found.worst_margin,
        power=1,
        better="more",
    ),
    Figure(
        "mean margin",
        f"The mean of the smallest |κ| over the workspace, by {MEAN_NODES} nodes on each axis",
        lambda found: found.mean_margin,
        power=1,
        better="more",
    ),
    Figure(
        "margin at home",
        "The smallest |κ| in the home pose",
        lambda found: found.home_margin,
        power=1,
        better="more",
    ),
    Figure(
        "mean 1 / cond J",
        "The mean inverse condition of the Jacobian over the workspace, by "
        f"{CONDITION_NODES} nodes on each axis; 0 is singular, 1 the best",
        lambda found: found.mean_condition,
        better="more",
    ),
    Figure(
        "1 / cond J at home",
        "The inverse condition of the Jacobian in the home pose; 0 is singular, 1 the best",
        lambda found: found.home_condition,
        better="more",
    ),
    Figure(
        "clearance",
        "The least of any two legs over the workspace, wherever every |κ| is at least a 20th of "
        "|a3|; certain to a 1000th of it",
        lambda found: found.clearance,
        power=1,
        better="more",
    ),
    Figure(
        "clear of collisions",
        f"The share of the workspace where no two legs meet, by {MEAN_NODES} nodes on each axis",
        lambda found: None if found.clear_share is None else 100.0 * found.clear_share,
        unit="%",
        better="more",
    ),
    Figure("yaw of home", "Of the orientation that the workspace has", lambda f: f.yaw, unit="°"),
    *map(_variable, range(6)),
)
"""What is compared, in the order of the table."""
