"""The guide through a course, which is the tour or a lesson, on a card over the scene.

A step turns to its tab and rings its control. In the end, and wherever a course is left, what it
has changed is taken back, in one step of the history, so that nothing is lost. What people have
changed meanwhile, in this browser or another, stays: a card keeps the state as it would be if its
course had set nothing, to which all that others do is carried over.
"""

from __future__ import annotations

import threading
from collections.abc import Iterator
from dataclasses import dataclass, field, replace
from functools import partial
from html import escape

import viser

from explorer.app.features.feature import Runner, Services
from explorer.app.features.help.lessons import (
    TOUR,
    Course,
    Relation,
    Step,
    arrange,
    list_courses,
    title_words,
)
from explorer.app.features.optimise.actions import cancel_run, restore_own
from explorer.app.features.optimise.state import Optimisation, SearchRun
from explorer.app.features.paths.state import Paths
from explorer.app.state.actions import Act, action
from explorer.app.state.frame import Frame
from explorer.app.state.moves import move_to
from explorer.app.state.parts import with_change, with_value
from explorer.app.state.state import State
from explorer.app.widgets.buttons import press_button
from explorer.export.drawings.markup import as_html
from explorer.mechanism.pose import Pose
from explorer.optimise.defaults import PAPER_VOLUME
from explorer.page.browser.viser_gaps import run_script_in
from explorer.page.look import call_script, read_script

PRESS, OFFER = "tour", "offer"
BUSY = "the tour changes the design: let the search end first, or cancel it"
OVER = "What the steps changed is taken back, and what you changed stays. Undo shows it again."
STAYS = "The design that the tour opened stays, since it was changed. Undo and History have yours."
BUTTONS = {
    "Leave": "Take back what the steps have changed; Help and the search begin them again.",
    "Back": "Go back to the step before.",
    "Show me": "Let the explorer do what this step asks for.",
    "Skip": "Go on, though the state is not what this step asks for.",
    "Next": "Go on to the next step, or end.",
}


def _result(frame: Frame) -> Iterator[str]:
    """Yield the volume before a search and now, as HTML; nothing without one."""
    run = Optimisation.of(frame.state).run
    if run is None or not run.iterates:
        return
    volumes = run.iterates[0].volume, run.iterates[-1].volume, PAPER_VOLUME
    unit = frame.state.unit_of(3)
    then, now, wanted = map(unit.number, volumes)
    yield f"The volume grew from {then} to <b>{now} {unit.name}</b>; the paper asks for {wanted}."


@action(title_words)
def end_course(state: State, title: str, own: State) -> State:
    """Show the state as if a course had set nothing; refused while a design is being optimised."""
    del title
    return replace(own.restore_over(state), view=own.view)


def carry_over(own: State, before: State, now: State) -> State:
    """Return a state with what others changed between two states in which a course has a part."""
    mine, last, journey = (Paths.of(each).journey for each in (own, before, now))
    if mine != last and journey not in (None, last) and last and last.poses == journey.poses:
        # The path that the course made was played.
        before = with_value(before, "paths.journey", journey)
        before = move_to(before, now.pose) if now.pose == journey.pose else before
    whole = with_change(own, before, now)
    if before.design != now.design and not own.base == before.base == now.base:
        # A design that was opened stays, and so does one of the course once it was changed.
        return now.with_view_of(whole)
    platform = before.design, before.pose, before.joints
    if platform in ((own.design, own.pose, own.joints), (now.design, now.pose, now.joints)):
        return whole
    # Angles belong to the quaternion, and joints to the pose and the design.
    turned = own if before.pose.quaternion == now.pose.quaternion else now
    pose = Pose(whole.pose.position, turned.pose.quaternion)
    return move_to(replace(whole, pose=pose), pose, turned.yaw_pitch_roll)


