"""The heavy tasks that the worker process does; each takes and returns plain values."""

from __future__ import annotations

import itertools
import time
from dataclasses import dataclass
from typing import Any, Literal

import numpy as np
from numpy.typing import NDArray

from explorer.app.colours import FAR_WARNINGS, Rgb, proximity_colour
from explorer.arrays import FloatArray
from explorer.constraints import HalfSpace, constraints, slacks
from explorer.design import Design
from explorer.errors import InputError
from explorer.region import region_of
from explorer.singularity import inverse_condition, jacobian, margins
from explorer.solid import Solid
from explorer.solids import convex_hull, limited_solid, workspace_solid
from explorer.workspace import NodeCount, bounds, workspace_nodes, workspace_volume

Axis = Literal["x", "y", "z"]
Measure = Literal["plain", "margin", "condition"]

AXES: tuple[Axis, ...] = ("x", "y", "z")
# An inverse condition number below this is coloured as a warning.
WARN_CONDITION = 0.01
# Colours come in bands, so that a surface tells how much and not only where less.
BAND_EDGES = (0.0, 0.25, 0.5, 0.75, 1.0, 1.5, 2.0, 2.5, 3.0, FAR_WARNINGS)
PLAIN: Rgb = (110, 150, 196)
# Shares of the reach: the longest edge of a coloured facet, the chord tolerance of a live solid.
COLOURED_EDGE = 0.08
LIVE_TOLERANCE = 0.004
# Pixels on the longer side of the map of a slice.
MAP_PIXELS = 110


@dataclass(frozen=True)
class WorkspaceRequest:
    """What to draw and measure of a workspace; lengths in design units.

    Attributes:
        design: The manipulator.
        rotation: Platform to base, rows of the matrix.
        colour: By what the surface is coloured.
        cut: The axis along which it is cut open, or None.
        level: Where.
        tolerance: Chord tolerance; None for a share of the reach.
        hull: Whether the convex hull is wanted.
        warn_below: The length below which margins are warned of.
    """

    design: Design
    rotation: tuple[tuple[float, ...], ...]
    colour: Measure
    cut: Axis | None
    level: float
    tolerance: float | None
    hull: bool
    warn_below: float


@dataclass(frozen=True)
class Shell:
    """A part of a surface in one colour: vertices (n, 3) in design units, faces (m, 3)."""

    colour: Rgb
    vertices: FloatArray
    faces: NDArray[np.int32]


@dataclass(frozen=True)
class SliceMap:
    """A picture of the slice: pixels (h, w, 4), from its lows to its highs on two axes."""

    pixels: NDArray[np.uint8]
    axes: tuple[Axis, Axis]
    lows: tuple[float, float]
    highs: tuple[float, float]


@dataclass(frozen=True)
class WorkspaceDrawing:
    """A workspace drawn and measured; lengths in design units.

    Attributes:
        request: What was asked for.
        shells: The surface.
        hull: The convex hull, if asked for.
        slice_map: The map of the slice, if it is cut.
        volume: Exact, see `explorer.workspace`.
        error: Of the exact volume.
        mesh_volume: Of the uncut solid.
        hull_volume: Of the hull, if asked for.
        extent: (lows, highs) of the solid, None if it is empty.
        nodes: The paper's node count, None if the grid is too fine.
        empty_because: The limits that empty it.
        seconds: How long it took.
    """

    request: WorkspaceRequest
    shells: tuple[Shell, ...]
    hull: Shell | None
    slice_map: SliceMap | None
    volume: float
    error: float
    mesh_volume: float
    hull_volume: float | None
    extent: tuple[FloatArray, FloatArray] | None
    nodes: NodeCount | None
    empty_because: tuple[str, ...]
    seconds: float


def ready() -> None:
    """Do nothing: the process that was asked has started."""


