"""The design as the load of the page finds it over the workspace."""

from __future__ import annotations

import msgspec

from explorer.app.state.state import State
from explorer.mechanism.design import Design
from explorer.statics.reactions import limited_parts


def loaded_design(state: State) -> Design:
    """Return the design, without the mass of its payload if no weights count on the page."""
    design = state.design
    if state.view.forces.weighed != "none" or not design.payload.mass_kg:
        return design
    payload = msgspec.structs.replace(design.payload, mass_kg=0.0)
    return msgspec.structs.replace(design, payload=payload)


def has_limits(design: Design) -> bool:
    """Return whether an actuator, a strut or the guide has a limit."""
    return bool(limited_parts(design).any())
