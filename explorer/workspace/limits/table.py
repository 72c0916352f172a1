"""The table of limits, in the order of the design file.

Validity, messages, safe steps of moves, solids, lists of limits in force and the controls of the
page all read it: a new limit is one row.
"""

from __future__ import annotations

import math
from collections.abc import Callable, Iterable, Iterator, Mapping, Sequence
from dataclasses import dataclass
from functools import lru_cache, partial
from operator import attrgetter
from typing import Any

import numpy as np

from explorer.mechanism.configuration import Configuration
from explorer.mechanism.design import JOINTS, LENGTHS, Design, Pair, Swing
from explorer.mechanism.feasible_intervals import possible_ranges
from explorer.mechanism.margins import MARGIN_KINDS
from explorer.numerics.arrays import FloatArray
from explorer.workspace.limits import quantities
from explorer.workspace.limits.quantities import Bound, Demand, LegAngle


@dataclass(frozen=True)
class LimitCase:
    """The data that the demands of a limit follow from.

    Attributes:
        design: The manipulator.
        value: Value of the limit's field.
        signs: Sign triple to demand, even if no margin is; None for the home's.
        order: Sign of d3 − d1 to demand, 0 for either; the design's if None.
    """

    design: Design
    value: Any
    signs: tuple[int, int, int] | None
    order: int | None


@dataclass(frozen=True)
class Switch:
    """A checkbox, for one field or for several.

    Attributes:
        label, hint: Words beside it, and a sentence on what it does.
        turn: Function of a design, the field's value and on or off, which returns the new value;
            None if off is None, and on the value that the entries show while it is None.
        is_on: Function of the value.
    """

    label: str
    hint: str
    turn: Callable[[Design, Any, bool], object] | None = None
    is_on: Callable[[Any], bool] = lambda value: value is not None


@dataclass(frozen=True)
class LimitSlider:
    """A slider for a number or for the ends of a range.

    Attributes:
        label, hint: Words beside it, and a sentence on what it sets.
        track: Function of a design that returns the range of the slider.
        axis: Index in each of the two corners of a box; None for the field itself.
        is_number: Whether the value is one number.
        is_angle: Whether it is in degrees, rather than in design units.
        free: Number in place of None; without a switch the field becomes None there. A range shows
            its track.
        least: Least value of the track.
    """

    label: str
    hint: str
    track: Callable[[Design], Pair]
    axis: int | None = None
    is_number: bool = False
    is_angle: bool = False
    free: float | None = None
    least: float = -math.inf


@dataclass(frozen=True)
class Limit:
    """A row of the table.

    Attributes:
        path: Field below `Design.limits`, such as "guide" or "swing.a1".
        subjects: The field at the beginning of a sentence, and its parts by the words that
            follow its path in messages.
        demands: Function that yields the demands that are in force.
        entries: Sliders that edit it.
        switch: Checkbox before the entries.
    """

    path: str
    subjects: Mapping[str, str]
    demands: Callable[[LimitCase], Iterable[Demand]]
    entries: tuple[LimitSlider, ...] = ()
    switch: Switch | None = None

    def value(self, design: Design) -> Any:
        """Return the value of the field in a design."""
        return attrgetter(self.path)(design.limits)


Number = partial(LimitSlider, is_number=True)
GAP, CARRIAGE_ORDER = "gap |d1 − d3|", "carriage order"


def _length(name: str) -> Limit:
    def demands(case: LimitCase) -> Iterator[Demand]:
        low, high = case.value
        most = Bound(high, {f"{name} maximum": 1.0}) if high is not None else _reach(case.design)
        least = Bound(low, {f"{name} minimum": 1.0})
        yield Demand(name, quantities.L1 + LENGTHS.index(name), least, most)

    def track(design: Design) -> Pair:
        longest = max(design.length_range(length)[1] for length in LENGTHS)
        return 0.0, max(longest, design.reach)

    words = {"": "length", " minimum": "least length", " maximum": "greatest length"}
    subjects = {part: f"The {which} {name}" for part, which in words.items()}
    entry = LimitSlider(name, f"Minimum and maximum of {name}.", track, least=0.0)
    return Limit(name, subjects, demands, (entry,), AT_REACH)


def _reach(design: Design) -> Bound:
    """Return the maximum of a length without one of its own, which follows a3."""
    x, y = design.a3
    return Bound(design.reach, {"a3x": x / design.reach, "a3y": y / design.reach}, "the reach")


