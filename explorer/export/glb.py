"""GLB files: named meshes below a tree of nodes, in metres with y up.

trimesh packs the meshes. Nodes, materials and metadata are glTF of our own, because trimesh
writes a node as a matrix, which glTF does not allow to be animated, drops offsets below 1e-8 m
and rounds colours to 8 bits of linear light.
"""

from __future__ import annotations

import json
import math
from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from typing import Any

import numpy as np
from numpy.typing import NDArray

from explorer.export.metadata import APPLICATION, Rgb, design_json, linear
from explorer.mechanism.design import Design
from explorer.numerics.arrays import FloatArray

METRES_PER_MILLIMETRE = 1e-3

Y_UP = [-math.sqrt(0.5), 0.0, 0.0, math.sqrt(0.5)]
"""The rotation (x, y, z, w) of the first node, which turns z up to y up."""


@dataclass(frozen=True)
class Material:
    """A surface: its colour and its reflectance.

    Attributes:
        name: Name in the file.
        rgb: Colour in sRGB, 0 to 255.
        metallic: Metalness, from 0 to 1.
        roughness: Roughness, from 0 to 1.
    """

    name: str
    rgb: Rgb
    metallic: float
    roughness: float

    def as_gltf(self) -> dict[str, Any]:
        """Return the material in glTF."""
        factors = {
            "baseColorFactor": [*(linear(channel) for channel in self.rgb), 1.0],
            "metallicFactor": self.metallic,
            "roughnessFactor": self.roughness,
        }
        return {"name": self.name, "pbrMetallicRoughness": factors}


@dataclass(frozen=True)
class Body:
    """A mesh of one material.

    Attributes:
        vertices: Corners in metres, shape (n, 3).
        faces: Indices of the corners of each triangle, shape (m, 3).
        material: Index of its material in the file.
    """

    vertices: FloatArray
    faces: NDArray[np.integer]
    material: int = 0


def glb_bytes(
    bodies: Mapping[str, Body],
    nodes: Sequence[Mapping[str, Any]],
    materials: Sequence[Material],
    design: Design,
) -> bytes:
    """Return a GLB file.

    Args:
        bodies: Meshes by name, none empty; nodes refer to them by their index in this order.
        nodes: Nodes in glTF; the first is the root and rotates by `Y_UP`.
        materials: The materials that the bodies refer to.
        design: The design, kept as JSON in the file.
    """
    import trimesh

    def complete(tree: dict[str, Any]) -> None:
        tree["asset"] = {
            "version": "2.0",
            "generator": APPLICATION,
            "extras": {
                "unit": "metre; millimetres of the base frame times 0.001",
                "up": "the first node turns the base frame, whose z is up, to y up",
                "unit_mm": design.unit_mm,
                "design": json.loads(design_json(design)),
            },
        }
        tree["scenes"] = [{"nodes": [0]}]
        tree["nodes"] = list(nodes)
        tree["materials"] = [material.as_gltf() for material in materials]
        for mesh, body in zip(tree["meshes"], bodies.values(), strict=True):
            mesh["primitives"][0]["material"] = body.material

    untyped: Any = trimesh
    scene = untyped.Scene()
    for name, body in bodies.items():
        scene.add_geometry(
            untyped.Trimesh(body.vertices, body.faces, process=False), geom_name=name
        )
    return scene.export(file_type="glb", tree_postprocessor=complete)
