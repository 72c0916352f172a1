"""The design before the last change, until the next press."""

from __future__ import annotations

from dataclasses import dataclass

import viser

from explorer.app.features.feature import Services
from explorer.app.features.workspace.volume import (
    MeasuredVolume,
    VolumeFeed,
    VolumeRequest,
    measure_volume,
    volume_request,
)
from explorer.app.session.feed import Feed
from explorer.app.state.frame import Frame
from explorer.app.state.state import State

OVER = "change.over"


@dataclass(frozen=True)
class Before:
    """What was before the last change of the design.

    Attributes:
        frame: The design and its pose.
        words: The change in words.
    """

    frame: Frame
    words: str


class DesignChange:
    """Follows the design from the last step of the history to the present one.

    A change counts until another step, undo or redo, or a press outside of the scene.
    """

    def __init__(self, services: Services) -> None:
        self._session = services.session
        self._now = services.get(VolumeFeed)
        # Another page of the same state may not have measured the design before the change.
        self._then = Feed[VolumeRequest, MeasuredVolume](
            services.worker,
            measure_volume,
            self._request_for,
            services.session.redraw,
            key="volume before",
        )
        self._ended: State | None = None
        self._before: Before | None = None
        services.buttons.on(OVER, self._end, values=("",))

    @property
    def before(self) -> Before | None:
        """What was before the change; None if the last step did not change the design."""
        return self._before

    @property
    def volumes(self) -> tuple[float | None, float | None]:
        """Volumes before and now, in cubed design units; None for one that is being computed."""
        return _volume(self._then), _volume(self._now)

    def follow(self, frame: Frame) -> None:
        """Find what was before the change that led to a frame, and request its volume."""
        self._before = self._find(frame)
        self._then.follow(frame)

    def _request_for(self, _: Frame) -> VolumeRequest | None:
        return None if self._before is None else volume_request(self._before.frame)

    def _find(self, frame: Frame) -> Before | None:
        history = self._session.history
        if not history.is_open or history.at == 0:
            return None
        state, now = history.steps[history.at - 1].state, frame.state
        if state is self._ended:
            return None
        # Another design that is opened is no change of this one.
        if state.base != now.base or state.design == now.design:
            return None
        known = self._before
        # What a frame has computed is kept from one value of a slider to the next.
        old = Frame(state) if known is None or known.frame.state is not state else known.frame
        return Before(old, history.step.words)

    def _end(self, _: str, client: viser.ClientHandle) -> None:
        del client
        if self._before is not None:
            self._ended = self._before.frame.state
            self._session.redraw()


def _volume(feed: Feed[VolumeRequest, MeasuredVolume]) -> float | None:
    drawing = feed.drawing
    return None if drawing is None or not feed.is_current else drawing.measured.volume
