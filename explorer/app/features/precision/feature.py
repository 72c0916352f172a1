"""The precision of the tool as a tab: its errors, its deflection, and the budget of tolerances."""

from __future__ import annotations

from collections.abc import Callable, Iterator
from dataclasses import dataclass
from functools import lru_cache
from typing import ClassVar

import numpy as np
import viser

from explorer.app.features.feature import Export, Feature, Services, Tab
from explorer.app.features.forces.loads import Loads
from explorer.app.features.optimise.work import requested_box
from explorer.app.features.precision import tasks
from explorer.app.features.precision.scene import DeflectedScene, ErrorEllipsoidScene
from explorer.app.inputs.controls import At, Controls
from explorer.app.session.feed import feed_of
from explorer.app.session.session import Who
from explorer.app.state.actions import Action, check_free
from explorer.app.state.frame import Frame
from explorer.app.state.parts import with_value
from explorer.app.state.state import State
from explorer.app.widgets.assigning import Update
from explorer.app.widgets.blocks import render
from explorer.app.widgets.buttons import CopyButton, press_button
from explorer.app.widgets.markup import box, dim, note
from explorer.app.widgets.under_way import problem
from explorer.measures.blocks import precision as answers
from explorer.measures.box import PositionSet
from explorer.mechanism.design import Design
from explorer.mechanism.design_file import typical_machine
from explorer.statics.budget import with_tolerances
from explorer.statics.compliance import is_elastic
from explorer.statics.loaded import ToolPrecision

LOAD = "the load and the weights of the tab Forces"
TYPICAL = "precision.typical"
TYPICAL_HINT = (
    "Give the design typical errors, stiffness, struts and tolerances where it states none; the "
    "tab Machine shows and changes them."
)

OVER: dict[str, PositionSet] = {
    "the present pose": "pose",
    "the required box": "box",
    "the workspace": "workspace",
}
OVER_HINT = (
    "Positions at which the precision is wanted: the present one; the box of the tab Optimise, or "
    "the workspace, at nodes of a grid in the orientation of home."
)
SET = "precision.set"
SET_HINT = "Give the design these tolerances, and these errors of its actuators."


@dataclass(frozen=True)
class AssumeTypical(Action):
    """Give the design typical errors, stiffness, struts and tolerances where it states none."""

    template: ClassVar[str] = "Typical errors, stiffness and tolerances"

    def apply(self, state: State) -> State:
        """Return the next state.

        Raises:
            InputError: The design is being optimised.
        """
        check_free(state)
        return with_value(state, "design", typical_machine(state.design)[0])


@dataclass(frozen=True)
class SetTolerances(Action):
    """Give the design the tolerances and the errors of its actuators that a budget found.

    Attributes:
        tolerances: Tolerances in mm and degrees, in the order of `SOURCES`; infinite for any,
            which the design keeps as it states them.
    """

    template: ClassVar[str] = "Tolerances of the budget"

    tolerances: tuple[float, ...]

    def apply(self, state: State) -> State:
        """Return the next state.

        Raises:
            InputError: The design is being optimised.
        """
        check_free(state)
        design = with_tolerances(state.design, np.array(self.tolerances))
        return with_value(state, "design", design)


def budget_request(state: State) -> tasks.BudgetRequest:
    """Return the request for the budget of a state."""
    view, design = state.view.precision, state.design
    pose = state.pose if view.over == "pose" else design.home_pose
    return tasks.BudgetRequest(
        design,
        view.over,
        pose,
        requested_box(state) if view.over == "box" else None,
        view.wanted,
        view.wanted_turn if view.wanted is not None else None,
        view.keep_actuators and view.wanted is not None,
    )


def _shown_budget(frame: Frame) -> tasks.BudgetRequest | None:
    return budget_request(frame.state) if frame.state.view.precision.budget else None


BUDGET_FEED = feed_of(tasks.budget_of, _shown_budget)


def _zero_for_none(path: str) -> At:
    return At(path, default=lambda _: 0.0, convert=lambda value: value or None)


