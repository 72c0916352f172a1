"""The panel of singularities: the verdict and the margins; then strata and performance."""

from __future__ import annotations

import math
from collections.abc import Iterator
from html import escape

from explorer.app.features.feature import Services
from explorer.app.features.singularity.distance import DistancePanel
from explorer.app.features.singularity.freedom import freedom_words
from explorer.app.features.singularity.performance import PerformancePanel
from explorer.app.features.singularity.strata import StrataPanel
from explorer.app.inputs.bindings import At
from explorer.app.inputs.controls import Controls
from explorer.app.inputs.ranges import length_span
from explorer.app.state.frame import Frame
from explorer.app.widgets.assigning import Update
from explorer.app.widgets.colours import CLEAR, FAR, FAR_WARNINGS, SINGULAR, WARNED, css
from explorer.app.widgets.markup import (
    Look,
    box,
    dim,
    format_number,
    row,
    share,
    status,
    table,
    ticks,
)
from explorer.measures.verdict import Kind, warnings
from explorer.mechanism.margins import MARGIN_KINDS

VERDICT_HINT = (
    "The distance is the root-mean-square displacement of b1 to b4 (Nawratil's metric) to the "
    "nearest singular pose, of any position and orientation"
)
LOOKS: dict[Kind, Look] = {"clear": "within", "near": "close", "singular": "beyond"}


class SingularityPanel:
    """The verdict and the margins; then folders for strata and performance."""

    def __init__(self, services: Services) -> None:
        gui = services.gui
        self._controls = Controls(gui, services.session)
        self._summary = gui.add_html("")
        self._distances = DistancePanel(services)
        with gui.add_folder("Stratum of the two flags"):
            self._strata = StrataPanel(services)
        with gui.add_folder("Performance"):
            self._measures = gui.add_html("")
            self._performance = PerformancePanel(services)
        self._controls.number(
            "Warn below",
            "Warning length of all margins in design units, to which those of distances, turns and "
            "1/cond J are proportional: what is below is orange.",
            At("view.warn_below", default=lambda state: state.warn_below),
            least=0.0,
            step=lambda state: length_span(state).step,
        )

    def updates(self, frame: Frame) -> Iterator[Update]:
        """Yield the updates that make the panel show the frame."""
        yield self._summary, "content", summary(frame)
        yield from self._distances.updates(frame)
        yield from self._strata.updates(frame)
        yield self._measures, "content", measures_table(frame)
        yield from self._performance.updates(frame)
        yield from self._controls.updates(frame)


def summary(frame: Frame) -> str:
    """Return the verdict, the mode, the limits and what a singular pose allows as HTML."""
    verdict, snapshot = frame.verdict, frame.snapshot
    look = LOOKS[verdict.kind]
    reason = escape(verdict.reason(frame.state.design.unit_mm))
    return box(
        status(verdict.title, look),
        f'<div class="{"ex-dim" if look == "within" else f"ex-{look}"} ex-two-lines" '
        f'title="{VERDICT_HINT}">{reason}</div>',
        f'<div class="ex-line"><span>{snapshot.mode_words.capitalize()}</span>'
        f"{_within(frame)}</div>",
        *(f'<div class="ex-beyond">{escape(str(limit))}</div>' for limit in snapshot.violations),
        freedom_words(frame),
    )


def _within(frame: Frame) -> str:
    if frame.snapshot.violations:
        return '<span class="ex-beyond ex-strong">Outside the limits</span>'
    if frame.snapshot.is_singular:
        return '<span class="ex-strong">Limits kept</span>'
    return '<span class="ex-within ex-strong">Within all limits</span>'


def legend(frame: Frame) -> str:
    """Return the scale of colours as HTML."""
    edge = 100.0 / FAR_WARNINGS
    stops = f"{css(SINGULAR)} 0%,{css(WARNED)} {edge:g}%,{css(CLEAR)} {edge:g}%,{css(FAR)} 100%"
    design = frame.state.design
    warn = warnings(design.reach, frame.state.warn_below)
    hint = (
        "The colour of an incidence: the least of its measures over their warning values, which "
        f"are {format_number(warn.margin, 3)} units of the margin, "
        f"{format_number(warn.distance * design.unit_mm, 3)} mm of the distance, "
        f"{format_number(math.degrees(warn.turn), 3)}° of turning (a transmission angle, which "
        "mechanisms usually keep above 30° to 45°), and "
        f"{format_number(warn.condition, 3)} of 1/cond J"
    )
    places = ticks((0.0, "0"), (edge, "warned below"), (100.0, f"≥ {FAR_WARNINGS:g} times"))
    return (
        f'<div title="{escape(hint)}"><div class="ex-legend" style="--colours:{stops}"></div>'
        f"{places}</div>"
    )


def measures_table(frame: Frame) -> str:
    """Return the scale of colours and the conditioning as HTML."""
    return box(legend(frame), table(_rows(frame)))


def _rows(frame: Frame) -> Iterator[str]:
    snapshot = frame.snapshot
    determinant = format_number(snapshot.determinant, size=snapshot.determinant_size)
    yield row(dim("det J"), f"{determinant} units³", hint="Determinant of the actuator Jacobian")
    yield row(
        dim("1/cond J"),
        share(snapshot.inverse_condition),
        hint="Inverse condition number of J, with lengths divided by the reach; 0 is singular",
    )
    yield row(
        dim("least σ of J"),
        share(snapshot.smallest_singular_value),
        hint="Smallest singular value of J, with lengths divided by the reach: errors of actuators "
        "and loads grow at most 1/σ times to those of the platform and of the actuators",
    )
    yield row(
        dim("min |δ| / reach"),
        share(snapshot.proximity),
        hint=f"Smallest margin over the reach |a3|; {MARGIN_KINDS}",
    )
