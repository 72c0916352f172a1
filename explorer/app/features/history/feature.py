"""The steps of the session: undo, redo, a list to go to any of them, and the last change.

The last change of the design is shown by a ghost of what was before, and by the differences.
"""

from __future__ import annotations

from dataclasses import replace
from html import escape

import numpy as np
import viser

from explorer.app.features.designs.feature import SavedDesigns
from explorer.app.features.feature import Feature, Services, Tab
from explorer.app.features.workspace.feeds import VOLUME_FEED, volume_request
from explorer.app.features.workspace.work import MeasuredVolume, Selection, measure_volume
from explorer.app.scene.placing import Placed, ScenePart, outline
from explorer.app.scene.shapes import GHOST, add_lines
from explorer.app.session.feed import Feed, FeedOf
from explorer.app.session.history import History, HistoryStep
from explorer.app.session.session import REDO, UNDO, move_to
from explorer.app.state.actions import Action, action
from explorer.app.state.frame import Frame
from explorer.app.state.state import State
from explorer.app.storage.session_file import decode_session
from explorer.app.widgets.buttons import open_button, press_button
from explorer.app.widgets.markup import box, dim, row, table
from explorer.files.json_text import decode_text
from explorer.numerics.number_text import drop_rounding, format_number
from explorer.page.browser.viser_gaps import run_script_in
from explorer.page.look import read_script
from explorer.page.widgets.assigning import Updates
from explorer.page.widgets.palette import Key, with_keys

GO = "history.go"
# Rows of the list; the slider reaches all steps.
ROWS = 24
# Rows at most of steps that were undone.
ROWS_AHEAD = 6
MOVE = "history.move"
KEYS = {
    "Undo": (Key("Z", "cmd/ctrl"),),
    "Redo": (Key("Z", "cmd/ctrl+shift"), Key("Y", "cmd/ctrl")),
}
MOVES = {"Undo": UNDO, "Redo": REDO}
ARROWS = {"Undo": "↶", "Redo": "↷"}
OVER = "change.over"
# Largest ratio of the sizes before and now at which one picture shows both.
MOST_RATIO = 5.0
DIGITS = 4


class HistoryPanel:
    """The list of the last steps, and a slider over all of them."""

    def __init__(self, services: Services) -> None:
        gui, self._session, self._services = services.gui, services.session, services
        self._slider = gui.add_slider(
            "Go to step",
            min=0,
            max=1,
            step=1,
            initial_value=0,
            hint="Run through all that was done; nothing is lost until something is changed.",
        )
        self._list = gui.add_html("")
        self._numbers: set[str] = set()
        self._slider.on_update(self._travel)
        services.do_on_press(
            GO, lambda value: move_to(int(value)) if value in self._numbers else None
        )

    def updates(self, _: Frame) -> Updates:
        """Yield the updates that show the history of the session."""
        history = self._session.history
        steps, here = history.steps, history.step
        yield self._slider, "min", steps[0].number
        yield self._slider, "max", max(steps[-1].number, steps[0].number + 1)
        yield self._slider, "disabled", len(steps) == 1
        if not self._session.is_waiting(self):
            yield self._slider, "value", here.number
        last = min(len(steps), max(history.at + 1 + ROWS_AHEAD, ROWS))
        # The newest step comes first.
        shown = steps[max(0, last - ROWS) : last][::-1]
        self._numbers = {str(step.number) for step in shown}
        yield self._list, "content", box(*(self._row(step, here) for step in shown))

    async def _travel(self, event: viser.GuiEvent[viser.GuiSliderHandle[int]]) -> None:
        if event.client_id is not None:
            stamp, number = self._slider.update_timestamp, int(self._slider.value)
            self._session.post(self, move_to(number), stamp=stamp, who=event.client_id)

    def _row(self, step: HistoryStep, here: HistoryStep) -> str:
        """Return a step as a button in HTML; steps that were undone stay in the list."""
        look = "is-here" if step.number == here.number else ""
        by = author(self._services, step)
        return press_button(
            GO,
            step.number,
            f'<span class="ex-dim ex-index">{step.number}</span>{escape(step.words)}{by}',
            hint=f"Go to step {step.number}: {step.words}",
            class_name=f"ex-row {'is-undone' if step.number > here.number else look}".rstrip(),
        )


