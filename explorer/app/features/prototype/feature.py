"""The prototype: parts that can be made, in place of the schematic ones."""

from __future__ import annotations

import viser

from explorer.app.features.feature import Export, Feature, Services, Tab
from explorer.app.features.prototype.feed import PartsFeed
from explorer.app.features.prototype.files import ASSEMBLIES, MechanismFiles
from explorer.app.features.prototype.panel import PrototypePanel
from explorer.app.features.prototype.scene import PrototypeScene


def _floor(services: Services) -> float | None:
    return services.get(PartsFeed).floor


PROTOTYPE = Feature(
    "prototype",
    tabs=(Tab("analyse", "Prototype", PrototypePanel, viser.Icon.ENGINE),),
    exports=(
        Export(
            "Mechanism",
            "Parts that can be made, assembled in the home pose, in millimetres.",
            tuple(ASSEMBLIES),
            lambda services: services.get(MechanismFiles).assembly,
        ),
        Export(
            "Simulation",
            "A model with joints, masses and servos for MuJoCo and other physics engines.",
            ("MJCF",),
            lambda services: lambda _, who: services.get(MechanismFiles).simulation(who),
        ),
    ),
    scene=(PrototypeScene,),
    feeds=(PartsFeed,),
    floor=_floor,
)
