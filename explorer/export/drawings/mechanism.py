"""The mechanism as a line drawing: base, guide, four legs, platform, and the flags' colours.

Each element of the two flags has the colour of the incidence that it is part of, as in the
page: a1 and the platform that of δ1, the guide and the line b2b3 that of δ2, b4 and the base
that of δ3.
"""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from xml.etree.ElementTree import Element

import numpy as np

from explorer.export.drawings.markup import coordinate, drawing_text, element
from explorer.export.drawings.projection import Projection, ViewName, fit_view, labels
from explorer.legs.clearance import leg_axes
from explorer.measures.snapshot import Snapshot
from explorer.measures.verdict import verdict
from explorer.mechanism.configuration import Configuration
from explorer.numerics.arrays import FloatArray
from explorer.numerics.number_text import format_number
from explorer.singularity.colours import css, proximity_colour

WIDTH = 720.0
# The share of a leg that is cylinder.
CYLINDER = 0.56
# The space around the points of a view, for labels.
ROOM = 30.0
# The heights of the sheet of three views and of the first picture.
SHEET_HEIGHT, LEAD_HEIGHT = 640.0, 430.0
# The least width and height of a view's cell.
LEAST_CELL = 210.0


def points_to_show(snapshot: Snapshot) -> FloatArray:
    """Return the points that a drawing of a mechanism must show, shape (n, 3)."""
    return np.concatenate([np.array(_points(snapshot)), _guide(snapshot), _carriages(snapshot)])


def cover_drawing(snapshot: Snapshot) -> Element:
    """Return the first picture of a report."""
    frame = (2 * ROOM, ROOM, WIDTH - 4 * ROOM, LEAD_HEIGHT - 2 * ROOM)
    view = fit_view("isometric", points_to_show(snapshot), frame)
    box = (0.0, 0.0, WIDTH, LEAD_HEIGHT)
    return svg_drawing(
        LEAD_HEIGHT,
        "The mechanism, seen from above at an angle",
        element("g", *mechanism(snapshot, view, box)),
        scale_bar(view, snapshot.design.unit_mm, 4.0, LEAD_HEIGHT - 8.0),
        axes_cross(view, WIDTH - 40.0, LEAD_HEIGHT - 34.0),
    )


def three_views(snapshot: Snapshot) -> Element:
    """Return the mechanism from above, from the front and from the side, at one scale."""
    points = points_to_show(snapshot)
    wide, deep = (float(extent) for extent in np.ptp(points[:, :2], axis=0))
    high = float(np.ptp(points[:, 2]))
    least = 1e-9 * max(wide, deep, high)
    room = 2.0 * ROOM
    scale = min(
        (WIDTH - 2.0 * room - 16.0) / max(wide + deep, least),
        (SHEET_HEIGHT - 2.0 * room - 16.0) / max(deep + high, least),
    )
    left = min(max(scale * wide + room, LEAST_CELL), WIDTH - LEAST_CELL)
    upper, lower = (max(scale * extent + room + 16.0, LEAST_CELL) for extent in (deep, high))
    height = upper + lower
    cells: tuple[tuple[ViewName, str, float, float, float, float], ...] = (
        ("top", "From above", 0.0, 0.0, left, upper),
        ("front", "From the front", 0.0, upper, left, lower),
        ("side", "From the right", left, upper, WIDTH - left, lower),
    )
    views: list[Element] = []
    for name, title, x, y, width, tall in cells:
        view = fit_view(name, points, (x, y + 16.0, width, tall - 16.0), scale)
        box = (x, y + 16.0, x + width, y + tall)
        views.append(element("text", title, x=x + 8.0, y=y + 18.0, class_="title"))
        views.extend(mechanism(snapshot, view, box))
        views.append(axes_cross(view, x + 14.0, y + 62.0, flat=True))
    lines = element(
        "path",
        d=f"M0,{coordinate(upper)}H{coordinate(WIDTH)}M{coordinate(left)},0V{coordinate(height)}",
        class_="rule",
    )
    view = fit_view("front", points, (0.0, 0.0, 1.0, 1.0), scale)
    return svg_drawing(
        height,
        "The mechanism from above, from the front and from the right, at one scale",
        lines,
        *views,
        *_key(left + 24.0, 18.0),
        scale_bar(view, snapshot.design.unit_mm, left + 24.0, upper - 18.0),
    )


