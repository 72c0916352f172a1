"""The open study, and how it is shown: the studies' part of the state, and its actions.

A study is known by its name, not by its folder: only the server knows the folders.
"""

from __future__ import annotations

import math
from collections.abc import Mapping
from dataclasses import dataclass, replace
from typing import Any, TypeAlias

import numpy as np

from explorer.app.state.actions import Act, action, open_design
from explorer.app.state.parts import FeaturePart, with_value
from explorer.app.state.state import State
from explorer.errors import InputError
from explorer.measures.catalogue import CATALOGUE, measures_in, unmet_needs
from explorer.measures.measure import Case
from explorer.mechanism.design import VARIABLES, Design
from explorer.numerics.arrays import BoolArray
from explorer.numerics.checks import LONGEST_NAME
from explorer.numerics.number_text import Unit, format_apart, format_number
from explorer.optimise.problem import REACH, YAW, longest_minimum, start_value
from explorer.sweep import study as sweeps
from explorer.sweep.machine import MACHINE
from explorer.sweep.results import unit_of

Range: TypeAlias = tuple[float, float]

# A variable near zero varies as if its value were this share of the reach; the yaw varies by a
# percentage of this angle, in degrees.
LEAST_SHARE, RIGHT_ANGLE = 0.05, 90.0
# Number of parts of a study from the page, about; each is shown as soon as it is computed.
PARTS = 40


@dataclass(frozen=True)
class Brush:
    """A filter on one axis: values must lie within one of its ranges, ends included."""

    axis: str
    ranges: tuple[Range, ...]


# Smallest and largest number of designs of a study from the page, and least and most per cent by
# which its variables vary; with more, a3y or b1y could be zero.
COUNTS, PERCENTS = (16.0, 2000.0), (1.0, 95.0)


@dataclass(frozen=True)
class StudyPlan:
    """A small study around the live design.

    Attributes:
        percent: How far each variable varies, in per cent.
        variables: Names of the variables that vary, out of `NAMES` of a study.
        objectives: Measures that span the Pareto front, each with its sense.
    """

    count: int = 256
    percent: float = 20.0
    variables: tuple[str, ...] = VARIABLES
    measures: tuple[str, ...] = sweeps.DEFAULT_MEASURES
    objectives: tuple[tuple[str, sweeps.Sense], ...] = (
        ("volume", "max"),
        ("reach", "min"),
        ("clearance", "max"),
    )

    def with_variable_toggled(self, name: str) -> StudyPlan:
        """Return the plan in which a variable varies if it did not, and else stays fixed."""
        return replace(self, variables=_toggle(sweeps.NAMES, self.variables, name))

    def with_measure_advanced(self, name: str) -> StudyPlan:
        """Return the plan with the next use of a measure.

        The uses in order: it is measured, then maximised, then minimised, then left out again.
        """
        senses = dict(self.objectives)
        measures = self.measures
        if name in measures and senses.get(name) != "min":
            senses[name] = "min" if name in senses else "max"
        else:
            senses.pop(name, None)
            measures = _toggle(tuple(measures_in("studies")), measures, name)
        ordered = tuple((other, senses[other]) for other in CATALOGUE if other in senses)
        return replace(self, measures=measures, objectives=ordered)


@dataclass(frozen=True)
class Studies(FeaturePart, name="studies"):
    """The open study, and how it is shown.

    Attributes:
        name: Name of the open study; None if none is.
        across, up: Names of the axes of the scatter plot; None for the first two objectives.
        colour: Name of what colours both plots; None for the first objective.
        logarithmic: Whether axes with positive values alone are logarithmic.
        picked: Index of the design that was picked last.
    """

    name: str | None = None
    brushes: tuple[Brush, ...] = ()
    across: str | None = None
    up: str | None = None
    colour: str | None = None
    logarithmic: bool = False
    front_only: bool = False
    picked: int | None = None
    plan: StudyPlan = StudyPlan()

    def with_ranges(self, axis: str, ranges: tuple[Range, ...]) -> Studies:
        """Return the studies with new ranges of one axis; with none the axis has no filter."""
        others = tuple(brush for brush in self.brushes if brush.axis != axis)
        return replace(self, brushes=(*others, Brush(axis, ranges)) if ranges else others)

    def ranges_of(self, axis: str) -> tuple[Range, ...]:
        """Return the ranges of an axis; none if it has no filter."""
        return next((brush.ranges for brush in self.brushes if brush.axis == axis), ())


