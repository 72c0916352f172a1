"""The mechanism as a line drawing, and the views of space on paper that drawings share.

Paper has y downwards. Each element of the two flags has the colour of the incidence that it is
part of, as in the page: a1 and the platform that of δ1, the guide and the line b2b3 that of δ2, b4
and the base that of δ3.
"""

from __future__ import annotations

import itertools
import math
from collections.abc import Iterator, Sequence
from dataclasses import dataclass, field, replace
from typing import Literal, TypeAlias
from xml.etree.ElementTree import Element

import numpy as np

from explorer.export.drawings.markup import (
    PRECISE,
    coordinate,
    drawing_text,
    element,
    line,
    path_of,
)
from explorer.legs.clearance import leg_axes
from explorer.measures.snapshot import Snapshot
from explorer.measures.verdict import verdict
from explorer.mechanism.configuration import Configuration
from explorer.mechanism.margins import TETRAHEDRA
from explorer.mechanism.rgb import css
from explorer.numerics.arrays import FloatArray
from explorer.numerics.number_text import format_number
from explorer.singularity.colours import MARGIN_COLOURS, proximity_colour

ViewName = Literal["isometric", "front", "side", "top"]
Frame: TypeAlias = tuple[float, float, float, float]
"""Left, top, right and bottom of a rectangle on paper."""

WIDTH = 720.0
# Fills of joints without an incidence.
DARK, LIGHT = "#343c48", "#ffffff"
# The share of a leg that is cylinder.
CYLINDER = 0.56
# The space around the points of a view, for labels.
ROOM = 30.0
# The heights of the sheet of three views and of the first picture.
SHEET_HEIGHT, LEAD_HEIGHT = 640.0, 430.0
# The least width and height of a view's cell.
LEAST_CELL = 210.0
# From the target towards the eye, as the page's camera.
_FROM = np.array([0.72, -1.0, 0.62])
# The size of a letter of a label, and the distances and directions at which labels are tried.
_LETTER, _HEIGHT = 6.4, 12.0
_DIRECTIONS = np.radians((45, 135, -45, -135, 90, -90, 0, 180))
_PLACES = np.array([*itertools.product((13.0, 19.0, 26.0), _DIRECTIONS)])
_ALONG = np.linspace(0.0, 1.0, 97)[:, None]


def _axes(name: ViewName) -> FloatArray:
    """Return right, up and towards the eye, in rows, shape (3, 3)."""
    x, y, z = np.eye(3)
    if name == "isometric":
        return _axes_from(_FROM)
    right, up = {"top": (x, y), "front": (x, z), "side": (y, z)}[name]
    return np.array([right, up, np.cross(right, up)])


def _axes_from(toward: FloatArray) -> FloatArray:
    """Return right, up and towards the eye, (3, 3), of an upright view not along z."""
    toward = toward / np.linalg.norm(toward)
    right = np.cross([0.0, 0.0, 1.0], toward)
    right /= np.linalg.norm(right)
    return np.array([right, np.cross(toward, right), toward])


@dataclass(frozen=True)
class Projection:
    """A view, with its scale in points of paper per design unit and its place on paper, (2,).

    Attributes:
        axes: Right, up and towards the eye, in rows, shape (3, 3).
        scale: Scale in the plane of the target.
        offset: The target on paper.
        target: Point in the middle of the view, in design units, shape (3,).
        distance: Distance of the eye from the target, in design units; infinite without
            perspective.
    """

    axes: FloatArray
    scale: float
    offset: FloatArray
    target: FloatArray = field(default_factory=lambda: np.zeros(3))
    distance: float = math.inf

    @staticmethod
    def of_camera(eye: FloatArray, target: FloatArray, *, perspective: bool) -> Projection:
        """Return the view of an upright camera at an eye, not above its target, at scale 1."""
        toward = eye - target
        axes = _axes_from(toward)
        distance = float(np.linalg.norm(toward)) if perspective else math.inf
        return Projection(axes, 1.0, np.zeros(2), target, distance)

    def to(self, points: FloatArray) -> FloatArray:
        """Return points (..., 3) on paper, shape (..., 2)."""
        local = (points - self.target) @ self.axes.T
        flat = local[..., :2] * self.scale / (1.0 - local[..., 2:] / self.distance)
        return flat * np.array([1.0, -1.0]) + self.offset

    def depth(self, points: FloatArray) -> FloatArray:
        """Return the nearness of points (..., 3) to the eye, in design units, shape (...)."""
        return np.asarray((points - self.target) @ self.axes[2])

    def side(self, normal: FloatArray, point: FloatArray) -> float:
        """Return a number with the sign of the eye's side of a plane, of normal and point (3,)."""
        ray = self.axes[2]
        if math.isfinite(self.distance):
            ray = self.target + self.distance * ray - point
        return float(normal @ ray)

    def fit(self, points: FloatArray, frame: Frame, scale: float | None = None) -> Projection:
        """Return the view in which points (n, 3) fill a frame, as `fit_view` does."""
        own = replace(self, scale=1.0, offset=np.zeros(2)).to(points)
        lows, highs = own.min(axis=0), own.max(axis=0)
        corners = np.array(frame).reshape(2, 2)
        if scale is None:
            # Points that coincide have no size to fit.
            spans = np.maximum(highs - lows, 1e-9 * float(np.abs(points).max()) or 1.0)
            scale = float((np.ptp(corners, axis=0) / spans).min())
        offset = corners.mean(axis=0) - 0.5 * scale * (lows + highs)
        return replace(self, scale=scale, offset=offset)


