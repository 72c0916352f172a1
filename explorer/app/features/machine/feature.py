"""The machine around the mechanism, as part of the design."""

from __future__ import annotations

import viser

from explorer.app.features.feature import Feature, Tab
from explorer.app.features.machine.panel import MachinePanel
from explorer.app.features.machine.scene import PayloadScene, ToolScene

MACHINE = Feature(
    "machine",
    tabs=(Tab("build", "Machine", MachinePanel, viser.Icon.CRANE),),
    scene=(ToolScene, PayloadScene),
    lists=("Gravity",),
)
