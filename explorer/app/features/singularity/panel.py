"""The panel of singularities: the verdict and the margins; then strata and performance."""

from __future__ import annotations

from collections.abc import Iterator
from html import escape

from explorer.app.features.feature import Services
from explorer.app.features.singularity.distance import DistancePanel
from explorer.app.features.singularity.freedom import show_button
from explorer.app.features.singularity.performance import PerformancePanel
from explorer.app.features.singularity.strata import StrataPanel
from explorer.app.inputs.bindings import At
from explorer.app.inputs.controls import Controls
from explorer.app.inputs.ranges import length_span
from explorer.app.state.frame import Frame
from explorer.app.widgets.assigning import Update
from explorer.app.widgets.blocks import render
from explorer.app.widgets.colours import CLEAR, FAR, FAR_WARNINGS, SINGULAR, WARNED, css
from explorer.app.widgets.copying import CopyButton
from explorer.app.widgets.markup import box, status, ticks
from explorer.measures.blocks.singularity import (
    LOOKS,
    VERDICT_HINT,
    colour_words,
    conditioning,
    freedoms,
)
from explorer.measures.blocks.source import Source, pose_source
from explorer.measures.verdict import warnings


class SingularityPanel:
    """The verdict and the margins; then folders for strata and performance."""

    def __init__(self, services: Services) -> None:
        gui = services.gui
        self._controls = Controls(gui, services.session)
        self._summary = gui.add_html("")

        def source() -> Source:
            state = services.session.settled()
            return pose_source("singularity", state.design, state.pose)

        self._copy = CopyButton(services.buttons, "Singularity", source)
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
        shows = {f"show {number}": show_button(number) for number in (1, 2, 3)}
        free = render(freedoms(frame.snapshot), shows) if frame.snapshot.is_singular else ""
        yield self._summary, "content", summary(frame, self._copy.html) + free
        yield from self._distances.updates(frame)
        yield from self._strata.updates(frame)
        yield self._measures, "content", measures_table(frame)
        yield from self._performance.updates(frame)
        yield from self._controls.updates(frame)


def summary(frame: Frame, corner: str = "") -> str:
    """Return the verdict, the mode and the limits as HTML, with a button in the corner."""
    verdict, snapshot = frame.verdict, frame.snapshot
    look = LOOKS[verdict.kind]
    reason = escape(verdict.reason(frame.state.design.unit_mm))
    return box(
        corner,
        status(verdict.title, look),
        f'<div class="{"ex-dim" if look == "within" else f"ex-{look}"} ex-two-lines" '
        f'title="{VERDICT_HINT}">{reason}</div>',
        f'<div class="ex-line"><span>{snapshot.mode_words.capitalize()}</span>'
        f"{_within(frame)}</div>",
        *(f'<div class="ex-beyond">{escape(str(limit))}</div>' for limit in snapshot.violations),
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
    hint = colour_words(warnings(design.reach, frame.state.warn_below), design.unit_mm)
    places = ticks((0.0, "0"), (edge, "warned below"), (100.0, f"≥ {FAR_WARNINGS:g} times"))
    return (
        f'<div title="{escape(hint)}"><div class="ex-legend" style="--colours:{stops}"></div>'
        f"{places}</div>"
    )


def measures_table(frame: Frame) -> str:
    """Return the scale of colours and the conditioning as HTML."""
    return box(legend(frame)) + render([conditioning(frame.snapshot)])
