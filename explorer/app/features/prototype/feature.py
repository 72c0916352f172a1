"""The prototype: parts that can be made, in place of the schematic ones."""

from __future__ import annotations

from collections.abc import Callable

import viser

from explorer.app.features.feature import Export, Feature, Services, Tab
from explorer.app.features.prototype.panel import PrototypePanel
from explorer.app.features.prototype.scene import PrototypeScene
from explorer.app.features.prototype.work import (
    PARTS_FEED,
    drawn_parts,
    export_assembly,
    export_simulation,
)
from explorer.app.session.session import Who

# Format of each file by its name on the page, and end of the name of the file.
ASSEMBLIES = {
    "3MF": ("3mf", "mechanism.3mf"),
    "GLB": ("glb", "mechanism.glb"),
    "STL (zip)": ("stl-zip", "parts-stl.zip"),
    "STEP": ("step", "mechanism.step"),
}


def _assembly_sender(services: Services) -> Callable[[str, Who], None]:
    def send(name: str, who: Who) -> None:
        design = services.session.latest_state().design
        file_format, end = ASSEMBLIES[name]
        file = f"{design.name}-{end}"
        services.downloads.compute(who, file, export_assembly, (design, file_format))

    return send


def _simulation_sender(services: Services) -> Callable[[str, Who], None]:
    def send(_: str, who: Who) -> None:
        state = services.session.latest_state()
        file = f"{state.design.name}-simulation.xml"
        arguments = state.design, state.view.prototype.density
        services.downloads.compute(who, file, export_simulation, arguments)

    return send


def _floor(services: Services) -> float | None:
    parts = drawn_parts(services.get(PARTS_FEED))
    return None if parts is None else parts.floor


PROTOTYPE = Feature(
    "prototype",
    tabs=(Tab("analyse", "Prototype", PrototypePanel, viser.Icon.ENGINE),),
    exports=(
        Export(
            "Mechanism",
            "Parts that can be made, assembled in the home pose, in millimetres.",
            tuple(ASSEMBLIES),
            _assembly_sender,
        ),
        Export(
            "Simulation",
            "A model with joints, masses and servos for MuJoCo and other physics engines.",
            ("MJCF",),
            _simulation_sender,
        ),
    ),
    scene=(PrototypeScene,),
    feeds=(PARTS_FEED,),
    floor=_floor,
)
