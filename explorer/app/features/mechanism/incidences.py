"""How near each incidence is: tetrahedra of the trilaterations, gaps between the flags, contacts.

An incidence is shown from twice its warning value on, and fully at the warning value and below:
first the lines and planes of the flags reach out, and once they have arrived the gap between them
is drawn, with δ and its length. The row of its margin shows it too, while a pointer rests there.

A pose is singular where one of the tetrahedra is flat. The edges of each have the colour of its
margin. That of the verdict is clear, and its faces are filled if it is near; the other two are
quiet: thinner and paler. A ring with a ball marks where an incidence holds.
"""

from __future__ import annotations

import itertools
from dataclasses import dataclass
from typing import NamedTuple

import numpy as np
import viser

from explorer.app.features.feature import Services, show
from explorer.app.scene import shapes
from explorer.app.scene.placing import NO_POINTS, Placed, ScenePart
from explorer.mechanism import rgb
from explorer.mechanism.margins import TETRAHEDRA
from explorer.mechanism.rgb import Rgb, mix
from explorer.numerics.arrays import FloatArray
from explorer.numerics.number_text import format_fitted
from explorer.page.widgets.assigning import Updates
from explorer.singularity import colours
from explorer.singularity.ellipsoids import planes_of_singularity

HOVER = "margins.hover"
# Level, in warning values, from which on an incidence fades in.
FADE_FROM = 2.0
# Presence at which lines and planes have reached the ends of the gap.
ARRIVED = 0.5
# Farthest that an end of a gap may be from its flag's point, and the longest gap, in reaches.
FARTHEST = 2.0
# Length of a gap, as a share of the reach, up to which its ends are one point to the eye.
CLOSED = 1e-6

EDGES = np.array(list(itertools.combinations(range(4), 2)))
OPACITY = 0.26
# Share by which a tetrahedron is drawn smaller about its centroid, so that edges that two of them
# share lie beside each other.
INSET = 0.04
# Pixels by which the edges of the filled tetrahedron are thicker, and thickness of one that fails.
FILLED_EDGE, FAILING_EDGE = 1.0, 5.0
# Share of the thickness that is left to quiet edges, and of a grey in the colour of these and of
# the name, which is between light pages and dark ones.
QUIET, PALE = 0.6, 0.35
GREY: Rgb = (160, 164, 170)

# Most dashes of one gap, their period in scene units, and the share that is drawn.
DASHES, PERIOD, DRAWN = 32, 0.32, 0.6
# Thickness of the dashes in pixels, when they fade in and in full.
THIN, THICK = 1.0, 3.0
FOOT_RADIUS = 0.13
RING_RADIUS, RING_TUBE, CONTACT_RADIUS = 0.85, 0.09, 0.42
# Ends of gaps that have no mark of their own, as margin and end: a1 and b4 have one.
FEET = ((0, 1), (1, 0), (1, 1), (2, 0))


class Stroke(NamedTuple):
    """Dashes of an edge: most of them, their period in scene units, share drawn, and pixels."""

    most: int
    period: float
    drawn: float
    thickness: float


# Solid, dashed and dotted, as the lines of the margins in charts; what has gaps is thicker.
STROKES = (Stroke(1, 1.0, 1.0, 1.8), Stroke(16, 0.9, 0.64, 2.4), Stroke(30, 0.5, 0.36, 3.0))


