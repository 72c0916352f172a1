"""Names of the fields of a design file in the messages of the page.

The editor of a file needs the names of its fields; the user of a slider needs the words beside it.
"""

from __future__ import annotations

from explorer.errors import DesignError, ExplorerError
from explorer.mechanism.design import LENGTHS
from explorer.mechanism.machine import Tolerances

SWINGS = {
    "a1": "U joint",
    "a3": "U joint",
    "b1": "ball",
    "b2": "ball",
    "b3": "ball",
    "b4": "ball",
}
"""The kind of each joint in which a leg may swing, by its point."""

FIELD_WORDS = {
    "unit_mm": "The unit",
    "node_step": "The step of the nodes",
    "limits.guide": "The guide",
    "limits.guide low": "The end of the guide, \u201cd least\u201d,",
    "limits.guide high": "The end of the guide, \u201cd most\u201d,",
    "limits.gap": "The gap of the carriages",
    "limits.carriage_order": "The order of the carriages",
    "limits.margin": "The margin",
    "limits.leg_radii": "The radius of a leg",
    "limits.box": "The box for b4",
    "limits.box lows": "The lower corner of the box for b4",
    "limits.box highs": "The upper corner of the box for b4",
    **{f"limits.box {axis}": f"The box for b4 along {axis}" for axis in "xyz"},
    "tool.position": "The tool point",
    "payload.mass_kg": "The mass of the payload",
    "payload.centre": "The centre of the payload",
    "payload.force_n": "The force on the tool",
    "gravity": "The direction of gravity",
    "actuators.push_n": "The push of an actuator",
    "actuators.pull_n": "The pull of an actuator",
    "actuators.error_mm": "The error of an actuator",
    "actuators.stiffness_n_mm": "The stiffness of an actuator",
    **{f"tolerances.{name}": "A tolerance" for name in Tolerances.__struct_fields__},
    "struts.outer_mm": "The outer diameter of the struts",
    "struts.inner_mm": "The inner diameter of the struts",
    "struts.modulus_gpa": "Young's modulus of the struts",
    "struts.stress_mpa": "The largest stress of the struts",
    "struts.moment_nm": "The largest moment of the struts",
    "guide.force_n": "The largest force on the guide",
    "guide.moment_nm": "The largest moment on the guide",
    **{f"limits.{name}": f"The length {name}" for name in LENGTHS},
    **{f"limits.{name} minimum": f"The least length {name}" for name in LENGTHS},
    **{f"limits.{name} maximum": f"The greatest length {name}" for name in LENGTHS},
    **{f"limits.swing.{name}": f"The swing of the {name} {kind}" for name, kind in SWINGS.items()},
}
"""Name of each field at the beginning of a sentence."""


def message_of(error: ExplorerError) -> str:
    """Return the message of an error in the words of the page."""
    if isinstance(error, DesignError) and error.field in FIELD_WORDS:
        return error.message_about(FIELD_WORDS[error.field])
    return str(error)
