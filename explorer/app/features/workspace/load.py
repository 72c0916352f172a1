"""The design as the load of the page finds it over the workspace."""

from __future__ import annotations

import msgspec

from explorer.app.scene.bands import Measure
from explorer.app.state.state import State
from explorer.mechanism.design import Design
from explorer.statics.reactions import has_limits
from explorer.workspace.position_bands import is_unstated


def loaded_design(state: State) -> Design:
    """Return the design, without the mass of its payload if no weights count on the page."""
    design = state.design
    if state.view.forces.weighed != "none" or not design.payload.mass_kg:
        return design
    payload = msgspec.structs.replace(design.payload, mass_kg=0.0)
    return msgspec.structs.replace(design, payload=payload)


def drawn_measure(state: State) -> Measure:
    """Return the measure that colours the surface; "plain" for one that would be zero everywhere.

    Shares are zero without limits, errors without errors of actuators, and the deflection of a
    rigid machine.
    """
    colour = state.view.workspace.colour
    return "plain" if colour != "plain" and is_unstated(state.design, colour) else colour


def map_measure(design: Design, colour: Measure, *, holds: bool) -> Measure:
    """Return the measure of the map of a slice; "plain" for the margins.

    Args:
        design: The manipulator.
        colour: Measure that colours the surface.
        holds: Whether the part of the workspace that holds the load is shown.
    """
    return "share" if colour == "plain" and holds and has_limits(design) else colour
