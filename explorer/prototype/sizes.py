"""The sizes of a design's parts, in millimetres, and the places that may be too tight.

The dimensions of a leg and of the guide follow from one radius each. The radius of a leg is that of
its cylinder; its joints scale with it, the clearance and the thinnest wall do not.
"""

from __future__ import annotations

import itertools
import math
from collections.abc import Iterator, Mapping
from functools import cached_property
from typing import NamedTuple

import numpy as np
from numpy.typing import ArrayLike

from explorer.legs.clearance import PAIRS, leg_axes, pair_rows
from explorer.mechanism.configuration import Configuration
from explorer.mechanism.design import LENGTHS, Design
from explorer.motion.chains import LEGS, ON_GUIDE, Chains, joints_of_leg
from explorer.workspace.workspace import Workspace

CLEARANCE = 0.2
"""Clearance between parts that move against each other."""

THINNEST = 0.5
"""Thinnest wall, and smallest radius of a rod."""

SLACK = 1e-9
"""Share of a length by which rounding may miss it."""

THINNEST_LEG = 2.0 * THINNEST + CLEARANCE
"""Smallest radius of a leg, with the thinnest wall about the thinnest rod."""

FIRST_SWING, SECOND_SWING = math.radians(60.0), math.radians(50.0)
"""Largest angles of a universal joint about its two axes, from the normal of the base plane."""

# Dimensions over the radius of a leg.
_WALL, _SWING, _EYE, _PIN, _NECK, _OVERLAP, _SHAFT = 0.3, 2.6, 1.1, 0.45, 0.45, 3.0, 0.7
# Depth of a cup's rim below the ball's centre, over the ball's radius. The rim is so low that the
# neck can swing to a right angle; a magnet holds the ball.
_RIM = 0.5


class StrokeRange(NamedTuple):
    """The shortest and the longest length of an actuator."""

    shortest: float
    longest: float

    def covers(self, required: StrokeRange) -> bool:
        """Whether it covers a required stroke, but for the last bits."""
        slack = SLACK * required.longest
        return (
            self.shortest <= required.shortest + slack and self.longest >= required.longest - slack
        )


class LegSizes:
    """The dimensions of a leg from its base joint to its ball.

    Args:
        radius: Radius of its cylinder.
        floor: Distance from the base joint to the bottom of the bore.

    Attributes:
        wall, bore, rod: Thickness of walls; radii of the bore and of the rod.
        eye, pin: Radii of the eyes and of the pins of the universal joint.
        inner, outer: Distances from the centre of the universal joint to the faces of its eyes.
        plate: Thickness of eyes and of the cylinder's bottom.
        swing: Radius of a ball about the universal joint that holds its parts, without the leg.
        bottom: Distance from the universal joint to the cylinder's bottom.
        ball, neck, cup: Radii of the ball, of its neck, and of the cup about it.
        rim, end: Distances from the ball's centre back to the rim and to the end of the cup.
        dead: Dead length: the excess of twice the shortest length over the longest one.
    """

    def __init__(self, radius: float, floor: float) -> None:
        self.radius, self.floor = radius, floor
        self.wall = max(_WALL * radius, THINNEST)
        self.bore = radius - self.wall
        self.rod = self.bore - CLEARANCE
        self.eye = _EYE * radius
        self.pin = _PIN * radius
        self.inner = self.eye + 2.0 * CLEARANCE
        self.plate = max(0.5 * radius, 1.2 * THINNEST)
        self.outer = self.inner + self.plate
        self.swing = math.hypot(self.outer, self.eye)
        self.bottom = _SWING * radius + CLEARANCE
        self.ball = radius
        self.neck = _NECK * radius
        self.rim = _RIM * radius
        self.cup = math.sqrt((radius + CLEARANCE) ** 2 - self.rim**2) + self.wall
        self.end = radius + CLEARANCE + 2.0 * self.wall
        self.dead = floor + self.end + _OVERLAP * radius + 2.0 * CLEARANCE

    def sweep(self, height: float) -> float:
        """Return the distance from its joint within which a leaning leg is below a height."""
        return height * math.tan(FIRST_SWING) + self.outer / math.cos(FIRST_SWING)

    def stroke(self, required: StrokeRange, home_length: float) -> StrokeRange:
        """Return the required stroke, or the part of it that a single rod covers.

        A rod no longer than its cylinder can at most double the length of a leg. Of a longer stroke
        it covers a part about the home length, shifted where that part would pass an end.
        """
        shortest = max(
            required.shortest,
            min((2.0 * home_length + self.dead) / 3.0, 0.5 * (required.longest + self.dead)),
        )
        return StrokeRange(shortest, min(required.longest, 2.0 * shortest - self.dead))