AT_REACH = Switch(
    "Maxima at the reach",
    "Set the maximum length of every actuator to the reach |a3| of the design.",
    lambda design, ends, on: (ends[0], None if on else max(ends[0], ends[1] or design.reach)),
    lambda ends: ends[1] is None,
)


def _guide(case: LimitCase) -> Iterator[Demand]:
    if case.value is not None:
        low, high = case.value
        ends = Bound(low, {"guide minimum": 1.0}), Bound(high, {"guide maximum": 1.0})
        yield from (Demand("d1", quantities.D1, *ends), Demand("d3", quantities.D3, *ends))


def _guide_track(design: Design) -> Pair:
    _, d1, _, d3, _, _ = possible_ranges(design.with_limits(guide=None)).joints
    own = design.limits.guide or d1
    return min(d1[0], d3[0], own[0]), max(d1[1], d3[1], own[1])


def _gap(case: LimitCase) -> Iterator[Demand]:
    if case.value > 0.0:
        yield Demand(GAP, quantities.GAP, Bound(case.value), has_ends=False)


def _gap_track(design: Design) -> Pair:
    # The carriages are never farther apart than b2 and b3.
    return 0.0, max(abs(design.b3 - design.b2), design.limits.gap)


def _order(case: LimitCase) -> Iterator[Demand]:
    sign = case.design.demanded_order if case.order is None else case.order
    if sign:
        yield _sign_demand(CARRIAGE_ORDER, quantities.ORDER, sign, Bound(0.0), "d3 − d1")


def _sign_demand(name: str, quantity: int, sign: int, least: Bound, symbol: str) -> Demand:
    """Return the demand that a quantity has a sign and at least a magnitude."""
    if sign > 0:
        return Demand(name, quantity, least, symbol=symbol, has_ends=False, is_sign=True)
    most = Bound(-least.value, {name: -rate for name, rate in least.rates.items()})
    return Demand(name, quantity, high=most, symbol=symbol, has_ends=False, is_sign=True)


def _box(case: LimitCase) -> Iterator[Demand]:
    if case.value is not None:
        for axis, (letter, low, high) in enumerate(zip("xyz", *case.value, strict=True)):
            name = f"box {letter}"
            ends = Bound(low, {f"{name} minimum": 1.0}), Bound(high, {f"{name} maximum": 1.0})
            yield Demand(name, quantities.X + axis, *ends, symbol=f"b4 {letter}")


def _box_entry(axis: int, name: str) -> LimitSlider:
    def track(design: Design) -> Pair:
        free = possible_ranges(design.with_limits(box=None)).position[axis]
        own = design.limits.box or ((free[0],) * 3, (free[1],) * 3)
        return min(free[0], own[0][axis]), max(free[1], own[1][axis])

    return LimitSlider(f"b4 {name}", f"The faces of the box across {name}.", track, axis)


def _margins(case: LimitCase) -> Iterator[Demand]:
    if case.value is None and case.signs is None:
        return
    least = Bound(case.value or 0.0, {"margin": 1.0})
    for index, sign in enumerate(case.signs or case.design.home_signs):
        symbol = f"δ{index + 1}"
        yield _sign_demand(f"margin {symbol}", quantities.DELTA1 + index, sign, least, symbol)


def _swing(joint: str, kind: str) -> Limit:
    leg = 3 if joint == "a3" else int(joint[1]) - 1

    def demands(case: LimitCase) -> Iterator[Demand]:
        if case.value is not None:
            angle = angle_from_home(case.design, leg, in_platform=joint.startswith("b"))
            name, most = f"swing {joint}", Bound(case.value)
            yield Demand(name, quantities.ANGLE, high=most, has_ends=False, angle=angle)

    hint = (
        f"Maximum angle of leg {leg + 1} in this joint from its direction in the home pose; 180 "
        "for no bound."
    )
    entry = Number(f"{joint} {kind}", hint, lambda _: (1.0, 180.0), is_angle=True, free=180.0)
    return Limit(f"swing.{joint}", {"": f"The swing of the {joint} {kind}"}, demands, (entry,))


