"""The path that is being planned or played, in the bar."""

from __future__ import annotations

from explorer.app.features.feature import Services
from explorer.app.state.frame import Frame
from explorer.app.widgets.buttons import press_button, running


class PathChip:
    """What is done about a path, and the button that ends it."""

    def __init__(self, services: Services) -> None:
        del services

    def markup(self, frame: Frame) -> str:
        """Return the chip for a frame, as HTML; "" while no path is planned or played."""
        state = frame.state
        if state.paths.is_planning:
            cancel = press_button("paths.cancel", "", "Cancel", class_name="ex-button")
            words = f"{state.paths.seconds:g} s at most"
            return running("Paths", "Planning a path", words, None, cancel)
        journey = state.journey
        if journey is None or not journey.is_playing:
            return ""
        pause = press_button("paths.play", "off", "Pause", class_name="ex-button")
        share = journey.at / journey.trajectory.duration
        return running("Paths", "Playing", f"{journey.at:.1f} s", share, pause)
