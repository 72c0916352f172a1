"""The panel of orientations: those of the present position, and positions over orientations."""

from __future__ import annotations

import math
from collections.abc import Iterator
from html import escape
from typing import Annotated

import msgspec
import viser

from explorer.app.browser.viser_gaps import run_script
from explorer.app.features.feature import Services
from explorer.app.features.orientation.actions import ANGLES, GoToTilt, SetTiltTorsion
from explorer.app.features.orientation.feeds import RangeFeed, ShareFeed, TiltsFeed
from explorer.app.features.orientation.polar_map import legend, polar_map
from explorer.app.features.orientation.scale import scale_of_tilts
from explorer.app.inputs.bindings import Bound
from explorer.app.inputs.controls import Controls
from explorer.app.inputs.tracks import Span
from explorer.app.look import read_script
from explorer.app.security.client_messages import decode_text
from explorer.app.state.frame import Frame
from explorer.app.state.state import State
from explorer.app.widgets.assigning import Update
from explorer.app.widgets.markup import alert, box, caption, dim, format_number, row, table
from explorer.mechanism.home import home_pose
from explorer.mechanism.tilt_torsion import TiltTorsion, tilt_torsion_of
from explorer.numerics.number_text import format_decimals
from explorer.workspace.orientations.tilts import (
    GreatestTilt,
    greatest_tilt,
    tilt_map,
    torsion_range,
)
from explorer.workspace.solids.solid import Solid

OVER = {"nothing": "none", "some of the tilts": "reachable", "all of the tilts": "dexterous"}
SPANS = (Span(-180.0, 180.0, 0.1), Span(0.0, 180.0, 0.1), Span(-180.0, 180.0, 0.1))
HINTS = (
    "Direction in the base's xy-plane, from x towards y, that the platform's z-axis tilts towards.",
    "Angle between the z-axes of platform and base.",
    "Turn of the platform about its own z-axis; at tilt 0 it is the yaw.",
)
# Tilt below which the azimuth has no effect, in degrees.
LEVEL = 1e-6

_TILT = msgspec.json.Decoder(
    tuple[
        Annotated[float, msgspec.Meta(ge=-360.0, le=360.0)],
        Annotated[float, msgspec.Meta(ge=0.0, le=180.0)],
    ]
)


