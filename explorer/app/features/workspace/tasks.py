"""The worker's tasks for the workspace: draw it, measure it, write files of it."""

from __future__ import annotations

from dataclasses import dataclass, replace

import numpy as np

from explorer.app.features.workspace.regions import (
    Part,
    Region,
    Selection,
    Trouble,
    exact_volume,
    find_part,
)
from explorer.app.features.workspace.slice_map import (
    AXES,
    CUT,
    Axis,
    SliceMap,
    keeps_above,
    level_within,
    slice_map,
)
from explorer.app.scene.bands import PLAIN, Colouring, Measure, Shell
from explorer.app.scene.creases import creased_faces
from explorer.app.session.feed import watch_of
from explorer.app.session.worker import Channel
from explorer.errors import InputError
from explorer.mechanism.design import Design
from explorer.mechanism.pose import Triple
from explorer.numerics.arrays import FloatArray
from explorer.numerics.search import ignore_stage
from explorer.statics.reactions import has_limits
from explorer.workspace.extremes import extent_of
from explorer.workspace.faces.faces import Faces, workspace_faces
from explorer.workspace.limits.constraints import HalfSpace, constraints
from explorer.workspace.slices.volume import NodeCount, Volume, workspace_nodes
from explorer.workspace.solids.booleans import convex_hull, cut_solid
from explorer.workspace.solids.solid import Solid
from explorer.workspace.solids.solids import workspace_solid

# Chord tolerances of a live solid, and of an accessible or a carried part, over the reach.
LIVE_TOLERANCE, PART_TOLERANCE = 0.004, 0.001
# The format with exact faces rather than facets.
STEP = "step"


@dataclass(frozen=True)
class MeasuredVolume:
    """The volume of a workspace within the limits with its error, in cubed design units."""

    request: Selection
    measured: Volume


def measure_volume(request: Selection) -> MeasuredVolume:
    """Return the exact volume of a workspace within the limits."""
    return MeasuredVolume(request, exact_volume(request.design, request.rotation))


@dataclass(frozen=True, kw_only=True)
class WorkspaceRequest(Selection):
    """Request to draw and measure a workspace; lengths in design units.

    Attributes:
        colour: Measure that colours the surface.
        cut: Axis across which the solid is cut open, or None.
        level: Coordinate of the cut; None, or one beyond the extent, for the middle.
        flipped: Whether the side is kept that faces the isometric camera.
        tolerance: Chord tolerance, in design units.
        hull: Whether to make the convex hull.
        warn_below: Length below which margins raise a warning.
    """

    colour: Measure
    cut: Axis | None
    level: float | None
    flipped: bool
    tolerance: float
    hull: bool
    warn_below: float

    @property
    def selection(self) -> Selection:
        """The workspace alone, without how it is drawn; a load that only colours it left out."""
        load = self.load if self.region == "held" else None
        return Selection(self.design, self.rotation, self.region, self.start, load)


@dataclass(frozen=True, eq=False)
class WorkspaceSurface:
    """What is drawn of a workspace; lengths in design units.

    Attributes:
        request: The request.
        shells: Surface, by colour.
        edges: Ends of the segments where two faces of it meet, shape (k, 2, 3).
        coarse_edge: Longest edge of a coloured triangle, if longer than usual; see
            `explorer.app.scene.bands.Colouring.shells`.
    """

    request: WorkspaceRequest
    shells: tuple[Shell, ...]
    edges: FloatArray
    coarse_edge: float | None


@dataclass(frozen=True, eq=False)
class WorkspaceDrawing:
    """A workspace drawn and measured; lengths in design units.

    Attributes:
        request: The request.
        surface: What is drawn.
        hull: Convex hull, if requested.
        slice_map: Map of the slice, if the solid is cut.
        volume: Exact volume within the limits, see `explorer.workspace.slices.volume`.
        part: Numbers of the part that is drawn; None for all within the limits.
        trouble: Why nothing is accessible or holds the load, if all within the limits is drawn
            instead.
        mesh_volume: Volume of the uncut solid.
        mesh_agrees: Whether the volume of the solid within the limits agrees with the exact one.
        hull_volume: Volume of the hull, if requested.
        extent: (lows, highs) of the solid; None if it is empty.
        nodes: The paper's node count within the limits; None if the grid is too fine.
        levels: The measure that colours the map at the edge of each band, see
            `explorer.workspace.position_bands.PositionBands`.
    """

    request: WorkspaceRequest
    surface: WorkspaceSurface
    hull: Shell | None
    slice_map: SliceMap | None
    volume: float
    part: Part | None
    trouble: Trouble | None
    mesh_volume: float
    mesh_agrees: bool | None
    hull_volume: float | None
    extent: tuple[FloatArray, FloatArray] | None
    nodes: NodeCount | None
    levels: tuple[float, ...]


