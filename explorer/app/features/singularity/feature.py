"""The proximity to singularities: its panel, the verdict and the margins; then strata and gains."""

from __future__ import annotations

import math
from collections.abc import Mapping
from functools import cache
from html import escape
from typing import get_args
from xml.etree.ElementTree import Element

import viser

from explorer.app.features.feature import Feature, Services, Tab
from explorer.app.features.mechanism.incidences import HOVER, margin_hover
from explorer.app.features.singularity import scene, work
from explorer.app.inputs.bindings import At
from explorer.app.inputs.controls import Controls
from explorer.app.inputs.ranges import length_span
from explorer.app.state.frame import Frame
from explorer.app.state.moves import FIRST_FOLD
from explorer.app.state.view import Gain, Ghost
from explorer.app.widgets.blocks import render
from explorer.app.widgets.buttons import figure, press_button
from explorer.app.widgets.chips import StateCommand
from explorer.app.widgets.markup import box, caption, dim, margin_name, meter, swatch, ticks
from explorer.export.drawings.markup import as_html, circle, element
from explorer.measures.blocks import singularity as blocks
from explorer.measures.blocks.block import Column, Facts, Statement, head_of
from explorer.measures.blocks.commands import pose_command
from explorer.measures.verdict import DISTANCE_SHARE, MEANINGS, TITLES, warnings
from explorer.mechanism.folds import FOLD_LINES, FOLDS
from explorer.mechanism.margins import INCIDENCES, MARGIN_WORDS, TETRAHEDRA, signs_of
from explorer.mechanism.rgb import css
from explorer.numerics.number_text import format_decimals, format_fitted
from explorer.page.widgets.palette import shift
from explorer.singularity import colours, strata
from explorer.singularity.strata import GENERIC, Stratum

GO = "singular.go"
GO_HINT = "Move the mechanism to the nearest pose with this incidence."
# Length of a dial's needle in pixels.
NEEDLE = 15.0
FOLD_HINT = "The fold on a dial: a red end is flat, and a flat fold is a singular pose."


class SingularityPanel(Controls):
    """The verdict, its reason and the margins; below "More" the strata and the performance."""

    def __init__(self, services: Services) -> None:
        super().__init__(services)
        gui, buttons = services.gui, services.buttons
        services.get(margin_hover)
        copy = services.copy_button(
            "Singularity", lambda state: pose_command("singularity", state.design, state.pose)
        )
        self.markup(lambda frame: summary(frame, copy))
        self.markup(distance_table)
        services.do_on_press(GO, lambda value: work.go_to_singularity(int(value)), {"1", "2", "3"})
        for incidence in (1, 2, 3):
            buttons.offer(f"Singularity › Go to δ{incidence} = 0", GO_HINT, GO, str(incidence))
        with gui.add_folder("More", expand_by_default=False):
            self.dropdown(
                "Ghost",
                "Draw the nearest pose with an incidence, and the displacements of b1 to b4 to it.",
                get_args(Ghost),
                "view.singular.ghost",
                is_in_palette=True,
            )
            add_strata(services, self)
            self.markup(lambda frame: measures_table(frame) + performance_table(frame))
            self.dropdown(
                "Ellipsoid",
                "Draw at b4 or at the tool point all velocities that unit actuator speeds reach, "
                "or all forces that unit actuator forces hold.",
                get_args(Gain),
                "view.singular.ellipsoid",
                is_in_palette=True,
            )
            self.checkbox(
                "Singularity-free ball",
                "Draw the largest ball of positions without a singular one at this orientation, "
                "and the point where it touches the singular plane.",
                "view.singular.ball",
            )
            self.number(
                "Warn below ({unit})",
                "Warning length of all margins, to which those of motions, turns "
                "and 1/cond J are proportional: what is below is orange.",
                At("view.warn_below", default=lambda state: state.warn_below),
                least=0.0,
                step=lambda state: length_span(state).step,
                power=1,
            )


