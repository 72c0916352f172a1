"""What only a browser knows: how large its window is, and whether its user prefers dark pages.

viser tells of neither. A picture of one pixel does: what it does once it is loaded puts both
into the browser's own storage, which viser can read.
"""

from __future__ import annotations

import time
from html import escape
from typing import Annotated

import msgspec
import viser

NAME = "explorer-browser"
# viser puts this in front of the names that it reads.
PREFIX = "viser-user:"
PIXEL = "data:image/gif;base64,R0lGODlhAQABAAAAACH5BAEKAAEALAAAAAABAAEAAAICTAEAOw=="

TELL = (
    f"localStorage.setItem('{PREFIX}{NAME}',JSON.stringify({{"
    "width:innerWidth,height:innerHeight,"
    "dark:matchMedia('(prefers-color-scheme: dark)').matches}))"
)

# Between two looks, and until none is expected any more.
LOOK_SECONDS, PATIENCE_SECONDS = 0.1, 10.0

Pixels = Annotated[float, msgspec.Meta(ge=0, le=100_000)]


class BrowserFacts(msgspec.Struct, frozen=True, forbid_unknown_fields=True):
    """What a browser says of itself.

    Attributes:
        width, height: Of its window, in CSS pixels.
        dark: Whether its user prefers dark pages.
    """

    width: Pixels
    height: Pixels
    dark: bool


def ask(client: viser.ClientHandle) -> BrowserFacts | None:
    """Ask a browser, and wait for what it says; None if it says nothing sensible in time."""
    # What an earlier visit left would be taken for the answer.
    client.local_storage.remove_item(NAME)
    pixel = client.gui.add_html(
        f'<img src="{PIXEL}" alt="" width="1" height="1" style="position:absolute" '
        f'onload="{escape(TELL)}">'
    )
    deadline = time.monotonic() + PATIENCE_SECONDS
    told: str | None = None
    try:
        while told is None and time.monotonic() < deadline:
            time.sleep(LOOK_SECONDS)
            told = client.local_storage.get_item(NAME, timeout=PATIENCE_SECONDS)
    except (TimeoutError, RuntimeError):
        # It has gone, or is none that answers.
        return None
    finally:
        pixel.remove()
    return None if told is None else facts_of(told)


def facts_of(told: str) -> BrowserFacts | None:
    """Return what a browser said, if it is what was asked for."""
    try:
        return msgspec.json.decode(told, type=BrowserFacts)
    except (msgspec.MsgspecError, RecursionError):
        return None
