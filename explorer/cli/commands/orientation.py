"""`explorer orientation`: the orientations that a position can have."""

from __future__ import annotations

import math
from collections.abc import Iterator
from dataclasses import dataclass
from typing import TYPE_CHECKING, Annotated

from explorer.cli.options import DesignOptions, JsonOptions, PointOptions
from explorer.cli.output import degrees, figure, figures, finite, heading, table
from explorer.cli.values import OF_HOME, finite_number, numbers, whole_number
from explorer.mechanism.configuration import Point, position_of
from explorer.mechanism.design import Design
from explorer.mechanism.pose import Triple

if TYPE_CHECKING:
    from explorer.workspace.orientations.share import OrientationShare
    from explorer.workspace.orientations.tilts import GreatestTilt, TiltMap
    from explorer.workspace.orientations.torsions import TiltByTorsion, TorsionRange


@dataclass(frozen=True, kw_only=True)
class Orientation(JsonOptions, PointOptions, DesignOptions):
    """Measure the orientations of a position: share of all, greatest tilts, torsion.

    The platform tilts from tilt zero, at one torsion and in each azimuth, until it meets the first
    limit. Collisions of legs are not among the limits. With `--at tool` the tool stays in its
    place, and b4 moves about it.
    """

    position: Annotated[Triple | None, numbers("--position", "x y z"), OF_HOME] = None
    """Position of b4, or of the tool, in the base frame, in design units."""

    torsion: Annotated[float | None, finite_number("--torsion"), OF_HOME] = None
    """Torsion of the tilts, in degrees."""

    samples: Annotated[int, whole_number("--samples", 2, 1_000_000)] = 100_000
    """Number of orientations for the share."""

    def run(self) -> None:
        """Write the measures of the orientations."""
        from explorer.workspace.orientations.share import orientation_share
        from explorer.workspace.orientations.tilts import greatest_tilt, tilt_map
        from explorer.workspace.orientations.torsions import (
            is_connected,
            tilt_by_torsion,
            torsion_range,
        )

        design = self.read_design()
        home, tool = design.home_pose, self.tool(design)
        position = position_of(design, home, self.at) if self.position is None else self.position
        found = _Orientations(
            design=design,
            at=self.at,
            position=position,
            share=orientation_share(design, position, self.samples, tool=tool),
            least=greatest_tilt(design, position, self.torsion, tool),
            tilts=tilt_map(design, position, self.torsion, tool=tool),
            by_torsion=tilt_by_torsion(design, position, tool=tool),
            torsions=torsion_range(design, position, self.torsion, tool=tool),
            is_home_connected=is_connected(design, position, home.rotation, tool=tool),
        )
        self.write(found.as_json, found.as_lines)


@dataclass(frozen=True)
class _Orientations:
    """The orientations of a position, ready to be written."""

    design: Design
    at: Point
    position: Triple
    share: OrientationShare
    least: GreatestTilt
    tilts: TiltMap
    by_torsion: TiltByTorsion
    torsions: TorsionRange
    is_home_connected: bool

    def as_json(self) -> dict[str, object]:
        """Return the answer as plain values."""
        least, torsions, best = self.least, self.torsions, self.by_torsion.best
        return {
            "position" if self.at == "b4" else "tool_position": self.position,
            "share": self.share.share,
            "standard_error": self.share.standard_error,
            "orientations": self.share.orientations,
            "torsion": least.torsion,
            "greatest_tilt": finite(least.tilt),
            "azimuth": finite(least.azimuth),
            "limit": least.limit,
            "azimuths": self.tilts.azimuths,
            "tilts": [finite(tilt) for tilt in self.tilts.tilts.tolist()],
            "limits": self.tilts.limits,
            "torsions": self.by_torsion.torsions,
            "tilts_by_torsion": [finite(tilt) for tilt in self.by_torsion.tilts.tolist()],
            "best_torsion": best.torsion,
            "best_tilt": finite(best.tilt),
            "torsion_range": [finite(torsions.low), finite(torsions.high)],
            "torsion_limits": [torsions.low_limit, torsions.high_limit],
            "home_connected": self.is_home_connected,
        }

    def as_lines(self) -> Iterator[str]:
        """Yield the answer as lines of text."""
        least = self.least
        name = "position" if self.at == "b4" else "tool position"
        yield from (heading(self.design), f"{name}  {'  '.join(figures(self.position))}", "")
        rows = [
            ("share of all orientations", self._share()),
            ("torsion", *degrees([least.torsion])),
            ("greatest tilt in every azimuth", self._greatest()),
            ("largest at any torsion", self._best()),
            ("torsion range at tilt zero", self._torsions()),
            ("home orientation", self._home()),
        ]
        yield from (table(rows, "<<"), "")
        if math.isnan(least.tilt):
            return
        listed = [("azimuth", "tilt", "ends at")]
        for azimuth, tilt, limit in zip(
            self.tilts.azimuths.tolist(), self.tilts.tilts.tolist(), self.tilts.limits, strict=True
        ):
            towards, most = degrees([azimuth, tilt])
            listed.append((towards, most, limit or "no limit"))
        yield table(listed, ">><")

    def _share(self) -> str:
        share = self.share
        if share.share in (0.0, 1.0):
            return f"{'all' if share.share else 'none'} of {share.orientations:,} orientations"
        error = f"standard error {figure(share.standard_error)}"
        return f"{figure(share.share)} ({error}, {share.orientations:,} orientations)"

    def _greatest(self) -> str:
        least = self.least
        if math.isnan(least.tilt):
            return f"none: tilt zero violates {least.limit}"
        (tilt,) = degrees([least.tilt])
        if least.limit is None:
            return f"{tilt}, no limit"
        return f"{tilt} in azimuth {degrees([least.azimuth])[0]}, ended by {least.limit}"

    def _best(self) -> str:
        best = self.by_torsion.best
        if math.isnan(best.tilt):
            return "none: tilt zero violates a limit at every torsion"
        tilt, torsion = degrees([best.tilt, best.torsion])
        return f"{tilt} at torsion {torsion}"

    def _torsions(self) -> str:
        torsions = self.torsions
        if math.isnan(torsions.low):
            return f"none: tilt zero violates {torsions.low_limit}"
        if torsions.low_limit is None:
            return "all"
        low, high = degrees([torsions.low, torsions.high])
        return f"{low} ({torsions.low_limit}) to {high} ({torsions.high_limit})"

    def _home(self) -> str:
        if self.is_home_connected:
            return "connected to tilt zero by a tilt without a gap"
        return "not connected to tilt zero by a tilt within the limits"
