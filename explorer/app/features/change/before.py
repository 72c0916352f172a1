"""The design before the last change, until the next press."""

from __future__ import annotations

from dataclasses import dataclass

import viser

from explorer.app.features.feature import Services
from explorer.app.features.workspace.volume import VolumeFeed
from explorer.app.state.frame import Frame
from explorer.app.state.state import State
from explorer.mechanism.design import Design

OVER = "change.over"
# Number of designs whose volume is kept: those of the last slider's values may come late.
MOST_VOLUMES = 32


@dataclass(frozen=True)
class Before:
    """What was before the last change of the design.

    Attributes:
        frame: The design and its pose.
        words: The change in words.
        volume: Volume of its workspace in cubed design units; None if it is not known.
    """

    frame: Frame
    words: str
    volume: float | None


class DesignChange:
    """Follows the design from the last step of the history to the present one.

    A change counts until another step, undo or redo, or a press outside of the scene.
    """

    def __init__(self, services: Services) -> None:
        self._session = services.session
        self._feed = services.get(VolumeFeed)
        self._volumes: dict[Design, float] = {}
        self._ended: State | None = None
        self._before: Before | None = None
        services.buttons.on(OVER, self._end, values=("",))

    @property
    def before(self) -> Before | None:
        """What was before the change; None if the last step did not change the design."""
        return self._before

    def volume_of(self, design: Design) -> float | None:
        """Return the volume of a design's workspace; None if it is not known."""
        return self._volumes.get(design)

    def follow(self, frame: Frame) -> None:
        """Find what was before the change that led to a frame."""
        measured = self._feed.drawing
        if measured is not None:
            design = measured.request.design
            self._volumes.pop(design, None)
            self._volumes[design] = measured.measured.volume
            while len(self._volumes) > MOST_VOLUMES:
                del self._volumes[next(iter(self._volumes))]
        self._before = self._find(frame)

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
        return Before(old, history.step.words, self.volume_of(state.design))

    def _end(self, _: str, client: viser.ClientHandle) -> None:
        del client
        if self._before is not None:
            self._ended = self._before.frame.state
            self._session.redraw()
