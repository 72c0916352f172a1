"""The sizes of a design's parts, in millimetres, and the places that are too tight for them."""

from __future__ import annotations

import itertools
from collections.abc import Iterator, Mapping
from dataclasses import dataclass
from functools import cached_property

import numpy as np

from explorer.mechanism.design import LENGTHS, Design
from explorer.mechanism.home import home_pose
from explorer.prototype.chains import LEGS, ON_GUIDE, Chains
from explorer.prototype.dimensions import CLEARANCE, THINNEST, GuideSizes, LegSizes, Stroke
from explorer.prototype.sketch import platform_points
from explorer.workspace.limits.constraints import constraints
from explorer.workspace.limits.region import region_of
from explorer.workspace.slices.volume import bounds


@dataclass(frozen=True)
class Sizes:
    """The sizes of all parts of a design.

    Attributes:
        design: The manipulator; its `unit_mm` sets the scale.
        radii: Radii of the four legs, in millimetres.
    """

    design: Design
    radii: tuple[float, ...]

    @cached_property
    def guide(self) -> GuideSizes:
        """The dimensions of the guide."""
        return GuideSizes(max(self.radii[leg - 1] for leg in ON_GUIDE))

    @cached_property
    def legs(self) -> tuple[LegSizes, ...]:
        """The dimensions of the four legs."""
        found: list[LegSizes] = []
        for leg, radius in zip(LEGS, self.radii, strict=True):
            own = LegSizes(radius, 0.0)
            bottom = self.guide.eye if leg in ON_GUIDE else own.bottom
            found.append(LegSizes(radius, bottom + own.plate))
        return tuple(found)

    @cached_property
    def chains(self) -> Chains:
        """The chains of bodies and joints."""
        return Chains.of(self.design)

    @cached_property
    def home_joints(self) -> tuple[float, ...]:
        """The joint values of the chains at home, in design units and radians."""
        home = home_pose(self.design)
        return tuple(self.chains.joints(home.position, home.rotation).tolist())

    def at_home(self, leg: int) -> float:
        """Return the length of a leg at home."""
        return self.home_joints[3 * leg - 1] * self.design.unit_mm

    def carriage_at_home(self, leg: int) -> float:
        """Return the place on the guide of a leg's carriage at home."""
        return self.home_joints[3 * leg - 3] * self.design.unit_mm

    def asked(self, leg: int) -> Stroke:
        """Return the stroke that the limits of a leg allow."""
        low, high = self.design.length_range(LENGTHS[leg - 1])
        return Stroke(low * self.design.unit_mm, high * self.design.unit_mm)

    @cached_property
    def strokes(self) -> tuple[Stroke, ...]:
        """The strokes of the four actuators."""
        return tuple(
            own.stroke(self.asked(leg), self.at_home(leg))
            for leg, own in zip(LEGS, self.legs, strict=True)
        )

    @cached_property
    def depth(self) -> float:
        """The distance from the base plane to the base plate."""
        swings = max(self.legs[0].swing, self.legs[3].swing)
        return max(swings, self.guide.eye) + 2.0 * CLEARANCE

    @cached_property
    def base_plate(self) -> float:
        """The thickness of the base plate."""
        return max(1.5 * max(self.radii), 3.0 * THINNEST)

    @cached_property
    def standoff(self) -> float:
        """The distance from the platform plane to its plate, where a rod along it has room."""
        return max(1.1 * own.cup for own in self.legs) + 2.0 * CLEARANCE

    @cached_property
    def platform_plate(self) -> float:
        """The thickness of the platform plate."""
        return max(1.2 * max(self.radii), 3.0 * THINNEST)

    def nearest_to_a1(self, leg: int) -> float:
        """Return the least distance of a leg's carriage from a1; a pillar stands between."""
        own = self.radii[leg - 1]
        sweep = self.legs[0].sweep(self.guide.eye)
        return sweep + 2.0 * CLEARANCE + self.guide.pillar + own

    def carriage_range(self, leg: int) -> Stroke:
        """Return the range along the guide of the carriage of a leg.

        It is the range of the guide's limits or, without any, the range that the workspace
        needs, on the carriage's own side of a1.
        """
        return self._carriage_ranges[leg]

    @cached_property
    def _carriage_ranges(self) -> Mapping[int, Stroke]:
        return {leg: self._carriage_range(leg) for leg in ON_GUIDE}

    def _carriage_range(self, leg: int) -> Stroke:
        home, nearest = self.carriage_at_home(leg), self.nearest_to_a1(leg)
        low, high = self._asked_of_guide(leg)
        low, high = min(low, home), max(high, home)
        return (
            Stroke(max(low, min(nearest, home)), high)
            if home > 0.0
            else Stroke(low, min(high, max(-nearest, home)))
        )

    def _asked_of_guide(self, leg: int) -> Stroke:
        design, home = self.design, home_pose(self.design)
        if design.limits.guide is not None:
            low, high = design.limits.guide
            return Stroke(low * design.unit_mm, high * design.unit_mm)
        region = region_of(constraints(design, home.rotation))
        shift = float(home.rotation[0, 0]) * (design.b2 if leg == 2 else design.b3)
        if region.is_empty:
            low = high = home.position[0]
        else:
            lows, highs = bounds(region)
            low, high = float(lows[0]), float(highs[0])
        return Stroke((low + shift) * design.unit_mm, (high + shift) * design.unit_mm)

    @cached_property
    def rails(self) -> tuple[Stroke, ...]:
        """The ends of the shaft, or of two shafts if a1 is between the carriages."""
        found: dict[bool, list[float]] = {}
        for leg in ON_GUIDE:
            room = self.radii[leg - 1] + CLEARANCE + self.guide.pillar
            low, high = self.carriage_range(leg)
            found.setdefault(self.carriage_at_home(leg) > 0.0, []).extend((low - room, high + room))
        return tuple(Stroke(min(ends), max(ends)) for ends in found.values())

    @property
    def between_carriages(self) -> float:
        """The least distance between the centres of the carriages."""
        return self.radii[1] + self.radii[2] + CLEARANCE

    def tight_places(self) -> Iterator[tuple[str, float, float]]:
        """Yield the tight places: the parts, their distance, and the distance that they need."""
        for leg, own in zip(LEGS, self.legs, strict=True):
            # A leg this thin has the thinnest wall.
            yield f"the radius of leg {leg}", own.radius, 2.0 * THINNEST + CLEARANCE
        d1, d3 = (self.carriage_at_home(leg) for leg in ON_GUIDE)
        yield "carriages 2 and 3 at home", abs(d1 - d3), self.between_carriages
        for leg, place in ((2, d1), (3, d3)):
            joint = f"carriage {leg} and the universal joint at a1"
            yield f"{joint} at home", abs(place), self.nearest_to_a1(leg)
        a3y = abs(self.design.a3[1]) * self.design.unit_mm
        needed = self.legs[3].sweep(self.guide.eye) + CLEARANCE + self.guide.eye
        yield "the guide and the universal joint at a3", a3y, needed
        points = platform_points(self.design) * self.design.unit_mm
        for i, j in itertools.combinations(range(4), 2):
            apart = float(np.linalg.norm(points[i] - points[j]))
            needed = self.legs[i].cup + self.legs[j].cup + CLEARANCE
            yield f"the ball joints at b{i + 1} and b{j + 1}", apart, needed
        for leg, own in zip(LEGS, self.legs, strict=True):
            # The stroke needs room on both sides of the home length.
            yield f"the ends of leg {leg} at home", self.at_home(leg), 1.1 * own.dead

    @cached_property
    def worst(self) -> tuple[str, float, float] | None:
        """The tight place that lacks the largest share of its need, None if everything fits."""
        short = [each for each in self.tight_places() if each[1] < each[2]]
        return max(short, key=lambda each: each[2] / max(each[1], 1e-300), default=None)