def author(services: Services, step: HistoryStep) -> str:
    """Return words in HTML that only browsers show which have not done a step.

    They stand there while that one is connected, and another one too.
    """
    clients = services.server.get_clients()
    if len(clients) < 2 or step.who not in clients:
        return ""
    return f'<span class="ex-author" data-who="{step.who}"> (another browser)</span>'


class UndoButtons:
    """Undo, redo, and the button that opens the list of all steps.

    Undo after a saved design was deleted brings that back: it is no step of the session.
    """

    def __init__(self, services: Services) -> None:
        self._session, self._services = services.session, services
        services.server.on_client_connect(
            lambda client: run_script_in(client, read_script("authors", client.client_id))
        )
        self._saved = None if services.user_data is None else services.get(SavedDesigns)
        services.buttons.on(MOVE, self._move, values=MOVES)
        for name in MOVES:
            # Always ready: a key that is pressed before the page knows of the last step counts.
            hint = f"{name} the last step."
            services.buttons.offer(f"Edit › {name}", hint, MOVE, name, keys=KEYS[name])

    def __call__(self, frame: Frame) -> str:
        """Return the buttons for a frame, as HTML."""
        history, is_busy = self._session.history, bool(frame.state.busy)
        buttons = "".join(self._button(name, history, is_busy=is_busy) for name in MOVES)
        steps = open_button(
            "History",
            "History",
            hint="List all steps, and go to any of them.",
            class_name="ex-tool",
        )
        return f'<span class="ex-undo">{buttons}{steps}</span>'

    def _move(self, name: str, client: viser.ClientHandle) -> None:
        if name == "Undo" and self._saved is not None and self._deleted is not None:
            self._saved.restore(client.client_id)
        else:
            self._session.do(MOVES[name], who=client.client_id)

    @property
    def _deleted(self) -> str | None:
        """Name of the saved design that was deleted last, if nothing was done since."""
        saved, step = self._saved, self._session.history.step
        return saved.last_deleted if saved is not None and saved.deleted_at is step else None

    def _button(self, name: str, history: History, *, is_busy: bool) -> str:
        # The step that "Undo" or "Redo" goes over.
        at = history.at if name == "Undo" else history.at + 1
        step = history.steps[at] if 0 < at < len(history.steps) else None
        words, deleted = None if step is None else step.words, self._deleted
        if name == "Undo" and deleted is not None:
            step, words, is_busy = None, f"Delete {deleted}", False
        hint = f"{name}: {words}." if words is not None else f"Nothing to {name.lower()}."
        return press_button(
            MOVE,
            name,
            ARROWS[name] + ("" if step is None else author(self._services, step)),
            hint=with_keys(hint, KEYS[name]),
            label=name if words is None else f"{name} {words}",
            class_name="ex-tool ex-arrow",
            is_disabled=words is None or is_busy,
        )


