"""The tetrahedra of the trilaterations, and the gaps that are left to the three incidences.

A pose is singular where one of the tetrahedra is flat. The edges of each have the colour of its
margin and dashes of their own; faces are filled for the incidence that is near, in the colour of
its danger. Gaps are dashes between the two flags, with δ and the length beside them. Where an
incidence holds, a ring with a ball in the colour of singular poses marks the contact.
"""

from __future__ import annotations

import functools
import itertools
from collections.abc import Iterator
from dataclasses import dataclass

import numpy as np

from explorer.app.features.feature import Services
from explorer.app.features.mechanism.incidences import (
    Approach,
    approaches,
    margin_hover,
)
from explorer.app.scene.placing import NO_POINTS, Placed, ScenePart
from explorer.app.scene.shapes import (
    TETRAHEDRON_FACES,
    Balls,
    Instances,
    Mesh,
    add_label,
    add_lines,
    add_translucent,
    dashes,
    join_meshes,
    linear_colour,
    of_one_colour,
    sphere,
    torus,
    turned_to,
)
from explorer.app.widgets.assigning import Update
from explorer.mechanism.margins import TETRAHEDRA
from explorer.numerics.arrays import FloatArray
from explorer.numerics.number_text import format_fitted
from explorer.singularity.colours import (
    MARGIN_COLOURS,
    OUTLINE,
    SINGULAR,
    WARNED,
    Rgb,
    proximity_colour,
)

EDGES = np.array(list(itertools.combinations(range(4), 2)))
OPACITY = 0.26


# Share by which a tetrahedron is drawn smaller about its centroid, so that edges that two of them
# share lie beside each other.
INSET = 0.04
# Pixels by which the edges of the filled tetrahedron are thicker, and thickness of one that fails.
FILLED_EDGE, FAILING_EDGE = 1.0, 5.0

# Most dashes of one gap, their period in scene units, and the share that is drawn.
DASHES, PERIOD, DRAWN = 32, 0.32, 0.6
# Thickness of the dashes in pixels, when they fade in and in full.
THIN, THICK = 1.0, 3.0
FOOT_RADIUS = 0.13
RING_RADIUS, RING_TUBE, CONTACT_RADIUS = 0.85, 0.09, 0.42
# Ends of gaps that have no mark of their own, as margin and end: a1 and b4 have one.
FEET = ((0, 1), (1, 0), (1, 1), (2, 0))


@dataclass(frozen=True)
class Stroke:
    """How the edges of a tetrahedron are drawn.

    Attributes:
        most: Most dashes of an edge.
        period: Length of a dash with the space after it, in scene units.
        drawn: Share of the dash in it.
        thickness: Thickness in pixels.
    """

    most: int
    period: float
    drawn: float
    thickness: float


# Solid, dashed and dotted, as the lines of the margins in charts; what has gaps is thicker.
STROKES = (Stroke(1, 1.0, 1.0, 1.8), Stroke(16, 0.9, 0.64, 2.4), Stroke(30, 0.5, 0.36, 3.0))


class Tetrahedra(ScenePart):
    """The edges of three tetrahedra with their names, and the faces of the nearest one.

    One that the present lengths cannot close has thick edges in the colour of an alarm.
    """

    def __init__(self, services: Services) -> None:
        scene, self._hovered = services.scene, services.get(margin_hover)
        flat = np.zeros((4, 3)), TETRAHEDRON_FACES
        self._faces = add_translucent(scene, "/tetrahedra/faces", flat, OPACITY, is_flat=True)
        self._edges = [
            add_lines(
                scene, f"/tetrahedra/{index}/edges", len(EDGES) * each.most, None, each.thickness
            )
            for index, each in enumerate(STROKES, start=1)
        ]
        self._names = [
            add_label(scene, f"/tetrahedra/{index}/name", f"δ{index}", colour=colour, visible=False)
            for index, colour in enumerate(MARGIN_COLOURS, start=1)
        ]

    def updates(self, placed: Placed) -> Iterator[Update]:
        """Yield the updates that draw the tetrahedra of this frame."""
        state = placed.frame.state
        failing = state.unclosed.failing if state.unclosed else ()
        each = approaches(placed, self._hovered.row)
        is_filled = False
        for index, approach in enumerate(each):
            corners = np.array([placed.points[name] for name in TETRAHEDRA[index]])
            centre = corners.mean(axis=0)
            shown, fails = approach.is_shown, index in failing
            inner = corners + INSET * (centre - corners)
            yield from self._draw_edges(index, inner, approach, shown=shown, fails=fails)
            is_named = shown and not approach.has_label and state.view.labels
            yield self._names[index], "visible", is_named
            yield self._names[index], "position", tuple(centre.tolist())
            if shown and approach.is_filled:
                is_filled = True
                yield self._faces, "vertices", inner.astype(np.float32)
                yield self._faces, "color", proximity_colour(approach.level)
                yield self._faces, "opacity", OPACITY * approach.presence
        yield self._faces, "visible", is_filled

    def _draw_edges(
        self, index: int, corners: FloatArray, approach: Approach, *, shown: bool, fails: bool
    ) -> Iterator[Update]:
        edges, stroke = self._edges[index], STROKES[index]
        segments = dashes(corners[EDGES], stroke.most, stroke.period, stroke.drawn)
        yield edges, "visible", shown or fails
        yield edges, "points", segments.astype(np.float32)
        colour = OUTLINE if fails else MARGIN_COLOURS[index]
        yield edges, "colors", of_one_colour(colour, len(segments))
        thickness = stroke.thickness + FILLED_EDGE * approach.presence * approach.is_filled
        yield edges, "thickness", FAILING_EDGE if fails else thickness


