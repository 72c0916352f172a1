"""Meshes for printers, CAD and viewers: 3MF, STL, GLB, OBJ and PLY.

Coordinates are those of the base frame in millimetres; GLB is by its specification in
metres and has y up, and says so. 3MF, STL and GLB hold single precision (6e-8 of the
largest coordinate), PLY and OBJ double. What a format has room for goes with it: a name,
a colour for each limit, and the design as JSON.
"""

from __future__ import annotations

import json
import math
import struct
from collections.abc import Callable, Iterable, Mapping
from pathlib import Path
from types import MappingProxyType
from typing import Any, TypeAlias

import msgspec
import numpy as np

from explorer import __version__
from explorer.errors import ExplorerError, InputError, NoAnswerError
from explorer.files.writing import write_whole
from explorer.mechanism.design import Design
from explorer.numerics.arrays import FloatArray
from explorer.workspace.solids.solid import Solid

Rgb: TypeAlias = tuple[int, int, int]

APPLICATION = f"flagged-explorer {__version__}"
NAMESPACE = "urn:flagged-explorer"
"""Of the design in the metadata of a 3MF file."""

# By the first word of a limit's name; pairs that colour-vision deficiencies keep apart.
COLOURS: Mapping[str, Rgb] = MappingProxyType(
    {
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
)
HULL_COLOUR: Rgb = (153, 170, 187)
LARGEST_3MF = 1e9
# Rounding may change a volume by this share before a format is refused.
ROUNDING = 1e-5


def mesh_bytes(solid: Solid, file_format: str, design: Design, name: str) -> bytes:
    """Return a file of a solid.

    Args:
        solid: Closed and not empty.
        file_format: One of `FORMATS`.
        design: What it is of.
        name: What to call it.

    Raises:
        InputError: another format, or one too coarse for where the solid lies.
        NoAnswerError: the solid is empty.
        ExplorerError: the solid is not closed, or the library of the format refuses it.
    """
    check_format(file_format)
    if solid.is_empty:
        reason = f": {', '.join(solid.empty_because)}" if solid.empty_because else ""
        raise NoAnswerError(f"there is nothing to export, the workspace is empty{reason}")
    if not solid.is_watertight:
        raise ExplorerError("the mesh is not watertight, so that it encloses no volume to export")
    plain = " ".join("".join(c if c.isprintable() else " " for c in name).split())
    return FORMATS[file_format](solid, design, plain or "workspace")


def write_mesh(solid: Solid, path: Path, file_format: str, design: Design, name: str) -> None:
    """Write a file of a solid, whole or not at all.

    Args:
        solid: Closed and not empty.
        path: The file; an existing one is replaced.
        file_format: One of `FORMATS`.
        design: What it is of.
        name: What to call it.

    Raises:
        InputError: as of `mesh_bytes`, or a file that cannot be written.
        NoAnswerError: the solid is empty.
        ExplorerError: the solid is not closed, or the library of the format refuses it.
    """
    write_whole(path, mesh_bytes(solid, file_format, design, name))


def check_format(file_format: str) -> None:
    """Refuse formats that there are not.

    Raises:
        InputError: no such format.
    """
    if file_format not in FORMATS:
        raise InputError(f"no mesh format {file_format!r}; there are {', '.join(FORMATS)}")


def colour_of(limit: str) -> Rgb:
    """Return the colour of the faces that a limit bounds."""
    return COLOURS.get(limit.partition(" ")[0], HULL_COLOUR)


def design_json(design: Design) -> str:
    """Return the design as JSON on one line, in ASCII."""
    return json.dumps(json.loads(msgspec.json.encode(design)))


def _millimetres(solid: Solid, design: Design) -> FloatArray:
    return solid.vertices * design.unit_mm


def _single(
    points: FloatArray, solid: Solid, file_format: str, decimals: int | None = None
) -> FloatArray:
    """Return points rounded to single precision, and to decimals if given, as float64.

    Raises:
        InputError: rounding spoils the volume.
    """
    with np.errstate(over="ignore", under="ignore"):
        rounded = points.astype(np.float32).astype(np.float64)
    if np.isfinite(rounded).all():
        if decimals is not None:
            rounded = rounded.round(decimals)
        middle = points.mean(axis=0)
        before, after = (_volume(each - middle, solid) for each in (points, rounded))
        if abs(after - before) <= ROUNDING * before:
            return rounded
    raise InputError(
        f"{file_format} holds single precision, which spoils a mesh of this size at coordinates up "
        f"to {float(np.abs(points).max()):.3g}; ply and obj hold double"
    )


def _volume(points: FloatArray, solid: Solid) -> float:
    a, b, c = (points[solid.faces[:, k]] for k in range(3))
    return float(np.einsum("ij,ij->", a, np.cross(b, c))) / 6.0


def _stl(solid: Solid, design: Design, name: str) -> bytes:
    points = _single(_millimetres(solid, design), solid, "stl")
    corners = points[solid.faces]
    normals = np.cross(corners[:, 1] - corners[:, 0], corners[:, 2] - corners[:, 0])
    lengths = np.linalg.norm(normals, axis=1, keepdims=True)
    normals = np.divide(normals, lengths, out=np.zeros_like(normals), where=lengths > 0.0)
    # Edges that rounding has closed leave facets of two corners, which bound nothing.
    a, b, c = corners[:, 0], corners[:, 1], corners[:, 2]
    kept = ~((a == b).all(axis=1) | (b == c).all(axis=1) | (c == a).all(axis=1))
    layout = np.dtype([("normal", "<f4", 3), ("corners", "<f4", (3, 3)), ("attribute", "<u2")])
    facets = np.zeros(int(kept.sum()), dtype=layout)
    facets["normal"], facets["corners"] = normals[kept], corners[kept]
    # It must not start with "solid", by which readers tell text from binary.
    text = f"binary STL in millimetres, {APPLICATION}: {name}"
    header = text.encode("ascii", "replace")[:80].ljust(80)
    return header + struct.pack("<I", len(facets)) + facets.tobytes()


def _ply(solid: Solid, design: Design, name: str) -> bytes:
    lines = [
        "ply",
        "format binary_little_endian 1.0",
        f"comment {APPLICATION}",
        f"comment name {json.dumps(name)[1:-1]}",
        "comment unit millimetre",
        *(f"comment colour {_spaced(colour_of(limit))} {_ascii(limit)}" for limit in solid.limits),
        f"comment design {design_json(design)}",
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
    return head + _millimetres(solid, design).astype("<f8").tobytes() + faces.tobytes()


def _obj(solid: Solid, design: Design, name: str) -> bytes:
    lines = [
        f"# {APPLICATION}",
        "# unit millimetre",
        f"# design {design_json(design)}",
        f"o {_ascii(name).replace(' ', '_')}",
        *(f"v {_spaced(point)}" for point in _millimetres(solid, design).tolist()),
    ]
    for index, limit in enumerate(solid.limits):
        faces = solid.faces[solid.limit_of_face == index] + 1
        if len(faces):
            lines.append(f"g {_ascii(limit).replace(' ', '_')}")
            lines.extend(f"f {_spaced(face)}" for face in faces.tolist())
    return ("\n".join(lines) + "\n").encode("ascii")


def _glb(solid: Solid, design: Design, name: str) -> bytes:
    points = _single(_millimetres(solid, design) * 1e-3, solid, "glb")
    positions = points.astype("<f4").tobytes()
    indices = solid.faces.astype("<u4").tobytes()
    red, green, blue = (linear(channel) for channel in HULL_COLOUR)
    quarter = math.sqrt(0.5)
    scene: dict[str, Any] = {
        "asset": {
            "version": "2.0",
            "generator": APPLICATION,
            "extras": {
                "unit": "metre; millimetres of the base frame times 0.001",
                "up": "the node turns the base frame, whose z is up, to y up",
                "unit_mm": design.unit_mm,
                "design": json.loads(design_json(design)),
            },
        },
        "scene": 0,
        "scenes": [{"nodes": [0]}],
        "nodes": [{"name": name, "mesh": 0, "rotation": [-quarter, 0.0, 0.0, quarter]}],
        "meshes": [
            {
                "name": name,
                "primitives": [{"attributes": {"POSITION": 0}, "indices": 1, "material": 0}],
            }
        ],
        "materials": [
            {
                "name": "workspace",
                "pbrMetallicRoughness": {
                    "baseColorFactor": [red, green, blue, 1.0],
                    "metallicFactor": 0.0,
                    "roughnessFactor": 0.8,
                },
            }
        ],
        "accessors": [
            {
                "bufferView": 0,
                "componentType": 5126,
                "count": len(points),
                "type": "VEC3",
                "min": points.min(axis=0).tolist(),
                "max": points.max(axis=0).tolist(),
            },
            {
                "bufferView": 1,
                "componentType": 5125,
                "count": int(solid.faces.size),
                "type": "SCALAR",
            },
        ],
        "bufferViews": [
            {"buffer": 0, "byteOffset": 0, "byteLength": len(positions), "target": 34962},
            {
                "buffer": 0,
                "byteOffset": len(positions),
                "byteLength": len(indices),
                "target": 34963,
            },
        ],
        "buffers": [{"byteLength": len(positions) + len(indices)}],
    }
    return pack_glb(scene, positions + indices)


def pack_glb(scene: Mapping[str, Any], binary: bytes) -> bytes:
    """Return a GLB file of a glTF scene and its one buffer, a multiple of four bytes."""
    text = json.dumps(scene).encode()
    text += b" " * (-len(text) % 4)
    length = 12 + 8 + len(text) + 8 + len(binary)
    return b"".join(
        [
            struct.pack("<4sII", b"glTF", 2, length),
            struct.pack("<I4s", len(text), b"JSON"),
            text,
            struct.pack("<I4s", len(binary), b"BIN\0"),
            binary,
        ]
    )


def _3mf(solid: Solid, design: Design, name: str) -> bytes:
    import lib3mf  # pyright: ignore[reportMissingTypeStubs]

    points = _millimetres(solid, design)
    largest = float(np.abs(points).max())
    if largest > LARGEST_3MF:
        raise InputError(
            f"lib3mf takes coordinates up to {LARGEST_3MF:g} mm; these reach {largest:.3g} mm: use "
            "another format, or a smaller unit"
        )
    # lib3mf writes fixed decimals, by way of integers of 64 bits.
    decimals = min(16, max(4, 11 - math.floor(math.log10(largest))))
    points = _single(points, solid, "3mf", decimals)
    library: Any = lib3mf
    try:
        wrapper = library.get_wrapper()
        model = wrapper.CreateModel()
        model.SetUnit(library.ModelUnit.MilliMeter)
        describe(model, name, design)
        mesh = model.AddMeshObject()
        mesh.SetName(name)
        corners = np.ascontiguousarray(points, dtype="<f4")
        faces = np.ascontiguousarray(solid.faces, dtype="<u4")
        mesh.SetGeometry(
            (library.Position * len(corners)).from_buffer_copy(corners),
            (library.Triangle * len(faces)).from_buffer_copy(faces),
        )
        materials = model.AddBaseMaterialGroup()
        resource = materials.GetResourceID()
        ids = np.array(
            [
                materials.AddMaterial(limit, wrapper.RGBAToColor(*colour_of(limit), 255))
                for limit in solid.limits
            ],
            dtype="<u4",
        )
        of_face = np.repeat(ids[solid.limit_of_face][:, None], 4, axis=1)
        of_face[:, 0] = resource
        mesh.SetObjectLevelProperty(resource, int(ids[0]))
        mesh.SetAllTriangleProperties(
            (library.TriangleProperties * len(faces)).from_buffer_copy(of_face)
        )
        model.AddBuildItem(mesh, wrapper.GetIdentityTransform())
        writer = model.QueryWriter("3mf")
        writer.SetDecimalPrecision(decimals)
        return bytes(writer.WriteToBuffer())
    except library.ELib3MFException as error:
        raise ExplorerError(f"lib3mf refuses the mesh: {error}") from None


def describe(model: Any, name: str, design: Design) -> None:
    """Add what a model of lib3mf is of: its name, the application and the design."""
    about = model.GetMetaDataGroup()
    for key, value in (
        ("Title", name),
        ("Application", APPLICATION),
        ("Description", f"{name}; one design unit is {design.unit_mm:g} mm"),
    ):
        about.AddMetaData("", key, value, "xs:string", True)
    about.AddMetaData(NAMESPACE, "design", design_json(design), "xs:string", True)


def _ascii(text: str) -> str:
    return text.encode("ascii", "replace").decode()


def _spaced(values: Iterable[float]) -> str:
    """Return numbers with all their digits, separated by blanks."""
    return " ".join(map(repr, values))


def linear(channel: int) -> float:
    """Return a channel of sRGB, 0 to 255, as linear light."""
    share = channel / 255.0
    return share / 12.92 if share <= 0.04045 else ((share + 0.055) / 1.055) ** 2.4


FORMATS: Mapping[str, Callable[[Solid, Design, str], bytes]] = MappingProxyType(
    {"3mf": _3mf, "stl": _stl, "glb": _glb, "obj": _obj, "ply": _ply}
)
"""What writes each format, by its name, which is also its suffix."""
