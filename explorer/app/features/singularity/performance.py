"""The gains of speed and force in the present pose, and the singularity-free ball."""

from __future__ import annotations

from collections.abc import Iterator
from typing import get_args

from explorer.app.features.feature import Services
from explorer.app.inputs.controls import Controls
from explorer.app.state.frame import Frame
from explorer.app.state.view import Gain
from explorer.app.widgets.assigning import Update
from explorer.app.widgets.markup import box, dim, format_number, row, table
from explorer.numerics.arrays import FloatArray

# Gain beyond which a pose counts as singular in a direction: J is known to fewer digits.
LARGEST_GAIN = 1e9
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
    gains, ball = frame.performance, frame.free_ball
    unit, point = frame.state.design.unit_mm, frame.state.point
    moves, turns = gains.translation, gains.rotation
    rows = (
        (f"speed of {point}", _range(moves.velocity), "Its speed per unit of actuator speed"),
        (f"force at {point}", _range(moves.force), "Force there per unit of actuator force"),
        (
            "angular velocity",
            _range(turns.velocity),
            "Angular velocity times the reach, per unit of actuator speed",
        ),
        ("moment", _range(turns.force), "Moment over the reach, per unit of actuator force"),
    )
    radius = (
        f"{format_number(ball.radius)} "
        + dim(f"= {format_number(ball.radius * unit, 3)} mm, to δ{ball.incidence} = 0")
        if not frame.snapshot.is_singular
        else f"none: δ{ball.incidence} = 0 here"
    )
    return box(
        table(
            (row(dim(name), low, high, hint=hint) for name, (low, high), hint in rows),
            ("per unit of the actuators", "min", "max"),
        ),
        f'<div class="ex-after" title="No position of {point} within this radius is singular at '
        f'this orientation">{dim("singularity-free radius")} {radius}</div>',
    )


def _range(semi_axes: FloatArray) -> tuple[str, str]:
    return gain_text(float(semi_axes.min())), gain_text(float(semi_axes.max()))


def gain_text(value: float) -> str:
    """Return a gain as text; one that only rounding keeps finite is infinite."""
    return "∞" if value > LARGEST_GAIN else format_number(value, 3)
