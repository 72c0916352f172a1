"""Demands that the limits of a problem cannot meet, known before a search starts.

A demand counts as impossible only where no design within the bounds can keep it: each test
compares it with a bound that holds for all of them. Other demands may still be impossible.
"""

from __future__ import annotations

import math
from collections.abc import Iterable, Iterator
from typing import NamedTuple

import msgspec

from explorer.legs.clearance import PAIRS
from explorer.mechanism.design import Design, Pair
from explorer.mechanism.design_file import PRESETS
from explorer.numerics.number_text import format_number
from explorer.optimise.demands import Box
from explorer.optimise.problem import SHIFTS, Problem
from explorer.optimise.refutation.lifting import BOX_LIMIT
from explorer.optimise.refutation.most_volume import (
    LONGEST_LEG,
    ceilings,
    near_singular_volume,
)
from explorer.optimise.refutation.ranges import Ranges, largest, negative, smallest, total
from explorer.statics.equilibrium import SINGULAR
from explorer.workspace.limits.constraints import GAP

# Excess over its bound that makes a demand impossible, as a share: searches have tolerances.
SPARE = 1e-6

PLANES = {
    2: "at z = 0",
    0: "where a1 lies on the platform plane",
    1: "where the lines a1a2 and b2b3 meet or are parallel",
}
"""Where each margin vanishes, by its index; the first two are the same for a level platform."""

PAPER_BOX = PRESETS["paper-optimal"].limits.box
"""Box of the paper's optimum."""


class Refutation(NamedTuple):
    """A demand that no design within the bounds keeps.

    Attributes:
        limit: Limit that makes it impossible, such as "box".
        message: Clause with the demand and the most that the limit allows.
    """

    limit: str
    message: str


def refutations(problem: Problem) -> tuple[Refutation, ...]:
    """Return the reasons why no design within the bounds meets the demands, one for each limit.

    Without a reason, the demands may be possible.
    """
    ranges = Ranges(problem)
    reasons: dict[str, Refutation] = {}
    for refutation in (
        *_volume(ranges),
        *_required_box(ranges),
        *_reach(ranges),
        *_gap(ranges),
        *_clearance(ranges),
    ):
        reasons.setdefault(refutation.limit, refutation)
    return tuple(reasons.values())


def words_of(reasons: Iterable[Refutation]) -> str:
    """Return all reasons in one line."""
    return "; ".join(refutation.message for refutation in reasons)


def with_box(design: Design, box: Box | None) -> Design:
    """Return a design with another box, or none; its home stays where it was."""
    limits = msgspec.structs.replace(design.limits, box=box)
    return msgspec.structs.replace(design, limits=limits, home=design.home_pose)


def paper_box(problem: Problem) -> Box | None:
    """Return the box of the paper's optimum, or None if it is too small for the demands too."""
    boxed = msgspec.structs.replace(problem, start=with_box(problem.start, PAPER_BOX))
    too_small = any(refutation.limit == BOX_LIMIT for refutation in refutations(boxed))
    return None if too_small else PAPER_BOX


def _volume(ranges: Ranges) -> Iterator[Refutation]:
    problem = ranges.problem
    wanted = problem.demands.volume or 0.0
    if wanted == 0.0 and problem.objective != "largest-volume":
        return
    for ceiling in ceilings(ranges):
        # A workspace without any volume is of no use.
        if ceiling.volume <= wanted * (1.0 - SPARE):
            room = "" if ceiling.limit == BOX_LIMIT else "room for "
            most, demanded = _amounts(ceiling.volume, wanted)
            words = f"{ceiling.words} {room}at most {most} of the {demanded} units³ asked for"
            if wanted == 0.0:
                words = f"{ceiling.words} {room}no volume"
            yield Refutation(ceiling.limit, f"{words}{ceiling.place and f', {ceiling.place}'}")


