"""The prototype for printers, CAD and viewers: 3MF, GLB, and a zip with an STL for each part.

3MF and STL are in millimetres, GLB by its specification in metres with y up. The assembly is
in the home pose. In 3MF each leg is a group of its parts; in GLB the tree of nodes is that of
the joints, so that turning or moving a node moves all that hangs on it. STL files hold each
part in the frame that it moves with.
"""

from __future__ import annotations

import io
import json
import math
import zipfile
from collections.abc import Callable, Mapping, Sequence
from pathlib import Path
from types import MappingProxyType
from typing import Any

import numpy as np

from explorer.errors import ExplorerError, InputError
from explorer.export.mesh import (
    APPLICATION,
    LARGEST_3MF,
    Rgb,
    describe,
    design_json,
    linear,
    mesh_bytes,
    pack_glb,
)
from explorer.files.writing import write_whole
from explorer.mechanism.home import home_pose
from explorer.mechanism.pose import quaternion_from_rotation
from explorer.numerics.arrays import FloatArray
from explorer.prototype.assembly import Prototype
from explorer.prototype.chains import BODIES, CHAIN_JOINTS, LEGS, ON_GUIDE, Places

COLOURS: Mapping[str, Rgb] = MappingProxyType(
    {
        "base": (214, 219, 226),
        "carriage": (238, 119, 51),
        "cross": (204, 187, 68),
        "cylinder": (68, 119, 170),
        "rod": (188, 197, 209),
        "platform": (34, 136, 51),
        "ball": (170, 51, 119),
    }
)
"""The colours of the kinds of parts."""

# Of the coordinates in 3MF, which are in millimetres.
_DECIMALS = 6


def assembly_bytes(prototype: Prototype, file_format: str) -> bytes:
    """Return a file of a prototype, assembled in the home pose.

    Args:
        prototype: Its parts.
        file_format: One of `FORMATS`.

    Raises:
        InputError: another format, or parts too large for it.
        ExplorerError: the library of the format refuses the parts.
    """
    check_format(file_format)
    return FORMATS[file_format](prototype)


def write_assembly(prototype: Prototype, path: Path, file_format: str) -> None:
    """Write a file of a prototype, whole or not at all.

    Raises:
        InputError: as of `assembly_bytes`, or a file that cannot be written.
        ExplorerError: the library of the format refuses the parts.
    """
    write_whole(path, assembly_bytes(prototype, file_format))


def check_format(file_format: str) -> None:
    """Refuse formats that there are not.

    Raises:
        InputError: no such format.
    """
    if file_format not in FORMATS:
        raise InputError(
            f"no format {file_format!r} of assemblies; there are {', '.join(FORMATS)}, step"
        )


def _at_home(prototype: Prototype) -> Places:
    """Return where the bodies are at home, in the order of `BODIES`."""
    home = home_pose(prototype.design)
    return prototype.chains.places_at(home.position, home.rotation)


def groups_of() -> Sequence[tuple[str, Sequence[str]]]:
    """Return the groups that people take apart, with the names of their parts."""
    legs = [(f"leg {leg}", [f"{kind} {leg}" for kind in _chain(leg)]) for leg in LEGS]
    top = ["platform", *(f"ball {leg}" for leg in LEGS)]
    return [("base", ["base"]), *legs, ("platform with balls", top)]


def _chain(leg: int) -> tuple[str, str, str]:
    return ("carriage" if leg in ON_GUIDE else "cross", "cylinder", "rod")


def _3mf(prototype: Prototype) -> bytes:
    import lib3mf  # pyright: ignore[reportMissingTypeStubs]

    unit, places = prototype.design.unit_mm, _at_home(prototype)
    largest = unit * max(float(np.abs(points).max()) for points in _everywhere(prototype))
    if largest > LARGEST_3MF:
        raise InputError(
            f"lib3mf takes coordinates up to {LARGEST_3MF:g} mm; these reach {largest:.3g} mm: use "
            "another format, or a smaller unit"
        )
    library: Any = lib3mf
    try:
        wrapper = library.get_wrapper()
        model = wrapper.CreateModel()
        model.SetUnit(library.ModelUnit.MilliMeter)
        describe(model, f"mechanism of {prototype.design.name}", prototype.design)
        materials = model.AddBaseMaterialGroup()
        colours = {
            kind: materials.AddMaterial(kind, wrapper.RGBAToColor(*rgb, 255))
            for kind, rgb in COLOURS.items()
        }
        whole = model.AddComponentsObject()
        whole.SetName("mechanism")
        by_name = {part.name: part for part in prototype.parts}
        for name, members in groups_of():
            group = model.AddComponentsObject()
            group.SetName(name)
            for member in members:
                part = by_name[member]
                mesh = model.AddMeshObject()
                mesh.SetName(part.name)
                corners = np.ascontiguousarray(part.vertices * unit, dtype="<f4")
                faces = np.ascontiguousarray(part.faces, dtype="<u4")
                mesh.SetGeometry(
                    (library.Position * len(corners)).from_buffer_copy(corners),
                    (library.Triangle * len(faces)).from_buffer_copy(faces),
                )
                mesh.SetObjectLevelProperty(materials.GetResourceID(), colours[part.kind])
                placed = _placed(library, places, part.body_index, unit)
                group.AddComponent(mesh, placed)
            whole.AddComponent(group, wrapper.GetIdentityTransform())
        model.AddBuildItem(whole, wrapper.GetIdentityTransform())
        writer = model.QueryWriter("3mf")
        writer.SetDecimalPrecision(_DECIMALS)
        return bytes(writer.WriteToBuffer())
    except library.ELib3MFException as error:
        raise ExplorerError(f"lib3mf refuses the parts: {error}") from None


