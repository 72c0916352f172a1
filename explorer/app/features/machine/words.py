"""The machine of a design in words: what it carries, and what its parts bear."""

from __future__ import annotations

import math

import numpy as np

from explorer.mechanism.design import DOWN, Design
from explorer.mechanism.machine import Actuators, Guide, Payload, Tool
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
# Significant digits of the numbers in the line.
DIGITS = 3


def machine_words(design: Design) -> str:
    """Return a line on the machine of a design, such as "Tool 3 units from b4; carries 2 kg"."""
    moment = design.struts.largest_moment
    limits = {
        "actuators": _actuator_words(design.actuators),
        "struts": f"struts up to {_text(moment)} N m" if math.isfinite(moment) else "",
        "guide": _guide_words(design.guide),
    }
    free = [name for name, words in limits.items() if not words]
    parts = [
        _tool_words(design.tool),
        _payload_words(design.payload),
        _gravity_words(design.gravity),
        *limits.values(),
        _free_words(free),
    ]
    line = "; ".join(part for part in parts if part)
    return f"{line[:1].upper()}{line[1:]}."


def _tool_words(tool: Tool) -> str:
    distance, turn = math.hypot(*tool.position), turn_of(tool)
    if distance == 0.0 and turn == 0.0:
        return "no tool"
    place = "at b4" if distance == 0.0 else f"{_text(distance)} units from b4"
    return f"tool {place}" + (f", turned by {_text(turn)}°" if turn else "")


def turn_of(tool: Tool) -> float:
    """Return the angle between the axes of the tool and those of the platform, in degrees."""
    w, *axis = tool.quaternion
    return math.degrees(2.0 * math.atan2(math.hypot(*axis), abs(w)))


def _payload_words(payload: Payload) -> str:
    mass = f"{_text(payload.mass_kg)} kg" if payload.mass_kg else ""
    force = f"a force of {_text(payload.force_n)} N" if payload.force_n else ""
    return f"carries {' and '.join(filter(None, (mass, force))) or 'nothing'}"


def _gravity_words(gravity: Triple) -> str:
    along = f"along ({', '.join(map(_text, gravity))})"
    return "" if gravity == DOWN else f"gravity {direction_name(gravity) or along}"


def direction_name(gravity: Triple) -> str | None:
    """Return the name of a direction of gravity; None where it is along no axis of the base."""
    for name, direction in DIRECTIONS.items():
        if max(abs(a - b) for a, b in zip(gravity, direction, strict=True)) <= SAME_DIRECTION:
            return name
    return None


def _actuator_words(actuators: Actuators) -> str:
    push, pull = actuators.limits
    if np.array_equal(push, pull):
        return f"actuators up to {_range(push)} N" if np.isfinite(push).all() else ""
    sides = {"push": push, "pull": pull}
    words = [f"{side} up to {_range(most)} N" for side, most in sides.items() if most[0] < math.inf]
    return f"actuators {' and '.join(words)}"


def _guide_words(guide: Guide) -> str:
    force = "" if guide.force_n is None else f"{_text(guide.force_n)} N"
    moment = "" if guide.moment_nm is None else f"{_text(guide.moment_nm)} N m"
    limits = " and ".join(filter(None, (force, moment)))
    return f"guide up to {limits}" if limits else ""


def _free_words(free: list[str]) -> str:
    """Return which of the three parts have no limit; "" for none."""
    if len(free) == 3:
        return "no force is limited"
    names = " and ".join(f"the {name}" for name in free)
    return f"{names} {'has' if free == ['guide'] else 'have'} no limit" if free else ""


def _text(value: float) -> str:
    return format_number(value, DIGITS)


def _range(values: FloatArray) -> str:
    """Return the range of values, or the value if they are all the same."""
    low, high = (_text(float(value)) for value in (values.min(), values.max()))
    return low if low == high else f"{low}–{high}"
