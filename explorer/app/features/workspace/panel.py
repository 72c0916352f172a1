"""The workspace: what is drawn of it, and files of it."""

from __future__ import annotations

import math
from collections.abc import Callable, Iterator, Mapping
from dataclasses import replace
from typing import Any

import numpy as np
import viser
from numpy.typing import NDArray

from explorer.app.features.workspace.feed import WorkspaceFeed
from explorer.app.features.workspace.slice_map import level_within
from explorer.app.features.workspace.tasks import LIVE_TOLERANCE, STEP, WorkspaceDrawing
from explorer.app.session.session import Session
from explorer.app.state.action import Action
from explorer.app.state.actions import SetView, StartThere
from explorer.app.state.frame import Frame
from explorer.app.state.state import State
from explorer.app.widgets.assigning import Update
from explorer.app.widgets.controls import Controls, Span
from explorer.app.widgets.markup import DIM, alert, format_number
from explorer.app.widgets.ranges import coordinate_span, fine_step, round_up
from explorer.app.widgets.under_way import UnderWay
from explorer.mechanism.pose import Pose

FORMATS = ("3mf", "stl", "glb", "obj", "ply", STEP)
REGIONS = {"within the limits": "limits", "reachable": "reachable"}
STARTS = {"the home position": "home", "the present position": "pose"}
COLOURINGS = {"one colour": "plain", "smallest margin": "margin", "1 / cond J": "condition"}
ORIENTATIONS = {"of the present pose": "pose", "of the home pose": "home"}
CUTS = {"no cut": None, "across x": "x", "across y": "y", "across z": "z"}
BLANK = np.zeros((8, 8, 4), dtype=np.uint8)

Export = Callable[[str, str, int | None], None]
"""Sends a file to one browser: of "workspace" or "hull", in a format, to a client."""