def draw_workspace(request: WorkspaceRequest) -> WorkspaceDrawing:
    """Return the workspace, drawn and measured."""
    start = time.perf_counter()
    design, rotation = request.design, np.array(request.rotation)
    tolerance = request.tolerance or LIVE_TOLERANCE * design.reach
    measured = workspace_volume(design, rotation)
    solid = workspace_solid(design, rotation, tolerance)
    hull = convex_hull(solid) if request.hull and not solid.is_empty else None
    shown, slice_map = solid, None
    if request.cut is not None and not solid.is_empty:
        # The half that looks at the isometric camera is taken away.
        side = -1.0 if request.cut == "y" else 1.0
        knife = HalfSpace("cut", side * np.eye(3)[AXES.index(request.cut)], side * request.level)
        limits = (*constraints(design, rotation), knife)
        shown = limited_solid(design, limits, tolerance)
        slice_map = _slice_map(request, rotation)
    try:
        nodes = workspace_nodes(design, rotation)
    except InputError:
        nodes = None
    vertices = solid.vertices
    return WorkspaceDrawing(
        request=request,
        shells=_shells(request, rotation, shown),
        hull=None if hull is None else Shell(PLAIN, hull.vertices, hull.faces),
        slice_map=slice_map,
        volume=measured.volume,
        error=measured.error,
        mesh_volume=solid.volume,
        hull_volume=None if hull is None else hull.volume,
        extent=None if solid.is_empty else (vertices.min(axis=0), vertices.max(axis=0)),
        nodes=nodes,
        empty_because=measured.empty_because,
        seconds=time.perf_counter() - start,
    )


def band_colours() -> tuple[Rgb, ...]:
    """Return the colour of each band, of values as multiples of the warning value."""
    edges = (*BAND_EDGES, 1.5 * BAND_EDGES[-1])
    return tuple(proximity_colour(0.5 * (a + b), 1.0) for a, b in itertools.pairwise(edges))


def _shells(request: WorkspaceRequest, rotation: FloatArray, solid: Solid) -> tuple[Shell, ...]:
    if solid.is_empty:
        return ()
    if request.colour == "plain":
        return (Shell(PLAIN, solid.vertices, solid.faces),)
    from trimesh import remesh

    untyped: Any = remesh
    edge = COLOURED_EDGE * request.design.reach
    vertices, faces = untyped.subdivide_to_size(solid.vertices, solid.faces, edge, max_iter=12)
    rest = np.asarray(vertices, dtype=np.float64)[np.asarray(faces)]
    share = _measured(request, rotation, rest.reshape(-1, 3)).reshape(-1, 3)
    shells: list[Shell] = []
    for colour, edge in zip(band_colours(), (*BAND_EDGES[1:], np.inf), strict=True):
        band, rest, share = split_at(rest, share, edge)
        if len(band):
            corners = np.arange(3 * len(band), dtype=np.int32).reshape(-1, 3)
            shells.append(Shell(colour, band.reshape(-1, 3), corners))
    return tuple(shells)


def split_at(
    triangles: FloatArray, values: FloatArray, level: float
) -> tuple[FloatArray, FloatArray, FloatArray]:
    """Split triangles along the line where a value that is linear on each is a level.

    Args:
        triangles: Shape (n, 3, 3).
        values: At their corners, shape (n, 3).
        level: Where to split.

    Returns:
        The triangles below, the triangles above, and the values of those above.
    """
    high = values >= level
    count = high.sum(axis=1)
    low_side, high_side = [triangles[count == 0]], [triangles[count == 3]]
    high_values = [values[count == 3]]
    for lone_is_high, mixed in ((True, count == 1), (False, count == 2)):
        if not mixed.any():
            continue
        t, v, h = triangles[mixed], values[mixed], high[mixed]
        # Turn each so that the corner alone on its side comes first.
        lone = np.argmax(h == lone_is_high, axis=1)
        order = (lone[:, None] + np.arange(3)) % 3
        t = np.take_along_axis(t, order[:, :, None], axis=1)
        v = np.take_along_axis(v, order, axis=1)
        share = ((level - v[:, :1]) / (v[:, 1:] - v[:, :1]))[:, :, None]
        cut = t[:, :1] + share * (t[:, 1:] - t[:, :1])
        tip = np.stack([t[:, 0], cut[:, 0], cut[:, 1]], axis=1)
        base = np.concatenate(
            [
                np.stack([cut[:, 0], t[:, 1], t[:, 2]], axis=1),
                np.stack([cut[:, 0], t[:, 2], cut[:, 1]], axis=1),
            ]
        )
        at = np.full(len(t), level)
        tip_values = np.stack([v[:, 0], at, at], axis=1)
        base_values = np.concatenate(
            [np.stack([at, v[:, 1], v[:, 2]], axis=1), np.stack([at, v[:, 2], at], axis=1)]
        )
        (high_side if lone_is_high else low_side).append(tip)
        (low_side if lone_is_high else high_side).append(base)
        high_values.append(tip_values if lone_is_high else base_values)
    return np.concatenate(low_side), np.concatenate(high_side), np.concatenate(high_values)


