"""The sketch above the design variables: base and platform seen from above, with dimension lines.

Each of the two figures is a triangle with two corners on a horizontal axis, and has a scale of its
own. Dimensions from the axis to the third corner stand in a column at the left, dimensions along
the axis in rows: those of points on the axis on the side away from the third corner. Rows and the
column keep texts apart whatever the design.
"""

from __future__ import annotations

from collections.abc import Iterator, Mapping
from dataclasses import dataclass
from html import escape
from itertools import pairwise
from typing import Literal

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


@dataclass(frozen=True)
class Word:
    """A text of the sketch.

    Attributes:
        text: The text.
        at: Place of its anchor and of its middle, in pixels, y downwards.
        anchor: End of the text that stands there.
        variable: Design variable that it names; "" for a point or a caption.
    """

    text: str
    at: Xy
    anchor: Anchor = "middle"
    variable: str = ""

    @property
    def left(self) -> float:
        """The left end, in pixels."""
        return self.at[0] - {"start": 0.0, "middle": 0.5, "end": 1.0}[self.anchor] * self.width

    @property
    def width(self) -> float:
        """The width, in pixels, no less than it is drawn."""
        return CHARACTER * len(self.text)


@dataclass(frozen=True)
class Dimension:
    """A dimension line with its text and the lines from what it measures.

    Attributes:
        word: Its text, which names the variable.
        line: The line.
        extensions: Thin lines from the points to the ends of the line.
    """

    word: Word
    line: tuple[Xy, Xy]
    extensions: tuple[tuple[Xy, Xy], ...]


@dataclass(frozen=True)
class Figure:
    """One of the two figures, in pixels.

    Attributes:
        caption: Its name.
        triangle: Its corners.
        axis: Ends of the line through its origin.
        points: Its points.
        names: Names of the points.
        dimensions: Its dimensions.
    """

    caption: Word
    triangle: tuple[Xy, ...]
    axis: tuple[Xy, Xy]
    points: tuple[Xy, ...]
    names: tuple[Word, ...]
    dimensions: tuple[Dimension, ...]

    @property
    def words(self) -> Iterator[Word]:
        """All its texts."""
        yield self.caption
        yield from self.names
        for dimension in self.dimensions:
            yield dimension.word


def figures(design: Design) -> tuple[Figure, Figure]:
    """Return the figures of the base and of the platform."""
    base = _figure(
        ("Base", 0.0),
        on_axis={"a1": 0.0, "a2": design.reach},
        corners=("a1", "a2"),
        apex=("a3", design.a3),
        along={},
        apex_is_away=True,
    )
    platform = _figure(
        ("Platform", WIDTH - FIGURE_WIDTH),
        on_axis={"b4": 0.0, "b2": design.b2, "b3": design.b3},
        corners=("b2", "b3"),
        apex=("b1", design.b1),
        along={"b2": design.b2, "b3": design.b3},
        apex_is_away=False,
    )
    return base, platform


def sketch(design: Design) -> str:
    """Return the sketch of a design as SVG."""
    drawn = "".join(map(_drawn, figures(design)))
    return (
        f'<svg class="ex-sketch" width="{WIDTH}" height="{HEIGHT}" role="img" '
        f'aria-label="Base and platform from above, with the design variables">{drawn}</svg>'
    )


def _figure(
    caption: tuple[str, float],
    *,
    on_axis: Mapping[str, float],
    corners: tuple[str, str],
    apex: tuple[str, Xy],
    along: Mapping[str, float],
    apex_is_away: bool,
) -> Figure:
    """Return a figure.

    Args:
        caption: Its name, and its left end.
        on_axis: Its points on the axis, the origin first.
        corners: Those that are corners of the triangle.
        apex: Name and place of the third corner.
        along: Dimensions of points on the axis.
        apex_is_away: Whether the row for the third corner's x is on the side away from it.
    """
    name, (apex_x, apex_y) = apex
    title, left = caption
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
    rows = sorted(along, key=lambda each: abs(along[each]))
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
            Word(f"{name}y", (column - BESIDE, middle), "end", f"{name}y"),
            ((column, axis_y), (column, tip[1])),
            ((place(min(xs)), (column, axis_y)), (tip, (column, tip[1]))),
        )
    )
    names = _apart(
        [
            Word(each, (at[0] - BESIDE + 1.0 if each == "a1" else at[0], axis_y - up * OFF_AXIS))
            for each, at in points.items()
        ],
        left,
    )
    ends = sorted((origin[0], *(at[0] for at in points.values())))
    return Figure(
        caption=Word(title, (left, 0.5 * ROW), "start"),
        triangle=(tip, points[corners[0]], points[corners[1]]),
        axis=((ends[0], axis_y), (ends[-1], axis_y)),
        points=(*points.values(), tip),
        names=(*names, Word(name, (tip[0], tip[1] + up * OFF_AXIS))),
        dimensions=tuple(dimensions),
    )