def extents(name: ViewName, points: FloatArray) -> tuple[FloatArray, FloatArray]:
    """Return lows and highs of points (n, 3) to the right and up in a view, each (2,)."""
    flat = points @ _axes(name)[:2].T
    return flat.min(axis=0), flat.max(axis=0)


def fit_view(
    name: ViewName, points: FloatArray, frame: Frame, scale: float | None = None
) -> Projection:
    """Return the view in which points (n, 3) fill a frame, at a scale or the largest that fits."""
    return Projection(_axes(name), 1.0, np.zeros(2)).fit(points, frame, scale)


def labels(
    names: Sequence[tuple[str, FloatArray]], lines: Sequence[FloatArray], within: Frame
) -> Iterator[Element]:
    """Yield labels of points, shape (2,), each where it covers least within a frame.

    Straight lines to keep clear are given by their ends, each of shape (2, 2).
    """
    distance, angle = _PLACES.T
    taken = [np.concatenate([point - 4.5, point + 4.5]) for _, point in names]
    covered = np.concatenate([a + _ALONG * (b - a) for a, b in lines])
    for name, point in names:
        size = np.array([_LETTER * len(name) + 4.0, _HEIGHT])
        aside = np.cos(angle) * (distance + 0.5 * size[0] - 4.0)
        middle = point + np.stack([aside, -np.sin(angle) * distance], axis=-1)
        low, high = (middle + sign * 0.5 * size for sign in (-1.0, 1.0))
        boxes, lows, highs = np.array(taken), low[:, None], high[:, None]
        common = np.minimum(highs, boxes[:, 2:]) - np.maximum(lows, boxes[:, :2])
        overlap = np.maximum(common, 0.0).prod(axis=-1).sum(axis=-1)
        inside = ((covered > lows) & (covered < highs)).all(axis=-1).sum(axis=-1)
        beyond = np.concatenate([within[:2] - low, high - within[2:], np.zeros_like(low)], axis=1)
        cost = overlap + inside + 50.0 * beyond.max(axis=1) + 1.2 * distance
        best = int(cost.argmin())
        taken.append(np.concatenate([low[best], high[best]]))
        x, y = float(middle[best, 0]), float(high[best, 1]) - 2.5
        yield drawing_text(name, x, y, "label", anchor="middle")


def points_to_show(snapshot: Snapshot) -> FloatArray:
    """Return the points that a drawing of a mechanism must show, shape (n, 3)."""
    return np.concatenate([np.array(snapshot.points), _guide(snapshot), _carriages(snapshot)])


def cover_drawing(snapshot: Snapshot) -> Element:
    """Return the first picture of a report."""
    frame = (2.0 * ROOM, ROOM, WIDTH - 2.0 * ROOM, LEAD_HEIGHT - ROOM)
    view = fit_view("isometric", points_to_show(snapshot), frame)
    return svg_drawing(
        LEAD_HEIGHT,
        "The mechanism, seen from above at an angle",
        element("g", *mechanism(snapshot, view, (0.0, 0.0, WIDTH, LEAD_HEIGHT))),
        scale_bar(view, snapshot.design.unit_mm, 4.0, LEAD_HEIGHT - 8.0),
        axes_cross(view, WIDTH - 40.0, LEAD_HEIGHT - 34.0),
    )


