"""The name of the live design in the bar, and whether it is saved."""

from __future__ import annotations

from html import escape

from explorer.app.features.designs.saved_designs import SavedDesigns
from explorer.app.features.feature import Services
from explorer.app.state.frame import Frame
from explorer.app.widgets.buttons import open_button
from explorer.mechanism.design import Design
from explorer.mechanism.design_file import PRESETS


class DesignName:
    """The name, a button that opens the dialog Designs where designs are saved."""

    def __init__(self, services: Services) -> None:
        self._saved = None if services.user_data is None else services.get(SavedDesigns)

    def __call__(self, frame: Frame) -> str:
        """Return the name for a frame, as HTML."""
        live = frame.state.design
        name = f'<b class="ex-cut">{escape(live.name)}</b>'
        if self._saved is None:
            return f'<span class="ex-name">{name}</span>'
        mark, words = saved_words(live, self._saved.find(live.name))
        content = f'{name}<span class="ex-dim">{mark}</span>'
        hint = f"{words} Save, rename, open or upload designs."
        return open_button("Designs", content, hint=hint, class_name="ex-name")


def saved_words(live: Design, saved: Design | None) -> tuple[str, str]:
    """Return whether a design is saved, in a word and in a sentence.

    Args:
        live: The live design.
        saved: The saved design of the same name; None if there is none.
    """
    if saved == live:
        return "saved", "Saved."
    if live == PRESETS.get(live.name):
        return "preset", "An unchanged preset."
    if saved is None:
        return "not saved", "Not saved under a name yet; it comes back with the session."
    return "changed", "Changed since it was saved."
