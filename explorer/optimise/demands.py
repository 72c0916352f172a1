"""Demands on a design that an optimisation looks for, besides the design's own limits."""

from __future__ import annotations

import math

import msgspec

from explorer.errors import InputError
from explorer.mechanism.pose import Triple
from explorer.numerics.checks import not_negative, numbers, ordered_pair, positive, two

Box = tuple[Triple, Triple]

AZIMUTHS = 12
"""Number of azimuths, at equal distances from the yaw of home, in which a tilt is demanded."""

MOST_TILT = 90.0


class Demands(msgspec.Struct, frozen=True, forbid_unknown_fields=True, kw_only=True):
    """Demands besides the design's own limits; None is no demand.

    Attributes:
        volume: Exact volume of the workspace to match, or the least one, in cubed design units.
        reach: Longest leg allowed, in design units.
        clearance: Smallest clearance of each pair of legs, radii taken off, wherever in the
            workspace every margin is at least `clearance_margin`. Nearer to a singularity
            legs may have to meet: with a level platform all four lie in the base at δ3 = 0.
        clearance_margin: Least margin at which clearance is demanded, in design units.
        least: Smallest |a3y|, |b1y| and |b3 − b2|, at zero of which a design is degenerate.
        stroke_ratio: Longest over shortest of each actuator: raises its minimum length to
            its maximum over this ratio, so that the workspace is what such strokes reach.
        required_box: (lows, highs) of positions that must lie in the workspace.
        held: Whether the design's load must be held over the required box, within the limits of
            its actuators, struts and guide.
        tilt: Tilt from the orientation of home that the required box must allow in every azimuth,
            in degrees. It is demanded in `AZIMUTHS` of them; between these the box may allow
            some hundredths less.
        error: Worst displacement of the tool by the actuators' errors over the required box, in
            design units.
        deflection: Largest displacement of the tool under the design's load over the required box,
            in design units.
    """

    volume: float | None = None
    reach: float | None = None
    clearance: float | None = None
    clearance_margin: float = 0.0
    least: float = 0.0
    stroke_ratio: float | None = None
    required_box: Box | None = None
    held: bool = False
    error: float | None = None
    deflection: float | None = None
    tilt: float | None = None

    def __post_init__(self) -> None:
        if self.volume is not None:
            # The volume of a huge design exceeds the bound of other numbers.
            if not 0.0 < self.volume < math.inf:
                raise InputError(
                    f"the volume demanded must be a positive, finite number; got {self.volume:g}"
                )
            msgspec.structs.force_setattr(self, "volume", float(self.volume))
        for field in ("reach", "clearance", "stroke_ratio", "error", "deflection", "tilt"):
            value = getattr(self, field)
            if value is not None:
                label = f"the {field.replace('_', ' ')} demanded"
                msgspec.structs.force_setattr(self, field, positive(label, value))
        for field in ("clearance_margin", "least"):
            value = not_negative(f"the {field.replace('_', ' ')}", getattr(self, field))
            msgspec.structs.force_setattr(self, field, value)
        msgspec.structs.force_setattr(self, "held", bool(self.held))
        if self.required_box is not None:
            lows, highs = two("the required box", self.required_box)
            pairs = [
                ordered_pair(f"the required box {axis}", low, high)
                for axis, low, high in zip(
                    "xyz",
                    numbers("the required box's lows", lows, 3),
                    numbers("the required box's highs", highs, 3),
                    strict=True,
                )
            ]
            box = tuple(low for low, _ in pairs), tuple(high for _, high in pairs)
            msgspec.structs.force_setattr(self, "required_box", box)
