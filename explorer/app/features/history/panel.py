"""What was done, as a list to jump in and a slider to run through."""

from __future__ import annotations

from collections.abc import Iterator
from html import escape

import viser

from explorer.app.browser.viser_gaps import element_id
from explorer.app.session.history import History, Step
from explorer.app.session.session import Session
from explorer.app.widgets.assigning import Update
from explorer.app.widgets.labels import labelled, out_of_sight
from explorer.app.widgets.markup import DIM

# Rows of the list; the slider reaches all steps.
ROWS = 24
# Of them, at most so many were undone.
ROWS_AHEAD = 6


class HistoryPanel:
    """The list of the last steps, and a slider over all of them."""

    def __init__(self, gui: viser.GuiApi, session: Session) -> None:
        self._session = session
        self._slider = gui.add_slider(
            "Go to step",
            min=0,
            max=1,
            step=1,
            initial_value=0,
            hint="Run through all that was done; nothing is lost until something is changed.",
        )
        self._list = gui.add_html("")
        # The rows are labels of these.
        self.buttons = [
            gui.add_button(
                f"Step {row + 1} of the list",
                hint=f"Go to the step in row {row + 1}, counted from the newest.",
            )
            for row in range(ROWS)
        ]
        self._ids = [element_id(button) for button in self.buttons]
        gui.add_html(out_of_sight(self._ids))
        self._numbers: tuple[int, ...] = ()
        self._slider.on_update(self._slid)
        for row, button in enumerate(self.buttons):
            button.on_click(lambda event, row=row: self._go(row, event.client_id))

    def updates(self, history: History) -> Iterator[Update]:
        """Yield what makes the panel show a history."""
        steps, here = history.steps, history.step
        yield self._slider, "min", steps[0].number
        yield self._slider, "max", max(steps[-1].number, steps[0].number + 1)
        yield self._slider, "disabled", len(steps) == 1
        if not self._session.is_waiting(self):
            yield self._slider, "value", here.number
        last = min(len(steps), max(history.at + 1 + ROWS_AHEAD, ROWS))
        # The newest on top.
        shown = steps[max(0, last - ROWS) : last][::-1]
        self._numbers = tuple(step.number for step in shown)
        yield self._list, "content", listed(shown, here, self._ids)
        for row, button in enumerate(self.buttons):
            yield button, "visible", row < len(shown)

    def _slid(self, event: viser.GuiEvent[viser.GuiSliderHandle[int]]) -> None:
        if event.client_id is not None:
            stamp, number = self._slider.update_timestamp, int(self._slider.value)
            self._session.travel_to(self, number, stamp=stamp, who=event.client_id)

    def _go(self, row: int, who: int | None) -> None:
        if row < len(self._numbers):
            self._session.travel_to(object(), self._numbers[row], stamp=None, who=who)


def listed(steps: tuple[Step, ...], here: Step, ids: list[str]) -> str:
    """Return steps as a list in HTML, each a label of the button with its id."""
    rows = "".join(
        labelled(
            identity,
            f"Go to step {step.number}: {step.words}",
            f'<span style="{DIM};display:inline-block;width:38px">{step.number}</span>'
            f"{escape(step.words)}",
            style=_look(step, here),
        )
        for step, identity in zip(steps, ids, strict=False)
    )
    return (
        '<div style="padding:2px 12px 8px;font-size:12.5px;line-height:1.3;'
        f'font-variant-numeric:tabular-nums">{rows}</div>'
    )


def _look(step: Step, here: Step) -> str:
    look = "display:block;padding:3px 8px;border-radius:4px;cursor:pointer;"
    if step.number == here.number:
        return look + "background:rgba(34,104,212,0.14);font-weight:600;"
    # What was undone is still there.
    return look + ("opacity:0.45;" if step.number > here.number else "")
