"""Meshes for printers, CAD and viewers: 3MF, STL, GLB, OBJ and PLY, with names and colours.

Coordinates are those of the base frame in millimetres; GLB is by its specification in metres with
y up. 3MF, STL and GLB hold single precision (6e-8 of the largest coordinate), PLY and OBJ double.

trimesh packs GLB and STL, lib3mf 3MF. PLY and OBJ are written here: those of trimesh have no limits
(comments, groups), and its PLY has single precision.
"""

from __future__ import annotations

import math
import re
import unicodedata
from collections.abc import Callable, Collection, Iterable, Mapping, Sequence
from dataclasses import replace
from typing import Any, TypeAlias

import msgspec
import numpy as np
from numpy.typing import NDArray

from explorer import __version__
from explorer.errors import ExplorerError, InputError, NoAnswerError
from explorer.mechanism.design import Design
from explorer.mechanism.rgb import Rgb, linear
from explorer.numerics.arrays import FloatArray
from explorer.workspace.solids.solid import Solid

APPLICATION = f"flagged-explorer {__version__}"
# Largest number of characters of a name in a file.
LONGEST_NAME = 160


def printable_name(name: str) -> str:
    """Return a name as one printable line of 1 to `LONGEST_NAME` characters."""
    printable = "".join(letter if letter.isprintable() else " " for letter in name)
    return " ".join(printable.split())[:LONGEST_NAME].rstrip() or "workspace"


def ascii_name(name: str) -> str:
    """Return a name in ASCII: letters without their accents, others left out; δ1 becomes 1."""
    return printable_name(unicodedata.normalize("NFKD", name).encode("ascii", "ignore").decode())


def check_format(file_format: str, formats: Collection[str], what: str) -> None:
    """Refuse an unknown format of a file, such as a "mesh".

    Raises:
        InputError: The format is unknown; the message lists the formats.
    """
    if file_format not in formats:
        raise InputError(f"no {what} format {file_format!r}; there are {', '.join(formats)}")


Y_UP = [-math.sqrt(0.5), 0.0, 0.0, math.sqrt(0.5)]
"""The rotation (x, y, z, w) of the first node, which turns z up to y up."""


def material(name: str, rgb: Rgb, *, metallic: float, roughness: float) -> dict[str, Any]:
    """Return a material in glTF, with its metalness and roughness from 0 to 1."""
    factors = {
        "baseColorFactor": [*(linear(channel) for channel in rgb), 1.0],
        "metallicFactor": metallic,
        "roughnessFactor": roughness,
    }
    return {"name": name, "pbrMetallicRoughness": factors}


def as_trimesh(vertices: FloatArray, faces: NDArray[np.integer]) -> Any:
    """Return a mesh of vertices (n, 3) and faces (m, 3), as they are, as one of trimesh."""
    import trimesh

    untyped: Any = trimesh
    return untyped.Trimesh(vertices, faces, process=False)


def glb_bytes(
    bodies: Mapping[str, tuple[FloatArray, NDArray[np.integer], int]],
    nodes: Sequence[Mapping[str, Any]],
    materials: Sequence[Mapping[str, Any]],
    design: Design,
) -> bytes:
    """Return a GLB file, which keeps the design as JSON.

    A body by name is corners (n, 3) in metres, triangles (m, 3), and the index of a material. Nodes
    refer to them in their order; the first one is the root and rotates by `Y_UP`.
    """
    import trimesh

    def complete(tree: dict[str, Any]) -> None:
        extras = {
            "unit": "metre; millimetres of the base frame times 0.001",
            "up": "the first node turns the base frame, whose z is up, to y up",
            "unit_mm": design.unit_mm,
            "design": msgspec.to_builtins(design),
        }
        tree["asset"] = {"version": "2.0", "generator": APPLICATION, "extras": extras}
        tree["scenes"] = [{"nodes": [0]}]
        tree["nodes"] = list(nodes)
        tree["materials"] = list(materials)
        for mesh, (_, _, index) in zip(tree["meshes"], bodies.values(), strict=True):
            mesh["primitives"][0]["material"] = index

    untyped: Any = trimesh
    scene = untyped.Scene()
    for name, (vertices, faces, _) in bodies.items():
        scene.add_geometry(as_trimesh(vertices, faces), geom_name=name)
    return scene.export(file_type="glb", tree_postprocessor=complete)