def draw_workspace(request: WorkspaceRequest, channel: Channel | None = None) -> WorkspaceDrawing:
    """Return the workspace, drawn and measured.

    Args:
        request: Workspace to draw.
        channel: Channel to the parent, which gets each `Stage`, and the `WorkspaceSurface` as soon
            as it is known, and may cancel; None for neither.
    """
    design, rotation = request.design, np.array(request.rotation)
    load = (0.0,) * 6 if request.load is None else request.load
    colouring = Colouring(design, rotation, request.colour, request.warn_below, np.array(load))
    holds = request.region == "held"
    on_map = replace(colouring, measure=map_measure(design, request.colour, holds=holds))
    limits = constraints(design, rotation)

    def draw(faces: Faces) -> WorkspaceSurface:
        shells, coarse_edge = colouring.shells(faces, holds=holds and trouble is None)
        surface = WorkspaceSurface(request, shells, faces.edges, coarse_edge)
        if channel is not None:
            channel.send(surface)
        return surface

    measured = exact_volume(design, request.rotation)
    surface = None
    if request.region == "limits" and request.cut is None:
        # It is waited for; it needs none of what follows.
        surface = draw(workspace_faces(limits))
    whole = workspace_solid(design, rotation, request.tolerance, volume=measured)
    solid, part, trouble = whole, None, None
    if request.region != "limits":
        found = find_part(request.selection, request.tolerance, watch_of(channel))
        if isinstance(found, Trouble):
            trouble = found
        else:
            part, solid = found
    whole_extent = None if whole.is_empty else extent_of(design, rotation)
    extent = whole_extent if part is None else _extent(solid)
    shown, mapped, cut, level = solid, None, None, 0.0
    if request.cut is not None and extent is not None:
        axis = AXES.index(request.cut)
        level = level_within(float(extent[0][axis]), float(extent[1][axis]), request.level)
        side = -1.0 if keeps_above(request.cut, request.flipped) else 1.0
        cut = HalfSpace(CUT, side * np.eye(3)[axis], side * level)
        limits = (*limits, cut)
        shown = solid if part is None else cut_solid(solid, cut)
    if surface is None:
        surface = draw(workspace_faces(limits) if part is None else creased_faces(shown))
    if cut is not None and request.cut is not None and whole_extent is not None:
        cut_solids = (None, None) if part is None else (cut_solid(whole, cut), shown)
        left_out = "load not held" if request.region == "held" else "not accessible"
        mapped = slice_map(on_map, whole_extent, request.cut, level, *cut_solids, left_out)
    hull = convex_hull(solid) if request.hull and not solid.is_empty else None
    try:
        nodes = workspace_nodes(design, rotation)
    except InputError:
        nodes = None
    return WorkspaceDrawing(
        request=request,
        surface=surface,
        hull=None if hull is None else Shell(PLAIN, hull.vertices, hull.faces),
        slice_map=mapped,
        volume=measured.volume,
        part=part,
        trouble=trouble,
        mesh_volume=solid.volume,
        mesh_agrees=solid.agrees,
        hull_volume=None if hull is None else hull.volume,
        extent=extent,
        nodes=nodes,
        levels=on_map.bands.levels,
    )


def map_measure(design: Design, colour: Measure, *, holds: bool) -> Measure:
    """Return the measure of the map of a slice; "plain" for the margins.

    Args:
        design: The manipulator.
        colour: Measure that colours the surface.
        holds: Whether the part of the workspace that holds the load is shown.
    """
    return "share" if colour == "plain" and holds and has_limits(design) else colour


def export_mesh(
    selection: Selection,
    tolerance: float,
    what: str,
    file_format: str,
    offset: Triple | None = None,
) -> bytes:
    """Return a file of the workspace or of its hull, in millimetres.

    Args:
        selection: The workspace or the part of it.
        tolerance: Chord tolerance, in design units.
        what: "workspace" or "hull".
        file_format: A format of `explorer.export.mesh`, or `STEP` for the workspace itself.
        offset: Vector from b4 to the tool point, of which the positions are; None for b4.

    Raises:
        ExplorerError: An empty workspace, nothing accessible, a load that nothing holds, a missing
            library, or STEP of a solid without exact faces.
    """
    if file_format == STEP:
        return _exact_file(selection, offset)
    from explorer.export.mesh import mesh_bytes

    design, region = selection.design, selection.region
    if region == "limits":
        solid = workspace_solid(design, np.array(selection.rotation), tolerance)
    else:
        found = find_part(selection, tolerance, ignore_stage)
        if isinstance(found, Trouble):
            cause = "nothing holds the load: " if region == "held" else ""
            raise InputError(cause + found.reason)
        _, solid = found
    made = convex_hull(solid) if what == "hull" else solid
    if offset is not None:
        made = made.shifted(np.array(offset))
    name = f"{design.name} {file_words(region, what, offset)}"
    return mesh_bytes(made, file_format, design, name)


def _exact_file(selection: Selection, offset: Triple | None) -> bytes:
    """Return a STEP file of the workspace within the limits.

    Raises:
        InputError: A part of the workspace, which has no exact faces.
        ExplorerError: As of `explorer.export.step.exact_workspace`.
    """
    design, region = selection.design, selection.region
    if region != "limits":
        cause = "legs begin to collide" if region == "accessible" else "a part takes its limit"
        raise InputError(
            f"STEP takes exact faces, and the surface along which {cause} consists of facets; "
            "export it as 3mf, stl, glb, obj or ply, or choose the region "
            '"within the limits"'
        )
    from explorer.export.step import exact_workspace, step_bytes

    solid = exact_workspace(design, np.array(selection.rotation))
    if offset is None:
        return step_bytes(solid, f"workspace of {design.name}")
    moved = solid.shifted(design.unit_mm * np.array(offset))
    return step_bytes(moved, f"workspace of the tool of {design.name}")


def file_words(region: Region, what: str, offset: Triple | None = None) -> str:
    """Return the name of a file with a "workspace" or a "hull", of b4 or of the tool point."""
    if offset is not None:
        what = f"{what} of the tool"
    match region:
        case "limits":
            return what
        case "accessible":
            return f"accessible {what}"
        case "held":
            return f"{what} that holds the load"


def _extent(solid: Solid) -> tuple[FloatArray, FloatArray] | None:
    if solid.is_empty:
        return None
    return solid.vertices.min(axis=0), solid.vertices.max(axis=0)
