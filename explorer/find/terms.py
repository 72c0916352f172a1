"""The numbers of a requirement as a search needs them, and machines as rows of numbers.

Lengths are over the diagonal of the required box, angles in radians, forces in newtons.
"""

from __future__ import annotations

import itertools
import math
from dataclasses import dataclass
from typing import Any, NamedTuple

import msgspec
import numpy as np

from explorer.errors import InputError
from explorer.find import machine_values as m
from explorer.find.machine_values import MachineValues
from explorer.find.requirement import Requirement
from explorer.mechanism.configuration import tool_position
from explorer.mechanism.design import LENGTHS, Design, Limits, Swing
from explorer.mechanism.machine import Actuators, Payload, Tool
from explorer.mechanism.pose import (
    Pose,
    Triple,
    rotation_from_yaw_pitch_roll,
    yaw_pitch_roll_from_rotation,
)
from explorer.numerics.arrays import FloatArray
from explorer.prototype.sizes import CLEARANCE, FIRST_SWING, THINNEST_LEG, GuideSizes, LegSizes

# Millimetres in one unit of the designs that are made.
UNIT_MM = 10.0


class Parts(NamedTuple):
    """Least distances that the parts of a machine need, see `explorer.prototype.sizes`.

    Attributes:
        dead: What the longest length of each leg lacks to twice the shortest one, shape (4,).
        carriages: Distance of the two carriages.
        from_a1: Distance of a carriage from a1.
        from_guide: Distance of a3 from the guide.
        balls: Distance of two of the points b1 to b4.
    """

    dead: FloatArray
    carriages: float
    from_a1: float
    from_guide: float
    balls: float

    @staticmethod
    def of(diameter_mm: float, scale_mm: float) -> Parts:
        """Return the distances over a scale for legs of a diameter, or for the thinnest legs."""
        radius = 0.5 * diameter_mm or THINNEST_LEG
        guide, own = GuideSizes(radius), LegSizes(radius, 0.0)
        ends = [own.bottom, guide.eye, guide.eye, own.bottom]
        dead = [LegSizes(radius, end + own.plate).dead for end in ends]
        sweep = LegSizes(radius, own.bottom + own.plate).sweep(guide.eye)
        return Parts(
            dead=np.array(dead) / scale_mm,
            carriages=(2.0 * radius + CLEARANCE) / scale_mm,
            from_a1=(sweep + 2.0 * CLEARANCE + guide.pillar + radius) / scale_mm,
            from_guide=(sweep + CLEARANCE + guide.eye) / scale_mm,
            balls=(2.0 * own.cup + CLEARANCE) / scale_mm,
        )


# Share by which machines exceed the distances that their parts need, and the cosine of a lean.
ROOM = 0.01


def part_slacks(parts: Parts, home: MachineValues) -> list[FloatArray]:
    """Return the slacks of the distances that the parts need, for machines at home."""
    x, keeps = home.x, 1.0 + ROOM
    d1, d3 = (end[0] for end in home.ends[1:3])
    rows = [m.size(d3 - d1) - keeps * parts.carriages]
    rows += [m.size(each) - keeps * parts.from_a1 for each in (d1, d3)]
    rows.append(m.size(x[m.A3Y]) - keeps * parts.from_guide)
    points = [(x[m.B1X], x[m.B1Y]), (x[m.B2], 0.0), (x[m.B3], 0.0), (0.0, 0.0)]
    for (a, b), (c, d) in itertools.combinations(points, 2):
        rows.append(np.sqrt((a - c) ** 2 + (b - d) ** 2) - keeps * parts.balls)
    # Legs 1 and 4 may lean so far from the normal of the base.
    cosine = math.cos(FIRST_SWING) + ROOM
    return rows + [m.size(home.legs[i][2]) / home.lengths[i] - cosine for i in (0, 3)]


