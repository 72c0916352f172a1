"""Studies: a tab to open one, brush and pick in its two plots, and start a small one; a chip.

viser's plots report nothing to the server. The script `plots` sends each of their events as a press
whose value is a line of JSON. The server draws brushes and picks, for every browser.
"""

from __future__ import annotations

import contextlib
from collections.abc import Callable, Iterator
from functools import partial
from typing import Annotated, Any, Literal, cast

import msgspec
import viser

from explorer.app.browser.browser_facts import decode_text
from explorer.app.browser.downloads import File
from explorer.app.browser.viser_gaps import run_script
from explorer.app.features.feature import Export, Feature, InBar, Services, Tab
from explorer.app.features.studies.actions import BrushAxes, OpenStudy, PickDesign, free_axes
from explorer.app.features.studies.feed import PlotJson, StudyDrawing
from explorer.app.features.studies.folders import keep_study, study_folders
from explorer.app.features.studies.state import (
    COUNTS,
    PERCENTS,
    Brush,
    Studies,
    StudyPlan,
    label_of,
)
from explorer.app.features.studies.words import BUTTONS, acts, chips, head, legend, table
from explorer.app.features.studies.work import study_runner
from explorer.app.inputs.controls import At, Bound, Control, Controls
from explorer.app.inputs.ranges import Span
from explorer.app.look import read_script
from explorer.app.session.session import Change, Who
from explorer.app.state.actions import Action, Set
from explorer.app.state.frame import Frame
from explorer.app.state.state import State
from explorer.app.widgets.assigning import Update
from explorer.app.widgets.buttons import Buttons, PressHandler, activity, press_button
from explorer.app.widgets.chips import Chip, Chips, turn
from explorer.app.widgets.markup import alert, beside
from explorer.app.widgets.palette import NO_OPTION
from explorer.errors import ExplorerError
from explorer.files.extras import check_extra, is_missing
from explorer.measures.catalogue import measures_in
from explorer.numerics.number_text import format_number
from explorer.sweep.results import load_results, table_bytes
from explorer.sweep.study import NAMES, decode_study

# Height over width.
PARALLEL_ASPECT, SCATTER_ASPECT = 0.28, 0.42
Axis = Literal["across", "up", "colour"]
AXES: dict[Axis, tuple[str, str]] = {
    "across": ("Across", "Measure or variable from left to right in the scatter plot."),
    "up": ("Up", "Measure or variable from bottom to top in the scatter plot."),
    "colour": ("Coloured by", "Measure or variable that colours the designs in both plots."),
}


LOOKS = {
    name: Chip(words, f"Studies › {words}", hint, turn(f"studies.{name}", words))
    for name, words, hint in (
        ("logarithmic", "Logarithmic axes", "Draw axes of positive values on a logarithm."),
        ("front_only", "Only the front", "Draw only the designs on the Pareto front."),
    )
}


class PlotEvent(msgspec.Struct, frozen=True, forbid_unknown_fields=True, kw_only=True):
    """A click on a design in a plot, or a change of its brushes.

    Attributes:
        study: Name of the study of the plot.
        index: Index of the design; None for a brush.
        brushes: New ranges of axes; an axis without ranges is freed.
    """

    study: str
    index: Annotated[int, msgspec.Meta(ge=0, le=2**31)] | None = None
    brushes: tuple[Brush, ...] = ()


DECODER = msgspec.json.Decoder(PlotEvent)