def _required_box(ranges: Ranges) -> Iterator[Refutation]:
    problem = ranges.problem
    required = problem.demands.required_box
    if required is None:
        return
    volume = math.prod(high - low for low, high in zip(*required, strict=True))
    wanted = problem.demands.volume
    if problem.objective == "match-volume" and wanted and volume > wanted * (1.0 + SPARE):
        has, demanded = _amounts(volume, wanted)
        yield Refutation(
            "required box",
            f"the required box has a volume of {has} units³ and {demanded} units³ is to be matched",
        )
    yield from _box_within_box(ranges, required)
    yield from _box_beyond_margins(ranges, required)
    yield from _box_on_plane(ranges, required)
    yield from _box_beyond_lengths(ranges, required)


def _box_within_box(ranges: Ranges, required: Box) -> Iterator[Refutation]:
    box = ranges.problem.start.limits.box
    if box is None:
        return
    for axis, name in enumerate("xyz"):
        (low, high), (least, most) = ((ends[0][axis], ends[1][axis]) for ends in (required, box))
        back, on = ranges.of(SHIFTS[axis])
        spare = SPARE * max(most - least, high - low)
        # It may be shifted by what lies in both intervals, if anything does.
        if max(least - low, back) > min(most - high, on) + spare:
            words = (
                f"the required box lies beyond the box along {name}: from "
                f"{format_number(low, 6)} to {format_number(high, 6)} units, and the box from "
                f"{format_number(least, 6)} to {format_number(most, 6)} units"
            )
            yield Refutation(BOX_LIMIT, words)


def _box_beyond_margins(ranges: Ranges, required: Box) -> Iterator[Refutation]:
    least = ranges.problem.start.limits.margin
    if least is None:
        return
    for index, sign in enumerate(ranges.signs):
        # The home's side of the plane of δ1 or δ2 may change as the platform turns.
        sides = (1, -1) if ranges.is_turning and index < 2 else (sign,)
        best = max(ranges.best_margin(index, side, required) for side in sides)
        if best < least - SPARE * ranges.problem.size:
            words = (
                "at its worst corner the required box has a margin of at most "
                f"{format_number(best)} units on the home's side, and the limits demand "
                f"{format_number(least, 6)} units"
            )
            yield Refutation("margin", words)


def _box_on_plane(ranges: Ranges, required: Box) -> Iterator[Refutation]:
    problem, demands = ranges.problem, ranges.problem.demands
    counts = {
        "no load is held": demands.held or problem.objective == "smallest-load",
        "errors are infinite": demands.error is not None or problem.objective == "smallest-error",
        "deflections are infinite": demands.deflection is not None
        or problem.objective == "smallest-deflection",
    }
    because = " and ".join(words for words, is_counted in counts.items() if is_counted)
    if not because:
        return
    size = math.hypot(*_farther_sides(ranges, required, ((0.0, 0.0),) * 3))
    can_move = ranges.is_turning or any(low < high for low, high in map(ranges.of, SHIFTS))
    always = "always " if can_move else ""
    for index, where in PLANES.items():
        best = max(ranges.best_margin(index, side, required) for side in (1, -1))
        if best <= SINGULAR * size:
            words = (
                f"the required box is {always}on or across the singular plane δ{index + 1} = 0: "
                f"{because} {where}"
            )
            yield Refutation("singular plane", words)


def _box_beyond_lengths(ranges: Ranges, required: Box) -> Iterator[Refutation]:
    lows, highs = required
    for name, axes in (("l1", (0, 1, 2)), ("d2", (1, 2)), ("d4", (1, 2)), ("l4", (0, 1, 2))):
        most = ranges.length(name)[1]
        half = 0.5 * math.hypot(*(highs[axis] - lows[axis] for axis in axes))
        farthest = max(half, _farthest_corner(ranges, name, axes, required))
        if farthest > most * (1.0 + SPARE):
            limit = LONGEST_LEG if ranges.is_tied(name) else f"{name} maximum"
            words = (
                f"{name} must be {format_number(farthest)} units at the least to get to all of the "
                f"required box, and at most {format_number(most, 6)} units are allowed"
            )
            yield Refutation(limit, words)


