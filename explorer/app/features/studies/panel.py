"""The tab of studies: open one, brush and pick in its plots, start a small one."""

from __future__ import annotations

from collections.abc import Callable, Iterator
from typing import Literal

import viser

from explorer.app.features.feature import Services
from explorer.app.features.studies.actions import (
    ClearBrushes,
    OpenStudy,
    PickDesign,
)
from explorer.app.features.studies.feed import StudyDrawing, StudyFeed
from explorer.app.features.studies.plots import HINT, StudyPlots
from explorer.app.features.studies.runner import Run, StudyRunner
from explorer.app.features.studies.words import chips, legend, run_line, status, table
from explorer.app.session.session import Who
from explorer.app.state.action import Action
from explorer.app.state.actions import Set
from explorer.app.state.frame import Frame
from explorer.app.state.state import State
from explorer.app.state.studies import (
    FEWEST,
    LEAST_PERCENT,
    MOST,
    MOST_PERCENT,
    StudyPlan,
    label_of,
)
from explorer.app.widgets.assigning import Update
from explorer.app.widgets.buttons import Buttons, Does
from explorer.app.widgets.commands import NO_OPTION
from explorer.app.widgets.controls import At, Bound, Control, Controls, Span
from explorer.app.widgets.markup import alert, note
from explorer.errors import ExplorerError
from explorer.measures.catalogue import measures_in
from explorer.sweep.study import NAMES

Axis = Literal["across", "up", "colour"]
AXES: dict[Axis, tuple[str, str]] = {
    "across": ("Across", "Measure or variable from left to right in the scatter plot."),
    "up": ("Up", "Measure or variable from bottom to top in the scatter plot."),
    "colour": ("Coloured by", "Measure or variable that colours the designs in both plots."),
}
ALONG = {"Previous": -1, "Next": 1}


