"""Controls of the workspace: its drawing, its cut and its files."""

from __future__ import annotations

import math
from collections.abc import Iterator
from dataclasses import replace

import numpy as np
import viser

from explorer.app.features.feature import Services
from explorer.app.features.workspace.feed import WorkspaceFeed
from explorer.app.features.workspace.files import FORMATS, WorkspaceFiles, tolerance_of
from explorer.app.features.workspace.slice_map import Axis, level_within
from explorer.app.features.workspace.tasks import WorkspaceDrawing
from explorer.app.state.action import Action
from explorer.app.state.actions import Set, StartThere
from explorer.app.state.frame import Frame
from explorer.app.state.state import State
from explorer.app.widgets.assigning import Update
from explorer.app.widgets.controls import At, Bound, Controls, Span
from explorer.app.widgets.markup import alert, format_number, note, sentence
from explorer.app.widgets.ranges import coordinate_span, fine_step, round_up
from explorer.app.widgets.under_way import UnderWay
from explorer.mechanism.pose import Pose

REGIONS = {"within the limits": "limits", "reachable": "reachable"}
STARTS = {"the home position": "home", "the present position": "pose"}
COLOURINGS = {"one colour": "plain", "smallest margin": "margin", "1 / cond J": "condition"}
ORIENTATIONS = {"of the present pose": "pose", "of the home pose": "home"}
CUTS: dict[str, Axis | None] = {
    "no cut": None,
    "across x": "x",
    "across y": "y",
    "across z": "z",
}
CUT_WORDS = {axis: words for words, axis in CUTS.items()}
BLANK = np.zeros((8, 8, 4), dtype=np.uint8)


