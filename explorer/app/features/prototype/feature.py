"""The prototype: parts that can be made, in place of the schematic ones."""

from __future__ import annotations

from explorer.app.features.feature import Feature, Services, StateCommand, Tab
from explorer.app.features.prototype.feed import PartsFeed
from explorer.app.features.prototype.panel import PrototypePanel
from explorer.app.features.prototype.scene import PrototypeScene
from explorer.app.state.actions import Set
from explorer.app.widgets.commands import Key


def _floor(services: Services) -> float | None:
    return services.get(PartsFeed).floor


PROTOTYPE = Feature(
    "prototype",
    tabs=(Tab("main", "View", PrototypePanel),),
    scene=(PrototypeScene,),
    feeds=(PartsFeed,),
    commands=(
        StateCommand(
            "View › Prototype",
            "Draw the mechanism as parts that can be made, or schematically again.",
            lambda state: Set("view.prototype.shown", not state.view.prototype.shown, "Prototype"),
            lambda state: not state.view.twin,
        ),
    ),
    keys={"View › Prototype": (Key("R"),)},
    lists=("Drawn as",),
    floor=_floor,
)
