"""The one door through which the state changes, and from which each new frame goes out.

A change is posted from any thread, as a function from the present state to an action, so
that it is made from the newest state and the newest value of its control.
"""

from __future__ import annotations

import time
from collections.abc import Callable, Sequence
from dataclasses import dataclass

from explorer.app.session.field_words import message_of
from explorer.app.session.gestures import ByHand
from explorer.app.session.history import History, begun, restored
from explorer.app.session.jobs import LatestWins
from explorer.app.state.action import Action
from explorer.app.state.frame import Frame
from explorer.app.state.presses import Press
from explorer.app.state.state import State
from explorer.errors import ExplorerError

Change = Callable[[State], Action]
Who = int | None


@dataclass(frozen=True)
class Travel:
    """A way through the history.

    Attributes:
        go: From the history as it is to the one at another step.
    """

    go: Callable[[History], History]


UNDO = Travel(lambda history: history.moved(-1))
REDO = Travel(lambda history: history.moved(1))


def to_step(number: int) -> Travel:
    """Return the way to the step with a number."""
    return Travel(lambda history: history.moved_to(number))


@dataclass(frozen=True)
class _Posted:
    change: Change | Travel
    key: object
    stamp: float
    who: Who


class Session:
    """Holds the state, applies what is posted, and hands each new frame to be drawn.

    Args:
        state: The first one.
        draw: Called on the session's thread with each new frame.
        complain: Called with a message for people and the client it is for (None: all).
        report: Called with an unexpected exception; the session goes on.
        history: That led to the state; None where it begins with it.
        press_at: Tells the press of a client at a time, if it held anything then; None if no
            client tells of presses.
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
    ) -> None:
        self._state = state
        self._history = begun(state) if history is None else history
        self._draw = draw
        self._complain = complain
        self._report = report
        self._press_at = press_at
        self._jobs: LatestWins[_Posted] = LatestWins(self._handle, "session")

    @property
    def state(self) -> State:
        """The present state."""
        return self._state

    @property
    def history(self) -> History:
        """What was done so far."""
        return self._history

    def post(
        self, key: object, change: Change, *, stamp: float | None = None, who: Who = None
    ) -> None:
        """Ask for a change; of one key only the newest that waits is made.

        Args:
            key: What it is about, for instance the slider.
            change: Makes the action from the state at the time.
            stamp: When the event happened; now if None.
            who: The client to tell should it not be possible.
        """
        self._post(key, change, stamp, who)

    def do(self, action: Action, *, who: Who = None) -> None:
        """Ask for an action that must not be merged with another of its kind."""
        self.post(object(), lambda _: action, who=who)

    def travel(self, travel: Travel, *, who: Who = None) -> None:
        """Ask to go through the history; no way is left out."""
        self._post(object(), travel, None, who)

    def travel_to(self, key: object, number: int, *, stamp: float | None, who: Who) -> None:
        """Ask for the step with a number; of one key only the newest that waits is done."""
        self._post(key, to_step(number), stamp, who)

    def is_waiting(self, key: object) -> bool:
        """Whether a change of this key waits."""
        return self._jobs.is_waiting(key)

    @property
    def has_more(self) -> bool:
        """Whether any change waits, so that another frame follows at once."""
        return self.waiting > 0

    @property
    def waiting(self) -> int:
        """How many changes wait."""
        return self._jobs.waiting

    def wait_until_idle(self, timeout: float = 10.0) -> bool:
        """Wait until all that was posted is done and drawn; say whether it is."""
        return self._jobs.wait_until_idle(timeout)

    def redraw(self) -> None:
        """Draw the present state again."""
        self.post("redraw", lambda _: _Nothing())

    def stop(self) -> None:
        """End the session's thread."""
        self._jobs.stop()

    def _post(self, key: object, change: Change | Travel, stamp: float | None, who: Who) -> None:
        at = time.time() if stamp is None else stamp
        self._jobs.post(key, at, _Posted(change, key, at, who))

    def _handle(self, items: Sequence[_Posted]) -> None:
        try:
            for item in items:
                try:
                    self._make(item)
                except ExplorerError as error:
                    self._complain(message_of(error), item.who)
            # Drawn also after a refusal: the control that asked for it must go back.
            self._draw(Frame(self._state))
        except Exception as error:  # noqa: BLE001 - one bad frame must not end the session
            self._report(error)

    def _make(self, item: _Posted) -> None:
        if isinstance(item.change, Travel):
            history = item.change.go(self._history)
            self._state = restored(history.step, self._state)
            self._history = history
            return
        press = None if self._press_at is None else self._press_at(item.who, item.stamp)
        action = ByHand(item.change(self._state), item.key, item.stamp, press)
        self._state = action.apply(self._state)
        self._history = self._history.recorded(action, self._state)


@dataclass(frozen=True)
class _Nothing(Action):
    def apply(self, state: State) -> State:
        return state
