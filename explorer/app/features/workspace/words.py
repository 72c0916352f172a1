"""The workspace in words: its volume, its numbers in detail, and the legend of its colours."""

from __future__ import annotations

import numpy as np

from explorer.app.features.feature import html_of, problem, progress
from explorer.app.features.workspace import work
from explorer.app.features.workspace.feeds import orientation_suffix, orientation_word
from explorer.app.scene.surfaces import AT_LIMIT, COLLIDING, PLAIN, Measure
from explorer.app.session.feed import Feed
from explorer.app.state.frame import Frame
from explorer.app.state.state import State
from explorer.app.widgets import markup
from explorer.app.widgets.blocks import content_of
from explorer.app.widgets.buttons import MANUAL, press_button
from explorer.export.drawings.slices import NOT_ACCESSIBLE, NOT_ACCESSIBLE_OPACITY
from explorer.measures.blocks.block import UTILISATION_EDGES, Fact, Facts
from explorer.measures.blocks.clearances import workspace_clearances
from explorer.measures.position_bands import (
    MEASURE_WORDS,
    STEP_COLOURS,
    UTILISATION_COLOURS,
    PositionMeasure,
)
from explorer.mechanism.design_file import PRESETS
from explorer.mechanism.pose import Triple
from explorer.mechanism.rgb import css
from explorer.numerics.number_text import Unit, format_number
from explorer.singularity.colours import BAND_EDGES, band_colours
from explorer.statics.reactions import has_limits

CLAIM = "claims.md#The designs of Table 1 have the printed extents and a volume of 7992."
"""The place in the manual that explains the paper's volume of its optimum."""
PAPER_COUNT = 7992.0
"""The volume of the paper's optimum, in cubed design units."""


def volume_headline(frame: Frame, feed: Feed[work.Selection, work.MeasuredVolume]) -> str:
    """Return the volume within the limits in large type as HTML."""

    def words(newest: work.MeasuredVolume) -> str:
        measured, design = newest.measured, newest.request.design
        if measured.volume <= 0.0:
            causes = ", ".join(measured.empty_because)
            return markup.alert("The workspace is empty", f"Emptied by: {causes}.")
        unit = frame.state.unit_of(3)
        where = f"Within the limits, in the {orientation_word(frame)} orientation"
        of_tool = ", of the tool" if frame.state.view.at == "tool" else ""
        hint = f"Exact but for ± {unit.text(measured.error, 1)}"
        return (
            f'<div class="ex-large" title="{hint}">{volume_text(newest, frame.state.unit)}</div>'
            + markup.caption(f"{where}{of_tool}")
            + (_paper_words(unit) if design == PRESETS["paper-optimal"] else "")
        )

    return html_of(feed, words, "The volume could not be computed")


def _paper_words(unit: Unit) -> str:
    """Return the paper's statement on the volume of its optimum, as HTML."""
    why = press_button(MANUAL, CLAIM, "why", class_name="ex-link")
    counted = unit.text(PAPER_COUNT)
    return f"<div>{markup.dim(f'The paper counts {counted} by nodes of a grid: {why}')}</div>"


def drawing_words(frame: Frame, feed: Feed[work.WorkspaceRequest, work.WorkspaceDrawing]) -> str:
    """Return why nothing is drawn, or the volume of the part that is drawn, as HTML; "" for none.

    While that part is computed, its progress is told.
    """
    if feed.problem is not None:
        return problem(feed, "The workspace could not be drawn", "Compute the workspace")
    region, drawing = frame.state.view.workspace.region, feed.drawing
    if region == "limits" or feed.request is None:
        return ""
    waiting = "" if feed.is_current else progress(feed)
    part = None if drawing is None or drawing.request.region != region else drawing.part
    if drawing is None or part is None:
        # If nothing is in the region, the alert of the panel tells the trouble.
        return markup.dim(waiting.capitalize())
    if drawing.volume <= 0.0:
        return ""
    percent = 100.0 * part.volume / drawing.volume
    is_accessible = region == "accessible"
    does, rest = ("accessible", COLLIDING) if is_accessible else ("hold the load", AT_LIMIT)
    words = (
        f'<div class="ex-line"><span>{frame.state.unit_of(3).text(part.volume, 6)} {does}, '
        f"{format_number(percent, 4)} %</span>{markup.dim(waiting)}</div>"
        f"{markup.meter(percent, PLAIN, rest)}"
    )
    if not is_accessible:
        unlimited = "The design has no limits of forces, so that it holds any load."
        has_any = has_limits(frame.state.design)
        words += markup.caption(f"{load_words(frame.state)}." if has_any else unlimited)
    return words


