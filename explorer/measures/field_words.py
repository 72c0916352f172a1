"""Errors of a design in the words of its fields, for people who see no design file."""

from __future__ import annotations

from explorer.errors import DesignError, ExplorerError
from explorer.mechanism.machine import Tolerances
from explorer.workspace.limits.table import LIMITS

FIELD_WORDS = {
    "name": "The name",
    "unit_mm": "The unit",
    "node_step": "The step of the nodes",
    "required_box": "The required box",
    "limits.leg_radii": "The radius of a leg",
    "tool.position": "The tool point",
    "payload.mass_kg": "The mass of the payload",
    "payload.centre": "The centre of the payload",
    "payload.inertia_kg_mm2": "The inertia of the payload",
    "payload.force_n": "The force on the tool",
    "gravity": "The direction of gravity",
    "actuators.push_n": "The push of an actuator",
    "actuators.pull_n": "The pull of an actuator",
    "actuators.continuous_n": "The continuous force of an actuator",
    "actuators.speed_mm_s": "The speed of an actuator",
    "actuators.acceleration_mm_s2": "The acceleration of an actuator",
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
    **{
        f"limits.{limit.path}{part}": words
        for limit in LIMITS
        for part, words in limit.subjects.items()
    },
}
"""Name of each field at the beginning of a sentence."""


def message_of(error: ExplorerError) -> str:
    """Return the message of an error with the words of the field that it is about."""
    if isinstance(error, DesignError) and error.field in FIELD_WORDS:
        return error.message_about(FIELD_WORDS[error.field])
    return str(error)
