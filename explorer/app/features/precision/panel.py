"""The panel of precision: figures of the pose, what is drawn of them, and the budget."""

from __future__ import annotations

from collections.abc import Iterator
from functools import lru_cache

import viser

from explorer.app.features.feature import Services
from explorer.app.features.precision.actions import AssumeTypical
from explorer.app.features.precision.budget import BudgetPart
from explorer.app.features.precision.figures import deflections, errors, headline
from explorer.app.features.precision.pose import PosePrecision
from explorer.app.inputs.bindings import At
from explorer.app.inputs.controls import Controls
from explorer.app.state.frame import Frame
from explorer.app.state.state import State
from explorer.app.widgets.assigning import Update
from explorer.app.widgets.buttons import press_button
from explorer.app.widgets.markup import box, dim
from explorer.mechanism.design import Design
from explorer.mechanism.typical import typical_machine
from explorer.statics.compliance import is_elastic

TYPICAL = "precision.typical"
TYPICAL_HINT = (
    "Give the design typical errors, stiffness, struts and tolerances where it states none; the "
    "tab Machine shows and changes them."
)


class PrecisionPanel:
    """Errors of the tool, its deflection, and what is drawn of them."""

    def __init__(self, services: Services) -> None:
        gui, self._session = services.gui, services.session
        self._poses = services.get(PosePrecision)
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
        services.buttons.on(TYPICAL, self._assume)
        services.buttons.offer(
            "Precision › Assume typical values",
            TYPICAL_HINT,
            TYPICAL,
            is_ready=lambda: bool(_assumed(services.session.state)),
        )

    def updates(self, frame: Frame) -> Iterator[Update]:
        """Yield the updates that make the panel show the frame."""
        precision = self._poses.of(frame)
        parts = [*headline(precision)]
        if precision.has_errors and precision.is_regular:
            parts += errors(precision)
        if not (precision.has_errors and is_elastic(frame.state.design)):
            parts += _offer(frame.state)
        yield self._top, "content", box(*parts)
        yield self._deflection, "content", box(*deflections(precision))
        yield from self._controls.updates(frame)
        yield from self._budget.updates(frame)

    def _assume(self, _: str, client: viser.ClientHandle) -> None:
        if _assumed(self._session.state):
            self._session.do(AssumeTypical(), who=client.client_id)


def _assumed(state: State) -> tuple[str, ...]:
    """Return what typical values the design would get."""
    return _assumed_of(state.design)


@lru_cache(maxsize=1)
def _assumed_of(design: Design) -> tuple[str, ...]:
    # A design stays while the mechanism moves.
    return typical_machine(design)[1]


def _offer(state: State) -> Iterator[str]:
    """Yield what typical values can be assumed, with the button that does."""
    assumed = _assumed(state)
    if assumed:
        values = "; ".join(assumed)
        words = dim(f"State them in the tab Machine, or assume typical values: {values}.")
        button = press_button(TYPICAL, "", "Assume these", hint=TYPICAL_HINT, class_name="ex-link")
        yield f'<div class="ex-after">{words} {button}</div>'