def summary(frame: Frame, corner: str = "") -> str:
    """Return the verdict, its reason and the freedoms as HTML, with a button in the corner."""
    verdict, unit = frame.verdict, frame.state.unit
    look, hint = blocks.LOOKS[verdict.kind], f"{MEANINGS[verdict.kind]} {blocks.VERDICT_HINT}"
    answer = Statement(verdict.title, verdict.reason(unit), look, hint=hint)
    shows = {f"show {number}": scene.show_button(number) for number in (1, 2, 3)}
    return render([answer, *blocks.freedoms(frame.snapshot, unit)], shows, corner=corner)


def measures_table(frame: Frame) -> str:
    """Return the scale of colours and the conditioning as HTML."""
    edge = 100.0 / colours.FAR_WARNINGS
    ends = (colours.SINGULAR, 0), (colours.WARNED, edge), (colours.CLEAR, edge), (colours.FAR, 100)
    stops = ",".join(f"{css(colour)} {place:g}%" for colour, place in ends)
    state = frame.state
    hint = blocks.colour_words(warnings(state.design.reach, state.warn_below), state.unit)
    most = f"≥ {colours.FAR_WARNINGS:g} times"
    legend = (
        f'<div title="{escape(hint)}"><div class="ex-legend" style="--colours:{stops}"></div>'
        f"{ticks((0.0, '0'), (edge, 'warned below'), (100.0, most))}</div>"
    )
    return box(legend) + render([blocks.conditioning(frame.snapshot, frame.state.unit)])


def performance_table(frame: Frame) -> str:
    """Return the gains and the radius of the ball in this pose as HTML."""
    point = frame.state.point
    radius = blocks.free_ball(frame.snapshot, frame.free_ball, point, frame.state.unit)
    return render([blocks.gains(frame.performance, point), Facts("", (radius,))])


def distance_table(frame: Frame) -> str:
    """Return the margins with their nearest singular poses as HTML, the nearest one in bold."""
    columns = blocks.margin_table(frame.snapshot, frame.state.unit).columns
    numbers = [each for each in columns if isinstance(each, Column) and not each.wide]
    named = [(head_of(each), each.hint) for each in numbers]
    heads = [("fold", FOLD_HINT), ("", ""), *named, ("", "")]
    head = "".join(f'<span title="{escape(hint)}">{name}</span>' for name, hint in heads)
    cells = zip(*(each.texts for each in numbers), strict=True)
    rows = "".join(_margin(frame, index, texts) for index, texts in enumerate(cells))
    return box(f'<div class="ex-margins"><div class="ex-dim ex-small">{head}</div>{rows}</div>')


