"""The proximity to singularities: its panel, the verdict and the margins; then strata and gains."""

from __future__ import annotations

import math
from html import escape
from typing import get_args

import viser

from explorer.app.features.feature import Feature, InBar, Services, StateCommand, Tab
from explorer.app.features.mechanism.incidences import HOVER, margin_hover
from explorer.app.features.singularity import scene
from explorer.app.features.singularity.strata import StrataPanel
from explorer.app.features.singularity.work import STRATA_FEED, GoToSingularity, strata_distances
from explorer.app.inputs.controls import At, Controls
from explorer.app.inputs.ranges import length_span
from explorer.app.state.folds import FIRST_FOLD
from explorer.app.state.frame import Frame
from explorer.app.state.view import Gain, Ghost
from explorer.app.widgets.assigning import Updates
from explorer.app.widgets.blocks import render
from explorer.app.widgets.buttons import CopyButton, figure, press_button
from explorer.app.widgets.markup import box, margin_name, meter, status, swatch, ticks
from explorer.app.widgets.palette import shift
from explorer.measures.blocks import singularity as blocks
from explorer.measures.blocks.block import Column, Facts, head_of
from explorer.measures.blocks.source import Source, pose_source
from explorer.measures.verdict import warnings
from explorer.mechanism.folds import FOLD_LINES, FOLDS
from explorer.mechanism.margins import INCIDENCES, TETRAHEDRA, signs_of
from explorer.numerics.number_text import format_decimals
from explorer.singularity import colours

GO = "singular.go"
GO_HINT = "Move the mechanism to the nearest pose with this incidence."
# Length of a dial's needle in pixels.
NEEDLE = 15.0
FOLD_HINT = "The fold on a dial: a red end is flat, and a flat fold is a singular pose."


class SingularityPanel:
    """The verdict and the margins; then folders for strata and performance."""

    def __init__(self, services: Services) -> None:
        gui, buttons, self._session = services.gui, services.buttons, services.session
        services.get(margin_hover)
        self._controls = controls = Controls(gui, services.session)
        self._summary = gui.add_html("")

        def source() -> Source:
            state = services.session.latest_state()
            return pose_source("singularity", state.design, state.pose)

        self._copy = CopyButton(buttons, "Singularity", source)
        self._table = gui.add_html("")
        controls.dropdown(
            "Ghost",
            "Draw the nearest pose with an incidence, and the displacements of b1 to b4 to it.",
            get_args(Ghost),
            "view.singular.ghost",
        )
        buttons.on(GO, self._go, values={"1", "2", "3"})
        for incidence in (1, 2, 3):
            buttons.offer(f"Singularity › Go to δ{incidence} = 0", GO_HINT, GO, str(incidence))
        with gui.add_folder("Stratum of the two flags"):
            self._strata = StrataPanel(services)
        with gui.add_folder("Performance"):
            self._measures = gui.add_html("")
            self._performance = gui.add_html("")
            controls.dropdown(
                "Ellipsoid",
                "Draw at b4 or at the tool point all velocities that unit actuator speeds reach, "
                "or all forces that unit actuator forces hold.",
                get_args(Gain),
                "view.singular.ellipsoid",
            )
            controls.checkbox(
                "Singularity-free ball",
                "Draw the largest ball of positions without a singular one at this orientation, "
                "and the point where it touches the singular plane.",
                "view.singular.ball",
            )
        controls.number(
            "Warn below",
            "Warning length of all margins in design units, to which those of distances, turns and "
            "1/cond J are proportional: what is below is orange.",
            At("view.warn_below", default=lambda state: state.warn_below),
            least=0.0,
            step=lambda state: length_span(state).step,
        )

    def updates(self, frame: Frame) -> Updates:
        """Yield the updates that make the panel show the frame."""
        shows = {f"show {number}": scene.show_button(number) for number in (1, 2, 3)}
        free = render(blocks.freedoms(frame.snapshot), shows) if frame.snapshot.is_singular else ""
        yield self._summary, "content", summary(frame, self._copy.html) + free
        yield self._table, "content", distance_table(frame)
        yield from self._strata.updates(frame)
        yield self._measures, "content", measures_table(frame)
        yield self._performance, "content", performance_table(frame)
        yield from self._controls.updates(frame)

    def _go(self, value: str, client: viser.ClientHandle) -> None:
        self._session.do(GoToSingularity(int(value)), who=client.client_id)


