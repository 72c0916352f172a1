"""The closure order of the 24 strata as a diagram of buttons, with the distance of each."""

from __future__ import annotations

from collections.abc import Iterator, Mapping
from functools import cache
from html import escape

import viser

from explorer.app.features.feature import Services
from explorer.app.features.singularity.work import (
    STRATA_FEED,
    GoToStratum,
    StrataFeed,
    stratum_name,
)
from explorer.app.inputs.controls import Controls
from explorer.app.state.frame import Frame
from explorer.app.widgets.assigning import Update
from explorer.app.widgets.buttons import press_button
from explorer.app.widgets.markup import box, dim
from explorer.measures.blocks.singularity import stratum_sentence
from explorer.measures.verdict import DISTANCE_SHARE
from explorer.numerics.number_text import format_fitted
from explorer.singularity.colours import css, proximity_colour
from explorer.singularity.strata import (
    COVERED,
    GENERIC,
    OF_INCIDENCES,
    STRATA,
    Stratum,
    codimension,
    describe_stratum,
    inversions,
)

# In pixels, as in the stylesheet: from row to row, and the height of a node.
ROW, NODE_HEIGHT = 50, 30


class StrataPanel:
    """The present stratum, those that one more incidence leads to, and the diagram."""

    def __init__(self, services: Services) -> None:
        gui, self._session, buttons = services.gui, services.session, services.buttons
        self._feed = services.get(STRATA_FEED)
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
            label = f"Go to {stratum_name(stratum)}: {describe_stratum(stratum)}"
            buttons.offer(f"Singularity › {label}", f"{label}.", PRESS, digits)

    def updates(self, frame: Frame) -> Iterator[Update]:
        """Yield the updates that make the panel show the frame."""
        yield from self._controls.updates(frame)
        is_visible = frame.state.view.singular.strata
        yield self._diagram, "visible", is_visible
        distances = distances_of(frame, self._feed)
        if is_visible:
            yield self._diagram, "content", diagram(frame, distances)
        yield self._words, "content", neighbours(frame, distances)

    def _go(self, digits: str, client: viser.ClientHandle) -> None:
        self._session.do(GoToStratum(GOALS[digits]), who=client.client_id)


def _digits(stratum: Stratum) -> str:
    return "".join(map(str, stratum))


PRESS = "strata.go"
GOALS = {_digits(w): w for w in STRATA if w != GENERIC}
"""The strata that the diagram leads to, by the values of their buttons."""


def distances_of(frame: Frame, feed: StrataFeed) -> Mapping[Stratum, float]:
    """Return the distances that are known, by stratum, in design units.

    The distances of the present stratum and of those with one incidence are known at once; the
    worker computes the others.
    """
    here = frame.snapshot.stratum
    distances = dict(feed.drawing or {}) if feed.is_current else {}
    for stratum, nearest in zip(OF_INCIDENCES, frame.snapshot.nearest, strict=True):
        distances[stratum] = nearest.distance
    distances[here] = 0.0
    return distances


def diagram(frame: Frame, distances: Mapping[Stratum, float]) -> str:
    """Return the diagram as HTML, with the distances that are known, in design units."""
    here = frame.snapshot.stratum
    warn = DISTANCE_SHARE * frame.state.warn_below
    levels = {w: distance / warn for w, distance in distances.items()}

    # One incidence has one colour all over the page.
    levels.update(zip(OF_INCIDENCES, frame.verdict.levels, strict=True))
    nodes = "".join(
        _node(w, _distance(distances.get(w), frame), levels.get(w), is_here=w == here)
        for w in STRATA
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
    here = frame.snapshot.stratum
    covered = COVERED[here] if here != GENERIC else ()
    rows = "".join(
        f'<div class="ex-line"><span>{escape(_sentence(w))}</span>'
        f"<span>{_distance(distances.get(w), frame)}</span></div>"
        for w in covered
    )
    rest = (
        '<div class="ex-line ex-dim ex-after"><span>With one more incidence</span>'
        f"<span>mm</span></div>{rows}"
        if rows
        else ""
    )
    if not COVERED[here]:
        rest = '<div class="ex-dim ex-after">Both flags coincide: nothing is more singular.</div>'
    return box(
        f"<div><b>{stratum_name(here)}</b> {dim(f'dimension {inversions(here)}')}</div>",
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
    colour = "currentColor" if level is None else css(proximity_colour(level))
    if is_here:
        below = "here"
        if stratum == GENERIC:
            colour = css(proximity_colour(float("inf")))
    elif stratum == GENERIC:
        below = "any"
    place = f"--left:{left:.4g}%;--top:{_top(inversions(stratum))}px;--colour:{colour}"
    content = f"<b>{_digits(stratum)}</b><span>{below}</span>"
    look = "ex-node is-here" if is_here else "ex-node"
    hint = f"{stratum_name(stratum)}  {_sentence(stratum)}"
    if stratum == GENERIC:
        return f'<span class="{look}" style="{place}" title="{escape(hint)}">{content}</span>'
    button = press_button(
        PRESS, _digits(stratum), content, hint=hint, label=f"Go to {hint}", class_name=look
    )
    return f'<div style="{place}">{button}</div>'


@cache
def _place(stratum: Stratum) -> tuple[int, int]:
    """Return the column of a stratum and how many its row has."""
    row = [w for w in STRATA if codimension(w) == codimension(stratum)]
    # In the order of `STRATA`, so that δ1, δ2 and δ3 stand from left to right.
    return row.index(stratum), len(row)


def _top(dimension: int) -> int:
    return (6 - dimension) * ROW


@cache
def _edges(here: Stratum) -> str:
    """Return the edges of the diagram as SVG; those down from a stratum are darker."""
    plain: list[str] = []
    darker: list[str] = []
    for upper, lowers in COVERED.items():
        for lower in lowers:
            ends = [(100.0 * (c + 0.5) / n) for c, n in (_place(upper), _place(lower))]
            first = _top(inversions(upper)) + NODE_HEIGHT
            line = (
                f'<line x1="{ends[0]:.4g}%" y1="{first}" x2="{ends[1]:.4g}%" '
                f'y2="{_top(inversions(lower))}"/>'
            )
            (darker if upper == here else plain).append(line)
    return (
        '<svg class="ex-edges" stroke="currentColor">'
        f'<g stroke-opacity="0.16">{"".join(plain)}</g>'
        f'<g stroke-opacity="0.75" stroke-width="1.5">{"".join(darker)}</g></svg>'
    )
