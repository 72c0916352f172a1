"""Presses that a browser reports: a script writes them to a hidden number field of its tab.

viser reports values alone. The script sends what any number field would send, past the same
guard and in the same order as the values of other controls, so that a value is known to come
from the press during which it arrives.
"""

from __future__ import annotations

from collections.abc import Callable

import viser

from explorer.app.browser.viser_gaps import element_id, run_script_in
from explorer.app.look import read_script
from explorer.app.session.clock import moment_of
from explorer.app.state.presses import Presses


def listen(client: viser.ClientHandle, presses: Presses, at_release: Callable[[], None]) -> None:
    """Record the presses of a browser that has connected.

    Args:
        client: The browser.
        presses: Where to record them.
        at_release: Called after each release.
    """
    field = client.gui.add_number("Press", 0, visible=False)

    # On the thread that reads the browser's messages, one after the other.
    @field.on_update
    async def _(event: viser.GuiEvent[viser.GuiNumberHandle[int]]) -> None:
        number, stamp = event.target.value, event.target.update_timestamp
        presses.record(client.client_id, number, moment_of(stamp))
        if number <= 0:
            at_release()

    run_script_in(client, read_script("holds", element_id(field)))
