"""The search in the bar: what it does or found, and the buttons that answer it."""

from __future__ import annotations

from html import escape

from explorer.app.features.optimise.buttons import ACCEPT, BUTTONS, PAPER, button
from explorer.app.features.optimise.words import search_notice
from explorer.app.state.frame import Frame
from explorer.app.widgets.buttons import open_button, running
from explorer.mechanism.design_file import PRESETS

TAB = "Optimise"


def search_chip(frame: Frame) -> str:
    """Return the search that runs or waits for an answer, or where to begin, as HTML."""
    state = frame.state
    notice = search_notice(state)
    if notice is not None:
        buttons = "".join(button(name, state, is_main=name == ACCEPT) for name in notice.buttons)
        return running(TAB, notice.title, notice.text, notice.share, buttons)
    if state.optimisation.run is None and state.design in PRESETS.values():
        paper = BUTTONS[PAPER]
        words = escape(paper.label)
        return open_button(
            TAB, words, press=PAPER, hint=paper.hint, class_name="ex-tool ex-outlined"
        )
    return ""
