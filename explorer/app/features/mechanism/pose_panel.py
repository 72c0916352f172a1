"""The panel that moves the mechanism, by its joints, its pose or its assembly mode."""

from __future__ import annotations

from collections.abc import Iterator

import viser

from explorer.app.browser.viser_gaps import Mark
from explorer.app.features.feature import Services
from explorer.app.features.mechanism.modes import ModesPanel
from explorer.app.state.actions import (
    GoHome,
    SetAngle,
    SetJoint,
    SetPosition,
    UseNearest,
)
from explorer.app.state.frame import Frame
from explorer.app.widgets.assigning import Update
from explorer.app.widgets.controls import Bound, Controls, Span
from explorer.app.widgets.markup import alert, format_number, remark
from explorer.app.widgets.ranges import coordinate_span, length_span
from explorer.mechanism.design import JOINTS, LENGTHS
from explorer.mechanism.feasible_intervals import Interval

JOINT_HINTS = {
    "l1": "Leg 1: length of the actuator from a1 to b1 (U joint, actuator, ball joint).",
    "d1": "Leg 2: position of its carriage on the guide, from a1.",
    "d2": "Leg 2: length of the actuator from the guide, perpendicular to it, to b2.",
    "d3": "Leg 3: position of its carriage on the guide, from a1.",
    "d4": "Leg 3: length of the actuator from the guide, perpendicular to it, to b3.",
    "l4": "Leg 4: length of the actuator from a3 to b4 (U joint, actuator, ball joint).",
}
JOINT_LABELS = {
    "l1": "l1  leg 1",
    "d1": "d1  leg 2 slide",
    "d2": "d2  leg 2",
    "d3": "d3  leg 3 slide",
    "d4": "d4  leg 3",
    "l4": "l4  leg 4",
}
ANGLES = (
    ("yaw", "about the base's z, the first of three", 180.0),
    ("pitch", "about the y that yaw turned, the second of three", 90.0),
    ("roll", "about the platform's x, the third of three", 180.0),
)
# Room for a label, as a share of the slider.
LABEL_ROOM = 0.24


class MovePanel:
    """Sliders for joints and pose, the table of modes, and messages on lengths."""

    def __init__(self, services: Services) -> None:
        gui = services.gui
        self._controls = controls = Controls(gui, services.session)
        with gui.add_folder("Legs (design units)"):
            for joint, name in enumerate(JOINTS):
                self._add_joint(joint, name)
            self._alert = gui.add_html("", visible=False)
            self._remark = gui.add_html("", visible=False)
            self._nearest = controls.button(
                "Use the nearest length",
                "Move this leg to the nearest length that closes and stays clear of "
                "singularities; the other legs stay as they are.",
                UseNearest,
                icon=viser.Icon.MAGNET,
            )
        with gui.add_folder("Pose of b4 (design units, degrees)"):
            for axis, name in enumerate("xyz"):
                self._add_position(axis, name)
            for axis, (name, order, edge) in enumerate(ANGLES):
                self._add_angle(axis, name, order, edge)
            controls.button(
                "Home pose",
                "Return to the pose that the design opens with.",
                GoHome,
                icon=viser.Icon.HOME,
            )
        with gui.add_folder("Assembly modes: b4 (design units)"):
            self._modes = ModesPanel(services)

    def _add_joint(self, joint: int, name: str) -> None:
        span = length_span if name in LENGTHS else coordinate_span

        def marks(frame: Frame) -> tuple[Mark, ...]:
            return interval_marks(frame.snapshot.intervals[joint], span(frame.state))

        self._controls.slider(
            JOINT_LABELS[name],
            f"{JOINT_HINTS[name]} The marks bound the values that close with the other joints as "
            "they are.",
            Bound(lambda frame: frame.state.joints[joint], lambda _, value: SetJoint(joint, value)),
            span,
            marks=marks,
        )

    def _add_position(self, axis: int, name: str) -> None:
        self._controls.slider(
            name,
            f"The {name} coordinate of b4 in the base frame.",
            Bound(
                lambda frame: frame.state.pose.position[axis],
                lambda _, value: SetPosition(axis, value),
            ),
            coordinate_span,
        )

    def _add_angle(self, axis: int, name: str, order: str, edge: float) -> None:
        self._controls.slider(
            f"{name} (°)",
            f"Rotation of the platform {order}, in degrees.",
            Bound(
                lambda frame: frame.state.yaw_pitch_roll[axis],
                lambda _, value: SetAngle(axis, value),
            ),
            Span(-edge, edge, 0.1),
        )

    def updates(self, frame: Frame) -> Iterator[Update]:
        """Yield the updates that make the panel show the frame."""
        unclosed = frame.state.unclosed
        yield self._alert, "visible", unclosed is not None
        yield self._nearest, "visible", unclosed is not None and unclosed.nearest is not None
        if unclosed is not None:
            yield self._alert, "content", alert("These lengths cannot close", str(unclosed))
        words = None if unclosed is not None else frame.state.remark
        yield self._remark, "visible", words is not None
        if words is not None:
            yield self._remark, "content", remark("The length was adjusted", words)
        yield from self._controls.updates(frame)
        yield from self._modes.updates(frame)


def interval_marks(intervals: tuple[Interval, ...], span: Span) -> tuple[Mark, ...]:
    """Return marks at the ends of the intervals, with labels that do not overlap.

    Args:
        intervals: Intervals in which the lengths close.
        span: Range of the slider.
    """
    marks: list[Mark] = []
    label_end = -1.0
    for low, high in intervals:
        start, end = (min(max(v, span.low), span.high) for v in (low, high))
        first, last = ((v - span.low) / (span.high - span.low) for v in (start, end))
        size = max(abs(span.low), abs(span.high))
        texts = (format_number(low, 3, size=size), format_number(high, 3, size=size))
        if first - label_end < LABEL_ROOM:
            texts = ("", "")
        elif last - first < LABEL_ROOM:
            # There is no room for two labels: the end with more room beside it has both.
            both = f"{texts[0]} … {texts[1]}"
            texts = ("", both) if first < 0.5 else (both, "")
        if any(texts):
            label_end = last
        marks += [(start, texts[0]), (end, texts[1])]
    return tuple(marks)
