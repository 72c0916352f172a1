"""The panel of orientations: those of the present position, and positions over orientations."""

from __future__ import annotations

import math
from collections.abc import Iterator
from typing import Annotated

import msgspec
import viser

from explorer.app.browser.browser_facts import decode_text
from explorer.app.browser.viser_gaps import run_script
from explorer.app.features.feature import Services
from explorer.app.features.orientation.maps import (
    SAME_TILT,
    legend,
    polar_map,
    scale_of_tilts,
    tilt_at,
    torsion_strip,
)
from explorer.app.features.orientation.work import (
    ANGLES,
    POSITION_FEED,
    RANGE_FEED,
    TILTS_FEED,
    GoToTilt,
    PositionFeed,
    RangeFeed,
    SetTiltTorsion,
    TiltsFeed,
)
from explorer.app.inputs.bindings import Bound
from explorer.app.inputs.controls import Controls
from explorer.app.inputs.tracks import Span
from explorer.app.look import read_script
from explorer.app.state.frame import Frame
from explorer.app.state.state import State
from explorer.app.widgets.assigning import Update
from explorer.app.widgets.markup import alert, box, caption, dim, row, table
from explorer.app.widgets.under_way import UnderWay, problem, progress
from explorer.mechanism.tilt_torsion import TiltTorsion, tilt_torsion_of
from explorer.numerics.number_text import format_decimals, format_number
from explorer.workspace.orientations.share import OrientationShare
from explorer.workspace.orientations.tilts import (
    GreatestTilt,
    greatest_tilt,
    tilt_map,
)
from explorer.workspace.orientations.torsions import torsion_range

OVER = {"none": "none", "inclusive": "inclusive", "total": "total"}
SPANS = (Span(-180.0, 180.0, 0.1), Span(0.0, 180.0, 0.1), Span(-180.0, 180.0, 0.1))
HINTS = (
    "Direction in the base's xy-plane, from x towards y, that the platform's z-axis tilts towards.",
    "Angle between the z-axes of platform and base. With azimuth and torsion: the T&T angles.",
    "Turn of the platform about its own z-axis; at tilt 0 it is the yaw.",
)
VOLUME_HINT = "Volume of the solid as drawn. A sample of orientations stands for the range:"
BOUNDS = {
    "inclusive": ("at least", "positions that have only others of the range are left out."),
    "total": ("at most", "positions that lack only others of the range are in it."),
}
# Tilt below which the azimuth has no effect, in degrees.
LEVEL = 1e-6

_TILT = msgspec.json.Decoder(
    tuple[
        Annotated[float, msgspec.Meta(ge=-360.0, le=360.0)],
        Annotated[float, msgspec.Meta(ge=0.0, le=180.0)],
    ]
)

_TORSION = msgspec.json.Decoder(Annotated[float, msgspec.Meta(ge=-360.0, le=360.0)])


