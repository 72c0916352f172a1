"""The prototype as STEP: parts of exact faces, in subassemblies.

AP242, millimetres of the base frame, in the home pose; names and colours as in 3MF. Needs
the extra `cad`, which is imported only when it is used.
"""

from __future__ import annotations

from typing import Any

from explorer.export.assembly import COLOURS, part_groups
from explorer.export.opencascade import Document, ExactKernel, ExactShape, occ, transform
from explorer.prototype.chains import BODIES, Chains
from explorer.prototype.forms import forms_of
from explorer.prototype.sizes import Sizes


def exact_parts(sizes: Sizes) -> dict[str, ExactShape]:
    """Return the parts by name, each in the frame of its body, in millimetres.

    Raises:
        MissingExtraError: OpenCASCADE is not installed.
        ExplorerError: A boolean operation fails.
    """
    return {name: shape for name, _, shape in forms_of(sizes, ExactKernel())}


def assembly_step(sizes: Sizes) -> bytes:
    """Return a STEP file of the parts, assembled in the home pose.

    Raises:
        MissingExtraError: OpenCASCADE is not installed.
        ExplorerError: A boolean operation fails, or the file cannot be made.
    """
    design = sizes.design
    home = design.home_pose
    places = Chains.of(design).places_at(home.position, home.rotation)
    parts = exact_parts(sizes)
    document = Document()
    whole = _group(document, f"mechanism of {design.name}")
    for name, members in part_groups():
        group = _group(document, name)
        for member in members:
            label = document.shapes.AddShape(parts[member].shape, False)
            document.set_name(label, member)
            document.set_colour(label, COLOURS[member.partition(" ")[0]])
            body = BODIES.index(member if member in BODIES else "platform")
            location = transform(places.rotation[body], places.origin[body] * design.unit_mm)
            _add(document, group, label, location, member)
        _add(document, whole, group, occ("gp_Trsf")(), name)
    document.shapes.UpdateAssemblies()
    return document.step()


def _group(document: Document, name: str) -> Any:
    label = document.shapes.NewShape()
    document.set_name(label, name)
    return label


def _add(document: Document, group: Any, label: Any, location: Any, name: str) -> None:
    document.set_name(
        document.shapes.AddComponent(group, label, occ("TopLoc_Location")(location)), name
    )
