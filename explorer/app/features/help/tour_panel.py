"""The card of the tour, over the scene of one browser."""

from __future__ import annotations

import threading
from collections.abc import Callable
from html import escape

import viser

from explorer.app.features.feature import Runner, Services
from explorer.app.features.help.tour import STEPS, Tour, start_tour
from explorer.app.features.optimise.actions import GiveUp
from explorer.app.state.frame import Frame
from explorer.app.widgets.buttons import open_button, press_button

# Place from the upper left corner of the scene, and width, in pixels.
PLACE, WIDTH = (14, 14), 330
PRESS = "tour"
BUTTONS = {
    "Skip": "End the tour; the command Tour begins it again.",
    "Back": "Go back to the step before.",
    "Show me": "Let the explorer do what this step asks for.",
    "Next": "Go on to the next step, or end the tour.",
}


class TourGuide(Runner):
    """Leads users through the tour, each in a browser of their own."""

    def __init__(self, services: Services) -> None:
        self._session = services.session
        self._services = services
        preferences = services.preferences
        self._is_seen = preferences is None or preferences.chosen.tour_seen
        self._lock = threading.RLock()
        self._cards: dict[int, _Card] = {}
        # Numbers of the searches whose results are given up once they end.
        self._given_up: set[int] = set()
        services.buttons.on(PRESS, self._press, values=BUTTONS)
        services.server.on_client_connect(self._connected)
        services.server.on_client_disconnect(self._disconnected)

    def begin(self, client: viser.ClientHandle) -> None:
        """Begin the tour, or begin it again."""
        with self._lock:
            self.end(client)
            self._cards[client.client_id] = _Card(client, start_tour(self._frame()))

    def end(self, client: viser.ClientHandle) -> None:
        """Close a browser's card."""
        with self._lock:
            card = self._cards.pop(client.client_id, None)
        if card is not None:
            card.remove()

    def follow(self, frame: Frame) -> None:
        """Mark the steps that a frame shows as done."""
        with self._lock:
            cards = tuple(self._cards.values())
        for card in cards:
            card.change(lambda tour: tour.after_frame(frame))
        run = frame.state.optimisation.run
        if run is not None and run.phase == "ended" and run.number in self._given_up:
            self._given_up.discard(run.number)
            self._session.do(GiveUp(run.number))

    def _connected(self, client: viser.ClientHandle) -> None:
        if not self._is_seen:
            self.begin(client)

    def _disconnected(self, client: viser.ClientHandle) -> None:
        with self._lock:
            self._cards.pop(client.client_id, None)

    def _frame(self) -> Frame:
        return Frame(self._session.state)

    def _press(self, name: str, client: viser.ClientHandle) -> None:
        card = self._cards.get(client.client_id)
        if card is None:
            return
        tour = card.tour
        if name == "Show me":
            change = tour.step.show
            self._session.do(lambda state: change(Frame(state)), who=client.client_id)
        elif name == "Skip" or (name == "Next" and tour.is_last):
            self.end(client)
            self._give_up(tour)
            self._is_seen = True
            self._services.remember(None, tour_seen=True)
        else:
            if name == "Next" and tour.step.after is not None:
                self._session.do(tour.step.after, who=client.client_id)
            frame = self._frame()
            card.change(lambda tour: tour.step_by(1 if name == "Next" else -1, frame))

    def _give_up(self, tour: Tour) -> None:
        """Put back what a search of the tour has left, unless its result was accepted."""
        number = tour.left_search(self._session.state)
        if number is not None:
            # While the search goes on, the first request cancels it, and its end reverts it.
            self._given_up.add(number)
            self._session.do(GiveUp(number))


class _Card:
    """The card of one browser."""

    def __init__(self, client: viser.ClientHandle, tour: Tour) -> None:
        self.tour = tour
        # Presses, frames and other browsers' presses come on threads of their own.
        self._lock = threading.Lock()
        self._is_removed = False
        gui = client.gui
        self._panel = gui.add_panel()
        self._panel.float(x=PLACE[0], y=PLACE[1], width=WIDTH)
        with self._panel.add_tab("Tour"):
            self._html = gui.add_html("")
        self._show()

    def change(self, advance: Callable[[Tour], Tour]) -> None:
        """Change the tour and show it, unless the card is closed."""
        with self._lock:
            tour = advance(self.tour)
            if tour != self.tour and not self._is_removed:
                self.tour = tour
                self._show()

    def remove(self) -> None:
        """Close the card."""
        with self._lock:
            self._is_removed = True
            self._panel.remove()

    def _show(self) -> None:
        self._html.content = card_words(self.tour)


def card_words(tour: Tour) -> str:
    """Return the card as HTML: the progress of the tour, its step, and the buttons."""
    step = tour.step
    dots = "".join(
        f'<span class="ex-dot{"" if i <= tour.at else " is-ahead"}"></span>'
        for i in range(len(STEPS))
    )
    done = '<span class="ex-within ex-strong">Done</span>' if tour.is_done else ""
    opens = open_button(step.tab, f"Open the tab {escape(step.tab)}", class_name="ex-link")
    first = "" if tour.at == 0 else _button("Back")
    show = "" if tour.is_done else _button("Show me")
    last = _button("Next", "Finish" if tour.is_last else "Next", look="is-main")
    return (
        '<div class="ex-card"><div class="ex-line ex-dim">'
        f"<span>{dots}</span><span>step {tour.at + 1} of {len(STEPS)}</span></div>"
        f"<h4>{escape(step.title)}</h4><div>{escape(step.text)}</div>"
        f"<div>{opens} {done}</div>"
        f'<div class="ex-ends">{_button("Skip", "Skip the tour", look="is-quiet")}'
        f"{first}{show}{last}</div></div>"
    )


def _button(name: str, words: str | None = None, *, look: str = "") -> str:
    return press_button(
        PRESS,
        name,
        escape(words or name),
        hint=BUTTONS[name],
        class_name=f"ex-button {look}".rstrip(),
    )
