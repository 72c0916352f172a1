"""Meshes for printers, CAD and viewers: 3MF, STL, GLB, OBJ and PLY.

Coordinates are those of the base frame in millimetres; GLB is by its specification in
metres with y up. 3MF, STL and GLB hold single precision (6e-8 of the largest coordinate),
PLY and OBJ double. A file holds the name, a colour or group for each limit, and the design
as JSON, as far as its format allows.

trimesh packs GLB and STL, lib3mf 3MF. PLY and OBJ are written here: those of trimesh have no
limits (comments, groups), and its PLY has single precision.
"""

from __future__ import annotations

import math
import re
from collections.abc import Callable, Iterable, Mapping
from types import MappingProxyType
from typing import Any

import numpy as np

from explorer.errors import ExplorerError, InputError, NoAnswerError
from explorer.export.packing import (
    APPLICATION,
    METRES_PER_MILLIMETRE,
    Y_UP,
    Model,
    Rgb,
    ascii_name,
    check_size,
    comments,
    design_json,
    glb_bytes,
    json_line,
    material,
    printable_name,
    refusals_of_lib3mf,
)
from explorer.mechanism.design import Design
from explorer.numerics.arrays import FloatArray
from explorer.workspace.solids.solid import Solid

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
"""The colour of a limit by the first word of its name, distinct with colour-vision deficiencies."""

HULL_COLOUR: Rgb = (153, 170, 187)
ROUNDING = 1e-5
"""The largest relative change of a volume by rounding; a format that exceeds it is refused."""


def mesh_bytes(solid: Solid, file_format: str, design: Design, name: str) -> bytes:
    """Return a file of a solid.

    Args:
        solid: Solid in design units, closed and not empty.
        file_format: One of `FORMATS`.
        design: Design of the solid, which gives the unit.
        name: Name of the solid in the file.

    Raises:
        InputError: The format is unknown, or too coarse for coordinates of this size.
        NoAnswerError: The solid is empty.
        ExplorerError: The solid is not closed, or the library of the format refuses it.
    """
    check_format(file_format)
    if solid.is_empty:
        reason = f": {', '.join(solid.empty_because)}" if solid.empty_because else ""
        raise NoAnswerError(f"there is nothing to export, the workspace is empty{reason}")
    if not solid.is_watertight:
        raise ExplorerError("the mesh is not watertight, so that it encloses no volume to export")
    return FORMATS[file_format](solid, design, printable_name(name))


def check_format(file_format: str) -> None:
    """Refuse an unknown format.

    Raises:
        InputError: The format is unknown; the message lists the formats.
    """
    if file_format not in FORMATS:
        raise InputError(f"no mesh format {file_format!r}; there are {', '.join(FORMATS)}")


def colour_of(limit: str) -> Rgb:
    """Return the colour of the faces that lie on a limit."""
    return COLOURS.get(limit.partition(" ")[0], HULL_COLOUR)


def _millimetres(solid: Solid, design: Design) -> FloatArray:
    return solid.vertices * design.unit_mm


def _single(
    points: FloatArray, solid: Solid, file_format: str, decimals: int | None = None
) -> FloatArray:
    """Return points rounded to single precision, and to decimals if given, as float64."""
    rounded = points.astype(np.float32).astype(np.float64)
    if decimals is not None:
        rounded = rounded.round(decimals)
    middle = points.mean(axis=0)
    before, after = (_volume(corners - middle, solid) for corners in (points, rounded))
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
    import trimesh

    points = _single(_millimetres(solid, design), solid, "stl")
    # Rounding may merge corners; the facets that it degenerates are left out.
    a, b, c = (points[solid.faces[:, k]] for k in range(3))
    is_facet = ~((a == b).all(axis=1) | (b == c).all(axis=1) | (c == a).all(axis=1))
    untyped: Any = trimesh
    mesh = untyped.Trimesh(points, solid.faces[is_facet], process=False)
    data: bytes = mesh.export(file_type="stl")
    # trimesh leaves the header empty. It must not start with "solid", by which readers tell text
    # from binary.
    text = f"binary STL in millimetres, {APPLICATION}: {ascii_name(name)}"
    return text.encode()[:80].ljust(80) + data[80:]


def _ply(solid: Solid, design: Design, name: str) -> bytes:
    lines = [
        "ply",
        "format binary_little_endian 1.0",
        f"comment {APPLICATION}",
        *comments("comment name", json_line(name)[1:-1]),
        "comment unit millimetre",
        *(
            f"comment colour {_join_numbers(colour_of(limit))} {ascii_name(limit)}"
            for limit in solid.limits
        ),
        *comments("comment design", design_json(design)),
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
        *comments("# design", design_json(design)),
        f"o {_word(name)}",
        *(f"v {_join_numbers(point)}" for point in _millimetres(solid, design).tolist()),
    ]
    for index, limit in enumerate(solid.limits):
        faces = solid.faces[solid.limit_of_face == index] + 1
        if len(faces):
            lines.append(f"g {_word(limit)}")
            lines.extend(f"f {_join_numbers(face)}" for face in faces.tolist())
    return ("\n".join(lines) + "\n").encode("ascii")


def _glb(solid: Solid, design: Design, name: str) -> bytes:
    points = _single(_millimetres(solid, design) * METRES_PER_MILLIMETRE, solid, "glb")
    return glb_bytes(
        {name: (points, solid.faces, 0)},
        [{"name": name, "mesh": 0, "rotation": Y_UP}],
        [material("workspace", HULL_COLOUR, metallic=0.0, roughness=0.8)],
        design,
    )


def _3mf(solid: Solid, design: Design, name: str) -> bytes:
    points = _millimetres(solid, design)
    largest = check_size(points)
    # lib3mf writes fixed decimals, which it computes as integers of 64 bits.
    decimals = min(16, max(4, 11 - math.floor(math.log10(largest))))
    points = _single(points, solid, "3mf", decimals)
    with refusals_of_lib3mf("mesh"):
        model = Model(name, design, {limit: colour_of(limit) for limit in solid.limits})
        mesh = model.add_mesh(name, points, solid.faces, 0)
        model.colour_faces(mesh, solid.limit_of_face)
        return model.encode(mesh, decimals)


def _word(name: str) -> str:
    """Return a name of OBJ: without blanks, and without what ends or continues a line."""
    return re.sub(r"[ #\\]", "_", ascii_name(name))


def _join_numbers(values: Iterable[float]) -> str:
    """Return numbers with all their digits, separated by spaces."""
    return " ".join(map(repr, values))


FORMATS: Mapping[str, Callable[[Solid, Design, str], bytes]] = MappingProxyType(
    {"3mf": _3mf, "stl": _stl, "glb": _glb, "obj": _obj, "ply": _ply}
)
"""The writer of each format by its name, which is also its suffix."""
