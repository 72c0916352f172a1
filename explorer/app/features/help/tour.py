"""The tour for first-time users: five steps, each done by the user, shown or skipped."""

from __future__ import annotations

import math
import threading
from collections.abc import Callable
from dataclasses import dataclass, replace
from html import escape

import viser

from explorer.app.features.feature import Runner, Services
from explorer.app.features.optimise.actions import StartRun
from explorer.app.features.optimise.state import Optimisation
from explorer.app.state.actions import Action, GoHome, Set, SetPosition, SetVariable
from explorer.app.state.frame import Frame
from explorer.app.widgets.buttons import open_button, press_button

# What "Show me" does: the stride of the platform in reaches, the height over the base plane in
# warning lengths, and the factor on a variable.
STRIDE, NEAR, GROWTH = 0.1, 0.5, 1.1
# Place of the card from the upper left corner of the scene, and its width, in pixels.
PLACE, WIDTH = (14, 14), 330
PRESS = "tour"
BUTTONS = {
    "Skip": "End the tour; the command Tour begins it again.",
    "Back": "Go back to the step before.",
    "Show me": "Let the explorer do what this step asks for.",
    "Next": "Go on to the next step, or end the tour.",
}


@dataclass(frozen=True)
class Step:
    """A step of the tour: a task of the user with instructions, at a tab of the controls.

    Attributes:
        is_done: Whether the user did it, from the frame in which it began and the present one.
        show: Action that does it for the user.
        after: Action when the user goes on; None for none.
    """

    title: str
    text: str
    tab: str
    is_done: Callable[[Frame, Frame], bool]
    show: Callable[[Frame], Action]
    after: Action | None = None


def _approach(frame: Frame) -> Action:
    """Lower b4 towards the base plane: δ3 is its height."""
    state = frame.state
    height = math.copysign(NEAR * state.warn_below, state.pose.position[2])
    return SetPosition(2, height + float(state.offset(state.pose.rotation)[2]))


STEPS = (
    Step(
        "Move the platform",
        "Drag an arrow or an arc at b4, or a slider of Pose. The legs and the pose stay in step.",
        "Pose",
        lambda before, now: before.state.pose != now.state.pose,
        lambda now: SetPosition(1, now.state.position[1] + STRIDE * now.state.design.reach),
    ),
    Step(
        "Come close to a singularity",
        "Lower z. The two flags turn from blue to orange as they come close: where they meet, the "
        "mechanism is singular. Singularity, on the right, tells how far it is.",
        "Pose",
        lambda _, now: now.verdict.kind != "clear",
        _approach,
        GoHome(),
    ),
    Step(
        "Change the design",
        "Move a slider of Design, such as a3x. The pose is held, or the lengths of the legs.",
        "Design",
        lambda before, now: before.state.design.variables != now.state.design.variables,
        lambda now: SetVariable("a3x", GROWTH * now.state.design.variables[0]),
    ),
    Step(
        "See the workspace",
        "Press Solid in Workspace: all positions of b4 within the limits. Cut it open, or colour "
        "it by the smallest margin.",
        "Workspace",
        lambda _, now: now.state.view.workspace.solid,
        lambda _: Set("view.workspace.solid", True, "Solid"),
    ),
    Step(
        "Optimise, and take it with you",
        "Press Optimise, and accept what it finds, or revert to your design. Export, on top of the "
        "page, has files for CAD, simulation and print. Ctrl-Z undoes what you changed.",
        "Optimise",
        lambda before, now: Optimisation.of(now.state).count > Optimisation.of(before.state).count,
        lambda _: StartRun(),
    ),
)


@dataclass(frozen=True)
class Tour:
    """The progress of a tour: its step, the frame in which it began, and whether it is done."""

    at: int
    start: Frame
    is_done: bool = False

    @property
    def step(self) -> Step:
        """The present step."""
        return STEPS[self.at]

    @property
    def is_last(self) -> bool:
        """Whether no step follows."""
        return self.at == len(STEPS) - 1

    def after_frame(self, frame: Frame) -> Tour:
        """Return the tour after a frame, in which the step may be done."""
        return replace(self, is_done=self.is_done or self.step.is_done(self.start, frame))

    def step_by(self, steps: int, frame: Frame) -> Tour:
        """Return the tour some steps on or back, within its first and last."""
        return Tour(min(max(self.at + steps, 0), len(STEPS) - 1), frame)


@dataclass
class _Card:
    """The tour of one browser, in a panel over its scene."""

    tour: Tour
    panel: viser.PanelHandle
    html: viser.GuiHtmlHandle

    def show(self, tour: Tour) -> None:
        if tour != self.tour:
            self.tour, self.html.content = tour, card_words(tour)


class TourGuide(Runner):
    """Leads users through the tour, each in a browser of their own."""

    def __init__(self, services: Services) -> None:
        self._services, self._session = services, services.session
        preferences = services.preferences
        self._is_seen = preferences is None or preferences.chosen.tour_seen
        # Presses, frames and browsers come on threads of their own.
        self._lock = threading.RLock()
        self._cards: dict[int, _Card] = {}
        services.buttons.on(PRESS, self._press, values=BUTTONS)
        services.server.on_client_connect(
            lambda client: None if self._is_seen else self.begin(client)
        )
        services.server.on_client_disconnect(self._forget)

    def begin(self, client: viser.ClientHandle) -> None:
        """Begin the tour, or begin it again."""
        with self._lock:
            self._end(client)
            tour = Tour(0, Frame(self._session.state))
            panel = client.gui.add_panel()
            panel.float(x=PLACE[0], y=PLACE[1], width=WIDTH)
            with panel.add_tab("Tour"):
                html = client.gui.add_html(card_words(tour))
            self._cards[client.client_id] = _Card(tour, panel, html)

    def follow(self, frame: Frame) -> None:
        """Mark the steps that a frame shows as done."""
        with self._lock:
            for card in tuple(self._cards.values()):
                card.show(card.tour.after_frame(frame))

    def _forget(self, client: viser.ClientHandle) -> None:
        self._cards.pop(client.client_id, None)

    def _end(self, client: viser.ClientHandle) -> None:
        card = self._cards.pop(client.client_id, None)
        if card is not None:
            card.panel.remove()

    def _press(self, name: str, client: viser.ClientHandle) -> None:
        card = self._cards.get(client.client_id)
        if card is None:
            return
        tour = card.tour
        if name == "Show me":
            show = tour.step.show
            self._session.do(lambda state: show(Frame(state)), who=client.client_id)
        elif name == "Skip" or (name == "Next" and tour.is_last):
            with self._lock:
                self._end(client)
            self._is_seen = True
            self._services.remember(None, tour_seen=True)
        else:
            if name == "Next" and tour.step.after is not None:
                self._session.do(tour.step.after, who=client.client_id)
            with self._lock:
                steps = 1 if name == "Next" else -1
                card.show(tour.step_by(steps, Frame(self._session.state)))


def card_words(tour: Tour) -> str:
    """Return the card as HTML: the progress of the tour, its step, and the buttons."""
    step = tour.step
    looks = ("ex-dot" if i <= tour.at else "ex-dot is-ahead" for i in range(len(STEPS)))
    dots = "".join(f'<span class="{look}"></span>' for look in looks)
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
    look = f"ex-button {look}".rstrip()
    return press_button(PRESS, name, escape(words or name), hint=BUTTONS[name], class_name=look)
