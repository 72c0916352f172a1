"""The geometry of a design, which may be chosen anew, and the machine around it, which then stays.

| part of the state | by a preset | by another unit | by a file, or a saved design |
|---|---|---|---|
| geometry: all other fields of the design | the preset's | grows with it | the file's |
| machine: `MACHINE`, and the radii of the legs | stays | stays | the file's |
| what is asked and shown: see `LENGTHS` | stays | stays | stays |
| the box that a search has required | the preset's: none | stays | the file's |

A length that stays keeps its value in the unit that the page shows, millimetres or design units.
"""

from __future__ import annotations

from dataclasses import replace
from typing import Any, TypeVar

import msgspec

from explorer.app.state.actions import Act, Set, action, open_design
from explorer.app.state.moves import assemble, move_to
from explorer.app.state.parts import in_unit
from explorer.app.state.state import State
from explorer.app.state.view import View
from explorer.errors import InputError
from explorer.mechanism.design import VARIABLES, Design
from explorer.mechanism.design_file import PRESETS
from explorer.mechanism.kinematics import forward
from explorer.numerics.number_text import format_number

MACHINE = ("tool", "payload", "gravity", "actuators", "struts", "guide", "tolerances")
"""The fields of a design that are its machine; the radii of the legs are among its limits."""


def with_machine(design: Design, of: Design, view: View) -> Design:
    """Return a design with the machine of another one, whose lengths stay in the unit of a view.

    Raises:
        DesignError: The tool or the payload lies too far from b4 for the design.
    """
    units = view.unit_for(of), view.unit_for(design)
    position, centre = in_unit((of.tool.position, of.payload.centre), *units)
    machine: dict[str, Any] = {name: getattr(of, name) for name in MACHINE}
    machine["tool"] = msgspec.structs.replace(of.tool, position=position)
    machine["payload"] = msgspec.structs.replace(of.payload, centre=centre)
    radii = in_unit(of.limits.leg_radii, *units)
    limits = msgspec.structs.replace(design.limits, leg_radii=radii)
    return msgspec.structs.replace(design, limits=limits, **machine)


def without_machine(design: Design) -> Design:
    """Return a design with an ideal machine: no payload, no limit, no error, and legs as lines."""
    ideal = Design(a3=design.a3, b1=design.b1, b2=design.b2, b3=design.b3)
    return with_machine(design, ideal, View())


Named = TypeVar("Named", bound=msgspec.Struct)


def without_name(design: Named) -> Named:
    """Return a design or a table without its name, on which nothing else depends."""
    return msgspec.structs.replace(design, name="untitled")


def preset_of(design: Design) -> str | None:
    """Return the name of the preset whose geometry and name a design has; None if it has none."""
    preset = PRESETS.get(design.name)
    return design.name if preset == without_machine(design) else None


def open_geometry(design: Design, state: State) -> Act:
    """Return the action that opens a design, in its home pose, with the machine of a state."""
    return open_design(with_machine(design, state.design, state.view))


def set_unit(state: State, unit_mm: float) -> Set:
    """Return the action that sets the millimetres in one design unit."""
    scaled = msgspec.structs.replace(state.design, unit_mm=unit_mm)
    design = with_machine(scaled, state.design, state.view)
    return Set("design", design, "1 unit", f"{format_number(unit_mm, 6)} mm")


def _variable_words(after: State, name: str, value: float) -> str:
    return f"{name} = {after.unit.text(value, 6)}"


@action(_variable_words)
def set_variable(state: State, name: str, value: float) -> State:
    """Set one design variable, named as in `VARIABLES`; `State.hold` says what stays.

    Raises:
        DesignError: The design would be degenerate.
        InputError: The legs are held and cannot close in the new design, or the design is being
            optimised.
    """
    state.check_free()
    design = state.design.with_variable(name, value)
    if state.hold == "pose":
        return move_to(replace(state, design=design), state.pose, state.yaw_pitch_roll)
    solution = forward(design, state.joints)
    if not solution.feasible:
        present = state.design.variables[VARIABLES.index(name)]
        raise InputError(
            f"{name} = {state.unit.text(value, 6)} cannot be assembled while the legs are held; "
            f"it stays {state.unit.text(present, 6)}. Hold the pose to go further."
        )
    return assemble(replace(state, design=design), solution, state.mode)


@action("Ideal machine")
def clear_machine(state: State) -> State:
    """Take the machine away, unless the design is being optimised."""
    state.check_free()
    return replace(state, design=without_machine(state.design))
