"""The variables of a study in the machine around the mechanism: payload, tool point and limits."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass
from typing import Literal

import msgspec

from explorer.errors import InputError
from explorer.mechanism.design import Design
from explorer.mechanism.machine import Actuators, Payload, Tool


@dataclass(frozen=True)
class MachineVariable:
    """A number of the machine around a design.

    Attributes:
        words: Meaning.
        unit: Unit; "units" for a length in design units.
        part, field: Place of the number in a design.
        axis: Index of the number in a point; None for a number of its own.
        bound: Numbers that are allowed.
    """

    words: str
    unit: str
    part: str
    field: str
    axis: int | None = None
    bound: Literal["any", "not negative", "positive"] = "positive"

    def check(self, name: str, low: float) -> None:
        """Check the low end of the range of a variable of a name.

        Raises:
            InputError: The number is not allowed.
        """
        if self.bound != "any" and (low < 0.0 or (low == 0.0 and self.bound == "positive")):
            demand = "not be negative" if self.bound == "not negative" else "be positive"
            raise InputError(f"{name} must {demand}; its range starts at {low:g}")

    def value_in(self, design: Design) -> float | None:
        """Return the number in a design, the least of six; None without such a part."""
        part = getattr(design, self.part)
        if part == Tool():
            return None
        if isinstance(part, Actuators):
            limits = [*(part.push_n or ()), *(part.pull_n or ())]
            return min(limits, default=None)
        found = getattr(part, self.field)
        # A mass or a force of zero is none.
        return found or None if self.axis is None else found[self.axis]

    def with_value(self, design: Design, value: float) -> Design:
        """Return a design with another number.

        Raises:
            DesignError: The number is not allowed.
        """
        part = getattr(design, self.part)
        changes: dict[str, object] = {self.field: value}
        if isinstance(part, Payload) and self.field == "mass_kg":
            return msgspec.structs.replace(design, payload=part.with_mass(value))
        if isinstance(part, Actuators):
            changes = {"push_n": (value,) * 6, "pull_n": None}
        elif self.axis is not None:
            point = [*getattr(part, self.field)]
            point[self.axis] = value
            changes = {self.field: tuple(point)}
        return msgspec.structs.replace(
            design, **{self.part: msgspec.structs.replace(part, **changes)}
        )


MACHINE: Mapping[str, MachineVariable] = {
    "payload_mass": MachineVariable(
        "mass of the payload", "kg", "payload", "mass_kg", bound="not negative"
    ),
    "payload_force": MachineVariable(
        "force of any direction at the tool", "N", "payload", "force_n", bound="not negative"
    ),
    **{
        f"tool_{name}": MachineVariable(
            f"{name} of the tool point in the platform", "units", "tool", "position", axis, "any"
        )
        for axis, name in enumerate("xyz")
    },
    "actuator_limit": MachineVariable(
        "one limit of push and pull for all six actuators", "N", "actuators", "push_n"
    ),
    "strut_limit": MachineVariable(
        "largest bending moment of a strut", "N m", "struts", "moment_nm"
    ),
    "guide_force": MachineVariable(
        "largest force across the guide at a carriage", "N", "guide", "force_n"
    ),
    "guide_moment": MachineVariable(
        "largest moment on the guide at a carriage", "N m", "guide", "moment_nm"
    ),
}
"""The variables by name; all else of a machine is that of the study's design."""
