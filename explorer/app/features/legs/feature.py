"""Clearances of the legs in the pose and in the last move, and the effect of their radii."""

from __future__ import annotations

import itertools

import numpy as np

from explorer.app.features.feature import Feature, InBar, Services, Tab, show, show_html
from explorer.app.features.workspace.feeds import workspace_rows, workspace_start
from explorer.app.features.workspace.work import Selection, Trouble, draw_radius_curve
from explorer.app.inputs.controls import Controls
from explorer.app.scene.placing import Placed, ScenePart
from explorer.app.scene.shapes import (
    SWEPT,
    TETRAHEDRON_FACES,
    add_label,
    add_lines,
    add_translucent,
    write_label,
)
from explorer.app.session.feed import Feed, FeedOf
from explorer.app.state.frame import Frame
from explorer.app.widgets import charts
from explorer.app.widgets.blocks import render
from explorer.app.widgets.buttons import figure
from explorer.app.widgets.markup import alert, box, dim, row, sentence, swatch, table
from explorer.app.widgets.under_way import UnderWay, problem, progress
from explorer.legs.clearance import PAIRS, legs_of, pair_name
from explorer.legs.interference import swept_tetrahedra
from explorer.measures.blocks.block import Statement
from explorer.measures.blocks.clearances import move_clearances, pose_clearances
from explorer.measures.blocks.source import pose_source
from explorer.mechanism.configuration import Configuration
from explorer.mechanism.design import Design
from explorer.mechanism.rgb import OUTLINE, Rgb
from explorer.numerics.arrays import FloatArray
from explorer.numerics.number_text import Unit, format_number
from explorer.page.widgets.assigning import Updates
from explorer.workspace.accessible.radii import RadiusCurve, with_radius

# Share of the volume without radii; the largest radius that keeps it is marked.
SHARE = 0.99
# End of the chart, as a multiple of the last radius of the curve and of the largest marked one.
BEYOND_LAST, BEYOND_PRESENT = 1.15, 1.05
HEIGHT = 190
MARKS = (
    ("present radius", charts.ORANGE, 10),
    ("99 % accessible up to", charts.TEAL, 8),
    ("no loss up to", charts.VIOLET, 8),
)
"""Name, colour and size of each mark on the curve."""


def _request_for(frame: Frame) -> Selection | None:
    if not frame.state.view.radius_curve:
        return None
    thin = with_radius(frame.state.design, 0.0)
    return Selection(thin, workspace_rows(frame), "accessible", workspace_start(frame))


RADIUS_FEED = FeedOf(draw_radius_curve, _request_for, has_stages=True)
"""The feed of the accessible volume over the radius of the legs, while it is shown."""


class ClearancePanel:
    """The table of clearances, that of the last move, and the radius curve."""

    def __init__(self, services: Services) -> None:
        gui = services.gui
        self._copy = services.copy_button(
            "Workspace › Clearance",
            lambda state: pose_source("interference", state.design, state.pose),
        )
        self._controls = controls = Controls(services)
        with gui.add_folder("Clearance"):
            self._pose = gui.add_html("")
            controls.checkbox(
                "Swept tetrahedra",
                "Draw the tetrahedra that the legs swept in the last move, and compare the paper's "
                "test for interference with the exact one.",
                "view.swept",
            )
            self._move = gui.add_html("", visible=False)
            controls.checkbox(
                "Volume against leg radius",
                "Draw the accessible volume over one radius of all four legs, for the orientation "
                "and the start above.",
                "view.radius_curve",
            )
            self._chart = charts.add_chart(
                gui,
                (charts.line("volume", charts.BLUE), *(charts.dots(*mark) for mark in MARKS)),
                (
                    charts.axis("radius of all four legs", label_size=20, size=28),
                    charts.axis("accessible volume", label_size=18, size=46),
                ),
                height=HEIGHT,
                padding=(8, 14, 0, 0),
            )
            self._words = gui.add_html("", visible=False)
            self._feed = services.get(RADIUS_FEED)
            self._under_way = UnderWay(services, "curve", self._feed)

    def updates(self, frame: Frame) -> Updates:
        """Yield the updates that make the panel show the frame."""
        view, drawing = frame.state.view, self._feed.drawing
        yield (
            self._pose,
            "content",
            render(pose_clearances(frame.snapshot, frame.state.unit), corner=self._copy),
        )
        yield from self._controls.updates(frame)
        yield from show_html(self._move, move_table(frame) if view.swept else "")
        yield from self._under_way.updates()
        words = radius_words(frame, self._feed) if view.radius_curve else ""
        yield from show_html(self._words, words)
        curve = drawing if view.radius_curve and isinstance(drawing, RadiusCurve) else None
        has_chart = curve is not None and float(curve.radii[-1]) > 0.0
        yield self._chart, "visible", has_chart
        if curve is not None and has_chart:
            unit, cubic = frame.state.unit, frame.state.unit_of(3)
            radii, *volumes = chart_columns(curve, common_radius(frame.state.design))
            columns = unit.factor * radii, *(cubic.factor * each for each in volumes)
            across = {"time": False, "range": (0.0, float(columns[0][-1]))}
            up = {"range": (0.0, 1.08 * cubic.factor * float(curve.volumes[0]))}
            yield self._chart, "scales", {"x": across, "y": up}
            yield self._chart, "data", columns


