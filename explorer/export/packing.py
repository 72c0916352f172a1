"""Mesh files with names, colours and metadata: GLB by trimesh, and 3MF by lib3mf."""

from __future__ import annotations

import contextlib
import json
import math
import re
import unicodedata
from collections.abc import Generator, Mapping, Sequence
from typing import Any, TypeAlias

import msgspec
import numpy as np
from numpy.typing import NDArray

from explorer import __version__
from explorer.errors import ExplorerError, InputError
from explorer.mechanism.design import Design
from explorer.numerics.arrays import FloatArray

Rgb: TypeAlias = tuple[int, int, int]
"""A colour in sRGB, each channel from 0 to 255."""

APPLICATION = f"flagged-explorer {__version__}"


# Largest number of characters of a name in a file.
LONGEST_NAME = 160

# Readers of PLY take lines of a few hundred characters only. A piece of a comment ends after a
# comma if it can; never at a blank, which programs trim, nor at a backslash, which in OBJ would
# append the next line.
_PIECE = re.compile(r".{1,160}(?<![ \\])(?! )(?:(?<=,)|$)|.{1,160}(?<![ \\])(?! )")


def json_line(value: object) -> str:
    """Return plain values as JSON on one line, in ASCII, that readers of comments stand.

    It has no two backslashes in a row, and not the last word of the header of a PLY file.
    """
    text = json.dumps(value, separators=(",", ":")).replace("\\\\", "\\u005c")
    return text.replace("end_header", "end\\u005fheader")


def design_json(design: Design) -> str:
    """Return the design as JSON, as `json_line` does."""
    return json_line(json.loads(msgspec.json.encode(design)))


def printable_name(name: str) -> str:
    """Return a name as one printable line of 1 to `LONGEST_NAME` characters."""
    printable = "".join(letter if letter.isprintable() else " " for letter in name)
    return " ".join(printable.split())[:LONGEST_NAME].rstrip() or "workspace"


def ascii_name(name: str) -> str:
    """Return a name in ASCII: letters without their accents, others left out; δ1 becomes 1."""
    return printable_name(unicodedata.normalize("NFKD", name).encode("ascii", "ignore").decode())


def comments(mark: str, text: str) -> list[str]:
    """Return a text in ASCII as comments of at most 160 characters, each after the same mark.

    Args:
        mark: Start of a comment, such as "comment design".
        text: What `json_line` returns; joining what follows the marks gives it back.
    """
    return [f"{mark} {piece}" for piece in _PIECE.findall(text)]


def linear(channel: int) -> float:
    """Return a channel of sRGB, 0 to 255, as linear light from 0 to 1 (IEC 61966-2-1)."""
    share = channel / 255.0
    return share / 12.92 if share <= 0.04045 else ((share + 0.055) / 1.055) ** 2.4


METRES_PER_MILLIMETRE = 1e-3

Y_UP = [-math.sqrt(0.5), 0.0, 0.0, math.sqrt(0.5)]
"""The rotation (x, y, z, w) of the first node, which turns z up to y up."""


Body: TypeAlias = tuple[FloatArray, NDArray[np.integer], int]
"""Corners of a mesh in metres, shape (n, 3), the indices of the corners of each triangle, shape
(m, 3), and the index of its material in the file."""


def material(name: str, rgb: Rgb, *, metallic: float, roughness: float) -> dict[str, Any]:
    """Return a material in glTF, with its metalness and roughness from 0 to 1."""
    factors = {
        "baseColorFactor": [*(linear(channel) for channel in rgb), 1.0],
        "metallicFactor": metallic,
        "roughnessFactor": roughness,
    }
    return {"name": name, "pbrMetallicRoughness": factors}


def glb_bytes(
    bodies: Mapping[str, Body],
    nodes: Sequence[Mapping[str, Any]],
    materials: Sequence[Mapping[str, Any]],
    design: Design,
) -> bytes:
    """Return a GLB file.

    Args:
        bodies: Meshes by name, none empty; nodes refer to them by their index in this order.
        nodes: Nodes in glTF; the first is the root and rotates by `Y_UP`.
        materials: Materials that the bodies refer to, as `material` returns them.
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
        tree["materials"] = list(materials)
        for mesh, (_, _, index) in zip(tree["meshes"], bodies.values(), strict=True):
            mesh["primitives"][0]["material"] = index

    untyped: Any = trimesh
    scene = untyped.Scene()
    for name, (vertices, faces, _) in bodies.items():
        scene.add_geometry(untyped.Trimesh(vertices, faces, process=False), geom_name=name)
    return scene.export(file_type="glb", tree_postprocessor=complete)


LARGEST = 1e9
"""The largest coordinate that lib3mf takes, in millimetres."""

NAMESPACE = "urn:flagged-explorer"
"""The XML namespace of the design in a file's metadata."""


