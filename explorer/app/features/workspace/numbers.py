"""Volumes, nodes and extent of the workspace, and the volume that collisions of legs block."""

from __future__ import annotations

import math
from collections.abc import Iterator

from explorer.app.features.feature import Services
from explorer.app.features.workspace.feed import WorkspaceFeed
from explorer.app.features.workspace.reached import Reached
from explorer.app.features.workspace.tasks import WorkspaceDrawing
from explorer.app.scene.bands import COLLIDING, PLAIN, WARN_CONDITION
from explorer.app.state.frame import Frame
from explorer.app.widgets.assigning import Update
from explorer.app.widgets.colours import css
from explorer.app.widgets.markup import (
    alert,
    box,
    caption,
    dim,
    format_number,
    meter,
    note,
    row,
    swatch,
    table,
    ticks,
)
from explorer.app.widgets.under_way import problem, progress
from explorer.legs.clearance import pair_name
from explorer.numerics.number_text import set_true_minus
from explorer.singularity.colours import BAND_EDGES, band_colours
from explorer.workspace.accessible.workspace import PairCost


class WorkspaceNumbers:
    """The numbers of the workspace as HTML."""

    def __init__(self, services: Services) -> None:
        gui, self._feed = services.gui, services.get(WorkspaceFeed)
        self._html = gui.add_html("")

    def updates(self, frame: Frame) -> Iterator[Update]:
        """Yield the updates that show a frame."""
        yield self._html, "content", workspace_summary(frame, self._feed)


def workspace_summary(frame: Frame, feed: WorkspaceFeed) -> str:
    """Return the numbers of the workspace as HTML."""
    view = frame.state.view.workspace
    if feed.problem is not None:
        return problem(feed, "The workspace could not be drawn", "Compute the workspace")
    if not (view.solid or view.hull):
        return note("Show the solid in the tab Workspace to measure it.")
    drawing = feed.drawing
    if drawing is None:
        return note(progress(feed).capitalize())
    # The workspace within the limits takes no time worth a message.
    is_waiting = view.region == "reachable" and not feed.is_current
    parts = [
        _headline(drawing, frame.state.design.unit_mm, progress(feed) if is_waiting else ""),
        _numbers(drawing),
    ]
    if drawing.reached is not None and drawing.volume > 0.0:
        parts.append(_pairs(drawing.reached, is_coloured=view.colour == "plain"))
    if view.colour != "plain":
        parts.append(_legend(view.colour, frame.state.warn_below))
    if drawing.coarse_edge is not None:
        parts.append(
            '<div class="ex-dim ex-after">The workspace is large beside the reach: colours '
            f"are computed at corners up to {drawing.coarse_edge:.3g} units apart.</div>"
        )
    return box(*parts)


def _headline(drawing: WorkspaceDrawing, unit_mm: float, waiting: str) -> str:
    """Return the volume in large type, and its share of the volume within the limits."""
    if drawing.volume <= 0.0:
        causes = ", ".join(drawing.empty_because)
        return alert("The workspace is empty", f"Emptied by: {causes}.")
    reached = drawing.reached
    text = ""
    if drawing.mesh_agrees is False:
        text = alert(
            "The solid is not quite the workspace",
            "The workspace is too thin for its triangles: their volume is not the exact one.",
        )
    volume = drawing.volume if reached is None else reached.volume
    litres = volume * (unit_mm / 100.0) ** 3
    kind = "exact volume" if reached is None else "reachable volume"
    text += (
        f'<div class="ex-line"><span class="ex-status">{volume:.6g} units³</span>'
        f'<span class="ex-dim ex-small">{waiting}</span></div>'
        + caption(f"{kind}, {litres:.4g} litres")
    )
    if reached is not None:
        percent = 100.0 * reached.volume / drawing.volume
        text += meter(percent, PLAIN, COLLIDING)
        text += caption(f"{percent:.4g} % of the {drawing.volume:.6g} within the limits")
    elif drawing.trouble is not None:
        which = "home" if drawing.request.start is None else "present"
        text += (
            '<div class="ex-beyond ex-before">All that is within the limits: '
            f"from the {which} position nothing can be reached.</div>"
        )
    return text


