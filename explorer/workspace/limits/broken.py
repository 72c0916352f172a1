"""The limits of a design that a pose violates, other than the clearances of the legs."""

from __future__ import annotations

import math
from dataclasses import dataclass

from explorer.mechanism.design import JOINTS, LENGTHS, TOLERANCE, Design
from explorer.numerics.arrays import FloatArray
from explorer.numerics.number_text import format_number
from explorer.workspace.limits.constraints import CARRIAGE_ORDER, GAP
from explorer.workspace.limits.joint_cones import angle_between, joint_cones, legs


@dataclass(frozen=True)
class Violation:
    """A limit that a pose violates.

    Attributes:
        limit: Name of the limited quantity: a joint, "gap |d1 − d3|", "carriage order", "box x",
            "margin δ1", "swing a1", ….
        value: Value in design units, of a swing in degrees; of the carriage order d3 − d1.
        bound: Maximum or minimum of the value.
        above: Whether the value exceeds a maximum, rather than falling below a minimum.
    """

    limit: str
    value: float
    bound: float
    above: bool

    def __str__(self) -> str:
        value = format_number(self.value, size=abs(self.bound))
        if self.limit == CARRIAGE_ORDER:
            sign = "negative" if self.above else "positive"
            return f"{self.limit}: d3 − d1 = {value}, but it is {sign} in the home pose"
        if self.limit.startswith("margin") and self.bound == 0.0:
            sign = "negative" if self.above else "positive"
            return f"{self.limit} = {value}, but it is {sign} in the home mode"
        relation = "above its maximum" if self.above else "below its minimum"
        unit = "°" if self.limit.startswith("swing") else ""
        return f"{self.limit} = {value}{unit} is {relation} {format_number(self.bound)}{unit}"


def violations(
    design: Design,
    position: FloatArray,
    rotation: FloatArray,
    joints: FloatArray,
    margin: FloatArray,
    home_signs: tuple[int, int, int],
    order: int | None = None,
) -> tuple[Violation, ...]:
    """Return the limits that a pose violates, in the order of the design file.

    Args:
        design: The manipulator.
        position: b4 in the base frame, shape (3,), in design units.
        rotation: Platform to base, shape (3, 3).
        joints: Joint values of the pose, shape (6,).
        margin: Margins (δ1, δ2, δ3) of the pose, shape (3,).
        home_signs: Sign triple of the home pose.
        order: Sign of d3 − d1 to demand, 0 for either; the design's if None.
    """
    limits, tolerance = design.limits, design.tolerance
    broken: list[Violation] = []

    def check(name: str, value: float, low: float | None, high: float | None) -> None:
        if low is not None and value < low - tolerance:
            broken.append(Violation(name, value, low, above=False))
        if high is not None and value > high + tolerance:
            broken.append(Violation(name, value, high, above=True))

    q = dict(zip(JOINTS, joints.tolist(), strict=True))
    for name in LENGTHS:
        check(name, q[name], *design.length_range(name))
    if limits.guide is not None:
        check("d1", q["d1"], *limits.guide)
        check("d3", q["d3"], *limits.guide)
    check(GAP, abs(q["d1"] - q["d3"]), limits.gap, None)
    demanded = design.demanded_order if order is None else order
    if demanded:
        low, high = (0.0, None) if demanded > 0 else (None, 0.0)
        check(CARRIAGE_ORDER, q["d3"] - q["d1"], low, high)
    if limits.box is not None:
        for axis, value, low, high in zip("xyz", position.tolist(), *limits.box, strict=True):
            check(f"box {axis}", value, low, high)
    if limits.margin is not None:
        for index, (value, sign) in enumerate(zip(margin.tolist(), home_signs, strict=True), 1):
            low, high = (limits.margin, None) if sign > 0 else (None, -limits.margin)
            check(f"margin δ{index}", value, low, high)
    cones = joint_cones(design)
    if cones:
        vectors = legs(design, position, rotation)
        for cone in cones:
            # A leg without a length at home violates its cone in every pose.
            angle = math.pi
            if cone.axis is not None:
                axis = rotation @ cone.axis if cone.in_platform else cone.axis
                angle = float(angle_between(vectors[cone.leg - 1], axis))
            if angle > cone.half_angle + TOLERANCE or cone.axis is None:
                swing, largest = math.degrees(angle), math.degrees(cone.half_angle)
                broken.append(Violation(f"swing {cone.joint}", swing, largest, above=True))
    return tuple(broken)
