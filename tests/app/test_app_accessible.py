"""The accessible workspace on the page: requests, drawings, numbers, messages, files."""

from __future__ import annotations

import io
import re
import sys
from collections.abc import Callable, Generator
from dataclasses import replace
from functools import cache
from typing import Any, Literal, TypeVar

import msgspec
import numpy as np
import pytest
import trimesh
import viser
from desk import Desk, number, rows_of, thick
from hypothesis import given, strategies as st
from services import StubWorker, services_for

from explorer.app.features.feature import Feed, Services
from explorer.app.features.legs.feed import RadiusFeed
from explorer.app.features.legs.panel import LegsPanel
from explorer.app.features.legs.radius_plot import chart_columns, radius_words, volume_at
from explorer.app.features.workspace import regions
from explorer.app.features.workspace.feed import WorkspaceFeed
from explorer.app.features.workspace.files import FORMATS
from explorer.app.features.workspace.panel import WorkspacePanel
from explorer.app.features.workspace.slice_map import SliceMap
from explorer.app.features.workspace.tasks import (
    REACHED_TOLERANCE,
    STEP,
    WorkspaceDrawing,
    export_mesh,
    exported_name,
)
from explorer.app.features.workspace.words import drawing_words, nothing_words, workspace_details
from explorer.app.scene.bands import COLLIDING, PLAIN
from explorer.app.state.actions import Set, SetPosition
from explorer.app.state.frame import Frame
from explorer.app.state.state import State, opened
from explorer.app.widgets.assigning import Assigner
from explorer.errors import InputError, MissingExtraError
from explorer.legs.clearance import PAIRS, leg_clearances
from explorer.mechanism.design_file import PRESETS
from explorer.numerics.arrays import BoolArray, FloatArray
from explorer.numerics.number_text import format_number
from explorer.workspace.accessible.radii import RadiusCurve
from explorer.workspace.accessible.start import StartError, check_start
from explorer.workspace.accessible.workspace import accessible_workspace
from explorer.workspace.least_clearance import least_clearances
from explorer.workspace.limits.constraints import constraints, slacks

pytestmark = pytest.mark.usefixtures("warm_kernels")

OPTIMAL = PRESETS["paper-optimal"]
RADIUS = 0.2
Followed = TypeVar("Followed", bound=Feed)
# Rows of the rotation at home.
LEVEL = regions.rows_of(opened(OPTIMAL).pose.rotation)


@pytest.fixture
def desk() -> Generator[Desk]:
    desk = Desk(show(beyond_its_limits()))
    yield desk
    desk.session.stop()


def show(state: State, **changes: Any) -> State:
    """Return the state with the accessible workspace shown."""
    values = {"solid": True, "region": "accessible", **changes}
    workspace = replace(state.view.workspace, **values)
    return Set("view", replace(state.view, workspace=workspace)).apply(state)


def show_curve(state: State) -> State:
    return Set("view", replace(state.view, radius_curve=True)).apply(state)


def with_limits(state: State, **limits: Any) -> State:
    return Set("design.limits", msgspec.structs.replace(state.design.limits, **limits)).apply(state)


def beyond_its_limits() -> State:
    """Return the optimum with a leg 4 that is too short for its home."""
    return with_limits(opened(OPTIMAL), l4=(0.0, 12.5))


def follow(
    state: State, kind: Callable[[Services], Followed], services: Services | None = None
) -> tuple[Followed, StubWorker]:
    """Return the feed of a class, which has drawn a state, and its worker."""
    services = services or services_for()
    feed, worker = services.get(kind), services.worker
    assert isinstance(worker, StubWorker)
    feed.follow(Frame(state))
    answer(worker)
    return feed, worker


@cache
def execute(task: Callable[[Any], Any], request: object) -> Any:
    """Return what a task finds, computed once for all tests."""
    return task(request)


def answer(worker: StubWorker) -> None:
    """Answer the newest order, if there is any."""
    for order in worker.orders[-1:]:
        order.done(execute(order.task, order.request))


def drawing_of(state: State) -> WorkspaceDrawing:
    drawing = follow(state, WorkspaceFeed)[0].drawing
    assert drawing is not None
    return drawing


