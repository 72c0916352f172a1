"""The session: all changes of the state go through it, and each new frame comes from it.

A change is posted from any thread, as a function from the present state to an action, so
that it is made from the newest state and the newest value of its control.
"""

from __future__ import annotations

import threading
import time
from collections.abc import Callable, Sequence
from dataclasses import dataclass
from typing import NamedTuple

from explorer.app.session.history import History, UserAction, start_history
from explorer.app.state.actions import Action
from explorer.app.state.frame import Frame
from explorer.app.state.state import State
from explorer.errors import ExplorerError
from explorer.page.session.clock import moment_of
from explorer.page.session.latest import LatestWins
from explorer.page.state.presses import Press

# Seconds after which a thread that waits for changes looks whether the session has ended.
WAKE_SECONDS = 1.0
# Key of requests to draw the present state again.
REDRAW = "redraw"
UNDONE = "Another browser has undone {}. Redo or History brings it back."

Change = Callable[[State], Action | None]
"""Function from the present state to an action; None for none."""
Who = int | None
"""Id of a client; None for all clients, or for none in particular."""


@dataclass(frozen=True)
class HistoryMove:
    """A move through the history, a function from the present one to that at another step."""

    move: Callable[[History], History]


UNDO = HistoryMove(lambda history: history.move(-1))
REDO = HistoryMove(lambda history: history.move(1))


def move_to(number: int) -> HistoryMove:
    """Return the move to the step with a number."""
    return HistoryMove(lambda history: history.move_to(number))


class _Posted(NamedTuple):
    change: Change | HistoryMove
    key: object
    stamp: float
    who: Who


class Session:
    """Holds the state, makes the changes that are posted, and passes each new frame on.

    Args:
        draw: Called on the session's thread with each new frame.
        complain: Called with a message for people and the client it is for (None: all).
        report: Called with an unexpected exception; the session goes on.
        history: History that led to the state; None to start one with it.
        press_at: Returns the press of a client at a time, if there was one; None if no client
            reports presses.
        tell: Called with a message and the client whose step another one has undone.
        words_of: Returns the message for people about an error.
    """

    def __init__(
        self,
        state: State,
        draw: Callable[[Frame], None],
        complain: Callable[[str, Who], None],
        report: Callable[[Exception], None],
        history: History | None = None,
        *,
        press_at: Callable[[Who, float], Press | None] | None = None,
        tell: Callable[[str, Who], None] = lambda _, __: None,
        words_of: Callable[[ExplorerError], str] = str,
    ) -> None:
        self._state = state
        self._history = start_history(state) if history is None else history
        self._draw = draw
        self._complain = complain
        self._report = report
        self._press_at = press_at
        self._tell = tell
        self._words_of = words_of
        self._watchers: list[Callable[[State], None]] = []
        self._jobs: LatestWins[_Posted] = LatestWins(self._handle, "session")

    @property
    def state(self) -> State:
        """The present state."""
        return self._state

    @property
    def history(self) -> History:
        """The history so far."""
        return self._history

    def watch(self, see: Callable[[State], None]) -> None:
        """Call a function with each new state, on the session's thread; not all are drawn."""
        self._watchers.append(see)

    def post(
        self,
        key: object,
        change: Change | HistoryMove,
        *,
        stamp: float | None = None,
        who: Who = None,
    ) -> None:
        """Queue a change, in place of one with the same key that waits.

        Args:
            key: Key of the change, for instance its slider.
            change: Makes the action from the state at the time, or moves through the history.
            stamp: Time of the event by the clock of the machine, in seconds; now if None.
            who: The client to tell if the change is not possible.
        """
        at = moment_of(time.time() if stamp is None else stamp)
        self._jobs.post(key, at, _Posted(change, key, at, who))

    def do(self, change: Action | Change | HistoryMove, *, who: Who = None) -> None:
        """Queue an action, the function that makes it, or a move, which no other may replace."""
        self.post(object(), (lambda _: change) if isinstance(change, Action) else change, who=who)

    def latest_state(self) -> State:
        """Return the state once all changes are made that were posted before.

        A press that reads the state needs this, since it may follow a typed value at once.
        """
        made = threading.Event()
        self.post(object(), lambda _: made.set())
        while not (made.wait(WAKE_SECONDS) or self._jobs.is_stopped):
            pass
        return self._state

    def is_waiting(self, key: object) -> bool:
        """Whether a change with this key waits."""
        return key in self._jobs.waiting

    @property
    def has_changes(self) -> bool:
        """Whether a change waits, other than a request to draw the state again."""
        return bool(self._jobs.waiting - {REDRAW})

    def wait_until_idle(self, timeout: float = 60.0) -> bool:
        """Wait until all changes are made and drawn; return whether they are."""
        return self._jobs.wait_until_idle(timeout)

    def redraw(self) -> None:
        """Draw the present state again."""
        self.post(REDRAW, lambda _: None)

    def stop(self) -> None:
        """End the session's thread."""
        self._jobs.stop()

    def _handle(self, items: Sequence[_Posted]) -> None:
        try:
            for item in items:
                try:
                    self._apply(item)
                except ExplorerError as error:
                    self._complain(self._words_of(error), item.who)
            # A refusal is drawn too: the control that was moved must go back.
            self._draw(Frame(self._state))
        except Exception as error:  # noqa: BLE001 - one bad frame must not end the session
            self._report(error)

    def _apply(self, item: _Posted) -> None:
        if isinstance(item.change, HistoryMove):
            history = item.change.move(self._history).restore(self._state)
            undone = self._history.steps[history.at + 1 : self._history.at + 1]
            self._replace(history.step.state, history)
            # The first step of each other client.
            for who, words in {each.who: each.words for each in undone[::-1]}.items():
                if item.who is not None and who not in (None, item.who):
                    self._tell(UNDONE.format(words), who)
            return
        press = None if self._press_at is None else self._press_at(item.who, item.stamp)
        action = item.change(self._state)
        if action is None:
            return
        event = UserAction(action, item.key, item.stamp, press, item.who)
        state = event.apply(self._state)
        self._replace(state, self._history.record(event, state))

    def _replace(self, state: State, history: History) -> None:
        # The history first: a thread that sees the new state finds its step.
        self._history = history
        self._state = state
        for see in self._watchers:
            see(state)
