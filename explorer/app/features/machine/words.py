"""The machine of a design in words: what it carries, and what its parts bear."""

from __future__ import annotations

import math

import numpy as np

from explorer.mechanism.design import DOWN, Design
from explorer.mechanism.machine import Actuators, Guide, Payload, Struts, Tool
from explorer.mechanism.pose import Triple
from explorer.numerics.arrays import FloatArray
from explorer.numerics.number_text import format_number

DIRECTIONS: dict[str, Triple] = {
    "down, −z": DOWN,
    "up, +z": (0.0, 0.0, 1.0),
    "along +x": (1.0, 0.0, 0.0),
    "along −x": (-1.0, 0.0, 0.0),
    "along +y": (0.0, 1.0, 0.0),
    "along −y": (0.0, -1.0, 0.0),
}
"""Directions of gravity along the axes of the base, by their names."""

# Difference of two coordinates of unit vectors up to which they are the same but for rounding.
SAME_DIRECTION = 1e-12


DIGITS = 3
"""Significant digits of the numbers in the line."""


def machine_words(design: Design) -> str:
    """Return a line on the machine of a design, such as "Tool 3 units from b4; carries 2 kg"."""
    limits = {
        "actuators": actuator_words(design.actuators),
        "struts": strut_words(design.struts),
        "guide": guide_words(design.guide),
    }
    free = [name for name, words in limits.items() if not words]
    parts = [
        tool_words(design.tool),
        payload_words(design.payload),
        gravity_words(design.gravity),
        *limits.values(),
        _free_words(free),
    ]
    line = "; ".join(part for part in parts if part)
    return f"{line[:1].upper()}{line[1:]}."


def tool_words(tool: Tool) -> str:
    """Return where the tool is, "no tool" where it is b4 in the frame of the platform."""
    distance, turn = math.hypot(*tool.position), turn_of(tool)
    if distance == 0.0 and turn == 0.0:
        return "no tool"
    place = "at b4" if distance == 0.0 else f"{text_of(distance)} units from b4"
    return f"tool {place}" + (f", turned by {text_of(turn)}°" if turn else "")


def turn_of(tool: Tool) -> float:
    """Return the angle between the axes of the tool and those of the platform, in degrees."""
    w, *axis = tool.quaternion
    return math.degrees(2.0 * math.atan2(math.hypot(*axis), abs(w)))


def payload_words(payload: Payload) -> str:
    """Return what the platform carries."""
    mass = f"{text_of(payload.mass_kg)} kg" if payload.mass_kg else ""
    force = f"a force of {text_of(payload.force_n)} N" if payload.force_n else ""
    return f"carries {' and '.join(filter(None, (mass, force))) or 'nothing'}"


def gravity_words(gravity: Triple) -> str:
    """Return the direction of gravity; "" where it is down."""
    name = direction_name(gravity)
    if name is None:
        return f"gravity along ({', '.join(map(text_of, gravity))})"
    return "" if gravity == DOWN else f"gravity {name}"


def direction_name(gravity: Triple) -> str | None:
    """Return the name of a direction of gravity; None where it is along no axis of the base."""
    for name, direction in DIRECTIONS.items():
        if max(abs(a - b) for a, b in zip(gravity, direction, strict=True)) <= SAME_DIRECTION:
            return name
    return None


def actuator_words(actuators: Actuators) -> str:
    """Return the largest forces of the actuators; "" where there is no limit."""
    push, pull = actuators.limits
    if np.array_equal(push, pull):
        return f"actuators up to {_range(push)} N" if np.isfinite(push).all() else ""
    sides = {"push": push, "pull": pull}
    words = [f"{side} up to {_range(most)} N" for side, most in sides.items() if most[0] < math.inf]
    return f"actuators {' and '.join(words)}"


def strut_words(struts: Struts) -> str:
    """Return the largest moment of the struts; "" where there is no limit."""
    moment = struts.largest_moment
    return f"struts up to {text_of(moment)} N m" if math.isfinite(moment) else ""


def guide_words(guide: Guide) -> str:
    """Return the limits of the guide; "" where there is none."""
    force = "" if guide.force_n is None else f"{text_of(guide.force_n)} N"
    moment = "" if guide.moment_nm is None else f"{text_of(guide.moment_nm)} N m"
    limits = " and ".join(filter(None, (force, moment)))
    return f"guide up to {limits}" if limits else ""


def text_of(value: float) -> str:
    """Return a number of the line."""
    return format_number(value, DIGITS)


def _free_words(free: list[str]) -> str:
    """Return which of the three parts have no limit; "" for none."""
    if len(free) == 3:
        return "no force is limited"
    names = " and ".join(f"the {name}" for name in free)
    return f"{names} {'has' if free == ['guide'] else 'have'} no limit" if free else ""


def _range(values: FloatArray) -> str:
    """Return the range of values, or the value if they are all the same."""
    low, high = (text_of(float(value)) for value in (values.min(), values.max()))
    return low if low == high else f"{low}–{high}"