def clearance_at(state: State, points: FloatArray) -> FloatArray:
    """Return the least clearance of any two legs at positions (n, 3)."""
    return leg_clearances(state.design, points, state.pose.rotation).clearance.min(axis=-1)


def area(drawing: WorkspaceDrawing) -> float:
    triangles = np.concatenate([shell.vertices[shell.faces] for shell in drawing.surface.shells])
    a, b, c = np.moveaxis(triangles, 1, 0)
    return 0.5 * float(np.linalg.norm(np.cross(b - a, c - a), axis=1).sum())


untyped_trimesh: Any = trimesh
# Forces and moments of no load.
UNLOADED = (0.0, 0.0, 0.0, 0.0, 0.0, 0.0)
THICK = show(thick(opened(OPTIMAL), RADIUS))


def test_drawing_has_the_numbers_of_the_library() -> None:
    drawing = drawing_of(THICK)
    expected = accessible_workspace(THICK.design, tolerance=REACHED_TOLERANCE * OPTIMAL.reach)
    assert drawing.accessible is not None
    assert drawing.trouble is None
    assert drawing.volume == expected.volume
    assert drawing.accessible.volume == expected.accessible_volume
    assert drawing.accessible.node_count == expected.accessible_node_count
    assert drawing.accessible.pairs == expected.pairs
    assert drawing.accessible.harmless_radius == expected.harmless_radius
    assert drawing.nodes is not None
    assert drawing.nodes.count == expected.node_count
    assert drawing.mesh_volume == pytest.approx(expected.accessible_volume, rel=1e-3)


def test_faces_where_legs_begin_to_collide_have_a_colour_of_their_own() -> None:
    shells = {shell.colour: shell for shell in drawing_of(THICK).surface.shells}
    assert set(shells) == {PLAIN, COLLIDING}
    collide = shells[COLLIDING].vertices[shells[COLLIDING].faces].reshape(-1, 3)
    # Where two pairs begin at once an edge cuts the corner, by less than a step of the grid.
    off = np.abs(clearance_at(THICK, collide))
    assert float(np.median(off)) < 1e-6
    assert float(np.quantile(off, 0.98)) < 0.1
    plain = shells[PLAIN].vertices[shells[PLAIN].faces].mean(axis=1)
    limits = constraints(THICK.design, THICK.pose.rotation)
    on_limits = np.abs(slacks(limits, plain)).min(axis=-1)
    assert float(on_limits.max()) < 2.0 * REACHED_TOLERANCE * OPTIMAL.reach
    whole = drawing_of(show(THICK, region="limits"))
    assert [shell.colour for shell in whole.surface.shells] == [PLAIN]


def test_hull_holds_the_accessible_part_and_lies_in_that_of_all() -> None:
    drawing, whole = (
        drawing_of(show(THICK, hull=True, region=region)) for region in ("accessible", "limits")
    )
    assert drawing.hull_volume is not None
    assert whole.hull_volume is not None
    assert drawing.mesh_volume <= drawing.hull_volume <= whole.hull_volume


@pytest.mark.parametrize("axis", [0, 1, 2])
def test_cut_takes_one_side_and_maps_the_accessible_part(axis: int) -> None:
    level = (12.0, -10.0, 0.3)[axis]
    state = show(THICK, cut="xyz"[axis], level=level)
    drawing = drawing_of(state)
    side = -1.0 if axis == 1 else 1.0
    vertices = np.concatenate([shell.vertices for shell in drawing.surface.shells])
    assert float((side * (vertices[:, axis] - level)).max()) == pytest.approx(0.0, abs=1e-9)
    assert drawing.slice_map is not None
    first, second = drawing.slice_map.plane
    lows, highs = np.array(drawing.slice_map.lows), np.array(drawing.slice_map.highs)
    points = np.full((3000, 3), level)
    flat = np.random.default_rng(axis).uniform(lows, highs, (len(points), 2))
    points[:, [first, second]] = flat
    limits = constraints(THICK.design, THICK.pose.rotation)
    within = np.asarray((slacks(limits, points) >= 0.2).all(axis=-1))
    blocked = inside(path_points(drawing.slice_map, "is-blocked"), flat)[within]
    colliding = inside(path_points(drawing.slice_map, "is-colliding"), flat)[within]
    clearance = clearance_at(THICK, points[within])
    assert blocked.any()
    assert not blocked.all()
    # The surface of collisions has facets as long as a step of its grid.
    assert float(clearance[~blocked].min()) > -0.1
    assert float(clearance[blocked].max()) < 0.1
    # Where legs collide is outlined on a finer grid, whatever path leads there.
    np.testing.assert_array_equal(
        colliding[np.abs(clearance) > 5e-3], (clearance <= 0.0)[np.abs(clearance) > 5e-3]
    )


