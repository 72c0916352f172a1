"""The mechanism as a figure for a paper: one SVG, in millimetres, with its labels as text.

Lines and letters have the sizes that journals ask for at the width at which the figure is printed,
85 mm for a column and 170 mm for a page, so it should not be scaled afterwards.
"""

from __future__ import annotations

import math
from collections.abc import Sequence
from xml.etree.ElementTree import tostring

from explorer.errors import InputError, NoAnswerError
from explorer.export.drawings import mechanism as drawings
from explorer.export.drawings.markup import coordinate, drawing_style, element
from explorer.export.drawings.mechanism import Projection
from explorer.measures.snapshot import Snapshot
from explorer.numerics.number_text import format_apart, format_number

COLUMN, PAGE = 85.0, 170.0
"""Widths of figures for a column and for a page, in millimetres."""
NARROWEST, WIDEST = 40.0, 400.0
# Points of paper in a millimetre, so that letters of a label are 2 mm high.
PER_MM = 4.0
# Room for labels beside the mechanism and above it, and below it for scale bar and axes, in points.
ASIDE, ABOVE, FOOT = 27.0, 20.0, 56.0
# Largest height of the mechanism as a share of the width.
MOST_HEIGHT = 0.9
# Least share of the target's distance at which the eye is from a part.
NEAREST = 0.05
FONT = "Helvetica, Arial, 'Liberation Sans', sans-serif"


def figure_svg(
    snapshot: Snapshot,
    view: Projection,
    width: float = COLUMN,
    *,
    black: bool = False,
    tetrahedra: Sequence[bool] = (True, True, True),
) -> bytes:
    """Return the mechanism from a view of any scale as an SVG file, with edges of tetrahedra.

    The width is in millimetres, within `NARROWEST` and `WIDEST`. All is black, white and grey if
    `black`. See `Projection.of_camera` for the view.

    Raises:
        InputError: The width is out of bounds.
        NoAnswerError: The eye is among the parts or behind them.
    """
    if not NARROWEST <= width <= WIDEST:
        least, most, got = format_apart((NARROWEST, WIDEST, width))
        raise InputError(
            f"a figure is {least} to {most} mm wide, {COLUMN:g} for a column and {PAGE:g} for a "
            f"page; got {got}"
        )
    points, unit_mm = drawings.points_to_show(snapshot), snapshot.design.unit_mm
    if float(view.depth(points).max()) > (1.0 - NEAREST) * view.distance:
        raise NoAnswerError("the camera is among the parts: move it away from the mechanism")
    across, has_perspective = PER_MM * width, math.isfinite(view.distance)
    frame = (ASIDE, 0.0, across - ASIDE, MOST_HEIGHT * across)
    view = view.fit(points, frame)
    heights = view.to(points)[:, 1]
    top, bottom = float(heights.min() - ABOVE), float(heights.max() + ABOVE + FOOT)
    # A length is drawn in its true size at the depth of b4 only, if there is a perspective.
    scale = view.scale / (1.0 - float(view.depth(snapshot.points.b4)) / view.distance)
    length = drawings.round_length(0.25 * across * unit_mm / scale)
    words = f"{format_number(length, 6)} mm" + (" at b4" if has_perspective else "")
    height = bottom - top
    x, y, z = snapshot.pose.position
    root = element(
        "svg",
        element("title", f"{snapshot.design.name}: flagged 4-4 parallel manipulator"),
        element("desc", f"b4 at ({x:.6g}, {y:.6g}, {z:.6g}) units of {unit_mm:g} mm"),
        element("style", drawing_style()),
        *drawings.mechanism(snapshot, view, (0.0, top, across, bottom - FOOT), tetrahedra),
        drawings.bar(4.0, bottom - 6.0, length / unit_mm * scale, words),
        drawings.axes_cross(view, across - 40.0, bottom - 16.0, flat=not has_perspective),
        xmlns="http://www.w3.org/2000/svg",
        width=f"{coordinate(width)}mm",
        height=f"{coordinate(height / PER_MM)}mm",
        viewBox=f"0 {coordinate(top)} {coordinate(across)} {coordinate(height)}",
        class_="figure black" if black else "figure",
        fill="none",
        font_family=FONT,
    )
    return tostring(root, encoding="utf-8", xml_declaration=True)
