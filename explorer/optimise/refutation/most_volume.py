"""Upper bounds of the volume that the limits of a problem leave, whatever its variables become.

Each limit is a solid of positions, so that no workspace is larger than that solid is at most
within the bounds of the variables: a box, a ball, the lens that two balls share, a slab of the
guide. A least margin δ3 leaves only the part on the home's side of the base plane. No workspace is
measured here, so all bounds take milliseconds.
"""

from __future__ import annotations

import math
from collections.abc import Iterator
from typing import NamedTuple

import numpy as np

from explorer.mechanism.design import LENGTHS, Pair
from explorer.numerics.arrays import FloatArray
from explorer.numerics.number_text import format_number
from explorer.optimise.demands import Box
from explorer.optimise.problem import REACH
from explorer.optimise.refutation.cut_box import cut_volume
from explorer.optimise.refutation.ranges import Ranges, product, smallest
from explorer.singularity.ellipsoids import planes_of_singularity

# Below this sine between the two lines they are parallel: δ2 is zero wherever b4 is.
PARALLEL = 1e-12

LONGEST_LEG = "longest leg"
"""Name of the limit on all lengths that are tied to the reach."""


class Ceiling(NamedTuple):
    """An upper bound of the volume.

    Attributes:
        limit: Limit that it comes from: "box", "guide", "longest leg" or such as "l1 maximum".
        words: Subject and verb of a sentence on it, such as "the box holds".
        volume: Bound, in cubed design units.
        place: Part of the limit whose volume is the bound, "" for all of it.
    """

    limit: str
    words: str
    volume: float
    place: str = ""


def ceilings(ranges: Ranges) -> Iterator[Ceiling]:
    """Yield upper bounds of the volume of every workspace within the bounds."""
    yield from _of_box(ranges)
    yield from _of_lengths(ranges)
    yield from _of_guide(ranges)


def margin_planes(ranges: Ranges, least: float | None) -> list[tuple[FloatArray, float]]:
    """Return the half-spaces normal · p >= least that margins leave at any yaw in bounds.

    Args:
        ranges: The intervals of the problem.
        least: Least margin, with the signs of home, in design units; None for no demand.
    """
    if least is None:
        return []
    normals = planes_of_singularity(ranges.problem.start.home_pose.rotation)
    return [
        (sign * normal, least)
        for index, (normal, sign) in enumerate(zip(normals, ranges.signs, strict=True))
        if index == 2 or not ranges.is_turning
        if float(np.linalg.norm(normal)) > PARALLEL
    ]


def near_singular_volume(ranges: Ranges, margin: float) -> float:
    """Return an upper bound of the volume in which some margin is less than this."""
    limits = ranges.problem.start.limits
    own, box = limits.margin, limits.box
    if own is not None and margin <= own:
        return 0.0
    width = 2.0 * margin if own is None else margin - own
    radius = min(ranges.length("l1")[1], ranges.length("l4")[1])
    slope = math.hypot(*map(smallest, ranges.along[1:]))
    widths = width * (2.0 + 1.0 / slope) if slope > PARALLEL else math.inf
    near = math.pi * radius**2 * widths
    if box is None or own is None or ranges.is_turning:
        return near
    left = [cut_volume(box, margin_planes(ranges, least)) for least in (own, margin)]
    return min(near, left[0] - left[1])


def _of_box(ranges: Ranges) -> Iterator[Ceiling]:
    limits = ranges.problem.start.limits
    if limits.box is None:
        return
    yield Ceiling("box", "the box holds", _volume_of(limits.box))
    places: list[str] = []
    box, planes = limits.box, margin_planes(ranges, limits.margin)
    if limits.guide is not None:
        box = _within_guide(ranges, box, limits.guide)
        places.append("within the guide")
    if planes:
        least = limits.margin or 0.0
        places.append(
            f"where every margin is at least {format_number(least, 6)} units"
            if least
            else "where the margins have the signs of home"
        )
    if places:
        yield Ceiling("box", "the box holds", cut_volume(box, planes), " and ".join(places))


def _volume_of(box: Box) -> float:
    return math.prod(high - low for low, high in zip(*box, strict=True))


def _within_guide(ranges: Ranges, box: Box, guide: Pair) -> Box:
    """Return the part of a box that leaves both carriages on the guide."""
    (low, *lows), (high, *highs) = box
    for name in ("b2", "b3"):
        ahead = product(ranges.of(name), ranges.along[0])
        low, high = max(low, guide[0] - ahead[1]), min(high, guide[1] - ahead[0])
    return (low, lows[0], lows[1]), (max(low, high), highs[0], highs[1])


