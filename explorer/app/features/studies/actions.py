"""The actions of looking at studies: open one, brush, choose axes, pick a design, wish for one."""

from __future__ import annotations

import math
from dataclasses import dataclass, replace
from typing import ClassVar

from explorer.app.state.action import Action, changes
from explorer.app.state.actions import Open
from explorer.app.state.state import State
from explorer.app.state.studies import Range, Studies, StudyWish, spoken
from explorer.errors import InputError

# Of one axis; hands make a few.
MOST_RANGES = 16


@dataclass(frozen=True)
class OpenStudy(Action):
    """Look at a study by its name, or at none."""

    name: str | None

    def apply(self, state: State) -> State:
        """Return the next state; what was brushed and picked in another study is forgotten."""
        if self.name == state.studies.name:
            return state
        return replace(state, studies=Studies(name=self.name, wish=state.studies.wish))

    def words(self) -> str:
        """Return what the action does."""
        return "Close the study" if self.name is None else f"Study {self.name}"


@dataclass(frozen=True)
class BrushAxis(Action):
    """Ask for designs that lie within ranges of an axis; with none the axis is free."""

    axis: str
    ranges: tuple[Range, ...]

    def apply(self, state: State) -> State:
        """Return the next state.

        Raises:
            InputError: too many ranges, or one without numbers.
        """
        return _with(state, state.studies.brushed(self.axis, _checked(self.axis, self.ranges)))

    def words(self) -> str:
        """Return what the action does."""
        return f"{'Brush' if self.ranges else 'Free'} {spoken(self.axis)}"


@dataclass(frozen=True)
class BrushBox(Action):
    """Ask for designs within a box of the scatter plot; without ranges both axes are free."""

    template: ClassVar[str] = "Brush {action.spoken}"

    across: str
    up: str
    box: tuple[Range, Range] | None

    @property
    def spoken(self) -> str:
        """What people call both axes."""
        return f"{spoken(self.across)} and {spoken(self.up)}"

    def apply(self, state: State) -> State:
        """Return the next state.

        Raises:
            InputError: ranges without numbers.
        """
        studies = state.studies
        for index, axis in enumerate((self.across, self.up)):
            ranges = () if self.box is None else (self.box[index],)
            studies = studies.brushed(axis, _checked(axis, ranges))
        return _with(state, studies)


@dataclass(frozen=True)
class ClearBrushes(Action):
    """Free all axes."""

    template: ClassVar[str] = "Clear all brushes"

    def apply(self, state: State) -> State:
        """Return the next state."""
        return _with(state, replace(state.studies, brushes=()))


@dataclass(frozen=True)
class SetAxes(Action):
    """Choose what the scatter plot shows and what colours the plots; None for an objective."""

    across: str | None
    up: str | None
    colour: str | None

    def apply(self, state: State) -> State:
        """Return the next state."""
        studies = replace(state.studies, across=self.across, up=self.up, colour=self.colour)
        return _with(state, studies)

    def describe(self, before: State, after: State) -> str:
        """Return what the step did."""
        return changes("Plot", before.studies, after.studies)


@dataclass(frozen=True)
class PickDesign(Open):
    """Open the design of a row of the open study.

    Attributes:
        index: Of the design in its study.
        study: Its name.
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
        after = super().apply(state)
        return _with(after, replace(after.studies, picked=self.index))


@dataclass(frozen=True)
class SetStudyWish(Action):
    """Change the small study that can be started."""

    wish: StudyWish

    def apply(self, state: State) -> State:
        """Return the next state."""
        return _with(state, replace(state.studies, wish=self.wish))

    def describe(self, before: State, after: State) -> str:
        """Return what the step did."""
        return changes("New study", before.studies.wish, after.studies.wish)


def _with(state: State, studies: Studies) -> State:
    return replace(state, studies=studies)


def _checked(axis: str, ranges: tuple[Range, ...]) -> tuple[Range, ...]:
    if len(ranges) > MOST_RANGES:
        raise InputError(f"an axis takes {MOST_RANGES} ranges; {axis} was given {len(ranges)}")
    for low, high in ranges:
        if not (math.isfinite(low) and math.isfinite(high) and low <= high):
            raise InputError(f"a range of {axis} goes from low to high; got {low:g} to {high:g}")
    return ranges
