"""Meshes whose edges look sharp and whose round faces look round.

Browsers shade by the normals of vertices, each the mean over the faces about it. So vertices are
split where faces meet at a sharp edge, and shared elsewhere.
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

# Faces at a larger angle meet at a sharp edge; neighbours on the parts' circles are 7.5° apart.
CREASE = math.radians(30.0)


def creased(vertices: FloatArray, faces: NDArray[np.int32]) -> Drawn:
    """Return a closed mesh whose faces on either side of a sharp edge share no vertices.

    Args:
        vertices: Positions of the vertices, shape (n, 3).
        faces: Indices of vertices, each edge shared by two, shape (m, 3).
    """
    corners = vertices[faces]
    normals = np.cross(corners[:, 1] - corners[:, 0], corners[:, 2] - corners[:, 0])
    normals /= np.maximum(np.linalg.norm(normals, axis=1, keepdims=True), 1e-300)
    count = len(faces)
    edges = np.sort(np.stack([faces, np.roll(faces, -1, axis=1)], axis=-1), axis=-1).reshape(-1, 2)
    owners = np.repeat(np.arange(count), 3)
    order = np.lexsort((edges[:, 1], edges[:, 0]))
    first, second = owners[order[::2]], owners[order[1::2]]
    smooth = np.einsum("ij,ij->i", normals[first], normals[second]) > math.cos(CREASE)
    links = (np.ones(int(smooth.sum())), (first[smooth], second[smooth]))
    _, patches = csgraph.connected_components(sparse.coo_matrix(links, shape=(count, count)))
    keys = faces.astype(np.int64) * count + patches[:, None]
    unique, indices = np.unique(keys.ravel(), return_inverse=True)
    shared = vertices[unique // count]
    return shared.astype(np.float32), indices.reshape(-1, 3).astype(np.uint32)