@dataclass(eq=False)
class Card:
    """The course of one browser, its step, and whether it is done.

    Attributes:
        start: The frame in which the step began.
        own: The state as it would be if the course had set nothing.
        plain: The state as it would be if no course of any browser had set anything.
        opens: Whether the course has opened a design.
    """

    client: viser.ClientHandle
    course: Course
    at: int
    start: Frame
    is_done: bool = False
    own: State = field(init=False)
    plain: State = field(init=False)
    opens: bool = False
    _seen: State = field(init=False)
    _shown: str = ""

    def __post_init__(self) -> None:
        self.own = self.plain = self._seen = self.start.state

    def observe(self, state: State, maker: Card | None = None) -> None:
        """Take in the next state, which the course of a card made; None for a user."""
        self.opens |= maker is self and state.base != self._seen.base
        before, self._seen = self._seen, self._without_search(state)
        if maker is not self:
            self.own = carry_over(self.own, before, self._seen)
        if maker is None:
            self.plain = carry_over(self.plain, before, self._seen)

    def own_search(self, state: State) -> SearchRun | None:
        """Return the last search if it began at a design that the course has opened; else None."""
        run = Optimisation.of(state).run
        return run if run and self.own.base != state.base == run.own.base else None

    def _without_search(self, state: State) -> State:
        run = self.own_search(state)
        if run is None or run.accepted:
            return state
        return with_value(restore_own(state, run.own), "optimisation.run", None)

    @property
    def step(self) -> Step:
        """The present step."""
        return self.course.steps[self.at]

    @property
    def is_last(self) -> bool:
        """Whether no step follows."""
        return self.at == len(self.course.steps) - 1

    @property
    def is_waiting(self) -> bool:
        """Whether one must do the step, or skip it, to go on."""
        return self.course.is_lesson and not self.is_done

    def turn(self, steps: int, frame: Frame) -> None:
        """Show the card some steps on or back, within its first and last."""
        self.at = min(max(self.at + steps, 0), len(self.course.steps) - 1)
        self.start, self.is_done = frame, False
        self.follow(frame)

    def follow(self, frame: Frame) -> None:
        """Show the card as it is after a frame, in which its step may be done.

        It turns to the tab of the step and rings its control.
        """
        stays = self.is_done and not self.course.is_lesson
        self.is_done = stays or self.step.is_done(frame, self.start)
        words, script = card_words(self, frame), call_script if self._shown else read_script
        if words != self._shown:
            place = {
                "number": self.at,
                "tab": self.step.tab,
                "control": self.step.control,
                "title": self.course.title,
                "ringsHandle": not self.course.is_lesson and self.at == 0,
            }
            run_script_in(self.client, script("tour", words, place))
        self._shown = words

    def close(self) -> None:
        """Remove the card, turn back to the tabs before it, and offer the tour no more."""
        run_script_in(self.client, read_script("tour", "", None))