class HoveredRow:
    """The number of the row of a table on which a pointer rests; None if there is none.

    Buttons and rows report the pointer under a name, see `press_button`. The number is no part of
    the state: it is neither saved nor undone.
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


def margin_hover(services: Services) -> HoveredRow:
    """Make the record of the margin, 1 to 3, on whose row a pointer rests."""
    return HoveredRow(services, HOVER, range(1, 4))


@dataclass(frozen=True)
class Approach:
    """How near one incidence is, by its level, see `explorer.measures.verdict`.

    Its presence is 0 where it is far, 1 at the warning value and below. The nearest is that of the
    row that is pointed at, otherwise that of the verdict. It touches where it holds and its gap is
    closed; parallel lines leave one. The ends of the gap (2, 3), on the base flag and on the
    platform flag in the scene, are None if they are too far away to be drawn.
    """

    level: float
    presence: float
    is_shown: bool
    is_nearest: bool
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
        return self.has_gap and (self.is_nearest or self.level < 1.0)


def approaches(placed: Placed, hovered: int | None) -> tuple[Approach, Approach, Approach]:
    """Return how near the three incidences are; the margin that is hovered is 1 to 3, or None."""
    verdict, snapshot = placed.frame.verdict, placed.frame.snapshot
    nearest = hovered or verdict.incidences[0]
    gaps, reach = snapshot.gaps, snapshot.design.reach
    ends = placed.scale * np.stack([gaps.base, gaps.platform], axis=1)
    ways = np.stack([gaps.base, gaps.platform - snapshot.points.b4, gaps.platform - gaps.base])
    farthest = np.abs(ways).max(axis=(0, 2)).tolist()

    def approach(index: int) -> Approach:
        level, is_hovered = verdict.levels[index], index + 1 == hovered
        is_on = placed.frame.state.view.tetrahedra[index] or is_hovered
        presence = min(1.0, max(0.0, (FADE_FROM - level) / (FADE_FROM - 1.0)))
        return Approach(
            level,
            1.0 if is_hovered else presence,
            # Like the flags, it would stand among parts that are drawn apart.
            is_on and not placed.is_apart,
            index + 1 == nearest,
            level == 0.0 and gaps.lengths[index] <= CLOSED * reach,
            ends[index] if farthest[index] <= FARTHEST * reach else None,
        )

    return approach(0), approach(1), approach(2)


class Tetrahedra(ScenePart):
    """The edges of three tetrahedra with their names, and the faces of the nearest one.

    One that the present lengths cannot close has thick edges in the colour of an alarm.
    """

    def __init__(self, services: Services) -> None:
        scene, self._hovered = services.scene, services.get(margin_hover)
        flat = np.zeros((4, 3)), shapes.TETRAHEDRON_FACES
        self._faces = shapes.add_translucent(
            scene, "/tetrahedra/faces", flat, OPACITY, is_flat=True
        )
        self._edges = [
            shapes.add_lines(
                scene, f"/tetrahedra/{index}/edges", len(EDGES) * each.most, None, each.thickness
            )
            for index, each in enumerate(STROKES, start=1)
        ]
        self._names = [
            shapes.add_label(scene, f"/tetrahedra/{index}/name", f"δ{index}", colour=colour)
            for index, colour in enumerate(colours.MARGIN_COLOURS, start=1)
        ]

    def updates(self, placed: Placed) -> Updates:
        """Yield the updates that draw the tetrahedra of this frame."""
        state = placed.frame.state
        failing = state.unclosed.failing if state.unclosed else ()
        filled = False
        for index, approach in enumerate(approaches(placed, self._hovered.row)):
            corners = np.array([placed.points[name] for name in TETRAHEDRA[index]])
            centre = corners.mean(axis=0)
            inner = corners + INSET * (centre - corners)
            colour, share = colours.MARGIN_COLOURS[index], 0.0 if approach.is_nearest else PALE
            tone = mix(colour, GREY, share)
            yield from self._draw_edges(index, inner, approach, tone, fails=index in failing)
            is_named = approach.is_shown and not approach.has_label and state.view.labels
            yield self._names[index], "visible", is_named
            yield self._names[index], "font_scene_height", shapes.label_height(tone)
            yield self._names[index], "position", tuple(centre.tolist())
            if approach.is_shown and approach.is_nearest and approach.presence > 0.0:
                filled = True
                yield self._faces, "vertices", inner.astype(np.float32)
                yield self._faces, "color", colours.proximity_colour(approach.level)
                yield self._faces, "opacity", OPACITY * approach.presence
        yield self._faces, "visible", filled

    def _draw_edges(
        self, index: int, corners: FloatArray, approach: Approach, colour: Rgb, *, fails: bool
    ) -> Updates:
        edges, stroke = self._edges[index], STROKES[index]
        segments = shapes.dashes(corners[EDGES], stroke.most, stroke.period, stroke.drawn)
        yield edges, "visible", approach.is_shown or fails
        yield edges, "points", segments.astype(np.float32)
        drawn = rgb.OUTLINE if fails else colour
        yield edges, "colors", shapes.of_one_colour(drawn, len(segments))
        thickness = stroke.thickness * (1.0 if approach.is_nearest else QUIET)
        thickness += FILLED_EDGE * approach.presence * approach.is_nearest
        yield edges, "thickness", FAILING_EDGE if fails else thickness


class Gaps(ScenePart):
    """The gaps that are near, each with its ends and its label, and the contacts."""

    def __init__(self, services: Services) -> None:
        scene, self._hovered = services.scene, services.get(margin_hover)
        self._dashes = shapes.add_lines(scene, "/gaps/dashes", 3 * DASHES, None, THICK)
        self._feet = shapes.Balls(scene, "/gaps/feet", [colours.WARNED] * len(FEET))
        vertices, faces = shapes.sphere()
        ring = shapes.torus(RING_RADIUS, RING_TUBE)
        mark = shapes.join_meshes((CONTACT_RADIUS * vertices, faces), ring)
        contacts = [shapes.linear_colour(colours.SINGULAR)] * 3
        self._contacts = shapes.Instances(scene, "/gaps/contacts", mark, contacts)
        self._labels = [
            shapes.add_label(scene, f"/gaps/label/{index}", "", fades=False) for index in (1, 2, 3)
        ]

    def updates(self, placed: Placed) -> Updates:
        """Yield the updates that draw the gaps of this frame."""
        shown = visible_gaps(placed, self._hovered.row)
        ends = {i: each.ends for i, each in shown.items() if each.ends is not None}
        closed = {i: each for i, each in ends.items() if shown[i].is_touching}
        gaps = {i: each for i, each in ends.items() if i not in closed}
        yield from show(bool(gaps), self._dashes, self._feet)
        yield from self._contacts.show(bool(closed))
        for index, label in enumerate(self._labels):
            yield label, "visible", index in shown and shown[index].has_label
        for index, each in shown.items():
            corners = [placed.points[name] for name in TETRAHEDRA[index]]
            at = np.mean(corners if each.ends is None else each.ends, axis=0)
            text = gap_text(placed, index, each)
            yield from shapes.write_label(self._labels[index], text, at)
        if gaps:
            yield from self._draw_gaps(gaps, shown)
        if closed:
            yield from self._draw_contacts(placed, closed)

    def corners(self, placed: Placed) -> FloatArray:
        """Return the ends of the gaps to incidences that are below their warning value."""
        shown = visible_gaps(placed, None).values()
        ends = [each.ends for each in shown if each.ends is not None and each.level < 1.0]
        return np.concatenate(ends) if ends else NO_POINTS

    def _draw_gaps(self, gaps: dict[int, FloatArray], shown: dict[int, Approach]) -> Updates:
        ends, feet = np.zeros((3, 2, 3)), np.full(len(FEET), 1e-6)
        drawn = [colours.WARNED] * 3
        for index, gap in gaps.items():
            ends[index], drawn[index] = gap, colours.proximity_colour(shown[index].level)
        for foot, (index, _) in enumerate(FEET):
            if index in gaps:
                feet[foot] = FOOT_RADIUS * shown[index].presence
        presence = max(shown[index].presence for index in gaps)
        segments = shapes.dashes(ends, DASHES, PERIOD, DRAWN)
        each = [shapes.of_one_colour(colour, DASHES) for colour in drawn]
        yield self._dashes, "points", segments.astype(np.float32)
        yield self._dashes, "colors", np.concatenate(each)
        yield self._dashes, "thickness", THIN + (THICK - THIN) * presence
        yield from self._feet.at(np.array([ends[foot] for foot in FEET]), feet)
        yield from self._feet.colour([shapes.linear_colour(drawn[index]) for index, _ in FEET])

    def _draw_contacts(self, placed: Placed, closed: dict[int, FloatArray]) -> Updates:
        positions, scales = np.zeros((3, 3)), np.full((3, 3), 1e-6)
        for index, ends in closed.items():
            positions[index], scales[index] = ends.mean(axis=0), 1.0
        # The mark lies in the plane in which the contact is.
        normals = planes_of_singularity(placed.frame.snapshot.rotation)
        yield from self._contacts.place(positions, shapes.turn_z_to(normals), scales)


def visible_gaps(placed: Placed, hovered: int | None) -> dict[int, Approach]:
    """Return the incidences whose gaps are shown, by the index of their margin."""
    each = enumerate(approaches(placed, hovered))
    return {index: one for index, one in each if one.has_gap and one.is_shown}


def gap_text(placed: Placed, index: int, approach: Approach) -> str:
    """Return the text beside a gap, such as "δ1 −4.2 · 4.2 mm"."""
    snapshot, unit = placed.frame.snapshot, placed.frame.state.unit
    reach = unit.factor * snapshot.design.reach
    if approach.level == 0.0:
        return f"δ{index + 1} = 0{'' if approach.is_touching else ', lines parallel'}"
    margin, gap = float(snapshot.margins[index]), snapshot.gaps.lengths[index]
    margin, gap = (format_fitted(unit.factor * each, reach, 4) for each in (margin, gap))
    return f"δ{index + 1} {margin} · {gap} {unit.name}"
