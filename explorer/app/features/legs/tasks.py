"""The worker's task for the legs: the accessible volume against their radius."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from explorer.app.features.workspace.reached import (
    Rows,
    Trouble,
    trouble_of,
    watch_of,
)
from explorer.app.session.worker import Line
from explorer.errors import ExplorerError
from explorer.mechanism.design import Design
from explorer.mechanism.pose import Triple
from explorer.workspace.accessible.radii import RadiusCurve, radius_curve


@dataclass(frozen=True)
class RadiusRequest:
    """Of what to draw the reachable volume against the radius of the legs.

    Attributes:
        design: The manipulator; its legs without radii, since these do not count.
        rotation: Platform to base, rows of the matrix.
        start: From where it is to be reached; None for the home position.
    """

    design: Design
    rotation: Rows
    start: Triple | None


@dataclass(frozen=True)
class RadiusDrawing:
    """The reachable volume against the radius.

    Attributes:
        request: What was asked for.
        curve: None if there is trouble.
        trouble: Why there is no curve.
    """

    request: RadiusRequest
    curve: RadiusCurve | None
    trouble: Trouble | None


def draw_radius_curve(request: RadiusRequest, line: Line | None = None) -> RadiusDrawing:
    """Return the reachable volume against the radius of all legs; `line` as above."""
    design, rotation = request.design, np.array(request.rotation)
    try:
        curve = radius_curve(design, rotation, start=request.start, watch=watch_of(line))
    except ExplorerError as error:
        return RadiusDrawing(request, None, trouble_of(error))
    return RadiusDrawing(request, curve, None)
