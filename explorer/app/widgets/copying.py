"""The small button of a panel that copies how its answer is computed: a command and Python."""

from __future__ import annotations

from collections.abc import Callable

import viser

from explorer.app.browser.viser_gaps import run_script_in
from explorer.app.look import read_script
from explorer.app.widgets.buttons import Buttons, press_button
from explorer.measures.blocks.source import Source

HINT = "Copy the command line and the Python that compute this answer."
# Two sheets.
ICON = (
    '<svg viewBox="0 0 16 16" aria-hidden="true"><path d="M5.5 5.5v-3h8v8h-3m-8-5h8v8h-8z"/></svg>'
)


class CopyButton:
    """The button of a panel that copies how its answer is computed.

    Args:
        buttons: Buttons of the page.
        tab: Title of the panel's tab.
        source: Function that returns how the present answer is computed.
    """

    def __init__(self, buttons: Buttons, tab: str, source: Callable[[], Source]) -> None:
        self._name, self._source = f"{tab.lower()}.copy", source
        buttons.on(self._name, self._copy)
        buttons.offer(f"{tab} › Copy the command line", HINT, self._name)
        self.html = press_button(
            self._name, "", ICON, hint=HINT, label="Copy the command line", class_name="ex-copy"
        )

    def _copy(self, _: str, client: viser.ClientHandle) -> None:
        run_script_in(client, read_script("copies", self._source().text))