class StudiesPanel:
    """The plots, legend and table of the open study, and the controls of a new one."""

    def __init__(self, services: Services) -> None:
        gui, session, none = services.gui, services.session, (NO_OPTION,)
        gui.add_html(beside(2))
        self._services, self._tab = services, services.tab
        self._session = session
        self._complain = services.complain
        self.choice = gui.add_dropdown(
            "Study",
            none,
            hint="A study of the data folder, or one named on the command line.",
        )
        self._control = Control[str](
            session,
            self.choice,
            Bound(
                lambda frame: Studies.of(frame.state).name or NO_OPTION,
                lambda _, name: OpenStudy(None if name == NO_OPTION else name),
            ),
        )
        self._acts = gui.add_html("")
        self._head = gui.add_html("")
        # viser's folders cannot be folded from here; one without a title is shown or hidden.
        with gui.add_folder(None, visible=False) as self.form:
            self._add_new_study(gui)
        lines_after = gui.add_html("")
        self._axes_mark = gui.add_html(beside(3), visible=False)
        self._axes: list[tuple[viser.GuiDropdownHandle[str], Control[str]]] = []
        for axis, (label, hint) in AXES.items():
            handle = gui.add_dropdown(label, none, hint=hint, visible=False)
            self._axes.append((handle, Control[str](session, handle, self._bind_axis(axis))))
        self.legend = gui.add_html("")
        points_after = gui.add_html(beside(2, wide=True))
        self._plots_after = lines_after, points_after
        self.plots: tuple[viser.GuiPlotlyHandle, viser.GuiPlotlyHandle] | None = None
        self.table = gui.add_html("")
        self.runner = services.get(study_runner)
        self.feed = self.runner.feed
        services.buttons.on("studies.plot", self._receive)
        self._add_buttons(services.buttons)
        self._looks = Chips(services.buttons, session, "studies.look", "", LOOKS)
        self._key: tuple[object, ...] = ()

    def updates(self, frame: Frame) -> Iterator[Update]:
        """Yield the updates that show a frame."""
        self.feed.follow(frame, dark=self._services.theme.is_dark)
        studies, drawing, run = Studies.of(frame.state), self.feed.drawing, self.runner.run
        names = (NO_OPTION, *dict.fromkeys((*self.feed.names, *filter(None, (studies.name,)))))
        yield self.choice, "options", names
        yield from self._control.updates(frame)
        axes = (NO_OPTION,) if drawing is None or drawing.plotted is None else drawing.plotted.axes
        has_axes = axes != (NO_OPTION,)
        yield self._axes_mark, "visible", has_axes
        for handle, control in self._axes:
            yield handle, "options", axes
            yield handle, "visible", has_axes
            yield from control.updates(frame)
        is_new = run is None and studies.name is None
        yield self.form, "visible", is_new
        yield from self._controls.updates(frame)
        # The texts are made again only after a change.
        key = (drawing, studies, run, self.feed.problem, is_new, frame.state.design)
        if len(key) == len(self._key) and all(a is b for a, b in zip(key, self._key, strict=True)):
            return
        self._key = key
        can_go_on = drawing is not None and not drawing.is_complete
        looks = "" if drawing is None else self._looks.buttons(frame.state)
        yield self._acts, "content", acts(run, looks, is_new=is_new, can_go_on=can_go_on)
        problem = None
        if self.feed.problem is not None:
            problem = alert("This study cannot be shown", self.feed.problem)
        plan = studies.plan if is_new else None
        lines = head(None if problem else drawing, run, plan, frame.state.design.name)
        yield self._head, "content", lines + (problem or "")
        yield from self._plots(drawing)
        yield self.legend, "content", "" if drawing is None else legend(drawing)
        yield self.table, "content", "" if drawing is None else table(drawing)
        yield self.chips, "content", chips(studies.plan, frame.state.design)

    def pick(self, index: int, who: Who) -> None:
        """Open the design with an index in the open study."""
        drawing = self.feed.drawing
        if drawing is None:
            return
        try:
            design = drawing.results.design_at(index)
        except ExplorerError as error:
            self._complain(str(error), who)
            return
        name = str(drawing.studies.name)
        self._session.do(PickDesign(design, index=index, study=name), who=who)

    def _plots(self, drawing: StudyDrawing | None) -> Iterator[Update]:
        plots = None if drawing is None else drawing.plots
        if plots is not None and self.plots is None and not is_missing("study"):
            self.plots = self._add_plots()
        for handle in self.plots or ():
            yield handle, "visible", plots is not None
        for handle, plot in zip(self.plots or (), plots or (), strict=False):
            yield handle, "figure", plot

    def _add_plots(self) -> tuple[viser.GuiPlotlyHandle, viser.GuiPlotlyHandle]:
        """Add the plots when they are first needed: each browser then loads Plotly, some 5 MB."""
        gui = self._services.gui
        # viser only calls `to_json` of a figure.
        empty = cast("Any", PlotJson({"data": [], "layout": {}}))
        # Each plot comes between the elements before and after it.
        after_lines, after_points = (handle.order + 0.5 for handle in self._plots_after)
        with self._tab or contextlib.nullcontext():
            lines = gui.add_plotly(empty, aspect=PARALLEL_ASPECT, order=after_lines)
            points = gui.add_plotly(empty, aspect=SCATTER_ASPECT, order=after_points)
        run_script(self._services.server, read_script("plots"))
        return lines, points

    def _receive(self, line: str, client: viser.ClientHandle) -> None:
        event = decode_text(line, DECODER)
        # An event in the plot of another study is out of date.
        if event is None or event.study != Studies.of(self._session.state).name:
            return
        if event.index is not None:
            self.pick(event.index, client.client_id)
        elif event.brushes:
            self._session.do(BrushAxes(event.brushes), who=client.client_id)

    def _bind_axis(self, axis: Axis) -> Bound[str]:
        def read(_: Frame) -> str:
            plotted = None if self.feed.drawing is None else self.feed.drawing.plotted
            return NO_OPTION if plotted is None else str(getattr(plotted, axis))

        def write(_: State, name: str) -> Action:
            path, label = f"studies.{axis}", AXES[axis][0]
            return Set(path, None if name == NO_OPTION else name, label, label_of(name))

        return Bound(read, write)

    def _add_new_study(self, gui: viser.GuiApi) -> None:
        self._controls = controls = Controls(gui, self._session)
        gui.add_html(beside(2))
        controls.slider(
            "Number of designs",
            "How many designs are computed, spread evenly over the ranges by a Sobol sequence; "
            "powers of two spread best.",
            At("studies.plan.count", convert=round),
            Span(*COUNTS, 1.0),
        )
        controls.slider(
            "Range, ± %",
            "How far each variable goes to both sides of its value in the live design: a share of "
            "the value, or of a 20th of the reach where that is more; for the yaw a share of 90°.",
            "studies.plan.percent",
            Span(*PERCENTS, 1.0),
        )
        self.chips = gui.add_html("")

    def _add_buttons(self, buttons: Buttons) -> None:
        handlers: dict[str, tuple[PressHandler, Callable[[], bool]]] = {
            "start": (self._start, lambda: self.runner.run is None and not is_missing("study")),
            "cancel": (lambda _, __: self.runner.cancel(), lambda: self.runner.run is not None),
            "continue": (self._go_on, self._can_go_on),
            "new": (
                lambda _, client: self._session.do(OpenStudy(None), who=client.client_id),
                lambda: Studies.of(self._session.state).name is not None,
            ),
            "clear": (
                lambda _, client: self._session.do(free_axes, who=client.client_id),
                lambda: bool(Studies.of(self._session.state).brushes),
            ),
        }
        for name, (handle, is_ready) in handlers.items():
            words, hint = BUTTONS[name]
            buttons.on(f"studies.{name}", handle)
            buttons.offer(f"Studies › {words}", hint, f"studies.{name}", is_ready=is_ready)
        buttons.on("studies.pick", self._pick_row)
        do_on_press = self._services.do_on_press
        do_on_press("studies.vary", partial(_turn, StudyPlan.with_variable_toggled), NAMES)
        measures = measures_in("studies")
        do_on_press("studies.measure", partial(_turn, StudyPlan.with_measure_advanced), measures)

    def _start(self, _: str, client: viser.ClientHandle) -> None:
        state = self._session.latest_state()
        self.runner.start(state.design, Studies.of(state).plan, client.client_id)

    def _go_on(self, _: str, client: viser.ClientHandle) -> None:
        name = Studies.of(self._session.state).name
        if name is not None:
            self.runner.go_on(name, client.client_id)

    def _can_go_on(self) -> bool:
        drawing = self.feed.drawing
        return self.runner.run is None and drawing is not None and not drawing.is_complete

    def _pick_row(self, index: str, client: viser.ClientHandle) -> None:
        if index.isascii() and index.isdecimal():
            self.pick(int(index), client.client_id)


