"""What is shown, and from where."""

from __future__ import annotations

from collections.abc import Callable, Iterator
from dataclasses import replace

import viser

from explorer.app.session.session import Session
from explorer.app.state.actions import SetView
from explorer.app.state.frame import Frame
from explorer.app.widgets.assigning import Update
from explorer.app.widgets.controls import Controls
from explorer.mechanism.margins import TETRAHEDRA

SWITCHES = (
    ("flags", "Flags", "Point, line and plane of base and platform, coloured by proximity."),
    ("bodies", "Bodies", "The plates of base and platform."),
    ("legs", "Legs", "Actuators, joints, carriages and guide."),
    ("labels", "Labels", "The names a1 … b4 of the attachment points."),
    ("handle", "Drag handle", "Arrows and arcs on the platform, to move it by hand."),
    ("grid", "Grid", "The ground grid; its cells are round numbers of design units."),
)


class ViewPanel:
    """Switches for all that is drawn."""

    def __init__(self, gui: viser.GuiApi, session: Session) -> None:
        self._controls = Controls(gui, session)
        with gui.add_folder("Show"):
            for name, label, hint in SWITCHES:
                self._add_switch(name, label, hint)
        with gui.add_folder("Tetrahedra"):
            for index, points in enumerate(TETRAHEDRA):
                self._add_tetrahedron(index, " ".join(points))
        with gui.add_folder("Legs"):
            self._controls.checkbox(
                "6-4 twin",
                "Draw the equivalent manipulator with six legs: same motion, and instead "
                "of each carriage two legs from a1 and a2.",
                lambda frame: frame.state.view.twin,
                lambda state, on: SetView(replace(state.view, twin=on)),
            )
            self._controls.checkbox(
                "Closest pair",
                "Mark the two legs that are closest to each other, and their clearance.",
                lambda frame: frame.state.view.clearance,
                lambda state, on: SetView(replace(state.view, clearance=on)),
            )

    def updates(self, frame: Frame) -> Iterator[Update]:
        """Yield what makes the panel show the frame."""
        yield from self._controls.updates(frame)

    def _add_switch(self, name: str, label: str, hint: str) -> None:
        read: Callable[[Frame], bool] = lambda frame: getattr(frame.state.view, name)  # noqa: E731
        self._controls.checkbox(
            label, hint, read, lambda state, on: SetView(replace(state.view, **{name: on}))
        )

    def _add_tetrahedron(self, index: int, points: str) -> None:
        def write(shown: tuple[bool, bool, bool], on: bool) -> tuple[bool, bool, bool]:
            first, second, third = (on if i == index else s for i, s in enumerate(shown))
            return first, second, third

        self._controls.checkbox(
            f"δ{index + 1}:  {points}",
            f"The tetrahedron that is flat where δ{index + 1} is zero.",
            lambda frame: frame.state.view.tetrahedra[index],
            lambda state, on: SetView(
                replace(state.view, tetrahedra=write(state.view.tetrahedra, on))
            ),
        )
