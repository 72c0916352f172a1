"""The card of the tour: over the scene of one browser, and nobody else's."""

from __future__ import annotations

import threading
from collections.abc import Callable
from html import escape

import viser

from explorer.app.browser.viser_gaps import element_id
from explorer.app.features.help.tour import STEPS, Tour, begun
from explorer.app.session.session import Session
from explorer.app.state.frame import Frame
from explorer.app.widgets.labels import labelled, out_of_sight
from explorer.app.widgets.markup import DIM, WITHIN

# In pixels, from the upper left corner of the scene.
PLACE, WIDTH = (14, 14), 330
BUTTONS = {
    "Skip": "End the tour; the command Tour begins it again.",
    "Back": "Go back to the step before.",
    "Show me": "Let the explorer do what this step asks for.",
    "Next": "Go on to the next step, or end the tour.",
}


class TourGuide:
    """Leads users through the tour, each in a browser of their own.

    Args:
        session: In which they do what the steps ask for.
        ended: Called when a user has come to the end, or skipped the rest.
    """

    def __init__(self, session: Session, ended: Callable[[], None]) -> None:
        self._session = session
        self._ended = ended
        self._lock = threading.RLock()
        self._cards: dict[int, _Card] = {}

    def begin(self, client: viser.ClientHandle) -> None:
        """Begin the tour, from its first step if it is on already."""
        with self._lock:
            self.end(client)
            self._cards[client.client_id] = _Card(client, begun(self._frame()), self._press)

    def end(self, client: viser.ClientHandle) -> None:
        """Put a browser's card away."""
        with self._lock:
            card = self._cards.pop(client.client_id, None)
        if card is not None:
            card.remove()

    def disconnected(self, client: viser.ClientHandle) -> None:
        """Forget a browser."""
        with self._lock:
            self._cards.pop(client.client_id, None)

    def follow(self, frame: Frame) -> None:
        """See whether users have done what their step asks for."""
        with self._lock:
            cards = tuple(self._cards.values())
        for card in cards:
            card.change(lambda tour: tour.seen(frame))

    def _frame(self) -> Frame:
        return Frame(self._session.state)

    def _press(self, client: viser.ClientHandle, name: str) -> None:
        card = self._cards.get(client.client_id)
        if card is None:
            return
        tour = card.tour
        if name == "Show me":
            change = tour.step.show
            self._session.post(object(), lambda s: change(Frame(s)), who=client.client_id)
        elif name == "Skip" or (name == "Next" and tour.is_last):
            self.end(client)
            self._ended()
        else:
            if name == "Next" and tour.step.after is not None:
                self._session.do(tour.step.after, who=client.client_id)
            frame = self._frame()
            card.change(lambda tour: tour.moved(1 if name == "Next" else -1, frame))


class _Card:
    """The card of one browser."""

    def __init__(
        self,
        client: viser.ClientHandle,
        tour: Tour,
        press: Callable[[viser.ClientHandle, str], None],
    ) -> None:
        self.tour = tour
        # Hands, frames and other browsers' hands come on threads of their own.
        self._lock = threading.Lock()
        self._is_removed = False
        gui = client.gui
        self._panel = gui.add_panel()
        self._panel.float(x=PLACE[0], y=PLACE[1], width=WIDTH)
        with self._panel.add_tab("Tour"):
            self._html = gui.add_html("")
            self._buttons = {name: gui.add_button(name, hint=BUTTONS[name]) for name in BUTTONS}
            ids = {name: element_id(button) for name, button in self._buttons.items()}
            gui.add_html(out_of_sight(tuple(ids.values())))
        self._ids = ids
        for name, button in self._buttons.items():
            button.on_click(lambda _, name=name: press(client, name))
        self._show()

    def change(self, moved: Callable[[Tour], Tour]) -> None:
        """Go where the tour is moved to, and show it; nothing once the card is gone."""
        with self._lock:
            tour = moved(self.tour)
            if tour != self.tour and not self._is_removed:
                self.tour = tour
                self._show()

    def remove(self) -> None:
        """Take the card away."""
        with self._lock:
            self._is_removed = True
            self._panel.remove()

    def _show(self) -> None:
        self._html.content = card_words(self.tour, self._ids)


def card_words(tour: Tour, ids: dict[str, str]) -> str:
    """Return the card as HTML.

    Args:
        tour: How far it has got.
        ids: Of the buttons, by their names.
    """
    step = tour.step
    dots = "".join(
        '<span style="display:inline-block;width:7px;height:7px;border-radius:4px;'
        f'margin-right:5px;background:currentColor;opacity:{1 if i <= tour.at else 0.25}"></span>'
        for i in range(len(STEPS))
    )
    done = f'<span style="color:{WITHIN};font-weight:600">Done</span>' if tour.is_done else ""
    first = "" if tour.at == 0 else _button(ids["Back"], "Back")
    show = "" if tour.is_done else _button(ids["Show me"], "Show me")
    last = _button(ids["Next"], "Finish" if tour.is_last else "Next", is_main=True)
    return (
        '<div style="padding:6px 14px 12px;font-size:13px;line-height:1.5">'
        f'<div style="display:flex;justify-content:space-between;{DIM};font-size:12px">'
        f"<span>{dots}</span><span>step {tour.at + 1} of {len(STEPS)}</span></div>"
        f'<div style="font-size:15px;font-weight:600;margin:6px 0 2px">{escape(step.title)}</div>'
        f"<div>{escape(step.text)}</div>"
        f'<div style="{DIM};margin-top:4px">Tab {escape(step.tab)}, on the right. {done}</div>'
        '<div style="display:flex;gap:6px;justify-content:flex-end;margin-top:10px">'
        f"{_button(ids['Skip'], 'Skip the tour', is_quiet=True)}{first}{show}{last}</div></div>"
    )


def _button(identity: str, words: str, *, is_main: bool = False, is_quiet: bool = False) -> str:
    if is_main:
        look = (
            "background:var(--mantine-primary-color-filled);"
            "color:var(--mantine-primary-color-contrast);"
        )
    elif is_quiet:
        look = f"{DIM};margin-right:auto;padding-left:0;"
    else:
        look = "border:1px solid color-mix(in srgb,currentColor 35%,transparent);"
    style = f"cursor:pointer;padding:3px 10px;border-radius:4px;white-space:nowrap;{look}"
    return labelled(identity, words, escape(words), style=style)
