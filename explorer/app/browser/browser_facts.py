"""What only a browser knows: when its user presses and releases.

viser reports values alone. So scripts of the page write the rest to hidden fields, by the same way
and in the same order as the values of other controls: a value is known to come from the press
during which it arrives.
"""

from __future__ import annotations

from collections.abc import Callable
from typing import TypeVar

import msgspec
import viser

from explorer.app.browser.viser_gaps import element_id, run_script_in
from explorer.app.look import read_script
from explorer.app.session.clock import moment_of
from explorer.app.state.presses import Presses

Described = TypeVar("Described")


def decode_text(text: str, decoder: msgspec.json.Decoder[Described]) -> Described | None:
    """Return what a text from a browser describes; None if no script of the page wrote it."""
    try:
        return decoder.decode(text)
    except (msgspec.MsgspecError, UnicodeEncodeError, RecursionError):
        return None


def listen(client: viser.ClientHandle, presses: Presses, at_release: Callable[[], None]) -> None:
    """Record the presses of a browser that has connected; call `at_release` after each release."""
    field = client.gui.add_number("Press", 0, visible=False)

    # On the thread that reads the browser's messages, one after the other.
    @field.on_update
    async def _(event: viser.GuiEvent[viser.GuiNumberHandle[int]]) -> None:
        number, stamp = event.target.value, event.target.update_timestamp
        presses.record(client.client_id, number, moment_of(stamp))
        if number <= 0:
            at_release()

    run_script_in(client, read_script("holds", element_id(field)))
