"""The prototype for printers, CAD and viewers: 3MF, GLB, and a zip with an STL for each part.

3MF and STL are in millimetres, GLB by its specification in metres with y up. The assembly is
in the home pose. In 3MF each leg is a group of its parts; in GLB the tree of nodes is that of
the joints, so that a rotated or moved node carries its children along. STL files hold each
part in the frame of its body.
"""

from __future__ import annotations

import io
import zipfile
from collections.abc import Callable, Mapping, Sequence
from types import MappingProxyType
from typing import Any

import numpy as np

from explorer.errors import InputError
from explorer.export import packing
from explorer.export.mesh import mesh_bytes
from explorer.mechanism.pose import quaternion_from_rotation
from explorer.prototype.assembly import Prototype
from explorer.prototype.chains import BODIES, CHAIN_JOINTS, LEGS, ON_GUIDE, Places

COLOURS: Mapping[str, packing.Rgb] = MappingProxyType(
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

# Decimals of coordinates in 3MF, in millimetres.
_DECIMALS = 6


def assembly_bytes(prototype: Prototype, file_format: str) -> bytes:
    """Return a file of a prototype, assembled in the home pose.

    Args:
        prototype: Prototype with its parts.
        file_format: One of `FORMATS`.

    Raises:
        InputError: The format is unknown, or the parts are too large for it.
        ExplorerError: The library of the format refuses the parts.
    """
    check_format(file_format)
    return FORMATS[file_format](prototype)


def check_format(file_format: str) -> None:
    """Refuse an unknown format.

    Raises:
        InputError: The format is unknown; the message lists the formats.
    """
    if file_format not in FORMATS:
        raise InputError(
            f"no format {file_format!r} of assemblies; there are {', '.join(FORMATS)}, step"
        )


def part_groups() -> Sequence[tuple[str, Sequence[str]]]:
    """Return the subassemblies, each with the names of its parts."""
    kinds = [("carriage" if leg in ON_GUIDE else "cross", "cylinder", "rod") for leg in LEGS]
    legs = [(f"leg {n}", [f"{kind} {n}" for kind in kinds[n - 1]]) for n in LEGS]
    top = ["platform", *(f"ball {leg}" for leg in LEGS)]
    return [("base", ["base"]), *legs, ("platform with balls", top)]


def _3mf(prototype: Prototype) -> bytes:
    design, unit, home = prototype.design, prototype.design.unit_mm, prototype.design.home_pose
    packing.check_size(np.concatenate(prototype.at(home.position, home.rotation)) * unit)
    places, kinds = prototype.chains.places_at(home.position, home.rotation), list(COLOURS)
    by_name = {part.name: part for part in prototype.parts}
    with packing.refusals_of_lib3mf("parts"):
        model = packing.Model(f"mechanism of {design.name}", design, COLOURS)
        whole = model.add_group("mechanism")
        for name, members in part_groups():
            group = model.add_group(name)
            for member in members:
                part, body = by_name[member], by_name[member].body_index
                corners = part.vertices * unit
                mesh = model.add_mesh(part.name, corners, part.faces, kinds.index(part.kind))
                origin = places.origin[body] * unit
                group.AddComponent(mesh, model.transform(places.rotation[body], origin))
            whole.AddComponent(group, model.untransformed)
        return model.encode(whole, _DECIMALS)


def _glb(prototype: Prototype) -> bytes:
    metres = packing.METRES_PER_MILLIMETRE * prototype.design.unit_mm
    kinds = list(COLOURS)
    return packing.glb_bytes(
        {
            part.name: (part.vertices * metres, part.faces, kinds.index(part.kind))
            for part in prototype.parts
        },
        _nodes(prototype, metres),
        [packing.material(kind, rgb, metallic=0.2, roughness=0.6) for kind, rgb in COLOURS.items()],
        prototype.design,
    )


def _nodes(prototype: Prototype, metres: float) -> list[dict[str, Any]]:
    """Return the nodes: the mechanism, the bodies from joint to joint, the balls."""
    home = prototype.design.home_pose
    places = prototype.chains.places_at(home.position, home.rotation)
    nodes: list[dict[str, Any]] = [{"name": "mechanism", "rotation": packing.Y_UP, "children": [1]}]
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
    """Return the parent of a body in its chain; None for the base."""
    if body == "base":
        return None
    kind, _, leg = body.partition(" ")
    before = {"rod": "cylinder", "cylinder": "carriage" if leg in "23" else "cross"}.get(kind)
    return f"{before} {leg}" if before else "base"


def _relative(places: Places, body: int, outer: int, metres: float) -> dict[str, list[float]]:
    """Return the rotation (x, y, z, w) and translation in metres of a body within its parent."""
    turn = places.rotation[outer].T
    w, x, y, z = quaternion_from_rotation(turn @ places.rotation[body]).tolist()
    offset = turn @ (places.origin[body] - places.origin[outer]) * metres
    return {"rotation": [x, y, z, w], "translation": offset.tolist()}


def _stl_zip(prototype: Prototype) -> bytes:
    file = io.BytesIO()
    with zipfile.ZipFile(file, "w", zipfile.ZIP_DEFLATED) as archive:
        for part in prototype.parts:
            # Without a date equal parts give equal files.
            entry = zipfile.ZipInfo(f"{part.name.replace(' ', '-')}.stl")
            entry.compress_type, entry.external_attr = zipfile.ZIP_DEFLATED, 0o644 << 16
            archive.writestr(entry, mesh_bytes(part.solid, "stl", prototype.design, part.name))
    return file.getvalue()


FORMATS: Mapping[str, Callable[[Prototype], bytes]] = MappingProxyType(
    {"3mf": _3mf, "glb": _glb, "stl-zip": _stl_zip}
)
"""The writer of each format."""