def _measured(request: WorkspaceRequest, rotation: FloatArray, points: FloatArray) -> FloatArray:
    """Return what colours points (n, 3), as multiples of the value to warn below."""
    if request.colour != "condition":
        return np.abs(margins(points, rotation)).min(axis=-1) / request.warn_below
    rates = jacobian(request.design, points, rotation)
    return inverse_condition(rates, request.design.reach) / WARN_CONDITION


def _slice_map(request: WorkspaceRequest, rotation: FloatArray) -> SliceMap | None:
    if request.cut is None:
        return None
    limits = constraints(request.design, rotation)
    lows, highs = bounds(region_of(limits))
    if not np.isfinite([lows, highs]).all() or not (lows < highs).all():
        return None
    cut = AXES.index(request.cut)
    first, second = (axis for axis in range(3) if axis != cut)
    width, height = float(highs[first] - lows[first]), float(highs[second] - lows[second])
    pixel = max(width, height) / MAP_PIXELS
    columns = lows[first] + pixel * (np.arange(max(1, round(width / pixel))) + 0.5)
    rows = lows[second] + pixel * (np.arange(max(1, round(height / pixel))) + 0.5)
    points = np.zeros((len(rows), len(columns), 3))
    points[..., cut] = request.level
    points[..., first] = columns
    # The first row of a picture is at the top.
    points[..., second] = rows[::-1, None]
    inside = np.asarray((slacks(limits, points) >= 0.0).all(axis=-1))
    pixels = np.zeros((*inside.shape, 4), dtype=np.uint8)
    if inside.any():
        share = _measured(request, rotation, points[inside])
        table = np.array([proximity_colour(s, 1.0) for s in np.linspace(0.0, FAR_WARNINGS, 201)])
        index = np.clip(np.rint(share / FAR_WARNINGS * 200.0), 0, 200).astype(np.int64)
        pixels[inside, :3] = table[index]
        pixels[inside, 3] = 255
    return SliceMap(
        pixels,
        (AXES[first], AXES[second]),
        (float(lows[first]), float(lows[second])),
        (float(highs[first]), float(highs[second])),
    )


def export_mesh(
    design: Design,
    rotation: tuple[tuple[float, ...], ...],
    tolerance: float,
    what: str,
    file_format: str,
) -> bytes:
    """Return a file of the workspace or of its hull, in millimetres.

    Args:
        design: The manipulator.
        rotation: Platform to base, rows of the matrix.
        tolerance: Chord tolerance, in design units.
        what: "workspace" or "hull".
        file_format: As of `explorer.export.mesh`.

    Raises:
        ExplorerError: an empty workspace, or a library that is missing.
    """
    from explorer.export.mesh import mesh_bytes

    solid = workspace_solid(design, np.array(rotation), tolerance)
    name = f"{design.name} {what}"
    return mesh_bytes(convex_hull(solid) if what == "hull" else solid, file_format, design, name)
