"""A session whose controls are used, and what else the tests of the panels share."""

from __future__ import annotations

import asyncio
import inspect
import re
import threading
from collections.abc import Callable, Iterable
from dataclasses import replace
from typing import Any

import msgspec
import numpy as np
import viser
from page_widgets import widgets

from explorer.app.features.feature import Services
from explorer.app.session.session import Session, Who
from explorer.app.state.actions import Set
from explorer.app.state.frame import Frame
from explorer.app.state.state import State, open_state
from explorer.app.widgets.buttons import Buttons
from explorer.measures.field_words import message_of
from explorer.mechanism.design_file import PRESETS
from explorer.mechanism.pose import Pose
from explorer.page.widgets.assigning import Assigner, Update


class Browser:
    """A browser, as far as the buttons in markup know one."""

    client_id = 1


CLIENT: Any = Browser()


class ScriptedBrowser(Browser):
    """A browser that keeps the scripts that are sent to it alone."""

    def __init__(self) -> None:
        self.scripts: list[str] = []
        self._websock_connection = self

    def queue_message(self, message: Any) -> None:
        self.scripts.append(message.source)


SUPERSCRIPTS = str.maketrans("⁻⁰¹²³⁴⁵⁶⁷⁸⁹", "-0123456789")


class Desk:
    """A session whose complaints are kept, and ways to use the controls of a page."""

    def __init__(self, state: State) -> None:
        self.complaints: list[str] = []
        self._drawn = threading.Condition()
        self.session = Session(state, self._draw, self.complain, self._fail, words_of=message_of)

    @property
    def state(self) -> State:
        assert self.session.wait_until_idle()
        return self.session.state

    def draw(self, frame: Frame) -> None:
        """Follow a frame, on the session's thread; a desk of its own kind overrides this."""

    def wait(self, condition: Callable[[State], bool]) -> State:
        """Return the state once it meets a condition, also while the session is never idle."""
        with self._drawn:
            assert self._drawn.wait_for(lambda: condition(self.session.state), 120.0)
        return self.session.state

    def use(self, handle: Any, value: object) -> None:
        """Set an input as a browser does: the value first, then word of it with a client."""
        handle.value = value
        self.click(handle)

    def click(self, handle: Any) -> None:
        """Say that an input was used, as a browser does."""
        event = viser.GuiEvent(client=None, client_id=1, target=handle)
        for callback in handle._impl.update_cb:
            outcome = callback(event)
            if inspect.iscoroutine(outcome):
                asyncio.run(outcome)

    def press(self, buttons: Buttons, name: str, value: object = "") -> None:
        """Press a button in markup."""
        buttons.press(name, str(value), CLIENT)

    def complain(self, message: str, who: Who = None) -> None:
        """Keep a complaint, whoever it is for."""
        del who
        self.complaints.append(message)

    def _draw(self, frame: Frame) -> None:
        self.draw(frame)
        with self._drawn:
            self._drawn.notify_all()

    def _fail(self, error: Exception) -> None:
        raise error


def random_states(count: int, seed: int = 3) -> list[State]:
    """Return the paper's optimum in poses all about its home."""
    rng = np.random.default_rng(seed)
    poses = (
        Pose.of_yaw_pitch_roll(rng.uniform(-8.0, 15.0, 3), rng.uniform(-80.0, 80.0, 3))
        for _ in range(count)
    )
    return [open_state(PRESETS["paper-optimal"], pose) for pose in poses]


def thick(state: State, *radii: float) -> State:
    """Return the state with radii of the legs: four, or one for all."""
    r1, r2, r3, r4 = radii if len(radii) == 4 else radii * 4
    limits = msgspec.structs.replace(state.design.limits, leg_radii=(r1, r2, r3, r4))
    return Set("design.limits", limits).apply(state)


def viewed(state: State, **changes: Any) -> State:
    """Return the state with other values of what is shown."""
    return Set("view", replace(state.view, **changes)).apply(state)


def by_name(updates: Iterable[Update]) -> dict[str, dict[str, Any]]:
    """Return the values that are assigned, by the names of node and property."""
    found: dict[str, dict[str, Any]] = {}
    for handle, name, value in updates:
        found.setdefault(handle.name, {})[name] = value
    return found


def controls_of(services: Services, panel: Any, state: State) -> dict[str, Any]:
    """Return the controls of a panel, visible or not, by their labels, set as in a state.

    The panel is the last one that was made for its server.
    """
    Assigner(services.server).assign(panel.updates(Frame(state)))
    return {widget.label: widget.handle for widget in widgets(services.server)}


def markup_of(panel: Any, state: State) -> str:
    """Return the markup that a panel shows in a state."""
    return " ".join(str(v) for _, name, v in panel.updates(Frame(state)) if name == "content")


def rows_of(html: str) -> list[list[str]]:
    """Return the cells of the rows of an HTML table, without the heading."""
    rows = re.findall(r"<tr.*?</tr>", html)
    return [
        [re.sub("<.*?>", "", cell) for cell in re.findall(r"<td.*?</td>", row)] for row in rows[1:]
    ]


def number(text: str) -> float:
    """Return the number that a text of the page stands for."""
    plain = text.replace(",", "").replace("−", "-").rstrip(" %")
    mantissa, _, power = plain.partition(" × 10")
    return float(mantissa) * 10.0 ** int(power.translate(SUPERSCRIPTS) or 0)
