"""What only a browser knows: how large its window is, and whether its user prefers dark pages.

viser reports neither. A script sends both to a hidden text field of its tab.
"""

from __future__ import annotations

from collections.abc import Callable
from typing import Annotated, TypeVar

import msgspec
import viser

from explorer.app.browser.viser_gaps import element_id, run_script_in
from explorer.app.look import read_script

Pixels = Annotated[float, msgspec.Meta(ge=0, le=100_000)]
Described = TypeVar("Described")


class BrowserFacts(msgspec.Struct, frozen=True, forbid_unknown_fields=True):
    """What a browser reports about itself.

    Attributes:
        width, height: Size of its window, in CSS pixels.
        dark: Whether its user prefers dark pages.
    """

    width: Pixels
    height: Pixels
    dark: bool


_DECODER = msgspec.json.Decoder(BrowserFacts)


def ask_browser(client: viser.ClientHandle, answered: Callable[[BrowserFacts], None]) -> None:
    """Ask a browser about itself, once.

    Args:
        client: The browser.
        answered: Function that takes its answer, on the thread that reads the browsers'
            messages; it is not called for an answer that is not valid.
    """
    field = client.gui.add_text("Browser", "", visible=False)

    @field.on_update
    async def _(event: viser.GuiEvent[viser.GuiTextHandle]) -> None:
        field.remove()
        facts = decode_facts(event.target.value)
        if facts is not None:
            answered(facts)

    run_script_in(client, read_script("window_facts", element_id(field)))


def decode_text(text: str, decoder: msgspec.json.Decoder[Described]) -> Described | None:
    """Return what a text from a browser describes; None if no script of the page wrote it."""
    try:
        return decoder.decode(text)
    except (msgspec.MsgspecError, UnicodeEncodeError, RecursionError):
        return None


def decode_facts(answer: str) -> BrowserFacts | None:
    """Return the facts in an answer of a browser; None if it is not valid."""
    return decode_text(answer, _DECODER)
