"""Which study is looked at, and how: a part of the state, frozen as all of it.

A study is named, not where it lies: only the server knows the folders.
"""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, replace
from typing import Any, TypeAlias

import numpy as np

from explorer.errors import InputError
from explorer.measures.catalogue import CATALOGUE, measures_in
from explorer.mechanism.design import VARIABLES, Design
from explorer.numerics.arrays import BoolArray
from explorer.optimise.problem import REACH, YAW, longest_minimum, start_value
from explorer.sweep.study import (
    DEFAULT_MEASURES,
    LONGEST_NAME,
    NAMES,
    RADIUS,
    Objective,
    Sampling,
    Sense,
    Study,
)

Range: TypeAlias = tuple[float, float]

FEWEST, MOST = 16, 2000
"""How many designs a study from the page may have."""

LEAST_PERCENT, MOST_PERCENT = 1.0, 95.0
"""How far variables may vary; with more a3y or b1y would come to zero."""

# A variable near zero varies as if it were this share of the reach; an angle by a share of this.
LEAST_SHARE, RIGHT_ANGLE = 0.05, 90.0
# A study from the page has about so many parts, each of which is shown when it is there.
PARTS = 40


@dataclass(frozen=True)
class Brush:
    """What is asked of one axis: to lie within one of its ranges, ends included.

    Attributes:
        axis: The name of a variable or measure.
        ranges: At least one, low and high end of each.
    """

    axis: str
    ranges: tuple[Range, ...]


@dataclass(frozen=True)
class StudyWish:
    """A small study around the live design.

    Attributes:
        count: How many designs.
        percent: How far each variable varies, in per cent.
        variables: Those that vary, out of `NAMES`.
        measures: What is measured.
        objectives: What the front is of, out of the measures, and what is wanted of each.
    """

    count: int = 256
    percent: float = 20.0
    variables: tuple[str, ...] = VARIABLES
    measures: tuple[str, ...] = DEFAULT_MEASURES
    objectives: tuple[tuple[str, Sense], ...] = (
        ("volume", "max"),
        ("reach", "min"),
        ("clearance", "max"),
    )

    def sense_of(self, measure: str) -> Sense | None:
        """Return what is wanted of a measure, None if nothing is."""
        return dict(self.objectives).get(measure)

    def with_variable_turned(self, name: str) -> StudyWish:
        """Return the wish in which a variable varies if it did not, and else does not."""
        return replace(self, variables=_turned(NAMES, self.variables, name))

    def with_measure_turned(self, name: str) -> StudyWish:
        """Return the wish with the next use of a measure.

        First it is measured, then to be large, then small, then left out again.
        """
        wanted = dict(self.objectives)
        measures = self.measures
        if name not in measures:
            measures = _turned(tuple(measures_in("studies")), measures, name)
        elif name not in wanted:
            wanted[name] = "max"
        elif wanted[name] == "max":
            wanted[name] = "min"
        else:
            del wanted[name]
            measures = _turned(tuple(measures_in("studies")), measures, name)
        ordered = tuple((each, wanted[each]) for each in CATALOGUE if each in wanted)
        return replace(self, measures=measures, objectives=ordered)


@dataclass(frozen=True)
class Studies:
    """What is looked at.

    Attributes:
        name: Of the open study; None if none is.
        brushes: At most one for each axis.
        across, up: What the scatter plot shows; None for the first two objectives.
        colour: What colours both plots; None for the first objective.
        picked: The index of the design that was picked last.
        wish: The small study that can be started.
    """

    name: str | None = None
    brushes: tuple[Brush, ...] = ()
    across: str | None = None
    up: str | None = None
    colour: str | None = None
    picked: int | None = None
    wish: StudyWish = StudyWish()

    def brushed(self, axis: str, ranges: tuple[Range, ...]) -> Studies:
        """Return the same with other ranges of one axis; with none the axis is free."""
        others = tuple(each for each in self.brushes if each.axis != axis)
        return replace(self, brushes=(*others, Brush(axis, ranges)) if ranges else others)

    def ranges_of(self, axis: str) -> tuple[Range, ...]:
        """Return the ranges of an axis, none where it is free."""
        return next((each.ranges for each in self.brushes if each.axis == axis), ())


