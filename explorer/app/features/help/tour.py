"""The tour for first-time users: five steps, each done by the user, shown or skipped.

A step turns to its tab and rings its control. In the end, and wherever the tour is skipped, what
the tour has changed is taken back, in one step of the history, so that nothing is lost. What people
have changed meanwhile, in this browser or another, stays.
"""

from __future__ import annotations

import math
import threading
from collections.abc import Callable, Sequence
from dataclasses import dataclass, field, replace
from functools import partial
from html import escape

import viser

from explorer.app.features.feature import Runner, Services
from explorer.app.features.optimise.actions import (
    cancel_run,
    revert,
    start_run,
    take_paper_problem,
)
from explorer.app.features.optimise.state import Optimisation, SearchRun
from explorer.app.state.actions import Act, Action, Set, action
from explorer.app.state.frame import Frame
from explorer.app.state.geometry import set_variable
from explorer.app.state.moves import go_home, move_to, set_position
from explorer.app.state.parts import take_back, with_value
from explorer.app.state.state import State
from explorer.app.widgets.buttons import press_button
from explorer.mechanism.pose import Pose
from explorer.optimise.defaults import PAPER_VOLUME
from explorer.page.browser.viser_gaps import run_script_in
from explorer.page.look import read_script

# What "Show me" does: the stride of the platform in reaches, the height over the base plane in
# warning lengths, and the factor on a variable.
STRIDE, NEAR, GROWTH = 0.1, 0.5, 1.1
PRESS, OFFER = "tour", "offer"
BUSY = "the tour changes the design: let the search end first, or cancel it"
OVER = "What the tour changed is taken back, and what you changed stays. Undo shows it again."
STAYS = "The design that the tour opened stays, since it was changed. Undo and History have yours."
BUTTONS = {
    "Skip": "End the tour, and take back what it has changed; the command Tour begins it again.",
    "Back": "Go back to the step before.",
    "Show me": "Let the explorer do what this step asks for.",
    "Next": "Go on to the next step, or end the tour.",
}


@dataclass(frozen=True)
class TourStep:
    """A step of the tour: a task of the user with instructions, at a tab of the controls.

    Attributes:
        control: CSS selector of the control that the text names.
        is_done: Whether the user did it, from the frame in which it began and the present one.
        show: Action that does it for the user.
        before: Action when the step begins; None for none.
        after: Action when the user goes on; None for none.
    """

    title: str
    text: str
    tab: str
    control: str
    is_done: Callable[[Frame, Frame], bool]
    show: Callable[[Frame], Action]
    before: Action | None = None
    after: Action | None = None


Change = tuple[State, State]
"""The states before and after an action of the tour."""


@action("End the tour")
def end_tour(state: State, changes: tuple[Change, ...]) -> State:
    """Take back what the tour has changed, with the search from a design that it opened.

    The action is refused while a design is being optimised.
    """
    after, run = state, own_search(state, changes)
    if run is not None and not run.accepted:
        after = with_value(revert().apply(state), "optimisation.run", None)
    for change in reversed(changes):
        after = _take_back(change, after)
    return replace(after.for_step().restore_over(state), view=after.view)


def own_search(state: State, changes: Sequence[Change]) -> SearchRun | None:
    """Return the last search if it began at a design that the tour has opened; else None."""
    run = Optimisation.of(state).run
    is_own = run is not None and any(
        before.base != after.base
        and run.own.design == after.design
        and run.number > Optimisation.of(after).count
        for before, after in changes
    )
    return run if is_own else None


def _take_back(change: Change, state: State) -> State:
    """Return a state without one change; a design that it opened stays once it was changed."""
    before, after = change
    if before.base != after.base and state.design != after.design:
        return state
    whole = take_back(before, after, state)
    if (state.design, state.pose, state.joints) == (after.design, after.pose, after.joints):
        return whole
    # Angles belong to the quaternion, and joints to the pose and the design.
    turned = before if state.pose.quaternion == after.pose.quaternion else state
    pose = Pose(whole.pose.position, turned.pose.quaternion)
    return move_to(replace(whole, pose=pose), pose, turned.yaw_pitch_roll)


def _approach(frame: Frame) -> Action:
    """Lower b4 towards the base plane: δ3 is its height."""
    state = frame.state
    height = math.copysign(NEAR * state.warn_below, state.pose.position[2])
    return set_position(2, height + float(state.offset(state.pose.rotation)[2]))


