"""The proximity to singularities: verdict, margins and conditioning of the present pose."""

from __future__ import annotations

from collections.abc import Iterator
from html import escape

from explorer.app.features.feature import Services
from explorer.app.features.singularity.actions import stratum_name
from explorer.app.features.singularity.distance import DistancePanel
from explorer.app.features.singularity.performance import PerformancePanel
from explorer.app.features.singularity.strata import StrataPanel
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
from explorer.app.widgets.controls import At, Controls
from explorer.app.widgets.markup import (
    Look,
    box,
    caption,
    dim,
    fitted,
    format_number,
    meter,
    row,
    share,
    status,
    swatch,
    table,
    ticks,
)
from explorer.app.widgets.ranges import length_span
from explorer.measures.snapshot import Snapshot
from explorer.measures.verdict import DISTANCE_SHARE, Kind
from explorer.mechanism.margins import INCIDENCES, describe_modes, mode_name
from explorer.singularity.strata import GENERIC

VERDICT_HINT = (
    "Root-mean-square displacement of b1 to b4 to the nearest singular pose, of any position and "
    "orientation"
)
LEGEND_HINT = (
    "Colour of an incidence: by its margin |δ| or by the distance to its nearest singular pose, "
    "whichever is further left on its scale"
)
LOOKS: dict[Kind, Look] = {"clear": "within", "near": "close", "singular": "beyond"}


class SingularityPanel:
    """The verdict with its numbers; then folders for distances, strata and performance."""

    def __init__(self, services: Services) -> None:
        gui = services.gui
        self._controls = Controls(gui, services.session)
        self._numbers = gui.add_html("")
        self._controls.number(
            "Warn below",
            "Warning length in design units: an incidence is orange if its margin is below this "
            "length, or if its nearest singular pose is closer than a third of it.",
            At("view.warn_below", default=lambda state: state.warn_below),
            least=0.0,
            step=lambda state: length_span(state).step,
        )
        with gui.add_folder("Nearest singular poses"):
            self._distances = DistancePanel(services)
        with gui.add_folder("Stratum of the two flags"):
            self._strata = StrataPanel(services)
        with gui.add_folder("Performance"):
            self._performance = PerformancePanel(services)

    def updates(self, frame: Frame) -> Iterator[Update]:
        """Yield the updates that make the panel show the frame."""
        yield self._numbers, "content", summary(frame)
        yield from self._controls.updates(frame)
        yield from self._distances.updates(frame)
        yield from self._strata.updates(frame)
        yield from self._performance.updates(frame)


def summary(frame: Frame) -> str:
    """Return the panel's numbers as HTML."""
    return box(
        _verdict(frame),
        _legend(frame.state.warn_below),
        *(_margin(frame, index) for index in range(3)),
        f'<div class="ex-after ex-before">{table(_rows(frame))}</div>',
        _limits(frame.snapshot),
    )


def _verdict(frame: Frame) -> str:
    verdict = frame.verdict
    look = LOOKS[verdict.kind]
    return status(verdict.title, look) + (
        f'<div class="{"ex-dim" if look == "within" else f"ex-{look}"} ex-two-lines" '
        f'title="{VERDICT_HINT}">{escape(verdict.reason(frame.state.design.unit_mm))}</div>'
    )


def _legend(warn: float) -> str:
    edge = 100.0 / FAR_WARNINGS
    stops = f"{css(SINGULAR)} 0%,{css(WARNED)} {edge:g}%,{css(CLEAR)} {edge:g}%,{css(FAR)} 100%"
    scales = "".join(
        ticks(
            (0.0, "0"),
            (edge, f"{length:.3g}"),
            (60.0, name),
            (100.0, f"≥ {FAR_WARNINGS * length:.3g}"),
        )
        for name, length in (("margin |δ|", warn), ("distance", DISTANCE_SHARE * warn))
    )
    return (
        caption("Proximity to singularities (design units)", LEGEND_HINT)
        + f'<div class="ex-legend" style="--colours:{stops}"></div>{scales}'
    )


def _margin(frame: Frame, index: int) -> str:
    snapshot, level = frame.snapshot, frame.verdict.levels[index]
    value, volume = float(snapshot.margins[index]), float(snapshot.volumes[index])
    reach, unit_mm = snapshot.design.reach, snapshot.design.unit_mm
    colour = proximity_colour(level)
    filled = min(100.0, 100.0 * level / FAR_WARNINGS)
    return (
        f'<div class="ex-after"><div class="ex-line"><span>{swatch(colour)}'
        f"<b>δ{index + 1}</b>&ensp;"
        f'{fitted(value, reach, 5)}&ensp;<span class="ex-dim ex-small">'
        f"{fitted(value * unit_mm, reach * unit_mm, 4)} mm</span></span>"
        '<span class="ex-dim ex-small" title="Volume of its tetrahedron, signed">'
        f"V {format_number(volume, size=float(snapshot.volume_sizes[index]))} units³</span></div>"
        f"{meter(filled, colour, look='ex-meter is-thin')}"
        f'<div class="ex-dim ex-small">{INCIDENCES[index]}</div></div>'
    )


def _rows(frame: Frame) -> Iterator[str]:
    snapshot, mode = frame.snapshot, frame.state.mode
    is_generic = snapshot.stratum == GENERIC
    determinant = format_number(snapshot.determinant, size=snapshot.determinant_size)
    yield row(dim("det J"), f"{determinant} units³", hint="Determinant of the actuator Jacobian")
    yield row(
        dim("1/cond J"),
        share(snapshot.inverse_condition),
        hint="Inverse condition number of J, with lengths divided by the reach; 0 is singular",
    )
    yield row(
        dim("min |δ| / reach"),
        share(snapshot.proximity),
        hint="Smallest margin over the reach |a3|",
    )
    yield row(
        dim("Mode"),
        f"{mode_name(mode)} &nbsp;({mode})" if is_generic else snapshot.sign_words,
        hint="Assembly mode: the signs of δ1, δ2, δ3",
    )
    if not is_generic:
        yield row(
            "",
            describe_modes(snapshot.bordering_modes),
            hint="Modes that meet at this singular pose: their signs differ where a margin is 0",
        )
    yield row(
        dim("Stratum"),
        stratum_name(snapshot.stratum),
        hint="Relative position of the two flags, one of 24",
    )
    kind = "generic" if is_generic else "singular"
    yield row(
        "", f"dimension {snapshot.stratum_dimension}, {kind}", hint="Dimension of the stratum"
    )


def _limits(snapshot: Snapshot) -> str:
    if not snapshot.violations:
        return '<div class="ex-within ex-strong">Within all limits</div>'
    items = "".join(f"<div>{escape(str(limit))}</div>" for limit in snapshot.violations)
    return f'<div class="ex-beyond"><b>Outside the limits</b>{items}</div>'
