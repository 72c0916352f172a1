"""The actions of studies: open one, brush axes, pick a design."""

from __future__ import annotations

import math
from dataclasses import dataclass
from typing import ClassVar

from explorer.app.features.studies.state import Brush, Studies, label_of
from explorer.app.state.actions import Action, Open
from explorer.app.state.parts import with_value
from explorer.app.state.state import State
from explorer.errors import InputError
from explorer.numerics.number_text import format_apart, format_number

# Ranges of one axis.
MOST_RANGES = 16


@dataclass(frozen=True)
class OpenStudy(Action):
    """Open a study by its name; None closes it."""

    name: str | None

    def apply(self, state: State) -> State:
        """Return the next state, without the brushes and the pick of another study."""
        if self.name == Studies.of(state).name:
            return state
        studies = Studies(name=self.name, plan=Studies.of(state).plan)
        return with_value(state, "studies", studies)

    def words(self) -> str:
        """Return the words for the action."""
        return "Close the study" if self.name is None else f"Study {self.name}"


@dataclass(frozen=True)
class BrushAxes(Action):
    """Select designs within ranges of some axes; an axis without ranges is freed."""

    brushes: tuple[Brush, ...]

    def apply(self, state: State) -> State:
        """Return the next state; refuse too many ranges, and ranges without numbers."""
        studies = Studies.of(state)
        for brush in self.brushes:
            _check_ranges(brush)
            studies = studies.with_ranges(brush.axis, brush.ranges)
        return with_value(state, "studies", studies)

    def words(self) -> str:
        """Return the words for the action."""
        verb = "Filter" if any(brush.ranges for brush in self.brushes) else "Free"
        return f"{verb} {' and '.join(label_of(brush.axis) for brush in self.brushes)}"


def free_axes(state: State) -> BrushAxes:
    """Return the action that frees all axes."""
    return BrushAxes(tuple(Brush(brush.axis, ()) for brush in Studies.of(state).brushes))


@dataclass(frozen=True)
class PickDesign(Open):
    """Open the design with an index in a study, which must be the open one."""

    template: ClassVar[str] = "Pick {design}"

    index: int = 0
    study: str = ""

    def apply(self, state: State) -> State:
        """Return the next state; refuse a design of another study than the open one."""
        if Studies.of(state).name != self.study:
            raise InputError(f"the study {self.study!r} is not open any more")
        return with_value(super().apply(state), "studies.picked", self.index)


def _check_ranges(brush: Brush) -> None:
    if len(brush.ranges) > MOST_RANGES:
        count = len(brush.ranges)
        raise InputError(f"an axis takes {MOST_RANGES} ranges; {brush.axis} was given {count}")
    for low, high in brush.ranges:
        if not (math.isfinite(low) and math.isfinite(high) and low <= high):
            got = " to ".join(format_apart((low, high), 4, format_number))
            raise InputError(f"a range of {brush.axis} goes from low to high; got {got}")
