"""Whether a design can be built: sizes of parts that fit, what would fit, and limits in a pose.

Joints scale with the legs; walls and clearances do not. A leg may be too thin to hold a rod in
its cylinder, or too thick beside its neighbours. A larger unit helps in both cases: what fits a
design with one unit fits it with every larger one. Thinner legs only give room, down to the
thinnest that hold a rod.
"""

from __future__ import annotations

import itertools
import math
from collections.abc import Callable, Iterator
from dataclasses import dataclass

import msgspec
import numpy as np
from numpy.typing import ArrayLike

from explorer.errors import InputError
from explorer.mechanism.configuration import Configuration
from explorer.mechanism.design import LENGTHS, Design
from explorer.mechanism.home import STEPS
from explorer.mechanism.pose import Pose
from explorer.motion.chains import BODIES, LEGS, ON_GUIDE, joints_of_leg
from explorer.numerics.arrays import FloatArray, lengths_of
from explorer.numerics.checks import MOST
from explorer.numerics.number_text import drop_rounding, format_apart, format_number
from explorer.prototype.sizes import (
    FIRST_SWING,
    SECOND_SWING,
    SLACK,
    THINNEST_LEG,
    Sizes,
    StrokeRange,
)
from explorer.workspace.limits.valid_poses import poses_are_valid

BALL_SWING = math.radians(85.0)
"""Largest angle between a leg and the normal of the platform."""


def broken_joint_limits(sizes: Sizes, position: ArrayLike, rotation: ArrayLike) -> tuple[str, ...]:
    """Return the limits of actuators, joints and distances that one pose breaks, as sentences.

    Where none is broken, the parts of different legs keep their clearance. It may be kept in other
    poses too, since each leg is taken as thick as capsules about its parts. For the pose see
    `Chains.joints`.
    """
    joints = sizes.chains.joints(position, rotation)
    broken = [*_strokes(sizes, joints), *_swings(sizes, joints, position, rotation)]
    for axes, distance, needed in sizes.leg_distances(position, rotation):
        if distance < needed * (1.0 - SLACK):
            apart, need = _beyond(distance, needed)
            broken.append(f"{axes} are {apart} mm apart and need {need} mm")
    return tuple(broken)


def _strokes(sizes: Sizes, joints: FloatArray) -> Iterator[str]:
    unit = sizes.design.unit_mm
    for leg, (low, high) in zip(LEGS, sizes.strokes, strict=True):
        length = float(joints_of_leg(joints, leg)[-1]) * unit
        if not low * (1.0 - SLACK) <= length <= high * (1.0 + SLACK):
            own, least, most = _beyond(length, low, high)
            yield f"leg {leg} is {own} mm long, its stroke is {least} to {most} mm"
    places = [float(joints_of_leg(joints, leg)[0]) * unit for leg in ON_GUIDE]
    for leg, place in zip(ON_GUIDE, places, strict=True):
        low, high = sizes.carriage_ranges[leg]
        if not low - SLACK * abs(low) <= place <= high + SLACK * abs(high):
            at, first, last = _beyond(place, low, high)
            yield f"carriage {leg} is at {at} mm, its rail is {first} to {last} mm"
    distance, needed = places[0] - places[1], sizes.between_carriages
    at_home = sizes.carriage_at_home(2) - sizes.carriage_at_home(3)
    if math.copysign(1.0, at_home) * distance < needed * (1.0 - SLACK):
        apart, need = _beyond(abs(distance), needed)
        yield f"carriages 2 and 3 are {apart} mm apart and need {need} mm"


def _beyond(length: float, *bounds: float) -> list[str]:
    """Return a length and the bounds that it exceeds as numbers that differ."""
    size = max(map(abs, bounds))
    return format_apart((drop_rounding(length, size), *bounds), 4, format_number)


def _swings(
    sizes: Sizes, joints: FloatArray, position: ArrayLike, rotation: ArrayLike
) -> Iterator[str]:
    for leg, point in ((1, "a1"), (4, "a3")):
        first, second, _ = np.abs(joints_of_leg(joints, leg)).tolist()
        for angle, most in ((first, FIRST_SWING), (second, SECOND_SWING)):
            if angle > most + SLACK:
                yield f"the universal joint at {point} leans {_angle_beyond(angle, most)}"
    for leg in ON_GUIDE:
        _, angle, _ = np.abs(joints_of_leg(joints, leg)).tolist()
        if angle > 0.5 * math.pi:
            yield f"leg {leg} leans {_angle_beyond(angle, 0.5 * math.pi)} about the guide"
    places = sizes.chains.places(joints, position, rotation)
    normal = -sizes.chains.platform_side * places.rotation[-1][:, 2]
    for leg in LEGS:
        along = places.rotation[BODIES.index(f"rod {leg}")][:, 2]
        lean = math.acos(float(np.clip(along @ normal, -1.0, 1.0)))
        if lean > BALL_SWING + SLACK:
            yield f"the ball joint at b{leg} leans {_angle_beyond(lean, BALL_SWING)}"


