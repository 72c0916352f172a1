"""The worker's tasks for the workspace: measure it, draw it or its parts, write files of it.

A part is what is accessible, or what holds a load. Lengths are in design units.
"""

from __future__ import annotations

from dataclasses import dataclass, replace
from functools import lru_cache
from typing import Literal, TypeAlias

import numpy as np

from explorer.app.features.workspace import slice_map as maps
from explorer.app.scene.surfaces import PLAIN, Colouring, Measure, Shell, creased_faces
from explorer.app.session.feed import watch_of
from explorer.errors import ExplorerError, InputError
from explorer.jobs.process import Channel
from explorer.measures.position_bands import PositionMeasure
from explorer.mechanism.design import Design
from explorer.mechanism.machine import NO_LOAD, Six
from explorer.mechanism.pose import Triple
from explorer.numerics.arrays import FloatArray, triple
from explorer.numerics.number_text import format_apart, format_number
from explorer.numerics.search import Watch, ignore_stage
from explorer.statics.reactions import has_limits
from explorer.workspace.accessible.nodes import InvalidStartError
from explorer.workspace.accessible.workspace import PairCost, accessible_part
from explorer.workspace.carried_region import carried_region
from explorer.workspace.extremes import extent_of
from explorer.workspace.faces.faces import Faces, faces_within, workspace_faces
from explorer.workspace.limits.constraints import HalfSpace
from explorer.workspace.slices.volume import NodeCount, Volume, node_count_of, volume_of
from explorer.workspace.solids.solid import Solid, convex_hull, cut_solid
from explorer.workspace.solids.solids import whole_solid
from explorer.workspace.workspace import Workspace

Rows: TypeAlias = tuple[tuple[float, ...], ...]
"""Rows of a matrix."""

Region = Literal["limits", "accessible", "held"]

# Number of cached workspaces, so that a cut or another colour takes no time.
CACHED = 4
# Most nodes of the paper's grid whose steps are checked for a drawing.
MOST_LIVE_NODES = 200_000
# Chord tolerances of a live solid, and of an accessible or a carried part, over the reach.
LIVE_TOLERANCE, PART_TOLERANCE = 0.004, 0.001
# The format with exact faces rather than facets.
STEP = "step"


@lru_cache(CACHED)
def kept_workspace(design: Design, rotation: Rows) -> Workspace:
    """Return the workspace of a design, with all that has been computed of it."""
    return Workspace(design, np.array(rotation))


def rows_of(matrix: FloatArray) -> Rows:
    """Return the rows of a matrix (n, m) as plain numbers, which can be compared and hashed."""
    return tuple(tuple(row) for row in matrix.tolist())


@dataclass(frozen=True)
class Selection:
    """The workspace or the part of it that is drawn or exported.

    Attributes:
        rotation: Rows of the matrix, platform to base.
        region: All that is within the limits, its accessible part, or the part that holds the load.
        start: Position where paths start; None for home.
        load: (F; M) at the tool point besides the payload, base axes, in N and N × unit; none if it
            does not matter.
    """

    design: Design
    rotation: Rows
    region: Region = "limits"
    start: Triple | None = None
    load: Six = NO_LOAD

    @property
    def workspace(self) -> Workspace:
        """The workspace within the limits."""
        return kept_workspace(self.design, self.rotation)


@dataclass(frozen=True)
class PartVolume:
    """The volume of a part of a workspace, and of an accessible one what legs block.

    Attributes:
        node_count: Number of accessible nodes of the paper's grid; None if the grid is too fine.
        pairs: Clearance and blocked volume of each pair of legs, in the order of `PAIRS`.
    """

    volume: float
    node_count: int | None = None
    pairs: tuple[PairCost, ...] = ()


@dataclass(frozen=True)
class Trouble:
    """Why nothing is accessible, or holds the load; the nearest position to start from, if any."""

    reason: str
    nearest: Triple | None = None


def find_part(
    selection: Selection, tolerance: float, watch: Watch
) -> tuple[PartVolume, Solid] | Trouble:
    """Return the part of a workspace that a region names, "accessible" or "held", or its trouble.

    The tolerance is that of chords; `watch` gets each stage.
    """
    if selection.region != "accessible":
        return _find_carried(selection, tolerance)
    try:
        accessible = accessible_part(
            selection.workspace,
            selection.start,
            most_nodes=MOST_LIVE_NODES,
            tolerance=tolerance,
            watch=watch,
        )
    except InvalidStartError as error:
        nearest = None if error.nearest is None else triple(error.nearest)
        return Trouble(error.in_millimetres, nearest)
    except ExplorerError as error:
        return Trouble(str(error))
    nodes = accessible.accessible_node_count
    return PartVolume(accessible.accessible_volume, nodes, accessible.pairs), accessible.solid


