"""The panel of the design: presets, the six variables, and the limits."""

from __future__ import annotations

from collections.abc import Callable, Iterator
from typing import cast

import msgspec
import viser

from explorer.app.features.feature import Services
from explorer.app.session.field_words import SWINGS
from explorer.app.state.action import Action
from explorer.app.state.actions import Open, Reset, Set, SetVariable
from explorer.app.state.frame import Frame
from explorer.app.state.state import Hold, State
from explorer.app.widgets.assigning import Update
from explorer.app.widgets.commands import NO_OPTION
from explorer.app.widgets.controls import At, Bound, Controls, Span
from explorer.app.widgets.ranges import coordinate_span, length_span, radius_span, variable_span
from explorer.mechanism.design import LENGTHS, VARIABLES, Design, Limits, Pair, Range
from explorer.mechanism.design_file import PRESETS
from explorer.mechanism.pose import Triple

VARIABLE_HINTS = {
    "a3x": "x of a3 in the base frame; leg 4 starts there.",
    "a3y": "y of a3 in the base frame; never zero.",
    "b1x": "x of b1 in the platform frame; leg 1 ends there.",
    "b1y": "y of b1 in the platform frame; never zero.",
    "b2": "x of b2 in the platform frame; leg 2 ends there.",
    "b3": "x of b3 in the platform frame; leg 3 ends there, never at b2.",
}
HOLDS: dict[str, Hold] = {"hold the pose": "pose", "hold the legs": "legs"}
# Half-angle in degrees at which a joint has no bound.
NO_SWING = 180.0


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
            self._add_lengths()
            self._add_guide()
            self._add_box()
            self._add_margin()
        with gui.add_folder("Radii of the legs (design units)", expand_by_default=False):
            for leg in range(4):
                self._add_radius(leg)
        with gui.add_folder("Swing of the joints (°)", expand_by_default=False):
            for name, kind in SWINGS.items():
                self._add_swing(name, kind)

    def updates(self, frame: Frame) -> Iterator[Update]:
        """Yield the updates that make the panel show the frame."""
        yield from self._controls.updates(frame)

    def _add_variable(self, index: int, name: str) -> None:
        self._controls.slider(
            name,
            VARIABLE_HINTS[name],
            Bound(
                lambda frame: frame.state.design.variables[index],
                lambda _, value: SetVariable(name, value),
            ),
            variable_span,
        )

    def _add_lengths(self) -> None:
        self._controls.checkbox(
            "Maxima at the reach",
            "Set the maximum length of every actuator to the reach |a3| of the design.",
            Bound(
                lambda frame: _are_maxima_at_reach(frame.state),
                lambda state, on: Set(
                    "design.limits",
                    _with_maxima(state.design, at_reach=on),
                    "Maxima at the reach",
                    "on" if on else "off",
                ),
            ),
        )
        for name in LENGTHS:
            self._add_length(name)

    def _add_length(self, name: str) -> None:
        def minimum(state: State, value: float) -> Action:
            low = min(value, state.design.length_range(name)[1])
            return _set_limit(name, (low, _maximum(state, name)))

        def maximum(state: State, value: float) -> Action:
            low = state.design.length_range(name)[0]
            return _set_limit(name, (low, max(value, low)))

        self._controls.slider(
            f"{name} least",
            f"Minimum of {name}.",
            Bound(lambda frame: frame.state.design.length_range(name)[0], minimum),
            length_span,
        )
        self._controls.slider(
            f"{name} most",
            f"Maximum of {name}.",
            Bound(lambda frame: frame.state.design.length_range(name)[1], maximum),
            length_span,
            disabled=_are_maxima_at_reach,
        )

    def _add_guide(self) -> None:
        self._controls.checkbox(
            "Bounded guide",
            "Keep both carriages between two ends of the guide.",
            Bound(
                lambda frame: frame.state.design.limits.guide is not None,
                lambda state, on: _set_limit("guide", _guide(state) if on else None),
            ),
        )

        def low_end(state: State, value: float) -> Action:
            return _set_limit("guide", (value, max(value, _guide(state)[1])))

        def high_end(state: State, value: float) -> Action:
            return _set_limit("guide", (min(value, _guide(state)[0]), value))

        for index, (label, write) in enumerate((("d least", low_end), ("d most", high_end))):
            self._add_guide_end(label, index, write)
        self._controls.slider(
            "gap",
            "Minimum distance |d1 − d3| between the carriages.",
            "design.limits.gap",
            length_span,
        )
        self._controls.checkbox(
            "Carriages keep their order",
            "Require that d3 − d1 keeps the sign that it has in the home pose. At d1 = d3 legs 2 "
            "and 3 share a point, so the carriages cannot pass each other. Without this both "
            "orders are allowed.",
            Bound(
                lambda frame: frame.state.design.limits.carriage_order == "home",
                lambda _, on: _set_limit("carriage_order", "home" if on else "any"),
            ),
        )

    def _add_guide_end(
        self, label: str, index: int, write: Callable[[State, float], Action]
    ) -> None:
        self._controls.slider(
            label,
            "An end of the guide, for both carriages.",
            Bound(lambda frame: _guide(frame.state)[index], write),
            coordinate_span,
            disabled=lambda state: state.design.limits.guide is None,
        )

    def _add_box(self) -> None:
        self._controls.checkbox(
            "Box for b4",
            "Keep b4 within a box.",
            Bound(
                lambda frame: frame.state.design.limits.box is not None,
                lambda state, on: _set_limit("box", _box(state) if on else None),
            ),
        )
        for axis, name in enumerate("xyz"):
            self._add_box_axis(axis, name)

    def _add_box_axis(self, axis: int, name: str) -> None:
        def write(end: int) -> Callable[[State, float], Action]:
            def action(state: State, value: float) -> Action:
                ends = [list(corner) for corner in _box(state)]
                ends[end][axis] = value
                # A slider that passes the other one moves it along.
                ends[0][axis] = min(ends[0][axis], value)
                ends[1][axis] = max(ends[1][axis], value)
                return _set_limit("box", (tuple(ends[0]), tuple(ends[1])))

            return action

        for end, word in enumerate(("least", "most")):
            self._add_box_face(f"{name} {word}", axis, end, write(end))

    def _add_box_face(
        self, label: str, axis: int, end: int, write: Callable[[State, float], Action]
    ) -> None:
        self._controls.slider(
            label,
            "Position of a face of the box.",
            Bound(lambda frame: _box(frame.state)[end][axis], write),
            coordinate_span,
            disabled=lambda state: state.design.limits.box is None,
        )

    def _add_margin(self) -> None:
        self._controls.checkbox(
            "Stay in the home mode",
            "Require the sign triple of the home pose, and the margin below.",
            Bound(
                lambda frame: frame.state.design.limits.margin is not None,
                lambda _, on: _set_limit("margin", 0.0 if on else None),
            ),
        )
        self._controls.slider(
            "margin",
            "Minimum of |δ1|, |δ2| and |δ3|.",
            At("design.limits.margin", default=lambda _: 0.0),
            length_span,
            disabled=lambda state: state.design.limits.margin is None,
        )

    def _add_radius(self, leg: int) -> None:
        self._controls.slider(
            f"leg {leg + 1}",
            f"Radius of leg {leg + 1}, a capsule about its axis; clearances decrease by it.",
            f"design.limits.leg_radii.{leg}",
            radius_span,
        )

    def _add_swing(self, name: str, kind: str) -> None:
        self._controls.slider(
            f"{name} {kind}",
            f"Maximum angle of leg {'4' if name == 'a3' else name[1]} in this joint from its "
            "direction in the home pose; 180 for no bound.",
            At(
                f"design.limits.swing.{name}",
                default=lambda _: NO_SWING,
                convert=lambda value: value if value < NO_SWING else None,
            ),
            Span(1.0, NO_SWING, 0.5),
        )


def _preset_name(frame: Frame) -> str:
    name = frame.state.design.name
    return name if PRESETS.get(name) == frame.state.design else NO_OPTION


def _set_limit(name: str, value: object) -> Set:
    return Set(f"design.limits.{name}", value)


def _maximum(state: State, name: str) -> float | None:
    return cast("Range", getattr(state.design.limits, name))[1]


def _are_maxima_at_reach(state: State) -> bool:
    return all(_maximum(state, name) is None for name in LENGTHS)


def _with_maxima(design: Design, *, at_reach: bool) -> Limits:
    ranges = {
        name: (low, None if at_reach else max(low, high))
        for name in LENGTHS
        for low, high in [design.length_range(name)]
    }
    return msgspec.structs.replace(design.limits, **ranges)


def _guide(state: State) -> Pair:
    """Return the ends of the guide; while it has none, those to begin with."""
    return state.design.limits.guide or (-state.base.reach, 2.0 * state.base.reach)


def _box(state: State) -> tuple[Triple, Triple]:
    """Return the box for b4; while there is none, the one to begin with."""
    reach = state.base.reach
    return state.design.limits.box or ((-reach, -reach, -reach), (reach, reach, reach))
