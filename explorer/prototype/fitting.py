"""Sizes of parts that fit a design, what to change in one without room, and limits in a pose.

Joints scale with the legs; walls and clearances do not. A leg may be too thin to hold a rod in
its cylinder, or too thick beside its neighbours. A larger unit helps in both cases.
"""

from __future__ import annotations

import math
from collections.abc import Iterator

import msgspec
import numpy as np
from numpy.typing import ArrayLike

from explorer.errors import InputError, TooTightError
from explorer.mechanism.design import Design
from explorer.numerics.arrays import FloatArray
from explorer.numerics.checks import MOST
from explorer.numerics.number_text import format_number
from explorer.prototype.chains import BODIES, LEGS, ON_GUIDE, joints_of_leg
from explorer.prototype.sizes import FIRST_SWING, SECOND_SWING, Sizes

BALL_SWING = math.radians(85.0)
"""Largest angle between a leg and the normal of the platform."""

# A pose at the end of a stroke is within it up to rounding.
_SLACK = 1e-9


def broken_joint_limits(sizes: Sizes, position: ArrayLike, rotation: ArrayLike) -> tuple[str, ...]:
    """Return the limits of actuators, joints and distances that one pose breaks, as sentences.

    Where none is broken, the parts of different legs keep their clearance. It may be kept in other
    poses too, since each leg is taken as thick as capsules about its parts. For the pose see
    `Chains.joints`.
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
        low, high = sizes.carriage_ranges[leg]
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


THICKEST_SHARE = 0.012
"""Largest radius, over the reach, of a leg that has none in the design."""

LARGEST_FACTOR = 1e4
"""Largest factor on the unit that is tried to make a design fit."""


def sizes_of(design: Design) -> Sizes:
    """Return the sizes of a design's parts.

    Legs without a radius in the design get the largest that fits, up to a share of the reach.

    Raises:
        TooTightError: The design is too tight for its parts; the message names the parts, their
            distance and what would fit.
        InputError: The home pose breaks the limits of a leg.
    """
    design = msgspec.structs.replace(design, home=design.home_pose)
    share = 1.0 if all(design.limits.leg_radii) else _fitting_factors(design, 1.0)[0]
    sizes = _sizes(design, 1.0, share or 1.0)
    if sizes.worst is not None:
        raise _refusal(design, sizes.worst)
    for leg in LEGS:
        low, high = sizes.required_stroke(leg)
        # A home pose on a limit is within it, whatever its rounding.
        if not low * (1.0 - 1e-9) <= sizes.home_length(leg) <= high * (1.0 + 1e-9):
            raise InputError(
                f"leg {leg} is {sizes.home_length(leg):.4g} mm long at home, but its limits are "
                f"{low:.4g} to {high:.4g} mm; choose another home"
            )
    home = design.home_pose
    for problem in broken_joint_limits(sizes, home.position, home.rotation):
        raise InputError(f"at home {problem}; choose another home")
    return sizes


def _sizes(design: Design, unit: float, share: float, all_of: bool = False) -> Sizes:
    """Return sizes with factors on the unit and on the radii that are open, or on `all_of` them."""
    larger = msgspec.structs.replace(design, unit_mm=unit * design.unit_mm)
    open_radius = THICKEST_SHARE * design.reach * share
    factor = share if all_of else 1.0
    radii = (factor * radius or open_radius for radius in design.limits.leg_radii)
    return Sizes(larger, tuple(radius * larger.unit_mm for radius in radii))


def _fitting_factors(
    design: Design, unit: float, all_of: bool = False
) -> tuple[float | None, float | None]:
    """Return the factors on the radii that fit: the largest up to 1, the smallest from 1 on."""

    def first_fitting(shares: FloatArray) -> float | None:
        fits = (s for s in shares.tolist() if _sizes(design, unit, s, all_of).worst is None)
        return next(fits, None)

    # Thin legs lack room for walls, thick legs room beside each other, so one interval fits.
    return first_fitting(np.geomspace(1.0, 1e-2, 100)), first_fitting(np.geomspace(1.0, 1e2, 100))


def _refusal(design: Design, worst: tuple[str, float, float]) -> TooTightError:
    parts, distance, needed = worst
    if parts.startswith("the radius"):
        text = f"too thin: {parts} is {_mm(distance)} and must be at least {_mm(needed)}"
    else:
        text = f"too tight for the parts: {parts} are {_mm(distance)} apart and need {_mm(needed)}"
    ways: list[str] = []
    factor = _least_unit(design)
    unit = None if factor is None else _round(factor * design.unit_mm, up=True)
    if unit is not None:
        ways.append(f"with a unit of at least {unit:.6g} mm")
    largest_radius = max(design.limits.leg_radii)
    smaller, larger = _fitting_factors(design, 1.0, all_of=True) if largest_radius else (None, None)
    if smaller is not None:
        ways.append(f"with legs of radius at most {_round(smaller * largest_radius, up=False):.6g}")
    elif larger is not None:
        ways.append(f"with legs of radius at least {_round(larger * largest_radius, up=True):.6g}")
    if not ways:
        text += "; no unit makes that fit: take thinner legs, another home, or points farther apart"
        return TooTightError(text, None)
    return TooTightError(f"{text}; it fits {' or '.join(ways)}", unit)


def _least_unit(design: Design) -> float | None:
    """Return the least factor on the unit with which everything fits, None if there is none."""
    share: float | None = 1.0
    largest = min(LARGEST_FACTOR, MOST / design.unit_mm)
    if not all(design.limits.leg_radii):
        # With a huge unit clearances vanish, so open radii are at their largest.
        share = _fitting_factors(design, largest)[0]

    def fits(factor: float) -> bool:
        return share is not None and _sizes(design, factor, share).worst is None

    low, high = 1.0, largest
    if not fits(high):
        return None
    while high > 1.001 * low:
        middle = math.sqrt(low * high)
        low, high = (low, middle) if fits(middle) else (middle, high)
    return high


def _mm(value: float) -> str:
    return f"{value:.3g} mm"


def _round(value: float, up: bool) -> float:
    """Return a value to three digits, rounded up or down."""
    step = 10.0 ** (math.floor(math.log10(value)) - 2)
    whole = math.ceil(value / step) if up else math.floor(value / step)
    return float(f"{whole * step:.6g}")
