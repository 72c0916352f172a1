"""How near each incidence is, as the scene shows it, and the flags of base and platform.

An incidence is shown from twice its warning value on, and fully at the warning value and below:
first the lines and planes of the flags reach out, and once they have arrived the gap between them
is drawn. The row of its margin shows it too, while a pointer rests there.

A flag is a point, a line through it and a plane through the line. Each element has the colour of
its incidence: a1 and the platform plane that of δ1, the two lines that of δ2, b4 and the base plane
that of δ3. Lines and planes are drawn as far as the mechanism goes; where an incidence is near they
reach out to its gap.
"""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import dataclass
from typing import NamedTuple

import numpy as np
import viser

from explorer.app.features.feature import Services
from explorer.app.features.mechanism.bodies import guide_span
from explorer.app.scene.placing import NO_POINTS, Placed, ScenePart
from explorer.app.scene.shapes import Patch, cylinder, sphere, turned_to
from explorer.app.widgets.assigning import Update
from explorer.numerics.arrays import FloatArray
from explorer.singularity.colours import proximity_colour

HOVER = "margins.hover"
# Level, in warning values, from which on an incidence fades in.
FADE_FROM = 2.0
# Presence at which lines and planes have reached the ends of the gap.
ARRIVED = 0.5
# Farthest that an end of a gap may be from its flag's point, and the longest gap, in reaches.
FARTHEST = 2.0
# Length of a gap, as a share of the reach, up to which its ends are one point to the eye.
CLOSED = 1e-6

POINT_RADIUS = 0.36
LINE_RADIUS = 0.075
PLANE_OPACITY = 0.2
# How far lines and planes go on beyond the end of a gap, as a share of the reach.
BEYOND = 0.06
# Ends of a gap.
BASE, PLATFORM = 0, 1
ALONG_X = turned_to(np.array([[1.0, 0.0, 0.0]]))[0]


class HoveredRow:
    """The row of a table on which a pointer rests.

    It is no part of the state: it is neither saved nor undone.

    Args:
        services: What the page offers.
        name: Name under which buttons and rows report the pointer, see `press_button`.
        rows: Numbers of the rows.

    Attributes:
        row: Number of the row; None if there is none.
    """

    def __init__(self, services: Services, name: str, rows: range) -> None:
        self.row: int | None = None
        self._session = services.session
        self._client: int | None = None
        services.buttons.on(name, self._hover, values={"", *map(str, rows)})
        services.server.on_client_disconnect(self._forget)

    def _hover(self, value: str, client: viser.ClientHandle) -> None:
        self._client = client.client_id
        self._show(int(value) if value else None)

    def _forget(self, client: viser.ClientHandle) -> None:
        # A browser that is closed does not report that the pointer has left.
        if client.client_id == self._client:
            self._show(None)

    def _show(self, row: int | None) -> None:
        if row != self.row:
            self.row = row
            self._session.redraw()


@dataclass(frozen=True)
class Approach:
    """How near one incidence is.

    Attributes:
        level: Its level, see `explorer.measures.verdict`.
        presence: How much of it is shown: 0 where it is far, 1 at the warning value and below.
        is_shown: Whether its tetrahedron and its gap are shown at all.
        is_filled: Whether its tetrahedron is filled: that of the row that is pointed at, otherwise
            the nearest one, once it fades in.
        is_touching: Whether the incidence holds and its gap is closed; parallel lines leave one.
        ends: Ends of its gap on the base flag and on the platform flag, in the scene, shape (2, 3);
            None if they are too far away to be drawn.
    """

    level: float
    presence: float
    is_shown: bool
    is_filled: bool
    is_touching: bool
    ends: FloatArray | None

    @property
    def arrival(self) -> float:
        """The share of the way to the ends of the gap that lines and planes have reached out."""
        return min(1.0, self.presence / ARRIVED)

    @property
    def has_gap(self) -> bool:
        """Whether the gap is shown."""
        return self.presence >= ARRIVED

    @property
    def has_label(self) -> bool:
        """Whether the gap has a label, in place of the name of the tetrahedron."""
        return self.has_gap and (self.is_filled or self.level < 1.0)


def margin_hover(services: Services) -> HoveredRow:
    """Make the record of the margin, 1 to 3, on whose row a pointer rests."""
    return HoveredRow(services, HOVER, range(1, 4))


def approaches(placed: Placed, hovered: int | None) -> tuple[Approach, Approach, Approach]:
    """Return how near the three incidences are.

    Args:
        placed: The frame that is drawn.
        hovered: Number 1 to 3 of the margin on whose row a pointer rests, if any.
    """
    levels, snapshot = placed.frame.verdict.levels, placed.frame.snapshot
    nearest = min(range(3), key=levels.__getitem__)
    if hovered is not None:
        filled = hovered - 1
    else:
        filled = nearest if levels[nearest] < FADE_FROM else None
    gaps, reach = snapshot.gaps, snapshot.design.reach
    ends = placed.scale * np.stack([gaps.base, gaps.platform], axis=1)
    ways = np.stack([gaps.base, gaps.platform - snapshot.points.b4, gaps.platform - gaps.base])
    farthest = np.abs(ways).max(axis=(0, 2)).tolist()

    def approach(index: int) -> Approach:
        level, is_hovered = levels[index], index + 1 == hovered
        is_on = placed.frame.state.view.tetrahedra[index] or is_hovered
        faded_in = min(1.0, max(0.0, (FADE_FROM - level) / (FADE_FROM - 1.0)))
        return Approach(
            level,
            1.0 if is_hovered else faded_in,
            # Like the flags, it would stand among parts that are drawn apart.
            is_on and not placed.is_apart,
            index == filled,
            level == 0.0 and gaps.lengths[index] <= CLOSED * reach,
            ends[index] if farthest[index] <= FARTHEST * reach else None,
        )

    return approach(0), approach(1), approach(2)


