"""The panel of the design: presets, the six variables, and the limits."""

from __future__ import annotations

from collections.abc import Iterator
from typing import cast

import msgspec
import viser

from explorer.app.features.feature import Services
from explorer.app.features.mechanism.sketch import sketch
from explorer.app.inputs.bindings import At, Bound
from explorer.app.inputs.controls import Controls
from explorer.app.inputs.ranges import (
    box_span,
    gap_span,
    guide_span,
    length_limit_span,
    length_span,
    radius_span,
    variable_span,
)
from explorer.app.inputs.tracks import Span
from explorer.app.session.field_words import SWINGS
from explorer.app.state.action import Action
from explorer.app.state.actions import Open, Reset, Set, SetVariable
from explorer.app.state.frame import Frame
from explorer.app.state.state import Hold, State
from explorer.app.widgets.assigning import Update
from explorer.app.widgets.commands import NO_OPTION
from explorer.mechanism.design import LENGTHS, VARIABLES, Design, Limits, Pair, Range
from explorer.mechanism.design_file import PRESETS
from explorer.mechanism.margins import MARGIN_KINDS
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
        def write(state: State, ends: Pair) -> Action:
            before = state.design.length_range(name)
            low, high = pushed(before, ends)
            # A maximum at the reach stays there while only the minimum is moved.
            keeps = high == before[1] and _maximum(state, name) is None
            return _set_limit(name, (low, None if keeps else high))

        self._controls.ends(
            name,
            f"Minimum and maximum of {name}.",
            Bound(lambda frame: frame.state.design.length_range(name), write),
            length_limit_span,
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
        self._controls.ends(
            "d1, d3",
            "The ends of the guide, for both carriages.",
            Bound(
                lambda frame: _guide(frame.state),
                lambda state, ends: _set_limit("guide", pushed(_guide(state), ends)),
            ),
            guide_span,
            disabled=lambda state: state.design.limits.guide is None,
        )
        self._controls.slider(
            "gap",
            "Minimum distance |d1 − d3| between the carriages.",
            "design.limits.gap",
            gap_span,
        )
        self._controls.checkbox(
            "Carriages keep their order",
            "Require that d3 − d1 keeps its sign of the home pose: at d1 = d3 legs 2 and 3 share a "
            "point.",
            Bound(
                lambda frame: frame.state.design.limits.carriage_order == "home",
                lambda _, on: _set_limit("carriage_order", "home" if on else "any"),
            ),
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
        def read(state: State) -> Pair:
            lows, highs = _box(state)
            return lows[axis], highs[axis]

        def write(state: State, ends: Pair) -> Action:
            lows, highs = map(list, _box(state))
            lows[axis], highs[axis] = pushed(read(state), ends)
            return _set_limit("box", (tuple(lows), tuple(highs)))

        self._controls.ends(
            f"b4 {name}",
            f"The faces of the box across {name}.",
            Bound(lambda frame: read(frame.state), write),
            lambda state: box_span(state, axis),
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
            f"Minimum of |δ1|, |δ2| and |δ3|, in units; {MARGIN_KINDS}.",
            At("design.limits.margin", default=lambda _: 0.0),
            length_span,
            disabled=lambda state: state.design.limits.margin is None,
        )

    def _add_radius(self, leg: int) -> None:
        self._controls.slider(
            f"leg {leg + 1}",
            f"Radius of leg {leg + 1}, a capsule about its axis.",
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


def pushed(before: Pair, after: Pair) -> Pair:
    """Return the ends of a range after a change of one of them, which pushes the other along."""
    low, high = after
    if low <= high:
        return after
    return (high, high) if low == before[0] else (low, low)


def _guide(state: State) -> Pair:
    """Return the ends of the guide; while it has none, wide ones to begin with."""
    span = guide_span(state)
    return state.design.limits.guide or (span.low, span.high)


def _box(state: State) -> tuple[Triple, Triple]:
    """Return the box for b4; while there is none, a wide one to begin with."""
    x, y, z = (box_span(state, axis) for axis in range(3))
    return state.design.limits.box or ((x.low, y.low, z.low), (x.high, y.high, z.high))
