"""The exact volume of the present design's workspace, whether or not the solid is drawn."""

from __future__ import annotations

from dataclasses import dataclass
from functools import lru_cache

import numpy as np

from explorer.app.features.feature import Services
from explorer.app.features.workspace.orientation import workspace_rows
from explorer.app.features.workspace.regions import Rows
from explorer.app.session.feed import Feed
from explorer.app.state.frame import Frame
from explorer.mechanism.design import Design
from explorer.numerics.number_text import format_number
from explorer.workspace.slices.volume import Volume, workspace_volume


@dataclass(frozen=True)
class VolumeRequest:
    """Request for the volume of a workspace.

    Attributes:
        design: The manipulator.
        rotation: Rows of the matrix, platform to base.
    """

    design: Design
    rotation: Rows


@dataclass(frozen=True)
class MeasuredVolume:
    """The volume of a workspace.

    Attributes:
        request: The request.
        measured: The volume with its error, in cubed design units.
    """

    request: VolumeRequest
    measured: Volume


@dataclass(frozen=True)
class VolumeText:
    """The volume in words.

    Attributes:
        words: The volume with its unit, such as "7,053.04 units³" or "empty"; "–" before the
            first one.
        is_current: Whether it is that of the present design.
    """

    words: str
    is_current: bool


class VolumeFeed(Feed[VolumeRequest, MeasuredVolume]):
    """Volumes of the workspace within the limits; the drawing of a solid takes ten times as long.

    It must be followed before `explorer.app.features.workspace.feed.WorkspaceFeed`, so that a
    volume never waits for the drawing of the same state.
    """

    def __init__(self, services: Services) -> None:
        super().__init__(services.worker, measure_volume, volume_request, services.session.redraw)

    @property
    def text(self) -> VolumeText:
        """The newest volume in words."""
        drawing = self.drawing
        return VolumeText("–" if drawing is None else volume_text(drawing), self.is_current)


def volume_text(drawing: MeasuredVolume) -> str:
    """Return a volume with its unit, or that the workspace is empty."""
    if drawing.measured.volume <= 0.0:
        return "empty"
    size = drawing.request.design.reach**3
    return f"{format_number(drawing.measured.volume, 6, size=size)} units³"


def measure_volume(request: VolumeRequest) -> MeasuredVolume:
    """Return the volume of a workspace: a task of the worker."""
    return MeasuredVolume(request, exact_volume(request.design, request.rotation))


@lru_cache(8)
def exact_volume(design: Design, rotation: Rows) -> Volume:
    """Return the exact volume of a workspace, computed once for its number and its drawing."""
    return workspace_volume(design, np.array(rotation))


def volume_request(frame: Frame) -> VolumeRequest:
    """Return the request for the volume of a frame's design."""
    return VolumeRequest(frame.state.design, workspace_rows(frame))
