"""How near a singularity is, and why: the numbers, and folders for what there is beyond them."""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import replace
from html import escape

import viser

from explorer.app.actions import SetView
from explorer.app.assigning import Update
from explorer.app.colours import CLEAR, FAR, FAR_WARNINGS, SINGULAR, WARNED, css, proximity_colour
from explorer.app.controls import Controls
from explorer.app.panels.distance import DistancePanel
from explorer.app.panels.html import BEYOND, DIM, WITHIN, fitted, scientific, share
from explorer.app.panels.performance import PerformancePanel
from explorer.app.panels.ranges import length_span
from explorer.app.panels.strata import StrataPanel
from explorer.app.session import Session
from explorer.app.state import Frame
from explorer.app.strata_feed import StrataFeed
from explorer.bruhat import incidences
from explorer.singularity import INCIDENCES, mode_name
from explorer.snapshot import Snapshot
from explorer.strata import GENERIC


class SingularityPanel:
    """Legend, margins, conditioning, mode; then distances, strata and performance."""

    def __init__(self, gui: viser.GuiApi, session: Session) -> None:
        self._controls = Controls(gui, session)
        self._numbers = gui.add_html("")
        self._controls.number(
            "Warn below",
            "Margins below this length are drawn orange, in design units.",
            lambda frame: frame.state.warn_below,
            lambda state, value: SetView(replace(state.view, warn_below=value)),
            least=0.0,
            step=lambda state: length_span(state).step,
        )
        with gui.add_folder("Nearest singular poses"):
            self._distances = DistancePanel(gui, session)
        with gui.add_folder("Stratum of the two flags"):
            self._strata = StrataPanel(gui, session)
        with gui.add_folder("Performance"):
            self._performance = PerformancePanel(gui, session)

    def updates(self, frame: Frame, feed: StrataFeed) -> Iterator[Update]:
        """Yield what makes the panel show the frame."""
        yield self._numbers, "content", summary(frame)
        yield from self._controls.updates(frame)
        yield from self._distances.updates(frame)
        yield from self._strata.updates(frame, feed)
        yield from self._performance.updates(frame)


def summary(frame: Frame) -> str:
    """Return the panel's contents as HTML."""
    snapshot, warn = frame.snapshot, frame.state.warn_below
    unit = snapshot.design.unit_mm
    return (
        '<div style="padding:4px 12px 2px;font-size:12.5px;line-height:1.45;'
        'font-variant-numeric:tabular-nums">'
        f"{_status(frame)}{_legend(warn)}"
        f"{''.join(_margin(snapshot, i, warn, unit) for i in range(3))}"
        f"{_table(frame)}{_limits(snapshot)}</div>"
    )


def _status(frame: Frame) -> str:
    snapshot = frame.snapshot
    near = snapshot.proximity * snapshot.design.reach < frame.state.warn_below
    word, colour = ("Near a singularity", BEYOND) if near else ("Clear of singularities", WITHIN)
    which = ""
    if snapshot.stratum != GENERIC:
        word, colour = "Singular", BEYOND
        which = "; ".join(
            f"κ{index} = 0: {INCIDENCES[index - 1]}" for index in incidences(snapshot.stratum)
        )
    note = f'<div style="color:{colour};margin-bottom:6px">{escape(which)}</div>' if which else ""
    return (
        f'<div style="font-size:15px;font-weight:600;color:{colour};'
        f'margin-bottom:{2 if which else 6}px">{word}</div>{note}'
    )


def _legend(warn: float) -> str:
    share = 100.0 / FAR_WARNINGS
    stops = f"{css(SINGULAR)} 0%,{css(WARNED)} {share:g}%,{css(CLEAR)} {share:g}%,{css(FAR)} 100%"
    ticks = "".join(
        f'<span style="position:absolute;left:{left:g}%;transform:translateX({shift});'
        f'white-space:nowrap">{text}</span>'
        for left, shift, text in (
            (0.0, "0", "0"),
            (share, "-50%", f"{warn:.3g}"),
            (100.0, "-100%", f"≥ {FAR_WARNINGS * warn:.3g}"),
        )
    )
    return (
        f'<div style="{DIM};margin-bottom:3px">Distance |κ| to singular (design units)</div>'
        f'<div style="height:11px;border-radius:2px;background:linear-gradient(90deg,{stops})">'
        f'</div><div style="position:relative;height:18px;font-size:11px;{DIM}">{ticks}</div>'
    )


def _margin(snapshot: Snapshot, index: int, warn: float, unit_mm: float) -> str:
    value, reach = float(snapshot.margins[index]), snapshot.design.reach
    colour = css(proximity_colour(value, warn))
    filled = min(100.0, 100.0 * abs(value) / (FAR_WARNINGS * warn))
    return (
        '<div style="margin:7px 0 0"><div style="display:flex;align-items:baseline;gap:7px">'
        f'<span style="width:11px;height:11px;border-radius:2px;background:{colour};'
        'flex:none;align-self:center"></span>'
        f"<b>κ{index + 1}</b><span>{fitted(value, reach, 5)}</span>"
        f'<span style="{DIM};font-size:11.5px">{fitted(value * unit_mm, reach * unit_mm, 4)} mm'
        f'</span><span style="{DIM};margin-left:auto;font-size:11.5px" '
        'title="Volume of its tetrahedron, signed">'
        f"V {scientific(float(snapshot.volumes[index]))} units³</span></div>"
        '<div style="height:3px;border-radius:2px;margin:3px 0 2px;'
        'background:color-mix(in srgb,currentColor 12%,transparent)">'
        f'<div style="height:3px;border-radius:2px;width:{filled:.1f}%;background:{colour}">'
        f'</div></div><div style="{DIM};font-size:11.5px">{escape(INCIDENCES[index])}</div></div>'
    )


def _table(frame: Frame) -> str:
    snapshot = frame.snapshot
    generic = "generic" if snapshot.stratum == GENERIC else "singular"
    rows = (
        (
            "det J",
            f"{scientific(snapshot.determinant)} units³",
            "Determinant of the actuator Jacobian",
        ),
        (
            "1/cond J",
            share(snapshot.inverse_condition),
            "Inverse condition number of J made homogeneous with the reach; 0 is singular",
        ),
        ("min |κ| / reach", share(snapshot.proximity), "Smallest margin over the reach |a3|"),
        (
            "Mode",
            f"{mode_name(frame.state.mode)} &nbsp;({frame.state.mode})",
            "Assembly mode: the signs of κ1, κ2, κ3",
        ),
        (
            "Stratum",
            f"({', '.join(map(str, snapshot.stratum))})",
            "Relative position of the two flags, one of 24",
        ),
        ("", f"dimension {snapshot.stratum_dimension}, {generic}", "Dimension of the stratum"),
    )
    cells = "".join(
        f'<tr title="{escape(hint)}"><td style="{DIM};padding:1px 8px 1px 0">{name}</td>'
        f'<td style="text-align:right">{value}</td></tr>'
        for name, value, hint in rows
    )
    return f'<table style="width:100%;border-collapse:collapse;margin:12px 0 8px">{cells}</table>'


def _limits(snapshot: Snapshot) -> str:
    if not snapshot.violations:
        return f'<div style="color:{WITHIN};font-weight:600">Within all limits</div>'
    items = "".join(f"<div>{escape(str(v))}</div>" for v in snapshot.violations)
    return f'<div style="color:{BEYOND}"><b>Outside the limits</b>{items}</div>'