class StudiesPanel:
    """The plots, legend and table of the open study, and the controls of a new one."""

    def __init__(self, services: Services) -> None:
        if services.studies is None:
            raise RuntimeError("a page without folders of studies has no panel for them")
        gui, session, none = services.gui, services.session, (NO_OPTION,)
        self._services = services
        self._session = session
        self._complain = services.complain
        # Browsers with a tall drawer.
        self._tall: set[int] = set()
        self.choice = gui.add_dropdown(
            "Study",
            none,
            hint="A study of the data folder, or one named on the command line.",
        )
        self._control = Control[str](
            session,
            self.choice,
            Bound(
                lambda frame: frame.state.studies.name or NO_OPTION,
                lambda _, name: OpenStudy(None if name == NO_OPTION else name),
            ),
        )
        self.running = gui.add_html("", visible=False)
        self.cancel = gui.add_button(
            "Cancel study",
            color="red",
            visible=False,
            hint="End the study; finished designs are kept.",
        )
        self.go_on = gui.add_button(
            "Continue the study", visible=False, hint="Compute the designs that are missing."
        )
        self.status = gui.add_html("")
        self.plots = StudyPlots(services, self.pick, self.status)
        self.feed = StudyFeed(services.studies, session.redraw)
        self.runner = StudyRunner(session, self.feed, services.complain, services.faults)
        services.at_end(self.feed.stop)
        services.at_end(self.runner.stop)
        self.legend = gui.add_html("")
        self.along = gui.add_button_group(
            "Along the front",
            tuple(ALONG),
            hint="Open the previous or the next design of the front.",
        )
        self.table = gui.add_html("")
        self._places: dict[Axis, viser.GuiDropdownHandle[str]] = {
            axis: gui.add_dropdown(label, none, hint=hint) for axis, (label, hint) in AXES.items()
        }
        self._axes = [
            Control[str](session, handle, Bound(self._read_axis(axis), self._write_axis(axis)))
            for axis, handle in self._places.items()
        ]
        with gui.add_folder("New study", expand_by_default=False) as self._new:
            self._add_new_study(gui)
        self._listen()
        self._add_buttons(services.buttons)
        self._key: tuple[object, ...] = ()

    def updates(self, frame: Frame) -> Iterator[Update]:
        """Yield the updates that show a frame."""
        self.feed.follow(frame, dark=self._services.theme.is_dark)
        studies, drawing, run = frame.state.studies, self.feed.drawing, self.runner.run
        names = (NO_OPTION, *dict.fromkeys((*self.feed.names, *filter(None, (studies.name,)))))
        yield self.choice, "options", names
        yield from self._control.updates(frame)
        axes = (NO_OPTION,) if drawing is None or drawing.plotted is None else drawing.plotted.axes
        for handle in self._places.values():
            yield handle, "options", axes
            yield handle, "visible", axes != (NO_OPTION,)
        for control in self._axes:
            yield from control.updates(frame)
        yield from self._controls.updates(frame)
        # The texts are made again only after a change.
        key = (drawing, studies, run, self.feed.problem)
        if len(key) == len(self._key) and all(a is b for a, b in zip(key, self._key, strict=True)):
            return
        self._key = key
        yield from self._texts(studies.plan, drawing, run)

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

    def _texts(
        self, plan: StudyPlan, drawing: StudyDrawing | None, run: Run | None
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
        yield self.table, "content", "" if drawing is None else table(drawing)
        yield self.chips, "content", chips(plan)

    def _status(self, drawing: StudyDrawing | None) -> str:
        if self.feed.problem is not None:
            return alert("This study cannot be shown", self.feed.problem)
        if not self.plots.is_possible:
            return alert("No plots", HINT)
        if drawing is None:
            return note(
                "Open a study, or start a small one around the live design below; "
                "explorer sweep runs large ones."
            )
        return status(drawing)

    def _read_axis(self, axis: Axis) -> Callable[[Frame], str]:
        def read(_: Frame) -> str:
            drawing = self.feed.drawing
            if drawing is None or drawing.plotted is None:
                return NO_OPTION
            return str(getattr(drawing.plotted, axis))

        return read

    def _write_axis(self, axis: Axis) -> Callable[[State, str], Action]:
        label, _ = AXES[axis]
        return lambda _, name: Set(
            f"studies.{axis}", None if name == NO_OPTION else name, label, label_of(name)
        )

    def _add_new_study(self, gui: viser.GuiApi) -> None:
        self._controls = controls = Controls(gui, self._session)
        controls.slider(
            "Designs",
            "Number of designs, spread evenly by a Sobol sequence; powers of two spread best.",
            At("studies.plan.count", convert=round),
            Span(float(FEWEST), float(MOST), 1.0),
        )
        controls.slider(
            "Around by ± %",
            "Range of the variables around the live design: a share of their value, or of a "
            "20th of the reach where that is more; for the yaw a share of 90°.",
            "studies.plan.percent",
            Span(LEAST_PERCENT, MOST_PERCENT, 1.0),
        )
        self.chips = gui.add_html("")
        self.start = gui.add_button(
            "Start study",
            icon=viser.Icon.PLAYER_PLAY,
            hint="Compute the study in the background; its results go to the data folder.",
        )

    def _listen(self) -> None:
        self.start.on_click(
            lambda event: self.runner.start(
                self._session.state.design, self._session.state.studies.plan, event.client_id
            )
        )
        self.cancel.on_click(lambda _: self.runner.cancel())
        self.go_on.on_click(lambda event: self._go_on(event.client_id))
        self.along.on_click(lambda event: self._step(ALONG[self.along.value], event.client_id))

    def _add_buttons(self, buttons: Buttons) -> None:
        buttons.on("studies.pick", self._pick_row)
        buttons.on("studies.vary", self._switch("variable"), values=NAMES)
        buttons.on("studies.measure", self._switch("measure"), values=measures_in("studies"))
        buttons.on("studies.clear", self._clear)
        buttons.on("studies.taller", self._toggle_height)
        buttons.offer(
            "Studies › Clear brushes",
            "Free all axes.",
            "studies.clear",
            is_ready=lambda: bool(self._session.state.studies.brushes),
        )
        buttons.offer(
            "Studies › Taller drawer", "Make the drawer taller, or lower again.", "studies.taller"
        )

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

    def _pick_row(self, index: str, client: viser.ClientHandle) -> None:
        if index.isascii() and index.isdecimal():
            self.pick(int(index), client.client_id)

    def _clear(self, _: str, client: viser.ClientHandle) -> None:
        self._session.do(ClearBrushes(), who=client.client_id)

    def _toggle_height(self, _: str, client: viser.ClientHandle) -> None:
        self._tall ^= {client.client_id}
        self._services.resize_drawer(client, tall=client.client_id in self._tall)

    def _switch(self, what: Literal["variable", "measure"]) -> Does:
        def press(name: str, client: viser.ClientHandle) -> None:
            def change(state: State) -> Action:
                plan = state.studies.plan
                is_variable = what == "variable"
                turn = plan.with_variable_toggled if is_variable else plan.with_measure_advanced
                return Set("studies.plan", turn(name), "New study", label_of(name))

            self._session.post(object(), change, who=client.client_id)

        return press
