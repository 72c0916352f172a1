"""The search in the bar: what it does or found, and the buttons that answer it."""

from __future__ import annotations

from html import escape

from explorer.app.features.feature import Services
from explorer.app.features.optimise.presses import ACCEPT, PAPER, PRESSES, button
from explorer.app.features.optimise.words import search_notice
from explorer.app.state.frame import Frame
from explorer.app.widgets.buttons import open_button, running
from explorer.mechanism.design_file import PRESETS

TAB = "Optimise"


class SearchChip:
    """The search that runs or waits for an answer; before the first one, where to begin."""

    def __init__(self, services: Services) -> None:
        del services

    def markup(self, frame: Frame) -> str:
        """Return the chip for a frame, as HTML; "" if there is nothing to say."""
        state = frame.state
        notice = search_notice(state)
        if notice is not None:
            buttons = "".join(
                button(name, state, is_main=name == ACCEPT) for name in notice.presses
            )
            return running(TAB, notice.title, notice.text, notice.share, buttons)
        if state.optimisation.run is None and state.design in PRESETS.values():
            press = PRESSES[PAPER]
            words = escape(press.label)
            return open_button(
                TAB, words, press=PAPER, hint=press.hint, class_name="ex-tool ex-outlined"
            )
        return ""
