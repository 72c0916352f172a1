"""A desk with the tour or a lesson in one browser."""

from __future__ import annotations

from collections.abc import Callable
from types import SimpleNamespace
from typing import Any

from desk import Desk, ScriptedBrowser
from sample_states import iterates_of
from services import services_for

from explorer.app.features.help.guide import Card, CourseGuide
from explorer.app.features.help.lessons import TOUR
from explorer.app.features.optimise.actions import end_run
from explorer.app.features.optimise.state import Optimisation, SearchResult
from explorer.app.state.actions import Action
from explorer.app.state.frame import Frame
from explorer.app.state.state import State, open_state
from explorer.mechanism.design_file import PRESETS

ONE, OTHER = 1, 2
"""Ids of the browser with the tour, and of one without."""
BROWSER: Any = ScriptedBrowser()


class TourDesk(Desk):
    """A desk with the tour of one browser, whose messages are kept with the browser's id."""

    def __init__(self) -> None:
        self.told: list[tuple[str, int | None]] = []
        self._clients: dict[int, Any] = {
            who: SimpleNamespace(client_id=who, _websock_connection=self) for who in (ONE, OTHER)
        }
        self._press: Callable[[str, Any], None]
        self._leave: Callable[[Any], None]
        self._guide: CourseGuide | None = None
        super().__init__(open_state(PRESETS["paper-optimal"]))
        server: Any = SimpleNamespace(on_client_disconnect=self._keep_leave)
        buttons: Any = SimpleNamespace(on=self._keep_press)
        tell: Any = self._keep_message
        services = services_for(server, self.session, buttons=buttons, tell=tell)
        self._guide = CourseGuide(services)

    def queue_message(self, message: object) -> None:
        """Drop what is sent to the browser."""

    def draw(self, frame: Frame) -> None:
        """Let the tour follow a frame."""
        if self._guide is not None:
            self._guide.follow(frame)

    def begin(self, *presses: str, file: str = TOUR, at: int = 0, who: int = ONE) -> None:
        """Begin the tour, or a lesson, at a step, and press buttons of its card."""
        assert self._guide is not None
        self._guide.begin(self._clients[who], file, at)
        for name in presses:
            self.tour(name, who)

    @property
    def card(self) -> Card:
        """The card of the browser."""
        assert self._guide is not None
        return self._guide.cards[ONE]

    def leave(self) -> None:
        """Close or reload the browser with the tour."""
        self._leave(self._clients[ONE])

    def tour(self, name: str, who: int = ONE) -> None:
        """Press a button of the card of a browser."""
        self._press(name, self._clients[who])
        assert self.session.wait_until_idle()

    def do(self, action: Action, who: int = OTHER) -> State:
        """Do an action, by default of the other browser; return the state after it."""
        self.session.do(action, who=who)
        return self.state

    def end_search(self, *, with_result: bool) -> None:
        """End the present search."""
        run = Optimisation.of(self.state).run
        assert run is not None
        iterates = iterates_of(self.state, 2) if with_result else ()
        status, best = ("converged", iterates[-1]) if iterates else ("cancelled", None)
        self.do(end_run(run.number, SearchResult(status, "It ended.", best), iterates))

    def _keep_message(self, message: str, who: int | None = None) -> None:
        self.told.append((message, who))

    def _keep_press(self, _: str, press: Callable[[str, Any], None], **__: object) -> None:
        self._press = press

    def _keep_leave(self, leave: Callable[[Any], None]) -> None:
        self._leave = leave