def move_table(frame: Frame) -> str:
    """Return the last move by both tests, the paper's and the exact one, as HTML."""
    move = frame.last_move
    if move is None:
        words = "No move yet. Move the platform: a drag without a pause is one move."
        return render([Statement("", words)])
    return render(move_clearances(move, frame.state.design, frame.state.unit))


def common_radius(design: Design) -> float | None:
    """Return the radius of all four legs, None if they differ."""
    radii = set(design.limits.leg_radii)
    return radii.pop() if len(radii) == 1 else None


def marked_radii(curve: RadiusCurve, radius: float | None) -> tuple[float | None, ...]:
    """Return the radii of `MARKS` on a curve; that of all legs may be None."""
    return radius, curve.radius_at(SHARE), curve.harmless


def volume_at(curve: RadiusCurve, radius: float | FloatArray) -> FloatArray:
    """Return the accessible volumes at radii (...); 0 beyond the last radius of the curve."""
    # The last radius comes twice; its second volume is the drop to 0.
    return np.asarray(np.interp(radius, curve.radii[:-1], curve.volumes[:-1], right=0.0))


def chart_columns(curve: RadiusCurve, radius: float | None) -> tuple[FloatArray, ...]:
    """Return the columns of the chart: radii, volumes, and the three marks."""
    marks = marked_radii(curve, radius)
    marked = [mark for mark in marks if mark is not None]
    last = float(curve.radii[-1])
    end = max(BEYOND_LAST * last, BEYOND_PRESENT * max(marked))
    x = np.unique([*curve.radii, *marked, end])
    drop = int(np.searchsorted(x, last)) + 1
    x, y = np.insert(x, drop, last), np.insert(volume_at(curve, x), drop, 0.0)
    columns = np.full((len(marks), len(x)), np.nan)
    for column, mark in zip(columns, marks, strict=True):
        if mark is not None:
            at = np.searchsorted(x, mark)
            column[at] = y[at]
    return x, y, *columns


def radius_words(frame: Frame, feed: Feed[Selection, RadiusCurve | Trouble]) -> str:
    """Return the numbers below the chart, or why there is no chart, as HTML."""
    if feed.problem is not None:
        return problem(feed, "The curve could not be drawn", "Compute the curve")
    curve = feed.drawing
    if curve is None:
        return box(dim(progress(feed).capitalize()))
    note = "" if feed.is_current else f' <span class="ex-dim ex-small">{progress(feed)}</span>'
    if not isinstance(curve, RadiusCurve):
        return alert("Nothing is accessible, even without radii", sentence(curve.reason)) + note
    if float(curve.volumes[0]) <= 0.0:
        return box(dim(f"The workspace is empty.{note}"))
    design, unit = frame.state.design, frame.state.unit
    radii = marked_radii(curve, common_radius(design))
    rows = (
        _row(name, colour, radius, curve, unit)
        for (name, colour, _), radius in zip(MARKS, radii, strict=True)
    )
    return box(
        f'<div class="ex-line"><b>Accessible volume ({frame.state.unit_of(3).name}) over the '
        f"radius ({unit.name})</b>{note}</div>",
        table(rows),
        f'<div class="ex-dim ex-after">{first_collision(curve, design.reach, unit)}</div>',
    )


def first_collision(curve: RadiusCurve, reach: float, unit: Unit) -> str:
    """Return a sentence on the legs that collide first as their radii grow, and where."""
    least = curve.least
    closest = float(least.clearance.min())
    if not np.isfinite(closest):
        return "No two legs can meet."
    first = np.flatnonzero(least.clearance <= closest).tolist()
    meetings = "; ".join(
        f"legs {PAIRS[pair][0]} and {PAIRS[pair][1]} at {_position(least.position[pair], unit)}"
        for pair in first
    )
    if closest > 0.0:
        return f"First collision within the limits: {meetings}."
    on_base = np.abs(least.position[first, 2]).max() <= 1e-6 * reach
    where = ", where z = 0" if on_base else ""
    return f"Even without radii legs touch within the limits{where}: {meetings}."


def _row(name: str, colour: Rgb, radius: float | None, curve: RadiusCurve, unit: Unit) -> str:
    value, note = "they differ", ""
    if radius is not None:
        value = unit.text(radius, 3)
        if name == MARKS[0][0]:
            share = float(volume_at(curve, radius) / curve.volumes[0])
            note = f"{format_number(100.0 * share, 3)} %"
    return row(f"{swatch(colour, 'ex-dot')}{name}", value, dim(note))