def _numbers(drawing: WorkspaceDrawing) -> str:
    """Return the table of nodes, extent and volumes."""
    rows: list[tuple[str, str, str]] = []
    nodes, reached = drawing.nodes, drawing.reached
    if nodes is not None:
        count, volume = f"{nodes.count:,}", nodes.volume
        hint = "The paper's measure: grid nodes within the limits"
        volume_hint = "Nodes times step³; it overstates the volume"
        if reached is not None and reached.node_count is not None:
            count, volume = f"{reached.node_count:,} of {count}", reached.node_count * nodes.step**3
            hint = "Nodes that collision-free steps of the grid reach, of all within the limits"
            volume_hint = "Nodes reached times step³, the paper's measure"
        elif reached is not None:
            hint += "; too many to check each step between them"
        rows += [
            ("Nodes", count, hint),
            ("Node volume", f"{volume:.6g}", volume_hint),
            ("Node step", f"{nodes.step:.4g}", "Step of the grid, in design units"),
        ]
    if drawing.extent is not None:
        size = drawing.request.design.reach
        for axis, low, high in zip("xyz", *drawing.extent, strict=True):
            text = f"{format_number(low, size=size)} … {format_number(high, size=size)}"
            rows.append((f"Extent {axis}", text, "Extent of the solid, in design units"))
    volume = drawing.volume if reached is None else reached.volume
    if volume > 0.0:
        error = 100.0 * (drawing.mesh_volume / volume - 1.0)
        text = set_true_minus(f"{error:+.2g} %")
        rows.append(("Mesh volume", text, "Volume of the drawn solid, against the one above"))
    if drawing.hull_volume is not None:
        rows.append(("Hull volume", f"{drawing.hull_volume:.6g}", "Volume of the convex hull"))
    rows.append(("Computed in", f"{1000.0 * drawing.seconds:.0f} ms", "Time of the worker process"))
    return table(row(dim(name), value, hint=hint) for name, value, hint in rows)


def _pairs(reached: Reached, *, is_coloured: bool) -> str:
    """Return the clearance of each pair of legs, and the volume that it blocks."""
    blocking = [pair for pair in reached.pairs if pair.blocked_volume > 0.0]
    words, look = "Legs touch, but block nothing", "within"
    if min(pair.clearance for pair in reached.pairs) > 0.0:
        words = "No pair collides"
    elif blocking:
        words, look = (
            f"Legs {', '.join(pair_name(pair.legs) for pair in blocking)} collide",
            "beyond",
        )
    mark = swatch(COLLIDING) if is_coloured and blocking else ""
    radius = ""
    if reached.harmless_radius > 0.0:
        radius = (
            '<div class="ex-dim ex-after">No two legs collide if all radii grow by up to '
            f"{format_number(reached.harmless_radius)}</div>"
        )
    rows = table(map(_pair, reached.pairs), ("legs", "least clearance", "blocked, units³"))
    return f'<div class="ex-strong ex-after ex-{look}">{mark}{words}</div>{rows}{radius}'


def _pair(pair: PairCost) -> str:
    clearance = "joined" if math.isinf(pair.clearance) else format_number(pair.clearance, 3)
    if pair.blocked_volume > 0.0:
        blocked = format_number(pair.blocked_volume, 3)
        return row(pair_name(pair.legs), clearance, blocked, look="ex-beyond")
    return row(pair_name(pair.legs), clearance, "–")


def _legend(colour: str, warn_below: float) -> str:
    """Return the bands of colours and the values at their edges."""
    unit, name = (
        (warn_below, "Smallest |δ| (design units)")
        if colour == "margin"
        else (WARN_CONDITION, "1 / cond J")
    )
    # All bands are drawn equally wide, so the values at their edges are not evenly spaced.
    width = 100.0 / len(BAND_EDGES)
    colours = ",".join(
        f"{css(band)} 0 {width * (index + 1):g}%" for index, band in enumerate(band_colours())
    )
    edges = ((width * index, f"{BAND_EDGES[index] * unit:.2g}") for index in (0, 2, 4, 6, 9))
    return (
        f'<div class="ex-caption ex-after">{name}</div>'
        f'<div class="ex-legend" style="--colours:{colours}"></div>{ticks(*edges)}'
    )
