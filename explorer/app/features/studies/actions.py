"""The actions of studies: open one, brush axes, pick a design."""

from __future__ import annotations

import math
from dataclasses import dataclass, replace
from typing import ClassVar

from explorer.app.state.action import Action
from explorer.app.state.actions import Open
from explorer.app.state.state import State
from explorer.app.state.studies import Range, Studies, label_of
from explorer.app.state.values import with_value
from explorer.errors import InputError
from explorer.numerics.number_text import format_number

# Ranges of one axis.
MOST_RANGES = 16


@dataclass(frozen=True)
class OpenStudy(Action):
    """Open a study by its name; None closes it."""

    name: str | None

    def apply(self, state: State) -> State:
        """Return the next state, without the brushes and the pick of another study."""
        if self.name == state.studies.name:
            return state
        return replace(state, studies=Studies(name=self.name, plan=state.studies.plan))

    def words(self) -> str:
        """Return what the action does."""
        return "Close the study" if self.name is None else f"Study {self.name}"


@dataclass(frozen=True)
class BrushAxis(Action):
    """Select designs within ranges of an axis; no ranges free it."""

    axis: str
    ranges: tuple[Range, ...]

    def apply(self, state: State) -> State:
        """Return the next state.

        Raises:
            InputError: too many ranges, or one without numbers.
        """
        ranges = _check_ranges(self.axis, self.ranges)
        return replace(state, studies=state.studies.with_ranges(self.axis, ranges))

    def words(self) -> str:
        """Return what the action does."""
        return f"{'Brush' if self.ranges else 'Free'} {label_of(self.axis)}"


@dataclass(frozen=True)
class BrushBox(Action):
    """Select designs within a box of the scatter plot; None frees both axes."""

    template: ClassVar[str] = "Brush {action.spoken}"

    across: str
    up: str
    box: tuple[Range, Range] | None

    @property
    def spoken(self) -> str:
        """The names of both axes on the page."""
        return f"{label_of(self.across)} and {label_of(self.up)}"

    def apply(self, state: State) -> State:
        """Return the next state.

        Raises:
            InputError: ranges without numbers.
        """
        studies = state.studies
        for index, axis in enumerate((self.across, self.up)):
            ranges = () if self.box is None else (self.box[index],)
            studies = studies.with_ranges(axis, _check_ranges(axis, ranges))
        return replace(state, studies=studies)


@dataclass(frozen=True)
class ClearBrushes(Action):
    """Free all axes."""

    template: ClassVar[str] = "Clear all brushes"

    def apply(self, state: State) -> State:
        """Return the next state."""
        return with_value(state, "studies.brushes", ())


@dataclass(frozen=True)
class PickDesign(Open):
    """Open the design of a row of the open study.

    Attributes:
        index: Index of the design in its study.
        study: Name of the study.
    """

    template: ClassVar[str] = "Pick {design}"

    index: int = 0
    study: str = ""

    def apply(self, state: State) -> State:
        """Return the next state.

        Raises:
            InputError: the design is being optimised, or another study is open by now.
        """
        if state.studies.name != self.study:
            raise InputError(f"the study {self.study!r} is not open any more")
        return with_value(super().apply(state), "studies.picked", self.index)


def _check_ranges(axis: str, ranges: tuple[Range, ...]) -> tuple[Range, ...]:
    if len(ranges) > MOST_RANGES:
        raise InputError(f"an axis takes {MOST_RANGES} ranges; {axis} was given {len(ranges)}")
    for low, high in ranges:
        if not (math.isfinite(low) and math.isfinite(high) and low <= high):
            raise InputError(
                f"a range of {axis} goes from low to high; "
                f"got {format_number(low)} to {format_number(high)}"
            )
    return ranges
