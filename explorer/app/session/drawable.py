"""The check that every length of a state is short enough to be drawn."""

from __future__ import annotations

from explorer.app.state.state import State
from explorer.errors import InputError
from explorer.mechanism.design import JOINTS, VARIABLES
from explorer.numerics.number_text import format_number

# Largest length over the reach of the design as it was opened: browsers draw in single precision.
LARGEST_SHARE = 1e6


def check_drawable(state: State) -> None:
    """Check that every length of a state can be drawn at the scale that it was opened in.

    Raises:
        InputError: a design variable, a coordinate, a joint, the guide or a radius is too long.
    """
    reach = state.base.reach
    for names, values in (
        (VARIABLES, state.design.variables),
        ("xyz", state.pose.position),
        (JOINTS, state.joints),
        (("the end of the guide",) * 2, state.design.limits.guide or (0.0, 0.0)),
        (("the radius of a leg",) * 4, state.design.limits.leg_radii),
    ):
        for name, value in zip(names, values, strict=True):
            if abs(value) > LARGEST_SHARE * reach:
                most = format_number(LARGEST_SHARE * reach)
                raise InputError(
                    f"{name} = {format_number(value)} is too far to be drawn; "
                    f"{most}, a million times the reach, is the most"
                )
