"""Meshes whose edges look sharp and whose round faces look round.

Browsers shade by the normals of vertices, each the mean over the faces about it. So vertices are
split where faces meet at a sharp edge, and shared elsewhere.
"""

from __future__ import annotations

import math
from typing import Any, TypeAlias

import numpy as np
from numpy.typing import NDArray
from scipy import sparse
from scipy.sparse import csgraph

from explorer.numerics.arrays import BoolArray, FloatArray, IntArray, dot
from explorer.statics.reactions import PART_NAMES
from explorer.workspace.accessible.workspace import PAIR_NAMES
from explorer.workspace.faces.faces import Faces
from explorer.workspace.solids.solid import Solid

Drawn: TypeAlias = tuple[NDArray[np.float32], NDArray[np.uint32]]
"""Vertices (n, 3) and faces (m, 3)."""

# Faces at a larger angle meet at a sharp edge; neighbours on the parts' circles are 7.5° apart.
CREASE = math.radians(30.0)


def with_creases(vertices: FloatArray, faces: NDArray[np.int32]) -> Drawn:
    """Return a closed mesh whose faces on either side of a sharp edge share no vertices.

    Args:
        vertices: Positions of the vertices, shape (n, 3).
        faces: Indices of vertices, each edge shared by two, shape (m, 3).
    """
    first, second, _ = _neighbours(faces)
    smooth = _is_smooth(vertices, faces, first, second)
    shared, indices = _split(vertices, faces, first[smooth], second[smooth])
    return shared.astype(np.float32), indices.astype(np.uint32)


def creased_faces(solid: Solid) -> Faces:
    """Return the faces of a solid, one for each limit.

    Surfaces along which legs begin to collide are one face wherever they meet smoothly, and so are
    those where parts take their limits under a load.
    """
    faces = solid.faces.astype(np.int64)
    first, second, sides = _neighbours(faces)
    owner = solid.limit_of_face
    names = (*PAIR_NAMES, *PART_NAMES)
    is_found = np.array([name in names for name in solid.limits], dtype=np.bool_)[owner]
    both = is_found[first] & is_found[second]
    same = owner[first] == owner[second]
    joined = same | (both & _is_smooth(solid.vertices, faces, first, second))
    vertices, triangles = _split(solid.vertices, faces, first[joined], second[joined])
    return Faces(vertices, triangles, owner, solid.limits, solid.vertices[sides[~same & ~both]])


def _neighbours(faces: NDArray[Any]) -> tuple[IntArray, IntArray, IntArray]:
    """Return the two faces at each edge, each (k,), and the ends of the edges, shape (k, 2)."""
    edges = np.stack([faces, np.roll(faces, -1, axis=1)], axis=-1).reshape(-1, 2)
    edges = np.sort(edges.astype(np.int64), axis=-1)
    owners = np.repeat(np.arange(len(faces)), 3)
    order = np.lexsort((edges[:, 1], edges[:, 0]))
    return owners[order[::2]], owners[order[1::2]], edges[order[::2]]


def _is_smooth(
    vertices: FloatArray, faces: NDArray[Any], first: IntArray, second: IntArray
) -> BoolArray:
    """Return whether neighbouring faces meet at a small angle."""
    corners = vertices[faces]
    normals = np.cross(corners[:, 1] - corners[:, 0], corners[:, 2] - corners[:, 0])
    normals /= np.maximum(np.linalg.norm(normals, axis=1, keepdims=True), 1e-300)
    return dot(normals[first], normals[second]) > math.cos(CREASE)


def _split(
    vertices: FloatArray, faces: NDArray[Any], first: IntArray, second: IntArray
) -> tuple[FloatArray, IntArray]:
    """Return vertices and faces, of which those share vertices that chains of neighbours join."""
    count = len(faces)
    links = (np.ones(len(first)), (first, second))
    _, patches = csgraph.connected_components(sparse.coo_matrix(links, shape=(count, count)))
    keys = faces.astype(np.int64) * count + patches[:, None]
    unique, indices = np.unique(keys.ravel(), return_inverse=True)
    return vertices[unique // count], indices.reshape(-1, 3)
