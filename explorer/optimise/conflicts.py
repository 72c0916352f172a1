"""Limits that leave no room for the volume that is demanded, found before a search starts.

A limit is in conflict with the volume if a bound in closed form shows that no design within the
bounds of the variables can have it. Other volumes may still be impossible.
"""

from __future__ import annotations

import math
from collections.abc import Iterator
from typing import NamedTuple

import msgspec
import numpy as np

from explorer.mechanism.design import LENGTHS, Design, Limits
from explorer.mechanism.design_file import PRESETS
from explorer.numerics.arrays import FloatArray
from explorer.numerics.number_text import UNITS, Unit, format_apart
from explorer.optimise import problem as problems

# Excess over its bound that makes a volume impossible, as a share: searches have tolerances.
SPARE, ROUNDING = 1e-6, 1e-9

BOX_LIMIT = "box"
"""Name of the limit on the position."""

PAPER_BOX = PRESETS["paper-optimal"].limits.box


class Conflict(NamedTuple):
    """A limit, such as "box" or "l1 maximum", and a clause on what it makes impossible."""

    limit: str
    message: str


def find_conflicts(problem: problems.Problem, unit: Unit = UNITS) -> tuple[Conflict, ...]:
    """Return why no design within the bounds has the volume demanded, one conflict a limit."""
    wanted, found = problem.demands.volume or 0.0, dict[str, Conflict]()
    cubed = unit.to_power(3, wanted)
    for limit, words, most in volume_bounds(problem, unit):
        if most < wanted * (1.0 - SPARE):
            room, demanded = format_apart((most, wanted), 4, cubed.number)
            amounts = f"at most {room} of the {demanded} {cubed.name} asked for"
            found.setdefault(limit, Conflict(limit, f"{words} {amounts}"))
    return tuple(found.values())


def paper_box(problem: problems.Problem) -> problems.Box | None:
    """Return the box of the paper's optimum, or None if it is too small for the demands too."""
    boxed = msgspec.structs.replace(problem, start=problems.with_box(problem.start, PAPER_BOX))
    is_too_small = any(conflict.limit == BOX_LIMIT for conflict in find_conflicts(boxed))
    return None if is_too_small else PAPER_BOX


def without_limit(design: Design, limit: str) -> Design | None:
    """Return a design without one limit, its home where it was; None if it has no such limit.

    The limit is named as in a conflict or a `DesignStartError`. A maximum becomes the reach.
    """
    name = limit.partition(" ")[0]
    lengths = LENGTHS if limit == problems.MAXIMA else {name}.intersection(LENGTHS)
    free = {length: (getattr(design.limits, length)[0], None) for length in lengths}
    if name in (BOX_LIMIT, "guide", problems.SWING_LIMIT):
        free[name] = getattr(Limits(), name)
    lifted = design.with_limits(**free)
    return None if lifted == design else msgspec.structs.replace(lifted, home=design.home_pose)


def volume_bounds(
    problem: problems.Problem, unit: Unit = UNITS
) -> Iterator[tuple[str, str, float]]:
    """Yield upper bounds of the volume: the limit, its words with a verb, and the most."""
    start, limits, rotation = problem.start, problem.start.limits, problem.start.home_pose.rotation
    bounds = {each.name: (each.low, each.high) for each in problem.variables}

    def of(name: str) -> FloatArray:
        """Return the ends between which a design variable lies, shape (2,)."""
        return np.array(bounds.get(name) or (problems.start_value(start, name),) * 2)

    farthest = math.hypot(*(np.abs(of(name)).max() for name in ("a3x", "a3y")))
    reach = min(bounds.get(problems.REACH, (0.0, farthest))[1], problem.demands.reach or math.inf)
    if limits.box is not None:
        lows, highs = limits.box
        yield BOX_LIMIT, "the box holds", math.prod(np.subtract(highs, lows))
    # Least height of b4 over the centre of each ball, on the home's side of the base plane.
    rises = [start.home_signs[2] * rotation[2, axis] * of(f"b1{'xy'[axis]}") for axis in (0, 1)]
    areas: list[float] = []
    for name, height in (("l4", 0.0), ("l1", float(sum(rise.min() for rise in rises)))):
        limit, radius, fixed = "longest leg", reach, getattr(limits, name)[1]
        if problems.REACH not in bounds and fixed is not None:
            limit, radius = f"{name} maximum", fixed
        is_halved = limits.margin is not None and height >= -ROUNDING * radius
        areas.append((0.5 if is_halved else 1.0) * math.pi * radius**2)
        words = f"the {limit} of {unit.text(radius, 6)} leaves room for"
        yield limit, words, 4.0 / 3.0 * radius * areas[-1]
    if limits.guide is not None:
        first, last = limits.guide
        # The carriages are apart by the base's x of b3 − b2, which a free yaw may make zero.
        apart = of("b3") - of("b2")[::-1]
        is_turning = len({*bounds.get(problems.YAW, ())}) > 1
        least = 0.0 if is_turning or apart[0] * apart[1] <= 0.0 else float(np.abs(apart).min())
        free = max(0.0, last - first - abs(rotation[0, 0]) * least)
        words = f"a guide from {unit.number(first, 6)} to {unit.text(last, 6)} leaves room for"
        yield "guide", words, free * min(areas)