def _angle_beyond(angle: float, most: float) -> str:
    return f"{math.degrees(angle):.1f}°, and {math.degrees(most):.0f}° is the most"


THICKEST_SHARE = 0.012
"""Largest radius, over the reach, of a leg that has none in the design."""

LARGEST_FACTOR = 1e4
"""Largest factor on the unit that is tried to make a design fit."""

# Number of homes that are tried, the nearest first.
HOMES = 24


@dataclass(frozen=True)
class Buildability:
    """Whether a machine can be built with its parts.

    Attributes:
        sizes: Sizes of the parts. Legs without a radius in the design have the largest that fits,
            up to a share of the reach, or the thinnest if none fits.
        problems: Clauses on what does not fit at home, and by how much; none if all fits.
        remedy: Design in which all fits, with the least unit and, if the joints cannot take the
            home pose, with a near home; None if there is none, or if all fits.
        advice: Clause on that, and on radii of the legs that would fit; "" if all fits.
    """

    sizes: Sizes
    problems: tuple[str, ...] = ()
    remedy: Design | None = None
    advice: str = ""

    @property
    def short_legs(self) -> tuple[int, ...]:
        """The legs whose limits ask for more than the stroke of one rod in its cylinder."""
        return tuple(
            leg
            for leg, stroke in zip(LEGS, self.sizes.strokes, strict=True)
            if not stroke.covers(self.sizes.required_stroke(leg))
        )

    @property
    def within_strokes(self) -> Design | None:
        """The design with the strokes of its short legs as their limits.

        None if none is short, or if a cylinder is too long for its rod to have any stroke.
        """
        design, limits = self.sizes.design, dict[str, StrokeRange]()
        for leg in self.short_legs:
            low, high = (end / design.unit_mm for end in self.sizes.strokes[leg - 1])
            limits[LENGTHS[leg - 1]] = StrokeRange(_round(low, up=True), _round(high, up=False))
        has_strokes = limits and all(low < high for low, high in limits.values())
        return design.with_limits(**limits) if has_strokes else None


def buildability(design: Design) -> Buildability:
    """Return whether a machine can be built with its parts, and what would make it fit."""
    design = msgspec.structs.replace(design, home=design.home_pose)
    # The larger the radii of legs that have none, the less room; the thinnest need the least.
    thinner = max(1.0, THICKEST_SHARE * design.reach * design.unit_mm / THINNEST_LEG)
    factor = _least(lambda f: _sizes(design, open_share=1.0 / f).worst is None, 1.0, thinner)
    sizes = _sizes(design, open_share=0.0 if factor is None else 1.0 / factor)
    problems = tuple(_problems(sizes))
    if not problems:
        return Buildability(sizes)
    remedy = _mend(sizes)
    return Buildability(sizes, problems, remedy, _advice(design, remedy))


def sizes_of(design: Design) -> Sizes:
    """Return the sizes of a design's parts; see `Buildability.sizes`.

    Raises:
        InputError: The machine cannot be built; the message says why, and what would fit.
    """
    built = buildability(design)
    if built.problems:
        raise InputError(f"too tight for the parts: {'; '.join(built.problems)}; {built.advice}")
    return built.sizes


def _sizes(design: Design, unit: float = 1.0, open_share: float = 0.0) -> Sizes:
    """Return sizes with a factor on the unit.

    Legs without a radius have a share of the largest one, and at least the least one.
    """
    larger = msgspec.structs.replace(design, unit_mm=unit * design.unit_mm)
    thickest = open_share * THICKEST_SHARE * design.reach * larger.unit_mm
    radii = (larger.unit_mm * radius for radius in design.limits.leg_radii)
    return Sizes(larger, tuple(radius or max(thickest, THINNEST_LEG) for radius in radii))


def _problems(sizes: Sizes) -> Iterator[str]:
    """Yield the obstacles to assembling parts of these sizes in the home pose."""
    if sizes.worst is not None:
        parts, *lengths = sizes.worst
        distance, needed = format_apart(lengths, 3)
        if parts.startswith("the radius"):
            yield f"{parts} is {distance} mm and must be at least {needed} mm"
        else:
            yield f"{parts} are {distance} mm apart and need {needed} mm"
    for leg in LEGS:
        low, high = sizes.required_stroke(leg)
        # A home pose on a limit is within it, whatever its rounding.
        if not low * (1.0 - SLACK) <= sizes.home_length(leg) <= high * (1.0 + SLACK):
            length, least, most = format_apart((sizes.home_length(leg), low, high), 4)
            yield (
                f"leg {leg} is {length} mm long at home, but its limits are {least} to {most} mm"
            )
    home = sizes.design.home_pose
    for swing in _swings(sizes, sizes.home_joints, home.position, home.rotation):
        yield f"at home {swing}"


