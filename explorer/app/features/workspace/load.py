"""The design as the load of the page finds it over the workspace."""

from __future__ import annotations

import msgspec

from explorer.app.scene.bands import Measure
from explorer.app.state.state import State
from explorer.mechanism.design import Design
from explorer.statics.reactions import has_limits


def loaded_design(state: State) -> Design:
    """Return the design, without the mass of its payload if no weights count on the page."""
    design = state.design
    if state.view.forces.weighed != "none" or not design.payload.mass_kg:
        return design
    payload = msgspec.structs.replace(design.payload, mass_kg=0.0)
    return msgspec.structs.replace(design, payload=payload)


def map_measure(design: Design, colour: Measure, *, holds: bool) -> Measure:
    """Return the measure of the map of a slice; "plain" for the margins.

    Args:
        design: The manipulator.
        colour: Measure that colours the surface.
        holds: Whether the part of the workspace that holds the load is shown.
    """
    return "share" if colour == "plain" and holds and has_limits(design) else colour
