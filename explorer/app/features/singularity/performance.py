"""How fast and how strong the platform is here, and how much room it has to singularity."""

from __future__ import annotations

import math
from collections.abc import Iterator
from dataclasses import replace
from html import escape
from typing import get_args

import viser

from explorer.app.features.singularity.actions import SetSingularView
from explorer.app.session.session import Session
from explorer.app.state.frame import Frame
from explorer.app.state.view import Gain
from explorer.app.widgets.assigning import Update
from explorer.app.widgets.controls import Controls
from explorer.app.widgets.markup import DIM, format_number
from explorer.numerics.arrays import FloatArray
from explorer.singularity.strata import GENERIC

GAINS: tuple[Gain, ...] = get_args(Gain)


class PerformancePanel:
    """The gains in figures, the ellipsoid and the ball on request."""

    def __init__(self, gui: viser.GuiApi, session: Session) -> None:
        self._table = gui.add_html("")
        self._controls = Controls(gui, session)
        self._controls.dropdown(
            "Ellipsoid",
            "Draw at b4 all velocities that a unit of actuator speed reaches, or all forces "
            "that a unit of actuator force holds.",
            GAINS,
            lambda frame: frame.state.view.singular.ellipsoid,
            lambda state, chosen: SetSingularView(
                replace(state.view.singular, ellipsoid=GAINS[GAINS.index(chosen)])
            ),
        )
        self._controls.checkbox(
            "Free ball",
            "Draw the largest ball of positions of b4, at this orientation, without a "
            "singular one, and where it touches the singular plane.",
            lambda frame: frame.state.view.singular.ball,
            lambda state, on: SetSingularView(replace(state.view.singular, ball=on)),
        )

    def updates(self, frame: Frame) -> Iterator[Update]:
        """Yield what makes the panel show the frame."""
        yield self._table, "content", performance_table(frame)
        yield from self._controls.updates(frame)


def performance_table(frame: Frame) -> str:
    """Return what the platform can do in this pose as HTML."""
    found, ball = frame.performance, frame.free_ball
    unit = frame.state.design.unit_mm
    moves, turns = found.translation, found.rotation
    rows = (
        ("speed of b4", _between(moves.velocity), "Per unit of actuator speed"),
        ("force at b4", _between(moves.force), "Per unit of actuator force"),
        (
            "turning",
            _between(turns.velocity),
            "Angular velocity times the reach, per unit of speed",
        ),
        ("moment", _between(turns.force), "Moment over the reach, per unit of actuator force"),
    )
    cells = "".join(
        f'<tr title="{escape(hint)}"><td style="{DIM};padding:1px 0">{name}</td>'
        f'<td style="text-align:right">{low}</td><td style="text-align:right">{high}</td></tr>'
        for name, (low, high), hint in rows
    )
    room = (
        f"{format_number(ball.radius)} "
        f'<span style="{DIM}">= {format_number(ball.radius * unit, 3)} mm, '
        f"to δ{ball.incidence} = 0</span>"
        if frame.snapshot.stratum == GENERIC
        else f"none: δ{ball.incidence} = 0 here"
    )
    return (
        '<div style="padding:2px 12px 6px;font-size:12.5px;line-height:1.45;'
        'font-variant-numeric:tabular-nums"><table style="width:100%;border-collapse:collapse">'
        f'<tr style="{DIM}"><td>per unit of the actuators</td><td style="text-align:right">'
        f'least</td><td style="text-align:right">most</td></tr>{cells}</table>'
        f'<div style="margin-top:6px" title="At this orientation no position of b4 within it is '
        f'singular"><span style="{DIM}">free ball about b4</span> {room}</div></div>'
    )


def _between(semi_axes: FloatArray) -> tuple[str, str]:
    low, high = float(semi_axes.min()), float(semi_axes.max())
    return _figure(low), _figure(high)


def _figure(value: float) -> str:
    return "∞" if math.isinf(value) else format_number(value, 3)
