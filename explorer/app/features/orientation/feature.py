"""The tab Tilt: what orientations a position can have, and positions over orientations."""

from __future__ import annotations

import math
from collections.abc import Iterator
from typing import Annotated

import msgspec
import numpy as np
import viser

from explorer.app.features.feature import Feature, Services, Tab, html_of, look_of, problem
from explorer.app.features.orientation import maps, work
from explorer.app.features.workspace.slice_map import AXES, keeps_above, level_within
from explorer.app.inputs.bindings import item
from explorer.app.inputs.controls import Controls
from explorer.app.inputs.ranges import Span
from explorer.app.scene.placing import NO_POINTS, Placed, ScenePart
from explorer.app.state.actions import Action
from explorer.app.state.frame import Frame
from explorer.app.state.view import WorkspaceView
from explorer.app.widgets.markup import alert, box, caption, dim, remark, row, table
from explorer.measures.box import corners_of
from explorer.mechanism.tilt_torsion import TiltTorsion, tilt_torsion_of
from explorer.numerics.arrays import BoolArray, FloatArray
from explorer.numerics.number_text import format_decimals
from explorer.page.browser.browser_facts import decode_text
from explorer.page.browser.viser_gaps import run_script_in
from explorer.page.look import call_script
from explorer.page.widgets.assigning import Updates
from explorer.workspace.orientations.tilts import (
    GreatestTilt,
    greatest_tilt,
    tilt_map,
    torsion_range,
)

# Size of a point over the distance of nodes.
POINT_SHARE = 0.12
SPANS = (Span(-180.0, 180.0, 0.1), Span(0.0, 180.0, 0.1), Span(-180.0, 180.0, 0.1))
HINTS = (
    "Direction in the base's xy-plane, from x towards y, that the platform's z-axis tilts towards.",
    "Angle between the z-axes of platform and base. With azimuth and torsion: the T&T angles.",
    "Turn of the platform about its own z-axis; at tilt 0 it is the yaw.",
)
NO_NODES: BoolArray = np.zeros(0, dtype=np.bool_)
# Tilt below which the azimuth has no effect, in degrees.
LEVEL = 1e-6

_Angle = Annotated[float, msgspec.Meta(ge=-180.0, le=180.0)]
_PLACE = msgspec.json.Decoder(tuple[_Angle, _Angle])


class OrientationPanel(Controls):
    """The map of tilts with its numbers and angles, and what is drawn over the workspace."""

    def __init__(self, services: Services) -> None:
        super().__init__(services)
        gui, self._here = services.gui, services.get(work.POSITION_FEED)
        tilts = services.get(work.TILTS_FEED)
        self._top = gui.add_html("")
        self._map = gui.add_html("")
        self._legend = gui.add_html("")
        for axis, name in enumerate(work.ANGLES):
            self.slider(
                f"{name.capitalize()} (°)",
                HINTS[axis],
                item(lambda frame: frame.state.tilt_torsion, axis, work.set_tilt_torsion),
                SPANS[axis],
                disabled=None if axis else lambda state: state.tilt_torsion.tilt < LEVEL,
            )
        with gui.add_folder("Over the workspace"):
            self.checkbox(
                "Greatest tilts",
                "Draw the greatest tilt in every azimuth, at the present torsion, at nodes over "
                "the workspace. The cut of the workspace opens them too.",
                "view.tilts",
            )
            failed = "The tilts could not be computed", "Compute the tilts"
            self.markup(
                lambda frame: (
                    box(html_of(tilts, maps.scale_of_tilts, *failed))
                    if frame.state.view.tilts
                    else ""
                )
            )
            self.under_way("tilts", tilts)
        services.do_on_press("orientation.go", _tilt)
        services.buttons.on("orientation.read", _read)

    def updates(self, frame: Frame) -> Updates:
        """Yield the updates that show a frame."""
        state, here = frame.state, frame.state.tilt_torsion
        design, place = state.design, (state.position, here.torsion)
        tilts = tilt_map(design, *place, tool=state.tool)
        least = greatest_tilt(design, *place, tool=state.tool)
        why = "" if state.remark is None else remark("", state.remark)
        yield self._top, "content", box(*summary(frame, here, least, self._here), why)
        home = tilt_torsion_of(design.home_pose.rotation)
        yield self._map, "content", box(maps.polar_map(tilts, least, here, home))
        title = caption("What ends the tilts, by share of azimuths")
        yield self._legend, "content", box(title, maps.legend(tilts))
        yield from super().updates(frame)


def _angles_at(text: str) -> tuple[float, float] | None:
    """Return azimuth and tilt at a place of the map that a page sent, in degrees."""
    place: tuple[float, float] | None = decode_text(text, _PLACE)
    if place is None:
        return None
    x, y = place
    return round(math.degrees(math.atan2(y, x)), 1), min(180.0, round(math.hypot(x, y), 1))


def _tilt(text: str) -> Action | None:
    """Return the action that tilts the platform to a place of the map."""
    angles = _angles_at(text)
    return None if angles is None else work.go_to_tilt(*angles)


def _read(text: str, client: viser.ClientHandle) -> None:
    """Answer a browser that asks for the words at a place of the map."""
    angles = _angles_at(text)
    if angles is not None:
        azimuth, tilt = map(_degrees, angles)
        run_script_in(client, call_script("map", text, f"azimuth {azimuth}, tilt {tilt}"))