def summary(frame: Frame, corner: str = "") -> str:
    """Return the verdict, the mode and the limits as HTML, with a button in the corner."""
    verdict, snapshot = frame.verdict, frame.snapshot
    look = blocks.LOOKS[verdict.kind]
    reason = escape(verdict.reason(frame.state.design.unit_mm))
    limits_look, limits = "ex-within", "Within all limits"
    if snapshot.violations:
        limits_look, limits = "ex-beyond", "Outside the limits"
    elif snapshot.is_singular:
        limits_look, limits = "", "Limits kept"
    return box(
        corner,
        status(verdict.title, look),
        f'<div class="{"ex-dim" if look == "within" else f"ex-{look}"} ex-two-lines" '
        f'title="{blocks.VERDICT_HINT}">{reason}</div>',
        f'<div class="ex-line"><span>{snapshot.mode_words.capitalize()}</span>'
        f'<span class="ex-strong {limits_look}">{limits}</span></div>',
        *(f'<div class="ex-beyond">{escape(str(limit))}</div>' for limit in snapshot.violations),
    )


def measures_table(frame: Frame) -> str:
    """Return the scale of colours and the conditioning as HTML."""
    edge = 100.0 / colours.FAR_WARNINGS
    ends = (colours.SINGULAR, 0), (colours.WARNED, edge), (colours.CLEAR, edge), (colours.FAR, 100)
    stops = ",".join(f"{colours.css(colour)} {place:g}%" for colour, place in ends)
    design = frame.state.design
    hint = blocks.colour_words(warnings(design.reach, frame.state.warn_below), design.unit_mm)
    most = f"≥ {colours.FAR_WARNINGS:g} times"
    legend = (
        f'<div title="{escape(hint)}"><div class="ex-legend" style="--colours:{stops}"></div>'
        f"{ticks((0.0, '0'), (edge, 'warned below'), (100.0, most))}</div>"
    )
    return box(legend) + render([blocks.conditioning(frame.snapshot)])


def performance_table(frame: Frame) -> str:
    """Return the gains and the radius of the ball in this pose as HTML."""
    point = frame.state.point
    radius = blocks.free_ball(frame.snapshot, frame.free_ball, point)
    return render([blocks.gains(frame.performance, point), Facts("", (radius,))])


def distance_table(frame: Frame) -> str:
    """Return the margins with their nearest singular poses as HTML, the nearest one in bold."""
    columns = blocks.margin_table(frame.snapshot).columns
    numbers = [each for each in columns if isinstance(each, Column) and not each.wide]
    named = [(head_of(each), each.hint) for each in numbers]
    heads = [("fold", FOLD_HINT), ("", ""), *named, ("", "")]
    head = "".join(f'<span title="{escape(hint)}">{name}</span>' for name, hint in heads)
    cells = zip(*(each.texts for each in numbers), strict=True)
    rows = "".join(_margin(frame, index, texts) for index, texts in enumerate(cells))
    return box(f'<div class="ex-margins"><div class="ex-dim ex-small">{head}</div>{rows}</div>')


