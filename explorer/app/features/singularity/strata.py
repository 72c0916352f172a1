"""The order of the 24 strata as a diagram to click on, today's lit, each with its distance."""

from __future__ import annotations

from collections.abc import Iterator, Mapping
from dataclasses import replace
from functools import cache
from html import escape

import viser

from explorer.app.browser.viser_gaps import element_id
from explorer.app.features.singularity.actions import GoToStratum, SetSingularView, name_of
from explorer.app.features.singularity.feed import StrataFeed
from explorer.app.session.session import Session
from explorer.app.state.frame import Frame
from explorer.app.widgets.assigning import Update
from explorer.app.widgets.colours import css, proximity_colour
from explorer.app.widgets.controls import Controls
from explorer.app.widgets.labels import out_of_sight
from explorer.app.widgets.markup import DIM, format_number
from explorer.measures.verdict import DISTANCE_SHARE
from explorer.singularity.bruhat import (
    COVERED,
    OF_INCIDENCES,
    Stratum,
    codimension,
    describe_stratum,
    incidences,
)
from explorer.singularity.strata import GENERIC, STRATA, inversions

# In pixels: from row to row, and the size of a node.
ROW, NODE_WIDTH, NODE_HEIGHT = 50, 36, 30
# On the left, for the dimensions.
LEFT = 14


class StrataPanel:
    """The diagram, and in words where one more incidence leads."""

    def __init__(self, gui: viser.GuiApi, session: Session) -> None:
        self._words = gui.add_html("")
        self._controls = Controls(gui, session)
        self._controls.checkbox(
            "Diagram",
            "Draw which of the 24 relative positions of the two flags borders on which; a click "
            "moves the mechanism to the nearest pose in one.",
            lambda frame: frame.state.view.singular.strata,
            lambda state, on: SetSingularView(replace(state.view.singular, strata=on)),
        )
        self._diagram = gui.add_html("", visible=False)
        self.buttons: dict[Stratum, viser.GuiButtonHandle] = {}
        for stratum in STRATA:
            if stratum != GENERIC:
                label = f"Go to {name_of(stratum)}: {describe_stratum(stratum)}"
                self.buttons[stratum] = self._controls.button(
                    label, f"{label}.", lambda w=stratum: GoToStratum(w)
                )
        self._ids = {w: element_id(button) for w, button in self.buttons.items()}
        gui.add_html(out_of_sight(tuple(self._ids.values())))

    def updates(self, frame: Frame, feed: StrataFeed) -> Iterator[Update]:
        """Yield what makes the panel show the frame."""
        yield from self._controls.updates(frame)
        shown = frame.state.view.singular.strata
        yield self._diagram, "visible", shown
        for button in self.buttons.values():
            yield button, "visible", shown
        distances = distances_of(frame, feed)
        if shown:
            yield self._diagram, "content", diagram(frame, distances, self._ids)
        yield self._words, "content", neighbours(frame, distances)


def distances_of(frame: Frame, feed: StrataFeed) -> Mapping[Stratum, float]:
    """Return what is known of the distances at this moment.

    Those of codimension one are, and those whose closure the pose lies in; the others come
    from the worker.
    """
    here = frame.snapshot.stratum
    drawing = feed.drawing if feed.is_current else None
    found = {} if drawing is None else dict(drawing.distances)
    for stratum, nearest in zip(OF_INCIDENCES, frame.snapshot.nearest, strict=True):
        found[stratum] = nearest.distance
    found[here] = 0.0
    return found


def diagram(frame: Frame, distances: Mapping[Stratum, float], ids: Mapping[Stratum, str]) -> str:
    """Return the diagram as HTML.

    Args:
        frame: What is shown.
        distances: As far as they are known, by stratum, in design units.
        ids: Of the buttons that the nodes push.
    """
    here = frame.snapshot.stratum
    warn = DISTANCE_SHARE * frame.state.warn_below
    levels = {w: distance / warn for w, distance in distances.items()}

    def below(stratum: Stratum) -> str:
        return _distance(distances.get(stratum), 3, frame)

    # One incidence has one colour all over the page.
    levels.update(zip(OF_INCIDENCES, frame.verdict.levels, strict=True))
    nodes = "".join(
        _node(w, below(w), levels.get(w), ids.get(w), is_here=w == here) for w in STRATA
    )
    ranks = "".join(
        f'<span style="position:absolute;left:0;top:{_top(d) + 8}px;font-size:10.5px;{DIM}" '
        f'title="Dimension {d}">{d}</span>'
        for d in range(7)
    )
    return (
        '<div style="padding:2px 12px 0;font-variant-numeric:tabular-nums">'
        f'<div style="{DIM};font-size:11.5px;line-height:1.35">Dimension on the left; below each '
        "its distance in design units. Click to go to the nearest pose in it.</div>"
        f'<div style="position:relative;height:{6 * ROW + NODE_HEIGHT + 4}px;margin-top:6px">'
        f'{_edges(here)}{ranks}<div style="position:absolute;left:{LEFT}px;right:0;top:0">'
        f"{nodes}</div></div></div>"
    )


