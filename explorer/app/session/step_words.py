"""What a step of the history is called."""

from __future__ import annotations

import re
from collections.abc import Callable, Iterator
from dataclasses import fields, is_dataclass
from typing import cast

from explorer.app.features.compare.actions import Pin, SetLook, Unpin
from explorer.app.features.optimise.actions import (
    Accept,
    EndRun,
    LiftBox,
    Revert,
    SetWish,
    TakePaperBox,
)
from explorer.app.features.paths.actions import (
    CancelPlan,
    ChooseModes,
    Plan,
    SetPathTime,
    SetPlanSeconds,
    StoreEnd,
    WatchModes,
)
from explorer.app.features.singularity.actions import (
    GoToSingularity,
    GoToStratum,
    Jog,
    SetSingularView,
    name_of,
)
from explorer.app.features.studies.actions import (
    BrushAxis,
    BrushBox,
    ClearBrushes,
    OpenStudy,
    PickDesign,
    SetAxes,
    SetStudyWish,
)
from explorer.app.state.actions import (
    GoHome,
    Open,
    Reset,
    SetAngle,
    SetHold,
    SetJoint,
    SetLimits,
    SetMode,
    SetName,
    SetPose,
    SetPosition,
    SetUnit,
    SetVariable,
    SetView,
    StartThere,
    UseNearest,
)
from explorer.app.state.state import State
from explorer.app.state.studies import spoken
from explorer.mechanism.design import JOINTS
from explorer.mechanism.margins import mode_name
from explorer.numerics.number_text import format_ascii
from explorer.singularity.uncoupled import UNCOUPLED

# So many changes are named; the others are left to the eye.
MOST_NAMED = 2
ANGLES = ("yaw", "pitch", "roll")

PLAIN: dict[type, str] = {
    Open: "Open {design}",
    Reset: "Reset to {design} as it was opened",
    GoHome: "Home pose",
    UseNearest: "Nearest usable length",
    StartThere: "Start where nothing is in the way",
    SetName: "Call it {design}",
    SetUnit: "Design unit = {action.unit_mm:.6g} mm",
    SetHold: "Hold the {action.hold}",
    SetVariable: "{action.name} = {action.value:.6g}",
    ChooseModes: "Path from mode {action.first} to {action.last}",
    WatchModes: "Watch the path between modes",
    SetPathTime: "Path at {action.seconds:.3g} s",
    StoreEnd: "Store the {action.end} of a path",
    SetPlanSeconds: "Plan for {action.seconds:.3g} s",
    Plan: "Plan a path",
    CancelPlan: "Stop planning",
    EndRun: "Optimise: {design}",
    LiftBox: "Lift the box",
    TakePaperBox: "Take the paper's box",
    Accept: "Accept {design}",
    Revert: "Revert to {design}",
    Pin: "Pin {action.design.name}",
    Unpin: "Unpin {action.place}",
    PickDesign: "Pick {design}",
    ClearBrushes: "Clear all brushes",
    BrushBox: "Brush {action.spoken}",
}
"""Of the action and the name of the design after it."""

CHANGING: dict[type, tuple[str, Callable[[State], object]]] = {
    SetView: ("View", lambda state: state.view),
    SetSingularView: ("View", lambda state: state.view.singular),
    SetLimits: ("Limits", lambda state: state.design.limits),
    SetWish: ("Wanted", lambda state: state.optimisation.wish),
    SetLook: ("Compare", lambda state: state.compared.look),
    SetAxes: ("Plot", lambda state: state.studies),
    SetStudyWish: ("New study", lambda state: state.studies.wish),
}
"""Actions that set many values at once, of which those that differ are named."""


def words(action: object, before: State, after: State) -> str:
    """Return what an action did, in a few words.

    Args:
        action: What was done.
        before: The state before the step.
        after: The state after it.
    """
    kind = type(action)
    if kind in PLAIN:
        return PLAIN[kind].format(action=action, design=after.design.name)
    if kind in CHANGING:
        what, part = CHANGING[kind]
        return changes(what, part(before), part(after))
    return _of_value(action)


def _of_value(action: object) -> str:
    match action:
        case SetJoint(joint, value):
            said = f"{JOINTS[joint]} = {format_ascii(value, 6)}"
        case SetPosition(axis, value):
            said = f"{'xyz'[axis]} = {format_ascii(value, 6)}"
        case SetAngle(axis, value):
            said = f"{ANGLES[axis]} = {format_ascii(value, 6)}°"
        case SetPose(pose):
            size = max(map(abs, pose.position))
            said = f"Move b4 to {', '.join(format_ascii(x, 4, size=size) for x in pose.position)}"
        case SetMode(mode):
            said = f"Assembly mode {mode} ({mode_name(mode)})"
        case Jog(number, amount):
            motion = UNCOUPLED[number]
            unit = "°" if motion.kind == "rotation" else ""
            said = f"κ{motion.incidence} alone, by {format_ascii(amount, 4)}{unit}"
        case GoToStratum(stratum):
            said = f"Go to stratum {name_of(stratum)}"
        case OpenStudy(None):
            said = "Close the study"
        case OpenStudy(name):
            said = f"Study {name}"
        case BrushAxis(axis, ranges):
            said = f"{'Brush' if ranges else 'Free'} {spoken(axis)}"
        case GoToSingularity(None):
            said = "Go to the nearest singular pose"
        case GoToSingularity(incidence):
            said = f"Go to the nearest pose with κ{incidence} = 0"
        case _:
            # "SetWish" reads "Wish".
            name = re.sub("(?<=.)([A-Z])", r" \1", type(action).__name__).lower()
            said = name.removeprefix("set ").capitalize()
    return said


def changes(what: str, before: object, after: object) -> str:
    """Return what differs between two values of one kind, in a few words."""
    named = list(_differences(before, after))
    shown = ", ".join(named[:MOST_NAMED]) + (" …" if len(named) > MOST_NAMED else "")
    return f"{what}: {shown}" if shown else what


def _differences(before: object, after: object) -> Iterator[str]:
    for name in _fields(after):
        was, now = getattr(before, name), getattr(after, name)
        if was == now:
            continue
        spoken = name.replace("_", " ")
        if _fields(now) and type(was) is type(now):
            yield from (f"{spoken} {each}" for each in _differences(was, now))
        else:
            yield f"{spoken} {_value(now)}"


def _fields(value: object) -> tuple[str, ...]:
    if is_dataclass(value):
        return tuple(field.name for field in fields(value))
    return getattr(value, "__struct_fields__", ())


def _value(value: object) -> str:
    if value is None:
        return "by default"
    if isinstance(value, bool):
        return "on" if value else "off"
    if isinstance(value, float):
        return format_ascii(value, 6)
    if isinstance(value, tuple):
        return " ".join(_value(each) for each in cast("tuple[object, ...]", value))
    return str(value)
