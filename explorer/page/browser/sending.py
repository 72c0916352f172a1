"""The messages to one browser: parts of the scene once they are in sight, and no value twice.

viser keeps the last message on each thing, and sends all of them to a browser that connects: the
mesh of each hidden part, and with each value that has changed the one that it had at first.
"""

from __future__ import annotations

from collections.abc import AsyncGenerator, Iterable, Iterator, Sequence
from contextlib import aclosing
from copy import copy
from dataclasses import replace
from itertools import accumulate
from typing import Any

from viser._messages import (
    GuiUpdateMessage,
    SceneNodeUpdateMessage,
    SetSceneNodeVisibilityMessage,
)
from viser.infra._messages import Message


class Sending:
    """Decides what one browser is sent, and when.

    A part of the scene waits, with all messages on it, until it and the parts that it belongs to
    are visible. Once it was sent it is kept up to date, hidden or not.
    """

    def __init__(self) -> None:
        # Whether what is due to all browsers was so before this one connected.
        self._is_backlog = True
        # The messages that make controls, by the id of the control, during the backlog.
        self._controls: dict[str, Any] = {}
        # The messages on parts that wait, by the name of the part, that which makes it first.
        self._waiting: dict[str, list[Message]] = {}
        # Viser's page has axes of its own from the beginning.
        self._sent = {"/WorldAxes"}
        # Whether parts are visible if those that they belong to are.
        self._visible: dict[str, bool] = {}

    async def filtered(
        self, windows: AsyncGenerator[Sequence[Message]], backlog_end: Message | None
    ) -> AsyncGenerator[Sequence[Message]]:
        """Yield the messages to send, of windows of messages that are due.

        Args:
            windows: Messages to all browsers, or to this one alone.
            backlog_end: The message after those that were due before this browser connected; None
                if the messages are to it alone.
        """
        async with aclosing(windows):
            async for window in windows:
                chosen: list[Message] = []
                for message in window:
                    if message is backlog_end:
                        chosen.extend(self._end_backlog())
                    chosen.extend(self._take(message, is_own=backlog_end is None))
                if chosen:
                    yield chosen

    def backlog(self, messages: Iterable[Message]) -> list[Message]:
        """Return the messages for a new browser, of those to all browsers."""
        taken = [message for each in messages for message in self._take(each, is_own=False)]
        return [*taken, *self._end_backlog()]

    def _take(self, message: Message, *, is_own: bool) -> Iterator[Message]:
        """Yield the messages that take the place of one that is due."""
        kind, name = _subject_of(message)
        phase = message.lifecycle_phase
        if kind == "gui" and self._is_backlog and not is_own:
            if phase == "create":
                self._controls[name] = message
            elif isinstance(message, GuiUpdateMessage) and name in self._controls:
                # What makes the control is sent later than this was due, and has its values.
                props = self._controls[name].props
                left = {k: v for k, v in message.updates.items() if not hasattr(props, k)}
                if not left:
                    return
                message = replace(message, updates=left)
        # Parts that a browser has of its own do not wait.
        is_part = kind == "scene" and getattr(message, "owner", "") == ""
        if is_part and phase == "create" and name not in self._sent:
            self._waiting[name] = []
        if isinstance(message, SetSceneNodeVisibilityMessage) and is_part:
            self._visible[name] = message.visible
        if not is_part or name not in self._waiting:
            yield message
        elif phase != "remove":
            self._waiting[name].append(message)
        if is_part and phase == "remove":
            self._waiting.pop(name, None)
            self._visible.pop(name, None)
            self._sent.discard(name)
        elif isinstance(message, SetSceneNodeVisibilityMessage) and not self._is_backlog:
            yield from self._release(name)

    def _end_backlog(self) -> Iterator[Message]:
        self._is_backlog = False
        self._controls.clear()
        yield from self._release("")

    def _release(self, name: str) -> Iterator[Message]:
        """Yield the messages on a part and on those within it that need not wait any more."""
        for each in tuple(self._waiting):
            lineage = accumulate(each.split("/"), "{}/{}".format)
            if f"{each}/".startswith(f"{name}/") and all(
                self._visible.get(part, part not in self._waiting) for part in lineage
            ):
                self._sent.add(each)
                yield from _merge_updates(self._waiting.pop(each))


def _subject_of(message: Any) -> tuple[str, str]:
    """Return the kind of thing that a message is on, "scene" or "gui", and its name or id."""
    if message.lifecycle_phase in ("create", "remove"):
        return message.entity_type, getattr(message, message.entity_id_field)
    return message.entity_state_key() or ("", "")


def _merge_updates(messages: list[Any]) -> Iterator[Message]:
    """Yield messages on a part, the first of which makes it, with its last properties."""
    first, *others = messages
    made = copy(first)
    made.props = copy(first.props)
    for message in others:
        if isinstance(message, SceneNodeUpdateMessage):
            for name, value in message.updates.items():
                setattr(made.props, name, value)
    yield made
    yield from (each for each in others if not isinstance(each, SceneNodeUpdateMessage))