def _margin(frame: Frame, index: int, texts: tuple[str, ...]) -> str:
    snapshot, level = frame.snapshot, frame.verdict.levels[index]
    colour = colours.proximity_colour(level)
    meaning = f"δ{index + 1}: {MARGIN_WORDS[index]}."
    flat = " ".join(TETRAHEDRA[index])
    hint = f"Zero with {INCIDENCES[index]}, where the tetrahedron {flat} is flat"
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
    is_nearest = index + 1 == frame.verdict.incidences[0]
    share = min(100.0, 100.0 * level / colours.FAR_WARNINGS)
    numbers = "".join(f"<span>{text}</span>" for text in texts)
    return (
        f'<div class="ex-margin-row" data-hover="{HOVER}" data-value="{index + 1}" '
        f'title="{meaning}">'
        f"{fold_dial(frame, index)}<div{' class=ex-strong' if is_nearest else ''}>"
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
    half = f"M{NEEDLE:g} 0A{NEEDLE:g} {NEEDLE:g} 0 0 {sweep} -{NEEDLE:g} 0Z"
    drawing = element(
        "svg",
        element("path", d=half),
        *(circle((end, 0.0), 2.5) for end in (NEEDLE, -NEEDLE)),
        element("path", d=f"M0 0L{x:.2f} {y:.2f}"),
        viewBox=f"-20 {top:g} 40 {NEEDLE + 6.0:g}",
        aria_hidden="true",
    )
    needle, ends = css(colours.MARGIN_COLOURS[index]), css(colours.SINGULAR)
    style = f"--colour:{needle};--end:{ends}"
    return as_html(element("span", drawing, angle, class_="ex-dial", title=hint, style=style))


def distance_figure(frame: Frame) -> str:
    """Return the motion to the nearest singular pose, and which margin is zero there."""
    verdict, unit = frame.verdict, frame.state.unit
    hint, look = f"{verdict.title}: {verdict.reason(unit)}.", f"ex-{blocks.LOOKS[verdict.kind]}"
    name = "Nearest singular pose"
    return figure("Singularity", name, verdict.brief(unit), hint=hint, look=look)


# In pixels, as in the stylesheet: from row to row, and the height of a node.
ROW, NODE_HEIGHT = 50, 30
PRESS = "strata.go"
GOALS = {"".join(map(str, w)): w for w in strata.STRATA if w != GENERIC}
"""The strata that the diagram leads to, by the values of their buttons."""


def add_strata(services: Services, controls: Controls) -> None:
    """Add the present stratum, those that one more incidence leads to, and the diagram."""
    feed = services.get(work.STRATA_FEED)
    controls.markup(lambda frame: neighbours(frame, distances_of(frame, feed)))
    controls.checkbox(
        "Diagram",
        "Draw which of the 24 relative positions of the two flags border on each other; a "
        "click on one moves the mechanism to the nearest pose in it.",
        "view.singular.strata",
    )

    def diagram_of(frame: Frame) -> str:
        is_shown = frame.state.view.singular.strata
        return diagram(frame, distances_of(frame, feed)) if is_shown else ""

    controls.markup(diagram_of)
    services.do_on_press(PRESS, lambda digits: work.go_to_stratum(GOALS[digits]), GOALS)
    for digits, stratum in GOALS.items():
        label = f"Go to {work.stratum_name(stratum)}: {strata.describe_stratum(stratum)}"
        services.buttons.offer(f"Singularity › {label}", f"{label}.", PRESS, digits)


def distances_of(frame: Frame, feed: work.StrataFeed) -> Mapping[Stratum, float]:
    """Return the distances that are known, by stratum, in design units.

    The distances of the present stratum and of those with one incidence are known at once; the
    worker computes the others.
    """
    distances = dict(feed.drawing or {}) if feed.is_current else {}
    nearest = (each.distance for each in frame.snapshot.nearest)
    distances.update(zip(strata.OF_INCIDENCES, nearest, strict=True))
    distances[frame.snapshot.stratum] = 0.0
    return distances


def diagram(frame: Frame, distances: Mapping[Stratum, float]) -> str:
    """Return the diagram as HTML, with the distances that are known, in design units."""
    here = frame.snapshot.stratum
    warn = DISTANCE_SHARE * frame.state.warn_below
    levels = {w: distance / warn for w, distance in distances.items()}
    # One incidence has one colour all over the page.
    levels.update(zip(strata.OF_INCIDENCES, frame.verdict.levels, strict=True))
    nodes = "".join(
        _node(w, _distance(distances.get(w), frame), levels.get(w), is_here=w == here)
        for w in strata.STRATA
    )
    ranks = "".join(
        f'<span style="--top:{_top(d) + 8}px" title="Dimension {d}">{d}</span>' for d in range(7)
    )
    return box(
        '<div class="ex-dim ex-small">Press one to go to its nearest pose. Dimensions on the left, '
        f"motions in {frame.state.unit.name}.</div>"
        f'<div class="ex-strata" style="--height:{6 * ROW + NODE_HEIGHT + 4}px">'
        f'{_edges(here)}<div class="ex-ranks ex-dim ex-small">{ranks}</div>'
        f'<div class="ex-nodes" role="toolbar" aria-label="Strata">{nodes}</div></div>'
    )


def neighbours(frame: Frame, distances: Mapping[Stratum, float]) -> str:
    """Return the present stratum and those that one more incidence leads to, as HTML.

    The first incidence of a generic pose is that of a margin: the table of the margins has it.
    """
    here, rest = frame.snapshot.stratum, ""
    rows = "".join(
        f'<div class="ex-line"><span>{escape(_sentence(w))}</span>'
        f"<span>{_distance(distances.get(w), frame)}</span></div>"
        for w in (strata.COVERED[here] if here != GENERIC else ())
    )
    if rows:
        rest = (
            '<div class="ex-line ex-dim ex-after"><span>With one more incidence</span>'
            f"<span>motion, {frame.state.unit.name}</span></div>{rows}"
        )
    elif not strata.COVERED[here]:
        rest = '<div class="ex-dim ex-after">Both flags coincide: nothing is more singular.</div>'
    dimension = dim(f"dimension {strata.inversions(here)}")
    return box(
        caption("Stratum of the two flags"),
        f"<div><b>{work.stratum_name(here)}</b> {dimension}</div>",
        f"<div>{escape(_sentence(here))}</div>{rest}",
    )


_sentence = cache(blocks.stratum_sentence)


def _distance(distance: float | None, frame: Frame) -> str:
    """Return a motion as text in the unit of the view."""
    if distance is None:
        return "…"
    state = frame.state
    return format_fitted(distance * state.unit.factor, state.design.reach * state.unit.factor, 4)


def _node(stratum: Stratum, below: str, level: float | None, *, is_here: bool) -> str:
    column, count = _place(stratum)
    left = 100.0 * (column + 0.5) / count
    is_generic = stratum == GENERIC
    if is_here and is_generic:
        level = float("inf")
    if is_here or is_generic:
        below = "here" if is_here else "any"
    colour = "currentColor" if level is None else css(colours.proximity_colour(level))
    place = f"--left:{left:.4g}%;--top:{_top(strata.inversions(stratum))}px;--colour:{colour}"
    digits = "".join(map(str, stratum))
    content = f"<b>{digits}</b><span>{below}</span>"
    look = "ex-node is-here" if is_here else "ex-node"
    hint = f"{work.stratum_name(stratum)}  {_sentence(stratum)}"
    if is_generic:
        return f'<span class="{look}" style="{place}" title="{escape(hint)}">{content}</span>'
    button = press_button(PRESS, digits, content, hint=hint, label=f"Go to {hint}", class_name=look)
    return f'<div style="{place}">{button}</div>'


@cache
def _place(stratum: Stratum) -> tuple[int, int]:
    """Return the column of a stratum and how many its row has."""
    row = [w for w in strata.STRATA if strata.inversions(w) == strata.inversions(stratum)]
    # In the order of `STRATA`, so that δ1, δ2 and δ3 stand from left to right.
    return row.index(stratum), len(row)


def _top(dimension: int) -> int:
    return (6 - dimension) * ROW


@cache
def _edges(here: Stratum) -> str:
    """Return the edges of the diagram as SVG; those down from a stratum are darker."""
    lines: dict[bool, list[Element]] = {False: [], True: []}
    for upper, lowers in strata.COVERED.items():
        for lower in lowers:
            x1, x2 = (f"{100.0 * (c + 0.5) / n:.4g}%" for c, n in map(_place, (upper, lower)))
            y1 = _top(strata.inversions(upper)) + NODE_HEIGHT
            y2 = _top(strata.inversions(lower))
            lines[upper == here].append(element("line", x1=x1, y1=y1, x2=x2, y2=y2))
    pale = element("g", *lines[False], stroke_opacity=0.16)
    dark = element("g", *lines[True], stroke_opacity=0.75, stroke_width=1.5)
    return as_html(element("svg", pale, dark, class_="ex-edges", stroke="currentColor"))


SINGULARITY = Feature(
    "singularity",
    manual="singularity.md#Verdict",
    tabs=(Tab("analyse", "Singularity", SingularityPanel, viser.Icon.ALERT_TRIANGLE),),
    bar=(("middle", lambda _: distance_figure),),
    verdicts={TITLES[kind]: meaning for kind, meaning in MEANINGS.items()},
    scene=(scene.NearestGhost, scene.EllipsoidScene, scene.BallScene, scene.FreeMotion),
    later_feeds=(work.STRATA_FEED,),
    commands=(
        StateCommand(
            "Singularity › Go to the nearest one",
            "Move the mechanism to the closest of the nearest poses of δ1, δ2 and δ3.",
            lambda _: work.go_to_singularity(None),
            keys=(shift("G"),),
        ),
    ),
)
