"""How near a singularity is, and why: the numbers, and folders for what there is beyond them."""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import replace
from html import escape

import viser

from explorer.app.features.singularity.distance import DistancePanel
from explorer.app.features.singularity.feed import StrataFeed
from explorer.app.features.singularity.performance import PerformancePanel
from explorer.app.features.singularity.strata import StrataPanel
from explorer.app.session.session import Session
from explorer.app.state.actions import SetView
from explorer.app.state.frame import Frame
from explorer.app.widgets.assigning import Update
from explorer.app.widgets.colours import (
    CLEAR,
    FAR,
    FAR_WARNINGS,
    SINGULAR,
    WARNED,
    css,
    proximity_colour,
)
from explorer.app.widgets.controls import Controls
from explorer.app.widgets.markup import BEYOND, CLOSE, DIM, WITHIN, fitted, format_number, share
from explorer.app.widgets.ranges import length_span
from explorer.measures.snapshot import Snapshot
from explorer.measures.verdict import DISTANCE_SHARE
from explorer.mechanism.margins import INCIDENCES, describe_modes, mode_name
from explorer.singularity.strata import GENERIC

VERDICT_HINT = (
    "How far b1 to b4 go to the nearest singular pose, as a root mean square, position and "
    "orientation being free"
)


class SingularityPanel:
    """Legend, margins, conditioning, mode; then distances, strata and performance."""

    def __init__(self, gui: viser.GuiApi, session: Session) -> None:
        self._controls = Controls(gui, session)
        self._numbers = gui.add_html("")
        self._controls.number(
            "Warn below",
            "Margins below this length are drawn orange, and singular poses nearer than a third "
            "of it; in design units.",
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
    return (
        '<div style="padding:4px 12px 2px;font-size:12.5px;line-height:1.45;'
        'font-variant-numeric:tabular-nums">'
        f"{_status(frame)}{_legend(frame.state.warn_below)}"
        f"{''.join(_margin(frame, index) for index in range(3))}"
        f"{_table(frame)}{_limits(frame.snapshot)}</div>"
    )


def _status(frame: Frame) -> str:
    found, design = frame.verdict, frame.state.design
    colour = {"clear": WITHIN, "near": CLOSE, "singular": BEYOND}[found.kind]
    millimetres = f"{format_number(found.distance * design.unit_mm, 3)} mm"
    note = DIM if found.kind == "clear" else f"color:{colour}"
    return (
        f'<div style="font-size:15px;font-weight:600;color:{colour};margin-bottom:2px">'
        f'{found.title}</div><div style="{note};min-height:36px;margin-bottom:6px" '
        f'title="{escape(VERDICT_HINT)}">'
        f"{escape(found.reason(millimetres))}</div>"
    )


def _legend(warn: float) -> str:
    share = 100.0 / FAR_WARNINGS
    stops = f"{css(SINGULAR)} 0%,{css(WARNED)} {share:g}%,{css(CLEAR)} {share:g}%,{css(FAR)} 100%"
    return (
        f'<div style="{DIM};margin-bottom:3px">Margin |δ| or distance, the worse (units)</div>'
        f'<div style="height:11px;border-radius:2px;background:linear-gradient(90deg,{stops})">'
        f"</div>{_ticks('|δ|', warn)}{_ticks('distance', DISTANCE_SHARE * warn)}"
    )


def _ticks(name: str, warn: float) -> str:
    """Return what stands below the legend for one of the two measures."""
    ticks = "".join(
        f'<span style="position:absolute;left:{left:g}%;transform:translateX({shift});'
        f'white-space:nowrap">{text}</span>'
        for left, shift, text in (
            (0.0, "0", "0"),
            (100.0 / FAR_WARNINGS, "-50%", f"{warn:.3g}"),
            (60.0, "-50%", name),
            (100.0, "-100%", f"≥ {FAR_WARNINGS * warn:.3g}"),
        )
    )
    return f'<div style="position:relative;height:16px;font-size:11px;{DIM}">{ticks}</div>'


def _margin(frame: Frame, index: int) -> str:
    snapshot, level = frame.snapshot, frame.verdict.levels[index]
    value, reach, unit_mm = (
        float(snapshot.margins[index]),
        snapshot.design.reach,
        snapshot.design.unit_mm,
    )
    colour = css(proximity_colour(level, 1.0))
    filled = min(100.0, 100.0 * level / FAR_WARNINGS)
    volume, size = float(snapshot.volumes[index]), float(snapshot.volume_sizes[index])
    return (
        '<div style="margin:7px 0 0"><div style="display:flex;align-items:baseline;gap:7px">'
        f'<span style="width:11px;height:11px;border-radius:2px;background:{colour};'
        'flex:none;align-self:center"></span>'
        f"<b>δ{index + 1}</b><span>{fitted(value, reach, 5)}</span>"
        f'<span style="{DIM};font-size:11.5px">{fitted(value * unit_mm, reach * unit_mm, 4)} mm'
        f'</span><span style="{DIM};margin-left:auto;font-size:11.5px" '
        'title="Volume of its tetrahedron, signed">'
        f"V {format_number(volume, size=size)} units³</span></div>"
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
            f"{format_number(snapshot.determinant, size=snapshot.determinant_size)} units³",
            "Determinant of the actuator Jacobian",
        ),
        (
            "1/cond J",
            share(snapshot.inverse_condition),
            "Inverse condition number of J made homogeneous with the reach; 0 is singular",
        ),
        ("min |δ| / reach", share(snapshot.proximity), "Smallest margin over the reach |a3|"),
        *_mode_rows(frame),
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


def _mode_rows(frame: Frame) -> tuple[tuple[str, str, str], ...]:
    snapshot, mode = frame.snapshot, frame.state.mode
    hint = "Assembly mode: the signs of δ1, δ2, δ3"
    if snapshot.stratum == GENERIC:
        return (("Mode", f"{mode_name(mode)} &nbsp;({mode})", hint),)
    between = "At a singular pose the modes meet whose signs differ where a margin is 0"
    return (
        ("Mode", snapshot.sign_words, hint),
        ("", describe_modes(snapshot.bordering_modes), between),
    )


def _limits(snapshot: Snapshot) -> str:
    if not snapshot.violations:
        return f'<div style="color:{WITHIN};font-weight:600">Within all limits</div>'
    items = "".join(f"<div>{escape(str(v))}</div>" for v in snapshot.violations)
    return f'<div style="color:{BEYOND}"><b>Outside the limits</b>{items}</div>'
