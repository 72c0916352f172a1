"""The closure order of the 24 strata as a diagram of buttons, with the distance of each."""

from __future__ import annotations

from collections.abc import Mapping
from functools import cache
from html import escape

import viser

from explorer.app.features.feature import Services
from explorer.app.features.singularity import work
from explorer.app.inputs.controls import Controls
from explorer.app.state.frame import Frame
from explorer.app.widgets.assigning import Updates
from explorer.app.widgets.buttons import press_button
from explorer.app.widgets.markup import box, dim
from explorer.measures.blocks.singularity import stratum_sentence
from explorer.measures.verdict import DISTANCE_SHARE
from explorer.numerics.number_text import format_fitted
from explorer.singularity import strata
from explorer.singularity.colours import css, proximity_colour
from explorer.singularity.strata import GENERIC, Stratum

# In pixels, as in the stylesheet: from row to row, and the height of a node.
ROW, NODE_HEIGHT = 50, 30
PRESS = "strata.go"
GOALS = {"".join(map(str, w)): w for w in strata.STRATA if w != GENERIC}
"""The strata that the diagram leads to, by the values of their buttons."""


class StrataPanel:
    """The present stratum, those that one more incidence leads to, and the diagram."""

    def __init__(self, services: Services) -> None:
        gui, self._session, buttons = services.gui, services.session, services.buttons
        self._feed = services.get(work.STRATA_FEED)
        self._words = gui.add_html("")
        self._controls = Controls(gui, services.session)
        self._controls.checkbox(
            "Diagram",
            "Draw which of the 24 relative positions of the two flags border on each other; a "
            "click on one moves the mechanism to the nearest pose in it.",
            "view.singular.strata",
        )
        self._diagram = gui.add_html("", visible=False)
        buttons.on(PRESS, self._go, values=GOALS)
        for digits, stratum in GOALS.items():
            label = f"Go to {work.stratum_name(stratum)}: {strata.describe_stratum(stratum)}"
            buttons.offer(f"Singularity › {label}", f"{label}.", PRESS, digits)

    def updates(self, frame: Frame) -> Updates:
        """Yield the updates that make the panel show the frame."""
        yield from self._controls.updates(frame)
        is_visible = frame.state.view.singular.strata
        yield self._diagram, "visible", is_visible
        distances = distances_of(frame, self._feed)
        if is_visible:
            yield self._diagram, "content", diagram(frame, distances)
        yield self._words, "content", neighbours(frame, distances)

    def _go(self, digits: str, client: viser.ClientHandle) -> None:
        self._session.do(work.GoToStratum(GOALS[digits]), who=client.client_id)


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
        "distances in mm.</div>"
        f'<div class="ex-strata" style="--height:{6 * ROW + NODE_HEIGHT + 4}px">'
        f'{_edges(here)}<div class="ex-ranks">{ranks}</div><div class="ex-nodes">{nodes}</div>'
        "</div>"
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
            f"<span>mm</span></div>{rows}"
        )
    elif not strata.COVERED[here]:
        rest = '<div class="ex-dim ex-after">Both flags coincide: nothing is more singular.</div>'
    dimension = dim(f"dimension {strata.inversions(here)}")
    return box(
        f"<div><b>{work.stratum_name(here)}</b> {dimension}</div>",
        f"<div>{escape(_sentence(here))}</div>{rest}",
    )


_sentence = cache(stratum_sentence)


def _distance(distance: float | None, frame: Frame) -> str:
    """Return a distance in mm as text."""
    if distance is None:
        return "…"
    design = frame.state.design
    return format_fitted(distance * design.unit_mm, design.reach * design.unit_mm, 4)


def _node(stratum: Stratum, below: str, level: float | None, *, is_here: bool) -> str:
    column, count = _place(stratum)
    left = 100.0 * (column + 0.5) / count
    is_generic = stratum == GENERIC
    if is_here and is_generic:
        level = float("inf")
    if is_here or is_generic:
        below = "here" if is_here else "any"
    colour = "currentColor" if level is None else css(proximity_colour(level))
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
    lines: dict[bool, list[str]] = {False: [], True: []}
    for upper, lowers in strata.COVERED.items():
        for lower in lowers:
            x1, x2 = (100.0 * (c + 0.5) / n for c, n in (_place(upper), _place(lower)))
            y1 = _top(strata.inversions(upper)) + NODE_HEIGHT
            y2 = _top(strata.inversions(lower))
            line = f'<line x1="{x1:.4g}%" y1="{y1}" x2="{x2:.4g}%" y2="{y2}"/>'
            lines[upper == here].append(line)
    return (
        '<svg class="ex-edges" stroke="currentColor">'
        f'<g stroke-opacity="0.16">{"".join(lines[False])}</g>'
        f'<g stroke-opacity="0.75" stroke-width="1.5">{"".join(lines[True])}</g></svg>'
    )
