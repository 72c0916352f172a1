"""The worker's task for the legs: the accessible volume over their radius."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from explorer.app.features.workspace.regions import (
    Rows,
    Trouble,
    trouble_of,
)
from explorer.app.session.feed import watch_of
from explorer.app.session.worker import Channel
from explorer.errors import ExplorerError
from explorer.mechanism.design import Design
from explorer.mechanism.pose import Triple
from explorer.workspace.accessible.radii import RadiusCurve, radius_curve


@dataclass(frozen=True)
class RadiusRequest:
    """A request for the accessible volume over the radius of the legs.

    Attributes:
        design: The manipulator, its legs without radii.
        rotation: Rotation from platform to base, rows of the matrix.
        start: Position of b4 from which paths start; None for the home position.
    """

    design: Design
    rotation: Rows
    start: Triple | None


@dataclass(frozen=True)
class RadiusDrawing:
    """The accessible volume over the radius of the legs.

    Attributes:
        request: The request.
        curve: The curve; None if it could not be computed.
        trouble: Reason why there is no curve; None if there is one.
    """

    request: RadiusRequest
    curve: RadiusCurve | None
    trouble: Trouble | None


def draw_radius_curve(request: RadiusRequest, channel: Channel | None = None) -> RadiusDrawing:
    """Return the accessible volume over the radius of all legs; `channel` sends progress."""
    design, rotation = request.design, np.array(request.rotation)
    try:
        curve = radius_curve(design, rotation, start=request.start, watch=watch_of(channel))
    except ExplorerError as error:
        return RadiusDrawing(request, None, trouble_of(error))
    return RadiusDrawing(request, curve, None)
