"""Conversion between meshes and the bodies of manifold3d, and unions of bodies.

Each face of a body has an id, which booleans preserve.
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
    """Return a mesh as a body.

    Args:
        shape: Vertices and faces.
        ids: Ids of the faces.
        counts: Number of consecutive faces with each id.
    """
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
    """Return the vertices, faces and ids of the faces of a body.

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
        merged = np.arange(len(mesh.vert_properties), dtype=np.int32)
        merged[mesh.merge_from_vert] = mesh.merge_to_vert
        faces = merged[faces]
    runs = np.diff(np.asarray(mesh.run_index, dtype=np.int64)) // 3
    ids = np.repeat(np.asarray(mesh.run_original_id), runs)
    return np.array(mesh.vert_properties[:, :3]), faces, ids


def union(bodies: Sequence[Manifold]) -> Manifold:
    """Return the union of bodies: of pairs first, then of pairs of pairs.

    Each boolean cuts surfaces that bodies share along their other surfaces. After `as_original`
    the cuts can be simplified away; otherwise the union of 64 bodies has millions of faces.
    """
    while len(bodies) > 1:
        pairs = zip(bodies[::2], bodies[1::2], strict=False)
        unpaired = bodies[len(bodies) // 2 * 2 :]
        bodies = [*((one + other).as_original().simplify(0.0) for one, other in pairs), *unpaired]
    return bodies[0]
