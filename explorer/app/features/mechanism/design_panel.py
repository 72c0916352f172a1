"""The panel of the design: presets, the six variables, and the limits."""

from __future__ import annotations

from collections.abc import Iterator

import viser

from explorer.app.features.feature import Services
from explorer.app.features.mechanism.sketch import sketch
from explorer.app.inputs.bindings import Bound
from explorer.app.inputs.controls import Controls
from explorer.app.inputs.limits import bound_entry, bound_switch, limit_span
from explorer.app.inputs.ranges import radius_span, variable_span
from explorer.app.state.actions import Open, Reset, SetVariable
from explorer.app.state.frame import Frame
from explorer.app.state.state import Hold
from explorer.app.widgets.assigning import Update
from explorer.app.widgets.commands import NO_OPTION
from explorer.mechanism.design import VARIABLES
from explorer.mechanism.design_file import PRESETS
from explorer.workspace.limits.limit import Entry, Limit, Switch
from explorer.workspace.limits.table import LIMITS

VARIABLE_HINTS = {
    "a3x": "x of a3 in the base frame; leg 4 starts there.",
    "a3y": "y of a3 in the base frame; never zero.",
    "b1x": "x of b1 in the platform frame; leg 1 ends there.",
    "b1y": "y of b1 in the platform frame; never zero.",
    "b2": "x of b2 in the platform frame; leg 2 ends there.",
    "b3": "x of b3 in the platform frame; leg 3 ends there, never at b2.",
}
HOLDS: dict[str, Hold] = {"hold the pose": "pose", "hold the legs": "legs"}


class DesignPanel:
    """The controls for all values of a design file."""

    def __init__(self, services: Services) -> None:
        gui = services.gui
        self._controls = controls = Controls(gui, services.session)
        with gui.add_folder("Design"):
            controls.dropdown(
                "Preset",
                "Open one of the designs of the paper's Table 1, in its home pose.",
                (*PRESETS, NO_OPTION),
                Bound(_preset_name, lambda state, chosen: Open(PRESETS.get(chosen, state.design))),
            )
            controls.dropdown(
                "On a change",
                "What a change of the design keeps: the pose, or the lengths of the legs.",
                HOLDS,
                "hold",
            )
            controls.button(
                "Reset", "Return to the design as it was opened.", Reset, icon=viser.Icon.RESTORE
            )
        with gui.add_folder("Design variables (design units)"):
            self._sketch = gui.add_html("")
            for index, name in enumerate(VARIABLES):
                self._add_variable(index, name)
            controls.number(
                "1 unit (mm)",
                "Millimetres in one design unit; exports use it.",
                "design.unit_mm",
                least=1e-6,
                step=0.001,
            )
        with gui.add_folder("Limits (design units)", expand_by_default=False):
            self._add_limits(in_degrees=False)
        with gui.add_folder("Radii of the legs (design units)", expand_by_default=False):
            for leg in range(4):
                self._add_radius(leg)
        with gui.add_folder("Swing of the joints (°)", expand_by_default=False):
            self._add_limits(in_degrees=True)

    def updates(self, frame: Frame) -> Iterator[Update]:
        """Yield the updates that make the panel show the frame."""
        yield self._sketch, "content", sketch(frame.state.design)
        yield from self._controls.updates(frame)

    def _add_variable(self, index: int, name: str) -> None:
        self._controls.slider(
            name,
            VARIABLE_HINTS[name],
            Bound(
                lambda frame: frame.state.design.variables[index],
                lambda _, value: SetVariable(name, value),
            ),
            lambda state: variable_span(state, index),
        )

    def _add_limits(self, *, in_degrees: bool) -> None:
        """Add the controls of those limits that are angles, or of the others."""
        switches: list[Switch] = []
        for limit in LIMITS:
            if in_degrees != any(entry.is_angle for entry in limit.entries):
                continue
            if limit.switch is not None and limit.switch not in switches:
                switches.append(limit.switch)
                words = limit.switch.label, limit.switch.hint
                self._controls.checkbox(*words, bound_switch(limit.switch))
            for entry in limit.entries:
                self._add_entry(limit, entry)

    def _add_entry(self, limit: Limit, entry: Entry) -> None:
        add = self._controls.slider if entry.is_number else self._controls.ends
        add(
            entry.label,
            entry.hint,
            bound_entry(limit, entry),
            lambda state: limit_span(state.base, entry),
            disabled=lambda state: limit.switch is not None and limit.value(state.design) is None,
        )

    def _add_radius(self, leg: int) -> None:
        self._controls.slider(
            f"leg {leg + 1}",
            f"Radius of leg {leg + 1}, a capsule about its axis.",
            f"design.limits.leg_radii.{leg}",
            radius_span,
        )


def _preset_name(frame: Frame) -> str:
    name = frame.state.design.name
    return name if PRESETS.get(name) == frame.state.design else NO_OPTION