def angle_from_home(design: Design, leg: int, *, in_platform: bool) -> LegAngle:
    """Return the angle of a leg, 0 to 3, from its direction in the home pose."""
    direction, rotation = _legs_at_home(design)[leg], design.home_pose.rotation
    length = float(np.linalg.norm(direction))
    if length == 0.0:
        return LegAngle(leg, None, in_platform)
    axis = direction / length
    return LegAngle(leg, rotation.T @ axis if in_platform else axis, in_platform)


@lru_cache(16)
def _legs_at_home(design: Design) -> FloatArray:
    return Configuration.at(design, design.home_pose).legs


LIMITS: list[Limit] = [
    *map(_length, LENGTHS),
    Limit(
        "guide",
        {
            "": "The guide",
            " low": "The end of the guide, \u201cd least\u201d,",
            " high": "The end of the guide, \u201cd most\u201d,",
        },
        _guide,
        (LimitSlider("d1, d3", "The ends of the guide, for both carriages.", _guide_track),),
        Switch("Bounded guide", "Keep both carriages between two ends of the guide."),
    ),
    Limit(
        "gap",
        {"": "The gap of the carriages"},
        _gap,
        (Number("gap", "Minimum distance |d1 − d3| of the carriages.", _gap_track, least=0.0),),
    ),
    Limit(
        "carriage_order",
        {"": "The order of the carriages"},
        _order,
        switch=Switch(
            "Carriages keep their order",
            "Require that d3 − d1 keeps its sign of the home pose: at d1 = d3 legs 2 and 3 share a "
            "point.",
            lambda _, __, on: "home" if on else "any",
            lambda value: value == "home",
        ),
    ),
    Limit(
        "box",
        {
            "": "The box for b4",
            " lows": "The lower corner of the box for b4",
            " highs": "The upper corner of the box for b4",
            **{f" {axis}": f"The box for b4 along {axis}" for axis in "xyz"},
        },
        _box,
        tuple(_box_entry(axis, name) for axis, name in enumerate("xyz")),
        Switch("Box for b4", "Keep b4 within a box."),
    ),
    Limit(
        "margin",
        {"": "The margin"},
        _margins,
        (
            Number(
                "margin",
                f"Minimum of |δ1|, |δ2| and |δ3|; {MARGIN_KINDS}.",
                lambda design: (0.0, design.reach),
                free=0.0,
                least=0.0,
            ),
        ),
        Switch(
            "Stay in the home mode",
            "Require the sign triple of the home pose, and the margin below.",
        ),
    ),
    *(_swing(joint, "U joint" if joint[0] == "a" else "ball") for joint in Swing.__struct_fields__),
]
"""The limits in the order of the design file."""


@lru_cache(256)
def demands_of(
    design: Design, signs: tuple[int, int, int] | None = None, order: int | None = None
) -> tuple[Demand, ...]:
    """Return the demands of a design that are in force, in the order of the table.

    A sign triple may be demanded in place of the home's, even if no margin is, and a sign of
    d3 − d1, 0 for either, in place of the design's.
    """
    return tuple(
        demand
        for limit in LIMITS
        for demand in limit.demands(LimitCase(design, limit.value(design), signs, order))
    )


def bounds_angles(design: Design) -> bool:
    """Return whether a limit of a design bounds an angle, so that cones bound its workspace."""
    return any(demand.angle is not None for demand in demands_of(design))


def joint_ranges(design: Design) -> dict[str, Pair]:
    """Return the ranges of those joints that limits bound, by their names, in design units."""
    return {
        demand.name: (demand.low.value, demand.high.value)
        for demand in demands_of(design)
        if demand.name in JOINTS
    }


def by_quantity(demands: Iterable[Demand]) -> list[Demand]:
    """Return demands in the order in which kernels take them, that of the quantities."""
    return sorted(demands, key=attrgetter("quantity"))


def rows_of(design: Design, demands: Sequence[Demand]) -> FloatArray:
    """Return the rows of demands for kernels, shape (n, DEMAND_COLUMNS)."""
    rows = [demand.row(design) for demand in demands]
    return np.array(rows, dtype=np.float64).reshape(-1, quantities.DEMAND_COLUMNS)


def limits_in_force(design: Design) -> Iterator[tuple[str, Demand]]:
    """Yield the demands in force for a list: equal ones once, with all their symbols."""
    rows: dict[str, list[Demand]] = {}
    for demand in demands_of(design):
        rows.setdefault(demand.words(), []).append(demand)
    for demands in rows.values():
        yield ", ".join(demand.symbol or demand.name for demand in demands), demands[0]