def _turn(turn: Callable[[StudyPlan, str], StudyPlan], name: str) -> Change:
    """Return the change that a press on a variable or measure of the new study makes."""
    return lambda state: Set(
        "studies.plan", turn(Studies.of(state).plan, name), "New study", label_of(name)
    )


class StudyChip:
    """How far the study is, and the button that ends it."""

    def __init__(self, services: Services) -> None:
        self._runner = services.get(study_runner)

    def __call__(self, _: Frame) -> str:
        """Return the chip, as HTML; "" while no study is computed."""
        run = self._runner.run
        if run is None:
            return ""
        cancel = press_button(
            "studies.cancel",
            "",
            "Cancel",
            hint=BUTTONS["cancel"][1],
            class_name="ex-button",
            is_disabled=run.is_cancelled,
        )
        done = 0 if run.progress is None else run.progress.done
        return activity("Studies", run.name, f"{format_number(done)} designs", run.share, cancel)


def open_study(services: Services, data: bytes, name: str) -> tuple[Action, str]:
    """Return the action that opens the study in a file, and what it is; see `Opener`."""
    check_extra("study")
    study, folders = decode_study(data, name), services.get(study_folders)
    folder = folders.new(study.name)
    keep_study(folder, study)
    services.get(study_runner).feed.look()
    return OpenStudy(folder.name), f"The study {study.name}; {BUTTONS['continue'][0]} computes it."


def send_table(services: Services, name: str, who: Who) -> None:
    """Send the rows of the open study."""
    study = str(Studies.of(services.session.latest_state()).name)

    def make(_: viser.ClientHandle) -> File:
        results = load_results(services.get(study_folders).folder(study))
        return f"{study}.{name.lower()}", table_bytes(results, is_csv=name == "CSV")

    services.downloads.make(who, "Writing the table", make)


STUDIES = Feature(
    "studies",
    manual="studies.md",
    tabs=(Tab("work", "Studies", StudiesPanel, viser.Icon.CHART_DOTS),),
    bar=(InBar("right", StudyChip),),
    exports=(
        Export(
            "Study",
            "The table of the study that is open in the tab Studies, a line for each design.",
            ("CSV", "Parquet"),
            send_table,
            lambda services: Studies.of(services.session.state).name is not None,
        ),
    ),
    openers=dict.fromkeys(("variables", "sampling", "measures", "objectives"), open_study),
    is_offered=lambda services: services.has(study_folders),
)
