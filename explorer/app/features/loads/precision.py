"""The precision of the tool: its errors, its deflection, and the budget of tolerances."""

from __future__ import annotations

from collections.abc import Iterable
from functools import lru_cache

from explorer.app.features.feature import FileExport, Services, html_of
from explorer.app.features.loads import load as tasks
from explorer.app.features.loads.load import Loads
from explorer.app.inputs.bindings import At
from explorer.app.inputs.controls import Controls
from explorer.app.session.feed import FeedOf
from explorer.app.session.session import Who
from explorer.app.state.actions import Action, Set
from explorer.app.state.frame import Frame
from explorer.app.state.state import State
from explorer.app.widgets.blocks import render
from explorer.app.widgets.markup import box, dim
from explorer.measures.blocks import precision as answers
from explorer.measures.box import PositionSet
from explorer.mechanism.design_file import typical_machine
from explorer.statics.budget import with_tolerances
from explorer.statics.compliance import is_elastic

LOAD = "the load and the weights above"
OVER: dict[str, PositionSet] = {
    "the present pose": "pose",
    "the box of the design": "box",
    "the workspace": "workspace",
}
OVER_HINT = (
    "Positions at which the precision is wanted: the present one; the box that bounds b4, or the "
    "workspace, at nodes of a grid in the orientation of home."
)


def budget_request(state: State) -> tasks.BudgetRequest:
    """Return the request for the budget of a state."""
    view, design = state.view.precision, state.design
    pose = state.pose if view.over == "pose" else design.home_pose
    return tasks.BudgetRequest(
        design,
        view.over,
        pose,
        design.limits.box,
        view.wanted,
        view.wanted_turn if view.wanted is not None else None,
        view.keep_actuators and view.wanted is not None,
    )


BUDGET_FEED = FeedOf(
    tasks.budget_of,
    lambda frame: budget_request(frame.state) if frame.state.view.precision.budget else None,
)


def _zero_for_none(path: str) -> At:
    return At(path, default=lambda _: 0.0, convert=lambda value: value or None)


def _is_wanted(state: State) -> bool:
    return state.view.precision.budget and state.view.precision.wanted is not None


class PrecisionPanel(Controls):
    """Errors of the tool, its deflection, what is drawn of them, and the budget of tolerances."""

    def __init__(self, services: Services) -> None:
        super().__init__(services)
        gui, self._loads = services.gui, services.get(Loads)
        self._feed = services.get(BUDGET_FEED)
        with gui.add_folder("Precision"):
            self.markup(self._errors)
            self.checkbox(
                "Error ellipsoid in the scene",
                "Draw the ellipsoid of the tool's RMS displacement, for errors uniform within "
                "their bounds, magnified as its label says.",
                "view.precision.ellipsoid",
            )
            self.markup(
                lambda frame: render(answers.deflections(self._loads.precision(frame), LOAD))
            )
            self.checkbox(
                "Deflected shape in the scene",
                "Draw platform and legs as the load deflects them, magnified.",
                "view.precision.deflected",
            )
            self.number(
                "Magnification (0: automatic)",
                "How many times larger the deflection is drawn than it is.",
                _zero_for_none("view.precision.times"),
                least=0.0,
                step=1.0,
                visible=lambda state: state.view.precision.deflected,
            )
        with gui.add_folder("Budget of tolerances"):
            self.checkbox(
                "What each tolerance costs",
                "Rank the six actuators and the 25 dimensions by what their errors cost at the "
                "tool.",
                "view.precision.budget",
            )
            self.dropdown("Worst over", OVER_HINT, OVER, "view.precision.over", is_in_palette=True)
            self.number(
                "Wanted within ± (mm)",
                "Largest displacement of the tool that is wanted: tolerances of the least total "
                "effort that keep it are found. 0 ranks the tolerances as they are.",
                _zero_for_none("view.precision.wanted"),
                least=0.0,
                step=0.01,
                visible=lambda state: state.view.precision.budget,
            )
            self.number(
                "and turned within ± (°)",
                "Largest turn of the tool that is wanted besides; 0 is any.",
                _zero_for_none("view.precision.wanted_turn"),
                least=0.0,
                step=0.01,
                visible=_is_wanted,
            )
            self.checkbox(
                "Keep the actuators' errors",
                "Find tolerances of the dimensions alone, with the errors of the actuators as they "
                "are; off, errors of the actuators are found too.",
                "view.precision.keep_actuators",
                visible=_is_wanted,
            )
            self.markup(self._budget_html)
        self._set = services.link(
            "precision.set",
            "Loads › Set these tolerances",
            "Give the design these tolerances, and these errors of its actuators.",
            self._set_tolerances,
        )
        self._copy = services.copy_button(
            "Loads › Precision", lambda state: self._loads.command("accuracy", state)
        )
        self._assume = services.link(
            "precision.typical",
            "Loads › Assume typical errors and stiffness",
            "Give the design typical errors, stiffness, struts and tolerances where it states "
            "none; the tab Machine shows and changes them.",
            assume_typical,
        )

    def _errors(self, frame: Frame) -> str:
        precision = self._loads.precision(frame)
        design = precision.loaded.design
        errors = render(answers.tool_errors(precision), corner=self._copy)
        if precision.has_errors and is_elastic(design):
            return errors
        return errors + offer("errors and stiffness", _typical(design)[1], self._assume)

    def _budget_html(self, _: Frame) -> str:
        is_shown = self._feed.request is not None
        return html_of(self._feed, self._budget, "There is no budget") if is_shown else ""

    def _budget(self, drawing: tasks.BudgetDrawing) -> str:
        request, costs, found = drawing.request, drawing.costs, drawing.found
        budget = answers.tolerance_budget(costs, found, request.wanted, request.wanted_turn)
        return render(budget, {"set": self._set})

    def _set_tolerances(self, state: State) -> Action | None:
        drawing = self._feed.drawing
        if drawing is None or drawing.found is None or not self._feed.is_current:
            return None
        design = with_tolerances(state.design, drawing.found.costs.tolerances)
        return Set("design", design, "Tolerances", "of the budget")


def offer(what: str, typical: Iterable[str], button: str) -> str:
    """Return the inputs that a design lacks, and a button for typical values, as HTML."""
    words = f"State {what} in the tab Machine, or assume typical ones: {'; '.join(typical)}."
    return box(f"{dim(words)} {button}")


# A design stays while the mechanism moves.
_typical = lru_cache(maxsize=1)(typical_machine)


def assume_typical(state: State) -> Action | None:
    """Return the action that gives the design typical values where it states none; None if all."""
    design, assumed = _typical(state.design)
    return Set("design", design, "Machine", "typical errors and stiffness") if assumed else None


def _send_tolerances(services: Services, _: str, who: Who) -> None:
    """Send the table of the budget, whether it is shown or not."""
    state = services.session.latest_state()
    name = f"{state.design.name}-tolerances.csv"
    services.downloads.compute(who, name, tasks.budget_table, (budget_request(state),))


TOLERANCES = FileExport(
    "Tolerances",
    "The dimensions by part, with their tolerances and what they cost at the tool.",
    ("CSV",),
    _send_tolerances,
)