def path_points(drawn: SliceMap, class_name: str) -> list[FloatArray]:
    """Return the polygons of the path of a class in a map, in design units."""
    (data,) = re.findall(rf'<path d="([^"]*)"[^>]*class="{class_name}"', drawn.markup)
    polygons = [
        np.array([[float(x) for x in point.split(",")] for point in part.rstrip("Z").split("L")])
        for part in data.split("M")[1:]
    ]
    return [polygon / drawn.own_scale + np.array(drawn.lows) for polygon in polygons]


def inside(polygons: list[FloatArray], points: FloatArray) -> BoolArray:
    """Return which points (n, 2) lie in polygons by the even-odd rule."""
    crossings = np.zeros(len(points), dtype=np.int64)
    for polygon in polygons:
        for (x0, y0), (x1, y1) in zip(polygon, np.roll(polygon, -1, axis=0), strict=True):
            spans = (y0 > points[:, 1]) != (y1 > points[:, 1])
            with np.errstate(divide="ignore", invalid="ignore"):
                at = x0 + (points[:, 1] - y0) / (y1 - y0) * (x1 - x0)
            crossings += spans & (at > points[:, 0])
    return crossings % 2 == 1


def test_cut_beyond_the_extent_goes_through_the_middle_and_one_within_stays() -> None:
    for level, found in ((-50.0, 10.0), (None, 10.0), (50.0, 10.0), (17.0, 17.0)):
        state = show(opened(OPTIMAL), region="limits", cut="x", level=level)
        assert drawing_of(state).level == pytest.approx(found)


def test_drawing_with_another_cut_colour_or_hull_computes_no_workspace_anew(
    monkeypatch: pytest.MonkeyPatch,
) -> None:
    drawing_of(THICK)
    monkeypatch.setattr(regions, "accessible_workspace", pytest.fail)
    for changes in ({"cut": "x", "level": 3.0}, {"colour": "margin"}, {"hull": True}):
        assert drawing_of(show(THICK, **changes)).accessible is not None


@pytest.mark.parametrize(
    ("start", "region", "orders"),
    [("home", "accessible", 1), ("pose", "accessible", 2), ("pose", "limits", 1)],
)
def test_move_requests_a_drawing_only_if_paths_start_at_the_pose(
    start: str, region: str, orders: int
) -> None:
    services = services_for()
    state = show(THICK, start=start, region=region)
    for each in (state, SetPosition(2, 8.0).apply(state)):
        services.get(WorkspaceFeed).follow(Frame(each))
    assert isinstance(services.worker, StubWorker)
    assert len(services.worker.orders) == orders


def test_failure_of_an_older_request_is_no_problem() -> None:
    feed, worker = follow(THICK, WorkspaceFeed)
    feed.follow(Frame(show(THICK, colour="margin")))
    first, second = worker.orders
    first.failed("too late")
    assert feed.problem is None
    second.failed("it failed")
    assert feed.problem == "it failed"
    answer(worker)
    assert feed.problem is None
    assert feed.is_current


def test_curve_is_requested_once_for_all_radii_when_it_is_show() -> None:
    feed, worker = follow(opened(OPTIMAL), RadiusFeed)
    state = show_curve(opened(OPTIMAL))
    narrow = with_limits(state, margin=1.0)
    for each, orders in (
        (opened(OPTIMAL), 0),
        (state, 1),
        (thick(state, 0.3), 1),
        (SetPosition(0, 11.0).apply(state), 1),
        (narrow, 2),
        (opened(OPTIMAL), 2),
    ):
        feed.follow(Frame(each))
        assert len(worker.orders) == orders
    assert worker.orders[-1].request.design.limits.margin == 1.0


