"""The sketch above the design variables: base and platform seen from above, with dimension lines.

Each of the two figures is a triangle with two corners on a horizontal axis, and has a scale of its
own. Dimensions from the axis to the third corner stand in a column at the left, dimensions along
the axis in rows: those of points on the axis on the side away from the third corner. Rows and the
column keep texts apart whatever the design.
"""

from __future__ import annotations

from collections.abc import Mapping
from html import escape
from typing import Literal, NamedTuple

from explorer.mechanism.design import Design

Xy = tuple[float, float]
Anchor = Literal["start", "middle", "end"]

# Width of the sketch and of each figure, and height, in pixels; the sketch is not scaled, so that
# its type keeps its size.
WIDTH, FIGURE_WIDTH, HEIGHT = 290, 143, 136
# Height of a row of text, and room at both sides of the points of a figure.
ROW, LEFT, RIGHT = 14.0, 32.0, 18.0
# Room between the axis and the names of points on it, and between a point and its name.
OFF_AXIS, BESIDE = 9.0, 5.0
# Width of a character, and that of the shortest dimension line with its text on it.
CHARACTER, SHORTEST = 6.4, 28.0
# Half the length of a tick at the end of a dimension line.
TICK = 3.0


class Word(NamedTuple):
    """A text of the sketch, and the place of its anchor and of its middle, y downwards."""

    text: str
    at: Xy
    anchor: Anchor = "middle"
    look: str = ""

    @property
    def left(self) -> float:
        """The left end, in pixels."""
        return self.at[0] - {"start": 0.0, "middle": 0.5, "end": 1.0}[self.anchor] * self.width

    @property
    def width(self) -> float:
        """The width, in pixels, no less than it is drawn."""
        return CHARACTER * len(self.text)

    @property
    def markup(self) -> str:
        """The text as SVG."""
        x, y = self.at
        return (
            f'<text{_class(self.look)} x="{x:.1f}" y="{y:.1f}" text-anchor="{self.anchor}">'
            f"{escape(self.text)}</text>"
        )


class Dimension(NamedTuple):
    """A dimension line with its text, and thin lines from what it measures to its ends."""

    word: Word
    line: tuple[Xy, Xy]
    extensions: tuple[tuple[Xy, Xy], tuple[Xy, Xy]]

    @property
    def markup(self) -> str:
        """The dimension as SVG, with ticks across its ends at half a right angle."""
        ticks = "".join(_line("", (x - TICK, y + TICK), (x + TICK, y - TICK)) for x, y in self.line)
        extensions = "".join(_line("is-thin", *each) for each in self.extensions)
        return (
            f'<g data-variable="{self.word.text}">{extensions}{_line("", *self.line)}{ticks}'
            f"{self.word.markup}</g>"
        )


class Figure(NamedTuple):
    """One of the two figures, in pixels; its words are its caption and the names of points."""

    triangle: tuple[Xy, ...]
    axis: tuple[Xy, Xy]
    points: tuple[Xy, ...]
    words: tuple[Word, ...]
    dimensions: tuple[Dimension, ...]

    @property
    def markup(self) -> str:
        """The figure as SVG."""
        corners = " ".join(f"{x:.1f},{y:.1f}" for x, y in self.triangle)
        dots = "".join(f'<circle cx="{x:.1f}" cy="{y:.1f}" r="2.2"/>' for x, y in self.points)
        texts = "".join(each.markup for each in (*self.dimensions, *self.words))
        return f'<polygon points="{corners}"/>{_line("is-axis", *self.axis)}{dots}{texts}'


def _class(look: str) -> str:
    return f' class="{look}"' if look else ""


def _line(look: str, start: Xy, end: Xy) -> str:
    (x1, y1), (x2, y2) = start, end
    return f'<line{_class(look)} x1="{x1:.1f}" y1="{y1:.1f}" x2="{x2:.1f}" y2="{y2:.1f}"/>'


def figures(design: Design) -> tuple[Figure, Figure]:
    """Return the figures of the base and of the platform."""
    base = {"a1": 0.0, "a2": design.reach}
    platform = {"b4": 0.0, "b2": design.b2, "b3": design.b3}
    return (
        _figure(("Base", 0.0), base, (), ("a3", design.a3)),
        _figure(("Platform", WIDTH - FIGURE_WIDTH), platform, ("b2", "b3"), ("b1", design.b1)),
    )


def sketch(design: Design) -> str:
    """Return the sketch of a design as SVG."""
    drawn = "".join(figure.markup for figure in figures(design))
    return (
        f'<svg class="ex-sketch" width="{WIDTH}" height="{HEIGHT}" role="img" '
        f'aria-label="Base and platform from above, with the design variables">{drawn}</svg>'
    )