def within(columns: Mapping[str, Any], brushes: tuple[Brush, ...]) -> BoolArray:
    """Return which rows lie within all brushes, shape (n,), given columns of this shape by name.

    A row lies within a brush if its value lies in one of the ranges, ends included; a missing
    value (NaN) lies in none. Brushes of axes that a study does not have are passed over.
    """
    chosen = np.ones(len(columns["index"]), dtype=np.bool_)
    for brush in brushes:
        if brush.axis not in columns:
            continue
        values = np.asarray(columns[brush.axis], dtype=np.float64)
        chosen &= np.any([(values >= low) & (values <= high) for low, high in brush.ranges], axis=0)
    return chosen


def range_around(design: Design, name: str, percent: float) -> Range:
    """Return the range of a variable of a study around its value in a design.

    The range extends to both sides by a percentage of the value, or of a 20th of the reach where
    that is larger; for the yaw, of a right angle. A radius stays at zero or above.

    Raises:
        InputError: No such variable, or a part of the machine that the design does not have.
    """
    least = LEAST_SHARE * design.reach
    if name in MACHINE:
        value = MACHINE[name].value_in(design)
        if value is None:
            raise InputError(f"the design has no {label_of(name)} that could vary")
        least = least if MACHINE[name].bound == "any" else 0.0
    elif name == sweeps.RADIUS:
        value, least = max(design.limits.leg_radii), LEAST_SHARE * least
    else:
        value = start_value(design, name)
    span = percent / 100.0 * (RIGHT_ANGLE if name == YAW else max(abs(value), least))
    low = value - span
    if name == REACH:
        # The reach goes at most halfway down to the longest minimum.
        low = max(low, 0.5 * (value + longest_minimum(design)))
    return max(0.0, low) if name == sweeps.RADIUS else low, value + span


def study_around(design: Design, plan: StudyPlan, name: str) -> sweeps.Study:
    """Return a small study around a design, with the name given.

    Raises:
        InputError: No variable or no measure, or a number that is out of its range.
    """
    for value, ends, words in (
        (plan.count, COUNTS, "the number of designs of a study from the page"),
        (plan.percent, PERCENTS, "the per cent by which variables vary"),
    ):
        if not ends[0] <= value <= ends[1]:
            low, high, got = format_apart((*ends, value), 4, format_number)
            raise InputError(f"{words} must lie within {low} to {high}; got {got}")
    if not plan.variables:
        raise InputError("choose at least one variable that varies")
    measures = tuple(measure for measure in plan.measures if measure not in plan.variables)
    if not measures:
        raise InputError("choose at least one measure")
    if lacking := unmet_needs([Case(design)], measures):
        raise InputError(f"the design has {lacking}")
    ranges = {v: range_around(design, v, plan.percent) for v in plan.variables}
    return sweeps.Study(
        name=name[:LONGEST_NAME],
        design=design,
        variables=ranges,
        sampling=sweeps.Sampling(method="sobol", count=plan.count),
        measures=measures,
        objectives=tuple(sweeps.Objective(measure, sense) for measure, sense in plan.objectives),
        chunk=max(4, -(-plan.count // PARTS)),
    )


def choices_for(design: Design, plan: StudyPlan) -> tuple[list[str], list[str]]:
    """Return the variables and the measures that a plan has or a design allows, in their order."""
    case = Case(design)
    variables = [
        name
        for name in sweeps.NAMES
        if name in plan.variables
        or name not in MACHINE
        or MACHINE[name].value_in(design) is not None
    ]
    measures = [
        name
        for name, measure in measures_in("studies").items()
        if name in plan.measures or all(map(case.has, measure.needs))
    ]
    return variables, measures


def label_of(name: str) -> str:
    """Return the name of a variable or measure on the page."""
    is_measure = name in measures_in("studies")
    return CATALOGUE[name].label if is_measure else name.replace("_", " ")


def title_of(name: str, lengths: Unit) -> str:
    """Return the title of an axis, with its unit, given that of lengths."""
    return unit_of(name, lengths).head(label_of(name))


def _toggle(order: tuple[str, ...], chosen: tuple[str, ...], name: str) -> tuple[str, ...]:
    if name not in order:
        raise InputError(f"there is no {name!r}; there are {', '.join(order)}")
    toggled = {*chosen} ^ {name}
    return tuple(other for other in order if other in toggled)


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
