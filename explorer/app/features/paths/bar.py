"""The path that is being planned or played, in the bar."""

from __future__ import annotations

from explorer.app.state.frame import Frame
from explorer.app.widgets.buttons import press_button, running
from explorer.numerics.number_text import format_decimals, format_number


def path_chip(frame: Frame) -> str:
    """Return what is done about a path and the button that ends it, as HTML; "" for nothing."""
    state = frame.state
    if state.paths.is_planning:
        cancel = press_button("paths.cancel", "", "Cancel", class_name="ex-button")
        words = f"{format_number(state.paths.seconds)} s at most"
        return running("Paths", "Planning a path", words, None, cancel)
    journey = state.journey
    if journey is None or not journey.is_playing:
        return ""
    pause = press_button("paths.play", "off", "Pause", class_name="ex-button")
    share = journey.at / journey.trajectory.duration
    return running("Paths", "Playing", f"{format_decimals(journey.at, 1)} s", share, pause)
