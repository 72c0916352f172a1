"""The folds: their sliders, and in the scene the inner leaves with an arc at each hinge.

The ends of a slider are walls of the assembly mode, where the pose is singular; its track has the
colours of the margins that its coordinate changes, the least of them, while the other five
coordinates stay. The leaves are the plane of the guide and b4, and that of a1 and the line b2b3. An
arc goes from where its fold would be 0 to where it is, with the angle beside it.
"""

from __future__ import annotations

import math
from collections.abc import Iterable
from functools import partial

import numpy as np
import viser

from explorer.app.features.feature import Services, show
from explorer.app.inputs.bindings import item
from explorer.app.inputs.controls import Controls
from explorer.app.inputs.ranges import Span, length_span
from explorer.app.scene import shapes
from explorer.app.scene.placing import Placed, ScenePart
from explorer.app.state.frame import Frame
from explorer.app.state.moves import FIRST_FOLD, HALF_TURN, set_fold
from explorer.app.state.state import State
from explorer.mechanism.folds import FOLDS
from explorer.mechanism.margins import signs_of
from explorer.mechanism.rgb import LEAVES, Rgb, css
from explorer.numerics.arrays import FloatArray
from explorer.numerics.number_text import format_decimals
from explorer.page.widgets.assigning import Updates
from explorer.singularity.colours import FAR_WARNINGS, MARGIN_COLOURS, proximity_colour

HINTS = (
    "The distance of a1 and b4. All three margins grow with it.",
    "The angle at a1 between the guide and the line a1b4. At 0 and 180° δ2 and δ3 are zero.",
    "The angle between the vector a1b4 and the platform's x. At 0 and 180° δ1 and δ2 are zero.",
    "The fold at the line b2b3. It changes δ1 alone, which is zero at both ends.",
    "The fold at the line a1b4. It changes δ2 alone, which is zero at both ends.",
    "The fold at the guide. It changes δ3 alone, which is zero at both ends.",
)
FACTORS = ((0, 2, 3), (0, 1, 2, 4), (0, 1, 5))
"""The coordinates of which each margin is the product: r itself, and the sines of the others."""

STEP = 0.1
# Levels at which the colours of a track change, just below the warning value and at it.
LEVELS = (0.0, math.nextafter(1.0, 0.0), 1.0, FAR_WARNINGS)
# Level of a track on which the pose is singular everywhere.
LEAST_LEVEL = 1e-9

OPACITY, WEDGE_OPACITY = 0.34, 0.22
# Radius of the arcs as a share of the reach.
RADIUS = 0.13
# Segments of an arc; two more lead from the hinge to its ends.
SEGMENTS = 24
# Thicknesses of arcs and of the edges of leaves, in pixels.
ARC, EDGE = 2.5, 1.5
# Shares of a fold at the ends of its arc's segments.
SHARES = np.linspace(0.0, 1.0, SEGMENTS + 1)
TRIANGLE = np.array([[0, 1, 2]])
# The triangles between the hinge, the first point, and an arc.
FAN = np.array([[0, each, each + 1] for each in range(1, SEGMENTS + 1)])


def add_fold_sliders(controls: Controls) -> None:
    """Add a slider for each of the six coordinates, visible while these are chosen."""
    for index, name in enumerate(FOLDS):
        controls.slider(
            name if index == 0 else f"{name} (°)",
            HINTS[index],
            item(lambda frame: frame.folds, index, set_fold),
            partial(fold_span, index=index),
            power=int(index == 0),
            visible=lambda state: state.view.coordinates == "folds",
            coloured=lambda frame, span, index=index: colour_stops(
                frame, index, frame.state.unit.read(span.high)
            ),
        )


def fold_span(state: State, index: int) -> Span:
    """Return the range of a coordinate of the folds in the present assembly mode."""
    if index == 0:
        return length_span(state)
    if index < FIRST_FOLD:
        return Span(0.0, HALF_TURN, STEP)
    is_positive = signs_of(state.mode)[index - FIRST_FOLD] > 0
    return Span(0.0, HALF_TURN, STEP) if is_positive else Span(-HALF_TURN, 0.0, STEP)


def colour_stops(frame: Frame, index: int, most: float) -> str:
    """Return the colours along the track of one of `FOLDS`, as stops of a CSS gradient.

    The track of r ends at `most`, in design units.
    """
    r, *angles = frame.folds
    factors = (r, *(abs(math.sin(math.radians(angle))) for angle in angles))
    # The largest value of a margin along the track: that where its own factor is r's end, or 1.
    largest = most if index == 0 else 1.0
    peak = min(
        largest * math.prod(factors[each] for each in margin if each != index)
        for margin in FACTORS
        if index in margin
    )
    peak = max(peak / frame.state.warn_below, LEAST_LEVEL)
    levels = [*(level for level in LEVELS if level < peak), peak]
    shares = [level / peak for level in levels]
    if index > 0:
        # Along half the track a sine rises to its peak.
        shares = [math.asin(share) / math.pi for share in shares]
    colours = [css(proximity_colour(level)) for level in levels]
    stops = list(zip(colours, shares, strict=True))
    if index > 0:
        stops += [(colour, 1.0 - share) for colour, share in reversed(stops[:-1])]
    return ",".join(f"{colour} {100.0 * share:.1f}%" for colour, share in stops)


