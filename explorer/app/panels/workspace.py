"""The workspace: what is drawn of it, its numbers, and files of it."""

from __future__ import annotations

from collections.abc import Callable, Iterator, Mapping
from dataclasses import replace
from html import escape
from typing import Any

import numpy as np
import viser
from numpy.typing import NDArray

from explorer.app.actions import Action, SetView
from explorer.app.assigning import Update
from explorer.app.colours import css
from explorer.app.controls import Controls, Span
from explorer.app.panels.html import DIM, alert
from explorer.app.panels.ranges import coordinate_span, fine_step, round_up
from explorer.app.session import Session
from explorer.app.state import Frame, State
from explorer.app.tasks import (
    BAND_EDGES,
    LIVE_TOLERANCE,
    WARN_CONDITION,
    WorkspaceDrawing,
    band_colours,
)
from explorer.app.workspace_feed import WorkspaceFeed

FORMATS = ("3mf", "stl", "glb", "obj", "ply")
COLOURINGS = {"one colour": "plain", "smallest margin": "margin", "1 / cond J": "condition"}
ORIENTATIONS = {"of the present pose": "pose", "of the home pose": "home"}
CUTS = {"no cut": None, "across x": "x", "across y": "y", "across z": "z"}
BLANK = np.full((8, 8, 3), 255, dtype=np.uint8)

Export = Callable[[str, str, int | None], None]
"""Sends a file to one browser: of "workspace" or "hull", in a format, to a client."""


class WorkspacePanel:
    """Controls of the workspace."""

    def __init__(self, gui: viser.GuiApi, session: Session, export: Export) -> None:
        self._controls = controls = Controls(gui, session)
        with gui.add_folder("Workspace of constant orientation"):
            controls.checkbox(
                "Solid",
                "Draw the positions of b4 within all limits at one orientation.",
                lambda frame: frame.state.view.workspace.solid,
                lambda state, on: _changed(state, solid=on),
            )
            controls.dropdown(
                "Orientation",
                "Whose orientation the workspace has.",
                tuple(ORIENTATIONS),
                lambda frame: _key(ORIENTATIONS, frame.state.view.workspace.orientation),
                lambda state, chosen: _changed(state, orientation=ORIENTATIONS[chosen]),
            )
            controls.dropdown(
                "Colour by",
                "One colour, the smallest margin |κ|, or the inverse condition number.",
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
                lambda state, chosen: _changed(state, cut=CUTS[chosen]),
            )
            controls.slider(
                "at",
                "Where the cutting plane stands, in design units.",
                lambda frame: frame.state.view.workspace.level,
                lambda state, value: _changed(state, level=value),
                coordinate_span,
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
                hint="3MF carries unit, name and colour; STL is a bare mesh in millimetres.",
            )
            for what in ("workspace", "hull"):
                self._add_export(gui, what, export)

    def updates(self, frame: Frame, feed: WorkspaceFeed) -> Iterator[Update]:
        """Yield what makes the panel show the frame."""
        yield from self._controls.updates(frame)
        drawing = feed.drawing
        slice_map = drawing.slice_map if drawing is not None else None
        for handle in (self._caption, self._map):
            yield handle, "visible", slice_map is not None
        if slice_map is not None:
            across, up = slice_map.axes
            text = (
                f"{across} from {slice_map.lows[0]:.4g} to {slice_map.highs[0]:.4g}, "
                f"{up} from {slice_map.lows[1]:.4g} to {slice_map.highs[1]:.4g} upwards"
            )
            yield (
                self._caption,
                "content",
                f'<div style="{DIM};font-size:12px;padding:2px 10px">{text}</div>',
            )
            yield self._map, "image", _picture(slice_map.pixels)

    def _add_export(self, gui: viser.GuiApi, what: str, export: Export) -> None:
        button = gui.add_button(
            f"Export {what}", icon=viser.Icon.DOWNLOAD, hint=f"Download the {what} as a mesh."
        )

        @button.on_click
        def _(event: viser.GuiEvent[viser.GuiButtonHandle]) -> None:
            export(what, self._format.value, event.client_id)


class WorkspaceNumbers:
    """The numbers of the workspace, beside those of the singularities."""

    def __init__(self, gui: viser.GuiApi) -> None:
        self._html = gui.add_html("")

    def updates(self, frame: Frame, feed: WorkspaceFeed) -> Iterator[Update]:
        """Yield what makes the panel show the frame."""
        yield self._html, "content", workspace_summary(frame, feed)


def tolerance_of(state: State) -> float:
    """Return the chord tolerance in design units."""
    return state.view.workspace.tolerance or LIVE_TOLERANCE * state.base.reach