class GuideSizes:
    """The dimensions of the guide, given the larger radius of its legs.

    Attributes:
        shaft: Half the side of the square shaft, on which carriages cannot turn.
        sleeve: Radius of a carriage's sleeve, on which a leg turns.
        flange: Radius of a carriage's flanges, which keep the leg on it.
        eye: Outer radius of the eye of a leg.
        pillar: Thickness of the pillars along the guide.
    """

    def __init__(self, radius: float) -> None:
        self.radius = radius
        wall = max(_WALL * radius, THINNEST)
        self.shaft = _SHAFT * radius
        self.sleeve = math.sqrt(2.0) * (self.shaft + CLEARANCE) + wall
        self.flange = self.sleeve + CLEARANCE + 0.5 * wall
        self.eye = self.sleeve + CLEARANCE + wall
        self.pillar = max(0.8 * radius, 2.0 * THINNEST)


# Parts of a leg that are as thick as one capsule: its base joint, its tube and rod, its cup. Rows
# combine the parts of the four legs in all ways.
JOINT, TUBE, CUP = range(3)
COMBINATIONS = np.array([*itertools.product((JOINT, TUBE, CUP), repeat=4)])


class Sizes:
    """The sizes of all parts of a design, in millimetres.

    Args:
        design: The manipulator; its `unit_mm` sets the scale.
        radii: Radii of the four legs.

    Attributes:
        guide, legs: Dimensions of the guide and of the four legs.
        chains: Chains of bodies and joints.
        home_joints: Joint values of the chains at home, in design units and radians, shape (12,).
        strokes: Strokes of the four actuators.
        depth: Distance from the base plane to the base plate.
        base_plate, platform_plate: Thickness of the plates.
        standoff: Distance from the platform plane to its plate, with room for a rod between.
        between_carriages: Least distance between the centres of the carriages.
    """

    def __init__(self, design: Design, radii: tuple[float, ...]) -> None:
        self.design, self.radii = design, radii
        home, thickest = design.home_pose, max(radii)
        self.guide = GuideSizes(max(radii[leg - 1] for leg in ON_GUIDE))
        self.legs = tuple(map(self._leg, LEGS))
        self.chains = Chains.of(design)
        self.home_joints = self.chains.joints(home.position, home.rotation)
        self.strokes = tuple(
            own.stroke(self.required_stroke(leg), self.home_length(leg))
            for leg, own in zip(LEGS, self.legs, strict=True)
        )
        room = max(self.legs[0].swing, self.legs[3].swing, self.guide.eye)
        self.depth = room + 2.0 * CLEARANCE
        self.base_plate = max(1.5 * thickest, 3.0 * THINNEST)
        self.standoff = max(1.1 * own.cup for own in self.legs) + 2.0 * CLEARANCE
        self.platform_plate = max(1.2 * thickest, 3.0 * THINNEST)
        self.between_carriages = radii[1] + radii[2] + CLEARANCE

    def _leg(self, leg: int) -> LegSizes:
        radius = self.radii[leg - 1]
        own = LegSizes(radius, 0.0)
        bottom = self.guide.eye if leg in ON_GUIDE else own.bottom
        return LegSizes(radius, bottom + own.plate)

    def home_length(self, leg: int) -> float:
        """Return the length of a leg in the home pose."""
        return float(joints_of_leg(self.home_joints, leg)[-1]) * self.design.unit_mm

    def carriage_at_home(self, leg: int) -> float:
        """Return the coordinate of a leg's carriage on the guide in the home pose."""
        return float(joints_of_leg(self.home_joints, leg)[0]) * self.design.unit_mm

    def required_stroke(self, leg: int) -> StrokeRange:
        """Return the stroke that the limits of a leg allow."""
        low, high = self.design.length_range(LENGTHS[leg - 1])
        return StrokeRange(low * self.design.unit_mm, high * self.design.unit_mm)

    def nearest_to_a1(self, leg: int) -> float:
        """Return the least distance of a leg's carriage from a1; a pillar stands between."""
        sweep = self.legs[0].sweep(self.guide.eye)
        return sweep + 2.0 * CLEARANCE + self.guide.pillar + self.radii[leg - 1]

    @cached_property
    def carriage_ranges(self) -> Mapping[int, StrokeRange]:
        """The ranges of the carriages along the guide, by their legs.

        A range is that of the guide's limits or, without such limits, the range that the
        workspace needs, on the carriage's side of a1.
        """
        ranges: dict[int, StrokeRange] = {}
        for leg in ON_GUIDE:
            home, nearest = self.carriage_at_home(leg), self.nearest_to_a1(leg)
            low, high = self._required_guide_range(leg)
            if home > 0.0:
                low = max(low, nearest)
            else:
                high = min(high, -nearest)
            ranges[leg] = StrokeRange(min(low, home), max(high, home))
        return ranges

    def _required_guide_range(self, leg: int) -> StrokeRange:
        design, home = self.design, self.design.home_pose
        if design.limits.guide is not None:
            low, high = design.limits.guide
            return StrokeRange(low * design.unit_mm, high * design.unit_mm)
        region = Workspace(design).region
        shift = float(home.rotation[0, 0]) * (design.b2 if leg == 2 else design.b3)
        low, high = region.low, region.high
        if region.is_flat or not low < high:
            low = high = home.position[0]
        return StrokeRange((low + shift) * design.unit_mm, (high + shift) * design.unit_mm)

    @cached_property
    def rails(self) -> tuple[StrokeRange, ...]:
        """The ends of the shaft, or of two shafts if a1 is between the carriages."""
        ends_by_side: dict[bool, list[float]] = {}
        for leg in ON_GUIDE:
            overhang = self.radii[leg - 1] + CLEARANCE + self.guide.pillar
            low, high = self.carriage_ranges[leg]
            ends_by_side.setdefault(self.carriage_at_home(leg) > 0.0, []).extend(
                (low - overhang, high + overhang)
            )
        return tuple(StrokeRange(min(ends), max(ends)) for ends in ends_by_side.values())

    def leg_distances(
        self, position: ArrayLike, rotation: ArrayLike
    ) -> Iterator[tuple[str, float, float]]:
        """Yield the axes of each pair of legs, a distance of them in a pose, and what it must be.

        The parts of a leg lie within three capsules about parts of its axis. Of the capsules of two
        legs those two count that come nearest to each other: the distance is that of their axes,
        and must be the sum of their radii and the clearance of parts. For the arguments see
        `leg_axes`.
        """
        axes = leg_axes(Configuration(self.design, position, rotation)) * self.design.unit_mm
        capsules, radii = np.repeat(axes[:, None], 3, axis=1), np.empty((4, 3))
        for index, (axis, own) in enumerate(zip(axes, self.legs, strict=True)):
            length = float(np.linalg.norm(axis[1] - axis[0]))
            along = (axis[1] - axis[0]) / max(length, 1e-300)
            capsules[index, CUP] = axis[1] - np.outer([own.end, own.rim], along)
            capsules[index, JOINT, 1] = axis[0] + own.floor * along
            radii[index] = own.swing, own.radius, own.cup
            if index + 1 in ON_GUIDE:
                # A ball about the carriage and the eye of the leg.
                capsules[index, JOINT, 1] = axis[0]
                radii[index, JOINT] = np.hypot(self.guide.eye, own.radius)
        rows = capsules[np.arange(4), COMBINATIONS]
        distance, points = np.empty((len(rows), 6)), np.empty((len(rows), 6, 2, 3))
        pair_rows(len(rows), rows, distance, points)
        thick = radii[np.arange(4), COMBINATIONS]
        for pair, (first, second) in enumerate(PAIRS):
            needed = thick[:, first - 1] + thick[:, second - 1] + CLEARANCE
            spare = distance[:, pair] - needed
            if (first, second) == ON_GUIDE:
                # Carriages and eyes lie beside each other, below the cups.
                spare[(COMBINATIONS[:, 1:3] == JOINT).any(axis=1)] = np.inf
            row = int(spare.argmin())
            yield (
                f"the axes of legs {first} and {second}",
                float(distance[row, pair]),
                float(needed[row]),
            )

    def tight_places(self) -> Iterator[tuple[str, float, float]]:
        """Yield places that may be tight: the parts, their distance, and the distance needed."""
        for leg, leg_sizes in zip(LEGS, self.legs, strict=True):
            yield f"the radius of leg {leg}", leg_sizes.radius, THINNEST_LEG
        d1, d3 = (self.carriage_at_home(leg) for leg in ON_GUIDE)
        yield "carriages 2 and 3 at home", abs(d1 - d3), self.between_carriages
        for leg, place in ((2, d1), (3, d3)):
            joint = f"carriage {leg} and the universal joint at a1"
            yield f"{joint} at home", abs(place), self.nearest_to_a1(leg)
        a3y = abs(self.design.a3[1]) * self.design.unit_mm
        needed = self.legs[3].sweep(self.guide.eye) + CLEARANCE + self.guide.eye
        yield "the guide and the universal joint at a3", a3y, needed
        points = self.design.platform_points * self.design.unit_mm
        for i, j in itertools.combinations(range(4), 2):
            distance = float(np.linalg.norm(points[i] - points[j]))
            needed = self.legs[i].cup + self.legs[j].cup + CLEARANCE
            yield f"the ball joints at b{i + 1} and b{j + 1}", distance, needed
        for leg, leg_sizes in zip(LEGS, self.legs, strict=True):
            # The stroke needs room on both sides of the home length.
            yield f"the ends of leg {leg} at home", self.home_length(leg), 1.1 * leg_sizes.dead
        home = self.design.home_pose
        for axes, distance, needed in self.leg_distances(home.position, home.rotation):
            yield f"{axes} at home", distance, needed

    @cached_property
    def worst(self) -> tuple[str, float, float] | None:
        """The place whose need exceeds its distance by the largest factor; None if all fit."""
        tight = [place for place in self.tight_places() if place[1] < place[2] * (1.0 - SLACK)]
        return max(tight, key=lambda place: place[2] / max(place[1], 1e-300), default=None)
