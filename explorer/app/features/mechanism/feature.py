"""The mechanism: its pose, its design, and how it is drawn."""

from __future__ import annotations

import viser

from explorer.app.features.designs.name import DesignName
from explorer.app.features.feature import Feature, InBar, StateCommand, Tab
from explorer.app.features.mechanism.bodies import Bodies
from explorer.app.features.mechanism.design_panel import DesignPanel
from explorer.app.features.mechanism.figures import limits_figure
from explorer.app.features.mechanism.flags import Flags
from explorer.app.features.mechanism.gaps import Gaps
from explorer.app.features.mechanism.leaves import Leaves
from explorer.app.features.mechanism.legs import Legs, TwinLegs
from explorer.app.features.mechanism.marks import DragHandle, Ghosts, Labels
from explorer.app.features.mechanism.modes import MODES
from explorer.app.features.mechanism.pose_panel import MovePanel
from explorer.app.features.mechanism.tetrahedra import Tetrahedra
from explorer.app.state.actions import SetMode
from explorer.app.widgets.commands import Key, shift

MECHANISM = Feature(
    "mechanism",
    tabs=(
        Tab("build", "Pose", MovePanel, viser.Icon.ARROWS_MOVE),
        Tab("build", "Design", DesignPanel, viser.Icon.RULER_2),
    ),
    bar=(InBar("left", DesignName), InBar("middle", lambda _: limits_figure)),
    # Bodies come first: they make the platform's frame, to which others attach.
    scene=(
        Bodies,
        Flags,
        Legs,
        TwinLegs,
        Tetrahedra,
        Leaves,
        Gaps,
        Labels,
        Ghosts,
        DragHandle,
    ),
    commands=(
        StateCommand(
            "Pose › Next assembly mode",
            "Assemble the same leg lengths in the next of the eight ways.",
            lambda state: SetMode((state.mode + 1) % len(MODES)),
            keys=(Key("N"),),
        ),
        StateCommand(
            "Pose › Previous assembly mode",
            "Assemble the same leg lengths in the previous of the eight ways.",
            lambda state: SetMode((state.mode - 1) % len(MODES)),
            keys=(shift("N"),),
        ),
    ),
    keys={
        "Pose › Home pose": (Key("H"),),
        "Pose › Use the nearest length": (Key("U"),),
    },
    lists=("Preset", "On a change"),
)