def three_views(snapshot: Snapshot) -> Element:
    """Return the mechanism from above, from the front and from the side, at one scale."""
    points = points_to_show(snapshot)
    wide, deep, high = np.ptp(points, axis=0).tolist()
    least = 1e-9 * max(wide, deep, high)
    room = 2.0 * ROOM
    scale = min(
        (WIDTH - 2.0 * room - 16.0) / max(wide + deep, least),
        (SHEET_HEIGHT - 2.0 * room - 16.0) / max(deep + high, least),
    )
    left = min(max(scale * wide + room, LEAST_CELL), WIDTH - LEAST_CELL)
    upper, lower = (max(scale * extent + room + 16.0, LEAST_CELL) for extent in (deep, high))
    height = upper + lower
    cells: tuple[tuple[ViewName, str, Frame], ...] = (
        ("top", "From above", (0.0, 0.0, left, upper)),
        ("front", "From the front", (0.0, upper, left, height)),
        ("side", "From the right", (left, upper, WIDTH, height)),
    )
    views: list[Element] = []
    for name, title, (x, y, right, bottom) in cells:
        box = (x, y + 16.0, right, bottom)
        view = fit_view(name, points, box, scale)
        views.append(drawing_text(title, x + 8.0, y + 18.0, "title"))
        views.extend(mechanism(snapshot, view, box))
        views.append(axes_cross(view, x + 14.0, y + 62.0, flat=True))
    rules = (((0.0, upper), (WIDTH, upper)), ((left, 0.0), (left, height)))
    view = fit_view("front", points, (0.0, 0.0, 1.0, 1.0), scale)
    return svg_drawing(
        height,
        "The mechanism from above, from the front and from the right, at one scale",
        *(line(ends, "rule") for ends in rules),
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
    snapshot: Snapshot,
    view: Projection,
    box: Frame | None,
    tetrahedra: Sequence[bool] = (False, False, False),
) -> Iterator[Element]:
    """Yield the elements of a mechanism, with labels within a box, or without labels if None."""
    points = snapshot.points
    legs = leg_axes(Configuration(snapshot.design, snapshot.pose.position, snapshot.rotation))
    tints = [css(proximity_colour(level)) for level in verdict(snapshot).levels]
    guide, carriages = _guide(snapshot), _carriages(snapshot)
    base = [
        _area(view, [*guide, points.a3], "base", tints[2]),
        line(view.to(guide), "rail"),
        line(view.to(guide), "flag", stroke=tints[1]),
    ]
    stations = np.array([points.b4, points.b2, points.b3])
    along = (stations - points.b4) @ snapshot.rotation[:, 0]
    ends = stations[[along.argmin(), along.argmax()]]
    plate = [
        _area(view, [*ends, points.b1], "platform", tints[0]),
        line(view.to(ends), "flag", stroke=tints[1]),
    ]
    edges: list[FloatArray] = []
    for index, colour in enumerate(MARGIN_COLOURS):
        if tetrahedra[index]:
            corners = view.to(np.array([getattr(points, name) for name in TETRAHEDRA[index]]))
            for pair in itertools.combinations(corners, 2):
                edges.append(np.array(pair))
                yield line(pair, f"tetrahedron is-{index + 1}", stroke=css(colour))
    pieces = [base, plate, *(_leg(view, leg) for leg in legs)]
    for index in _back_to_front(snapshot, view, legs):
        yield from pieces[index]
    for x, y in view.to(carriages).tolist():
        yield element("rect", x=x - 5.0, y=y - 5.0, width=10.0, height=10.0, class_="carriage")
    dots = [(points.a1, 5.0, "joint", tints[0]), (points.a3, 4.2, "joint", DARK)]
    dots += [(ball, 4.2, "ball", LIGHT) for ball in (points.b1, points.b2, points.b3)]
    for point, radius, look, fill in (*dots, (points.b4, 5.0, "ball", tints[2])):
        x, y = view.to(np.asarray(point)).tolist()
        yield element("circle", cx=x, cy=y, r=radius, class_=look, fill=fill)
    if box is not None:
        places = {**points._asdict(), **dict(zip(("d1", "d3"), carriages, strict=True))}
        named = [(name, view.to(np.asarray(point))) for name, point in places.items()]
        lines = [*(view.to(ends) for ends in (*legs, guide, ends)), *edges]
        yield element("g", *labels(named, lines, box))


def _back_to_front(snapshot: Snapshot, view: Projection, legs: FloatArray) -> list[int]:
    """Return the order of drawing of the base, the platform and the legs, 0 to 5.

    Legs end in the base plane and in the platform plane, so each lies on one side of either.
    """
    points, (normal, z) = snapshot.points, (snapshot.rotation[:, 2], np.array([0.0, 0.0, 1.0]))
    above = view.side(z, points.a1), view.side(normal, points.b4)
    covers = np.zeros((6, 6), dtype=np.bool_)
    covers[1, 0] = (points.b1 + points.b2 + points.b3 + points.b4)[2] * above[0] > 0.0
    covers[0, 1] = not covers[1, 0]
    for k, (start, end) in enumerate(legs, start=2):
        covers[k, 0] = end[2] * above[0] >= 0.0
        covers[k, 1] = (start - points.b4) @ normal * above[1] >= 0.0
        covers[:2, k] = ~covers[k, :2]
    for i, j in itertools.permutations(range(4), 2):
        (a, b), (c, d) = legs[i], legs[j]
        across = np.cross(b - a, d - c)
        nearer = (a - c) @ across * view.side(across, c) > 0.0
        covers[i + 2, j + 2] = nearer and _cross(view.to(legs[i]), view.to(legs[j]))
    order: list[int] = []
    left = [*range(6)]
    while left:
        # In a circle of legs, each over the next, none is farthest.
        order.append(min(left, key=lambda i: int(covers[i, left].sum())))
        left.remove(order[-1])
    return order