def summary(
    frame: Frame, here: TiltTorsion, least: GreatestTilt, feed: work.PositionFeed
) -> Iterator[str]:
    """Yield the greatest tilt, the share of orientations and the range of torsions."""
    state = frame.state
    if math.isnan(least.tilt):
        yield alert("Tilt zero is beyond a limit here", f"It violates {least.limit}.")
    else:
        azimuth = f"{format_decimals(least.azimuth, 0)}°"
        why = f", ended by {least.limit} at azimuth {azimuth}" if least.limit is not None else ""
        about = "" if state.view.at == "b4" else f"about {state.point}, "
        yield (
            f'<div><span class="ex-large">{_degrees(least.tilt)}</span> '
            f"{dim('greatest tilt in every azimuth')}</div>"
            + caption(f"{about}at torsion {_degrees(here.torsion)}{why}")
        )
    share = best = "…"
    if feed.drawing is not None:
        found = feed.drawing.share
        share = f"{100.0 * found.share:.2f} % ± {100.0 * found.standard_error:.2f} %"
        if found.share in (0.0, 1.0):
            share = f"{'all' if found.share else 'none'} of {found.orientations:,}"
        best = best_words(feed.drawing.by_torsion.best, least.tilt)
    if feed.problem is not None:
        share = best = "unknown"
        yield problem(feed, "The share and the largest tilt could not be computed", "")
    torsions = torsion_range(
        state.design, state.position, here.torsion, here.azimuth, here.tilt, tool=state.tool
    )
    span = f"{_degrees(torsions.low)} to {_degrees(torsions.high)}"
    if math.isnan(torsions.low) or torsions.low_limit is None:
        span = "none here" if math.isnan(torsions.low) else "all"
    look = look_of(feed)
    largest = "The greatest tilt in every azimuth at the torsion that allows the most"
    possible = "Share of all orientations that this position can have within the limits, with its "
    turns = "Torsions that a turn about the platform's z-axis leads to, at the present azimuth "
    yield table(
        (
            row(dim("Largest at any torsion"), best, look=look, hint=largest),
            row(
                dim("Share of all orientations"), share, look=look, hint=f"{possible}standard error"
            ),
            row(dim("Torsions without a gap"), span, hint=f"{turns}and tilt"),
        )
    )


def best_words(best: GreatestTilt, tilt: float) -> str:
    """Return the greatest tilt at any torsion in words, beside that at the present one."""
    if math.isnan(best.tilt):
        return "none"
    if best.tilt - tilt <= maps.SAME_TILT:
        return f"{_degrees(best.tilt)}, as here"
    return f"{_degrees(best.tilt)} at {_degrees(best.torsion)}"


def _degrees(angle: float) -> str:
    return f"{format_decimals(angle, 1)}°"


class OrientationScene(ScenePart):
    """Points over the workspace in the colours of their tilts."""

    def __init__(self, services: Services) -> None:
        scene = services.scene
        self._tilts = services.get(work.TILTS_FEED)
        self._points = scene.add_point_cloud(
            "/orientation/tilts",
            np.zeros((1, 3), dtype=np.float32),
            np.zeros((1, 3), dtype=np.uint8),
            point_size=0.1,
            point_shape="circle",
            visible=False,
        )

    def updates(self, placed: Placed) -> Updates:
        """Yield the updates that draw the tilts of a frame."""
        view, scale = placed.frame.state.view, placed.scale
        tilts = self._tilts.drawing if view.tilts else None
        visible = NO_NODES if tilts is None else nodes_beside_cut(tilts, view.workspace)
        yield self._points, "visible", bool(visible.any())
        if tilts is not None and visible.any():
            yield self._points, "points", (scale * tilts.positions[visible]).astype(np.float32)
            yield self._points, "colors", maps.colours_of(tilts.tilts[visible], maps.most_of(tilts))
            yield self._points, "point_size", POINT_SHARE * scale * tilts.step

    def corners(self, placed: Placed) -> FloatArray:
        """Return the corners of the box about the nodes."""
        tilts = self._tilts.drawing
        if tilts is None or not len(tilts.positions):
            return NO_POINTS
        ends = np.array([tilts.positions.min(axis=0), tilts.positions.max(axis=0)])
        return placed.scale * corners_of(ends)


def nodes_beside_cut(drawing: work.TiltsDrawing, view: WorkspaceView) -> BoolArray:
    """Return which nodes the cut of the workspace keeps, shape (n,)."""
    if view.cut is None or not len(drawing.positions):
        return np.ones(len(drawing.positions), dtype=np.bool_)
    along = drawing.positions[:, AXES.index(view.cut)]
    level = level_within(float(along.min()), float(along.max()), view.level)
    return np.asarray(along >= level if keeps_above(view.cut, view.flipped) else along <= level)


ORIENTATION = Feature(
    "orientation",
    manual="orientation.md#On the page",
    tabs=(Tab("analyse", "Tilt", OrientationPanel, viser.Icon.COMPASS),),
    scene=(OrientationScene,),
    later_feeds=(work.POSITION_FEED, work.TILTS_FEED),
)
