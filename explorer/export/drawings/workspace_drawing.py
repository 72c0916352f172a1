"""The workspace about the mechanism as drawings: whole, and cut open through the pose.

The workspace is an intersection of balls, cylinders and half-spaces, convex where no length
has a minimum: then no visible face covers another, and the drawing is exact.
"""

from __future__ import annotations

import itertools
import operator
from xml.etree.ElementTree import Element

import numpy as np

from explorer.export.drawings import mechanism as drawings
from explorer.export.drawings.markup import element, path_of
from explorer.export.drawings.mechanism import ROOM, WIDTH, Projection
from explorer.export.drawings.slices import Slices
from explorer.export.mesh import as_trimesh
from explorer.measures.snapshot import Snapshot
from explorer.mechanism.rgb import css, mix
from explorer.workspace.limits.constraints import HalfSpace
from explorer.workspace.solids.solid import Solid, cut_solid

MOST_HEIGHT = 380.0


def workspace_views(snapshot: Snapshot, solid: Solid, slices: Slices) -> Element:
    """Return a workspace, not empty, with the mechanism in it, and cut open at the pose's y."""
    points = np.concatenate([drawings.points_to_show(snapshot), solid.vertices])
    lows, highs = drawings.extents("isometric", points)
    half = 0.5 * WIDTH
    wide, high = (highs - lows).tolist()
    scale = min((half - 2.0 * ROOM) / wide, (MOST_HEIGHT - 2.0 * ROOM) / high)
    height = scale * high + 2.0 * ROOM
    whole = drawings.fit_view("isometric", points, (0.0, 0.0, half, height), scale)
    opened = drawings.fit_view("isometric", points, (half, 0.0, WIDTH, height), scale)
    level = snapshot.pose.position[1]
    cut = cut_solid(solid, HalfSpace("cut", np.array([0.0, -1.0, 0.0]), -level))
    pieces = [
        element("g", *drawings.mechanism(snapshot, whole, None)),
        element("g", shaded_faces(solid, whole), opacity="0.66"),
        visible_edges(solid, whole),
        drawings.scale_bar(whole, snapshot.design.unit_mm, 4.0, height - 6.0),
        drawings.axes_cross(whole, half - 40.0, height - 30.0),
    ]
    if not cut.is_empty:
        pieces += [shaded_faces(cut, opened), visible_edges(cut, opened)]
    pieces.append(_on_cut(slices, level, opened))
    pieces.append(element("g", *drawings.mechanism(snapshot, opened, None), opacity="0.9"))
    return drawings.svg_drawing(height, "The workspace, whole and cut open", *pieces)


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


# The direction of the light: right, up and towards the eye.
_LIGHT = np.array([-0.45, 0.65, 0.62])
_DARK, _PALE = (86, 124, 172), (222, 232, 243)
_SHADES = 24


def shaded_faces(solid: Solid, view: Projection) -> Element:
    """Return the visible faces of a solid, shaded by their angle to the light."""
    corners = solid.vertices[solid.faces]
    normals = as_trimesh(solid.vertices, solid.faces).face_normals
    seen = np.flatnonzero(normals @ view.axes[2] > 0.0)
    order = seen[np.argsort(view.depth(corners[seen].mean(axis=1)), kind="stable")]
    light = _LIGHT / np.linalg.norm(_LIGHT)
    facing = 0.5 + 0.5 * (normals[order] @ view.axes.T @ light)
    shades = np.rint(facing * (_SHADES - 1)).tolist()
    group = element("g", class_="faces")
    shaded = zip(shades, map(path_of, view.to(corners[order])), strict=True)
    for shade, faces in itertools.groupby(shaded, key=operator.itemgetter(0)):
        colour = css(mix(_DARK, _PALE, shade / (_SHADES - 1)))
        data = "".join(face for _, face in faces)
        group.append(element("path", d=data, fill=colour, stroke=colour))
    return group


def visible_edges(solid: Solid, view: Projection) -> Element:
    """Return the visible edges: those between two limits, and the silhouette."""
    mesh = as_trimesh(solid.vertices, solid.faces)
    facing = mesh.face_normals @ view.axes[2] > 0.0
    one, other = mesh.face_adjacency.T
    differs = solid.limit_of_face[one] != solid.limit_of_face[other]
    drawn = (facing[one] & facing[other] & differs) | (facing[one] != facing[other])
    ends = view.to(solid.vertices[mesh.face_adjacency_edges[drawn]])
    return element("path", d="".join(path_of(edge, "") for edge in ends), class_="edge")
