"""Outer bounds of joints and position that the limits of a design leave, in any orientation.

Legs 1 and 4 keep b4 in two balls, legs 2 and 3 near the guide, and the bounds of the guide near
its ends. The bounds here are those of the boxes around these bodies: nothing that the limits allow
lies outside, but not all inside is allowed.
"""

from __future__ import annotations

import functools
import math
from typing import NamedTuple

import msgspec

from explorer.mechanism.design import Design, Pair


class PossibleRanges(NamedTuple):
    """Outer bounds (low, high), in design units; low exceeds high where limits contradict.

    Attributes:
        joints: Of the joints, in the order of `JOINTS`.
        position: Of x, y and z of b4 in the base frame.
    """

    joints: tuple[Pair, Pair, Pair, Pair, Pair, Pair]
    position: tuple[Pair, Pair, Pair]


@functools.lru_cache(64)
def possible_ranges(design: Design) -> PossibleRanges:
    """Return outer bounds of what the limits of a design allow, in any orientation."""
    limits = design.limits
    (l1, d2, d4, l4) = (design.length_range(name) for name in ("l1", "d2", "d4", "l4"))
    b1, b2, b3 = math.hypot(*design.b1), abs(design.b2), abs(design.b3)
    (a3x, a3y), box = design.a3, limits.box or ((-math.inf,) * 3, (math.inf,) * 3)
    # |p + R b1| is at most the longest l1, and |p - a3| the longest l4.
    about_a1 = l1[1] + b1
    from_guide = min(d2[1] + b2, d4[1] + b3)
    guide = limits.guide or (-math.inf, math.inf)
    x = _within(
        (-about_a1, about_a1),
        (a3x - l4[1], a3x + l4[1]),
        (guide[0] - b2, guide[1] + b2),
        (guide[0] - b3, guide[1] + b3),
        (box[0][0], box[1][0]),
    )
    across = min(about_a1, from_guide)
    y = _within((-across, across), (a3y - l4[1], a3y + l4[1]), (box[0][1], box[1][1]))
    height = min(across, l4[1])
    z = _within((-height, height), _side(design), (box[0][2], box[1][2]))
    farthest = (_farthest(x), _farthest(y), _farthest(z))
    from_a1 = min(math.hypot(*farthest), about_a1)
    from_axis = math.hypot(*farthest[1:])
    carriages = [
        _within(
            (x[0] - b, x[1] + b),
            # The point of the platform is as far from b1, which leg 1 holds, at every pose.
            (-l1[1] - apart, l1[1] + apart),
            guide,
        )
        for b, apart in ((b2, _to_b1(design, design.b2)), (b3, _to_b1(design, design.b3)))
    ]
    from_a3 = math.hypot(
        *(max(abs(e - a) for e in ends) for ends, a in ((x, a3x), (y, a3y))), farthest[2]
    )
    joints = (
        (l1[0], min(l1[1], from_a1 + b1)),
        carriages[0],
        (d2[0], min(d2[1], from_axis + b2)),
        carriages[1],
        (d4[0], min(d4[1], from_axis + b3)),
        (l4[0], min(l4[1], from_a3)),
    )
    return PossibleRanges(joints, (x, y, z))


def without_guide(design: Design) -> Design:
    """Return a design whose guide is unbounded."""
    limits = msgspec.structs.replace(design.limits, guide=None)
    return msgspec.structs.replace(design, limits=limits)


def without_box(design: Design) -> Design:
    """Return a design without a box for b4."""
    limits = msgspec.structs.replace(design.limits, box=None)
    return msgspec.structs.replace(design, limits=limits)


def _farthest(ends: Pair, point: float = 0.0) -> float:
    return max(abs(end - point) for end in ends)


def _within(*ranges: Pair) -> Pair:
    return max(low for low, _ in ranges), min(high for _, high in ranges)


def _side(design: Design) -> Pair:
    """Return the range of z that the smallest margin leaves; δ3 is z."""
    margin = design.limits.margin
    if margin is None:
        return -math.inf, math.inf
    return (margin, math.inf) if design.home_pose.position[2] > 0.0 else (-math.inf, -margin)


def _to_b1(design: Design, b: float) -> float:
    return math.hypot(design.b1[0] - b, design.b1[1])