class Extent(NamedTuple):
    """The part of a plane that is drawn, in its flag's frame; the line is part of the x-axis."""

    low: float
    high: float
    bottom: float
    top: float

    @property
    def corners(self) -> FloatArray:
        """The corners, shape (4, 3)."""
        low, high, bottom, top = self
        return np.array([[low, bottom, 0], [high, bottom, 0], [high, top, 0], [low, top, 0]], float)

    def towards(self, point: FloatArray, share: float, beyond: float) -> Extent:
        """Return the extent grown by a share of the way to one with a point (3,) in it."""
        x, y, _ = point.tolist()
        grown = (
            min(self.low, x - beyond),
            max(self.high, x + beyond),
            min(self.bottom, y - beyond),
            max(self.top, y + beyond),
        )
        return Extent(*(a + share * (b - a) for a, b in zip(self, grown, strict=True)))


class Flag:
    """One flag in its own frame: the point at the origin, the line along x."""

    def __init__(self, scene: viser.SceneApi, root: str, deltas: tuple[int, int, int]) -> None:
        # Indices of the margins that colour the point, the line and the plane.
        self._deltas = deltas
        self._point = scene.add_mesh_simple(f"{root}/flag/point", *sphere(), scale=POINT_RADIUS)
        self._line = scene.add_mesh_simple(f"{root}/flag/line", *cylinder(), wxyz=ALONG_X)
        self._patch = Patch(scene, f"{root}/flag", opacity=PLANE_OPACITY)

    def updates(self, placed: Placed, line: Extent, plane: Extent, size: float) -> Iterator[Update]:
        """Yield the updates that draw the flag.

        Args:
            placed: The frame that is drawn.
            line: Extent whose ends along x are those of the line.
            plane: Extent of the plane.
            size: Scale of thicknesses.
        """
        levels = placed.frame.verdict.levels
        point_colour, line_colour, plane_colour = (
            proximity_colour(levels[index]) for index in self._deltas
        )
        visible = _are_visible(placed)
        for handle in (self._point, self._line):
            yield handle, "visible", visible
        yield from self._patch.show(visible)
        yield self._point, "color", point_colour
        yield self._point, "scale", POINT_RADIUS * size
        yield self._line, "color", line_colour
        yield self._line, "position", (line.low, 0.0, 0.0)
        yield self._line, "scale", (LINE_RADIUS * size, LINE_RADIUS * size, line.high - line.low)
        yield from self._patch.span(plane.corners, plane_colour)


class Flags(ScenePart):
    """The base's flag and the platform's."""

    def __init__(self, services: Services) -> None:
        scene, self._hovered = services.scene, services.get(margin_hover)
        self._base = Flag(scene, "/base", deltas=(0, 1, 2))
        self._platform = Flag(scene, "/platform", deltas=(2, 1, 0))

    def updates(self, placed: Placed) -> Iterator[Update]:
        """Yield the updates that draw the flags of this frame."""
        beyond = BEYOND * placed.reach
        to_platform_plane, of_lines, to_base_plane = approaches(placed, self._hovered.row)

        def grown(extent: Extent, approach: Approach, end: int) -> Extent:
            if approach.ends is None:
                return extent
            point = approach.ends[end]
            if end == PLATFORM:
                point = (point - placed.points["b4"]) @ placed.frame.snapshot.rotation
            return extent.towards(point, approach.arrival, beyond)

        base, platform = _base_extent(placed), _platform_extent(placed)
        yield from self._base.updates(
            placed, grown(base, of_lines, BASE), grown(base, to_base_plane, BASE), 1.0
        )
        yield from self._platform.updates(
            placed,
            grown(platform, of_lines, PLATFORM),
            grown(platform, to_platform_plane, PLATFORM),
            max(0.6, placed.thickness),
        )

    def corners(self, placed: Placed) -> FloatArray:
        """Return the corners of both planes where no incidence is near."""
        if not _are_visible(placed):
            return NO_POINTS
        rotation = placed.frame.snapshot.rotation
        platform = placed.points["b4"] + _platform_extent(placed).corners @ rotation.T
        return np.concatenate([_base_extent(placed).corners, platform])


def _are_visible(placed: Placed) -> bool:
    # They would stand among parts that are drawn apart.
    return placed.frame.state.view.flags and not placed.is_apart


def _base_extent(placed: Placed) -> Extent:
    low, high = guide_span(placed)
    return _between(low - 1.0, high + 1.0, 1.2 * float(placed.points["a3"][1]))


def _platform_extent(placed: Placed) -> Extent:
    local = placed.platform_points
    stations = [float(local[name][0]) for name in ("b1", "b2", "b3", "b4")]
    beyond = 0.16 * placed.reach
    side = float(local["b1"][1])
    edge = side + float(np.copysign(0.5 * beyond, side))
    return _between(min(stations) - beyond, max(stations) + beyond, edge)


def _between(low: float, high: float, y: float) -> Extent:
    """Return the extent between the x-axis and a line at y."""
    return Extent(low, high, min(0.0, y), max(0.0, y))
