"""Meshes as the bodies of manifold3d, whose booleans combine them, and back.

Faces of a body have an id each, which booleans keep.
"""

from __future__ import annotations

from collections.abc import Sequence
from typing import TYPE_CHECKING, Any

import numpy as np
from numpy.typing import NDArray

from explorer.errors import ExplorerError
from explorer.numerics.arrays import FloatArray
from explorer.workspace.solids.facets import Facets

if TYPE_CHECKING:
    from manifold3d import Manifold


def manifold_of(shape: Facets, ids: tuple[int, ...], counts: tuple[int, ...]) -> Manifold:
    """Return a body; so many of its faces, in their order, have each of the ids."""
    from manifold3d import Manifold, Mesh64

    vertices, faces = shape
    return Manifold(
        Mesh64(
            np.ascontiguousarray(vertices),
            faces.astype(np.uint64),
            run_index=np.cumsum([0, *counts], dtype=np.uint64) * np.uint64(3),
            run_original_id=np.array(ids, dtype=np.uint32),
        )
    )


def mesh_of(body: Manifold) -> tuple[FloatArray, NDArray[np.int32], NDArray[np.uint32]]:
    """Return vertices, faces, and of each face the id of the body that it comes from.

    Raises:
        ExplorerError: a boolean failed.
    """
    from manifold3d import Error

    status = body.status()
    if status != Error.NoError:
        raise ExplorerError(f"the solid could not be made: manifold3d reports {status.name}")
    mesh: Any = body.to_mesh64()
    faces = np.asarray(mesh.tri_verts, dtype=np.int32)
    if len(mesh.merge_from_vert):
        same = np.arange(len(mesh.vert_properties), dtype=np.int32)
        same[mesh.merge_from_vert] = mesh.merge_to_vert
        faces = same[faces]
    runs = np.diff(np.asarray(mesh.run_index, dtype=np.int64)) // 3
    ids = np.repeat(np.asarray(mesh.run_original_id), runs)
    return np.array(mesh.vert_properties[:, :3]), faces, ids


def union(bodies: Sequence[Manifold]) -> Manifold:
    """Return the union, in pairs and pairs of pairs.

    Surfaces that bodies share are cut along all their other surfaces. Without what a body
    was made of those cuts heal, and without healing the faces of 64 bodies are millions.
    """
    while len(bodies) > 1:
        pairs = zip(bodies[::2], bodies[1::2], strict=False)
        left = bodies[len(bodies) // 2 * 2 :]
        bodies = [*((one + other).as_original().simplify(0.0) for one, other in pairs), *left]
    return bodies[0]