def _everywhere(prototype: Prototype) -> tuple[FloatArray, ...]:
    home = home_pose(prototype.design)
    return prototype.at(home.position, home.rotation)


def _placed(library: Any, places: Places, body: int, unit: float) -> Any:
    """Return where a body is as lib3mf has it: the columns of the rotation, then the origin."""
    found = library.Transform()
    rows = [*places.rotation[body].T.tolist(), (places.origin[body] * unit).tolist()]
    for i, row in enumerate(rows):
        for j, value in enumerate(row):
            found.Fields[i][j] = value
    return found


class _Buffer:
    """The one buffer of a glTF scene, with its views and accessors."""

    def __init__(self) -> None:
        self.data = b""
        self.views: list[dict[str, Any]] = []
        self.accessors: list[dict[str, Any]] = []

    def add(self, array: Any, target: int, **accessor: Any) -> int:
        """Add an array and return the index of its accessor."""
        data = array.tobytes()
        place = {"byteOffset": len(self.data), "byteLength": len(data), "target": target}
        self.views.append({"buffer": 0, **place})
        self.accessors.append({"bufferView": len(self.views) - 1, **accessor})
        self.data += data
        return len(self.accessors) - 1


def _glb(prototype: Prototype) -> bytes:
    metres, places = 1e-3 * prototype.design.unit_mm, _at_home(prototype)
    buffer = _Buffer()
    meshes: list[dict[str, Any]] = []
    kinds = list(COLOURS)
    for part in prototype.parts:
        points = (part.vertices * metres).astype("<f4")
        corners = buffer.add(
            points,
            34962,
            componentType=5126,
            count=len(points),
            type="VEC3",
            min=points.min(axis=0).tolist(),
            max=points.max(axis=0).tolist(),
        )
        faces = part.faces.astype("<u4")
        indices = buffer.add(faces, 34963, componentType=5125, count=faces.size, type="SCALAR")
        primitive = {
            "attributes": {"POSITION": corners},
            "indices": indices,
            "material": kinds.index(part.kind),
        }
        meshes.append({"name": part.name, "primitives": [primitive]})
    scene: dict[str, Any] = {
        "asset": {
            "version": "2.0",
            "generator": APPLICATION,
            "extras": {
                "unit": "metre; millimetres of the base frame times 0.001",
                "up": "the first node turns the base frame, whose z is up, to y up",
                "unit_mm": prototype.design.unit_mm,
                "design": json.loads(design_json(prototype.design)),
            },
        },
        "scene": 0,
        "scenes": [{"nodes": [0]}],
        "nodes": _nodes(prototype, places, metres),
        "meshes": meshes,
        "materials": [_material(kind, rgb) for kind, rgb in COLOURS.items()],
        "accessors": buffer.accessors,
        "bufferViews": buffer.views,
        "buffers": [{"byteLength": len(buffer.data)}],
    }
    return pack_glb(scene, buffer.data)


def _material(kind: str, rgb: Rgb) -> dict[str, Any]:
    colour = [*(linear(channel) for channel in rgb), 1.0]
    factors = {"baseColorFactor": colour, "metallicFactor": 0.2, "roughnessFactor": 0.6}
    return {"name": kind, "pbrMetallicRoughness": factors}


def _nodes(prototype: Prototype, places: Places, metres: float) -> list[dict[str, Any]]:
    """Return the nodes: the mechanism, the bodies from joint to joint, the balls."""
    quarter = math.sqrt(0.5)
    nodes: list[dict[str, Any]] = [
        {"name": "mechanism", "rotation": [-quarter, 0.0, 0.0, quarter], "children": [1]}
    ]
    indices: dict[str, int] = {}
    for number, part in enumerate(prototype.parts):
        node: dict[str, Any] = {"name": part.name, "mesh": number}
        if part.name in BODIES:
            indices[part.name] = len(nodes)
            outer = _parent(part.name)
            if outer is not None:
                node.update(_relative(places, part.body_index, BODIES.index(outer), metres))
                nodes[indices[outer]].setdefault("children", []).append(len(nodes))
                if part.name != "platform":
                    node["extras"] = {"joint": CHAIN_JOINTS[part.body_index - 1]}
        else:
            nodes[indices[part.body]].setdefault("children", []).append(len(nodes))
        nodes.append(node)
    return nodes


def _parent(body: str) -> str | None:
    """Return what a body is joined to on the side of the base; the platform to the base."""
    if body == "base":
        return None
    kind, _, leg = body.partition(" ")
    before = {"rod": "cylinder", "cylinder": "carriage" if leg in "23" else "cross"}.get(kind)
    return f"{before} {leg}" if before else "base"


def _relative(places: Places, body: int, outer: int, metres: float) -> dict[str, list[float]]:
    turn = places.rotation[outer].T
    w, x, y, z = quaternion_from_rotation(turn @ places.rotation[body]).tolist()
    offset = turn @ (places.origin[body] - places.origin[outer]) * metres
    return {"rotation": [x, y, z, w], "translation": offset.tolist()}


def _stl_zip(prototype: Prototype) -> bytes:
    file = io.BytesIO()
    with zipfile.ZipFile(file, "w", zipfile.ZIP_DEFLATED) as archive:
        for part in prototype.parts:
            # Without a date equal parts make equal files.
            entry = zipfile.ZipInfo(f"{part.name.replace(' ', '-')}.stl")
            entry.compress_type, entry.external_attr = zipfile.ZIP_DEFLATED, 0o644 << 16
            archive.writestr(entry, mesh_bytes(part.solid, "stl", prototype.design, part.name))
    return file.getvalue()


FORMATS: Mapping[str, Callable[[Prototype], bytes]] = MappingProxyType(
    {"3mf": _3mf, "glb": _glb, "stl-zip": _stl_zip}
)
"""What writes each format."""