def _farthest_corner(ranges: Ranges, name: str, axes: tuple[int, ...], required: Box) -> float:
    """Return how far the farthest corner is from the nearest place of a length's centre."""
    centre: tuple[Pair, ...] = ((0.0, 0.0),) * 3
    if name == "l4":
        centre = (ranges.of("a3x"), ranges.of("a3y"), (0.0, 0.0))
    within = {
        "l1": ranges.arm,
        "d2": largest(ranges.of("b2")),
        "d4": largest(ranges.of("b3")),
        "l4": 0.0,
    }[name]
    away = _farther_sides(ranges, required, centre)
    return math.hypot(*(away[axis] for axis in axes)) - within


def _farther_sides(ranges: Ranges, required: Box, centre: tuple[Pair, ...]) -> list[float]:
    """Return the least distance along each axis from a centre to the farther side of a box."""
    return [
        max(smallest(total(total((end, end), shift), negative(middle))) for end in ends)
        for ends, shift, middle in zip(
            zip(*required, strict=True), map(ranges.of, SHIFTS), centre, strict=True
        )
    ]


def _reach(ranges: Ranges) -> Iterator[Refutation]:
    demanded = ranges.problem.demands.reach
    if demanded is None:
        return
    least = ranges.least_longest_leg
    if least > demanded * (1.0 + SPARE):
        words = (
            f"the longest leg is at least {format_number(least, 6)} units within the bounds, and "
            f"{format_number(demanded, 6)} units are asked for"
        )
        yield Refutation(LONGEST_LEG, words)


def _gap(ranges: Ranges) -> Iterator[Refutation]:
    gap = ranges.problem.start.limits.gap
    if ranges.apart < gap * (1.0 - SPARE):
        words = (
            f"the carriages are at most {format_number(ranges.apart)} units apart within the "
            f"bounds, and the gap is to be {format_number(gap, 6)} units"
        )
        yield Refutation(GAP, words)


def _clearance(ranges: Ranges) -> Iterator[Refutation]:
    """Yield the pairs of legs of which two ends never are as far apart as the legs are to be."""
    problem = ranges.problem
    demanded, volume = problem.demands.clearance, problem.demands.volume
    # All of a smaller workspace may lie where no clearance is demanded.
    if demanded is None or volume is None:
        return
    if volume * (1.0 - SPARE) <= near_singular_volume(ranges, problem.demands.clearance_margin):
        return
    radii = problem.start.limits.leg_radii
    for first, second in PAIRS:
        most = _ends_apart(ranges, first, second) - radii[first - 1] - radii[second - 1]
        if most < demanded * (1.0 - SPARE):
            words = (
                f"legs {first} and {second} keep at most {format_number(most)} of the clearance of "
                f"{format_number(demanded, 6)} units asked for, within the bounds"
            )
            yield Refutation(f"clearance of legs {first} and {second}", words)


def _ends_apart(ranges: Ranges, first: int, second: int) -> float:
    """Return the largest distance of the nearer two ends of a pair of legs."""
    b1x, b1y = ranges.of("b1x"), largest(ranges.of("b1y"))
    match first, second:
        case 1, 4:
            return min(ranges.arm, ranges.distance_a3[1])
        case 1, _:
            other = ranges.of("b2" if second == 2 else "b3")
            return math.hypot(max(b1x[1] - other[0], other[1] - b1x[0]), b1y)
        case 2, 3:
            return ranges.apart
        case _:
            along = ranges.of("b2" if first == 2 else "b3")
            # Legs that share a joint have no clearance to keep.
            return math.inf if smallest(along) == 0.0 else largest(along)


def _amounts(one: float, other: float) -> tuple[str, str]:
    """Return two volumes as text with as many digits as they need to differ, at least four."""
    digits = 4
    while digits < 17 and _amount(one, digits) == _amount(other, digits):
        digits += 1
    return _amount(one, digits), _amount(other, digits)


def _amount(value: float, digits: int) -> str:
    if not 1e3 <= value < 1e9:
        return f"{value:.{digits}g}"
    return f"{value:,.{max(0, digits - 1 - math.floor(math.log10(value)))}f}"
