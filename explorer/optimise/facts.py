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
    least = MARGIN_OF_CLEARANCE * design.reach if clearance_margin is None else clearance_margin
    nodes = workspace_nodes(design, rotation, step)
    own = design.limits.margin or 0.0
    limits = msgspec.structs.replace(design.limits, margin=max(own, least))
    clear = least_clearances(
        msgspec.structs.replace(design, limits=limits), rotation, 1e-3 * design.reach
    )
    pair = int(clear.clearance.argmin())
    is_known = bool(np.isfinite(clear.clearance[pair]))
    return Facts(
        design=design,
        yaw=float(yaw_pitch_roll_from_rotation(rotation)[0]),
        reach=max(design.reach, longest_length(design)),
        volume=workspace_volume(design, rotation).volume,
        node_count=nodes.count,
        node_volume=nodes.volume,
        worst_margin=None
        if box is None
        else float(np.abs(margins(corners_of(box), rotation)).min()),
        clearance=float(clear.clearance[pair]) if is_known else None,
        clearance_margin=least,
        nearest=PAIRS[pair] if is_known else None,
    )
