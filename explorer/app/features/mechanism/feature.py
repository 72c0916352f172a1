"""The mechanism: its pose, its design, and how it is drawn."""

from __future__ import annotations

import viser

from explorer.app.features.designs.feature import DesignName
from explorer.app.features.feature import Feature, InBar, StateCommand, Tab
from explorer.app.features.mechanism.bodies import Bodies, Flags, Legs, TwinLegs
from explorer.app.features.mechanism.folds import Leaves
from explorer.app.features.mechanism.incidences import Gaps, Tetrahedra
from explorer.app.features.mechanism.marks import DragHandle, Labels
from explorer.app.features.mechanism.modes import MODES, Ghosts
from explorer.app.features.mechanism.panel import DesignPanel, MovePanel
from explorer.app.state.actions import SetMode
from explorer.app.state.frame import Frame
from explorer.app.widgets.buttons import figure
from explorer.app.widgets.palette import Key, shift


def limits_figure(frame: Frame) -> str:
    """Return how many limits the pose breaks, as HTML."""
    broken = [str(each) for each in frame.snapshot.violations]
    if broken:
        words, look, hint = f"{len(broken)} broken", "ex-beyond", "; ".join(broken)
        hint = f"Outside the limits: {hint}."
    elif frame.snapshot.is_singular:
        words, look = "kept, but singular", ""
        hint = "The pose keeps all limits of the design, but it is singular."
    else:
        words, look, hint = "kept", "ex-within", "The pose keeps all limits of the design."
    return figure("Design", "Limits", words, hint=hint, look=look)


MECHANISM = Feature(
    "mechanism",
    tabs=(
        Tab("build", "Pose", MovePanel, viser.Icon.ARROWS_MOVE),
        Tab("build", "Design", DesignPanel, viser.Icon.RULER_2),
    ),
    bar=(InBar("left", DesignName), InBar("middle", lambda _: limits_figure)),
    # Bodies come first: they make the platform's frame, to which others attach.
    scene=(Bodies, Flags, Legs, TwinLegs, Tetrahedra, Leaves, Gaps, Labels, Ghosts, DragHandle),
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
