"""The masses of bodies in closed form, and the weights that the forces of the actuators need.

Bars and balls stand in for the parts of a prototype, also of a design that is too tight for these.
Units are those of the lengths and the density given.
"""

from __future__ import annotations

import math
from collections.abc import Iterable, Mapping
from dataclasses import dataclass

import numpy as np

from explorer.mechanism.design import Design
from explorer.motion.chains import LEGS, ON_GUIDE, Chains, joints_of_leg
from explorer.motion.weights import MovingBodies
from explorer.numerics.arrays import FloatArray


@dataclass(frozen=True)
class Mass:
    """The mass properties of a rigid body: a positive mass, and its centre (3,) in its frame.

    The inertia (3, 3) is about the centre, along the axes of that frame.
    """

    mass: float
    centre: FloatArray
    inertia: FloatArray


def bar(radius: float, start: FloatArray, end: FloatArray, density: float) -> Mass:
    """Return the mass properties of a round bar between two points (3,), zero if they coincide."""
    along = end - start
    length = float(np.linalg.norm(along))
    mass = density * math.pi * radius**2 * length
    across = mass * (radius**2 / 4.0 + length**2 / 12.0)
    about_axis = mass * radius**2 / 2.0
    axis = along / length if length > 0.0 else np.zeros(3)
    inertia = across * np.eye(3) + (about_axis - across) * np.outer(axis, axis)
    return Mass(mass, 0.5 * (start + end), inertia)


def ball(radius: float, centre: FloatArray, density: float) -> Mass:
    """Return the mass properties of a ball about a point (3,)."""
    mass = density * 4.0 / 3.0 * math.pi * radius**3
    return Mass(mass, centre, 0.4 * mass * radius**2 * np.eye(3))


def total_mass(parts: Iterable[Mass]) -> Mass:
    """Return the mass properties of parts joined as one body; at least one part has a mass."""
    masses = list(parts)
    mass = sum(part.mass for part in masses)
    centre = np.sum([part.mass * part.centre for part in masses], axis=0) / mass
    inertia = np.zeros((3, 3))
    for part in masses:
        off = part.centre - centre
        inertia += part.inertia + part.mass * (off @ off * np.eye(3) - np.outer(off, off))
    return Mass(mass, centre, inertia)


DENSITY = 1240.0
"""The default density of the bodies, in kg/m³: that of printed PLA."""

DEFAULT_RADIUS = 0.01
"""Radius, over the reach, of a leg that has none in the design."""

# Length of a cylinder and of a rod, over the leg's length at home; above a half, so they overlap.
SHARE = 0.55
# Radii over the radius of the leg.
ROD, JOINT, BALL = 0.6, 2.0, 1.2


def leg_radii(design: Design) -> tuple[float, ...]:
    """Return the radii of the four legs, all positive, in design units."""
    return tuple(radius or DEFAULT_RADIUS * design.reach for radius in design.limits.leg_radii)


def with_payload(design: Design, masses: Mapping[str, Mass]) -> Mapping[str, Mass]:
    """Return the masses of the bodies, the design's payload being part of the platform."""
    centre = 1e-3 * design.unit_mm * np.array(design.payload.centre)
    payload = Mass(design.payload.mass_kg, centre, 1e-6 * np.diag(design.payload.inertia_kg_mm2))
    return {**masses, "platform": total_mass([masses["platform"], payload])}


def moving_bodies(
    design: Design, masses: Mapping[str, Mass], *, payload: bool = True
) -> MovingBodies:
    """Return the masses of bodies and, unless it is left out, of the design's payload.

    The masses of the bodies are in their own frames, in metres and kilograms, such as
    `explorer.prototype.assembly.Prototype.masses`. Cylinders and rods have their centres on their
    axes, and principal axes along those of their frames; the centre of a cross is at its joint.
    """
    metres = 1e-3 * design.unit_mm
    rows: list[list[float]] = []
    for leg, axis in zip(LEGS, Chains.of(design).mounts[:, :, 0], strict=True):
        cylinder, rod = masses[f"cylinder {leg}"], masses[f"rod {leg}"]
        first = masses[f"{'carriage' if leg in ON_GUIDE else 'cross'} {leg}"]
        slides, turns = (first.mass, 0.0) if leg in ON_GUIDE else (0.0, first.inertia[0, 0])
        height, back = cylinder.centre[2] / metres, -rod.centre[2] / metres
        about = np.diag(cylinder.inertia + rod.inertia) / metres**2
        about = about + cylinder.mass * height**2 * np.array([1.0, 1.0, 0.0])
        of_leg = slides + cylinder.mass + rod.mass, rod.mass, back, cylinder.mass * height
        rows.append([*of_leg, *about, turns / metres**2, *axis])
    own = masses["platform"]
    bodies = MovingBodies(legs=rows).with_mass(
        own.mass, own.centre / metres, own.inertia / metres**2
    )
    return bodies.with_payload(design) if payload else bodies


def bar_masses(design: Design, density: float) -> Mapping[str, Mass]:
    """Return the masses of all bodies but the base, as bars with the legs' radii in place of parts.

    They are in the bodies' own frames, in metres and kilograms; the density is in kg/m³.
    """
    chains, home, metres = Chains.of(design), design.home_pose, 1e-3 * design.unit_mm
    joints = metres * chains.joints(home.position, home.rotation)
    radii = [metres * radius for radius in leg_radii(design)]
    masses: dict[str, Mass] = {}
    for leg, radius in zip(LEGS, radii, strict=True):
        length = SHARE * max(float(joints_of_leg(joints, leg)[-1]), radius)
        joint = "carriage" if leg in ON_GUIDE else "cross"
        along = np.array([0.0, 0.0, length])
        masses[f"{joint} {leg}"] = ball(JOINT * radius, np.zeros(3), density)
        masses[f"cylinder {leg}"] = bar(radius, np.zeros(3), along, density)
        masses[f"rod {leg}"] = bar(ROD * radius, -along, np.zeros(3), density)
    points = metres * design.platform_points
    hub = points.mean(axis=0)
    balls = (ball(BALL * r, point, density) for r, point in zip(radii, points, strict=True))
    bars = (bar(r, hub, point, density) for r, point in zip(radii, points, strict=True))
    masses["platform"] = total_mass([*balls, *bars])
    return masses