def test_columns_of_a_chart_are_sent_only_if_they_change(server: viser.ViserServer) -> None:
    chart = server.gui.add_uplot((np.zeros(2), np.zeros(2)), ({}, {}))
    assigner = Assigner(server)
    for y, differing in ((1.0, 1), (1.0, 0), (2.0, 1)):
        columns = (np.arange(3.0), np.full(3, y))
        assert len(assigner.assign([(chart, "data", columns)])) == differing


def summary(state: State) -> str:
    """Return all that the panel says of the drawing of a state."""
    frame, feed = Frame(state), follow(state, WorkspaceFeed)[0]
    return drawing_words(frame, feed) + workspace_details(frame, feed)


def test_numbers_of_the_panel_are_those_of_the_library() -> None:
    drawing, html = drawing_of(THICK), summary(THICK)
    accessible = drawing.accessible
    assert accessible is not None
    volume, percent = accessible.volume, 100.0 * accessible.volume / drawing.volume
    for text in (
        f"{format_number(volume, 6)} units³ accessible, {format_number(percent, 4)} %",
        f"{accessible.node_count} of 999",
        "Legs 1 – 4, 2 – 4, 3 – 4 collide",
    ):
        assert text in html
    head, *rows = [row for row in rows_of(html) if len(row) == 3]
    assert [row[0] for row in (head, *rows)] == ["legs"] + [f"{i} – {j}" for i, j in PAIRS]
    for (_, clearance, blocked), pair in zip(rows, accessible.pairs, strict=True):
        assert number(clearance) == pytest.approx(pair.clearance, rel=5e-3)
        shown = 0.0 if blocked == "–" else number(blocked)
        assert shown == pytest.approx(pair.blocked_volume, rel=5e-3)


def test_numbers_without_a_collision_show_how_far_each_pair_is_from_one() -> None:
    state = with_limits(show(opened(OPTIMAL)), margin=1.0)
    html = summary(state)
    assert "No pair collides" in html
    assert "accessible, 100 %" in html
    least = least_clearances(state.design).clearance
    assert f"all radii grow by up to {0.5 * float(least.min()):.4g}" in html
    rows = [row for row in rows_of(html) if len(row) == 3][1:]
    assert [number(row[1]) for row in rows] == pytest.approx(least.tolist(), rel=5e-3)
    assert {row[2] for row in rows} == {"–"}


def test_home_in_trouble_leaves_the_solid_and_says_what_would_do() -> None:
    state = show(beyond_its_limits())
    home = np.array(state.pose.position)
    drawing, whole = drawing_of(state), drawing_of(show(state, region="limits"))
    trouble = drawing.trouble
    assert drawing.accessible is None
    assert trouble is not None
    with pytest.raises(StartError) as refused:
        check_start(state.design, state.pose.rotation, home)
    assert trouble.reason == str(refused.value)
    assert "l4 = 13.01 is above its maximum 12.5" in trouble.reason
    assert trouble.nearest is not None
    check_start(state.design, state.pose.rotation, np.array(trouble.nearest))
    # On the sphere that home is beyond.
    off = np.linalg.norm(np.array(trouble.nearest) - [*OPTIMAL.a3, 0.0])
    assert float(off) == pytest.approx(12.5, abs=1e-3)
    assert area(drawing) == pytest.approx(area(whole), rel=1e-4)
    assert nothing_words(drawing) == "Nothing is accessible from the home position"
    # The alert of the panel has these words.
    assert nothing_words(drawing) not in summary(state)


def test_legs_that_collide_everywhere_are_named_without_a_button(services: Services) -> None:
    state, panel = show(thick(opened(OPTIMAL), 0.4)), WorkspacePanel(services)
    follow(state, WorkspaceFeed, services)
    updates = list(panel.updates(Frame(state)))
    buttons = {h.label: v for h, _, v in updates if isinstance(h, viser.GuiButtonHandle)}
    assert buttons["Go there"] is False
    assert any("legs 2 and 3 overlap" in str(v) for _, name, v in updates if name == "content")