def _find_carried(selection: Selection, tolerance: float) -> tuple[PartVolume, Solid] | Trouble:
    region = carried_region(selection.workspace, selection.load, tolerance=tolerance)
    if region.volume == 0.0 or not region.solid.is_empty:
        return PartVolume(region.held_volume), region.solid
    # Without a factor columns find a volume.
    if region.factor is None or region.factor >= 1.0:
        return Trouble("the positions that hold it are too few to be drawn")
    (limit,) = region.solid.empty_because
    percent = format_apart((100.0 * region.factor, 100.0), 3, format_number)[0]
    return Trouble(
        f"the best position found holds {percent} % of load and payload; {limit} is at its limit "
        "there"
    )


@dataclass(frozen=True)
class MeasuredVolume:
    """The volume of a workspace within the limits with its error, in cubed design units."""

    request: Selection
    measured: Volume


def measure_volume(request: Selection) -> MeasuredVolume:
    """Return the volume of a workspace within the limits."""
    return MeasuredVolume(request, volume_of(request.workspace))


@dataclass(frozen=True, kw_only=True)
class WorkspaceRequest(Selection):
    """Request to draw and measure a workspace; lengths in design units.

    The level of a cut is in the middle if it is None or beyond the extent. A flipped cut keeps
    the side that faces the isometric camera. Margins below `warn_below` raise a warning.
    """

    colour: Measure
    cut: maps.Axis | None
    level: float | None
    flipped: bool
    tolerance: float
    hull: bool
    warn_below: float


@dataclass(frozen=True, eq=False)
class WorkspaceSurface:
    """The surface of a workspace by colour, and the edges where its faces meet, (k, 2, 3)."""

    request: WorkspaceRequest
    shells: tuple[Shell, ...]
    edges: FloatArray


@dataclass(frozen=True, eq=False)
class WorkspaceDrawing:
    """A workspace drawn and measured.

    Attributes:
        volume: Exact volume within the limits, see `explorer.workspace.slices.volume`.
        part: Numbers of the part that is drawn; None for all within the limits.
        trouble: Why nothing is accessible or holds the load, if all within the limits is drawn
            instead.
        mesh_agrees: Whether the volume of the solid within the limits agrees with the exact one.
        extent: (lows, highs) of the solid; None if it is empty.
        nodes: The paper's node count within the limits; None if the grid is too fine.
        levels: The measure that colours the map at the edge of each band, see
            `explorer.measures.position_bands.PositionBands`.
    """

    request: WorkspaceRequest
    surface: WorkspaceSurface
    hull: Shell | None
    slice_map: maps.SliceMap | None
    volume: float
    part: PartVolume | None
    trouble: Trouble | None
    mesh_volume: float
    mesh_agrees: bool | None
    hull_volume: float | None
    extent: tuple[FloatArray, FloatArray] | None
    nodes: NodeCount | None
    levels: tuple[float, ...]


