"""The numbers of the workspace: volumes, nodes, extent, and what the legs take from it."""

from __future__ import annotations

import math
from collections.abc import Iterator
from html import escape

import viser

from explorer.app.features.workspace.feed import WorkspaceFeed
from explorer.app.features.workspace.reached import Reached
from explorer.app.features.workspace.tasks import WorkspaceDrawing
from explorer.app.scene.bands import COLLIDING, PLAIN, WARN_CONDITION
from explorer.app.state.frame import Frame
from explorer.app.widgets.assigning import Update
from explorer.app.widgets.colours import css
from explorer.app.widgets.markup import BEYOND, DIM, WITHIN, alert, format_number
from explorer.app.widgets.under_way import problem, progress
from explorer.singularity.colours import BAND_EDGES, band_colours
from explorer.workspace.accessible.workspace import PairCost

RIGHT = '<td style="text-align:right">'


class WorkspaceNumbers:
    """The numbers of the workspace, beside those of the singularities."""

    def __init__(self, gui: viser.GuiApi) -> None:
        self._html = gui.add_html("")

    def updates(self, frame: Frame, feed: WorkspaceFeed) -> Iterator[Update]:
        """Yield what makes the panel show the frame."""
        yield self._html, "content", workspace_summary(frame, feed)


def workspace_summary(frame: Frame, feed: WorkspaceFeed) -> str:
    """Return the numbers of the workspace as HTML."""
    view = frame.state.view.workspace
    if feed.problem is not None:
        return problem(feed, "The workspace could not be drawn", "Compute the workspace")
    if not (view.solid or view.hull):
        return _note("Show the solid in the tab Workspace to measure it.")
    drawing = feed.drawing
    if drawing is None:
        return _note(progress(feed).capitalize())
    # What is within the limits is there at once.
    waits = view.region == "reachable" and not feed.is_current
    note = progress(feed) if waits else ""
    parts = [_headline(drawing, frame.state.design.unit_mm, note), _numbers(drawing)]
    if drawing.reached is not None and drawing.volume > 0.0:
        parts.append(_pairs(drawing.reached, coloured=view.colour == "plain"))
    if view.colour != "plain":
        parts.append(_legend(view.colour, frame.state.warn_below))
    if drawing.coarse_edge is not None:
        parts.append(
            f'<div style="{DIM};margin-top:4px">The workspace is large beside the reach: colours '
            f"are computed at corners up to {drawing.coarse_edge:.3g} units apart.</div>"
        )
    return (
        '<div style="padding:4px 12px 8px;font-size:12.5px;line-height:1.45;'
        f'font-variant-numeric:tabular-nums">{"".join(parts)}</div>'
    )


def _headline(drawing: WorkspaceDrawing, unit_mm: float, waits: str) -> str:
    if drawing.volume <= 0.0:
        causes = ", ".join(drawing.empty_because)
        return alert("The workspace is empty", f"Emptied by: {causes}.")
    reached = drawing.reached
    disagrees = ""
    if drawing.mesh_agrees is False:
        disagrees = alert(
            "The solid is not quite the workspace",
            "The workspace is too thin for its triangles: their volume is not the exact one.",
        )
    volume = drawing.volume if reached is None else reached.volume
    litres = volume * (unit_mm / 100.0) ** 3
    word = "exact volume" if reached is None else "can be reached"
    note = f'<span style="{DIM};font-size:11.5px">{waits}</span>' if waits else ""
    text = disagrees + (
        '<div style="display:flex;align-items:baseline;justify-content:space-between">'
        f'<span style="font-size:15px;font-weight:600">{volume:.6g} units³</span>{note}</div>'
        f'<div style="{DIM};margin-bottom:6px">{word}, {litres:.4g} litres</div>'
    )
    if reached is not None:
        text += _share(reached.volume, drawing.volume)
    elif drawing.trouble is not None:
        which = "home" if drawing.request.start is None else "present"
        text += (
            f'<div style="color:{BEYOND};margin-bottom:6px">All that is within the limits: '
            f"from the {which} position nothing can be reached.</div>"
        )
    return text


def _share(reached: float, volume: float) -> str:
    """Return how much of the volume within the limits can be reached, as a bar and in words."""
    percent = 100.0 * reached / volume
    return (
        '<div style="height:5px;border-radius:3px;overflow:hidden;margin:2px 0 3px;'
        f'background:{css(COLLIDING)}">'
        f'<div style="height:5px;width:{percent:.2f}%;background:{css(PLAIN)}"></div></div>'
        f'<div style="{DIM};margin-bottom:6px">{percent:.4g} % of the {volume:.6g} within the '
        "limits</div>"
    )


