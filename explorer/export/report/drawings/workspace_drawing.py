"""Drawings of the workspace about the mechanism: whole, and cut open through the pose."""

from __future__ import annotations

from xml.etree.ElementTree import Element

import numpy as np

from explorer.export.report.drawings.mechanism import (
    ROOM,
    WIDTH,
    axes_cross,
    mechanism,
    points_to_show,
    scale_bar,
    svg_drawing,
)
from explorer.export.report.drawings.projection import Projection, extents, fit_view
from explorer.export.report.drawings.slices import Slices
from explorer.export.report.drawings.solid_drawing import shaded_faces, visible_edges
from explorer.export.report.markup import element
from explorer.measures.snapshot import Snapshot
from explorer.workspace.limits.constraints import HalfSpace
from explorer.workspace.solids.solid import Solid
from explorer.workspace.solids.solids import cut_solid

MOST_HEIGHT = 380.0


def workspace_views(snapshot: Snapshot, solid: Solid, slices: Slices) -> Element:
    """Return the workspace with the mechanism in it, and cut open at the pose's y.

    Args:
        snapshot: Measures of the design in its pose.
        solid: Mesh of its workspace, not empty.
        slices: Slices of the same workspace.
    """
    points = np.concatenate([points_to_show(snapshot), solid.vertices])
    lows, highs = extents("isometric", points)
    half = 0.5 * WIDTH
    wide, high = (highs - lows).tolist()
    scale = min((half - 2.0 * ROOM) / wide, (MOST_HEIGHT - 2.0 * ROOM) / high)
    height = scale * high + 2.0 * ROOM
    whole = fit_view("isometric", points, (0.0, 0.0, half, height), scale)
    opened = fit_view("isometric", points, (half, 0.0, half, height), scale)
    level = snapshot.pose.position[1]
    cut = cut_solid(solid, HalfSpace("cut", np.array([0.0, -1.0, 0.0]), -level))
    pieces = [
        element("g", *mechanism(snapshot, whole, None)),
        element("g", shaded_faces(solid, whole), opacity="0.66"),
        visible_edges(solid, whole),
        scale_bar(whole, snapshot.design.unit_mm, 4.0, height - 6.0),
        axes_cross(whole, half - 40.0, height - 30.0),
    ]
    if not cut.is_empty:
        pieces += [shaded_faces(cut, opened), visible_edges(cut, opened)]
    pieces.append(_on_cut(slices, level, opened))
    pieces.append(element("g", *mechanism(snapshot, opened, None), opacity="0.9"))
    return svg_drawing(height, "The workspace, whole and cut open", *pieces)


def _on_cut(slices: Slices, level: float, view: Projection) -> Element:
    """Return the map of the slice normal to y, projected into the view."""
    group = slices.map("y", level, "slice-cut")
    corner = np.array([slices.lows[0], level, slices.lows[2]])
    origin = view.to(corner)
    x, _, z = np.eye(3) / slices.own_scale
    columns = view.to(corner + x) - origin, view.to(corner + z) - origin, origin
    numbers = " ".join(f"{value:.6g}" for column in columns for value in column.tolist())
    group.set("transform", f"matrix({numbers})")
    return group
