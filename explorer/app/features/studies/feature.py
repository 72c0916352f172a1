"""Studies: a tab to open one, brush and pick in its two plots, and start a small one; a chip.

The script `plots` sends what is done to a plot as a press whose value is a line of JSON. The server
finds the design or the axes there, and draws brushes and picks, for every browser.
"""

from __future__ import annotations

from collections.abc import Callable, Iterator
from functools import partial
from typing import Annotated, Literal

import msgspec
import viser

from explorer.app.features.feature import Feature, FileExport, Services, Tab
from explorer.app.features.studies.figures import PlotName, brushes_in, reading_of, row_at
from explorer.app.features.studies.folders import keep_study, study_folders
from explorer.app.features.studies.state import (
    COUNTS,
    PERCENTS,
    Brush,
    Studies,
    StudyPlan,
    brush_axes,
    free_axes,
    label_of,
    open_study,
    pick_design,
)
from explorer.app.features.studies.words import BUTTONS, acts, chips, head, legend, table
from explorer.app.features.studies.work import StudyRunner, study_feed
from explorer.app.inputs.bindings import At, ControlBinding
from explorer.app.inputs.controls import Controls
from explorer.app.inputs.ranges import Span
from explorer.app.session.session import Change, Who
from explorer.app.state.actions import Action, Set
from explorer.app.state.frame import Frame
from explorer.app.state.state import State
from explorer.app.widgets.buttons import Buttons, PressHandler, activity, press_button
from explorer.app.widgets.chips import Chips, StateCommand, turn
from explorer.app.widgets.downloads import File
from explorer.app.widgets.markup import alert, beside
from explorer.errors import ExplorerError
from explorer.files.extras import check_extra, is_missing
from explorer.measures.catalogue import measures_in
from explorer.numerics.number_text import format_number
from explorer.page.browser.browser_facts import decode_text
from explorer.page.browser.viser_gaps import run_script, run_script_in
from explorer.page.look import call_script, read_script
from explorer.page.widgets.assigning import Update
from explorer.page.widgets.palette import NO_OPTION
from explorer.sweep.results import csv_bytes, load_results, parquet_bytes
from explorer.sweep.study import NAMES, decode_study

Axis = Literal["across", "up", "colour"]
AXES: dict[Axis, tuple[str, str]] = {
    "across": ("Across", "Measure or variable from left to right in the scatter plot."),
    "up": ("Up", "Measure or variable from bottom to top in the scatter plot."),
    "colour": ("Coloured by", "Measure or variable that colours the designs in both plots."),
}


LOOKS = {
    name: StateCommand(f"Studies › {words}", hint, *turn(f"studies.{name}", words))
    for name, words, hint in (
        ("logarithmic", "Logarithmic axes", "Draw axes of positive values on a logarithm."),
        ("front_only", "Only the front", "Draw only the designs on the Pareto front."),
    )
}


Share = Annotated[float, msgspec.Meta(ge=0.0, le=1.0)]
Pixels = Annotated[float, msgspec.Meta(gt=0.0)]


class PlotEvent(msgspec.Struct, frozen=True, forbid_unknown_fields=True, kw_only=True):
    """A gesture of a pointer on a plot, from its start to its end; the size is in pixels.

    It reads or picks the design at the end, brushes the axes of a box, or frees all axes.
    """

    study: str
    plot: PlotName
    act: Literal["read", "pick", "brush", "free"]
    start: tuple[Share, Share]
    end: tuple[Share, Share]
    size: tuple[Pixels, Pixels]


DECODER = msgspec.json.Decoder(PlotEvent)


