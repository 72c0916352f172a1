"""A session with hands: what the tests of the panels share."""

from __future__ import annotations

import re
from typing import Any

import msgspec
import viser

from explorer.app.session.session import Session
from explorer.app.state.actions import SetLimits
from explorer.app.state.state import State


class Desk:
    """A session whose complaints are kept, and hands that use the page's controls."""

    def __init__(self, state: State) -> None:
        self.complaints: list[str] = []
        self.session = Session(
            state, lambda _: None, lambda message, _: self.complaints.append(message), self._fail
        )

    @property
    def state(self) -> State:
        assert self.session.wait_until_idle()
        return self.session.state

    def use(self, handle: Any, value: object) -> None:
        """Set an input as a browser does: the value first, then word of it with a client."""
        handle.value = value
        self.click(handle)

    def click(self, handle: Any) -> None:
        """Say that an input was used, as a browser does."""
        event = viser.GuiEvent(client=None, client_id=1, target=handle)
        for callback in handle._impl.update_cb:
            callback(event)

    def _fail(self, error: Exception) -> None:
        raise error


def thick(state: State, *radii: float) -> State:
    """Return the state with radii of the legs: four, or one for all."""
    r1, r2, r3, r4 = radii if len(radii) == 4 else radii * 4
    limits = msgspec.structs.replace(state.design.limits, leg_radii=(r1, r2, r3, r4))
    return SetLimits(limits).apply(state)


def rows_of(html: str) -> list[list[str]]:
    """Return the cells of the rows of an HTML table, without the heading."""
    rows = re.findall(r"<tr.*?</tr>", html)
    return [
        [re.sub("<.*?>", "", cell) for cell in re.findall(r"<td.*?</td>", row)] for row in rows[1:]
    ]


def number(text: str) -> float:
    return float(text.replace("−", "-").rstrip(" %"))
