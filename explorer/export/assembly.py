"""The prototype for printers, CAD and viewers: 3MF, GLB, STEP, and a zip with an STL of each part.

3MF, STEP and STL are in millimetres, GLB by its specification in metres with y up. The assembly is
in the home pose. In 3MF and STEP each leg is a group of its parts; in GLB the tree of nodes is that
of the joints, so that a rotated or moved node carries its children along. STL files hold each part
in the frame of its body.
"""

from __future__ import annotations

from collections.abc import Callable, Mapping, Sequence
from typing import Any, TypeAlias

from explorer.export import mesh, opencascade as cad
from explorer.files.writing import zip_bytes
from explorer.mechanism.rgb import Rgb
from explorer.motion.chains import BODIES, CHAIN_JOINTS, LEGS, ON_GUIDE
from explorer.prototype.assembly import Prototype
from explorer.prototype.shapes import forms_of

COLOURS: Mapping[str, Rgb] = {
    "base": (214, 219, 226),
    "carriage": (238, 119, 51),
    "cross": (204, 187, 68),
    "cylinder": (68, 119, 170),
    "rod": (188, 197, 209),
    "platform": (34, 136, 51),
    "ball": (170, 51, 119),
}
"""The colours of the kinds of parts."""

# Decimals of coordinates in 3MF, in millimetres.
_DECIMALS = 6


def assembly_bytes(prototype: Prototype, file_format: str) -> bytes:
    """Return a file of a prototype in one of `FORMATS`, assembled in the home pose.

    Raises:
        InputError: The format is unknown.
        MissingExtraError: STEP without OpenCASCADE.
        ExplorerError: The library of the format refuses the parts.
    """
    mesh.check_format(file_format, FORMATS, "assembly")
    return FORMATS[file_format](prototype)


def part_groups() -> Sequence[tuple[str, Sequence[str]]]:
    """Return the subassemblies, each with the names of its parts."""
    kinds = [("carriage" if leg in ON_GUIDE else "cross", "cylinder", "rod") for leg in LEGS]
    legs = [(f"leg {n}", [f"{kind} {n}" for kind in kinds[n - 1]]) for n in LEGS]
    top = ["platform", *(f"ball {leg}" for leg in LEGS)]
    return [("base", ["base"]), *legs, ("platform with balls", top)]


def _3mf(prototype: Prototype) -> bytes:
    design, unit, home = prototype.design, prototype.design.unit_mm, prototype.design.home_pose
    places, kinds = prototype.chains.places_at(home.position, home.rotation), list(COLOURS)
    by_name = {part.name: part for part in prototype.parts}
    model = mesh.ThreeMfModel(f"mechanism of {design.name}", design, COLOURS)
    whole = model.add_group("mechanism")
    for name, members in part_groups():
        group = model.add_group(name)
        for member in members:
            part, body = by_name[member], by_name[member].body_index
            kind = kinds.index(part.kind)
            item = model.add_mesh(part.name, part.vertices * unit, part.faces, kind)
            place = model.transform(places.rotation[body], places.origin[body] * unit)
            group.AddComponent(item, place)
        whole.AddComponent(group, model.untransformed)
    return model.encode(whole, _DECIMALS)


def _glb(prototype: Prototype) -> bytes:
    metres, kinds = 1e-3 * prototype.design.unit_mm, list(COLOURS)
    bodies = {
        part.name: (part.vertices * metres, part.faces, kinds.index(part.kind))
        for part in prototype.parts
    }
    look = {"metallic": 0.2, "roughness": 0.6}
    materials = [mesh.material(kind, rgb, **look) for kind, rgb in COLOURS.items()]
    return mesh.glb_bytes(bodies, _nodes(prototype, metres), materials, prototype.design)


def _nodes(prototype: Prototype, metres: float) -> list[dict[str, Any]]:
    """Return the nodes: the mechanism, the bodies from joint to joint, the balls."""
    home = prototype.design.home_pose
    places = prototype.chains.places_at(home.position, home.rotation)
    nodes: list[dict[str, Any]] = [{"name": "mechanism", "rotation": mesh.Y_UP, "children": [1]}]
    # Bodies come in the order of their chains; the node of one follows that of its index.
    for number, part in enumerate(prototype.parts):
        body, node = part.body_index, {"name": part.name, "mesh": number}
        if part.name not in BODIES:
            nodes[body + 1].setdefault("children", []).append(len(nodes))
        elif body:
            outer = body - 1 if (body - 1) % 3 else 0
            offset, (w, x, y, z) = places.within(body, outer)
            node |= {"rotation": [x, y, z, w], "translation": (offset * metres).tolist()}
            nodes[outer + 1].setdefault("children", []).append(len(nodes))
            if part.name != "platform":
                node["extras"] = {"joint": CHAIN_JOINTS[body - 1]}
        nodes.append(node)
    return nodes


def _stl_zip(prototype: Prototype) -> bytes:
    design, parts = prototype.design, prototype.parts
    stl = {each.name: mesh.mesh_bytes(each.solid, "stl", design, each.name) for each in parts}
    return zip_bytes({f"{name.replace(' ', '-')}.stl": data for name, data in stl.items()})


def _step(prototype: Prototype) -> bytes:
    design, home = prototype.design, prototype.design.home_pose
    places = prototype.chains.places_at(home.position, home.rotation)
    forms = forms_of(prototype.sizes, cad.ExactShapeMaker())
    parts = {name: (body, form.shape) for name, body, form in forms}
    document = cad.Document()

    def named(label: Any, name: str) -> Any:
        document.set_name(label, name)
        return label

    def add(group: Any, label: Any, transformation: Any, name: str) -> None:
        location = cad.occ("TopLoc_Location")(transformation)
        named(document.shapes.AddComponent(group, label, location), name)

    whole = named(document.shapes.NewShape(), f"mechanism of {design.name}")
    for name, members in part_groups():
        group = named(document.shapes.NewShape(), name)
        for member in members:
            body, shape = parts[member]
            label = named(document.shapes.AddShape(shape, False), member)
            document.set_colour(label, COLOURS[member.partition(" ")[0]])
            index = BODIES.index(body)
            place = cad.transform(places.rotation[index], places.origin[index] * design.unit_mm)
            add(group, label, place, member)
        add(whole, group, cad.occ("gp_Trsf")(), name)
    document.shapes.UpdateAssemblies()
    return document.step()


_Writer: TypeAlias = Callable[[Prototype], bytes]
FORMATS: Mapping[str, _Writer] = {"3mf": _3mf, "glb": _glb, "stl-zip": _stl_zip, "step": _step}
"""The writer of each format."""