class StudiesPanel(Controls):
    """The plots, legend and table of the open study, and the controls of a new one."""

    def __init__(self, services: Services) -> None:
        super().__init__(services)
        gui, session, none = services.gui, services.session, (NO_OPTION,)
        gui.add_html(beside(2))
        self._services = services
        self._complain = services.complain
        self.runner, self.feed = services.get(StudyRunner), services.get(study_feed)
        self.choice = self.dropdown(
            "Study",
            "A study of the data folder, or one named on the command line.",
            none,
            ControlBinding(
                lambda frame: Studies.of(frame.state).name or NO_OPTION,
                lambda _, name: open_study(None if name == NO_OPTION else name),
            ),
        )
        self.follow(self.choice, "options", self._names)
        self._acts = gui.add_html("")
        self._head = gui.add_html("")
        # viser's folders cannot be folded from here; one without a title is shown or hidden.
        with gui.add_folder(None, visible=False) as self.form:
            self._add_new_study(services)
        self.follow(self.form, "visible", self._is_new)
        self.lines = gui.add_html("")
        self.follow(gui.add_html(beside(3)), "visible", lambda _: self._axes != none)
        for axis, (label, hint) in AXES.items():
            handle = self.dropdown(label, hint, none, self._bind_axis(axis))
            self.follow(handle, "options", lambda _: self._axes)
            self.follow(handle, "visible", lambda _: self._axes != none)
        self.legend = gui.add_html("")
        gui.add_html(beside(2, wide=True))
        self.points = gui.add_html("")
        self.table = gui.add_html("")
        services.buttons.on("studies.plot", self._receive)
        run_script(services.server, read_script("plots"))
        self._add_buttons(services.buttons)
        self._looks = Chips(services.buttons, session, "studies.look", "", LOOKS)
        self._key: tuple[object, ...] = ()

    def updates(self, frame: Frame) -> Iterator[Update]:
        """Yield the updates that show a frame."""
        studies, drawing, run = Studies.of(frame.state), self.feed.drawing, self.runner.run
        yield from super().updates(frame)
        is_new = self._is_new(frame)
        # The texts are made again only after a change.
        lengths = frame.state.view.lengths
        key = (drawing, studies, run, self.feed.problem, is_new, frame.state.design, lengths)
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
        lines, points = ("", "") if drawing is None else drawing.plots
        yield self.lines, "content", lines
        yield self.points, "content", points
        yield self.legend, "content", "" if drawing is None else legend(drawing)
        yield self.table, "content", "" if drawing is None else table(drawing)
        yield self.chips, "content", chips(studies.plan, frame.state.design, frame.state.unit)

    def _is_new(self, frame: Frame) -> bool:
        return self.runner.run is None and Studies.of(frame.state).name is None

    def _names(self, frame: Frame) -> tuple[str, ...]:
        name = Studies.of(frame.state).name
        return (NO_OPTION, *dict.fromkeys((*self.feed.names, *filter(None, (name,)))))

    @property
    def _axes(self) -> tuple[str, ...]:
        """The axes of the plots; none to choose from without plots."""
        drawing = self.feed.drawing
        return (NO_OPTION,) if drawing is None or not drawing.plotted else drawing.plotted.axes

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
        self._session.do(pick_design(design, index, name), who=who)

    def _receive(self, line: str, client: viser.ClientHandle) -> None:
        event, drawing = decode_text(line, DECODER), self.feed.drawing
        # An event in the plot of another study is out of date.
        if event is None or drawing is None or event.study != drawing.studies.name:
            return
        plotted, who = drawing.plotted, client.client_id
        if plotted is None:
            return
        if event.act == "free":
            free = (Brush(name, ()) for name in plotted.axes_of(event.plot))
            self._session.do(brush_axes(tuple(free)), who=who)
        elif event.act == "brush":
            brushes = brushes_in(plotted, event.plot, event.start, event.end)
            self._session.do(brush_axes(tuple(brushes)), who=who)
        else:
            row = row_at(plotted, event.plot, event.end, event.size)
            if event.act == "read":
                answer = reading_of(plotted, event.plot, row)
                run_script_in(client, call_script("plots", event.plot, *answer))
            elif row is not None:
                self.pick(int(plotted.results.columns["index"][row]), who)

    def _bind_axis(self, axis: Axis) -> ControlBinding[str]:
        def read(_: Frame) -> str:
            plotted = None if self.feed.drawing is None else self.feed.drawing.plotted
            return NO_OPTION if plotted is None else str(getattr(plotted, axis))

        def write(_: State, name: str) -> Action:
            path, label = f"studies.{axis}", AXES[axis][0]
            return Set(path, None if name == NO_OPTION else name, label, label_of(name))

        return ControlBinding(read, write)

    def _add_new_study(self, services: Services) -> None:
        gui = services.gui
        gui.add_html(beside(2))
        self.slider(
            "Number of designs",
            "How many designs are computed, spread evenly over the ranges by a Sobol sequence; "
            "powers of two spread best.",
            At("studies.plan.count", convert=round),
            Span(*COUNTS, 1.0),
        )
        self.slider(
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
                lambda _, client: self._session.do(open_study(None), who=client.client_id),
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
        vary = partial(_set_plan, StudyPlan.with_variable_toggled)
        measure = partial(_set_plan, StudyPlan.with_measure_advanced)
        self._services.do_on_press("studies.vary", vary, NAMES)
        self._services.do_on_press("studies.measure", measure, measures_in("studies"))

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


def _set_plan(change: Callable[[StudyPlan, str], StudyPlan], name: str) -> Change:
    """Return the change that a press on a variable or measure of the new study makes."""
    return lambda state: Set(
        "studies.plan", change(Studies.of(state).plan, name), "New study", label_of(name)
    )


def study_chip(runner: StudyRunner) -> str:
    """Return how far a study is and the button that ends it, as HTML; "" without one."""
    run = runner.run
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


def open_study_file(services: Services, data: bytes, name: str) -> tuple[Action, str]:
    """Return the action that opens the study in a file, and what it is; see `Opener`."""
    check_extra("study")
    study, folders = decode_study(data, name), services.get(study_folders)
    folder = folders.new(study.name)
    keep_study(folder, study)
    services.get(study_feed).look()
    return open_study(folder.name), f"The study {study.name}; {BUTTONS['continue'][0]} computes it."


def send_table(services: Services, name: str, who: Who) -> None:
    """Send the rows of the open study."""
    state = services.session.latest_state()
    study = str(Studies.of(state).name)

    def make(_: viser.ClientHandle) -> File:
        results = load_results(services.get(study_folders).folder(study))
        if name == "Parquet":
            return f"{study}.parquet", parquet_bytes(results)
        return f"{study}.csv", csv_bytes(results, state.view.unit_for(results.study.base))

    services.downloads.make(who, "Writing the table", make)


STUDIES = Feature(
    "studies",
    manual="studies.md",
    tabs=(Tab("work", "Studies", StudiesPanel, viser.Icon.CHART_DOTS),),
    bar=(("right", lambda services: lambda _: study_chip(services.get(StudyRunner))),),
    later_feeds=(study_feed,),
    exports=(
        FileExport(
            "Study",
            "The table of the study that is open in the tab Studies, a line for each design.",
            ("CSV", "Parquet"),
            send_table,
            lambda services: Studies.of(services.session.state).name is not None,
        ),
    ),
    openers=dict.fromkeys(("variables", "sampling", "measures", "objectives"), open_study_file),
    is_offered=lambda services: services.has(study_folders),
)