class OrientationPanel:
    """The map of tilts with its figures and angles, and what is drawn over the workspace."""

    def __init__(self, services: Services) -> None:
        gui, self._session = services.gui, services.session
        self._here = services.get(POSITION_FEED)
        self._tilts, self._ranges = services.get(TILTS_FEED), services.get(RANGE_FEED)
        self._controls = controls = Controls(gui, services.session)
        self._top = gui.add_html("")
        self._map = gui.add_html("")
        self._legend = gui.add_html("")
        for axis, name in enumerate(ANGLES):
            self._add_angle(axis, name)
        self._strip = gui.add_html("")
        with gui.add_folder("Over the workspace"):
            controls.checkbox(
                "Greatest tilts",
                "Draw the greatest tilt in every azimuth, at the present torsion, at nodes over "
                "the workspace. The cut of the workspace opens them too.",
                "view.orientation.tilts",
            )
            self._scale = gui.add_html("", visible=False)
            self._tilts_under_way = UnderWay(gui, "tilts", self._tilts)
            controls.dropdown(
                "Solid over tilts",
                "Draw the positions that allow at least one (inclusive workspace) or all (total "
                "workspace) of the orientations within a tilt and a turn from that of home.",
                OVER,
                "view.orientation.over",
            )
            controls.number(
                "Tilts from home up to (°)",
                "Largest tilt from the orientation of home, in degrees.",
                "view.orientation.range",
                least=0.0,
                step=1.0,
                visible=lambda state: state.view.orientation.over != "none",
            )
            controls.number(
                "Torsions from home ± (°)",
                "Largest change of the torsion from that of home, either way, in degrees.",
                "view.orientation.turn",
                least=0.0,
                step=1.0,
                visible=lambda state: state.view.orientation.over != "none",
            )
            self._volume = gui.add_html("", visible=False)
        services.buttons.on("orientation.go", self._go)
        services.buttons.on("orientation.torsion", self._turn)
        run_script(services.server, read_script("tilts"))

    def _add_angle(self, axis: int, name: str) -> None:
        def is_level(state: State) -> bool:
            return state.tilt_torsion.tilt < LEVEL

        self._controls.slider(
            f"{name.capitalize()} (°)",
            HINTS[axis],
            Bound(
                lambda frame: frame.state.tilt_torsion[axis],
                lambda _, value: SetTiltTorsion(axis, value),
            ),
            SPANS[axis],
            disabled=is_level if axis == 0 else None,
        )

    def updates(self, frame: Frame) -> Iterator[Update]:
        """Yield the updates that show a frame."""
        state, here = frame.state, frame.state.tilt_torsion
        design, place = state.design, (state.position, here.torsion)
        tilts = tilt_map(design, *place, tool=state.tool)
        least = greatest_tilt(design, *place, tool=state.tool)
        yield self._top, "content", box(*summary(frame, here, least, self._here))
        home = tilt_torsion_of(design.home_pose.rotation)
        yield self._map, "content", box(polar_map(tilts, least, here, home))
        title = caption("What ends the tilts, by share of azimuths")
        yield self._legend, "content", box(title, legend(tilts))
        yield from self._controls.updates(frame)
        strip = strip_words(self._here, here, least)
        yield self._strip, "visible", strip != ""
        yield self._strip, "content", box(strip)
        yield from self._tilts_under_way.updates()
        view = frame.state.view.orientation
        yield self._scale, "visible", view.tilts
        if view.tilts:
            yield self._scale, "content", box(tilts_words(self._tilts))
        yield self._volume, "visible", view.over != "none"
        if view.over != "none":
            yield self._volume, "content", box(range_words(self._ranges))

    def _go(self, text: str, client: viser.ClientHandle) -> None:
        """Tilt the platform as a page sent it, (azimuth, tilt) in degrees."""
        angles: tuple[float, float] | None = decode_text(text, _TILT)
        if angles is not None:
            self._session.do(GoToTilt(*angles), who=client.client_id)

    def _turn(self, text: str, client: viser.ClientHandle) -> None:
        """Turn the platform to a torsion that a page sent, in degrees."""
        torsion: float | None = decode_text(text, _TORSION)
        if torsion is not None:
            self._session.do(SetTiltTorsion(ANGLES.index("torsion"), torsion), who=client.client_id)


