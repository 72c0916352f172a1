"""Facts that only a browser knows: when its user presses and releases, and whether it is answered.

viser reports values alone. So scripts of the page write the rest to hidden fields, by the same way
and in the same order as the values of other controls: a value is known to come from the press
during which it arrives.
"""

from __future__ import annotations

from collections.abc import Callable
from typing import TypeVar

import msgspec
import viser

from explorer.page.browser.viser_gaps import element_id, run_script_in
from explorer.page.look import read_script
from explorer.page.session.clock import moment_of
from explorer.page.state.presses import Presses

Described = TypeVar("Described")


def decode_text(text: str, decoder: msgspec.json.Decoder[Described]) -> Described | None:
    """Return the facts in a text from a browser; None if no script of the page wrote it."""
    try:
        return decoder.decode(text)
    except (msgspec.MsgspecError, UnicodeEncodeError, RecursionError):
        return None


def listen(
    client: viser.ClientHandle, presses: Presses, at_release: Callable[[], None], *, is_saved: bool
) -> None:
    """Listen to a browser that has connected: record its presses, and answer what it asks.

    Args:
        client: The browser.
        presses: Where its presses are recorded.
        at_release: Called after each release.
        is_saved: Whether the session is saved, of which the page tells while nobody answers it.
    """
    field, questions = (
        client.gui.add_number(name, 0, visible=False) for name in ("Press", "Question")
    )

    # On the thread that reads the browser's messages, one after the other.
    @field.on_update
    async def _(event: viser.GuiEvent[viser.GuiNumberHandle[int]]) -> None:
        number, stamp = event.target.value, event.target.update_timestamp
        presses.record(client.client_id, number, moment_of(stamp))
        if number <= 0:
            at_release()

    # Whether there is anybody: whatever arrives there is an answer.
    @questions.on_update
    async def _(_: viser.GuiEvent[viser.GuiNumberHandle[int]]) -> None:
        run_script_in(client, "")

    run_script_in(client, read_script("holds", element_id(field)))
    run_script_in(client, read_script("connection", element_id(questions), is_saved))