def svg_drawing(height: float, title: str, *pieces: Element) -> Element:
    """Return a drawing as wide as the page."""
    return element(
        "svg",
        element("title", title),
        *pieces,
        viewBox=f"0 0 {coordinate(WIDTH)} {coordinate(height)}",
        role="img",
        xmlns="http://www.w3.org/2000/svg",
    )


def mechanism(
    snapshot: Snapshot, view: Projection, box: tuple[float, float, float, float] | None
) -> Iterator[Element]:
    """Yield the elements of a mechanism, with labels within a box, or without labels if None."""
    points = snapshot.points
    legs = leg_axes(Configuration(snapshot.design, snapshot.pose.position, snapshot.rotation))
    here = verdict(snapshot)
    tints = [css(proximity_colour(level)) for level in here.levels]
    low, high = _guide(snapshot)
    yield _area(view, [low, high, points.a3], tints[2])
    yield _line(view, low, high, "rail")
    yield _line(view, low, high, "flag", stroke=tints[1])
    stations = np.array([points.b4, points.b2, points.b3])
    along = (stations - points.b4) @ snapshot.rotation[:, 0]
    ends = stations[along.argmin()], stations[along.argmax()]
    pieces: list[tuple[float, list[Element]]] = [
        (float(view.depth(leg).mean()), list(_leg(view, leg))) for leg in legs
    ]
    plate = [
        _area(view, [*ends, points.b1], tints[0], class_="platform"),
        _line(view, *ends, "flag", stroke=tints[1]),
    ]
    pieces.append((float(view.depth(np.array([*ends, points.b1])).mean()), plate))
    for _, elements in sorted(pieces, key=lambda piece: piece[0]):
        yield from elements
    for station in _carriages(snapshot):
        x, y = view.to(station).tolist()
        yield element("rect", x=x - 5.0, y=y - 5.0, width=10.0, height=10.0, class_="carriage")
    yield _dot(view, points.a1, 5.0, "joint", fill=tints[0])
    yield _dot(view, points.a3, 4.2, "joint")
    for ball in (points.b1, points.b2, points.b3):
        yield _dot(view, ball, 4.2, "ball")
    yield _dot(view, points.b4, 5.0, "ball", fill=tints[2])
    if box is not None:
        named = [(name, view.to(np.asarray(point))) for name, point in points._asdict().items()]
        named += [
            (name, view.to(station))
            for name, station in zip(("d1", "d3"), _carriages(snapshot), strict=True)
        ]
        lines = [(view.to(a), view.to(b)) for a, b in [*legs, (low, high), ends]]
        yield element("g", *labels(named, lines, box))


def scale_bar(view: Projection, unit_mm: float, x: float, y: float) -> Element:
    """Return a scale bar of a round length, labelled in design units and millimetres."""
    length = round_length(130.0 / view.scale)
    end = x + length * view.scale
    path = (
        f"M{coordinate(x)},{coordinate(y - 4.0)}v8M{coordinate(x)},{coordinate(y)}"
        f"H{coordinate(end)}m0,-4v8"
    )
    words = f"{format_number(length, 6)} units = {format_number(length * unit_mm, 6)} mm"
    return element(
        "g",
        element("path", d=path, class_="bar"),
        element("text", words, x=x, y=y - 7.0, class_="small"),
    )


def round_length(length: float) -> float:
    """Return the largest of 1, 2 and 5 times a power of ten that is not above a length."""
    power = 10.0 ** np.floor(np.log10(length))
    return float(power * max(step for step in (1.0, 2.0, 5.0) if step * power <= length))


