"""The gains of speed and force in the present pose, and the singularity-free ball."""

from __future__ import annotations

from collections.abc import Iterator
from typing import get_args

from explorer.app.features.feature import Services
from explorer.app.inputs.controls import Controls
from explorer.app.state.frame import Frame
from explorer.app.state.view import Gain
from explorer.app.widgets.assigning import Update
from explorer.app.widgets.blocks import render
from explorer.measures.blocks.block import Facts
from explorer.measures.blocks.singularity import free_ball, gains

GAINS: tuple[Gain, ...] = get_args(Gain)


class PerformancePanel:
    """The table of gains, and the switches for the ellipsoid and the ball."""

    def __init__(self, services: Services) -> None:
        gui = services.gui
        self._table = gui.add_html("")
        self._controls = Controls(gui, services.session)
        self._controls.dropdown(
            "Ellipsoid",
            "Draw at b4 or at the tool point all velocities that unit actuator speeds reach, or "
            "all forces that unit actuator forces hold.",
            GAINS,
            "view.singular.ellipsoid",
        )
        self._controls.checkbox(
            "Singularity-free ball",
            "Draw the largest ball of positions without a singular one at this orientation, and "
            "the point where it touches the singular plane.",
            "view.singular.ball",
        )

    def updates(self, frame: Frame) -> Iterator[Update]:
        """Yield the updates that make the panel show the frame."""
        yield self._table, "content", performance_table(frame)
        yield from self._controls.updates(frame)


def performance_table(frame: Frame) -> str:
    """Return the gains and the radius of the ball in this pose as HTML."""
    point = frame.state.point
    radius = free_ball(frame.snapshot, frame.free_ball, point)
    return render([gains(frame.performance, point), Facts("", (radius,))])