class BudgetPart:
    """The part of the panel with the budget."""

    def __init__(self, services: Services) -> None:
        gui, self._session = services.gui, services.session
        self._feed = services.get(BUDGET_FEED)
        self._controls = controls = Controls(gui, services.session)
        controls.checkbox(
            "What each tolerance costs",
            "Rank the six actuators and the 23 dimensions by what their errors cost at the tool.",
            "view.precision.budget",
        )
        controls.dropdown("Worst over", OVER_HINT, OVER, "view.precision.over")
        controls.number(
            "Wanted within ± (mm)",
            "Largest displacement of the tool that is wanted: tolerances of the least total effort "
            "that keep it are found. 0 ranks the tolerances as they are.",
            _zero_for_none("view.precision.wanted"),
            least=0.0,
            step=0.01,
            small=True,
            visible=lambda state: state.view.precision.budget,
        )
        controls.number(
            "and turned within ± (°)",
            "Largest turn of the tool that is wanted besides; 0 is any.",
            _zero_for_none("view.precision.wanted_turn"),
            least=0.0,
            step=0.01,
            small=True,
            visible=_is_wanted,
        )
        controls.checkbox(
            "Keep the actuators' errors",
            "Find tolerances of the dimensions alone, with the errors of the actuators as they "
            "are; off, errors of the actuators are found too.",
            "view.precision.keep_actuators",
            visible=_is_wanted,
        )
        self._result = gui.add_html("", visible=False)
        services.buttons.on(SET, self._set)
        services.buttons.offer(
            "Precision › Set these tolerances",
            SET_HINT,
            SET,
            is_ready=lambda: self._found is not None,
        )

    def updates(self, frame: Frame) -> Iterator[Update]:
        """Yield the updates that make the part show the frame."""
        yield from self._controls.updates(frame)
        yield self._result, "visible", self._feed.request is not None
        yield self._result, "content", self._content()

    @property
    def _found(self) -> tasks.BudgetDrawing | None:
        drawing = self._feed.drawing
        is_found = drawing is not None and drawing.found is not None and self._feed.is_current
        return drawing if is_found else None

    def _content(self) -> str:
        feed = self._feed
        if feed.problem is not None:
            return problem(feed, "There is no budget", "")
        if feed.drawing is None:
            return note("computing …")
        request = feed.drawing.request
        button = press_button(SET, "", "Set these tolerances", hint=SET_HINT, class_name="ex-link")
        return render(
            answers.tolerance_budget(
                feed.drawing.costs, feed.drawing.found, request.wanted, request.wanted_turn
            ),
            {"set": button},
        )

    def _set(self, _: str, client: viser.ClientHandle) -> None:
        found = self._found
        if found is not None:
            tolerances = tuple(found.costs.tolerances.tolist())
            self._session.do(SetTolerances(tolerances), who=client.client_id)


def _is_wanted(state: State) -> bool:
    return state.view.precision.budget and state.view.precision.wanted is not None


class PrecisionPanel:
    """Errors of the tool, its deflection, and what is drawn of them."""

    def __init__(self, services: Services) -> None:
        gui, self._session = services.gui, services.session
        self._loads = services.get(Loads)
        self._controls = controls = Controls(gui, services.session)
        self._top = gui.add_html("")
        controls.checkbox(
            "Error ellipsoid in the scene",
            "Draw the ellipsoid of the tool's RMS displacement, for errors uniform within their "
            "bounds, magnified as its label says.",
            "view.precision.ellipsoid",
        )
        self._deflection = gui.add_html("")
        controls.checkbox(
            "Deflected shape in the scene",
            "Draw platform and legs as the load of the tab Forces deflects them, magnified.",
            "view.precision.deflected",
        )
        controls.number(
            "Magnification (0: automatic)",
            "How many times larger the deflection is drawn than it is.",
            _zero_for_none("view.precision.times"),
            least=0.0,
            step=1.0,
            visible=lambda state: state.view.precision.deflected,
        )
        with gui.add_folder("Budget of tolerances"):
            self._budget = BudgetPart(services)
        self._copy = CopyButton(
            services.buttons, "Precision", lambda: self._loads.source("accuracy")
        )
        services.buttons.on(TYPICAL, self._assume)
        services.buttons.offer(
            "Precision › Assume typical values",
            TYPICAL_HINT,
            TYPICAL,
            is_ready=lambda: bool(_assumed_values(services.session.state.design)),
        )

    def updates(self, frame: Frame) -> Iterator[Update]:
        """Yield the updates that make the panel show the frame."""
        precision = self._loads.precision(frame)
        yield (
            self._top,
            "content",
            render(answers.tool_errors(precision), corner=self._copy.html) + _offer(precision),
        )
        yield self._deflection, "content", render(answers.deflections(precision, LOAD))
        yield from self._controls.updates(frame)
        yield from self._budget.updates(frame)

    def _assume(self, _: str, client: viser.ClientHandle) -> None:
        if _assumed_values(self._session.state.design):
            self._session.do(AssumeTypical(), who=client.client_id)


@lru_cache(maxsize=1)
def _assumed_values(design: Design) -> tuple[str, ...]:
    """Return what typical values the design would get; it stays while the mechanism moves."""
    return typical_machine(design)[1]


def _offer(precision: ToolPrecision) -> str:
    """Return what typical values can be assumed, with the button that does, as HTML."""
    design = precision.loaded.design
    if precision.has_errors and is_elastic(design):
        return ""
    assumed = _assumed_values(design)
    if not assumed:
        return ""
    words = dim(f"State them in the tab Machine, or assume typical values: {'; '.join(assumed)}.")
    button = press_button(TYPICAL, "", "Assume these", hint=TYPICAL_HINT, class_name="ex-link")
    return box(f"{words} {button}")


def _send_tolerances(services: Services) -> Callable[[str, Who], None]:
    """Return the function that sends the table of the budget, whether it is shown or not."""

    def send(_: str, who: Who) -> None:
        state = services.session.latest_state()
        name = f"{state.design.name}-tolerances.csv"
        services.downloads.compute(who, name, tasks.budget_table, (budget_request(state),))

    return send


PRECISION = Feature(
    "precision",
    tabs=(Tab("analyse", "Precision", PrecisionPanel, viser.Icon.RULER_MEASURE),),
    exports=(
        Export(
            "Tolerances",
            "The dimensions by part, with their tolerances and what they cost at the tool.",
            ("CSV",),
            _send_tolerances,
        ),
    ),
    scene=(ErrorEllipsoidScene, DeflectedScene),
    later_feeds=(BUDGET_FEED,),
    tasks=(tasks.budget_of, tasks.budget_table),
    lists=("Worst over",),
)