def axes_cross(view: Projection, x: float, y: float, *, flat: bool = False) -> Element:
    """Return the axes of the base; of a flat view only those in its plane."""
    axes = element("g", class_="axes")
    for name, axis in zip("xyz", np.eye(3), strict=True):
        dx, dy = ((view.to(axis) - view.to(np.zeros(3))) / view.scale).tolist()
        if flat and np.hypot(dx, dy) < 0.5:
            continue
        end_x, end_y = x + 22.0 * dx, y + 22.0 * dy
        axes.append(element("line", x1=x, y1=y, x2=end_x, y2=end_y))
        axes.append(drawing_text(name, x + 30.0 * dx, y + 30.0 * dy + 3.5))
    return axes


def path_of(points: FloatArray) -> str:
    """Return a closed polygon (n, 2) as the data of a path."""
    return "M" + "L".join(f"{coordinate(x)},{coordinate(y)}" for x, y in points.tolist()) + "Z"


def _points(snapshot: Snapshot) -> Sequence[FloatArray]:
    return [np.asarray(point) for point in snapshot.points]


def _carriages(snapshot: Snapshot) -> FloatArray:
    """Return the positions of the carriages, shape (2, 3)."""
    return np.array([[snapshot.joints[k], 0.0, 0.0] for k in (1, 3)])


def _guide(snapshot: Snapshot) -> FloatArray:
    """Return both ends of the guide as drawn: it carries a1, a2 and the carriages, (2, 3)."""
    stations = [0.0, float(snapshot.points.a2[0]), *snapshot.joints[[1, 3]].tolist()]
    beyond = 0.04 * (max(stations) - min(stations))
    return np.array([[min(stations) - beyond, 0, 0], [max(stations) + beyond, 0, 0]])


def _leg(view: Projection, leg: FloatArray) -> Iterator[Element]:
    start, end = leg
    middle = start + CYLINDER * (end - start)
    yield _line(view, start, end, "casing")
    yield _line(view, start, middle, "casing thick")
    yield _line(view, start, end, "rod")
    yield _line(view, start, middle, "cylinder")


def _line(
    view: Projection, start: FloatArray, end: FloatArray, class_: str, stroke: str | None = None
) -> Element:
    (x1, y1), (x2, y2) = view.to(start).tolist(), view.to(end).tolist()
    return element("line", x1=x1, y1=y1, x2=x2, y2=y2, class_=class_, stroke=stroke)


def _area(
    view: Projection, corners: Sequence[FloatArray], fill: str, class_: str = "base"
) -> Element:
    return element("path", d=path_of(view.to(np.array(corners))), class_=class_, fill=fill)


def _dot(
    view: Projection, point: FloatArray, radius: float, class_: str, fill: str | None = None
) -> Element:
    x, y = view.to(np.asarray(point)).tolist()
    return element("circle", cx=x, cy=y, r=radius, class_=class_, fill=fill)


def _key(x: float, y: float) -> Iterator[Element]:
    """Yield the key to the signs of the drawings."""
    yield element("text", "Key", x=x, y=y, class_="title")
    leg = [
        element("line", x1=x, y1=0.0, x2=x + length, y2=0.0, class_=name)
        for name, length in (("rod", 18.0), ("cylinder", 10.0))
    ]
    carriage = element("rect", x=x + 4.0, y=-5.0, width=10.0, height=10.0, class_="carriage")
    joint, ball = (
        element("circle", cx=x + 9.0, cy=0.0, r=4.2, class_=name) for name in ("joint", "ball")
    )
    entries = (
        (joint, "universal joint, on the base"),
        (carriage, "carriage on the guide: d1, d3"),
        (ball, "ball joint, on the platform"),
        (element("g", *leg), "leg: cylinder and rod"),
    )
    for index, (sign, words) in enumerate(entries):
        line = y + 22.0 + 20.0 * index
        sign.set("transform", f"translate(0 {coordinate(line)})")
        yield sign
        yield element("text", words, x=x + 28.0, y=line + 4.0, class_="small")