def _along(name: str, origin: Xy, end: Xy, row_y: float, left: float) -> Dimension:
    """Return a dimension along the axis, in a row."""
    (from_x, from_y), (to_x, to_y) = origin, end
    word = Word(name, (0.5 * (from_x + to_x), row_y), "middle", name)
    if abs(to_x - from_x) < SHORTEST:
        # There is no room on the line: the text stands beside it, at the right if it fits.
        after = max(from_x, to_x) + BESIDE
        word = Word(name, (after, row_y), "start", name)
        if after + word.width > left + FIGURE_WIDTH:
            word = Word(name, (min(from_x, to_x) - BESIDE, row_y), "end", name)
    return Dimension(
        word,
        ((from_x, row_y), (to_x, row_y)),
        (((from_x, from_y), (from_x, row_y)), ((to_x, to_y), (to_x, row_y))),
    )


def _apart(names: list[Word], left: float) -> list[Word]:
    """Return names in one row, moved along it until none overlaps, in their order along it."""
    order = sorted(range(len(names)), key=lambda index: names[index].at[0])
    step = names[0].width + 2.0
    xs = [names[index].at[0] for index in order]
    for before, after in pairwise(range(len(xs))):
        xs[after] = max(xs[after], xs[before] + step)
    last = left + FIGURE_WIDTH - 0.5 * step
    for after in range(len(xs) - 1, -1, -1):
        xs[after] = min(xs[after], last)
        last = xs[after] - step
    moved = dict(zip(order, xs, strict=True))
    return [Word(word.text, (moved[i], word.at[1])) for i, word in enumerate(names)]


def _drawn(figure: Figure) -> str:
    corners = " ".join(f"{x:.1f},{y:.1f}" for x, y in figure.triangle)
    dots = "".join(f'<circle cx="{x:.1f}" cy="{y:.1f}" r="2.2"/>' for x, y in figure.points)
    return (
        f'<polygon points="{corners}"/>{_line("is-axis", *figure.axis)}{dots}'
        + "".join(map(_dimension, figure.dimensions))
        + "".join(_text(word, "is-point") for word in figure.names)
        + _text(figure.caption)
    )


def _dimension(dimension: Dimension) -> str:
    (x1, y1), (x2, y2) = dimension.line
    # Ticks across the line at its ends, at half a right angle.
    ticks = "".join(
        _line("", (x - TICK, y + TICK), (x + TICK, y - TICK)) for x, y in ((x1, y1), (x2, y2))
    )
    extensions = "".join(_line("is-thin", *each) for each in dimension.extensions)
    line = _line("", *dimension.line)
    name = dimension.word.variable
    return f'<g data-variable="{name}">{extensions}{line}{ticks}{_text(dimension.word)}</g>'


def _line(look: str, start: Xy, end: Xy) -> str:
    (x1, y1), (x2, y2) = start, end
    classes = f' class="{look}"' if look else ""
    return f'<line{classes} x1="{x1:.1f}" y1="{y1:.1f}" x2="{x2:.1f}" y2="{y2:.1f}"/>'


def _text(word: Word, look: str = "") -> str:
    x, y = word.at
    classes = f' class="{look}"' if look else ""
    return (
        f'<text{classes} x="{x:.1f}" y="{y:.1f}" text-anchor="{word.anchor}">'
        f"{escape(word.text)}</text>"
    )