class Gaps(ScenePart):
    """The gaps that are near, each with its ends and its label, and the contacts."""

    def __init__(self, services: Services) -> None:
        scene, self._hovered = services.scene, services.get(margin_hover)
        self._dashes = add_lines(scene, "/gaps/dashes", 3 * DASHES, None, THICK)
        self._feet = Balls(scene, "/gaps/feet", [WARNED] * len(FEET))
        self._contacts = Instances(
            scene, "/gaps/contacts", _contact_mark(), [linear_colour(SINGULAR)] * 3
        )
        self._labels = [
            add_label(scene, f"/gaps/label/{index}", f"δ{index}", fades=False, visible=False)
            for index in (1, 2, 3)
        ]

    def updates(self, placed: Placed) -> Iterator[Update]:
        """Yield the updates that draw the gaps of this frame."""
        shown = visible_gaps(placed, self._hovered.row)
        ends = {i: each.ends for i, each in shown.items() if each.ends is not None}
        closed = {i: each for i, each in ends.items() if shown[i].is_touching}
        gaps = {i: each for i, each in ends.items() if i not in closed}
        yield self._dashes, "visible", bool(gaps)
        yield from self._feet.show(bool(gaps))
        yield from self._contacts.show(bool(closed))
        for index, label in enumerate(self._labels):
            yield label, "visible", index in shown and shown[index].has_label
        for index, each in shown.items():
            corners = [placed.points[name] for name in TETRAHEDRA[index]]
            at = np.mean(corners if each.ends is None else each.ends, axis=0)
            yield self._labels[index], "text", gap_text(placed, index, each)
            yield self._labels[index], "position", tuple(at.tolist())
        if gaps:
            yield from self._draw_gaps(gaps, shown)
        if closed:
            yield from self._draw_contacts(placed, closed)

    def corners(self, placed: Placed) -> FloatArray:
        """Return the ends of the gaps to incidences that are below their warning value."""
        shown = visible_gaps(placed, None).values()
        ends = [each.ends for each in shown if each.ends is not None and each.level < 1.0]
        return np.concatenate(ends) if ends else NO_POINTS

    def _draw_gaps(
        self, gaps: dict[int, FloatArray], shown: dict[int, Approach]
    ) -> Iterator[Update]:
        ends, feet = np.zeros((3, 2, 3)), np.full(len(FEET), 1e-6)
        colours: list[Rgb] = [WARNED] * 3
        for index, gap in gaps.items():
            ends[index], colours[index] = gap, proximity_colour(shown[index].level)
        for foot, (index, _) in enumerate(FEET):
            if index in gaps:
                feet[foot] = FOOT_RADIUS * shown[index].presence
        presence = max(shown[index].presence for index in gaps)
        yield self._dashes, "points", dashes(ends, DASHES, PERIOD, DRAWN).astype(np.float32)
        yield self._dashes, "colors", np.concatenate([of_one_colour(c, DASHES) for c in colours])
        yield self._dashes, "thickness", THIN + (THICK - THIN) * presence
        yield from self._feet.at(np.array([ends[foot] for foot in FEET]), feet)
        yield from self._feet.colour([linear_colour(colours[index]) for index, _ in FEET])

    def _draw_contacts(self, placed: Placed, closed: dict[int, FloatArray]) -> Iterator[Update]:
        positions, scales = np.zeros((3, 3)), np.full((3, 3), 1e-6)
        for index, ends in closed.items():
            positions[index], scales[index] = ends.mean(axis=0), 1.0
        rotation = placed.frame.snapshot.rotation
        # The mark lies in the plane in which the contact is.
        normals = np.array([rotation[:, 2], [0.0, -rotation[2, 0], rotation[1, 0]], [0, 0, 1.0]])
        yield from self._contacts.place(positions, turned_to(normals), scales)


def visible_gaps(placed: Placed, hovered: int | None) -> dict[int, Approach]:
    """Return the incidences whose gaps are shown, by the index of their margin.

    Args:
        placed: The frame that is drawn.
        hovered: Number 1 to 3 of the margin on whose row a pointer rests, if any.
    """
    return {
        index: each
        for index, each in enumerate(approaches(placed, hovered))
        if each.has_gap and each.is_shown
    }


def gap_text(placed: Placed, index: int, approach: Approach) -> str:
    """Return the text beside a gap, such as "δ1 −0.42 · 4.2 mm"."""
    snapshot = placed.frame.snapshot
    reach, unit_mm = snapshot.design.reach, snapshot.design.unit_mm
    if approach.level == 0.0:
        return f"δ{index + 1} = 0{'' if approach.is_touching else ', lines parallel'}"
    margin = format_fitted(float(snapshot.margins[index]), reach, 4)
    length = format_fitted(snapshot.gaps.lengths[index] * unit_mm, reach * unit_mm, 4)
    return f"δ{index + 1} {margin} · {length} mm"


@functools.cache
def _contact_mark() -> Mesh:
    """Return a ring about the z-axis with a ball in its middle."""
    vertices, faces = sphere()
    return join_meshes((CONTACT_RADIUS * vertices, faces), torus(RING_RADIUS, RING_TUBE))