def _figure(
    caption: tuple[str, float],
    on_axis: Mapping[str, float],
    along: tuple[str, ...],
    apex: tuple[str, Xy],
) -> Figure:
    """Return a figure with points on an axis, the origin first, and the apex of a triangle.

    Its caption comes with its left end; the points `along` the axis have dimensions. The last two
    points on the axis are the other corners of the triangle.
    """
    name, (apex_x, apex_y) = apex
    title, left = caption
    # Without dimensions on the axis, the row for the third corner's x is on the side away from it.
    apex_is_away = not along
    xs = (*on_axis.values(), apex_x)
    # On each side of the axis there are rows: of names, and of dimensions.
    away = OFF_AXIS + ROW * (0.5 + len(along) + apex_is_away)
    beyond = OFF_AXIS + ROW * (0.5 + (not apex_is_away))
    room_x = FIGURE_WIDTH - LEFT - RIGHT
    room_y = HEIGHT - ROW - away - beyond
    scale = min(room_x / (max(xs) - min(xs)), room_y / abs(apex_y))
    up = -1.0 if apex_y > 0.0 else 1.0
    height = scale * abs(apex_y)
    spare = 0.5 * (room_y - height)
    axis_y = HEIGHT - spare - away if up < 0.0 else ROW + spare + away
    first_x = left + LEFT + 0.5 * (room_x - scale * (max(xs) - min(xs)))

    def place(x: float, y: float = 0.0) -> Xy:
        return first_x + scale * (x - min(xs)), axis_y - scale * y

    origin, tip = place(0.0), place(apex_x, apex_y)
    points = {each: place(x) for each, x in on_axis.items()}
    dimensions: list[Dimension] = []
    rows = sorted(along, key=lambda each: abs(on_axis[each]))
    for index, each in enumerate(rows):
        row_y = axis_y - up * (OFF_AXIS + ROW * (1.0 + index))
        dimensions.append(_along(each, origin, points[each], row_y, left))
    tip_row = (
        axis_y - up * (OFF_AXIS + ROW * (1.0 + len(rows)))
        if apex_is_away
        else tip[1] + up * (OFF_AXIS + ROW)
    )
    dimensions.append(_along(f"{name}x", origin, tip, tip_row, left))
    column = left + LEFT - BESIDE - 1.0
    middle = axis_y + up * max(0.5 * height, 0.5 * ROW)
    dimensions.append(
        Dimension(
            Word(f"{name}y", (column - BESIDE, middle), "end"),
            ((column, axis_y), (column, tip[1])),
            ((place(min(xs)), (column, axis_y)), (tip, (column, tip[1]))),
        )
    )
    name_y = axis_y - up * OFF_AXIS
    names = {each: at[0] - (BESIDE - 1.0) * (each == "a1") for each, at in points.items()}
    words = [Word(title, (left, 0.5 * ROW), "start")]
    words += [Word(each, (x, name_y), look="is-point") for each, x in _spread(names, left).items()]
    words.append(Word(name, (tip[0], tip[1] + up * OFF_AXIS), look="is-point"))
    ends = sorted((origin[0], *(at[0] for at in points.values())))
    return Figure(
        triangle=(tip, *list(points.values())[-2:]),
        axis=((ends[0], axis_y), (ends[-1], axis_y)),
        points=(*points.values(), tip),
        words=tuple(words),
        dimensions=tuple(dimensions),
    )


def _along(name: str, origin: Xy, end: Xy, row_y: float, left: float) -> Dimension:
    """Return a dimension along the axis, in a row."""
    (from_x, from_y), (to_x, to_y) = origin, end
    word = Word(name, (0.5 * (from_x + to_x), row_y))
    if abs(to_x - from_x) < SHORTEST:
        # There is no room on the line: the text stands beside it, at the right if it fits.
        after = max(from_x, to_x) + BESIDE
        word = Word(name, (after, row_y), "start")
        if after + word.width > left + FIGURE_WIDTH:
            word = Word(name, (min(from_x, to_x) - BESIDE, row_y), "end")
    return Dimension(
        word,
        ((from_x, row_y), (to_x, row_y)),
        (((from_x, from_y), (from_x, row_y)), ((to_x, to_y), (to_x, row_y))),
    )


def _spread(names: Mapping[str, float], left: float) -> dict[str, float]:
    """Return the places of names in one row, moved along it until none overlaps, in their order."""
    order = sorted(names, key=names.__getitem__)
    step = CHARACTER * len(order[0]) + 2.0
    xs = [names[each] for each in order]
    for after in range(1, len(xs)):
        xs[after] = max(xs[after], xs[after - 1] + step)
    last = left + FIGURE_WIDTH - 0.5 * step
    for after in reversed(range(len(xs))):
        xs[after] = min(xs[after], last)
        last = xs[after] - step
    return dict(zip(order, xs, strict=True))
