"""The requests for the workspace of a frame: its orientation, load and start, feeds and files.

The workspace of the tool point is that of b4, moved by the vector between them. While one drawing
is computed, only the newest request waits.
"""

from __future__ import annotations

from typing import TYPE_CHECKING, Literal

import msgspec
import numpy as np

from explorer.app.features.workspace import work
from explorer.app.scene.surfaces import Measure
from explorer.app.session.feed import Feed, FeedOf
from explorer.app.session.session import Who
from explorer.app.state.frame import Frame
from explorer.app.state.state import State
from explorer.measures.position_bands import LOAD_MEASURES, is_unstated
from explorer.mechanism.design import Design
from explorer.mechanism.machine import NO_LOAD
from explorer.mechanism.pose import Pose, Triple
from explorer.numerics.arrays import triple

if TYPE_CHECKING:
    from explorer.app.features.feature import Services

# Rotations whose entries differ by less are the same.
SAME = 1e-9


def workspace_pose(frame: Frame) -> Pose:
    """Return the pose whose orientation the workspace has: the present one, or that of home."""
    state = frame.state
    return state.design.home_pose if orientation_word(frame) == "home" else state.pose


def orientation_word(frame: Frame) -> str:
    """Return which orientation the workspace has: "present" or "home"."""
    return "home" if frame.state.view.workspace.orientation == "home" else "present"


def orientation_suffix(design: Design, rotation: work.Rows) -> str:
    """Return the suffix of the names of a workspace's measures; "" in the orientation of home."""
    is_home = np.allclose(rotation, design.home_pose.rotation, atol=SAME)
    return "" if is_home else ", turned"


def workspace_rows(frame: Frame) -> work.Rows:
    """Return the orientation of the workspace that is shown, as the rows of its matrix."""
    return work.rows_of(workspace_pose(frame).rotation)


def workspace_position(frame: Frame) -> Triple:
    """Return b4 where the shown point is where it is, in the orientation of the workspace."""
    state, pose = frame.state, workspace_pose(frame)
    return pose.position if pose == state.pose else state.pose_at(state.position, pose).position


def workspace_start(frame: Frame) -> Triple | None:
    """Return the position of b4 where paths start; None for home."""
    is_here = frame.state.view.workspace.start == "pose"
    return workspace_position(frame) if is_here else None


def tolerance_of(state: State) -> float:
    """Return the chord tolerance of what is drawn and written to files, in design units."""
    view = state.view.workspace
    share = work.LIVE_TOLERANCE if view.region == "limits" else work.PART_TOLERANCE
    return view.tolerance or share * state.base.reach


def loaded_design(state: State) -> Design:
    """Return the design, without the mass of its payload if no weights count on the page."""
    design = state.design
    if state.view.forces.weighed != "none" or not design.payload.mass_kg:
        return design
    return msgspec.structs.replace(design, payload=design.payload.with_mass(0.0))


def measure_of_colour(state: State) -> Measure:
    """Return the measure that colours the surface; "plain" for one that would be zero everywhere.

    Shares are zero without limits, errors without errors of actuators, and the deflection of a
    rigid machine.
    """
    colour = state.view.workspace.colour
    return "plain" if colour != "plain" and is_unstated(state.design, colour) else colour


def volume_request(frame: Frame) -> work.Selection:
    """Return the request for the volume of a frame's design."""
    return work.Selection(frame.state.design, workspace_rows(frame))


VOLUME_FEED = FeedOf(work.measure_volume, volume_request)
"""The feed of the volume within the limits, whether or not the solid is drawn.

It takes a tenth of the time of a drawing, and is followed before `WORKSPACE_FEED`, so that it
never waits for the drawing of the same state.
"""


def surface_of(
    feed: Feed[work.WorkspaceRequest, work.WorkspaceDrawing],
) -> work.WorkspaceSurface | None:
    """Return the newest surface; None if there is none, none is requested, or it was cancelled."""
    if isinstance(feed.part, work.WorkspaceSurface):
        return feed.part
    return None if feed.drawing is None else feed.drawing.surface


def workspace_request(frame: Frame) -> work.WorkspaceRequest | None:
    """Return the request for the workspace of a frame; None if none is shown."""
    view = frame.state.view.workspace
    if not (view.solid or view.hull):
        return None
    is_cut, level = view.cut is not None, view.level
    if view.cut is not None and level is not None:
        # The worker counts in coordinates of b4.
        level -= float(frame.state.offset(workspace_pose(frame).rotation)["xyz".index(view.cut)])
    coloured = view.colour == "margin" or is_cut
    colour = measure_of_colour(frame.state)
    # The load changes no drawing that does not show it.
    is_loaded = colour in LOAD_MEASURES or view.region == "held"
    return work.WorkspaceRequest(
        design=loaded_design(frame.state) if is_loaded else frame.state.design,
        rotation=workspace_rows(frame),
        region=view.region,
        start=workspace_start(frame) if view.region == "accessible" else None,
        colour=colour,
        cut=view.cut,
        level=level if is_cut else None,
        flipped=is_cut and view.flipped,
        tolerance=tolerance_of(frame.state),
        hull=view.hull,
        # The length changes no drawing that is not coloured by it.
        warn_below=frame.state.warn_below if coloured else 1.0,
        load=frame.state.load if is_loaded else NO_LOAD,
    )


WORKSPACE_FEED = FeedOf(work.draw_workspace, workspace_request, has_stages=True)
"""The feed of the drawn workspace, whose surface arrives before the numbers."""


# The hull consists of facets, which STEP does not take.
HULL_FORMATS = ("3mf", "stl", "glb", "obj", "ply")
FORMATS = (*HULL_FORMATS, work.STEP)
"""The formats of files; `work.STEP` takes the workspace within the limits only."""

Exported = Literal["workspace", "hull"]


def send_workspace(services: Services, what: Exported, file_format: str, who: Who) -> None:
    """Send a client a file of the workspace that is shown, or of its hull, in one of `FORMATS`."""
    state = services.session.latest_state()
    frame, region = Frame(state), state.view.workspace.region
    rows = workspace_rows(frame)
    start = workspace_start(frame) if region == "accessible" else None
    design, load = state.design, NO_LOAD
    if region == "held":
        design, load = loaded_design(state), state.load
    offset = triple(state.offset(rows)) if state.view.at == "tool" else None
    words = work.file_words(region, what, offset).replace(" ", "-")
    selection = work.Selection(design, rows, region, start, load)
    services.downloads.compute(
        who,
        f"{design.name}-{words}.{file_format}",
        work.export_mesh,
        (selection, tolerance_of(state), what, file_format, offset),
    )
