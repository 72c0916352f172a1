"""Presses that a browser reports: a script writes them to a hidden number field of its tab.

viser reports values alone. The script sends what any number field would send, past the same
guard and in the same order as the values of other controls, so that a value is known to come
from the press during which it arrives.
"""

from __future__ import annotations

import viser

from explorer.app.browser.viser_gaps import element_id, run_script_in
from explorer.app.look import read_script
from explorer.app.state.presses import Presses


def listen(client: viser.ClientHandle, presses: Presses) -> None:
    """Record the presses of a browser that has connected."""
    field = client.gui.add_number("Press", 0, visible=False)

    # On the thread that reads the browser's messages, one after the other.
    @field.on_update
    async def _(event: viser.GuiEvent[viser.GuiNumberHandle[int]]) -> None:
        presses.record(client.client_id, event.target.value, event.target.update_timestamp)

    run_script_in(client, read_script("holds", element_id(field)))