def _has_found(before: Frame, now: Frame) -> bool:
    """Whether a search that began after a frame has ended."""
    of = Optimisation.of(now.state)
    return of.count > Optimisation.of(before.state).count and not of.is_on


STEPS = (
    TourStep(
        "Move the platform",
        "Drag the handle at b4 in the scene, or the slider y. Legs and pose stay in step.",
        "Pose",
        "[role=slider][aria-label=y]",
        lambda before, now: before.state.pose != now.state.pose,
        lambda now: set_position(1, now.state.position[1] + STRIDE * now.state.design.reach),
    ),
    TourStep(
        "Come close to a singularity",
        "Lower z. The two flags turn from blue to orange as they come close: where they meet, the "
        "mechanism is singular. Singularity, on the right, tells how far it is.",
        "Pose",
        "[role=slider][aria-label=z]",
        lambda _, now: now.verdict.kind != "clear",
        _approach,
        after=go_home(),
    ),
    TourStep(
        "Change the design",
        "Move the slider a3x. The pose is held, and the legs and the workspace follow.",
        "Design",
        "[role=slider][aria-label=a3x]",
        lambda before, now: before.state.design.variables != now.state.design.variables,
        lambda now: set_variable("a3x", GROWTH * now.state.design.variables[0]),
    ),
    TourStep(
        "See the workspace",
        "Press Solid: all positions of b4 within the limits. Below it, cut the solid open, or "
        "colour it by the smallest margin.",
        "Workspace",
        ".ex-chip[data-value=solid]",
        lambda _, now: now.state.view.workspace.solid,
        lambda _: Set("view.workspace.solid", True, "Solid"),
    ),
    TourStep(
        "Optimise",
        "This is the initial design of the paper. Press Optimise: the search looks for a design "
        "whose workspace is as large as the paper asks for.",
        "Optimise",
        "[data-ex=drawer] [data-press='optimise.start']",
        _has_found,
        lambda _: start_run(),
        take_paper_problem(),
    ),
)


@dataclass(frozen=True)
class Tour:
    """The progress of a tour: its step, the frame in which it began, and whether it is done.

    Its result is what the search of the last step has reached, "" without one.
    """

    at: int
    start: Frame
    is_done: bool = False
    result: str = ""

    @property
    def step(self) -> TourStep:
        """The present step."""
        return STEPS[self.at]

    @property
    def is_last(self) -> bool:
        """Whether no step follows."""
        return self.at == len(STEPS) - 1

    def after_frame(self, frame: Frame) -> Tour:
        """Return the tour after a frame, in which the step may be done."""
        is_done = self.is_done or self.step.is_done(self.start, frame)
        return replace(self, is_done=is_done, result=_result(frame) if self.is_last else "")

    def step_by(self, steps: int, frame: Frame) -> Tour:
        """Return the tour some steps on or back, within its first and last."""
        return Tour(min(max(self.at + steps, 0), len(STEPS) - 1), frame)


def _result(frame: Frame) -> str:
    """Return the volume before a search and now, as HTML."""
    run = Optimisation.of(frame.state).run
    if run is None or not run.iterates:
        return ""
    volumes = run.iterates[0].volume, run.iterates[-1].volume, PAPER_VOLUME
    unit = frame.state.unit_of(3)
    then, now, wanted = map(unit.number, volumes)
    return f"The volume grew from {then} to <b>{now} {unit.name}</b>; the paper asks for {wanted}."


@dataclass
class _Card:
    """The tour of one browser, and what it has changed so far."""

    client: viser.ClientHandle
    tour: Tour
    changes: list[Change] = field(default_factory=list[Change])

    def show(self, tour: Tour) -> None:
        """Show the card of the tour at another step or with another result."""
        if tour != self.tour:
            self.tour = tour
            self.draw()

    def draw(self) -> None:
        """Show the card, turn to the tab of the step and ring its control."""
        at, step = self.tour.at, self.tour.step
        place = {"number": at, "tab": step.tab, "control": step.control}
        run_script_in(self.client, read_script("tour", card_words(self.tour), place))

    def close(self) -> None:
        """Remove the card, turn back to the tabs before the tour, and offer it no more."""
        run_script_in(self.client, read_script("tour", "", None))


