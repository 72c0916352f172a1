"""Mesh files read back by the libraries of their formats."""

from __future__ import annotations

import json
import struct
from typing import Any

import lib3mf  # pyright: ignore[reportMissingTypeStubs]
import numpy as np
import trimesh

library: Any = lib3mf


def read_3mf(data: bytes) -> Any:
    """Return the model of lib3mf in a file that it accepts without a warning."""
    model = library.get_wrapper().CreateModel()
    reader = model.QueryReader("3mf")
    reader.SetStrictModeActive(True)
    reader.ReadFromBuffer(data)
    assert reader.GetWarningCount() == 0
    assert model.GetUnit() == library.ModelUnit.MilliMeter
    return model


def metadata_of(model: Any) -> dict[str, str]:
    """Return the four entries of a model's metadata by name."""
    about = model.GetMetaDataGroup()
    return {about.GetMetaData(k).GetName(): about.GetMetaData(k).GetValue() for k in range(4)}


def mesh_of(resource: Any) -> trimesh.Trimesh:
    """Return a mesh object of lib3mf, manifold and oriented, as one of trimesh."""
    assert resource.IsManifoldAndOriented()
    corners = np.array([list(v.Coordinates) for v in resource.GetVertices()])
    faces = np.array([list(t.Indices) for t in resource.GetTriangleIndices()])
    return trimesh.Trimesh(corners, faces, process=False)


def glb_json(data: bytes) -> dict[str, Any]:
    """Return the JSON of a GLB file, whose length and alignment are checked."""
    assert struct.unpack("<I", data[8:12]) == (len(data),)
    length = struct.unpack("<I", data[12:16])[0]
    scene: dict[str, Any] = json.loads(data[20 : 20 + length])
    assert all(view["byteOffset"] % 4 == 0 for view in scene["bufferViews"])
    return scene