def within(columns: Mapping[str, Any], brushes: tuple[Brush, ...]) -> BoolArray:
    """Return which rows lie within all brushes, shape (n,).

    A row lies within a brush if its value lies in one of the ranges, ends included; what has
    no value lies in none. Brushes of axes that a study does not have ask for nothing.

    Args:
        columns: By name, shape (n,) each, with the index among them.
        brushes: At most one for each axis.
    """
    found = np.ones(len(columns["index"]), dtype=np.bool_)
    for brush in brushes:
        if brush.axis not in columns:
            continue
        values = np.asarray(columns[brush.axis], dtype=np.float64)
        inside = np.zeros(len(values), dtype=np.bool_)
        for low, high in brush.ranges:
            inside |= (values >= low) & (values <= high)
        found &= inside
    return found


def range_around(design: Design, name: str, percent: float) -> Range:
    """Return how far a variable of a study varies around a design.

    By the per cent of its value, of a 20th of the reach where that is larger; the yaw by
    those of a right angle, a radius down to zero at most.

    Raises:
        InputError: no such variable.
    """
    share = percent / 100.0
    if name == YAW:
        value, span = start_value(design, YAW), share * RIGHT_ANGLE
    elif name == RADIUS:
        value = max(design.limits.leg_radii)
        span = share * max(value, LEAST_SHARE**2 * design.reach)
        return max(0.0, value - span), value + span
    else:
        value = start_value(design, name)
        span = share * max(abs(value), LEAST_SHARE * design.reach)
    low = value - span
    if name == REACH:
        # Halfway to the longest minimum at the most.
        low = max(low, 0.5 * (value + longest_minimum(design)))
    return low, value + span


def study_around(design: Design, wish: StudyWish, name: str) -> Study:
    """Return a small study around a design.

    Args:
        design: The design.
        wish: What varies and what is measured.
        name: Of the study.

    Raises:
        InputError: nothing varies or nothing is measured, or far too many designs.
    """
    if not FEWEST <= wish.count <= MOST:
        raise InputError(f"a study from the page has {FEWEST} to {MOST} designs; got {wish.count}")
    if not LEAST_PERCENT <= wish.percent <= MOST_PERCENT:
        raise InputError(
            f"variables vary by {LEAST_PERCENT:g} to {MOST_PERCENT:g} %; got {wish.percent:g} %"
        )
    if not wish.variables:
        raise InputError("choose at least one variable that varies")
    measures = tuple(each for each in wish.measures if each not in wish.variables)
    if not measures:
        raise InputError("choose at least one measure")
    ranges = {each: range_around(design, each, wish.percent) for each in wish.variables}
    return Study(
        name=name[:LONGEST_NAME],
        design=design,
        variables=ranges,
        sampling=Sampling(method="sobol", count=wish.count),
        measures=measures,
        objectives=tuple(Objective(measure, sense) for measure, sense in wish.objectives),
        chunk=max(4, -(-wish.count // PARTS)),
    )


def unit_of(name: str) -> str:
    """Return the unit of a variable or measure as people read it, "" for a plain number."""
    if name in CATALOGUE:
        return CATALOGUE[name].unit_in("units")
    return "°" if name == YAW else "units" if name in NAMES else ""


def spoken(name: str) -> str:
    """Return what people call a variable or measure."""
    is_measure = name in measures_in("studies")
    return CATALOGUE[name].label if is_measure else name.replace("_", " ")


def titled(name: str) -> str:
    """Return the title of an axis, with its unit."""
    unit = unit_of(name)
    return f"{spoken(name)} [{unit}]" if unit else spoken(name)


def briefly(name: str) -> str:
    """Return the title of an axis where there is little room, with its unit: u is one unit."""
    unit = unit_of(name).replace("units", "u")
    words = spoken(name).replace("inverse condition", "inv. cond.")
    return f"{words} [{unit}]" if unit else words


def _turned(order: tuple[str, ...], chosen: tuple[str, ...], name: str) -> tuple[str, ...]:
    if name not in order:
        raise InputError(f"there is no {name!r}; there are {', '.join(order)}")
    kept = {*chosen} ^ {name}
    return tuple(each for each in order if each in kept)