def draw_workspace(request: WorkspaceRequest, channel: Channel | None = None) -> WorkspaceDrawing:
    """Return the workspace, drawn and measured.

    The parent at a channel gets each `Stage`, and the `WorkspaceSurface` as soon as it is known,
    and may cancel.
    """
    workspace, holds = request.workspace, request.region == "held"
    colouring = Colouring(workspace, request.colour, request.warn_below, request.load)
    on_map = replace(colouring, measure=map_measure(request.design, request.colour, holds=holds))

    def draw(faces: Faces) -> WorkspaceSurface:
        shells = colouring.shells(faces, holds=holds and trouble is None)
        surface = WorkspaceSurface(request, shells, faces.edges)
        if channel is not None:
            channel.send(surface)
        return surface

    surface = None
    if request.region == "limits" and request.cut is None:
        # It is waited for; it needs none of what follows.
        surface = draw(workspace_faces(workspace))
    whole = whole_solid(workspace, request.tolerance)
    solid, part, trouble = whole, None, None
    if request.region != "limits":
        answer = find_part(request, request.tolerance, watch_of(channel))
        if isinstance(answer, Trouble):
            trouble = answer
        else:
            part, solid = answer
    whole_extent = extent = None if whole.is_empty else extent_of(workspace)
    if part is not None:
        extent = None if solid.is_empty else solid.ends
    shown, mapped, cut, level = solid, None, None, 0.0
    if request.cut is not None and extent is not None:
        axis = maps.AXES.index(request.cut)
        level = maps.level_within(float(extent[0][axis]), float(extent[1][axis]), request.level)
        side = -1.0 if maps.keeps_above(request.cut, request.flipped) else 1.0
        cut = HalfSpace(maps.CUT, side * np.eye(3)[axis], side * level)
        shown = solid if part is None else cut_solid(solid, cut)
    if surface is None:
        limits = workspace.limits if cut is None else (*workspace.limits, cut)
        surface = draw(faces_within(limits) if part is None else creased_faces(shown))
    if cut is not None and request.cut is not None and whole_extent is not None:
        cut_solids = (None, None) if part is None else (cut_solid(whole, cut), shown)
        left_out = "load not held" if holds else "not accessible"
        mapped = maps.slice_map(on_map, whole_extent, request.cut, level, *cut_solids, left_out)
    hull = convex_hull(solid) if request.hull and not solid.is_empty else None
    try:
        nodes = node_count_of(workspace)
    except InputError:
        nodes = None
    return WorkspaceDrawing(
        request=request,
        surface=surface,
        hull=None if hull is None else Shell(PLAIN, hull.vertices, hull.faces),
        slice_map=mapped,
        volume=volume_of(workspace).volume,
        part=part,
        trouble=trouble,
        mesh_volume=solid.volume,
        mesh_agrees=solid.agrees,
        hull_volume=None if hull is None else hull.volume,
        extent=extent,
        nodes=nodes,
        levels=on_map.bands.levels,
    )


def map_measure(design: Design, colour: Measure, *, holds: bool) -> PositionMeasure:
    """Return the measure of the map of a slice.

    It is that which colours the surface; of a surface of one colour the smallest margin, or the
    share of limits in what `holds` the load.
    """
    if colour != "plain":
        return colour
    return "share" if holds and has_limits(design) else "margin"


def export_mesh(
    selection: Selection,
    tolerance: float,
    what: str,
    file_format: str,
    offset: Triple | None = None,
) -> bytes:
    """Return a file of the "workspace" or of its "hull", in millimetres.

    The format is one of `explorer.export.mesh`, or `STEP` for the workspace itself. The
    positions are those of b4, or of the tool point, which lies at an offset from it.

    Raises:
        ExplorerError: An empty workspace, nothing accessible, a load that nothing holds, a missing
            library, or STEP of a solid without exact faces.
    """
    design, region = selection.design, selection.region
    name = file_words(region, what, offset)
    if file_format == STEP:
        if region != "limits":
            cause = "legs begin to collide" if region == "accessible" else "a part takes its limit"
            raise InputError(
                f"STEP takes exact faces, and the surface along which {cause} consists of facets; "
                "export it as 3mf, stl, glb, obj or ply, or choose the region "
                '"within the limits"'
            )
        from explorer.export.step import exact_workspace, step_bytes

        exact = exact_workspace(selection.workspace)
        if offset is not None:
            exact = exact.shift(design.unit_mm * np.array(offset))
        return step_bytes(exact, f"{name} of {design.name}")
    from explorer.export.mesh import mesh_bytes

    if region == "limits":
        solid = whole_solid(selection.workspace, tolerance)
    else:
        answer = find_part(selection, tolerance, ignore_stage)
        if isinstance(answer, Trouble):
            cause = "nothing holds the load: " if region == "held" else ""
            raise InputError(cause + answer.reason)
        _, solid = answer
    solid = convex_hull(solid) if what == "hull" else solid
    if offset is not None:
        solid = solid.shift(np.array(offset))
    return mesh_bytes(solid, file_format, design, f"{design.name} {name}")


def file_words(region: Region, what: str, offset: Triple | None = None) -> str:
    """Return the name of a file with a "workspace" or a "hull", of b4 or of the tool point."""
    what = what if offset is None else f"{what} of the tool"
    match region:
        case "limits":
            return what
        case "accessible":
            return f"accessible {what}"
        case "held":
            return f"{what} that holds the load"