class WorkspacePanel:
    """Controls of the workspace."""

    def __init__(self, services: Services) -> None:
        gui = services.gui
        self._controls = controls = Controls(gui, services.session)
        self._session = services.session
        self._feed = services.get(WorkspaceFeed)
        files = services.get(WorkspaceFiles)
        self._nearest_start: Pose | None = None
        # The drawing whose solid is cut.
        self._drawing: WorkspaceDrawing | None = None
        with gui.add_folder("Workspace of constant orientation"):
            controls.checkbox(
                "Solid",
                "Draw the positions of b4 within all limits at one orientation.",
                "view.workspace.solid",
            )
            controls.dropdown(
                "Region",
                "All positions within the limits, or those that a path without a collision "
                "of legs leads to.",
                REGIONS,
                "view.workspace.region",
            )
            controls.dropdown(
                "Reached from",
                "Where the paths start, at the orientation of the workspace.",
                STARTS,
                "view.workspace.start",
                disabled=lambda state: state.view.workspace.region == "limits",
            )
            self._under_way = UnderWay(gui, "workspace", self._feed)
            self._trouble = gui.add_html("", visible=False)
            self._go = gui.add_button(
                "Go there",
                icon=viser.Icon.MAP_PIN,
                hint="Move the platform to that position and let the paths start from it.",
                visible=False,
            )
            self._go.on_click(self._go_there)
            controls.dropdown(
                "Orientation",
                "The orientation of the platform all over the workspace.",
                ORIENTATIONS,
                "view.workspace.orientation",
            )
            controls.dropdown(
                "Colour by",
                "One colour, the smallest margin |δ|, or the inverse condition number.",
                COLOURINGS,
                "view.workspace.colour",
            )
            controls.checkbox(
                "Convex hull",
                "Draw the convex hull of the workspace.",
                "view.workspace.hull",
            )
            controls.checkbox(
                "Singular planes",
                "Draw the three planes of singular positions, at the present orientation.",
                "view.workspace.planes",
            )
        with gui.add_folder("Cut"):
            controls.dropdown(
                "Cut open",
                "Take away one side of the solid, to see inside.",
                CUTS,
                Bound(
                    lambda frame: CUT_WORDS[frame.state.view.workspace.cut],
                    lambda state, chosen: self._cut(state, CUTS[chosen]),
                ),
            )
            controls.slider(
                "at",
                "Position of the cutting plane, in design units.",
                Bound(
                    lambda frame: self._level(frame.state),
                    lambda _, value: Set("view.workspace.level", value, "Cut at"),
                ),
                self._cut_span,
                disabled=lambda state: state.view.workspace.cut is None,
            )
            self._caption = gui.add_html("", visible=False)
            self._map = gui.add_image(BLANK, format="png", visible=False)
        with gui.add_folder("Export (millimetres)"):
            controls.slider(
                "tolerance",
                "Largest distance of a facet from the true surface, in design units.",
                At("view.workspace.tolerance", default=tolerance_of),
                _tolerance_span,
            )
            file_format = gui.add_dropdown(
                "Format",
                FORMATS,
                hint="3MF carries unit, name and colour; STL is a bare mesh in millimetres; STEP "
                "has the exact faces of the workspace within the limits, and needs pip install "
                '"flagged-explorer[cad]".',
            )
            file_format.on_update(lambda _: files.choose(file_format.value))
            for what in ("workspace", "hull"):
                self._add_export(gui, what, files)

    def updates(self, frame: Frame) -> Iterator[Update]:
        """Yield the updates that show a frame."""
        drawing = self._drawing = self._feed.drawing
        yield from self._controls.updates(frame)
        yield from self._under_way.updates()
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
                text += "; pale red: within the limits, not reachable"
            yield self._caption, "content", note(text)
            yield self._map, "image", slice_map.picture

    def _cut(self, state: State, axis: Axis | None) -> Action:
        """Return the action that cuts the solid open; a new axis starts in the middle."""
        view, level = state.view.workspace, None
        ends = None if axis is None else self._ends(axis)
        if axis is None or axis == view.cut:
            level = view.level
        elif ends is not None:
            step = coordinate_span(state).step
            level = level_within(*ends, round(0.5 * sum(ends) / step) * step)
        new = replace(view, cut=axis, level=level)
        return Set("view.workspace", new, "Cut open", CUT_WORDS[axis])

    def _level(self, state: State) -> float:
        """Return the level of the cut, or the level that a cut would have."""
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
        """Return the extent of the drawn solid on an axis; None without a solid."""
        if self._drawing is None or self._drawing.extent is None:
            return None
        low, high = (float(end["xyz".index(axis)]) for end in self._drawing.extent)
        return low, high

    def _show_trouble(self, drawing: WorkspaceDrawing | None) -> Iterator[Update]:
        """Yield why nothing can be reached, and the nearest position to start from."""
        trouble = None if drawing is None else drawing.trouble
        self._nearest_start = None
        yield self._trouble, "visible", trouble is not None
        if drawing is not None and trouble is not None:
            if trouble.nearest is not None:
                self._nearest_start = Pose.of(trouble.nearest, drawing.request.rotation)
            which = "home" if drawing.request.start is None else "present"
            title = f"The {which} position is no start"
            yield self._trouble, "content", alert(title, sentence(trouble.reason))
        yield self._go, "visible", self._nearest_start is not None

    def _go_there(self, event: viser.GuiEvent[viser.GuiButtonHandle]) -> None:
        if self._nearest_start is not None:
            self._session.do(StartThere(self._nearest_start), who=event.client_id)

    def _add_export(self, gui: viser.GuiApi, what: str, files: WorkspaceFiles) -> None:
        button = gui.add_button(
            f"Export {what}", icon=viser.Icon.DOWNLOAD, hint=f"Download the {what} as a file."
        )

        @button.on_click
        def _(event: viser.GuiEvent[viser.GuiButtonHandle]) -> None:
            files.send(what, event.client_id)


def _tolerance_span(state: State) -> Span:
    reach = state.base.reach
    step = fine_step(reach, 5e3)
    return Span(step, round_up(0.05 * reach), step)