@dataclass(frozen=True)
class Terms:
    """The limits of a requirement; infinite or zero where nothing is demanded.

    Attributes:
        requirement: The requirement.
        scale_mm: Diagonal of the box, in millimetres.
        edges: Edges of the box, shape (3,).
        tilt: Largest tilt.
        ratio, longest: Largest ratio of the lengths of a leg, and longest leg.
        margin: Least margin.
        swing: Half-angle of the cones; π without one.
        distance: Least distance of the axes of two legs; 0 for none.
        spread: Factor on the usual sizes of machines, above 1 for thick legs and short strokes.
        parts: Sizes of the parts where they must fit; None otherwise.
    """

    requirement: Requirement
    scale_mm: float
    edges: FloatArray
    tilt: float
    ratio: float
    longest: float
    margin: float
    swing: float
    distance: float
    spread: float
    parts: Parts | None

    @staticmethod
    def of(requirement: Requirement) -> Terms:
        """Return the terms of a requirement.

        Raises:
            InputError: A speed of the tool or a time is demanded of actuators without a speed.
        """
        legs, tool, scale = requirement.legs, requirement.tool, requirement.diagonal_mm
        if (tool.speed_mm_s or tool.turning_deg_s) and legs.speed_mm_s is None:
            raise InputError("tool.speed_mm_s and tool.turning_deg_s need legs.speed_mm_s")
        if requirement.move_s and not (legs.speed_mm_s or legs.acceleration_mm_s2):
            raise InputError("move_s needs legs.speed_mm_s or legs.acceleration_mm_s2")

        def most(value: float | None, unit: float = 1.0) -> float:
            return math.inf if value is None else value / unit

        distance, ratio = (legs.diameter_mm + legs.apart_mm) / scale, most(legs.ratio)
        # No leg is shorter than the least edge allows with a ratio of its lengths.
        least = 0.0 if legs.ratio is None else min(requirement.box_mm) / scale / (1.0 - 1.0 / ratio)
        return Terms(
            requirement=requirement,
            scale_mm=scale,
            edges=np.array(requirement.box_mm) / scale,
            tilt=math.radians(requirement.tilt_deg),
            ratio=ratio,
            longest=most(legs.longest_mm, scale),
            margin=requirement.least_margin_mm / scale,
            swing=math.radians(requirement.swing_deg or 180.0),
            distance=distance,
            spread=max(1.0, 0.5 * least, 6.0 * distance),
            parts=Parts.of(legs.diameter_mm, scale) if requirement.buildable else None,
        )

    def values(self, x: Any, poses: FloatArray) -> MachineValues:
        """Return the values of machines (..., n) in poses over the box."""
        return MachineValues(x, self.edges, poses)


def row_of(design: Design, terms: Terms) -> FloatArray:
    """Return a design as a machine, shape (18,), with home's tool at the centre of the box."""
    scale, home = terms.scale_mm / design.unit_mm, design.home_pose
    x = np.ones(m.VARIABLES)
    x[: m.HX] = np.array(design.variables) / scale
    x[m.HX : m.BOX_YAW] = np.divide(tool_position(home, design.tool.position), scale)
    x[m.BOX_YAW] = math.radians(design.required_yaw)
    x[m.YAW : m.TX] = np.radians(yaw_pitch_roll_from_rotation(home.rotation))
    x[m.TX : m.TILT] = np.array(design.tool.position) / scale
    return x


def design_of(
    x: FloatArray, terms: Terms, ranges: FloatArray, name: str, base: Design | None = None
) -> Design:
    """Return a machine as a design that states what its requirement asks for.

    Lowest and highest lengths of the legs, shape (4, 2), become its limits. What the requirement
    does not speak of is that of a base.
    """
    requirement = terms.requirement
    legs, payload = requirement.legs, requirement.payload
    unit = UNIT_MM if base is None else base.unit_mm
    scale = terms.scale_mm / unit

    def point(values: FloatArray) -> Triple:
        a, b, c = (scale * values).tolist()
        return a, b, c

    def six(value: float | None) -> Any:
        return None if value is None else (value,) * 6

    own_centre = point(np.array(payload.centre_mm) / terms.scale_mm)
    rotation = rotation_from_yaw_pitch_roll(np.degrees(x[m.YAW : m.TX]))
    centre, tool = x[m.HX : m.BOX_YAW], x[m.TX : m.TILT]
    half = 0.5 * terms.edges
    swing = Swing(*(requirement.swing_deg,) * 6)
    radius = 0.5 * legs.diameter_mm / unit
    ends: list[Any] = (scale * ranges).tolist()
    lengths: dict[str, Any] = dict(zip(LENGTHS, map(tuple[Any, ...], ends), strict=True))
    limits = Limits(
        **lengths,
        margin=requirement.least_margin_mm / unit,
        leg_radii=(radius, radius, radius, radius),
        swing=swing,
    )
    fields: dict[str, Any] = {
        "name": name,
        "unit_mm": unit,
        "a3": tuple((scale * x[m.A3X : m.B1X]).tolist()),
        "b1": tuple((scale * x[m.B1X : m.B2]).tolist()),
        "b2": float(scale * x[m.B2]),
        "b3": float(scale * x[m.B3]),
        "limits": limits,
        "home": Pose.of(scale * centre - rotation @ (scale * tool), rotation),
        "tool": Tool(point(tool)),
        "payload": Payload(payload.mass_kg, own_centre, payload.force_n),
        "gravity": requirement.gravity,
        "actuators": Actuators(
            push_n=six(legs.push_n),
            pull_n=six(legs.pull_n),
            error_mm=six(legs.error_mm),
            stiffness_n_mm=six(legs.stiffness_n_mm),
            speed_mm_s=six(legs.speed_mm_s),
            acceleration_mm_s2=six(legs.acceleration_mm_s2),
        ),
        "required_box": (point(centre - half), point(centre + half)),
        "required_yaw": math.degrees(float(x[m.BOX_YAW])),
    }
    return Design(**fields) if base is None else msgspec.structs.replace(base, **fields)