class WorkspacePanel:
    """Controls of the workspace."""

    def __init__(self, gui: viser.GuiApi, session: Session, export: Export) -> None:
        self._controls = controls = Controls(gui, session)
        self._session = session
        self._there: Pose | None = None
        # Of the solid that is drawn, which the cut is laid through.
        self._drawing: WorkspaceDrawing | None = None
        with gui.add_folder("Workspace of constant orientation"):
            controls.checkbox(
                "Solid",
                "Draw the positions of b4 within all limits at one orientation.",
                lambda frame: frame.state.view.workspace.solid,
                lambda state, on: _changed(state, solid=on),
            )
            controls.dropdown(
                "Region",
                "All positions within the limits, or those that a way without a collision "
                "of legs leads to.",
                tuple(REGIONS),
                lambda frame: _key(REGIONS, frame.state.view.workspace.region),
                lambda state, chosen: _changed(state, region=REGIONS[chosen]),
            )
            controls.dropdown(
                "Reached from",
                "Where the ways start, at the orientation of the workspace.",
                tuple(STARTS),
                lambda frame: _key(STARTS, frame.state.view.workspace.start),
                lambda state, chosen: _changed(state, start=STARTS[chosen]),
                disabled=lambda state: state.view.workspace.region == "limits",
            )
            self._under_way = UnderWay(gui, "workspace")
            self._trouble = gui.add_html("", visible=False)
            self._go = gui.add_button(
                "Go there",
                icon=viser.Icon.MAP_PIN,
                hint="Move the platform to that position and let the ways start from it.",
                visible=False,
            )
            self._go.on_click(self._went)
            controls.dropdown(
                "Orientation",
                "Whose orientation the workspace has.",
                tuple(ORIENTATIONS),
                lambda frame: _key(ORIENTATIONS, frame.state.view.workspace.orientation),
                lambda state, chosen: _changed(state, orientation=ORIENTATIONS[chosen]),
            )
            controls.dropdown(
                "Colour by",
                "One colour, the smallest margin |δ|, or the inverse condition number.",
                tuple(COLOURINGS),
                lambda frame: _key(COLOURINGS, frame.state.view.workspace.colour),
                lambda state, chosen: _changed(state, colour=COLOURINGS[chosen]),
            )
            controls.checkbox(
                "Convex hull",
                "Draw the convex hull of the workspace.",
                lambda frame: frame.state.view.workspace.hull,
                lambda state, on: _changed(state, hull=on),
            )
            controls.checkbox(
                "Singular planes",
                "Draw the three planes of singular positions, at the present orientation.",
                lambda frame: frame.state.view.workspace.planes,
                lambda state, on: _changed(state, planes=on),
            )
        with gui.add_folder("Cut"):
            controls.dropdown(
                "Cut open",
                "Take away one side of the solid, to see inside.",
                tuple(CUTS),
                lambda frame: _key(CUTS, frame.state.view.workspace.cut),
                lambda state, chosen: self._cut(state, CUTS[chosen]),
            )
            controls.slider(
                "at",
                "Where the cutting plane stands, in design units.",
                lambda frame: self._level(frame.state),
                lambda state, value: _changed(state, level=value),
                self._cut_span,
                disabled=lambda state: state.view.workspace.cut is None,
            )
            self._caption = gui.add_html("", visible=False)
            self._map = gui.add_image(BLANK, format="png", visible=False)
        with gui.add_folder("Export (millimetres)"):
            controls.slider(
                "tolerance",
                "Largest distance of a facet from the true surface, in design units.",
                lambda frame: tolerance_of(frame.state),
                lambda state, value: _changed(state, tolerance=value),
                _tolerance_span,
            )
            self._format = gui.add_dropdown(
                "Format",
                FORMATS,
                hint="3MF carries unit, name and colour; STL is a bare mesh in millimetres; STEP "
                "has the exact faces of the workspace within the limits, and needs the extra cad.",
            )
            for what in ("workspace", "hull"):
                self._add_export(gui, what, export)

    @property
    def file_format(self) -> str:
        """The format chosen for files."""
        return self._format.value

    def updates(self, frame: Frame, feed: WorkspaceFeed) -> Iterator[Update]:
        """Yield what makes the panel show the frame."""
        drawing = self._drawing = feed.drawing
        yield from self._controls.updates(frame)
        yield from self._under_way.updates(feed)
        yield from self._show_trouble(drawing)
        slice_map = drawing.slice_map if drawing is not None else None
        for handle in (self._caption, self._map):
            yield handle, "visible", slice_map is not None
        if drawing is not None and slice_map is not None:
            across, up = slice_map.axes
            reach = frame.state.design.reach
            (left, low), (right, high) = (
                [format_number(float(end), size=reach) for end in ends]
                for ends in (slice_map.lows, slice_map.highs)
            )
            text = f"{across} from {left} to {right}, {up} from {low} to {high} upwards"
            if drawing.reached is not None:
                text += "; pale red: within the limits and out of reach"
            yield (
                self._caption,
                "content",
                f'<div style="{DIM};font-size:12px;padding:2px 10px">{text}</div>',
            )
            yield self._map, "image", _enlarged(slice_map.pixels)

    def _cut(self, state: State, axis: str | None) -> Action:
        """Return what cuts the solid open: on another axis than before, through its middle."""
        if axis is None or axis == state.view.workspace.cut:
            return _changed(state, cut=axis)
        ends = self._ends(axis)
        if ends is None:
            return _changed(state, cut=axis, level=None)
        step = coordinate_span(state).step
        middle = round(0.5 * sum(ends) / step) * step
        return _changed(state, cut=axis, level=level_within(*ends, middle))

    def _level(self, state: State) -> float:
        """Return where the solid is cut; where it would be, if it is not."""
        view = state.view.workspace
        ends = None if view.cut is None else self._ends(view.cut)
        return (view.level or 0.0) if ends is None else level_within(*ends, view.level)

    def _cut_span(self, state: State) -> Span:
        """Return the extent of the solid on the axis across which it is cut."""
        span, axis = coordinate_span(state), state.view.workspace.cut
        ends = None if axis is None else self._ends(axis)
        if ends is None:
            return span
        low, high = math.ceil(ends[0] / span.step), math.floor(ends[1] / span.step)
        return Span(low * span.step, high * span.step, span.step) if low < high else span

    def _ends(self, axis: str) -> tuple[float, float] | None:
        """Return the extent of the solid that is drawn on an axis, None if there is none."""
        if self._drawing is None or self._drawing.extent is None:
            return None
        low, high = (float(end["xyz".index(axis)]) for end in self._drawing.extent)
        return low, high

    def _show_trouble(self, drawing: WorkspaceDrawing | None) -> Iterator[Update]:
        """Yield why nothing can be reached, and where it could be started from."""
        trouble = None if drawing is None else drawing.trouble
        self._there = None
        yield self._trouble, "visible", trouble is not None
        if drawing is not None and trouble is not None:
            if trouble.nearest is not None:
                self._there = Pose.of(trouble.nearest, drawing.request.rotation)
            text = f"{trouble.reason[0].upper()}{trouble.reason[1:]}."
            which = "home" if drawing.request.start is None else "present"
            title = f"The {which} position is no start"
            yield self._trouble, "content", alert(title, text)
        yield self._go, "visible", self._there is not None

    def _went(self, event: viser.GuiEvent[viser.GuiButtonHandle]) -> None:
        if self._there is not None:
            self._session.do(StartThere(self._there), who=event.client_id)

    def _add_export(self, gui: viser.GuiApi, what: str, export: Export) -> None:
        button = gui.add_button(
            f"Export {what}", icon=viser.Icon.DOWNLOAD, hint=f"Download the {what} as a file."
        )

        @button.on_click
        def _(event: viser.GuiEvent[viser.GuiButtonHandle]) -> None:
            export(what, self._format.value, event.client_id)


def tolerance_of(state: State) -> float:
    """Return the chord tolerance in design units."""
    return state.view.workspace.tolerance or LIVE_TOLERANCE * state.base.reach


def _enlarged(pixels: NDArray[np.uint8]) -> NDArray[np.uint8]:
    """Return the map so large that its pixels stay sharp."""
    return np.repeat(np.repeat(pixels, 3, axis=0), 3, axis=1)


def _tolerance_span(state: State) -> Span:
    reach = state.base.reach
    step = fine_step(reach, 5e3)
    return Span(step, round_up(0.05 * reach), step)


def _changed(state: State, **changes: Any) -> Action:
    return SetView(replace(state.view, workspace=replace(state.view.workspace, **changes)))


def _key(options: Mapping[str, str | None], value: str | None) -> str:
    return next(label for label, option in options.items() if option == value)