NAMESPACE = "urn:flagged-explorer"
"""The XML namespace of the design in a file's metadata."""


class ThreeMfModel:
    """A model of lib3mf: a title, a design, and colours of materials by name, at least one."""

    def __init__(self, name: str, design: Design, colours: Mapping[str, Rgb]) -> None:
        import lib3mf  # pyright: ignore[reportMissingTypeStubs]

        self._library: Any = lib3mf
        wrapper = self._library.get_wrapper()
        self.untransformed: Any = wrapper.GetIdentityTransform()
        self._model: Any = wrapper.CreateModel()
        self._model.SetUnit(self._library.ModelUnit.MilliMeter)
        about = self._model.GetMetaDataGroup()
        for space, key, value in (
            ("", "Title", name),
            ("", "Application", APPLICATION),
            ("", "Description", f"{name}; one design unit is {design.unit_mm:g} mm"),
            (NAMESPACE, "design", msgspec.json.encode(design).decode()),
        ):
            about.AddMetaData(space, key, value, "xs:string", True)
        group = self._model.AddBaseMaterialGroup()
        self._materials: int = group.GetResourceID()
        self._ids = [
            group.AddMaterial(material, wrapper.RGBAToColor(*rgb, 255))
            for material, rgb in colours.items()
        ]

    def add_mesh(
        self, name: str, points: FloatArray, faces: NDArray[np.integer], material: int
    ) -> Any:
        """Add a mesh of one material, given by its index, and return it.

        Corners (n, 3) are in millimetres; the faces (m, 3) are indices of them.
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
        """Return the file that shows one object; lib3mf writes a fixed number of decimals."""
        self._model.AddBuildItem(item, self.untransformed)
        writer = self._model.QueryWriter("3mf")
        writer.SetDecimalPrecision(decimals)
        return bytes(writer.WriteToBuffer())


COLOURS: Mapping[str, Rgb] = {
    "l1": (68, 119, 170),
    "d2": (102, 204, 238),
    "d4": (34, 136, 51),
    "l4": (204, 187, 68),
    "d1": (238, 119, 51),
    "d3": (238, 153, 102),
    "box": (187, 187, 187),
    "margin": (238, 102, 119),
    "swing": (170, 51, 119),
}
"""The colour of a limit by the first word of its name, distinct with colour-vision deficiencies."""

HULL_COLOUR: Rgb = (153, 170, 187)
ROUNDING = 1e-5
"""The largest relative change of a volume by rounding; a format that exceeds it is refused."""


def mesh_bytes(solid: Solid, file_format: str, design: Design, name: str) -> bytes:
    """Return a file in one of `FORMATS` of a named solid in the units of a design.

    Raises:
        InputError: The format is unknown, or too coarse for coordinates of this size.
        NoAnswerError: The solid is empty.
        ExplorerError: The solid is not closed, or the library of the format refuses it.
    """
    check_format(file_format, FORMATS, "mesh")
    if solid.is_empty:
        reason = f": {', '.join(solid.empty_because)}" if solid.empty_because else ""
        raise NoAnswerError(f"there is nothing to export, the workspace is empty{reason}")
    if not solid.is_watertight:
        raise ExplorerError("the mesh is not watertight, so that it encloses no volume to export")
    solid = replace(solid, vertices=solid.vertices * design.unit_mm)
    return FORMATS[file_format](solid, design, printable_name(name))


def colour_of(limit: str) -> Rgb:
    """Return the colour of the faces that lie on a limit."""
    return COLOURS.get(limit.partition(" ")[0], HULL_COLOUR)


def _single(solid: Solid, file_format: str, decimals: int | None = None) -> Solid:
    """Return a solid rounded to single precision, and to decimals if given."""
    points = solid.vertices.astype(np.float32).astype(np.float64)
    rounded = replace(solid, vertices=points if decimals is None else points.round(decimals))
    if abs(rounded.volume - solid.volume) <= ROUNDING * solid.volume:
        return rounded
    raise InputError(
        f"{file_format} holds single precision, which spoils a mesh of this size at coordinates up "
        f"to {float(np.abs(points).max()):.3g}; ply and obj hold double"
    )


def _stl(solid: Solid, _: Design, name: str) -> bytes:
    points = _single(solid, "stl").vertices
    # Rounding may merge corners; the facets that it degenerates are left out.
    a, b, c = (points[solid.faces[:, k]] for k in range(3))
    is_facet = ~((a == b).all(axis=1) | (b == c).all(axis=1) | (c == a).all(axis=1))
    data: bytes = as_trimesh(points, solid.faces[is_facet]).export(file_type="stl")
    # trimesh leaves the header empty. It must not start with "solid", by which readers tell text
    # from binary.
    text = f"binary STL in millimetres, {APPLICATION}: {ascii_name(name)}"
    return text.encode()[:80].ljust(80) + data[80:]


def _ply(solid: Solid, *_: object) -> bytes:
    lines = [
        "ply",
        "format binary_little_endian 1.0",
        f"comment {APPLICATION}",
        "comment unit millimetre",
        *(
            f"comment colour {_join_numbers(colour_of(limit))} {ascii_name(limit)}"
            for limit in solid.limits
        ),
        f"element vertex {len(solid.vertices)}",
        *(f"property double {axis}" for axis in "xyz"),
        f"element face {len(solid.faces)}",
        "property list uchar int vertex_indices",
        *(f"property uchar {channel}" for channel in ("red", "green", "blue")),
        "end_header",
    ]
    layout = np.dtype([("count", "u1"), ("corners", "<i4", 3), ("colour", "u1", 3)])
    faces = np.zeros(len(solid.faces), dtype=layout)
    faces["count"], faces["corners"] = 3, solid.faces
    faces["colour"] = np.array([colour_of(limit) for limit in solid.limits])[solid.limit_of_face]
    head = ("\n".join(lines) + "\n").encode("ascii")
    return head + solid.vertices.astype("<f8").tobytes() + faces.tobytes()


def _obj(solid: Solid, _: Design, name: str) -> bytes:
    lines = [
        f"# {APPLICATION}",
        "# unit millimetre",
        f"o {_word(name)}",
        *(f"v {_join_numbers(point)}" for point in solid.vertices.tolist()),
    ]
    for index, limit in enumerate(solid.limits):
        faces = solid.faces[solid.limit_of_face == index] + 1
        if len(faces):
            lines.append(f"g {_word(limit)}")
            lines.extend(f"f {_join_numbers(face)}" for face in faces.tolist())
    return ("\n".join(lines) + "\n").encode("ascii")


def _glb(solid: Solid, design: Design, name: str) -> bytes:
    metres = _single(replace(solid, vertices=1e-3 * solid.vertices), "glb")
    return glb_bytes(
        {name: (metres.vertices, solid.faces, 0)},
        [{"name": name, "mesh": 0, "rotation": Y_UP}],
        [material("workspace", HULL_COLOUR, metallic=0.0, roughness=0.8)],
        design,
    )


def _3mf(solid: Solid, design: Design, name: str) -> bytes:
    # lib3mf writes fixed decimals, which it computes as integers of 64 bits.
    largest = float(np.abs(solid.vertices).max())
    decimals = min(16, max(4, 11 - math.floor(math.log10(largest))))
    points = _single(solid, "3mf", decimals).vertices
    model = ThreeMfModel(name, design, {limit: colour_of(limit) for limit in solid.limits})
    mesh = model.add_mesh(name, points, solid.faces, 0)
    model.colour_faces(mesh, solid.limit_of_face)
    return model.encode(mesh, decimals)


def _word(name: str) -> str:
    """Return a name of OBJ: without blanks, and without what ends or continues a line."""
    return re.sub(r"[ #\\]", "_", ascii_name(name))


def _join_numbers(values: Iterable[float]) -> str:
    """Return numbers with all their digits, separated by spaces."""
    return " ".join(map(repr, values))


_Writer: TypeAlias = Callable[[Solid, Design, str], bytes]
FORMATS: Mapping[str, _Writer] = {"3mf": _3mf, "stl": _stl, "glb": _glb, "obj": _obj, "ply": _ply}
"""The writer of each format by its name, which is also its suffix."""