class CourseGuide(Runner):
    """Leads users through courses, each in a browser of their own."""

    def __init__(self, services: Services) -> None:
        self._services, self._session = services, services.session
        # Presses, frames and browsers come on threads of their own.
        self._lock = threading.RLock()
        self.cards: dict[int, Card] = {}
        # Courses that have ended, until what they have changed is taken back.
        self._ended: list[Card] = []
        self.courses = list_courses()
        self._session.watch(self._observe)
        services.buttons.on(PRESS, self._press, values=(OFFER, *BUTTONS))
        if services.offers_tour:
            offer = f"{read_script('tour')}window.explorer.tour.offer();"
            services.server.on_client_connect(lambda client: run_script_in(client, offer))
        services.server.on_client_disconnect(lambda client: self._end(client.client_id))

    def begin(self, client: viser.ClientHandle, file: str = TOUR, at: int = 0) -> None:
        """Begin the course of a file at a step, or begin it again."""
        self._end(client.client_id)
        # Not within the lock: the session waits for that while it draws.
        state, course = self._session.latest_state(), self.courses[file]
        if state.busy and not course.is_lesson:
            self._services.complain(BUSY, client.client_id)
            return
        with self._lock:
            card = Card(client, course, at, Frame(state))
            card.plain = next((each.plain for each in self._all()), state)
            self.cards[client.client_id] = card
            card.turn(0, card.start)
        self._set(card, card.step.first)

    def follow(self, frame: Frame) -> None:
        """Mark the steps that a frame shows as done, and end the courses that are over."""
        with self._lock:
            for card in tuple(self.cards.values()):
                card.follow(frame)
            if not frame.state.busy:
                for card in self._ended:
                    self._session.do(partial(self._take_back, card), who=card.client.client_id)

    def _all(self) -> tuple[Card, ...]:
        return (*self.cards.values(), *self._ended)

    def _observe(self, state: State, maker: Card | None = None) -> None:
        with self._lock:
            for card in self._all():
                card.observe(state, maker)

    def _take_back(self, card: Card, state: State) -> Act | None:
        """Return the action that takes back what a course has changed; None if nothing is left."""
        course, own = card.course, card.own
        if card not in self._ended:
            return None
        if card.opens and own.base == state.base:
            self._services.tell(STAYS, card.client.client_id)
        elif (own.design, own.pose) != (state.design, state.pose):
            self._services.tell(OVER, card.client.client_id)
        title = f"Leave the lesson {course.title}" if course.is_lesson else "End the tour"
        end = end_course(title, own)
        after = end.apply(state)
        with self._lock:
            self._ended.remove(card)
            self._observe(after, card)
            for other in self._all():
                other.own = other.plain
        return None if own == state else end

    def _end(self, who: int) -> None:
        """End the course of a browser; a search from a design that it opened is cancelled first."""
        with self._lock:
            card = self.cards.pop(who, None)
            if card is not None:
                card.close()
                self._ended.append(card)
                self._session.do(lambda s: cancel_run() if card.own_search(s) else None, who=who)

    def _set(self, card: Card, settings: tuple[Relation, ...] | None = None) -> None:
        """Make settings of a step, if there are any, or those that do it for None."""
        step, start = card.step, card.start

        def change(state: State) -> Act:
            act = step.solve(state, start) if settings is None else arrange(step.title, settings)
            self._observe(act.apply(state), card)
            return act

        if settings != ():
            self._session.do(change, who=card.client.client_id)

    def _press(self, name: str, client: viser.ClientHandle) -> None:
        card = self.cards.get(client.client_id)
        if name == OFFER and not self._session.state.busy:
            self.begin(client)
        # The state may have changed while a press was on its way.
        if card is None or (name == "Next" and card.is_waiting):
            return
        is_on = name in ("Next", "Skip")
        if name == "Show me":
            self._set(card)
        elif name == "Leave" or (is_on and card.is_last):
            self._end(client.client_id)
        else:
            self._set(card, card.step.then if is_on else ())
            with self._lock:
                card.turn(1 if is_on else -1, Frame(self._session.state))
            self._set(card, card.step.first)


def card_words(card: Card, frame: Frame) -> str:
    """Return the card as HTML: the progress of the course, its step, and the buttons."""
    course, step, count = card.course, card.step, len(card.course.steps)
    looks = ("ex-dot" if i <= card.at else "ex-dot is-ahead" for i in range(count))
    dots = "".join(f'<span class="{look}"></span>' for look in looks)
    look, tone, done = "ex-card", "ex-strong", ""
    if card.is_done:
        look, tone = "ex-card is-done", "ex-within"
        done = f'<span class="{tone} ex-strong">Done</span>'
    title, text, leave = "", as_html(step.instructions), "Skip the tour"
    if course.is_lesson:
        title, leave = f'<div class="ex-dim ex-small">{escape(course.title)}</div>', "Leave"
        readings = step.readings(frame, card.start)
        text += "".join(f'<div class="{tone}">{escape(each)}</div>' for each in readings)
    elif card.is_last:
        text = "".join(_result(frame)) or text
    buttons = (
        _button("Leave", leave, look="is-quiet"),
        "" if card.at == 0 else _button("Back"),
        "" if card.is_done else _button("Show me"),
        _button("Skip") if card.is_waiting else "",
        _button(
            "Next",
            "Finish" if card.is_last else "Next",
            look="is-main",
            is_disabled=card.is_waiting,
        ),
    )
    return (
        f'<div class="{look}"><div class="ex-line ex-dim"><span>{dots}</span>{done}'
        f"<span>step {card.at + 1} of {count}</span></div>{title}"
        f"<h4>{escape(step.title)}</h4>{text}"
        f'<div class="ex-ends">{"".join(buttons)}</div></div>'
    )


def _button(name: str, words: str = "", *, look: str = "", is_disabled: bool = False) -> str:
    hint, look = BUTTONS[name], f"ex-button {look}".rstrip()
    return press_button(
        PRESS, name, words or name, hint=hint, class_name=look, is_disabled=is_disabled
    )
