"""Charts as SVG: two axes with round numbers, curves between them, and the course of a search."""

from __future__ import annotations

from collections.abc import Iterable, Iterator
from typing import TYPE_CHECKING, NamedTuple
from xml.etree.ElementTree import Element

import numpy as np
from numpy.typing import ArrayLike

from explorer.export.drawings.markup import circle, element, line, path_of
from explorer.export.drawings.slices import ruler
from explorer.mechanism.design import Pair
from explorer.numerics.arrays import FloatArray
from explorer.numerics.number_text import format_number, power_of_ten

if TYPE_CHECKING:
    # The charts of a path need no optimiser.
    from explorer.optimise.outcome import Curve

# Room beyond the values of an axis, as a share of their span.
ROOM = 0.07
# Largest number of iterates of a search with a point each.
MOST_POINTS = 60


class Chart(NamedTuple):
    """The ends of both axes of a chart, and its place in the drawing without their words."""

    across: Pair
    up: Pair
    left: float
    width: float
    top: float
    height: float

    def place(self, points: ArrayLike) -> FloatArray:
        """Return points (n, 2) of the chart as places in the drawing."""
        lows, highs = np.transpose([self.across, self.up])
        sides = np.array([self.width, -self.height])
        return (self.left, self.top + self.height) + sides * (points - lows) / (highs - lows)

    def axes(
        self,
        name: str,
        *,
        up_name: str = "",
        has_numbers: bool = True,
        whole: bool = False,
        powers: bool = False,
    ) -> Iterator[Element]:
        """Yield both axes, with their names unless these are "".

        The axis across may have no numbers, or whole ones; those of the other one may be exponents
        of ten.
        """
        (width, height), bottom = np.ptp([self.across, self.up], axis=1), self.top + self.height

        def across(value: float) -> str:
            return format_number(value, 5) if has_numbers else ""

        def up(value: float) -> str:
            return power_of_ten(round(value)) if powers else format_number(value, 5)

        yield ruler(
            name,
            self.across,
            self.left,
            self.width / width,
            across=bottom,
            up=False,
            whole=whole,
            grid=self.height,
            words=across,
        )
        yield ruler(up_name, self.up, bottom, self.height / height, across=self.left, up=True,
                    whole=powers, grid=self.width, words=up)  # fmt: skip

    def curve(self, points: ArrayLike, **look: str | None) -> Element:
        """Return a curve through points (n, 2) of the chart."""
        return element("path", d=path_of(self.place(points), "", decimals=1), **look)

    def level(self, value: float, class_: str) -> Element:
        """Return the line of a value on the axis that goes up."""
        return line(self.place([(end, value) for end in self.across]), class_)


def ends_of(values: Iterable[float]) -> Pair:
    """Return the ends of an axis of some values, leaving out those that are not finite."""
    finite = [float(value) for value in values if np.isfinite(value)] or [0.0]
    low, high = min(finite), max(finite)
    room = ROOM * (high - low) or 0.05 * abs(high) or 1.0
    return low - room, high + room


def search_chart(
    curve: Curve, left: float, width: float, top: float, height: float
) -> Iterator[Element]:
    """Yield the chart of a quantity of the iterates of a search, at a place in the drawing."""
    level = [] if curve.level is None else [curve.level]
    index = np.flatnonzero(np.isfinite(curve.values))
    points = np.column_stack([index, curve.values[index]])
    low, high = ends_of([*points[:, 1], *level])
    if curve.powers and len(index):
        low = float(np.floor(points[:, 1].min()))
        high = max(float(np.ceil(points[:, 1].max())), low + 1.0)
    last = float(max(1, len(curve.values) - 1))
    chart = Chart((0.0, last), (low, high), left, width, top, height)
    yield from chart.axes("iteration", whole=True, powers=curve.powers)
    for value in level:
        yield chart.level(value, "level")
    if len(index):
        yield chart.curve(points, class_="curve")
    if len(index) <= MOST_POINTS:
        for x, y in chart.place(points).tolist():
            yield circle((x, y), 2.2, "point")
