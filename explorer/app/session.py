"""The one door through which the state changes, and from which each new frame goes out.

A change is posted from any thread, as a function from the present state to an action, so
that it is made from the newest state and the newest value of its control.
"""

from __future__ import annotations

import time
from collections.abc import Callable, Sequence
from dataclasses import dataclass

from explorer.app.actions import Action, ByHand
from explorer.app.jobs import LatestWins
from explorer.app.state import Frame, State
from explorer.errors import ExplorerError

Change = Callable[[State], Action]
Who = int | None


@dataclass(frozen=True)
class _Posted:
    change: Change
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
    """

    def __init__(
        self,
        state: State,
        draw: Callable[[Frame], None],
        complain: Callable[[str, Who], None],
        report: Callable[[Exception], None],
    ) -> None:
        self._state = state
        self._draw = draw
        self._complain = complain
        self._report = report
        self._jobs: LatestWins[_Posted] = LatestWins(self._handle, "session")

    @property
    def state(self) -> State:
        """The present state."""
        return self._state

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
        at = time.time() if stamp is None else stamp
        self._jobs.post(key, at, _Posted(change, key, at, who))

    def do(self, action: Action, *, who: Who = None) -> None:
        """Ask for an action that must not be merged with another of its kind."""
        self.post(object(), lambda _: action, who=who)

    def is_waiting(self, key: object) -> bool:
        """Whether a change of this key waits."""
        return self._jobs.is_waiting(key)

    @property
    def has_more(self) -> bool:
        """Whether any change waits, so that another frame follows at once."""
        return self._jobs.has_more

    def wait_until_idle(self, timeout: float = 10.0) -> bool:
        """Wait until all that was posted is done and drawn; say whether it is."""
        return self._jobs.wait_until_idle(timeout)

    def redraw(self) -> None:
        """Draw the present state again."""
        self.post("redraw", lambda _: _Nothing())

    def stop(self) -> None:
        """End the session's thread."""
        self._jobs.stop()

    def _handle(self, items: Sequence[_Posted]) -> None:
        try:
            for item in items:
                try:
                    action = ByHand(item.change(self._state), item.key, item.stamp)
                    self._state = action.apply(self._state)
                except ExplorerError as error:
                    self._complain(str(error), item.who)
            # Drawn also after a refusal: the control that asked for it must go back.
            self._draw(Frame(self._state))
        except Exception as error:  # noqa: BLE001 - one bad frame must not end the session
            self._report(error)


@dataclass(frozen=True)
class _Nothing:
    def apply(self, state: State) -> State:
        return state
