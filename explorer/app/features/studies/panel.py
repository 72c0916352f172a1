"""The tab of studies: open one, brush and pick in its plots, start a small one."""

from __future__ import annotations

from collections.abc import Callable, Iterator
from dataclasses import replace
from typing import Any, Literal

import viser

from explorer.app.browser.viser_gaps import element_id
from explorer.app.features.studies.actions import (
    ClearBrushes,
    OpenStudy,
    PickDesign,
    SetAxes,
    SetStudyWish,
)
from explorer.app.features.studies.feed import StudyDrawing, StudyFeed
from explorer.app.features.studies.folders import StudyFolders
from explorer.app.features.studies.plots import HINT, StudyPlots
from explorer.app.features.studies.runner import Run, StudyRunner
from explorer.app.features.studies.words import ROWS, chips, legend, run_line, status, table, window
from explorer.app.session.faults import Faults
from explorer.app.session.session import Session, Who
from explorer.app.state.action import Action
from explorer.app.state.frame import Frame
from explorer.app.state.state import State
from explorer.app.state.studies import FEWEST, LEAST_PERCENT, MOST, MOST_PERCENT, StudyWish, spoken
from explorer.app.widgets.assigning import Update
from explorer.app.widgets.controls import Control
from explorer.app.widgets.labels import labelled, out_of_sight
from explorer.app.widgets.markup import DIM, alert
from explorer.errors import ExplorerError
from explorer.measures.catalogue import measures_in
from explorer.sweep.study import NAMES

NONE = "—"
Axis = Literal["across", "up", "colour"]
AXES: dict[Axis, tuple[str, str]] = {
    "across": ("Across", "What the scatter plot shows from left to right."),
    "up": ("Up", "What it shows from bottom to top."),
    "colour": ("Coloured by", "What colours the designs in both plots."),
}
ALONG = {"Previous": -1, "Next": 1}
Resize = Callable[[viser.ClientHandle, bool], None]


