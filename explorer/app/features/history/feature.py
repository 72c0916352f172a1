"""The steps of the session: undo, redo, a list to go to any of them, and the last change."""

from __future__ import annotations

from collections.abc import Iterator
from html import escape

import viser

from explorer.app.features.feature import Feature, InBar, Services, Tab
from explorer.app.features.history.change import ChangeCard, ChangeScene, DesignChange
from explorer.app.session.history import History, Step
from explorer.app.session.session import REDO, UNDO
from explorer.app.state.frame import Frame
from explorer.app.widgets.assigning import Update
from explorer.app.widgets.buttons import open_button, press_button
from explorer.app.widgets.commands import Key, with_keys
from explorer.app.widgets.markup import box

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


class HistoryPanel:
    """The list of the last steps, and a slider over all of them."""

    def __init__(self, services: Services) -> None:
        gui, self._session = services.gui, services.session
        self._slider = gui.add_slider(
            "Go to step",
            min=0,
            max=1,
            step=1,
            initial_value=0,
            hint="Run through all that was done; nothing is lost until something is changed.",
        )
        self._list = gui.add_html("")
        self._numbers: tuple[int, ...] = ()
        self._slider.on_update(self._travel)
        services.buttons.on(GO, self._go)

    def updates(self, _: Frame) -> Iterator[Update]:
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
        self._numbers = tuple(step.number for step in shown)
        yield self._list, "content", box(*(_row(step, here) for step in shown))

    async def _travel(self, event: viser.GuiEvent[viser.GuiSliderHandle[int]]) -> None:
        if event.client_id is not None:
            stamp, number = self._slider.update_timestamp, int(self._slider.value)
            self._session.travel_to(self, number, stamp=stamp, who=event.client_id)

    def _go(self, value: str, client: viser.ClientHandle) -> None:
        number = next((step for step in self._numbers if str(step) == value), None)
        if number is not None:
            self._session.travel_to(object(), number, stamp=None, who=client.client_id)


def _row(step: Step, here: Step) -> str:
    """Return a step as a button in HTML; steps that were undone stay in the list."""
    look = "is-here" if step.number == here.number else ""
    return press_button(
        GO,
        step.number,
        f'<span class="ex-index">{step.number}</span>{escape(step.words)}',
        hint=f"Go to step {step.number}: {step.words}",
        class_name=f"ex-row {'is-undone' if step.number > here.number else look}".rstrip(),
    )


class UndoButtons:
    """Undo, redo, and the button that opens the list of all steps."""

    def __init__(self, services: Services) -> None:
        self._session = services.session
        services.buttons.on(MOVE, self._move, values=MOVES)
        for name in MOVES:
            # Always ready: a key that is pressed before the page knows of the last step counts.
            hint = f"{name} the last step."
            services.buttons.offer(f"Edit › {name}", hint, MOVE, name, keys=KEYS[name])

    def __call__(self, frame: Frame) -> str:
        """Return the buttons for a frame, as HTML."""
        history, is_busy = self._session.history, frame.state.optimisation.is_on
        buttons = "".join(self._button(name, history, is_busy=is_busy) for name in MOVES)
        steps = open_button(
            "History",
            "History",
            hint="List all steps, and go to any of them.",
            class_name="ex-tool",
        )
        return f'<span class="ex-undo">{buttons}{steps}</span>'

    def _button(self, name: str, history: History, *, is_busy: bool) -> str:
        # The step that "Undo" or "Redo" goes over.
        at = history.at if name == "Undo" else history.at + 1
        words = history.steps[at].words if 0 < at < len(history.steps) else None
        hint = f"{name}: {words}." if words is not None else f"Nothing to {name.lower()}."
        return press_button(
            MOVE,
            name,
            ARROWS[name],
            hint=with_keys(hint, KEYS[name]),
            label=name if words is None else f"{name} {words}",
            class_name="ex-tool ex-arrow",
            is_disabled=words is None or is_busy,
        )

    def _move(self, name: str, client: viser.ClientHandle) -> None:
        self._session.travel(MOVES[name], who=client.client_id)


HISTORY = Feature(
    "history",
    tabs=(Tab("dialog", "History", HistoryPanel),),
    bar=(InBar("left", UndoButtons), InBar("left", ChangeCard)),
    scene=(ChangeScene,),
    feeds=(DesignChange,),
)
