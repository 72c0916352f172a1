"""Typical values of precision and stiffness, for a design that does not state its own.

They are those of a small machine with ball screws and milled parts. A design without values of its
own starts with them, and the page and the commands say so.
"""

from __future__ import annotations

import msgspec

from explorer.mechanism.design import Design
from explorer.mechanism.machine import Six, Tolerances
from explorer.mechanism.pose import Triple

ERROR = 0.05
"""Typical positioning error of an actuator to either side, in mm."""
STIFFNESS = 1000.0
"""Typical stiffness of an actuator, in N/mm."""
OUTER, INNER = 12.0, 10.0
"""Typical diameters of the struts' tubes, in mm."""
LENGTH, TILT = 0.1, 0.1
"""Typical tolerances of lengths in mm and of tilts in degrees."""

ERRORS: Six = (ERROR, ERROR, ERROR, ERROR, ERROR, ERROR)
STIFFNESSES: Six = (STIFFNESS, STIFFNESS, STIFFNESS, STIFFNESS, STIFFNESS, STIFFNESS)


def typical_machine(design: Design) -> tuple[Design, tuple[str, ...]]:
    """Return a design with typical values in place of those that it leaves out, and words for each.

    Errors of the actuators count as left out if all six are zero, tolerances if all 23 are. There
    are no words for a design that states everything.
    """
    assumed: list[str] = []
    actuators, struts, tolerances = design.actuators, design.struts, design.tolerances
    if not any(actuators.error_mm):
        actuators = msgspec.structs.replace(actuators, error_mm=ERRORS)
        assumed.append(f"errors of the actuators {ERROR:g} mm")
    if actuators.stiffness_n_mm is None:
        actuators = msgspec.structs.replace(actuators, stiffness_n_mm=STIFFNESSES)
        assumed.append(f"stiffness of the actuators {STIFFNESS:g} N/mm")
    if struts.outer_mm is None:
        struts = msgspec.structs.replace(struts, outer_mm=OUTER, inner_mm=INNER)
        assumed.append(f"struts of tube {OUTER:g} × {INNER:g} mm, {struts.modulus_gpa:g} GPa")
    if not tolerances.values(design.unit_mm).any():
        each: Triple = (LENGTH, LENGTH, LENGTH)
        tolerances = Tolerances(each, each, each, (TILT, TILT), each, each, each, each)
        assumed.append(f"tolerances {LENGTH:g} mm and {TILT:g}°")
    filled = msgspec.structs.replace(
        design, actuators=actuators, struts=struts, tolerances=tolerances
    )
    return filled, tuple(assumed)
