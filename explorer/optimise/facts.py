"""What there is to compare of two designs, such as those before and after an optimisation."""

from __future__ import annotations

from dataclasses import dataclass

import msgspec
import numpy as np

from explorer.errors import InputError
from explorer.legs.clearance import PAIRS
from explorer.mechanism.design import Design
from explorer.mechanism.home import home_pose
from explorer.mechanism.margins import margins
from explorer.mechanism.pose import yaw_pitch_roll_from_rotation
from explorer.optimise.defaults import MARGIN_OF_CLEARANCE
from explorer.optimise.problem import Box, longest_length
from explorer.optimise.search.demands import corners_of
from explorer.workspace.least_clearance import least_clearances
from explorer.workspace.slices.volume import NodeCount, workspace_nodes, workspace_volume

# To which the least clearance is certain, as a share of the reach.
CERTAIN = 1e-3


@dataclass(frozen=True)
class Facts:
    """Measures of a design, in design units.

    Each of them depends on the design alone, and is the figure of the same name in
    `explorer.optimise.figures`; what depends on a demand has a name that says so.

    Attributes:
        design: The design.
        yaw: Of its home, in degrees.
        reach: |a3|, or the largest maximum length where that is larger.
        volume: Of its workspace, exact.
        nodes: The paper's nodes; None of too fine a grid.
        box_margin: The least |κ| over a box that is asked about; None without one.
        clearance: The least over its workspace where every margin is at least a 20th of
            |a3|; None if there is no such position.
        nearest: The pair of legs that has it.
        demanded_margin: From which margin on a clearance was demanded; None if it was not.
        demanded_clearance: The least there; None if there is no such position.
        demanded_nearest: The pair of legs that has it.
    """

    design: Design
    yaw: float
    reach: float
    volume: float
    nodes: NodeCount | None
    box_margin: float | None
    clearance: float | None
    nearest: tuple[int, int] | None
    demanded_margin: float | None
    demanded_clearance: float | None
    demanded_nearest: tuple[int, int] | None


def facts_of(
    design: Design,
    *,
    demanded_margin: float | None = None,
    box: Box | None = None,
    step: float | None = None,
) -> Facts:
    """Return the measures of a design.

    Args:
        design: The design.
        demanded_margin: From which margin on a clearance was demanded, in design units.
        box: Over which the least margin is looked for.
        step: Of the paper's nodes; that of the design if None.
    """
    rotation = home_pose(design).rotation
    clearance, nearest = clearance_beyond(design, clearance_margin_of(design))
    demanded = (None, None)
    if demanded_margin is not None:
        demanded = clearance_beyond(design, demanded_margin)
    return Facts(
        design=design,
        yaw=float(yaw_pitch_roll_from_rotation(rotation)[0]),
        reach=reach_of(design),
        volume=workspace_volume(design, rotation).volume,
        nodes=nodes_of(design, step),
        box_margin=None if box is None else float(np.abs(margins(corners_of(box), rotation)).min()),
        clearance=clearance,
        nearest=nearest,
        demanded_margin=demanded_margin,
        demanded_clearance=demanded[0],
        demanded_nearest=demanded[1],
    )


def nodes_of(design: Design, step: float | None = None) -> NodeCount | None:
    """Return the paper's nodes at the home's orientation; None of too fine a grid."""
    try:
        return workspace_nodes(design, step=step)
    except InputError:
        return None


def reach_of(design: Design) -> float:
    """Return |a3|, or the largest maximum length where that is larger, in design units."""
    return max(design.reach, longest_length(design))


def clearance_margin_of(design: Design) -> float:
    """Return from which margin on clearances count by default, in design units."""
    return MARGIN_OF_CLEARANCE * design.reach


def clearance_beyond(
    design: Design, margin: float
) -> tuple[float, tuple[int, int]] | tuple[None, None]:
    """Return the least clearance where every margin is at least some length, and its legs.

    Over the workspace at the home's orientation, certain to a thousandth of the reach; None
    if it has no such position, or no volume: positions may be left then, all on a surface.

    Args:
        design: The design; nearer to a singularity its legs may have to meet.
        margin: In design units.
    """
    if workspace_volume(design, explain=False).volume <= 0.0:
        return None, None
    own = design.limits.margin or 0.0
    limits = msgspec.structs.replace(design.limits, margin=max(own, margin))
    found = least_clearances(
        msgspec.structs.replace(design, limits=limits),
        home_pose(design).rotation,
        CERTAIN * design.reach,
        only_least=True,
    ).clearance
    pair = int(found.argmin())
    return (float(found[pair]), PAIRS[pair]) if np.isfinite(found[pair]) else (None, None)
