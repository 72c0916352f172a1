"""The clearances of the legs in the pose and in the last move, and the effect of their radii."""

from __future__ import annotations

from collections.abc import Iterator

from explorer.app.features.feature import Services
from explorer.app.features.legs.feed import RadiusFeed
from explorer.app.features.legs.radius_plot import RadiusPlot
from explorer.app.inputs.controls import Controls
from explorer.app.state.frame import Frame
from explorer.app.widgets.assigning import Update
from explorer.app.widgets.blocks import render
from explorer.app.widgets.copying import CopyButton
from explorer.measures.blocks.block import Statement
from explorer.measures.blocks.clearances import move_clearances, pose_clearances
from explorer.measures.blocks.source import Source, pose_source


class LegsPanel:
    """The table of clearances, that of the last move, and the radius curve."""

    def __init__(self, services: Services) -> None:
        gui = services.gui
        self._pose = gui.add_html("")

        def source() -> Source:
            state = services.session.settled()
            return pose_source("interference", state.design, state.pose)

        self._copy = CopyButton(services.buttons, "Legs", source)
        self._controls = Controls(gui, services.session)
        with gui.add_folder("Last move"):
            self._controls.checkbox(
                "Swept tetrahedra",
                "Draw the tetrahedra that the legs swept in the last move, and compare the paper's "
                "test for interference with the exact one.",
                "view.swept",
            )
            self._move = gui.add_html("", visible=False)
        with gui.add_folder("Leg radius"):
            self._controls.checkbox(
                "Volume against radius",
                "Draw the accessible volume over one radius of all four legs, for the orientation "
                "and the start of the tab Workspace.",
                "view.radius_curve",
            )
            self._plot = RadiusPlot(gui, services.get(RadiusFeed))

    def updates(self, frame: Frame) -> Iterator[Update]:
        """Yield the updates that make the panel show the frame."""
        answer = render(pose_clearances(frame.snapshot), corner=self._copy.html)
        yield self._pose, "content", answer
        yield from self._controls.updates(frame)
        yield self._move, "visible", frame.state.view.swept
        if frame.state.view.swept:
            yield self._move, "content", move_table(frame)
        yield from self._plot.updates(frame)


def move_table(frame: Frame) -> str:
    """Return the last move by both tests, the paper's and the exact one, as HTML."""
    move = frame.last_move
    if move is None:
        words = "No move yet. Move the platform: a drag without a pause is one move."
        return render([Statement("", words)])
    return render(move_clearances(move, frame.state.design))
