"""The steps of the session: a list to jump in, and a slider to run through them."""

from __future__ import annotations

from collections.abc import Iterator
from html import escape

import viser

from explorer.app.features.feature import Services
from explorer.app.session.history import Step
from explorer.app.state.frame import Frame
from explorer.app.widgets.assigning import Update
from explorer.app.widgets.buttons import press_button
from explorer.app.widgets.markup import box

PRESS = "history.go"
# Rows of the list; the slider reaches all steps.
ROWS = 24
# Rows at most of steps that were undone.
ROWS_AHEAD = 6


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
        services.buttons.on(PRESS, self._go)

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
        yield self._list, "content", list_steps(shown, here)

    async def _travel(self, event: viser.GuiEvent[viser.GuiSliderHandle[int]]) -> None:
        if event.client_id is not None:
            stamp, number = self._slider.update_timestamp, int(self._slider.value)
            self._session.travel_to(self, number, stamp=stamp, who=event.client_id)

    def _go(self, value: str, client: viser.ClientHandle) -> None:
        number = next((step for step in self._numbers if str(step) == value), None)
        if number is not None:
            self._session.travel_to(object(), number, stamp=None, who=client.client_id)


def list_steps(steps: tuple[Step, ...], here: Step) -> str:
    """Return steps as a list of buttons in HTML."""
    rows = "".join(
        press_button(
            PRESS,
            step.number,
            f'<span class="ex-index">{step.number}</span>{escape(step.words)}',
            hint=f"Go to step {step.number}: {step.words}",
            class_name=f"ex-row {_state(step, here)}".rstrip(),
        )
        for step in steps
    )
    return box(rows)


def _state(step: Step, here: Step) -> str:
    """Return the class of a row; steps that were undone stay in the list."""
    if step.number == here.number:
        return "is-here"
    return "is-undone" if step.number > here.number else ""