def workspace_summary(frame: Frame, feed: WorkspaceFeed) -> str:
    """Return the numbers of the workspace as HTML."""
    view = frame.state.view.workspace
    if feed.problem is not None:
        return alert("The workspace could not be drawn", feed.problem)
    if not (view.solid or view.hull):
        return _note("Show the solid in the tab Workspace to measure it.")
    drawing = feed.drawing
    if drawing is None:
        return _note("Computing …")
    parts = [_headline(drawing, frame.state.design.unit_mm), _numbers(drawing)]
    if view.colour != "plain":
        parts.append(_legend(view.colour, frame.state.warn_below))
    return (
        '<div style="padding:4px 12px 8px;font-size:12.5px;line-height:1.45;'
        f'font-variant-numeric:tabular-nums">{"".join(parts)}</div>'
    )


def _headline(drawing: WorkspaceDrawing, unit_mm: float) -> str:
    if drawing.volume <= 0.0:
        causes = ", ".join(drawing.empty_because)
        return alert("The workspace is empty", f"Emptied by: {causes}.")
    litres = drawing.volume * (unit_mm / 100.0) ** 3
    return (
        f'<div style="font-size:15px;font-weight:600">{drawing.volume:.6g} units³</div>'
        f'<div style="{DIM};margin-bottom:6px">exact volume, {litres:.4g} litres</div>'
    )


def _numbers(drawing: WorkspaceDrawing) -> str:
    rows: list[tuple[str, str, str]] = []
    nodes = drawing.nodes
    if nodes is not None:
        rows += [
            ("Nodes", f"{nodes.count:,}", "The paper's measure: grid nodes within the limits"),
            ("Node volume", f"{nodes.volume:.6g}", "Nodes times step³; it overstates the volume"),
            ("Node step", f"{nodes.step:.4g}", "Of the grid, in design units"),
        ]
    if drawing.extent is not None:
        for axis, low, high in zip("xyz", *drawing.extent, strict=True):
            text = f"{low:.4g} … {high:.4g}".replace("-", "−")
            rows.append((f"Extent {axis}", text, "Of the solid, in design units"))
    if drawing.volume > 0.0:
        error = 100.0 * (drawing.mesh_volume / drawing.volume - 1.0)
        text = f"{error:+.2g} %".replace("-", "−")
        rows.append(("Mesh volume", text, "Of the drawn solid, against the exact one"))
    if drawing.hull_volume is not None:
        rows.append(("Hull volume", f"{drawing.hull_volume:.6g}", "Of the convex hull"))
    rows.append(("Computed in", f"{1000.0 * drawing.seconds:.0f} ms", "In the worker process"))
    cells = "".join(
        f'<tr title="{escape(hint)}"><td style="{DIM};padding:1px 8px 1px 0">{name}</td>'
        f'<td style="text-align:right">{value}</td></tr>'
        for name, value, hint in rows
    )
    return f'<table style="width:100%;border-collapse:collapse;margin:4px 0 8px">{cells}</table>'


def _legend(colour: str, warn_below: float) -> str:
    unit, name = (
        (warn_below, "Smallest |κ| (design units)")
        if colour == "margin"
        else (WARN_CONDITION, "1 / cond J")
    )
    bands = "".join(f'<div style="flex:1;background:{css(band)}"></div>' for band in band_colours())
    # All bands are drawn equally wide, so the values at their edges are not evenly spaced.
    share = 100.0 / len(BAND_EDGES)
    ticks = "".join(
        f'<span style="position:absolute;left:{index * share:g}%;transform:translateX('
        f'{"0" if index == 0 else "-50%"})">{BAND_EDGES[index] * unit:.2g}</span>'
        for index in (0, 2, 4, 6, 9)
    )
    return (
        f'<div style="{DIM};margin-bottom:3px">{name}</div>'
        f'<div style="display:flex;height:11px;border-radius:2px;overflow:hidden">{bands}</div>'
        f'<div style="position:relative;height:18px;font-size:11px;{DIM}">{ticks}</div>'
    )


def _note(text: str) -> str:
    return f'<div style="padding:8px 12px;{DIM}">{text}</div>'


def _picture(pixels: NDArray[np.uint8]) -> NDArray[np.uint8]:
    """Return the map on white, enlarged so that its pixels stay sharp."""
    alpha = pixels[..., 3:].astype(np.float64) / 255.0
    flat = pixels[..., :3] * alpha + 255.0 * (1.0 - alpha)
    return np.repeat(np.repeat(flat.astype(np.uint8), 3, axis=0), 3, axis=1)


def _tolerance_span(state: State) -> Span:
    reach = state.base.reach
    step = fine_step(reach, 5e3)
    return Span(step, round_up(0.05 * reach), step)


def _changed(state: State, **changes: Any) -> Action:
    return SetView(replace(state.view, workspace=replace(state.view.workspace, **changes)))


def _key(options: Mapping[str, str | None], value: str | None) -> str:
    return next(label for label, option in options.items() if option == value)