def test_button_of_a_home_in_trouble_goes_to_the_nearest_start(
    services: Services, desk: Desk
) -> None:
    panel, before = WorkspacePanel(services), desk.state
    feed, worker = follow(before, WorkspaceFeed, services)
    updates = list(panel.updates(Frame(before)))
    assert any("Nothing is accessible from the home position" in str(v) for *_, v in updates)
    (button,) = (
        handle
        for handle, name, value in updates
        if isinstance(handle, viser.GuiButtonHandle) and (name, value) == ("visible", True)
    )
    drawing = feed.drawing
    assert drawing is not None
    assert drawing.trouble is not None
    desk.click(button)
    after = desk.state
    assert desk.complaints == []
    assert after.pose.position == drawing.trouble.nearest
    np.testing.assert_allclose(after.pose.rotation, before.pose.rotation, atol=1e-12)
    assert after.view.workspace == replace(before.view.workspace, start="pose")
    assert after.design == before.design
    feed.follow(Frame(after))
    answer(worker)
    assert feed.drawing is not None
    assert feed.drawing.accessible is not None
    assert (button, "visible", False) in list(panel.updates(Frame(after)))


@pytest.mark.parametrize("what", ["workspace", "hull"])
def test_exported_mesh_has_the_volume_of_the_drawing(what: str) -> None:
    drawing = drawing_of(show(THICK, hull=True))
    tolerance = REACHED_TOLERANCE * OPTIMAL.reach
    data = export_mesh(THICK.design, LEVEL, tolerance, "accessible", None, UNLOADED, what, "stl")
    mesh = untyped_trimesh.load_mesh(io.BytesIO(data), file_type="stl")
    expected = drawing.mesh_volume if what == "workspace" else drawing.hull_volume
    assert expected is not None
    assert mesh.volume == pytest.approx(expected * OPTIMAL.unit_mm**3, rel=1e-4)
    assert exported_name("accessible", what) == f"accessible {what}"
    assert exported_name("limits", what) == what


def test_step_of_the_workspace_has_exact_faces() -> None:
    data = export_mesh(OPTIMAL, LEVEL, 0.1, "limits", None, UNLOADED, "workspace", STEP)
    assert data.startswith(b"ISO-10303-21;")
    assert data.count(b"ADVANCED_FACE") < 20
    assert STEP in FORMATS


@pytest.mark.parametrize(
    ("limits", "region", "what", "file_format", "reason"),
    [
        ({"l4": (0.0, 12.5)}, "accessible", "workspace", "stl", "no position is accessible from"),
        ({}, "limits", "hull", STEP, "a convex hull.*export it as 3mf, stl, glb, obj or ply"),
        ({}, "accessible", "workspace", STEP, "begin to collide.*export it as 3mf, stl, glb"),
    ],
)
def test_file_that_cannot_be_written_is_refused_with_what_would_work(
    limits: dict[str, Any],
    region: Literal["limits", "accessible"],
    what: str,
    file_format: str,
    reason: str,
) -> None:
    design = with_limits(THICK, **limits).design
    with pytest.raises(InputError, match=reason):
        export_mesh(design, LEVEL, 0.1, region, None, UNLOADED, what, file_format)


