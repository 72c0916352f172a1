"""The tab that optimises the design: its problem, the search with its result, and the charts.

The three are columns side by side, as many as the tab has room for.
"""

from __future__ import annotations

from collections.abc import Iterator

from explorer.app.features.feature import Services
from explorer.app.features.optimise.actions import SetObjective, SetRequest
from explorer.app.features.optimise.buttons import OptimiseButtons
from explorer.app.features.optimise.plots import OptimisePlots
from explorer.app.features.optimise.problem import (
    requested_box,
    requested_reach,
    requested_volume,
)
from explorer.app.features.optimise.words import result_words
from explorer.app.inputs.bindings import At, Bound
from explorer.app.inputs.controls import Controls
from explorer.app.state.action import Action
from explorer.app.state.frame import Frame
from explorer.app.state.optimisation import PLACE
from explorer.app.state.state import State
from explorer.app.widgets.assigning import Update
from explorer.measures.catalogue import CATALOGUE
from explorer.mechanism.design import VARIABLES
from explorer.mechanism.pose import Triple
from explorer.optimise.problem import OVER_BOX, YAW, ObjectiveName
from explorer.statics.compliance import is_elastic

OBJECTIVES: dict[str, ObjectiveName] = {
    "match a volume": "match-volume",
    "shortest legs for a volume": "smallest-reach",
    "largest volume for a leg length": "largest-volume",
    "largest worst margin over a box": "largest-margin",
    "smallest load over a box": "smallest-load",
    "smallest error over a box": "smallest-error",
    "smallest deflection over a box": "smallest-deflection",
}
FREE = {
    **{name: f"Let {name} change." for name in VARIABLES},
    YAW: "Let the yaw of home change, and with it the orientation of the workspace.",
    PLACE: "Let the required box move without changing its size.",
}
FREE_LABELS = {YAW: "yaw of home", PLACE: "place of the box"}
STEP = 0.001
COLUMNS = '<div class="ex-columns"></div>'
"""Markup that makes the stylesheet put what follows it in a tab side by side."""


class OptimisePanel:
    """The controls of the problem, the search with its result, and the charts."""

    def __init__(self, services: Services) -> None:
        gui = services.gui
        services.get(OptimiseButtons)
        self._controls = Controls(gui, services.session)
        gui.add_html(COLUMNS)
        with gui.add_folder("Problem, in design units"):
            self._add_problem()
            with gui.add_folder("Free variables", expand_by_default=False):
                for name, hint in FREE.items():
                    self._add_free(name, hint)
        self._result = gui.add_html("")
        self._plots = OptimisePlots(gui)

    def updates(self, frame: Frame) -> Iterator[Update]:
        """Yield the updates that show a frame."""
        yield from self._controls.updates(frame)
        yield self._result, "content", result_words(frame.state)
        yield from self._plots.updates(frame.state.optimisation.run)

    def _add_problem(self) -> None:
        controls = self._controls
        controls.dropdown(
            "Objective",
            "The measure that the search improves.",
            OBJECTIVES,
            At("optimisation.request.objective", action=SetObjective),
        )
        controls.number(
            _label("volume"),
            "The exact volume of the workspace, in units³, at the orientation of home: to match, "
            "or at least.",
            At("optimisation.request.volume", default=requested_volume, action=SetRequest),
            least=0.0,
            step=STEP,
            visible=lambda state: state.optimisation.request.needs_volume,
        )
        controls.number(
            _label("longest_leg"),
            "The largest maximum length of l1, d2, d4 and l4 allowed, in units.",
            At("optimisation.request.reach", default=requested_reach, action=SetRequest),
            least=0.0,
            step=STEP,
            visible=lambda state: state.optimisation.request.needs_reach,
        )
        controls.number(
            _label("demanded_clearance"),
            "The least clearance of any two legs, their radii taken off, in units, wherever in the "
            "workspace all margins are at least a 20th of the reach that the search starts with; 0 "
            "for no demand.",
            At("optimisation.request.clearance", action=SetRequest),
            least=0.0,
            step=STEP,
        )
        controls.number(
            "Starts",
            "Number of designs to start from: the present one, and others spread over the bounds.",
            At("optimisation.request.starts", convert=round, action=SetRequest),
            least=1,
            step=1,
        )
        controls.checkbox(
            "Required box",
            "Demand that a box lies within the workspace; it is drawn.",
            Bound(
                lambda frame: frame.state.optimisation.request.needs_box,
                lambda _, on: SetRequest("optimisation.request.with_box", on, "Required box"),
            ),
            disabled=lambda state: state.optimisation.request.objective in OVER_BOX,
        )
        controls.checkbox(
            "Hold the load",
            "Demand that the payload's weight and force are held within the limits of actuators, "
            "struts and guide, wherever in the required box.",
            At("optimisation.request.held", action=SetRequest),
        )
        controls.number(
            _label("worst_error"),
            "The worst displacement of the tool by the actuators' errors allowed in the required "
            "box, in units; 0 for no demand.",
            At("optimisation.request.error", action=SetRequest),
            least=0.0,
            step=STEP,
            # A demand that another design left behind can be taken back.
            visible=lambda state: (
                any(state.design.actuators.error_mm) or state.optimisation.request.error > 0.0
            ),
        )
        controls.number(
            _label("deflection"),
            "The largest displacement of the tool under the payload's weight and force allowed in "
            "the required box, in units; 0 for no demand.",
            At("optimisation.request.deflection", action=SetRequest),
            least=0.0,
            step=STEP,
            visible=lambda state: (
                is_elastic(state.design) or state.optimisation.request.deflection > 0.0
            ),
        )
        controls.number(
            f"{_label('box_tilt')} (°)",
            "The tilt from the orientation of home that every position of the required box must "
            "allow in every azimuth, in degrees; 0 for no demand.",
            At("optimisation.request.tilt", action=SetRequest),
            least=0.0,
            step=1.0,
        )
        for end, word in enumerate(("from", "to")):
            self._add_corner(end, f"Box {word}")

    def _add_corner(self, end: int, label: str) -> None:
        def write(state: State, value: Triple) -> Action:
            lows, highs = requested_box(state)
            box = (value, highs) if end == 0 else (lows, value)
            return SetRequest("optimisation.request.box", box, "Required box")

        self._controls.triple(
            label,
            "A corner of the box, in the base frame.",
            Bound(lambda frame: requested_box(frame.state)[end], write),
            step=STEP,
            visible=lambda state: state.optimisation.request.needs_box,
        )

    def _add_free(self, name: str, hint: str) -> None:
        def write(state: State, on: bool) -> Action:
            free = state.optimisation.request.free
            chosen = tuple(key for key in FREE if (on if key == name else key in free))
            label = f"Free variable {FREE_LABELS.get(name, name)}"
            return SetRequest("optimisation.request.free", chosen, label, "on" if on else "off")

        self._controls.checkbox(
            FREE_LABELS.get(name, name),
            hint,
            Bound(lambda frame: name in frame.state.optimisation.request.free, write),
            disabled=(lambda state: not state.optimisation.request.needs_box)
            if name == PLACE
            else None,
        )


def _label(measure: str) -> str:
    """Return the label of a demand: that of the measure which it bounds."""
    return CATALOGUE[measure].label.capitalize()