def nothing_words(drawing: work.WorkspaceDrawing) -> str:
    """Return that the region of a drawing is empty, without a full stop."""
    if drawing.request.region == "held":
        return "No position holds the load"
    which = "home" if drawing.request.start is None else "present"
    return f"Nothing is accessible from the {which} position"


def load_words(state: State, *, any_direction: bool = True) -> str:
    """Return the loads on the platform over the workspace in words, without a full stop.

    The payload's force counts if it may have `any_direction`.
    """
    forces, payload = state.view.forces, state.design.payload

    def vector(numbers: Triple, unit: str) -> str:
        return f"({', '.join(format_number(number, 4) for number in numbers)}) {unit}"

    parts = [f"{vector(forces.force, 'N')} at the tool"] if any(forces.force) else []
    if any(forces.moment):
        parts.append(vector(forces.moment, "N m"))
    if forces.weighed != "none" and payload.mass_kg:
        parts.append(f"{format_number(payload.mass_kg, 4)} kg of payload")
    if any_direction and payload.force_n:
        parts.append(f"{format_number(payload.force_n, 4)} N in any direction")
    words = f"Load: {', '.join(parts) or 'none; the tab Loads sets it'}"
    if forces.weighed == "payload and legs":
        words += "; platform and legs count as weightless"
    return words


def volume_text(drawing: work.MeasuredVolume | None, unit: Unit) -> str:
    """Return a volume in a unit of lengths, "empty", or "–" before the first one."""
    if drawing is None:
        return "–"
    if drawing.measured.volume <= 0.0:
        return "empty"
    size = drawing.request.design.reach**3
    return unit.to_power(3, size).text(drawing.measured.volume, size=size)


def workspace_details(
    frame: Frame, feed: Feed[work.WorkspaceRequest, work.WorkspaceDrawing]
) -> str:
    """Return the numbers of the drawn workspace as HTML."""
    drawing = feed.drawing
    if drawing is None:
        return markup.note("Show the solid or the hull to see its numbers.")
    part, parts = drawing.part, list[str]()
    if drawing.mesh_agrees is False:
        why = "The workspace is too thin for its triangles: their volume is not the exact one."
        parts.append(markup.alert("The solid is not quite the workspace", why))
    parts.append(_numbers(drawing, frame.state))
    if part is not None and part.pairs and drawing.volume > 0.0:
        clearances = workspace_clearances(part.pairs, drawing.request.design, frame.state.unit)
        parts += [content_of(block, {}) for block in clearances]
        is_coloured = frame.state.view.workspace.colour == "plain"
        if is_coloured and any(pair.blocked_volume > 0.0 for pair in part.pairs):
            parts.append(f'<div class="ex-dim">{markup.swatch(COLLIDING)}legs collide</div>')
    return markup.box(*parts)