def _of_lengths(ranges: Ranges) -> Iterator[Ceiling]:
    of_reach: list[float] = []
    for name in LENGTHS:
        least, most = ranges.length(name)
        if name in ("l1", "l4"):
            volume = ball_above(most, least, _least_height(ranges, name))
        else:
            ends = min(ranges.length(end)[1] for end in ("l1", "l4"))
            volume = 2.0 * ends * disc_above(most, least, _least_height(ranges, name))
        if ranges.is_tied(name):
            of_reach.append(volume)
        else:
            yield Ceiling(
                f"{name} maximum",
                f"{name} of at most {format_number(most, 6)} units leaves",
                volume,
            )
    if all(map(ranges.is_tied, ("l1", "l4"))):
        of_reach.append(_lens(ranges))
    elif not any(map(ranges.is_tied, ("l1", "l4"))):
        l1, l4 = (ranges.length(name)[1] for name in ("l1", "l4"))
        words = (
            f"l1 of at most {format_number(l1, 6)} units together with l4 of at most "
            f"{format_number(l4, 6)} units leaves"
        )
        yield Ceiling("l1 maximum", words, _lens(ranges))
    if of_reach:
        words = f"a longest leg of at most {format_number(ranges.most_reach, 6)} units leaves"
        yield Ceiling(LONGEST_LEG, words, min(of_reach))


def _lens(ranges: Ranges) -> float:
    """Return the largest volume of the lens that the balls of l1 and l4 share.

    Where l4 is tied to the reach |a3|, its ball moves away as it grows; ball and lens are still
    largest at the largest reach.
    """
    one, other = ranges.length("l1")[1], ranges.length("l4")[1]
    is_following = REACH not in ranges.problem.names and ranges.is_tied("l1")
    away = ranges.most_reach if is_following else ranges.distance_a3[0]
    apart = max(0.0, away - ranges.arm)
    if apart >= one + other:
        return 0.0
    smaller = min(one, other)
    if apart <= abs(one - other):
        whole = 4.0 / 3.0 * math.pi * smaller**3
    else:
        both, gap = one + other, one - other
        rest = apart**2 + 2.0 * apart * both - 3.0 * gap**2
        whole = math.pi * (both - apart) ** 2 * rest / (12.0 * apart)
    is_halved = ranges.arm_height == (0.0, 0.0) and ranges.problem.start.limits.margin is not None
    return 0.5 * whole if is_halved else whole


def _least_height(ranges: Ranges, name: str) -> float:
    """Return the least height of positions over the centre of a length's limit.

    It is the least that the bounds allow, and upwards is the home's side of the base plane.
    """
    margin = ranges.problem.start.limits.margin
    if margin is None:
        return -math.inf
    match name:
        case "l1":
            height = ranges.arm_height
        case "l4":
            height = (0.0, 0.0)
        case _:
            height = product(ranges.of("b2" if name == "d2" else "b3"), ranges.along[2])
    up = float(ranges.signs[2])
    return margin + min(up * end for end in height)


def ball_above(radius: float, hole: float, foot: float) -> float:
    """Return the volume of a ball about 0 with z >= foot, less that of a smaller ball there."""

    def part(r: float) -> float:
        low = min(max(foot, -r), r)
        return math.pi * (r - low) ** 2 * (2.0 * r + low) / 3.0

    return part(radius) - part(min(hole, radius))


def disc_above(radius: float, hole: float, foot: float) -> float:
    """Return the area of a disc about 0 with z >= foot, less that of a smaller disc there."""

    def part(r: float) -> float:
        low = min(max(foot, -r), r)
        return r * r * math.acos(low / r) - low * math.sqrt(r * r - low * low) if r > 0.0 else 0.0

    return part(radius) - part(min(hole, radius))


def _of_guide(ranges: Ranges) -> Iterator[Ceiling]:
    guide = ranges.problem.start.limits.guide
    if guide is None:
        return
    apart = smallest(ranges.span) * smallest(ranges.along[0])
    free = max(0.0, guide[1] - guide[0] - apart)
    area = min(
        disc_above(ranges.length(name)[1], 0.0, _least_height(ranges, name)) for name in LENGTHS
    )
    words = (
        f"a guide from {format_number(guide[0], 6)} to {format_number(guide[1], 6)} units leaves"
    )
    yield Ceiling("guide", words, free * area)
