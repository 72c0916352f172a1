"""The panel of precision: figures of the pose, what is drawn of them, and the budget."""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import dataclass
from functools import lru_cache
from typing import ClassVar

import viser

from explorer.app.features.feature import Services
from explorer.app.features.forces.loads import Loads
from explorer.app.features.precision.budget import BudgetPart
from explorer.app.inputs.bindings import At
from explorer.app.inputs.controls import Controls
from explorer.app.state.action import Action
from explorer.app.state.actions import check_free
from explorer.app.state.frame import Frame
from explorer.app.state.parts import with_value
from explorer.app.state.state import State
from explorer.app.widgets.assigning import Update
from explorer.app.widgets.blocks import render
from explorer.app.widgets.buttons import CopyButton, press_button
from explorer.app.widgets.markup import box, dim
from explorer.measures.blocks.precision import deflections, tool_errors
from explorer.measures.blocks.source import Source, load_source
from explorer.mechanism.design import Design
from explorer.mechanism.design_file import typical_machine
from explorer.statics.compliance import is_elastic
from explorer.statics.loaded import ToolPrecision

LOAD = "the load and the weights of the tab Forces"
TYPICAL = "precision.typical"
TYPICAL_HINT = (
    "Give the design typical errors, stiffness, struts and tolerances where it states none; the "
    "tab Machine shows and changes them."
)


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
            At("view.precision.times", default=lambda _: 0.0, convert=lambda value: value or None),
            least=0.0,
            step=1.0,
            visible=lambda state: state.view.precision.deflected,
        )
        with gui.add_folder("Budget of tolerances"):
            self._budget = BudgetPart(services)
        self._copy = CopyButton(services.buttons, "Precision", self._source)
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
            render(tool_errors(precision), corner=self._copy.html) + _offer(precision),
        )
        yield self._deflection, "content", render(deflections(precision, LOAD))
        yield from self._controls.updates(frame)
        yield from self._budget.updates(frame)

    def _source(self) -> Source:
        state = self._session.latest_state()
        loaded = self._loads.of(Frame(state))
        density = None if loaded.own is None else state.view.prototype.density
        return load_source("accuracy", loaded, density)

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
