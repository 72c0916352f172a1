"""What a browser is sent: it shows the same as one that was sent everything, with less."""

from __future__ import annotations

import asyncio
from collections.abc import AsyncGenerator, Iterable, Sequence
from itertools import accumulate
from typing import Any

import msgspec
import numpy as np
import server_clock
from viser._messages import ReplayDoneMessage, RunJavascriptMessage, SceneNodeUpdateMessage
from viser.infra._messages import Message

from explorer.app.server import Running
from explorer.app.state.actions import Set, open_design
from explorer.mechanism.design_file import PRESETS
from explorer.page.browser.sending import Sending

Fields = dict[str, Any]

# Switches of the view, each of which shows other parts of the scene.
SWITCHES = (
    *(
        "workspace.solid",
        "workspace.planes",
        "singular.ball",
        "forces.shown",
        "precision.ellipsoid",
    ),
    *("leaves", "clearance", "swept", "ghosts", "legs", "flags", "grid", "labels", "handle"),
)
# Messages of a window.
SIZE = 40


class Page:
    """What a browser shows that applies the messages it is sent, in their order.

    Attributes:
        parts: The parts of the scene, hidden ones too, with their properties, by name.
        controls: The controls with their properties, by id.
    """

    def __init__(self) -> None:
        # Viser's page has axes of its own.
        self.parts: dict[str, Fields] = {"/WorldAxes": {"visible": True}}
        self.controls: dict[str, Fields] = {}

    def apply(self, messages: Iterable[Message]) -> None:
        """Apply messages as they are now, while they are on their way."""
        for message in messages:
            kind: Any = type(message)
            fields: Fields = msgspec.msgpack.decode(
                msgspec.msgpack.encode(message.as_serializable_dict())
            )
            things = {"scene": self.parts, "gui": self.controls}.get(kind.entity_type or "")
            if things is None:
                continue
            name = fields.pop(kind.entity_id_field)
            if kind.lifecycle_phase == "remove":
                things.pop(name, None)
                continue
            if kind.lifecycle_phase == "create":
                things[name] = {}
            # The root of the scene and the panel of all others are there from the beginning.
            is_given = name in ("", "viser-control-panel")
            thing = things.setdefault(name, {}) if is_given else things[name]
            thing |= fields | fields.get("props", {}) | fields.get("updates", {})

    def visible(self) -> dict[str, Fields]:
        """Return the parts of the scene that are in sight."""

        def is_visible(name: str) -> bool:
            lineage = accumulate(name.split("/"), "{}/{}".format)
            return all(self.parts.get(each, {}).get("visible", True) for each in lineage)

        return {name: shown(part) for name, part in self.parts.items() if is_visible(name)}


def shown(thing: Fields) -> Fields:
    """Return the properties of a thing without what they came with."""
    return {k: v for k, v in thing.items() if k not in ("type", "props", "updates")}


class Browser:
    """A browser that connects now, and reads what is due whenever it is asked to.

    Args:
        running: The explorer.
        sending: What decides on what it is sent; None if it is sent everything.
    """

    def __init__(self, running: Running, sending: Sending | None) -> None:
        server: Any = running.viser
        self._buffer = server._websock_server.get_message_buffer()
        self._pause = RunJavascriptMessage("pause")
        end = ReplayDoneMessage()
        windows = self._due(end)
        self._windows = windows if sending is None else sending.filtered(windows, end)
        self.page = Page()

    async def _due(self, end: Message) -> AsyncGenerator[Sequence[Message]]:
        last, backlog = -1, self._buffer.message_counter - 1
        while True:
            until = min(last + SIZE, self._buffer.message_counter - 1)
            due = (self._buffer.message_from_id.get(each) for each in range(last + 1, until + 1))
            window: list[Message] = [message for message in due if message is not None]
            yield [*window, *([end] if last < backlog <= until else []), self._pause]
            last = until

    async def read(self) -> None:
        """Read all that is due."""
        for _ in range(self._buffer.message_counter // SIZE + 2):
            self.page.apply(await anext(self._windows))


def test_browser_shows_the_same_whenever_it_connects_and_without_what_is_hidden(
    running: Running,
) -> None:
    session, random = running.page.session, np.random.default_rng(18)

    async def use() -> list[Page]:
        browsers = [Browser(running, Sending())]
        for round_ in range(6):
            await browsers[-1].read()
            for switch in random.permutation(SWITCHES)[:7]:
                session.do(Set(f"view.{switch}", bool(random.integers(2))))
            session.do(open_design(PRESETS["paper-initial" if round_ % 2 else "paper-optimal"]))
            # Some of it comes while it is read.
            await browsers[0].read()
            assert server_clock.settle(running.page, 60.0)
            browsers.append(Browser(running, Sending()))
        browsers.append(Browser(running, None))
        for browser in browsers:
            await browser.read()
        return [browser.page for browser in browsers]

    *pages, whole = asyncio.run(use())
    for page in pages:
        assert page.visible() == whole.visible()
        assert {k: shown(v) for k, v in page.controls.items()} == {
            k: shown(v) for k, v in whole.controls.items()
        }
    # The last one was never sent what was hidden when it came.
    assert pages[-1].parts.keys() - {"/WorldAxes"} == whole.visible().keys() < whole.parts.keys()


def test_own_colour_of_a_hidden_part_comes_with_the_part(running: Running) -> None:
    session, sending = running.page.session, Sending()
    session.do(Set("view.grid", False))
    assert server_clock.settle(running.page, 60.0)

    async def own() -> AsyncGenerator[Sequence[Message]]:
        yield [SceneNodeUpdateMessage("/shadow", {"color": (1, 2, 3)})]

    async def show() -> dict[str, Fields]:
        browser = Browser(running, sending)
        await browser.read()
        assert "/shadow" not in browser.page.parts
        assert [window async for window in sending.filtered(own(), None)] == []
        session.do(Set("view.grid", True))
        assert server_clock.settle(running.page, 60.0)
        await browser.read()
        return browser.page.visible()

    assert asyncio.run(show())["/shadow"]["color"] == [1, 2, 3]