def summary(
    frame: Frame, here: TiltTorsion, least: GreatestTilt, feed: PositionFeed
) -> Iterator[str]:
    """Yield the greatest tilt, the share of orientations and the range of torsions."""
    state, design = frame.state, frame.state.design
    if math.isnan(least.tilt):
        yield alert("Tilt zero is beyond a limit here", f"It violates {least.limit}.")
    else:
        why = ""
        if least.limit is not None:
            azimuth = f"{format_decimals(least.azimuth, 0)}°"
            why = f", ended by {least.limit} at azimuth {azimuth}"
        about = "" if state.view.at == "b4" else f"about {state.point}, "
        yield (
            f'<div><span class="ex-large">{_degrees(least.tilt)}</span> '
            f"{dim('greatest tilt in every azimuth')}</div>"
            + caption(f"{about}at torsion {_degrees(here.torsion)}{why}")
        )
    share = best = "…"
    if feed.drawing is not None:
        share = share_words(feed.drawing.share)
        best = best_words(feed.drawing.by_torsion.best, tilt_here(feed, here, least))
    if feed.problem is not None:
        share = best = "unknown"
        yield problem(feed, "The share and the largest tilt could not be computed", "")
    torsions = torsion_range(
        design, state.position, here.torsion, here.azimuth, here.tilt, tool=state.tool
    )
    span = "none here"
    if not math.isnan(torsions.low):
        span = f"{_degrees(torsions.low)} to {_degrees(torsions.high)}"
        if torsions.low_limit is None:
            span = "all"
    yield table(
        (
            row(
                dim("Largest at any torsion"),
                best,
                look=look_of(feed),
                hint="The greatest tilt in every azimuth at the torsion that allows the most",
            ),
            row(
                dim("Share of all orientations"),
                share,
                look=look_of(feed),
                hint="Share of all orientations that this position can have within the limits, "
                "with its standard error",
            ),
            row(
                dim("Torsions without a gap"),
                span,
                hint="Torsions that a turn about the platform's z-axis leads to, at the "
                "present azimuth and tilt",
            ),
        )
    )


def strip_words(feed: PositionFeed, here: TiltTorsion, least: GreatestTilt) -> str:
    """Return the strip of torsions as HTML; "" before the first drawing."""
    if feed.drawing is None:
        return ""
    tilt = tilt_here(feed, here, least)
    strip = torsion_strip(feed.drawing.by_torsion, here.torsion, tilt)
    return f'<div class="{look_of(feed)}">{strip}</div>'


def look_of(feed: PositionFeed) -> str:
    """Return the class of what belongs to the drawing of a feed."""
    return "" if feed.drawing is None or feed.is_current else "is-outdated"


def tilt_here(feed: PositionFeed, here: TiltTorsion, least: GreatestTilt) -> float:
    """Return the greatest tilt at the present torsion, at the position of the drawing."""
    if feed.drawing is None or feed.is_current:
        return least.tilt
    return tilt_at(feed.drawing.by_torsion, here.torsion)


def share_words(share: OrientationShare) -> str:
    """Return a share of all orientations in words."""
    if share.share in (0.0, 1.0):
        return f"{'all' if share.share else 'none'} of {share.orientations:,}"
    return f"{100.0 * share.share:.2f} % ± {100.0 * share.standard_error:.2f} %"


def best_words(best: GreatestTilt, tilt: float) -> str:
    """Return the greatest tilt at any torsion in words, beside that at the present one."""
    if math.isnan(best.tilt):
        return "none"
    if best.tilt - tilt <= SAME_TILT:
        return f"{_degrees(best.tilt)}, as here"
    return f"{_degrees(best.tilt)} at {_degrees(best.torsion)}"


def tilts_words(feed: TiltsFeed) -> str:
    """Return the scale of the colours of tilts, or how far they are, as HTML."""
    if feed.problem is not None:
        return problem(feed, "The tilts could not be computed", "Compute the tilts")
    if feed.drawing is None:
        return dim(progress(feed).capitalize())
    look = "" if feed.is_current else "is-outdated"
    return f'<div class="{look}">{scale_of_tilts(feed.drawing)}</div>'


def range_words(feed: RangeFeed) -> str:
    """Return the volume over a range of tilts, as HTML."""
    if feed.problem is not None:
        return problem(feed, "The solid could not be made", "Compute the solid")
    drawing = feed.drawing
    if drawing is None:
        return dim("Computing …")
    solid, design = drawing.solid, drawing.request.design
    look = "" if feed.is_current else "is-outdated"
    if solid.is_empty:
        return alert("This workspace is empty", f"Emptied by: {', '.join(solid.empty_because)}.")
    bound, hint = BOUNDS[drawing.request.over]
    text = f"{bound} {format_number(solid.volume, 5, size=design.reach**3)} units³"
    name = dim(f"{drawing.request.over.capitalize()} workspace")
    return f'<div class="{look}">{table((row(name, text, hint=f"{VOLUME_HINT} {hint}"),))}</div>'


def _degrees(angle: float) -> str:
    return f"{format_decimals(angle, 1)}°"
