"""The optimiser: its tab with problem, search and charts, and its part of the bar."""

from __future__ import annotations

from collections.abc import Callable, Iterator
from dataclasses import replace
from html import escape

import viser

from explorer.app.features.feature import Feature, FileExport, Services, Tab
from explorer.app.features.optimise.actions import SetObjective
from explorer.app.features.optimise.buttons import ACCEPT, add_buttons, button
from explorer.app.features.optimise.runner import Optimiser
from explorer.app.features.optimise.state import Optimisation, OptimisationRequest, SearchRun
from explorer.app.features.optimise.words import (
    VERDICTS,
    goal_unit,
    result_words,
    search_notice,
    search_words,
)
from explorer.app.features.optimise.work import complete_request
from explorer.app.features.prototype.building import BuildVerdict
from explorer.app.inputs.bindings import At, ControlBinding
from explorer.app.inputs.controls import Controls
from explorer.app.session.session import Who
from explorer.app.state.actions import Action, Set
from explorer.app.state.frame import Frame
from explorer.app.state.state import State
from explorer.app.widgets.buttons import activity
from explorer.export.drawings.charts import search_chart
from explorer.export.drawings.markup import page_picture
from explorer.measures.catalogue import CATALOGUE
from explorer.mechanism.design import VARIABLES
from explorer.numerics.number_text import Unit, format_number
from explorer.optimise.outcome import OBJECTIVE_SYMBOLS, Curve, Iterate, curves_of, encode_record
from explorer.optimise.problem import YAW, ObjectiveName, Problem

OBJECTIVES: dict[str, ObjectiveName] = {
    "match a volume": "match-volume",
    "shortest legs for a volume": "smallest-reach",
    "largest volume for a leg length": "largest-volume",
}
FREE = {
    **{name: f"Let {name} change." for name in VARIABLES},
    YAW: "Let the yaw of home change, and with it the orientation of the workspace.",
}
FREE_LABELS = {YAW: "yaw of home"}
STEP = 0.001
# Width and height of a chart with its axes, and its place in that, in pixels.
SIZE, PLACE = "0 0 280 120", (48.0, 222.0, 6.0, 78.0)


class OptimisePanel(Controls):
    """The controls of the problem, the search with its result, and the charts."""

    def __init__(self, services: Services) -> None:
        super().__init__(services)
        gui, verdict = services.gui, services.get(BuildVerdict)
        # The run and the unit that are drawn, and their charts.
        self._drawn: tuple[SearchRun | None, Unit | None, str] = (None, None, "")
        add_buttons(services)
        # By its class the stylesheet puts what follows it side by side, and keeps it in sight.
        self.markup(lambda frame: f'<div class="ex-columns">{search_words(frame.state)}</div>')
        with gui.add_folder("Problem"):
            self._add_problem()
            title = "Free variables"
            folder = gui.add_folder(title, expand_by_default=False)
            with folder, services.commands.within(title):
                for name, hint in FREE.items():
                    self._add_free(name, hint)
        self.markup(lambda frame: result_words(frame.state, verdict.html()))
        folder = gui.add_folder("Course of the search", visible=False)
        self.follow(folder, "visible", lambda frame: self._charts(frame) != "")
        with folder:
            self.markup(self._charts)

    def _charts(self, frame: Frame) -> str:
        """Return the charts of the last run, drawn again for another one, or another unit."""
        run, unit = Optimisation.of(frame.state).run, frame.state.unit
        if run is not self._drawn[0] or unit != self._drawn[1]:
            charts = "" if run is None else "".join(course(run, frame.state))
            self._drawn = run, unit, charts
        return self._drawn[2]

    def _add_problem(self) -> None:
        self.dropdown(
            "Objective",
            "The measure that the search improves.",
            OBJECTIVES,
            At("optimisation.request.objective", action=SetObjective),
            is_in_palette=True,
        )
        self._add_number(
            "volume",
            "volume",
            "The exact volume of the workspace, at the orientation of home: to match, or at least.",
            visible=lambda state: _request(state).needs_volume,
        )
        self._add_number(
            "reach",
            "longest_leg",
            "The largest maximum length of l1, d2, d4 and l4 allowed.",
            visible=lambda state: not _request(state).needs_volume,
        )
        self._add_number(
            "clearance",
            "demanded_clearance",
            "The least clearance of any two legs, their radii taken off, wherever in the "
            "workspace all margins are at least a 20th of the reach that the search starts with; 0 "
            "for no demand.",
        )
        self.number(
            "Starts",
            "Number of designs to start from: the present one, and others spread over the bounds.",
            At("optimisation.request.starts", convert=round),
            least=1,
            step=1,
        )

    def _add_number(
        self,
        field: str,
        measure: str,
        hint: str,
        *,
        visible: Callable[[State], bool] | None = None,
    ) -> None:
        """Add a demand, with the label of the measure that it bounds."""
        at = At(
            f"optimisation.request.{field}",
            default=lambda state: getattr(complete_request(state), field),
        )
        label, power = CATALOGUE[measure].label.capitalize() + " ({unit})", CATALOGUE[measure].power
        self.number(label, hint, at, least=0.0, step=STEP, power=power, visible=visible)

    def _add_free(self, name: str, hint: str) -> None:
        def write(state: State, on: bool) -> Action:
            free = _request(state).free
            chosen = tuple(key for key in FREE if (on if key == name else key in free))
            label = f"Free variable {FREE_LABELS.get(name, name)}"
            return Set("optimisation.request.free", chosen, label, "on" if on else "off")

        self.checkbox(
            FREE_LABELS.get(name, name),
            hint,
            ControlBinding(lambda frame: name in _request(frame.state).free, write),
        )