def neighbours(frame: Frame, distances: Mapping[Stratum, float]) -> str:
    """Return where the pose lies and where one more incidence leads, in words, as HTML."""
    here = frame.snapshot.stratum
    rows = "".join(_neighbour(w, _distance(distances.get(w), 4, frame)) for w in COVERED[here])
    rest = (
        f'<div style="{DIM};margin:7px 0 3px;display:flex;'
        f'justify-content:space-between"><span>One incidence from here</span><span>units</span>'
        f"</div>{rows}"
        if rows
        else f'<div style="{DIM};margin-top:7px">Both flags coincide: nothing is more singular.'
        "</div>"
    )
    return (
        '<div style="padding:4px 12px 8px;font-size:12.5px;line-height:1.4;'
        f'font-variant-numeric:tabular-nums"><div><b>{name_of(here)}</b> '
        f'<span style="{DIM}">dimension {inversions(here)}</span></div>'
        f"<div>{escape(_sentence(here))}</div>{rest}</div>"
    )


@cache
def _sentence(stratum: Stratum) -> str:
    if stratum == GENERIC:
        return "Generic: no incidence, not singular."
    zero = ", ".join(f"δ{index}" for index in incidences(stratum))
    return f"{zero} = 0: {describe_stratum(stratum)}"


def _distance(distance: float | None, digits: int, frame: Frame) -> str:
    if distance is None:
        return "…"
    return format_number(distance, digits, size=frame.state.design.reach)


def _neighbour(stratum: Stratum, value: str) -> str:
    return (
        '<div style="display:flex;justify-content:space-between;gap:8px;padding:2px 0">'
        f"<span>{escape(_sentence(stratum))}</span><span>{value}</span></div>"
    )


def _node(
    stratum: Stratum,
    below: str,
    level: float | None,
    button: str | None,
    *,
    is_here: bool,
) -> str:
    column, count = _place(stratum)
    left = 100.0 * (column + 0.5) / count
    colour = "currentColor" if level is None else css(proximity_colour(level, 1.0))
    look = "background:var(--mantine-color-body);"
    edge = f"border:1.5px solid color-mix(in srgb,{colour} 75%,transparent);"
    if is_here:
        below = "here"
        edge, look = f"border:1.5px solid {colour};", f"background:{colour};color:#fff;"
        if stratum == GENERIC:
            colour = css(proximity_colour(float("inf"), 1.0))
            edge, look = f"border:1.5px solid {colour};", f"background:{colour};color:#fff;"
    elif stratum == GENERIC:
        below = "any"
    hint = escape(f"{name_of(stratum)}  {_sentence(stratum)}")
    tag, does = ("span", "") if button is None else ("label", f' for="{button}"')
    # The button takes its name from its label.
    named = "" if button is None else f' aria-label="Go to {hint}"'
    pointer = "" if button is None else "cursor:pointer;"
    return (
        f'<{tag}{does} title="{hint}"{named} style="position:absolute;left:calc({left:.4g}% - '
        f"{NODE_WIDTH // 2}px);top:{_top(inversions(stratum))}px;width:{NODE_WIDTH}px;"
        f"height:{NODE_HEIGHT}px;box-sizing:border-box;border-radius:5px;text-align:center;"
        f'user-select:none;{pointer}{edge}{look}"><span style="display:block;font-size:11px;'
        f'line-height:15px;font-weight:600">{"".join(map(str, stratum))}</span>'
        f'<span style="display:block;font-size:9.5px;line-height:10px;opacity:0.85">{below}'
        f"</span></{tag}>"
    )


@cache
def _place(stratum: Stratum) -> tuple[int, int]:
    """Return the column of a stratum and how many its row has."""
    row = [w for w in STRATA if codimension(w) == codimension(stratum)]
    # From the left as δ1, δ2 and δ3 are counted.
    return row.index(stratum), len(row)


def _top(dimension: int) -> int:
    return (6 - dimension) * ROW


@cache
def _edges(here: Stratum) -> str:
    """Return the edges of the diagram; those that lead on from a stratum stand out."""
    plain: list[str] = []
    lit: list[str] = []
    for upper, lowers in COVERED.items():
        for lower in lowers:
            ends = [(100.0 * (c + 0.5) / n) for c, n in (_place(upper), _place(lower))]
            first = _top(inversions(upper)) + NODE_HEIGHT
            line = (
                f'<line x1="{ends[0]:.4g}%" y1="{first}" x2="{ends[1]:.4g}%" '
                f'y2="{_top(inversions(lower))}"/>'
            )
            (lit if upper == here else plain).append(line)
    return (
        f'<svg style="position:absolute;left:{LEFT}px;top:0;width:calc(100% - {LEFT}px);'
        'height:100%;overflow:visible" stroke="currentColor">'
        f'<g stroke-opacity="0.16">{"".join(plain)}</g>'
        f'<g stroke-opacity="0.75" stroke-width="1.5">{"".join(lit)}</g></svg>'
    )