class TourGuide(Runner):
    """Leads users through the tour, each in a browser of their own."""

    def __init__(self, services: Services) -> None:
        self._services, self._session = services, services.session
        # Presses, frames and browsers come on threads of their own.
        self._lock = threading.RLock()
        self._cards: dict[int, _Card] = {}
        # Tours that have ended, until what they have changed is taken back.
        self._ended: list[_Card] = []
        services.buttons.on(PRESS, self._press, values=(OFFER, *BUTTONS))
        if services.offers_tour:
            offer = f"{read_script('tour')}window.explorer.tour.offer();"
            services.server.on_client_connect(lambda client: run_script_in(client, offer))
        services.server.on_client_disconnect(lambda client: self._end(client.client_id))

    def begin(self, client: viser.ClientHandle) -> None:
        """Begin the tour, or begin it again."""
        self._end(client.client_id)
        # Not within the lock: the session waits for that while it draws.
        state = self._session.latest_state()
        if state.busy:
            self._services.complain(BUSY, client.client_id)
            return
        with self._lock:
            card = _Card(client, Tour(0, Frame(state)))
            self._cards[client.client_id] = card
            card.draw()

    def follow(self, frame: Frame) -> None:
        """Mark the steps that a frame shows as done, and end the tours that are over."""
        with self._lock:
            for card in tuple(self._cards.values()):
                card.show(card.tour.after_frame(frame))
            if not frame.state.busy:
                ended, self._ended = self._ended, []
                for card in ended:
                    self._session.do(partial(self._take_back, card), who=card.client.client_id)

    def _take_back(self, card: _Card, state: State) -> Act | None:
        """Return the action that takes back what a tour has changed; None if nothing is left."""
        if not card.changes:
            return None
        end = end_tour(tuple(card.changes))
        after = end.apply(state)
        opened = [before.base for before, shown in card.changes if before.base != shown.base]
        if opened and after.base != opened[0]:
            self._services.tell(STAYS, card.client.client_id)
        elif (after.design, after.pose) != (state.design, state.pose):
            self._services.tell(OVER, card.client.client_id)
        return end

    def _end(self, who: int) -> None:
        """End the tour of a browser; a search from a design that it opened is cancelled first."""
        with self._lock:
            card = self._cards.pop(who, None)
            if card is not None:
                card.close()
                self._ended.append(card)
                self._session.do(
                    lambda state: cancel_run() if own_search(state, card.changes) else None, who=who
                )

    def _do(self, card: _Card, make: Callable[[State], Action | None]) -> None:
        """Do an action of the tour, and note what it changes."""

        def change(state: State) -> Action | None:
            action = make(state)
            if action is not None:
                card.changes.append((state, action.apply(state)))
            return action

        self._session.do(change, who=card.client.client_id)

    def _press(self, name: str, client: viser.ClientHandle) -> None:
        card = self._cards.get(client.client_id)
        if name == OFFER and not self._session.state.busy:
            self.begin(client)
        if card is None:
            return
        step = card.tour.step
        if name == "Show me":
            self._do(card, lambda state: step.show(Frame(state)))
        elif name == "Skip" or (name == "Next" and card.tour.is_last):
            self._end(client.client_id)
        else:
            if name == "Next":
                self._do(card, lambda _: step.after)
            tour = card.tour.step_by(1 if name == "Next" else -1, Frame(self._session.state))
            first = tour.step.before
            self._do(card, lambda state: None if state.busy else first)
            with self._lock:
                card.show(tour)


def card_words(tour: Tour) -> str:
    """Return the card as HTML: the progress of the tour, its step, and the buttons."""
    step = tour.step
    looks = ("ex-dot" if i <= tour.at else "ex-dot is-ahead" for i in range(len(STEPS)))
    dots = "".join(f'<span class="{look}"></span>' for look in looks)
    look, done = "ex-card", ""
    if tour.is_done:
        look, done = "ex-card is-done", '<span class="ex-within ex-strong">Done</span>'
    first = "" if tour.at == 0 else _button("Back")
    show = "" if tour.is_done else _button("Show me")
    last = _button("Next", "Finish" if tour.is_last else "Next", look="is-main")
    return (
        f'<div class="{look}"><div class="ex-line ex-dim"><span>{dots}</span>{done}'
        f"<span>step {tour.at + 1} of {len(STEPS)}</span></div>"
        f"<h4>{escape(step.title)}</h4><div>{tour.result or escape(step.text)}</div>"
        f'<div class="ex-ends">{_button("Skip", "Skip the tour", look="is-quiet")}'
        f"{first}{show}{last}</div></div>"
    )


def _button(name: str, words: str | None = None, *, look: str = "") -> str:
    look = f"ex-button {look}".rstrip()
    return press_button(PRESS, name, escape(words or name), hint=BUTTONS[name], class_name=look)