def _margin(frame: Frame, index: int, texts: tuple[str, ...]) -> str:
    snapshot, level = frame.snapshot, frame.verdict.levels[index]
    distances, colour = snapshot.nearest_distances, colours.proximity_colour(level)
    hint = f"{INCIDENCES[index]}, where the tetrahedron {' '.join(TETRAHEDRA[index])} is flat"
    go = press_button(
        GO,
        index + 1,
        "Go",
        hint=GO_HINT,
        label=f"Go to δ{index + 1} = 0",
        class_name="ex-link",
        hover=HOVER,
        is_disabled=snapshot.nearest[index].distance == 0.0,
    )
    is_least = distances[index] == min(distances)
    share = min(100.0, 100.0 * level / colours.FAR_WARNINGS)
    numbers = "".join(f"<span>{text}</span>" for text in texts)
    return (
        f'<div class="ex-margin-row" data-hover="{HOVER}" data-value="{index + 1}">'
        f"{fold_dial(frame, index)}<div{' class=ex-strong' if is_least else ''}>"
        f"{margin_name(index + 1)}{numbers}{go}</div>"
        f'<div class="ex-danger" title="{escape(hint)}">{swatch(colour)}'
        f'<span class="ex-dim ex-small ex-fill">{INCIDENCES[index]}</span>'
        f"{meter(share, colour, look='ex-meter is-thin')}</div></div>"
    )


def fold_dial(frame: Frame, index: int) -> str:
    """Return the fold of a margin, by the margin's index, as a needle on half a circle, as HTML.

    The half is the upper one for a positive fold, the lower one for a negative fold.
    """
    fold = frame.folds[FIRST_FOLD + index]
    x, y = NEEDLE * math.cos(math.radians(fold)), -NEEDLE * math.sin(math.radians(fold))
    side = signs_of(frame.state.mode)[index] if fold == 0.0 else math.copysign(1.0, fold)
    top, sweep = (-NEEDLE - 2.0, 0) if side > 0.0 else (-4.0, 1)
    angle = f"{format_decimals(fold, 1)}°"
    hint = (
        f"Fold {FOLDS[FIRST_FOLD + index]} at the {FOLD_LINES[index]}: {angle}; flat at 0° and "
        f"{'' if side > 0.0 else '−'}180°, with {INCIDENCES[index]}"
    )
    return (
        f'<span class="ex-dial" title="{escape(hint)}" '
        f'style="--colour:{colours.css(colours.MARGIN_COLOURS[index])};--end:{colours.css(colours.SINGULAR)}">'
        f'<svg viewBox="-20 {top:g} 40 {NEEDLE + 6.0:g}" aria-hidden="true">'
        f'<path d="M{NEEDLE:g} 0A{NEEDLE:g} {NEEDLE:g} 0 0 {sweep} -{NEEDLE:g} 0Z"/>'
        f'<circle cx="{NEEDLE:g}" r="2.5"/><circle cx="-{NEEDLE:g}" r="2.5"/>'
        f'<path d="M0 0L{x:.2f} {y:.2f}"/></svg>{angle}</span>'
    )


def distance_figure(frame: Frame) -> str:
    """Return the distance to the nearest singular pose, and which margin is zero there."""
    verdict, unit_mm = frame.verdict, frame.state.design.unit_mm
    hint, look = f"{verdict.title}: {verdict.reason(unit_mm)}.", f"ex-{blocks.LOOKS[verdict.kind]}"
    name = "Nearest singular pose"
    return figure("Singularity", name, verdict.brief(unit_mm), hint=hint, look=look)


SINGULARITY = Feature(
    "singularity",
    tabs=(Tab("analyse", "Singularity", SingularityPanel, viser.Icon.ALERT_TRIANGLE),),
    bar=(InBar("middle", lambda _: distance_figure),),
    scene=(scene.NearestGhost, scene.EllipsoidScene, scene.BallScene, scene.FreeMotion),
    later_feeds=(STRATA_FEED,),
    tasks=(strata_distances,),
    commands=(
        StateCommand(
            "Singularity › Go to the nearest one",
            "Move the mechanism to the closest of the nearest poses of δ1, δ2 and δ3.",
            lambda _: GoToSingularity(None),
            keys=(shift("G"),),
        ),
    ),
    lists=("Ghost", "Ellipsoid"),
)
