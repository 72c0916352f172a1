"""`explorer orientation`: the orientations that a position can have."""

from __future__ import annotations

import math
from dataclasses import dataclass
from typing import TYPE_CHECKING, Annotated

from explorer.cli import values
from explorer.cli.options import JsonOptions, PointOptions
from explorer.cli.output import attributes, degrees, figure, figures, finite, heading, table
from explorer.mechanism.configuration import position_of

if TYPE_CHECKING:
    from explorer.workspace.orientations.share import OrientationShare
    from explorer.workspace.orientations.tilts import GreatestTilt, TiltMap, TorsionRange

CONNECTED = "connected to tilt zero by a tilt without a gap"
NOT_CONNECTED = "not connected to tilt zero by a tilt within the limits"


@dataclass(frozen=True, kw_only=True)
class Orientation(JsonOptions, PointOptions):
    """Measure the orientations of a position: share of all, greatest tilts, torsion.

    The platform tilts from tilt zero, at one torsion and in each azimuth, until it meets the first
    limit. Collisions of legs are not among the limits. With `--at tool` the tool stays in its
    place, and b4 moves about it.
    """

    position: Annotated[values.Position, values.OF_HOME] = None
    """Position of b4, or of the tool, in the base frame, in design units."""

    torsion: Annotated[values.Finite, values.OF_HOME] = None
    """Torsion of the tilts, in degrees."""

    samples: Annotated[int, values.whole_number(2, 1_000_000)] = 100_000
    """Number of orientations for the share."""

    def run(self) -> None:
        """Write the measures of the orientations."""
        from explorer.workspace.orientations.share import orientation_share
        from explorer.workspace.orientations.tilts import (
            greatest_tilt,
            is_connected,
            tilt_by_torsion,
            tilt_map,
            torsion_range,
        )

        design = self.read_design()
        home, tool = design.home_pose, self.tool(design)
        position = position_of(design, home, self.at) if self.position is None else self.position
        share = orientation_share(design, position, self.samples, tool=tool)
        least = greatest_tilt(design, position, self.torsion, tool)
        tilts = tilt_map(design, position, self.torsion, tool=tool)
        by_torsion = tilt_by_torsion(design, position, tool=tool)
        best = by_torsion.best
        torsions = torsion_range(design, position, self.torsion, tool=tool)
        is_home_connected = is_connected(design, position, home.rotation, tool=tool)
        name = "position" if self.at == "b4" else "tool position"
        rows = [
            ("share of all orientations", _share_words(share)),
            ("torsion", *degrees([least.torsion])),
            ("greatest tilt in every azimuth", _least_words(least)),
            ("largest at any torsion", _best_words(best)),
            ("torsion range at tilt zero", _range_words(torsions)),
            ("home orientation", CONNECTED if is_home_connected else NOT_CONNECTED),
        ]
        self.write(
            lambda: {
                name.replace(" ", "_"): position,
                **attributes(share, "share standard_error orientations"),
                "torsion": least.torsion,
                "greatest_tilt": finite(least.tilt),
                "azimuth": finite(least.azimuth),
                "limit": least.limit,
                "azimuths": tilts.azimuths,
                "tilts": [*map(finite, tilts.tilts.tolist())],
                "limits": tilts.limits,
                "torsions": by_torsion.torsions,
                "tilts_by_torsion": [*map(finite, by_torsion.tilts.tolist())],
                "best_torsion": best.torsion,
                "best_tilt": finite(best.tilt),
                "torsion_range": [finite(torsions.low), finite(torsions.high)],
                "torsion_limits": [torsions.low_limit, torsions.high_limit],
                "home_connected": is_home_connected,
            },
            [
                heading(design),
                f"{name}  {'  '.join(figures(position))}",
                *("", table(rows, "<<"), ""),
                *([] if math.isnan(least.tilt) else [_azimuth_table(tilts)]),
            ],
        )


def _azimuth_table(tilts: TiltMap) -> str:
    rows = [("azimuth", "tilt", "ends at")]
    pairs = zip(tilts.azimuths.tolist(), tilts.tilts.tolist(), strict=True)
    for pair, limit in zip(pairs, tilts.limits, strict=True):
        azimuth, tilt = degrees(pair)
        rows.append((azimuth, tilt, limit or "no limit"))
    return table(rows, ">><")


def _share_words(share: OrientationShare) -> str:
    if share.share in (0.0, 1.0):
        return f"{'all' if share.share else 'none'} of {share.orientations:,} orientations"
    error = f"standard error {figure(share.standard_error)}"
    return f"{figure(share.share)} ({error}, {share.orientations:,} orientations)"


def _least_words(least: GreatestTilt) -> str:
    if math.isnan(least.tilt):
        return f"none: tilt zero violates {least.limit}"
    tilt, azimuth = degrees([least.tilt, least.azimuth])
    if least.limit is None:
        return f"{tilt}, no limit"
    return f"{tilt} in azimuth {azimuth}, ended by {least.limit}"


def _best_words(best: GreatestTilt) -> str:
    if math.isnan(best.tilt):
        return "none: tilt zero violates a limit at every torsion"
    tilt, torsion = degrees([best.tilt, best.torsion])
    return f"{tilt} at torsion {torsion}"


def _range_words(torsions: TorsionRange) -> str:
    if math.isnan(torsions.low):
        return f"none: tilt zero violates {torsions.low_limit}"
    if torsions.low_limit is None:
        return "all"
    low, high = degrees([torsions.low, torsions.high])
    return f"{low} ({torsions.low_limit}) to {high} ({torsions.high_limit})"