class OrientationPanel:
    """The map of tilts with its figures and angles, and what is drawn over the workspace."""

    def __init__(self, services: Services) -> None:
        gui, self._session = services.gui, services.session
        self._shares = services.get(ShareFeed)
        self._tilts, self._ranges = services.get(TiltsFeed), services.get(RangeFeed)
        self._controls = controls = Controls(gui, services.session)
        self._top = gui.add_html("")
        self._map = gui.add_html("")
        self._legend = gui.add_html("")
        for axis, name in enumerate(ANGLES):
            self._add_angle(axis, name)
        with gui.add_folder("Over the workspace"):
            controls.checkbox(
                "Greatest tilts",
                "Draw the greatest tilt in every azimuth, at the present torsion, at nodes over "
                "the workspace.",
                "view.orientation.tilts",
            )
            self._scale = gui.add_html("", visible=False)
            controls.dropdown(
                "Positions with",
                "Draw the positions that have some or all orientations which a tilt from the "
                "orientation of home leads to: the reachable and the dexterous workspace.",
                OVER,
                "view.orientation.over",
            )
            controls.number(
                "Tilts up to (°)",
                "Largest tilt from the orientation of home, in degrees.",
                "view.orientation.range",
                least=0.0,
                step=1.0,
                visible=lambda state: state.view.orientation.over != "none",
            )
            self._volumes = gui.add_html("", visible=False)
        services.buttons.on("orientation.go", self._go)
        run_script(services.server, read_script("tilts"))

    def _add_angle(self, axis: int, name: str) -> None:
        def is_level(state: State) -> bool:
            return tilt_torsion_of(state.pose.rotation).tilt < LEVEL

        self._controls.slider(
            f"{name.capitalize()} (°)",
            HINTS[axis],
            Bound(
                lambda frame: tilt_torsion_of(frame.state.pose.rotation)[axis],
                lambda _, value: SetTiltTorsion(axis, value),
            ),
            SPANS[axis],
            disabled=is_level if axis == 0 else None,
        )

    def updates(self, frame: Frame) -> Iterator[Update]:
        """Yield the updates that show a frame."""
        design, pose = frame.state.design, frame.state.pose
        here = tilt_torsion_of(pose.rotation)
        tilts = tilt_map(design, pose.position, here.torsion)
        least = greatest_tilt(design, pose.position, here.torsion)
        yield self._top, "content", box(*self._summary(frame, here, least))
        home = tilt_torsion_of(home_pose(design).rotation)
        yield self._map, "content", box(polar_map(tilts, here, home))
        yield self._legend, "content", box(caption("What ends the tilts"), legend(tilts))
        yield from self._controls.updates(frame)
        drawing = self._tilts.drawing
        yield self._scale, "visible", drawing is not None
        if drawing is not None:
            yield self._scale, "content", box(scale_of_tilts(drawing))
        ranged = self._ranges.drawing
        waits = frame.state.view.orientation.over != "none"
        yield self._volumes, "visible", waits
        if waits:
            words = dim("computing …")
            if ranged is not None and ranged.problem:
                words = alert("There is no such workspace", ranged.problem)
            elif ranged is not None:
                look = "" if self._ranges.is_current else "is-outdated"
                rows = table(_volume_rows(ranged.reachable, ranged.dexterous))
                words = f'<div class="{look}">{rows}</div>'
            yield self._volumes, "content", box(words)

    def _summary(self, frame: Frame, here: TiltTorsion, least: GreatestTilt) -> Iterator[str]:
        """Yield the greatest tilt, the share of orientations and the range of torsions."""
        design, position = frame.state.design, frame.state.pose.position
        if math.isnan(least.tilt):
            yield alert("Tilt zero is beyond a limit here", f"It violates {least.limit}.")
        else:
            why = "" if least.limit is None else f", ended by {escape(least.limit)}"
            yield (
                f'<div class="ex-line"><span class="ex-large">{_degrees(least.tilt)}</span>'
                f"{dim('in every azimuth')}</div>"
                + caption(f"Greatest tilt at torsion {_degrees(here.torsion)}{why}")
            )
        drawing = self._shares.drawing
        share = "…"
        if drawing is not None:
            value, error = drawing.share.share, drawing.share.standard_error
            share = f"{100.0 * value:.2f} % ± {100.0 * error:.2f} %"
        torsions = torsion_range(design, position, here.torsion, here.azimuth, here.tilt)
        span = "none here"
        if not math.isnan(torsions.low):
            span = f"{_degrees(torsions.low)} to {_degrees(torsions.high)}"
            if torsions.low_limit is None:
                span = "all"
        yield table(
            (
                row(
                    dim("of all orientations"),
                    share,
                    hint="Share of all orientations that this position can have within the limits, "
                    "with its standard error",
                ),
                row(
                    dim("torsions"),
                    span,
                    hint="Torsions that a turn about the platform's z-axis leads to, at the "
                    "present azimuth and tilt",
                ),
            )
        )

    def _go(self, text: str, client: viser.ClientHandle) -> None:
        """Tilt the platform as a page sent it, (azimuth, tilt) in degrees."""
        angles: tuple[float, float] | None = decode_text(text, _TILT)
        if angles is not None:
            self._session.do(GoToTilt(*angles), who=client.client_id)


def _degrees(angle: float) -> str:
    return f"{format_decimals(angle, 1)}°"


def _volume_rows(reachable: Solid | None, dexterous: Solid | None) -> Iterator[str]:
    """Yield the volumes of both workspaces over a range."""
    for name, hint, solid in (
        ("reachable", "Positions that have one of the orientations at least", reachable),
        ("dexterous", "Positions that have all of them", dexterous),
    ):
        if solid is None:
            continue
        text = f"{format_number(solid.volume, 6)} units³"
        if solid.is_empty:
            text = f"empty: {', '.join(solid.empty_because)}"
        yield row(dim(name), escape(text), hint=hint)