def test_step_without_its_extra_says_how_to_get_it(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setitem(sys.modules, "OCP.gp", None)
    with pytest.raises(MissingExtraError, match=r"flagged-explorer\[cad\]"):
        export_mesh(OPTIMAL, LEVEL, 0.1, "limits", None, UNLOADED, "workspace", STEP)


def curve_of(state: State) -> RadiusCurve:
    drawing = follow(show_curve(state), RadiusFeed)[0].drawing
    assert drawing is not None
    assert drawing.curve is not None
    return drawing.curve


def words_of(state: State) -> str:
    return radius_words(Frame(state), follow(show_curve(state), RadiusFeed)[0])


@given(st.lists(st.floats(1.0, 1e3), min_size=2, max_size=30), st.none() | st.floats(0.0, 2.0))
def test_chart_shows_any_curve_and_marks_on_it(values: list[float], radius: float | None) -> None:
    whole = curve_of(opened(OPTIMAL))
    drawn = replace(
        whole,
        radii=np.append(np.linspace(0.0, 0.5, len(values)), 0.5),
        volumes=np.array([*sorted(values, reverse=True), 0.0]),
        # Two legs that come as near as 0.1 bear radii of 0.05.
        least=whole.least._replace(clearance=np.full(len(PAIRS), 0.1)),
    )
    x, y, *columns = chart_columns(drawn, radius)
    assert (np.diff(x) >= 0.0).all()
    assert (np.diff(y) <= 1e-9).all()
    assert y[-1] == 0.0
    assert x[-1] > 0.5
    at = np.searchsorted(x, drawn.radii)
    np.testing.assert_allclose(y[at[:-1]], drawn.volumes[:-1])
    marked = (radius, drawn.radius_at(0.99), drawn.harmless)
    for column, expected in zip(columns, marked, strict=True):
        points = np.nonzero(np.isfinite(column))[0]
        assert x[points].tolist() == ([] if expected is None else [expected])
        for point in points:
            assert column[point] == pytest.approx(volume_at(drawn, x[point]))
    assert volume_at(drawn, 0.6) == 0.0


def test_words_of_the_curve_show_its_radii_shares_and_first_contacts() -> None:
    expected, html = curve_of(opened(OPTIMAL)), words_of(thick(opened(OPTIMAL), RADIUS))
    rows = rows_of("<tr></tr>" + html)
    assert [row[0] for row in rows] == ["present radius", "99 % accessible up to", "no loss up to"]
    assert number(rows[0][1]) == RADIUS
    share = 100.0 * volume_at(expected, RADIUS) / float(expected.volumes[0])
    assert number(rows[0][2]) == pytest.approx(share, rel=5e-3)
    assert number(rows[1][1]) == pytest.approx(expected.radius_at(0.99), rel=5e-3)
    assert rows[2][1] == "0"
    assert "touch within the limits, where z = 0: legs 1 and 4 at (0, 0, 0)" in html
    least = least_clearances(OPTIMAL)
    for pair in (PAIRS.index((2, 4)), PAIRS.index((3, 4))):
        x, y = (f"{v:.3g}".replace("-", "−") for v in least.position[pair, :2])
        assert f"legs {PAIRS[pair][0]} and {PAIRS[pair][1]} at ({x}, {y}, 0)" in html


def test_words_of_a_harmless_radius_name_the_pair_that_ends_it() -> None:
    state = with_limits(opened(OPTIMAL), margin=1.0)
    html, least = words_of(state), least_clearances(state.design)
    first, second = PAIRS[int(least.clearance.argmin())]
    assert f"First collision within the limits: legs {first} and {second} at (" in html
    assert f"{0.5 * least.clearance.min():.3g}" in html


@pytest.mark.parametrize(
    ("limits", "words"),
    [
        ({"l4": (0.0, 12.5)}, "l4 = 13.01 is above its maximum 12.5"),
        ({"box": ((10.0,) * 3, (11.0,) * 3), "l1": (0.0, 1.0)}, "The workspace is empty"),
        ({"leg_radii": (0.1, 0.1, 0.1, 0.2)}, "they differ"),
    ],
)
def test_words_of_a_curve_say_what_is_missing(limits: dict[str, Any], words: str) -> None:
    assert words in words_of(with_limits(opened(OPTIMAL), **limits))


def test_chart_appears_once_its_curve_is_computed(services: Services, worker: StubWorker) -> None:
    panel, feed = LegsPanel(services), services.get(RadiusFeed)
    state = show_curve(opened(OPTIMAL))

    def chart(state: State) -> dict[str, Any]:
        feed.follow(Frame(state))
        updates = list(panel.updates(Frame(state)))
        return {name: v for h, name, v in updates if isinstance(h, viser.GuiUplotHandle)}

    assert chart(opened(OPTIMAL)) == chart(state) == {"visible": False}
    assert "Computing" in radius_words(Frame(state), feed)
    answer(worker)
    drawn = chart(state)
    assert drawn["visible"] is True
    expected = chart_columns(curve_of(state), 0.0)
    for found, column in zip(drawn["data"], expected, strict=True):
        np.testing.assert_array_equal(found, column)
    # The very same columns again, until something changes.
    assert chart(state)["data"] is drawn["data"]
    assert chart(thick(state, 0.1))["data"] is not drawn["data"]
    # A new limit: the old curve, called out of date, until the new one is there.
    narrow = with_limits(state, margin=1.0)
    assert chart(narrow)["visible"] is True
    assert "computing" in radius_words(Frame(narrow), feed)
    answer(worker)
    assert "computing" not in radius_words(Frame(narrow), feed)