def _position(position: FloatArray, unit: Unit) -> str:
    rounded = np.round(position, 6) + 0.0
    texts = ", ".join(unit.number(float(x), 3) for x in rounded)
    return f"({texts}) {unit.name}"


def clearance_figure(frame: Frame) -> str:
    """Return the clearance of the closest legs in the pose, as HTML."""
    clearances, state = frame.snapshot.clearances, frame.state
    closest = int(clearances.closest)
    clearance = float(clearances.clearance[closest])
    words = state.unit.text(clearance, 3, size=state.design.reach)
    pair = pair_name(PAIRS[closest])
    hint = f"Clearance of the closest legs, {pair}: distance of their axes less their radii."
    if not any(state.design.limits.leg_radii):
        words += f" {dim('axes only')}"
        hint = f"Distance of the axes of the closest legs, {pair}: the design states no radii."
    look = "ex-beyond" if clearance < 0.0 else ""
    return figure("Workspace", "Clearance here", words, hint=hint, look=look)


OPACITY = 0.22
# Vertices 0 and 1 are the base ends at the start and at the end, 2 and 3 the platform ends.
# Legs 1 and 4 sweep triangles, since their base ends do not move; a face drawn twice would be twice
# as opaque.
TRIANGLE = np.array([[0, 2, 3]])
# The leg before the move has thicker lines of its own, which show the direction of the move.
START = np.array([(0, 2)])
EDGES = np.array([edge for edge in itertools.combinations(range(4), 2) if edge != (0, 2)])


class ClearanceScene(ScenePart):
    """The shortest line between the axes of the closest legs, and their clearance."""

    def __init__(self, services: Services) -> None:
        scene = services.scene
        self._line = add_lines(scene, "/clearance/line", 1, OUTLINE, 4.0)
        self._label = add_label(scene, "/clearance/label", "0")

    def updates(self, placed: Placed) -> Updates:
        """Yield the updates that draw the closest pair of this frame."""
        state, snapshot = placed.frame.state, placed.frame.snapshot
        is_visible = state.view.clearance and not state.view.is_twin
        yield from show(is_visible, self._line, self._label)
        if is_visible:
            clearances = snapshot.clearances
            pair = int(clearances.closest)
            ends = placed.scale * clearances.points[pair]
            yield self._line, "points", ends[None].astype(np.float32)
            least = float(clearances.clearance[pair])
            clearance = state.unit.text(least, 3, size=state.design.reach)
            words = f"legs {pair_name(PAIRS[pair])}: {clearance}"
            yield from write_label(self._label, words, ends.mean(axis=0))


class SweptTetrahedra(ScenePart):
    """Tetrahedra that the legs swept in the last move, taken as one step as in the paper.

    Those that overlap another have the colour of a collision.
    """

    def __init__(self, services: Services) -> None:
        scene = services.scene
        self._meshes = [
            add_translucent(
                scene,
                f"/swept/{leg}",
                (np.zeros((4, 3)), TRIANGLE if leg in (1, 4) else TETRAHEDRON_FACES),
                OPACITY,
                is_flat=True,
            )
            for leg in (1, 2, 3, 4)
        ]
        self._lines = (
            (EDGES, add_lines(scene, "/swept/edges", 4 * len(EDGES), None, 1.5)),
            (START, add_lines(scene, "/swept/starts", 4, None, 4.0)),
        )

    def updates(self, placed: Placed) -> Updates:
        """Yield the updates that draw the tetrahedra of this frame's last move."""
        view = placed.frame.state.view
        move = placed.frame.last_move if view.swept and not view.is_twin else None
        lines = (handle for _, handle in self._lines)
        yield from show(move is not None, *self._meshes, *lines)
        if move is None:
            return
        design = placed.frame.state.design
        ends = (Configuration.at(design, pose) for pose in (move.start, move.end))
        tetrahedra = placed.scale * swept_tetrahedra(*ends)
        colours = [OUTLINE if overlaps else SWEPT for overlaps in legs_of(move.overlaps)]
        for mesh, corners, colour in zip(self._meshes, tetrahedra, colours, strict=True):
            yield mesh, "vertices", corners.astype(np.float32)
            yield mesh, "color", colour
        for edges, handle in self._lines:
            points = tetrahedra[:, edges].reshape(-1, 2, 3)
            yield handle, "points", points.astype(np.float32)
            ends = np.repeat(np.array(colours, dtype=np.uint8), 2 * len(edges), axis=0)
            yield handle, "colors", ends.reshape(-1, 2, 3)


LEGS = Feature(
    "legs",
    tabs=(Tab("analyse", "Workspace", ClearancePanel),),
    bar=(InBar("middle", lambda _: clearance_figure),),
    scene=(ClearanceScene, SweptTetrahedra),
    feeds=(RADIUS_FEED,),
)
