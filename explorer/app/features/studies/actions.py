"""The actions of studies: open one, brush axes, pick a design."""

from __future__ import annotations

import math

from explorer.app.features.studies.state import Brush, Studies, label_of
from explorer.app.state.actions import Act, action, open_design
from explorer.app.state.parts import with_value
from explorer.app.state.state import State
from explorer.errors import InputError
from explorer.mechanism.design import Design
from explorer.numerics.number_text import format_apart, format_number

# Ranges of one axis.
MOST_RANGES = 16


def _study_words(_: State, name: str | None) -> str:
    return "Close the study" if name is None else f"Study {name}"


@action(_study_words)
def open_study(state: State, name: str | None) -> State:
    """Open a study by its name, without the brushes and the pick of another one; None closes it."""
    if name == Studies.of(state).name:
        return state
    return with_value(state, "studies", Studies(name=name, plan=Studies.of(state).plan))


def _brush_words(_: State, brushes: tuple[Brush, ...]) -> str:
    verb = "Filter" if any(brush.ranges for brush in brushes) else "Free"
    return f"{verb} {' and '.join(label_of(brush.axis) for brush in brushes)}"


@action(_brush_words)
def brush_axes(state: State, brushes: tuple[Brush, ...]) -> State:
    """Select designs within ranges of some axes; an axis without ranges is freed.

    Raises:
        InputError: Too many ranges of an axis, or a range without numbers.
    """
    studies = Studies.of(state)
    for brush in brushes:
        _check_ranges(brush)
        studies = studies.with_ranges(brush.axis, brush.ranges)
    return with_value(state, "studies", studies)


def free_axes(state: State) -> Act:
    """Return the action that frees all axes."""
    return brush_axes(tuple(Brush(brush.axis, ()) for brush in Studies.of(state).brushes))


@action("Pick {design}", is_jump=True)
def pick_design(state: State, design: Design, index: int, study: str) -> State:
    """Open the design with an index in a study, which must be the open one."""
    if Studies.of(state).name != study:
        raise InputError(f"the study {study!r} is not open any more")
    return with_value(open_design(design).apply(state), "studies.picked", index)


def _check_ranges(brush: Brush) -> None:
    if len(brush.ranges) > MOST_RANGES:
        count = len(brush.ranges)
        raise InputError(f"an axis takes {MOST_RANGES} ranges; {brush.axis} was given {count}")
    for low, high in brush.ranges:
        if not (math.isfinite(low) and math.isfinite(high) and low <= high):
            got = " to ".join(format_apart((low, high), 4, format_number))
            raise InputError(f"a range of {brush.axis} goes from low to high; got {got}")