def _numbers(drawing: WorkspaceDrawing) -> str:
    rows: list[tuple[str, str, str]] = []
    nodes, reached = drawing.nodes, drawing.reached
    if nodes is not None and reached is not None and reached.node_count is not None:
        there = f"{reached.node_count:,} of {nodes.count:,}"
        least = f"{reached.node_count * nodes.step**3:.6g}"
        rows += [
            ("Nodes", there, "Reached by free steps of the grid, of those within the limits"),
            ("Node volume", least, "Nodes reached times step³, the paper's measure"),
            ("Node step", f"{nodes.step:.4g}", "Of the grid, in design units"),
        ]
    elif nodes is not None:
        hint = "The paper's measure: grid nodes within the limits"
        if reached is not None:
            hint += "; too many to look at each step between them"
        rows += [
            ("Nodes", f"{nodes.count:,}", hint),
            ("Node volume", f"{nodes.volume:.6g}", "Nodes times step³; it overstates the volume"),
            ("Node step", f"{nodes.step:.4g}", "Of the grid, in design units"),
        ]
    if drawing.extent is not None:
        for axis, low, high in zip("xyz", *drawing.extent, strict=True):
            size = drawing.request.design.reach
            text = f"{format_number(low, size=size)} … {format_number(high, size=size)}"
            rows.append((f"Extent {axis}", text, "Of the solid, in design units"))
    volume = drawing.volume if reached is None else reached.volume
    if volume > 0.0:
        error = 100.0 * (drawing.mesh_volume / volume - 1.0)
        text = f"{error:+.2g} %".replace("-", "−")
        rows.append(("Mesh volume", text, "Of the drawn solid, against the volume above"))
    if drawing.hull_volume is not None:
        rows.append(("Hull volume", f"{drawing.hull_volume:.6g}", "Of the convex hull"))
    rows.append(("Computed in", f"{1000.0 * drawing.seconds:.0f} ms", "In the worker process"))
    cells = "".join(
        f'<tr title="{escape(hint)}"><td style="{DIM};padding:1px 8px 1px 0">{name}</td>'
        f'<td style="text-align:right">{value}</td></tr>'
        for name, value, hint in rows
    )
    return f'<table style="width:100%;border-collapse:collapse;margin:4px 0 8px">{cells}</table>'


def _pairs(reached: Reached, *, coloured: bool) -> str:
    """Return what the pairs of legs mean for the workspace, as HTML."""
    blocking = [pair for pair in reached.pairs if pair.blocked_volume > 0.0]
    if min(pair.clearance for pair in reached.pairs) > 0.0:
        word, colour = "No pair collides", WITHIN
    elif blocking:
        names = [f"{first} – {second}" for first, second in (pair.legs for pair in blocking)]
        word, colour = f"Legs {', '.join(names)} collide", BEYOND
    else:
        word, colour = "Legs touch, but block nothing", WITHIN
    swatch = (
        f'<span style="display:inline-block;width:11px;height:11px;border-radius:2px;'
        f'background:{css(COLLIDING)};margin-right:6px;vertical-align:-1px"></span>'
        if coloured and blocking
        else ""
    )
    rows = "".join(map(_pair, reached.pairs))
    radius = (
        f'<div style="{DIM};margin-top:4px">No two collide with radii larger by up to '
        f"{format_number(reached.harmless_radius)}</div>"
        if reached.harmless_radius > 0.0
        else ""
    )
    return (
        f'<div style="font-weight:600;color:{colour};margin:8px 0 2px">{swatch}{word}</div>'
        f'<table style="width:100%;border-collapse:collapse"><tr style="{DIM}"><td>legs</td>'
        f"{RIGHT}least clearance</td>{RIGHT}blocked, units³</td></tr>{rows}</table>{radius}"
    )


def _pair(pair: PairCost) -> str:
    first, second = pair.legs
    clearance = "joined" if math.isinf(pair.clearance) else format_number(pair.clearance, 3)
    blocked = format_number(pair.blocked_volume, 3) if pair.blocked_volume > 0.0 else "–"
    colour = f"color:{BEYOND};" if pair.blocked_volume > 0.0 else ""
    return (
        f'<tr style="{colour}"><td style="padding:1px 0">{first} – {second}</td>'
        f"{RIGHT}{clearance}</td>{RIGHT}{blocked}</td></tr>"
    )


def _legend(colour: str, warn_below: float) -> str:
    unit, name = (
        (warn_below, "Smallest |δ| (design units)")
        if colour == "margin"
        else (WARN_CONDITION, "1 / cond J")
    )
    bands = "".join(f'<div style="flex:1;background:{css(band)}"></div>' for band in band_colours())
    # All bands are drawn equally wide, so the values at their edges are not evenly spaced.
    share = 100.0 / len(BAND_EDGES)
    ticks = "".join(
        f'<span style="position:absolute;left:{index * share:g}%;transform:translateX('
        f'{"0" if index == 0 else "-50%"})">{BAND_EDGES[index] * unit:.2g}</span>'
        for index in (0, 2, 4, 6, 9)
    )
    return (
        f'<div style="{DIM};margin-bottom:3px">{name}</div>'
        f'<div style="display:flex;height:11px;border-radius:2px;overflow:hidden">{bands}</div>'
        f'<div style="position:relative;height:18px;font-size:11px;{DIM}">{ticks}</div>'
    )


def _note(text: str) -> str:
    return f'<div style="padding:8px 12px;{DIM}">{text}</div>'
