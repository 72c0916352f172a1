"""Which of a design's limits a pose breaks (design.md, section 6, but for interference)."""

from __future__ import annotations

import math
from dataclasses import dataclass

from explorer.mechanism.design import JOINTS, LENGTHS, TOLERANCE, Design
from explorer.numerics.arrays import FloatArray
from explorer.workspace.limits.constraints import (
    CARRIAGE_ORDER,
    GAP,
    angle_between,
    demanded_order,
    joint_cones,
    legs,
)


@dataclass(frozen=True)
class Violation:
    """A broken limit.

    Attributes:
        limit: What is limited: a joint, "gap |d1 − d3|", "carriage order", "box x",
            "margin κ1", "swing a1", ….
        value: What it is, in design units; of a swing in degrees, of the order d3 − d1.
        bound: What it may be at the most, or at the least.
        above: Whether the value exceeds the bound, rather than falling short of it.
    """

    limit: str
    value: float
    bound: float
    above: bool

    def __str__(self) -> str:
        if self.limit == CARRIAGE_ORDER:
            sign = "negative" if self.above else "positive"
            text = f"{self.limit}: d3 − d1 = {self.value:.4g}, but it is {sign} in the home pose"
            return text.replace("-", "−")
        if self.limit.startswith("margin") and self.bound == 0.0:
            sign = "negative" if self.above else "positive"
            text = f"{self.limit} = {self.value:.4g}, but it is {sign} in the home mode"
            return text.replace("-", "−")
        relation = "above its maximum" if self.above else "below its minimum"
        unit = "°" if self.limit.startswith("swing") else ""
        text = f"{self.limit} = {self.value:.4g}{unit} is {relation} {self.bound:.4g}{unit}"
        return text.replace("-", "−")


def violations(
    design: Design,
    position: FloatArray,
    rotation: FloatArray,
    joints: FloatArray,
    margin: FloatArray,
    home_signs: tuple[int, int, int],
    order: int | None = None,
) -> tuple[Violation, ...]:
    """Return the limits that a pose breaks, in the order of the design file; none if ().

    Args:
        design: The manipulator.
        position: b4 in the base frame, shape (3,).
        rotation: Platform to base, shape (3, 3).
        joints: Those of the pose, shape (6,).
        margin: Those of the pose, shape (3,).
        home_signs: The sign triple of the home pose.
        order: The sign of d3 − d1 to demand, 0 for either; the one that the design demands
            if None.
    """
    limits, tolerance = design.limits, design.tolerance
    found: list[Violation] = []

    def check(name: str, value: float, low: float | None, high: float | None) -> None:
        if low is not None and value < low - tolerance:
            found.append(Violation(name, value, low, above=False))
        if high is not None and value > high + tolerance:
            found.append(Violation(name, value, high, above=True))

    q = dict(zip(JOINTS, joints.tolist(), strict=True))
    for name in LENGTHS:
        check(name, q[name], *design.length_range(name))
    if limits.guide is not None:
        check("d1", q["d1"], *limits.guide)
        check("d3", q["d3"], *limits.guide)
    check(GAP, abs(q["d1"] - q["d3"]), limits.gap, None)
    demanded = demanded_order(design) if order is None else order
    if demanded:
        low, high = (0.0, None) if demanded > 0 else (None, 0.0)
        check(CARRIAGE_ORDER, q["d3"] - q["d1"], low, high)
    if limits.box is not None:
        for axis, value, low, high in zip("xyz", position.tolist(), *limits.box, strict=True):
            check(f"box {axis}", value, low, high)
    if limits.margin is not None:
        for index, (value, sign) in enumerate(zip(margin.tolist(), home_signs, strict=True), 1):
            # In the home mode a margin lies on the home's side of zero.
            low, high = (limits.margin, None) if sign > 0 else (None, -limits.margin)
            check(f"margin κ{index}", value, low, high)
    cones = joint_cones(design)
    if cones:
        vectors = legs(design, position, rotation)
        for cone in cones:
            # A leg without a length at home has no direction to swing about.
            angle = math.pi
            if cone.axis is not None:
                axis = rotation @ cone.axis if cone.in_platform else cone.axis
                angle = float(angle_between(vectors[cone.leg - 1], axis))
            if angle > cone.half_angle + TOLERANCE or cone.axis is None:
                swing, most = math.degrees(angle), math.degrees(cone.half_angle)
                found.append(Violation(f"swing {cone.joint}", swing, most, above=True))
    return tuple(found)