def _request(state: State) -> OptimisationRequest:
    return Optimisation.of(state).request


def course(run: SearchRun, state: State) -> Iterator[str]:
    """Yield the charts of a run, each with its caption, as HTML in the unit of a state."""
    iterates = charted_iterates(run)
    for curve in curves_of(run.problem, iterates) if iterates else ():
        is_plain = curve.kind == "spare" or curve.powers
        goal = "match-volume" if curve.kind == "volume" else run.problem.objective
        unit = Unit("") if is_plain else goal_unit(goal, state)
        level = None if curve.level is None else unit.factor * curve.level
        shown = replace(curve, values=unit.factor * curve.values, level=level)
        name = _name(run.problem, iterates[-1], shown, unit)
        yield f'<div class="ex-note ex-dim ex-cut">{escape(name)}</div>'
        yield page_picture("ex-map ex-course", name, *search_chart(shown, *PLACE), viewBox=SIZE)


def charted_iterates(run: SearchRun) -> list[Iterate]:
    """Return the iterates of the present start; once the run has ended, of the best one."""
    if not run.iterates:
        return []
    start = (run.best or run.iterates[-1]).run
    return [iterate for iterate in run.iterates if iterate.run == start]


def _name(problem: Problem, last: Iterate, curve: Curve, unit: Unit) -> str:
    """Return the name of the values of a curve, with the last one in a unit."""
    if curve.kind == "spare":
        return f"Worst constraint, broken below 0: {last.worst or 'none'}"
    if curve.kind == "volume":
        target = "" if curve.level is None else f", required {format_number(curve.level, 6)}"
        return f"Volume: {unit.text(last.volume, 6)}{target}"
    if curve.powers:
        return f"F = |1 − V / V′|: {format_number(last.objective, 2, size=1.0)}"
    name = OBJECTIVE_SYMBOLS[problem.objective].capitalize()
    return f"{name}: {unit.text(last.objective, 6)}"


TAB = "Optimise"


def search_chip(frame: Frame) -> str:
    """Return the search that runs or waits for an answer, as HTML."""
    state = frame.state
    notice = search_notice(state)
    if notice is None:
        return ""
    buttons = "".join(button(name, state, is_main=name == ACCEPT) for name in notice.buttons)
    return activity(TAB, notice.title, notice.text, notice.share, buttons)


def send_record(services: Services, _: str, who: Who) -> None:
    """Send the record of the search that ended last."""
    state = services.session.latest_state()
    record = Optimisation.of(state).record
    if record is not None:
        services.downloads.send(who, f"{state.design.name}.record.json", encode_record(record))


OPTIMISE = Feature(
    "optimise",
    manual="optimise.md#On the page",
    tabs=(Tab("work", "Optimise", OptimisePanel, viser.Icon.SPARKLES),),
    bar=(("right", lambda _: search_chip),),
    verdicts=VERDICTS,
    exports=(
        FileExport(
            "Record of the search",
            "What repeats the last search of the tab Optimise, and tells its course in a report.",
            ("JSON",),
            send_record,
            lambda services: Optimisation.of(services.session.state).record is not None,
        ),
    ),
    runners=(Optimiser,),
)
