"""What there is to compare of two designs, such as those before and after an optimisation."""

from __future__ import annotations

from dataclasses import dataclass

import msgspec
import numpy as np

from explorer.clearance import PAIRS
from explorer.design import Design
from explorer.home import home_pose
from explorer.least_clearance import least_clearances
from explorer.optimise.defaults import MARGIN_OF_CLEARANCE
from explorer.optimise.demands import corners_of
from explorer.optimise.problem import Box, longest_length
from explorer.pose import yaw_pitch_roll_from_rotation
from explorer.singularity import margins
from explorer.workspace import workspace_nodes, workspace_volume

# To which the least clearance is certain, as a share of the reach.
CERTAIN = 1e-3


@dataclass(frozen=True)
class Facts:
    """Measures of a design, in design units.

    Attributes:
        design: The design.
        yaw: Of its home, in degrees.
        reach: |a3|, or the largest maximum length where that is larger.
        volume: Of its workspace, exact.
        node_count: Of the paper's nodes.
        node_volume: Theirs.
        worst_margin: The least |κ| over a box; None without one.
        clearance: The least over its workspace where every margin is at least
            `clearance_margin`; None if there is no such position.
        clearance_margin: See above.
        nearest: The pair of legs that has it.
    """

    design: Design
    yaw: float
    reach: float
    volume: float
    node_count: int
    node_volume: float
    worst_margin: float | None
    clearance: float | None
    clearance_margin: float
    nearest: tuple[int, int] | None


def facts_of(
    design: Design,
    *,
    clearance_margin: float | None = None,
    box: Box | None = None,
    step: float | None = None,
) -> Facts:
    """Return the measures of a design.

    Args:
        design: The design.
        clearance_margin: From which margin on clearances count; a 20th of |a3| if None.
        box: Over which the worst margin is looked for.
        step: Of the paper's nodes; that of the design if None.
    """
    rotation = home_pose(design).rotation
    least = clearance_margin_of(design) if clearance_margin is None else clearance_margin
    nodes = workspace_nodes(design, rotation, step)
    clearance, nearest = clearance_beyond(design, least)
    return Facts(
        design=design,
        yaw=float(yaw_pitch_roll_from_rotation(rotation)[0]),
        reach=reach_of(design),
        volume=workspace_volume(design, rotation).volume,
        node_count=nodes.count,
        node_volume=nodes.volume,
        worst_margin=None
        if box is None
        else float(np.abs(margins(corners_of(box), rotation)).min()),
        clearance=clearance,
        clearance_margin=least,
        nearest=nearest,
    )


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
    if it has no such position.

    Args:
        design: The design; nearer to a singularity its legs may have to meet.
        margin: In design units.
    """
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