class DesignChange:
    """The last change of the design, and the frame before it, None if the last step changed none.

    A change counts until another step, undo or redo, or a press outside of the scene.
    """

    def __init__(self, services: Services) -> None:
        self.before: Frame | None = None
        self._session = services.session
        self._now = services.get(VOLUME_FEED)
        # Another page of the same state may not have measured the design before the change.
        self._then = FeedOf(
            measure_volume,
            lambda _: None if self.before is None else volume_request(self.before),
            key="volume before",
        )(services)
        self._ended: State | None = None
        services.buttons.on(OVER, self._end, values=("",))

    def follow(self, frame: Frame) -> None:
        """Find what was before the change that led to a frame, and request its volume."""
        history, now = self._session.history, frame.state
        state = history.steps[history.at - 1].state if history.is_open and history.at else None
        # Another design that is opened is no change of this one.
        if state is self._ended or (state is not None and state.base != now.base):
            state = None
        if state is None or state.design == now.design:
            self.before = None
        elif self.before is None or self.before.state is not state:
            # What a frame has computed is kept from one value of a slider to the next.
            self.before = Frame(state)
        self._then.follow(frame)

    def card(self, frame: Frame) -> str:
        """Return the values before and now with their differences, HTML; nothing without any."""
        old, words = self.before, self._session.history.step.words
        if old is None:
            return ""
        state = frame.state
        ratio = state.view.unit_for(old.state.design).factor / state.unit.factor

        def difference(name: str, power: int, before: float | None, now: float | None) -> str:
            unit = state.unit_of(power)
            before = None if before is None else before * ratio**power * unit.factor
            return _difference(name, before, None if now is None else now * unit.factor, unit.name)

        lines = [
            difference("Volume", 3, _volume(self._then), _volume(self._now)),
            difference("Reach", 1, old.state.design.reach, frame.state.design.reach),
            difference("Clearance here", 1, _clearance(old), _clearance(frame)),
        ]
        body = table(lines, head=("", "before", "now", ""))
        return (
            f'<div class="ex-change-card" role="status" data-until-press="{OVER}">'
            f"<b>{escape(words)}</b>{body}</div>"
        )

    def _end(self, _: str, client: viser.ClientHandle) -> None:
        del client
        if self.before is not None:
            self._ended = self.before.state
            self._session.redraw()


def _volume(feed: Feed[Selection, MeasuredVolume]) -> float | None:
    drawing = feed.drawing
    return None if drawing is None or not feed.is_current else drawing.measured.volume


def _difference(name: str, before: float | None, now: float | None, unit: str) -> str:
    """Return a row with a value before and now, and the difference; "…" while one is computed."""
    words = ""
    if before is not None and now is not None:
        change = drop_rounding(now - before, max(abs(before), abs(now)))
        sign = "+" if change > 0.0 else ""
        words = "same" if change == 0.0 else f"<b>{sign}{format_number(change, 3)}</b>"
    texts = ("…" if value is None else format_number(value, DIGITS) for value in (before, now))
    return row(f"{name} {dim(unit)}", *texts, words)


def _clearance(frame: Frame) -> float:
    clearances = frame.snapshot.clearances
    return float(clearances.clearance[int(clearances.closest)])


class ChangeScene(ScenePart):
    """The outline of base, legs and platform before the change."""

    def __init__(self, services: Services) -> None:
        self._change = services.get(DesignChange)
        self._lines = add_lines(services.scene, "/change/before", 1, GHOST, 2.0)

    def updates(self, placed: Placed) -> Updates:
        """Yield the updates that draw the ghost of this frame."""
        before, now = self._change.before, placed.frame.state.design
        is_visible = False
        if before is not None:
            old = before.state.design
            scale = old.unit_mm / now.unit_mm
            is_visible = 1.0 / MOST_RATIO <= scale * old.reach / now.reach <= MOST_RATIO
            if is_visible:
                lines = placed.scale * scale * outline(before.snapshot)
                yield self._lines, "points", lines.astype(np.float32)
        yield self._lines, "visible", is_visible


@action("Open the session of {design}", is_jump=True)
def take_session(state: State, history: History) -> State:
    """Open the design of a session as it was left there, unless one is being optimised."""
    return replace(history.restore(state).step.state, view=history.step.state.view)


def open_session(_: Services, data: bytes, name: str) -> tuple[Action, str]:
    """Return the action that opens the session in a file, and what it is; see `Opener`."""
    history = decode_session(decode_text(data).encode(), name)
    design = history.step.state.design
    return take_session(history), f"The session of {design.name}; undo brings yours back."


HISTORY = Feature(
    "history",
    tabs=(Tab("dialog", "History", HistoryPanel),),
    bar=(
        ("left", UndoButtons),
        ("left", lambda services: services.get(DesignChange).card),
    ),
    scene=(ChangeScene,),
    feeds=(DesignChange,),
    # Those of earlier versions, which are refused, had words.
    openers=dict.fromkeys(("steps", "words"), open_session),
)