def _numbers(drawing: work.WorkspaceDrawing, state: State) -> str:
    """Return the table of nodes, extent and volumes."""
    nodes, part, request = drawing.nodes, drawing.part, drawing.request
    unit, cubic = state.unit, state.unit_of(3)
    suffix = orientation_suffix(request.design, request.rotation)
    facts: list[Fact] = []

    def add(name: str, value: str, hint: str) -> None:
        facts.append(Fact(name + suffix, value, hint=hint))

    if nodes is not None:
        count, volume, which = format_number(nodes.count), nodes.volume, "Node"
        hint = "The paper's measure: grid nodes within the limits"
        volume_hint = "Nodes times step³; it overstates the volume"
        if part is not None and part.node_count is not None:
            count = f"{format_number(part.node_count)} of {count}"
            volume, which = part.node_count * nodes.step**3, "Accessible node"
            hint = "Nodes that collision-free steps of the grid lead to, of all within the limits"
            volume_hint = "Accessible nodes times step³, the paper's measure"
        elif part is not None and part.pairs:
            hint += "; too many to check each step between them"
        add(f"{which}s", count, hint)
        add(f"{which} volume", cubic.text(volume, 6), volume_hint)
        add("Node step", unit.text(nodes.step), "Step of the grid")
    if drawing.extent is not None:
        size = request.design.reach
        ends = np.array(drawing.extent) + state.offset(request.rotation)
        name = "Extent" if state.view.at == "b4" else "Extent of the tool"
        for axis, low, high in zip("xyz", *ends.tolist(), strict=True):
            text = f"{unit.number(low, size=size)} … {unit.text(high, size=size)}"
            add(f"{name} {axis}", text, "Extent of the workspace")
    if drawing.hull_volume is not None:
        add("Hull volume", cubic.text(drawing.hull_volume, 6), "Volume of the convex hull")
    return content_of(Facts("", facts), {})


def legend(
    measure: PositionMeasure, warn_below: float, drawing: work.WorkspaceDrawing | None, unit: Unit
) -> str:
    """Return the bands of colours with the values at their edges, and the colours of the map.

    Margins and conditions raise a warning below a value; other levels are those of the drawing.
    """
    if measure in MEASURE_WORDS:
        words, symbol, factor = MEASURE_WORDS[measure]
        name = f"{words.capitalize()} ({symbol})"
        colours = UTILISATION_COLOURS if measure == "share" else STEP_COLOURS
        levels: tuple[float, ...] = UTILISATION_EDGES if measure == "share" else ()
        if measure != "share" and drawing is not None and drawing.request.colour == measure:
            levels = drawing.levels[:0:-1]
        texts = ("0", *(format_number(factor * level, 3) for level in levels), "∞")
        # The ends of bands, and the infinity of singular planes.
        marked = dict(enumerate(texts))
    else:
        name, factor = "1 / cond J", 1.0
        if measure == "margin":
            name, factor = f"Smallest |δ| ({unit.name})", unit.factor
        colours = band_colours()
        # All bands are drawn equally wide, so the values at their edges are not evenly spaced.
        warn = factor * warn_below
        marked = {k: format_number(BAND_EDGES[k] * warn, 2) for k in (0, 2, 4, 6, 9)}
    width = 100.0 / len(colours)
    stops = ",".join(f"{css(band)} 0 {width * k:g}%" for k, band in enumerate(colours, 1))
    edges = [(100.0 * k / len(colours), text) for k, text in marked.items()]
    marks = ""
    if drawing is not None and drawing.slice_map is not None:
        if any(drawing.request.design.limits.leg_radii):
            marks += f"<span>{markup.swatch(COLLIDING)}legs collide</span>"
        if drawing.part is not None:
            faint = f"--opacity:{NOT_ACCESSIBLE_OPACITY:g}"
            left_out = "not held" if drawing.request.region == "held" else "not accessible"
            mark = f'<span class="ex-faint" style="{faint}">{markup.swatch(NOT_ACCESSIBLE)}</span>'
            marks += f"<span>{mark}{left_out}</span>"
    return markup.box(
        f'<div class="ex-line"><span class="ex-dim">{name}</span>'
        f'<span class="ex-flow ex-dim">{marks}</span></div>'
        f'<div class="ex-legend" style="--colours:{stops}"></div>{markup.ticks(*edges)}'
    )


def missing_input(measure: Measure) -> str:
    """Return a hint on the missing input that makes a measure zero over the whole workspace."""
    force, bending = MEASURE_WORDS["force"][0], MEASURE_WORDS["bending"][0]
    words = f"The design has no limits of forces: colour by the {force} or the {bending}."
    if measure == "error":
        words = "The actuators of the design have no errors: state them in the tab Machine."
    elif measure == "deflection":
        lacking = "the stiffness of its actuators or the tubes of its struts"
        words = f"The design is rigid: state {lacking} in the tab Machine."
    return markup.note(words)
