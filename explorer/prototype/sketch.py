"""Bars and balls in place of the parts, to simulate a design that is too tight for them."""

from __future__ import annotations

from collections.abc import Mapping

import numpy as np

from explorer.mechanism.design import Design
from explorer.numerics.arrays import FloatArray
from explorer.prototype.chains import ON_GUIDE, Chains, joints_of_leg
from explorer.prototype.mass import Mass, ball, bar, total_mass

DEFAULT_RADIUS = 0.01
"""Radius, over the reach, of a leg that has none in the design."""

# Length of a cylinder and of a rod, over the leg's length at home; above a half, so they overlap.
SHARE = 0.55
# Radii over the radius of the leg.
ROD, JOINT, BALL = 0.6, 2.0, 1.2


def leg_radii(design: Design) -> tuple[float, ...]:
    """Return the radii of the four legs, all positive, in design units."""
    return tuple(radius or DEFAULT_RADIUS * design.reach for radius in design.limits.leg_radii)


def sketch_masses(chains: Chains, home_joints: FloatArray, density: float) -> Mapping[str, Mass]:
    """Return the masses of all bodies but the base, in the bodies' frames and design units.

    The joint values at home have the shape (12,); the density is per cubed design unit.
    """
    radii = leg_radii(chains.design)
    masses: dict[str, Mass] = {}
    for leg, radius in enumerate(radii, 1):
        length = SHARE * max(float(joints_of_leg(home_joints, leg)[-1]), radius)
        joint = "carriage" if leg in ON_GUIDE else "cross"
        along = np.array([0.0, 0.0, length])
        masses[f"{joint} {leg}"] = ball(JOINT * radius, np.zeros(3), density)
        masses[f"cylinder {leg}"] = bar(radius, np.zeros(3), along, density)
        masses[f"rod {leg}"] = bar(ROD * radius, -along, np.zeros(3), density)
    points = chains.design.platform_points
    hub = points.mean(axis=0)
    balls = (ball(BALL * r, point, density) for r, point in zip(radii, points, strict=True))
    bars = (bar(r, hub, point, density) for r, point in zip(radii, points, strict=True))
    masses["platform"] = total_mass([*balls, *bars])
    return masses
