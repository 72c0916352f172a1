"""The limits of the prototype in a pose: strokes, carriages, swings, legs that come close."""

from __future__ import annotations

import math
from collections.abc import Iterator

import numpy as np
from numpy.typing import ArrayLike

from explorer.numerics.arrays import FloatArray
from explorer.numerics.number_text import format_number
from explorer.prototype.chains import BODIES, LEGS, ON_GUIDE, joints_of_leg
from explorer.prototype.dimensions import FIRST_SWING, SECOND_SWING
from explorer.prototype.sizes import Sizes

BALL_SWING = math.radians(85.0)
"""Largest angle between a leg and the normal of the platform."""

# A pose at the end of a stroke is within it up to rounding.
_SLACK = 1e-9


def broken_joint_limits(sizes: Sizes, position: ArrayLike, rotation: ArrayLike) -> tuple[str, ...]:
    """Return the limits of actuators, joints and distances that one pose breaks, as sentences.

    Where none is broken, the parts of different legs keep their clearance. It may be kept in other
    poses too, since each leg is taken as thick as capsules about its parts.

    Args:
        sizes: Sizes of the parts.
        position: Position of b4 in the base frame, shape (3,), in design units.
        rotation: Rotation from platform to base, shape (3, 3).

    Raises:
        InputError: a pose that is not finite or not a rotation.
    """
    chains = sizes.chains
    joints = chains.joints(position, rotation)
    places = chains.places(joints, position, rotation)
    broken = [*_strokes(sizes, joints), *_swings(joints)]
    normal = -chains.platform_side * places.rotation[-1][:, 2]
    for leg in LEGS:
        along = places.rotation[BODIES.index(f"rod {leg}")][:, 2]
        lean = math.acos(float(np.clip(along @ normal, -1.0, 1.0)))
        if lean > BALL_SWING + _SLACK:
            broken.append(f"the ball joint at b{leg} leans {_angle_beyond(lean, BALL_SWING)}")
    for axes, distance, needed in sizes.leg_distances(position, rotation):
        if distance < needed * (1.0 - _SLACK):
            apart = format_number(distance, size=needed)
            broken.append(f"{axes} are {apart} mm apart and need {format_number(needed)} mm")
    return tuple(broken)


def _strokes(sizes: Sizes, joints: FloatArray) -> Iterator[str]:
    unit = sizes.design.unit_mm
    for leg, (low, high) in zip(LEGS, sizes.strokes, strict=True):
        length = float(joints_of_leg(joints, leg)[-1]) * unit
        if not low * (1.0 - _SLACK) <= length <= high * (1.0 + _SLACK):
            stroke = f"{format_number(low)} to {format_number(high)} mm"
            yield f"leg {leg} is {format_number(length, size=high)} mm long, its stroke is {stroke}"
    places = [float(joints_of_leg(joints, leg)[0]) * unit for leg in ON_GUIDE]
    for leg, place in zip(ON_GUIDE, places, strict=True):
        low, high = sizes.carriage_range(leg)
        if not low - _SLACK * abs(low) <= place <= high + _SLACK * abs(high):
            rail = f"{format_number(low)} to {format_number(high)} mm"
            at = format_number(place, size=high - low)
            yield f"carriage {leg} is at {at} mm, its rail is {rail}"
    distance, needed = places[0] - places[1], sizes.between_carriages
    at_home = sizes.carriage_at_home(2) - sizes.carriage_at_home(3)
    if math.copysign(1.0, at_home) * distance < needed * (1.0 - _SLACK):
        apart = format_number(abs(distance), size=needed)
        yield f"carriages 2 and 3 are {apart} mm apart and need {format_number(needed)} mm"


def _swings(joints: FloatArray) -> Iterator[str]:
    for leg, point in ((1, "a1"), (4, "a3")):
        first, second, _ = np.abs(joints_of_leg(joints, leg)).tolist()
        for angle, most in ((first, FIRST_SWING), (second, SECOND_SWING)):
            if angle > most + _SLACK:
                yield f"the universal joint at {point} leans {_angle_beyond(angle, most)}"
    for leg in ON_GUIDE:
        _, angle, _ = np.abs(joints_of_leg(joints, leg)).tolist()
        if angle > 0.5 * math.pi:
            yield f"leg {leg} leans {_angle_beyond(angle, 0.5 * math.pi)} about the guide"


def _angle_beyond(angle: float, most: float) -> str:
    return f"{math.degrees(angle):.1f}°, and {math.degrees(most):.0f}° is the most"