def check_size(points: FloatArray) -> float:
    """Return the largest magnitude of a coordinate of points (n, 3), in millimetres.

    Raises:
        InputError: Lib3mf does not accept the coordinate.
    """
    largest = float(np.abs(points).max())
    if largest > LARGEST:
        raise InputError(
            f"lib3mf takes coordinates up to {LARGEST:g} mm; these reach {largest:.3g} mm: use "
            "another format, or a smaller unit"
        )
    return largest


@contextlib.contextmanager
def refusals_of_lib3mf(what: str) -> Generator[None]:
    """Raise an error of lib3mf as an `ExplorerError` that names what it refuses."""
    import lib3mf  # pyright: ignore[reportMissingTypeStubs]

    library: Any = lib3mf
    try:
        yield
    except library.ELib3MFException as error:
        raise ExplorerError(f"lib3mf refuses the {what}: {error}") from None


class Model:
    """A model of lib3mf with one group of materials.

    Args:
        name: Title of the file.
        design: The design that the file is of.
        colours: Colours of the materials by their names, one at least.
    """

    def __init__(self, name: str, design: Design, colours: Mapping[str, Rgb]) -> None:
        import lib3mf  # pyright: ignore[reportMissingTypeStubs]

        self._library: Any = lib3mf
        wrapper = self._library.get_wrapper()
        self.untransformed: Any = wrapper.GetIdentityTransform()
        self._model: Any = wrapper.CreateModel()
        self._model.SetUnit(self._library.ModelUnit.MilliMeter)
        about = self._model.GetMetaDataGroup()
        for key, value in (
            ("Title", name),
            ("Application", APPLICATION),
            ("Description", f"{name}; one design unit is {design.unit_mm:g} mm"),
        ):
            about.AddMetaData("", key, value, "xs:string", True)
        about.AddMetaData(NAMESPACE, "design", design_json(design), "xs:string", True)
        group = self._model.AddBaseMaterialGroup()
        self._materials: int = group.GetResourceID()
        self._ids = [
            group.AddMaterial(material, wrapper.RGBAToColor(*rgb, 255))
            for material, rgb in colours.items()
        ]

    def add_mesh(
        self, name: str, points: FloatArray, faces: NDArray[np.integer], material: int
    ) -> Any:
        """Add a mesh of one material and return it.

        Args:
            name: Name of the mesh.
            points: Corners in millimetres, shape (n, 3).
            faces: Indices of the corners of each triangle, shape (m, 3).
            material: Index of its material.
        """
        mesh = self._model.AddMeshObject()
        mesh.SetName(name)
        corners = np.ascontiguousarray(points, dtype="<f4")
        triangles = np.ascontiguousarray(faces, dtype="<u4")
        mesh.SetGeometry(
            (self._library.Position * len(corners)).from_buffer_copy(corners),
            (self._library.Triangle * len(triangles)).from_buffer_copy(triangles),
        )
        mesh.SetObjectLevelProperty(self._materials, self._ids[material])
        return mesh

    def colour_faces(self, mesh: Any, material_of_face: NDArray[np.integer]) -> None:
        """Give each triangle of a mesh the material of an index, shape (m,)."""
        properties = np.empty((len(material_of_face), 4), dtype="<u4")
        properties[:, 0] = self._materials
        properties[:, 1:] = np.array(self._ids)[material_of_face][:, None]
        mesh.SetAllTriangleProperties(
            (self._library.TriangleProperties * len(properties)).from_buffer_copy(properties)
        )

    def add_group(self, name: str) -> Any:
        """Add an object that holds others as components and return it."""
        group = self._model.AddComponentsObject()
        group.SetName(name)
        return group

    def transform(self, rotation: FloatArray, origin: FloatArray) -> Any:
        """Return a rotation and a translation in millimetres: its columns, then the origin."""
        transform = self._library.Transform()
        for i, row in enumerate([*rotation.T.tolist(), origin.tolist()]):
            for j, value in enumerate(row):
                transform.Fields[i][j] = value
        return transform

    def encode(self, item: Any, decimals: int) -> bytes:
        """Return the file that shows one object.

        Args:
            item: The object.
            decimals: Decimals of the coordinates, which lib3mf writes with a fixed number.
        """
        self._model.AddBuildItem(item, self.untransformed)
        writer = self._model.QueryWriter("3mf")
        writer.SetDecimalPrecision(decimals)
        return bytes(writer.WriteToBuffer())
