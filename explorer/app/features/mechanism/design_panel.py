"""The design: presets, the six variables, and the limits."""

from __future__ import annotations

from collections.abc import Callable, Iterator
from typing import cast

import msgspec
import viser

from explorer.app.session.field_words import SWINGS
from explorer.app.session.session import Session
from explorer.app.state.action import Action
from explorer.app.state.actions import Open, Reset, SetHold, SetLimits, SetUnit, SetVariable
from explorer.app.state.frame import Frame
from explorer.app.state.state import Hold, State
from explorer.app.widgets.assigning import Update
from explorer.app.widgets.controls import Controls, Span
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
NO_PRESET = "—"
# A half-angle, in degrees, that bounds nothing.
NO_SWING = 180.0


class DesignPanel:
    """Everything that a design file holds, on sliders."""

    def __init__(self, gui: viser.GuiApi, session: Session) -> None:
        self._controls = controls = Controls(gui, session)
        with gui.add_folder("Design"):
            controls.dropdown(
                "Preset",
                "Open one of the designs of the paper's Table 1, in its home pose.",
                (*PRESETS, NO_PRESET),
                _preset_shown,
                lambda state, chosen: Open(PRESETS.get(chosen, state.design)),
            )
            controls.dropdown(
                "On a change",
                "What stays while the design changes: the pose, or the lengths of the legs.",
                tuple(HOLDS),
                lambda frame: next(k for k, v in HOLDS.items() if v == frame.state.hold),
                lambda _, chosen: SetHold(HOLDS[chosen]),
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
                lambda frame: frame.state.design.unit_mm,
                lambda _, value: SetUnit(value),
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
        """Yield what makes the panel show the frame."""
        yield from self._controls.updates(frame)

    def _add_variable(self, index: int, name: str) -> None:
        self._controls.slider(
            name,
            VARIABLE_HINTS[name],
            lambda frame: frame.state.design.variables[index],
            lambda _, value: SetVariable(name, value),
            variable_span,
        )

    def _add_lengths(self) -> None:
        self._controls.checkbox(
            "Maxima at the reach",
            "Tie the longest length of every actuator to the reach |a3| of the design.",
            lambda frame: _tied(frame.state),
            lambda state, on: SetLimits(_with_maxima(state.design, tied=on)),
        )
        for name in LENGTHS:
            self._add_length(name)

    def _add_length(self, name: str) -> None:
        def minimum(state: State, value: float) -> Action:
            low = min(value, state.design.length_range(name)[1])
            return _limited(state, name, (low, _maximum(state, name)))

        def maximum(state: State, value: float) -> Action:
            low = state.design.length_range(name)[0]
            return _limited(state, name, (low, max(value, low)))

        self._controls.slider(
            f"{name} least",
            f"The shortest that {name} may be.",
            lambda frame: frame.state.design.length_range(name)[0],
            minimum,
            length_span,
        )
        self._controls.slider(
            f"{name} most",
            f"The longest that {name} may be.",
            lambda frame: frame.state.design.length_range(name)[1],
            maximum,
            length_span,
            disabled=_tied,
        )

    def _add_guide(self) -> None:
        self._controls.checkbox(
            "Bounded guide",
            "Keep both carriages between two ends of the guide.",
            lambda frame: frame.state.design.limits.guide is not None,
            lambda state, on: _limited(state, "guide", _guide(state) if on else None),
        )

        def low_end(state: State, value: float) -> Action:
            return _limited(state, "guide", (value, max(value, _guide(state)[1])))

        def high_end(state: State, value: float) -> Action:
            return _limited(state, "guide", (min(value, _guide(state)[0]), value))

        for index, (label, write) in enumerate((("d least", low_end), ("d most", high_end))):
            self._end(label, index, write)
        self._controls.slider(
            "gap",
            "The least distance |d1 − d3| between the carriages.",
            lambda frame: frame.state.design.limits.gap,
            lambda state, value: _limited(state, "gap", value),
            length_span,
        )
        self._controls.checkbox(
            "Carriages keep their order",
            "Demand that d3 − d1 keeps the sign that it has in the home pose. At d1 = d3 legs 2 "
            "and 3 share a point, so the carriages cannot pass each other. Clear this for the "
            "plain geometry, which counts both orders.",
            lambda frame: frame.state.design.limits.carriage_order == "home",
            lambda state, on: _limited(state, "carriage_order", "home" if on else "any"),
        )

    def _end(self, label: str, index: int, write: Callable[[State, float], Action]) -> None:
        self._controls.slider(
            label,
            "An end of the guide, for both carriages.",
            lambda frame: _guide(frame.state)[index],
            write,
            coordinate_span,
            disabled=lambda state: state.design.limits.guide is None,
        )

    def _add_box(self) -> None:
        self._controls.checkbox(
            "Box for b4",
            "Keep b4 within a box.",
            lambda frame: frame.state.design.limits.box is not None,
            lambda state, on: _limited(state, "box", _box(state) if on else None),
        )
        for axis, name in enumerate("xyz"):
            self._add_box_axis(axis, name)

    def _add_box_axis(self, axis: int, name: str) -> None:
        def write(end: int) -> Callable[[State, float], Action]:
            def action(state: State, value: float) -> Action:
                ends = [list(corner) for corner in _box(state)]
                ends[end][axis] = value
                # The other end gives way, as a slider pushed into another does.
                ends[0][axis] = min(ends[0][axis], value)
                ends[1][axis] = max(ends[1][axis], value)
                return _limited(state, "box", (tuple(ends[0]), tuple(ends[1])))

            return action

        for end, word in enumerate(("least", "most")):
            self._box_slider(f"{name} {word}", axis, end, write(end))

    def _box_slider(
        self, label: str, axis: int, end: int, write: Callable[[State, float], Action]
    ) -> None:
        self._controls.slider(
            label,
            "A face of the box that b4 keeps to.",
            lambda frame: _box(frame.state)[end][axis],
            write,
            coordinate_span,
            disabled=lambda state: state.design.limits.box is None,
        )

    def _add_margin(self) -> None:
        self._controls.checkbox(
            "Stay in the home mode",
            "Demand the home pose's sign triple, and the margin below.",
            lambda frame: frame.state.design.limits.margin is not None,
            lambda state, on: _limited(state, "margin", 0.0 if on else None),
        )
        self._controls.slider(
            "margin",
            "The least distance |δ| to each of the three singularities.",
            lambda frame: frame.state.design.limits.margin or 0.0,
            lambda state, value: _limited(state, "margin", value),
            length_span,
            disabled=lambda state: state.design.limits.margin is None,
        )

    def _add_radius(self, leg: int) -> None:
        def write(state: State, value: float) -> Action:
            radii = list(state.design.limits.leg_radii)
            radii[leg] = value
            return _limited(state, "leg_radii", tuple(radii))

        self._controls.slider(
            f"leg {leg + 1}",
            f"Radius of leg {leg + 1} as a capsule about its axis; clearances are less it.",
            lambda frame: frame.state.design.limits.leg_radii[leg],
            write,
            radius_span,
        )

    def _add_swing(self, name: str, kind: str) -> None:
        def write(state: State, value: float) -> Action:
            bound = value if value < NO_SWING else None
            swing = msgspec.structs.replace(state.design.limits.swing, **{name: bound})
            return _limited(state, "swing", swing)

        self._controls.slider(
            f"{name} {kind}",
            f"How far leg {'4' if name == 'a3' else name[1]} may swing in this joint from its "
            "direction at home; 180 for no bound.",
            lambda frame: getattr(frame.state.design.limits.swing, name) or NO_SWING,
            write,
            lambda _: Span(1.0, NO_SWING, 0.5),
        )


def _preset_shown(frame: Frame) -> str:
    name = frame.state.design.name
    return name if PRESETS.get(name) == frame.state.design else NO_PRESET


def _limited(state: State, name: str, value: object) -> SetLimits:
    return SetLimits(msgspec.structs.replace(state.design.limits, **{name: value}))


def _maximum(state: State, name: str) -> float | None:
    return cast("Range", getattr(state.design.limits, name))[1]


def _tied(state: State) -> bool:
    return all(_maximum(state, name) is None for name in LENGTHS)


def _with_maxima(design: Design, *, tied: bool) -> Limits:
    ranges = {
        name: (low, None if tied else max(low, high))
        for name in LENGTHS
        for low, high in [design.length_range(name)]
    }
    return msgspec.structs.replace(design.limits, **ranges)


def _guide(state: State) -> Pair:
    """Return the bounds of the guide, or those that it gets when it is bounded."""
    return state.design.limits.guide or (-state.base.reach, 2.0 * state.base.reach)


def _box(state: State) -> tuple[Triple, Triple]:
    """Return the box, or the one that there is when it is switched on."""
    reach = state.base.reach
    return state.design.limits.box or ((-reach, -reach, -reach), (reach, reach, reach))