def _mend(sizes: Sizes) -> Design | None:
    """Return a design whose parts do not fit with the least unit, and a near home if it must."""
    design = sizes.design
    most = min(LARGEST_FACTOR, 0.99 * MOST / design.unit_mm)
    has_room = not any(_problems(_sizes(design, most)))
    homes = [design.home_pose] if has_room else _near_homes(design)

    def fitting(unit: float) -> Design | None:
        moved = (msgspec.structs.replace(design, home=home) for home in homes)
        fits = (each for each in moved if not any(_problems(_sizes(each, unit))))
        return next(fits, None)

    factor = _least(lambda unit: fitting(unit) is not None, 1.0, most)
    if factor is None:
        return None
    unit_mm = design.unit_mm
    if factor > 1.0:
        unit_mm = _roundest(
            lambda each: fitting(each / design.unit_mm) is not None, factor * unit_mm, up=True
        )
    remedy = fitting(unit_mm / design.unit_mm)
    return remedy and msgspec.structs.replace(remedy, unit_mm=unit_mm)


def _near_homes(design: Design) -> list[Pose]:
    """Return homes within the limits whose legs may lean as they do, the nearest first.

    They have the orientation and the mode of the design's own home; positions are those of a grid.
    """
    home, reach = design.home_pose, design.reach
    lows, highs = design.limits.box or ((-reach,) * 3, (reach,) * 3)
    axes = [np.linspace(*ends, STEPS + 2)[1:-1] for ends in zip(lows, highs, strict=True)]
    positions = np.array([*itertools.product(*axes)])
    positions = positions[poses_are_valid(design, positions, home.rotation)]
    legs = Configuration(design, positions, home.rotation).points.legs()
    upright = np.abs(legs[:, [0, 3], 2]) >= math.cos(FIRST_SWING) * lengths_of(legs[:, [0, 3]])
    positions = positions[upright.all(axis=-1)]
    nearest = np.argsort(lengths_of(positions - home.position), kind="stable")[:HOMES]
    return [Pose((x, y, z), home.quaternion) for x, y, z in positions[nearest].tolist()]


def _least(fits: Callable[[float], bool], low: float, high: float) -> float | None:
    """Return the least factor of a range that fits, if all above one that fits do; None if none."""
    if fits(low):
        return low
    if not fits(high):
        return None
    while high > (1.0 + 1e-6) * low:
        middle = math.sqrt(low * high)
        low, high = (low, middle) if fits(middle) else (middle, high)
    return high


def _advice(design: Design, remedy: Design | None) -> str:
    """Return a clause on what would make the parts of a design fit."""
    unit, ways = design.unit_mm, list[str]()
    if remedy is not None:
        larger = f"a unit of at least {remedy.unit_mm:.6g} mm" * (remedy.unit_mm != unit)
        x, y, z = remedy.home_pose.position
        home = f"its home at ({x:.4g}, {y:.4g}, {z:.4g})" * (remedy.home != design.home)
        ways.append(" and ".join(filter(None, (larger, home))))
    radii = [radius * unit for radius in design.limits.leg_radii if radius]
    if radii:
        ways += _fitting_radii(design, min(radii), max(*radii, THINNEST_LEG))
    if ways:
        return f"it fits with {' or '.join(ways)}"
    return "no unit makes that fit: take thinner legs, another home, or points farther apart"


def _fitting_radii(design: Design, thinnest: float, thickest: float) -> Iterator[str]:
    """Yield the radii that stated ones may have so that the parts fit; nothing if none do.

    The thinnest of the stated radii and the largest one to try are in millimetres.
    """

    def fits(most: float) -> bool:
        least, unit = THINNEST_LEG, design.unit_mm
        radii = (unit * radius for radius in design.limits.leg_radii)
        within = tuple(radius and min(max(radius, least), most) / unit for radius in radii)
        return not any(_problems(_sizes(design.with_limits(leg_radii=within))))

    factor = _least(lambda f: fits(thickest / f), 1.0, thickest / THINNEST_LEG)
    if factor is None:
        return
    least = f"at least {THINNEST_LEG:.6g} mm" * (thinnest < THINNEST_LEG)
    most = ""
    if factor > 1.0:
        most = f"at most {_roundest(fits, thickest / factor, up=False):.6g} mm"
    yield f"legs of radius {' and '.join(filter(None, (least, most)))}"


def _roundest(fits: Callable[[float], bool], value: float, *, up: bool) -> float:
    """Return the value of three digits next to one that fits, which fits too."""
    nearest = float(f"{value:.3g}")
    return nearest if fits(nearest) else _round(value, up)


def _round(value: float, up: bool) -> float:
    """Return a value to three digits, rounded up or down."""
    step = 10.0 ** (math.floor(math.log10(value)) - 2)
    whole = math.ceil(value / step) if up else math.floor(value / step)
    return float(f"{whole * step:.6g}")