def _cross(first: FloatArray, second: FloatArray) -> bool:
    """Whether two segments on paper, (2, 2) each, cross."""
    return all(
        np.linalg.det([end - start, other[0] - start])
        * np.linalg.det([end - start, other[1] - start])
        < 0.0
        for (start, end), other in ((first, second), (second, first))
    )


def scale_bar(view: Projection, unit_mm: float, x: float, y: float) -> Element:
    """Return a scale bar of a round length, labelled in design units and millimetres."""
    length = round_length(130.0 / view.scale)
    words = f"{format_number(length * unit_mm, 6)} mm"
    if unit_mm != 1.0:
        words = f"{format_number(length, 6)} units = {words}"
    return bar(x, y, length * view.scale, words)


def bar(x: float, y: float, length: float, words: str) -> Element:
    """Return a bar of a length on paper from (x, y) to the right, with words above it."""
    path = (
        f"M{coordinate(x)},{coordinate(y - 4.0)}v8M{coordinate(x)},{coordinate(y)}"
        f"h{coordinate(length, PRECISE)}m0,-4v8"
    )
    return element("g", element("path", d=path, class_="bar"), drawing_text(words, x, y - 7.0))


def round_length(length: float) -> float:
    """Return the largest of 1, 2 and 5 times a power of ten that is not above a length."""
    power = 10.0 ** math.floor(math.log10(length))
    return max(step * power for step in (1.0, 2.0, 5.0) if step * power <= length)


def axes_cross(view: Projection, x: float, y: float, *, flat: bool = False) -> Element:
    """Return the axes of the base; of a flat view only those in its plane."""
    axes = element("g", class_="axes")
    for name, (right, up) in zip("xyz", view.axes[:2].T.tolist(), strict=True):
        if not flat or math.hypot(right, up) >= 0.5:
            axes.append(line(((x, y), (x + 22.0 * right, y - 22.0 * up))))
            at = x + 30.0 * right, y - 30.0 * up + 3.5
            axes.append(drawing_text(name, *at, anchor="middle"))
    return axes


def _carriages(snapshot: Snapshot) -> FloatArray:
    """Return the positions of the carriages, shape (2, 3)."""
    return np.array([[snapshot.joints[k], 0.0, 0.0] for k in (1, 3)])


def _guide(snapshot: Snapshot) -> FloatArray:
    """Return both ends of the guide as drawn: it carries a1, a2 and the carriages, (2, 3)."""
    stations = [0.0, float(snapshot.points.a2[0]), *snapshot.joints[[1, 3]].tolist()]
    beyond = 0.04 * (max(stations) - min(stations))
    return np.array([[min(stations) - beyond, 0, 0], [max(stations) + beyond, 0, 0]])


def _leg(view: Projection, leg: FloatArray) -> list[Element]:
    ends = view.to(leg)
    cylinder = view.to(np.array([leg[0], leg[0] + CYLINDER * (leg[1] - leg[0])]))
    looks = {"casing": ends, "casing thick": cylinder, "rod": ends, "cylinder": cylinder}
    return [line(points, look) for look, points in looks.items()]


def _area(view: Projection, corners: Sequence[FloatArray], class_: str, fill: str) -> Element:
    data = path_of(view.to(np.array(corners)), decimals=PRECISE)
    return element("path", d=data, class_=class_, fill=fill)


def _key(x: float, y: float) -> Iterator[Element]:
    yield drawing_text("Key", x, y, "title")
    leg = (
        line(((x, 0.0), (x + length, 0.0)), name)
        for name, length in (("rod", 18.0), ("cylinder", 10.0))
    )
    joint, ball = (
        element("circle", cx=x + 9.0, cy=0.0, r=4.2, class_=name, fill=fill)
        for name, fill in (("joint", DARK), ("ball", LIGHT))
    )
    carriage = element("rect", x=x + 4.0, y=-5.0, width=10.0, height=10.0, class_="carriage")
    entries = (
        (joint, "universal joint, on the base"),
        (carriage, "carriage on the guide: d1, d3"),
        (ball, "ball joint, on the platform"),
        (element("g", *leg), "leg: cylinder and rod"),
    )
    for index, (sign, words) in enumerate(entries):
        level = y + 22.0 + 20.0 * index
        sign.set("transform", f"translate(0 {coordinate(level)})")
        yield sign
        yield drawing_text(words, x + 28.0, level + 4.0)
