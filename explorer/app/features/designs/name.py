"""The name of the live design in the bar, whether it is saved, and whether the session is."""

from __future__ import annotations

from html import escape

import viser

from explorer.app.features.designs.saved_designs import SavedDesigns
from explorer.app.features.feature import Services
from explorer.app.state.frame import Frame
from explorer.app.widgets.buttons import open_button, press_button
from explorer.mechanism.design import Design
from explorer.mechanism.design_file import PRESETS

# Name of the button that shows why the session is not saved, and its label.
UNSAVED, UNSAVED_LABEL = "session.unsaved", "Session not saved"


class DesignName:
    """The name, a button that opens the dialog Designs, and a warning while saving fails."""

    def __init__(self, services: Services) -> None:
        self._saved = None if services.user_data is None else services.get(SavedDesigns)
        self._autosaver = services.autosaver
        services.buttons.on(UNSAVED, lambda _, client: self._show_problem(client))

    def __call__(self, frame: Frame) -> str:
        """Return the name for a frame, as HTML."""
        live = frame.state.design
        name = f'<b class="ex-cut">{escape(live.name)}</b>'
        if self._saved is None:
            return f'<span class="ex-name">{name}</span>'
        mark, words = saved_words(live, self._saved.find(live.name))
        content = f'{name}<span class="ex-dim">{mark}</span>'
        hint = f"{words} Save, rename, open or upload designs."
        return open_button("Designs", content, hint=hint, class_name="ex-name") + self._warning()

    def _warning(self) -> str:
        """Return the button that warns of an unsaved session, as HTML; "" while it is saved."""
        problem = self._problem
        if problem is None:
            return ""
        look = "ex-tool ex-outlined ex-beyond"
        return press_button(UNSAVED, "", UNSAVED_LABEL, hint=problem, class_name=look)

    def _show_problem(self, client: viser.ClientHandle) -> None:
        problem = self._problem
        if problem is not None:
            client.add_notification(UNSAVED_LABEL, problem, color="orange")

    @property
    def _problem(self) -> str | None:
        return None if self._autosaver is None else self._autosaver.problem


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
