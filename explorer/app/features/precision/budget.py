"""The budget of the tolerances: its feed, its file, and its part of the panel."""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import dataclass
from typing import ClassVar

import numpy as np
import viser

from explorer.app.features.feature import Services
from explorer.app.features.optimise.work import requested_box
from explorer.app.features.precision.tasks import (
    BudgetDrawing,
    BudgetRequest,
    budget_of,
    budget_table,
)
from explorer.app.inputs.bindings import At
from explorer.app.inputs.controls import Controls
from explorer.app.session.feed import feed_of
from explorer.app.session.session import Who
from explorer.app.state.action import Action
from explorer.app.state.actions import check_free
from explorer.app.state.frame import Frame
from explorer.app.state.parts import with_value
from explorer.app.state.state import State
from explorer.app.widgets.assigning import Update
from explorer.app.widgets.blocks import render
from explorer.app.widgets.buttons import press_button
from explorer.app.widgets.markup import note
from explorer.app.widgets.under_way import problem
from explorer.measures.blocks.budget import tolerance_budget
from explorer.measures.size import PositionSet
from explorer.mechanism.pose import Pose
from explorer.statics.budget.costs import with_tolerances

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


def _shown_budget(frame: Frame) -> BudgetRequest | None:
    return budget_request(frame.state) if frame.state.view.precision.budget else None


def budget_request(state: State) -> BudgetRequest:
    """Return the request for the budget of a state."""
    view, design = state.view.precision, state.design
    pose: Pose = state.pose if view.over == "pose" else design.home_pose
    return BudgetRequest(
        design,
        view.over,
        pose,
        requested_box(state) if view.over == "box" else None,
        view.wanted,
        view.wanted_turn if view.wanted is not None else None,
        view.keep_actuators and view.wanted is not None,
    )


BUDGET_FEED = feed_of(budget_of, _shown_budget)


class ToleranceFile:
    """Sends the tolerances and their costs as a table."""

    def __init__(self, services: Services) -> None:
        self._session, self._downloads = services.session, services.downloads

    def send(self, who: Who) -> None:
        """Send the table of the budget, whether it is shown or not."""
        state = self._session.latest_state()
        name = f"{state.design.name}-tolerances.csv"
        self._downloads.compute(who, name, budget_table, (budget_request(state),))


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
            At("view.precision.wanted", default=lambda _: 0.0, convert=lambda value: value or None),
            least=0.0,
            step=0.01,
            small=True,
            visible=lambda state: state.view.precision.budget,
        )
        controls.number(
            "and turned within ± (°)",
            "Largest turn of the tool that is wanted besides; 0 is any.",
            At(
                "view.precision.wanted_turn",
                default=lambda _: 0.0,
                convert=lambda value: value or None,
            ),
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
    def _found(self) -> BudgetDrawing | None:
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
            tolerance_budget(
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
