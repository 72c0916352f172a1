"""The panel of the visible parts of the scene."""

from __future__ import annotations

from collections.abc import Iterator

from explorer.app.features.feature import Services
from explorer.app.state.frame import Frame
from explorer.app.widgets.assigning import Update
from explorer.app.widgets.controls import Controls
from explorer.mechanism.margins import TETRAHEDRA

SWITCHES = (
    ("flags", "Flags", "Point, line and plane of base and platform, coloured by proximity."),
    ("bodies", "Bodies", "The plates of base and platform."),
    ("legs", "Legs", "Actuators, joints, carriages and guide."),
    ("labels", "Labels", "The names a1 … b4 of the attachment points."),
    ("handle", "Drag handle", "Arrows and arcs on the platform that move it when dragged."),
    ("grid", "Grid", "The ground grid; its cells are round numbers of design units."),
)


class ViewPanel:
    """A switch for each part of the scene."""

    def __init__(self, services: Services) -> None:
        gui = services.gui
        self._controls = controls = Controls(gui, services.session)
        with gui.add_folder("Show"):
            for name, label, hint in SWITCHES:
                controls.checkbox(label, hint, f"view.{name}")
        with gui.add_folder("Tetrahedra"):
            for index, points in enumerate(TETRAHEDRA):
                controls.checkbox(
                    f"δ{index + 1}:  {' '.join(points)}",
                    f"The tetrahedron that is flat where δ{index + 1} is zero.",
                    f"view.tetrahedra.{index}",
                )
        with gui.add_folder("Legs"):
            controls.checkbox(
                "6-4 twin",
                "Draw the equivalent manipulator with six legs: the same motion, and two legs "
                "from a1 and a2 in place of each carriage.",
                "view.twin",
            )
            controls.checkbox(
                "Closest pair",
                "Mark the two legs that are closest to each other, and their clearance.",
                "view.clearance",
            )

    def updates(self, frame: Frame) -> Iterator[Update]:
        """Yield the updates that make the panel show the frame."""
        yield from self._controls.updates(frame)
