"""Meshes whose edges look sharp and whose round faces look round.

Browsers shade by normals of vertices, the mean over the faces about each. So vertices are
split where faces meet at an edge, and shared where they go on smoothly.
"""

from __future__ import annotations

import math
from typing import TypeAlias

import numpy as np
from numpy.typing import NDArray
from scipy import sparse
from scipy.sparse import csgraph

from explorer.numerics.arrays import FloatArray

Drawn: TypeAlias = tuple[NDArray[np.float32], NDArray[np.uint32]]
"""Vertices (n, 3) and faces (m, 3)."""

# Faces that turn by more meet at an edge; those of the parts' circles turn by 7.5°.
CREASE = math.radians(30.0)


def creased(vertices: FloatArray, faces: NDArray[np.int32]) -> Drawn:
    """Return a closed mesh with vertices of their own on either side of its edges.

    Args:
        vertices: Shape (n, 3).
        faces: Indices of vertices, each edge shared by two, shape (m, 3).
    """
    corners = vertices[faces]
    normals = np.cross(corners[:, 1] - corners[:, 0], corners[:, 2] - corners[:, 0])
    normals /= np.maximum(np.linalg.norm(normals, axis=1, keepdims=True), 1e-300)
    count = len(faces)
    edges = np.sort(np.stack([faces, np.roll(faces, -1, axis=1)], axis=-1), axis=-1).reshape(-1, 2)
    owners = np.repeat(np.arange(count), 3)
    order = np.lexsort((edges[:, 1], edges[:, 0]))
    one, other = owners[order[::2]], owners[order[1::2]]
    smooth = np.einsum("ij,ij->i", normals[one], normals[other]) > math.cos(CREASE)
    links = (np.ones(int(smooth.sum())), (one[smooth], other[smooth]))
    _, patches = csgraph.connected_components(sparse.coo_matrix(links, shape=(count, count)))
    keys = faces.astype(np.int64) * count + patches[:, None]
    unique, indices = np.unique(keys.ravel(), return_inverse=True)
    shared = vertices[unique // count]
    return shared.astype(np.float32), indices.reshape(-1, 3).astype(np.uint32)
