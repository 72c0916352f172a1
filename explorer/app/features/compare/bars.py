"""Designs side by side as bars from zero, in a drawing for each of some measures."""

from __future__ import annotations

from collections.abc import Sequence
from html import escape

from explorer.app.features.compare.columns import (
    Column,
    best_of,
    hint_of,
    size_of,
    unit_of,
    value_text,
)
from explorer.app.widgets.colours import css
from explorer.measures.catalogue import CATALOGUE, Measure

DRAWN = (
    "volume",
    "volume_per_leg",
    "node_volume",
    "reach",
    "exact_extent_x",
    "exact_extent_y",
    "exact_extent_z",
    "least_clearance",
    "least_margin",
    "mean_margin",
    "home_margin",
    "mean_inverse_condition",
)
"""The measures that are drawn, row by row."""

LOADS = ("home_load_share", "home_largest_payload", "home_largest_bending", "held_volume")
"""The measures of a further row, each drawn if a design has what it needs."""

# Number of drawings in a row.
ACROSS = 4
# Sizes in pixels: a drawing's width, heights of its title, a bar and the gap below it; widths of a
# letter and a number; the space below a drawing.
WIDTH, TITLE, BAR, GAP = 148.0, 17.0, 11.0, 3.0
LETTER, NUMBER, SPACE = 24.0, 52.0, 9.0


def bars(columns: Sequence[Column], *, millimetres: bool) -> str:
    """Return the bars as an SVG.

    Args:
        columns: Columns of the comparison, the live design first.
        millimetres: Whether lengths are in millimetres, rather than in design units.
    """
    loads = [name for name in LOADS if any(column.has(CATALOGUE[name]) for column in columns)]
    drawn = (*DRAWN, *loads)
    height = TITLE + len(columns) * (BAR + GAP) + SPACE
    drawings = "".join(
        f'<g transform="translate({(index % ACROSS) * WIDTH:g},{(index // ACROSS) * height:g})">'
        f"{_drawing(CATALOGUE[name], columns, millimetres=millimetres)}</g>"
        for index, name in enumerate(drawn)
    )
    rows = -(-len(drawn) // ACROSS)
    return (
        f'<svg viewBox="0 0 {ACROSS * WIDTH:g} {rows * height:g}" width="100%" '
        'class="ex-bars" role="img" '
        f'aria-label="Measures of the designs as bars">{drawings}</svg>'
    )


def _drawing(measure: Measure, columns: Sequence[Column], *, millimetres: bool) -> str:
    values = [column.value(measure) for column in columns]
    known = [value for value in values if value is not None]
    low, high = min([0.0, *known]), max([0.0, *known])
    longest = WIDTH - LETTER - NUMBER - 8.0
    scale = longest / (high - low) if high > low else 0.0
    zero = LETTER - low * scale
    best, size = best_of(measure, values), size_of(values)
    unit = unit_of(measure, millimetres=millimetres)
    arrow = {"more": " ↑", "less": " ↓", None: ""}[measure.sense]
    title = (
        f"<title>{escape(hint_of(measure))}</title>"
        f'<text x="0" y="11" font-weight="600">{escape(_short_label(measure))}'
        f'<tspan font-weight="400" fill-opacity="0.6"> {unit}{arrow}</tspan></text>'
    )
    parts = [title]
    for index, (column, value) in enumerate(zip(columns, values, strict=True)):
        y = TITLE + index * (BAR + GAP)
        baseline = y + BAR - 2.0
        parts.append(f'<text x="0" y="{baseline:g}" fill-opacity="0.6">{column.letter}</text>')
        if value is None:
            parts.append(f'<text x="{zero + 4.0:.1f}" y="{baseline:g}" fill-opacity="0.6">–</text>')
            continue
        start, end = sorted((zero, zero + value * scale))
        weight = 700 if index in best else 400
        parts.append(
            f'<rect x="{start:.2f}" y="{y:g}" width="{max(end - start, 0.8):.2f}" '
            f'height="{BAR:g}" rx="1.5" fill="{css(column.colour)}"/>'
            f'<text x="{end + 4.0:.1f}" y="{baseline:g}" font-weight="{weight}">'
            f"{value_text(measure, value, size)}</text>"
        )
    return "".join(parts)


def _short_label(measure: Measure) -> str:
    """Return the label without how it was measured, which only the hint has room to say."""
    label = measure.label.removesuffix(" at nodes")
    return label.removesuffix(" at home") if measure.name in LOADS else label