class StudiesPanel:
    """A study in plots and words, and the wish for a small one.

    Args:
        server: Of the page.
        tab: In which it is.
        session: To which it posts.
        folders: Where studies lie.
        complain: Called with a message for people and the client it is for.
        resize: Makes the drawer taller in a browser, or as low as it was.
        faults: Where requests are kept that failed unexpectedly; None to keep none.
    """

    def __init__(
        self,
        server: viser.ViserServer,
        tab: viser.GuiTabHandle,
        session: Session,
        folders: StudyFolders,
        complain: Callable[[str, Who], None],
        resize: Resize,
        faults: Faults | None = None,
    ) -> None:
        self._session = session
        self._complain = complain
        self._resize = resize
        # Browsers in which the drawer is tall; the others are not.
        self._tall: set[int] = set()
        gui = server.gui
        self.choice = gui.add_dropdown(
            "Study",
            _only_none(),
            hint="A study of the data folder, or one named on the command line.",
        )
        self._control = Control[str](
            session,
            self.choice,
            lambda frame: frame.state.studies.name or NONE,
            lambda _, name: OpenStudy(None if name == NONE else name),
        )
        self.running = gui.add_html("", visible=False)
        self.cancel = gui.add_button(
            "Cancel study", color="red", visible=False, hint="End it; what is finished is kept."
        )
        self.go_on = gui.add_button(
            "Go on with the study", visible=False, hint="Compute the designs that are missing."
        )
        self.status = gui.add_html("")
        self.plots = StudyPlots(server, tab, session, self.pick)
        self.feed = StudyFeed(folders, session.redraw, lambda: self.plots.inbox_id)
        self.runner = StudyRunner(session, self.feed, complain, faults)
        self.legend = gui.add_html("")
        self.along = gui.add_button_group(
            "Along the front", tuple(ALONG), hint="Open a design of the front, beside the live one."
        )
        self.table = gui.add_html("")
        self._places: dict[Axis, viser.GuiDropdownHandle[str]] = {
            axis: gui.add_dropdown(label, _only_none(), hint=hint)
            for axis, (label, hint) in AXES.items()
        }
        self._axes = [
            Control[str](session, handle, self._shown(axis), self._chooses(axis))
            for axis, handle in self._places.items()
        ]
        with gui.add_folder("New study", expand_by_default=False) as self._new:
            self._add_wish(gui)
        self.rows = [gui.add_button(f"Front row {row + 1}", visible=False) for row in range(ROWS)]
        self.clear = gui.add_button("Clear brushes", hint="Let all designs in again.")
        self.taller = gui.add_button("Taller drawer", hint="Or as low as it was.")
        chips = (*self.vary.values(), *self.measure.values())
        hidden = (*self.rows, *chips, self.clear, self.taller)
        self._hides = gui.add_html(
            out_of_sight([element_id(button) for button in hidden]) + self.plots.hides
        )
        self._listen()
        self._key: tuple[object, ...] = ()

    def updates(self, frame: Frame, *, dark: bool = False) -> Iterator[Update]:
        """Yield what makes the tab show a frame."""
        self.feed.follow(frame, dark=dark)
        studies, drawing, run = frame.state.studies, self.feed.drawing, self.runner.run
        names = (NONE, *dict.fromkeys((*self.feed.names, *filter(None, (studies.name,)))))
        yield self.choice, "options", names
        yield from self._control.updates(frame)
        axes = (NONE,) if drawing is None or drawing.shown is None else drawing.shown.axes
        for handle in self._places.values():
            yield handle, "options", axes
            yield handle, "visible", axes != (NONE,)
        for control in self._axes:
            yield from control.updates(frame)
        for control in self._wishes:
            yield from control.updates(frame)
        # All that follows is text, made anew only if something has changed.
        key = (drawing, studies, run, self.feed.problem)
        if len(key) == len(self._key) and all(a is b for a, b in zip(key, self._key, strict=True)):
            return
        self._key = key
        yield from self._texts(studies.wish, drawing, run)

    def pick(self, index: int, who: Who) -> None:
        """Open the design with an index in the open study."""
        drawing = self.feed.drawing
        if drawing is None:
            return
        try:
            design = drawing.results.design_of_row(drawing.row_of(index))
        except ExplorerError as error:
            self._complain(str(error), who)
            return
        name = str(drawing.request.studies.name)
        self._session.do(PickDesign(design, index=index, study=name), who=who)

    def stop(self) -> None:
        """End the threads and processes."""
        self.runner.stop()
        self.feed.stop()

    def _texts(
        self, wish: StudyWish, drawing: StudyDrawing | None, run: Run | None
    ) -> Iterator[Update]:
        yield self.running, "visible", run is not None
        yield self.running, "content", "" if run is None else run_line(run)
        yield self.cancel, "visible", run is not None
        yield self.cancel, "disabled", run is None or run.is_cancelled
        is_open = drawing is not None and not drawing.is_complete
        yield self.go_on, "visible", run is None and is_open
        yield self.start, "disabled", run is not None
        yield self.status, "content", self._status(drawing)
        yield from self.plots.updates(drawing)
        yield self.legend, "content", "" if drawing is None else legend(drawing)
        has_front = drawing is not None and len(drawing.front_inside) > 0
        yield self.along, "visible", has_front
        is_brushed = drawing is not None and bool(drawing.request.studies.brushes)
        yield self.clear, "disabled", not is_brushed
        ids = [element_id(button) for button in self.rows]
        yield self.table, "content", "" if drawing is None else table(drawing, ids)
        count = 0 if drawing is None else min(len(drawing.front_inside), ROWS)
        for row, button in enumerate(self.rows):
            yield button, "visible", row < count
        yield (
            self.chips,
            "content",
            chips(
                wish,
                {name: element_id(button) for name, button in self.vary.items()},
                {name: element_id(button) for name, button in self.measure.items()},
            ),
        )

    def _status(self, drawing: StudyDrawing | None) -> str:
        if self.feed.problem is not None:
            return alert("This study cannot be shown", self.feed.problem)
        if not self.plots.is_possible:
            return alert("No plots", HINT)
        if drawing is None:
            return (
                f'<div style="padding:2px 12px;font-size:12.5px;{DIM}">Open a study, or start a '
                "small one around the live design below; explorer sweep runs large ones.</div>"
            )
        look = "cursor:pointer;color:var(--mantine-primary-color-filled)"
        clear = labelled(element_id(self.clear), "Clear all brushes", "clear", style=look)
        taller = labelled(
            element_id(self.taller),
            "Make the drawer taller, or lower again",
            "Taller ⇕",
            style=look,
        )
        return status(drawing, clear, taller)

    def _shown(self, axis: Axis) -> Callable[[Frame], str]:
        def read(_: Frame) -> str:
            drawing = self.feed.drawing
            if drawing is None or drawing.shown is None:
                return NONE
            return str(getattr(drawing.shown, axis))

        return read

    def _chooses(self, axis: Axis) -> Callable[[State, str], Action]:
        def write(state: State, name: str) -> Action:
            studies = state.studies
            chosen: dict[str, Any] = {each: getattr(studies, each) for each in AXES}
            return SetAxes(**{**chosen, axis: None if name == NONE else name})

        return write

    def _add_wish(self, gui: viser.GuiApi) -> None:
        def counted(state: State, value: float) -> Action:
            return SetStudyWish(replace(state.studies.wish, count=round(value)))

        def ranged(state: State, value: float) -> Action:
            return SetStudyWish(replace(state.studies.wish, percent=float(value)))

        count = gui.add_slider(
            "Designs",
            min=float(FEWEST),
            max=float(MOST),
            step=1.0,
            initial_value=float(FEWEST),
            hint="How many designs, spread evenly by a Sobol sequence; powers of two spread best.",
        )
        percent = gui.add_slider(
            "Around by ± %",
            min=LEAST_PERCENT,
            max=MOST_PERCENT,
            step=1.0,
            initial_value=LEAST_PERCENT,
            hint="How far variables go around the live design: by so much of their value, or of a "
            "20th of the reach where that is more; the yaw by so much of 90°.",
        )
        self._wishes: list[Control[Any]] = [
            Control[float](
                self._session,
                count,
                lambda frame: float(frame.state.studies.wish.count),
                counted,
            ),
            Control[float](
                self._session,
                percent,
                lambda frame: frame.state.studies.wish.percent,
                ranged,
            ),
        ]
        self.chips = gui.add_html("")
        self.start = gui.add_button(
            "Start study",
            icon=viser.Icon.PLAYER_PLAY,
            hint="Run it in processes of their own; its results go to the data folder.",
        )
        self.vary = {name: gui.add_button(f"Vary {spoken(name)}") for name in NAMES}
        self.measure = {
            name: gui.add_button(f"Measure {spoken(name)}") for name in measures_in("studies")
        }

    def _listen(self) -> None:
        self.start.on_click(
            lambda event: self.runner.start(
                self._session.state.design, self._session.state.studies.wish, event.client_id
            )
        )
        self.cancel.on_click(lambda _: self.runner.cancel())
        self.go_on.on_click(lambda event: self._go_on(event.client_id))
        self.along.on_click(lambda event: self._step(ALONG[self.along.value], event.client_id))
        self.clear.on_click(lambda event: self._session.do(ClearBrushes(), who=event.client_id))
        for row, button in enumerate(self.rows):
            button.on_click(lambda event, row=row: self._pick_row(row, event.client_id))
        for name, button in self.vary.items():
            button.on_click(lambda event, name=name: self._turn("variable", name, event.client_id))
        for name, button in self.measure.items():
            button.on_click(lambda event, name=name: self._turn("measure", name, event.client_id))

        @self.taller.on_click
        def _(event: viser.GuiEvent[viser.GuiButtonHandle]) -> None:
            if event.client is not None:
                self._tall ^= {event.client.client_id}
                self._resize(event.client, event.client.client_id in self._tall)

    def _go_on(self, who: Who) -> None:
        name = self._session.state.studies.name
        if name is not None:
            self.runner.go_on(name, who)

    def _step(self, step: int, who: Who) -> None:
        drawing = self.feed.drawing
        index = None
        if drawing is not None:
            index = drawing.beside(self._session.state.studies.picked, step)
        if index is not None:
            self.pick(index, who)

    def _pick_row(self, row: int, who: Who) -> None:
        drawing = self.feed.drawing
        if drawing is None:
            return
        indices = drawing.results.columns["index"]
        rows = window(drawing.front_inside, drawing.request.studies.picked, indices)
        if row < len(rows):
            self.pick(int(indices[rows[row]]), who)

    def _turn(self, what: Literal["variable", "measure"], name: str, who: Who) -> None:
        def change(state: State) -> Action:
            wish = state.studies.wish
            turned = (
                wish.with_variable_turned(name)
                if what == "variable"
                else wish.with_measure_turned(name)
            )
            return SetStudyWish(turned)

        self._session.post(object(), change, who=who)


def _only_none() -> tuple[str, ...]:
    """Return the options of a list that has none yet; more come."""
    return (NONE,)
