"""The weights of the machine's bodies, from their masses, as the forces of the actuators need them.

Centres of mass count by their distance along the leg; their distance from its axis is left out.
"""

from __future__ import annotations

from collections.abc import Mapping

import numpy as np

from explorer.mechanism.design import Design
from explorer.mechanism.machine import Payload
from explorer.prototype.chains import LEGS, ON_GUIDE, Chains
from explorer.prototype.mass import Mass
from explorer.prototype.sketch import sketch_masses
from explorer.statics.weights import Weights


def machine_weights(design: Design, masses: Mapping[str, Mass], *, payload: bool = True) -> Weights:
    """Return the weights of bodies and of the design's payload.

    Args:
        design: The manipulator.
        masses: Masses of the bodies in their own frames, in metres and kilograms, such as
            `explorer.prototype.assembly.Prototype.masses`.
        payload: Whether the design's payload is among them.
    """
    units = 1e3 / design.unit_mm
    x, y, z = (units * masses["platform"].centre).tolist()

    def row(values: list[float]) -> tuple[float, float, float, float]:
        first, second, third, fourth = values
        return first, second, third, fourth

    carried = (design.payload,) if payload else ()
    cylinders = [masses[f"cylinder {leg}"] for leg in LEGS]
    rods = [masses[f"rod {leg}"] for leg in LEGS]
    carriages = [masses[f"carriage {leg}"].mass if leg in ON_GUIDE else 0.0 for leg in LEGS]
    return Weights(
        on_platform=(*carried, Payload(masses["platform"].mass, (x, y, z))),
        carriages=row(carriages),
        cylinders=row([each.mass for each in cylinders]),
        cylinder_centres=row([units * float(each.centre[2]) for each in cylinders]),
        rods=row([each.mass for each in rods]),
        rod_centres=row([-units * float(each.centre[2]) for each in rods]),
    )


def bar_masses(design: Design, density: float) -> Mapping[str, Mass]:
    """Return the masses of bars with the legs' radii in place of parts, in metres and kilograms.

    Args:
        design: The manipulator.
        density: Density of the bars, in kg/m³.
    """
    chains, home, metres = Chains.of(design), design.home_pose, 1e-3 * design.unit_mm
    joints = chains.joints(np.array(home.position), home.rotation)
    masses = sketch_masses(chains, joints, 1.0)
    return {name: each.scaled(metres, density * metres**3) for name, each in masses.items()}