class Leaves(ScenePart):
    """The two leaves, three arcs in the colours of the margins, and their angles."""

    def __init__(self, services: Services) -> None:
        scene = services.scene
        leaf, wedge = (np.zeros((3, 3)), TRIANGLE), (np.zeros((SEGMENTS + 2, 3)), FAN)
        self._leaves = [
            shapes.add_translucent(scene, f"/leaves/{index}", leaf, OPACITY, colour=colour)
            for index, colour in enumerate(LEAVES)
        ]
        self._wedges = [
            shapes.add_translucent(
                scene, f"/leaves/wedge/{index}", wedge, WEDGE_OPACITY, colour=colour
            )
            for index, colour in enumerate(MARGIN_COLOURS, start=1)
        ]
        self._edges = _add_lines(scene, "/leaves/edges", LEAVES, 3, EDGE)
        self._arcs = _add_lines(scene, "/leaves/arcs", MARGIN_COLOURS, SEGMENTS + 2, ARC)
        self._labels = [
            shapes.add_label(scene, f"/leaves/label/{index}", "", colour=colour)
            for index, colour in enumerate(MARGIN_COLOURS, start=1)
        ]

    def updates(self, placed: Placed) -> Updates:
        """Yield the updates that draw leaves and arcs of this frame."""
        state = placed.frame.state
        # They would stand among parts that are drawn apart.
        shown = state.view.leaves and not placed.is_apart
        yield from show(shown, *self._leaves, *self._wedges, self._edges, self._arcs)
        yield from show(shown and state.view.labels, *self._labels)
        if not shown:
            return
        hinges, arcs = fold_arcs(placed)
        leaves, wedges = leaf_corners(placed), np.concatenate([hinges, arcs], axis=1)
        for meshes, lines, outlines in (
            (self._leaves, self._edges, leaves),
            (self._wedges, self._arcs, wedges),
        ):
            for mesh, outline in zip(meshes, outlines, strict=True):
                yield mesh, "vertices", outline.astype(np.float32)
            sides = np.stack([outlines, np.roll(outlines, -1, axis=1)], axis=2)
            yield lines, "points", sides.reshape(-1, 2, 3).astype(np.float32)
        for index, label in enumerate(self._labels):
            name, fold = FOLDS[FIRST_FOLD + index], placed.frame.folds[FIRST_FOLD + index]
            words = f"{name} {format_decimals(fold, 0)}°"
            yield from shapes.write_label(label, words, arcs[index, SEGMENTS // 2])


def _add_lines(
    scene: viser.SceneApi, name: str, colours: Iterable[Rgb], count: int, thickness: float
) -> viser.LineSegmentsHandle:
    """Add as many line segments of each colour."""
    each = np.concatenate([shapes.of_one_colour(colour, count) for colour in colours])
    lines = shapes.add_lines(scene, name, len(each), None, thickness)
    lines.colors = each
    return lines


def leaf_corners(placed: Placed) -> FloatArray:
    """Return the corners of both leaves, shape (2, 3, 3): a1 a2 b4, and a1 with the line b2b3b4."""
    points, local = placed.points, placed.platform_points
    line = sorted(("b2", "b3", "b4"), key=lambda name: local[name][0])
    names = (("a1", "a2", "b4"), ("a1", line[0], line[-1]))
    return np.array([[points[name] for name in corners] for corners in names])


def fold_arcs(placed: Placed) -> tuple[FloatArray, FloatArray]:
    """Return the centres (3, 1, 3) of the arcs of φ1, φ2, φ3, and their points (3, n, 3).

    The arc of a fold begins where the leaf beyond the hinge would lie if the fold were 0.
    """
    r, *degrees = placed.frame.folds
    beta, epsilon, phi1, phi2, phi3 = map(math.radians, degrees)
    points = placed.points
    # Halfway to the foot of b4 on the guide, beside the carriages.
    on_guide = np.array([0.5 * placed.scale * r * math.cos(beta), 0.0, 0.0])
    hinges = (0.5 * (points["b2"] + points["b3"]), 0.5 * points["b4"], on_guide)
    # Axes along the hinge, in the leaf before it and across both, from the base on; what a fold
    # turns is turned by an angle in its leaf too.
    x, y, z = np.eye(3)
    arcs: list[FloatArray] = []
    for turn, angle, hinge in ((phi3, beta, 2), (-phi2, epsilon, 1), (-phi1, 0.0, 0)):
        along = (turn * SHARES)[:, None]
        arcs.append(hinges[hinge] + RADIUS * placed.reach * (np.cos(along) * y + np.sin(along) * z))
        y, z = math.cos(turn) * y + math.sin(turn) * z, math.cos(turn) * z - math.sin(turn) * y
        x, y = math.cos(angle) * x + math.sin(angle) * y, math.cos(angle) * y - math.sin(angle) * x
    return np.array(hinges)[:, None], np.array(arcs[::-1])
