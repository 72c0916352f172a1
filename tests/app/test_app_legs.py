"""The legs on the page: the accessible workspace, clearances, radii and the last move."""

from __future__ import annotations

import io
import re
from collections.abc import Callable
from dataclasses import replace
from functools import cache
from typing import Any, TypeVar

import msgspec
import numpy as np
import pytest
import trimesh
from desk import Desk, by_name, number, random_states, rows_of as rows_below_head, thick, viewed
from services import StubJobs, services_for

from explorer.app.features.feature import Follower, Services
from explorer.app.features.legs.feature import (
    ClearanceScene,
    SweptTetrahedra,
    clearance_figure,
    move_table,
)
from explorer.app.features.mechanism.bodies import AXIS_RADIUS, Legs
from explorer.app.features.workspace import work
from explorer.app.features.workspace.feature import WorkspacePanel
from explorer.app.features.workspace.feeds import WORKSPACE_FEED
from explorer.app.features.workspace.slice_map import SliceMap
from explorer.app.features.workspace.words import drawing_words, nothing_words, workspace_details
from explorer.app.scene.placing import Placed
from explorer.app.scene.shapes import SWEPT
from explorer.app.scene.surfaces import COLLIDING, PLAIN
from explorer.app.session.history import UserAction
from explorer.app.state.actions import Set
from explorer.app.state.frame import Frame
from explorer.app.state.moves import set_pose, set_position
from explorer.app.state.state import State, open_state
from explorer.app.widgets.blocks import render
from explorer.errors import InputError
from explorer.export.drawings.slices import in_plane
from explorer.legs.clearance import PAIRS, leg_axes, leg_clearances
from explorer.legs.interference import step_overlaps, swept_tetrahedra
from explorer.legs.moves import move_clearance
from explorer.measures.blocks.clearances import DIGITS, pose_clearances
from explorer.mechanism.configuration import Configuration
from explorer.mechanism.design_file import PRESETS
from explorer.mechanism.pose import Pose
from explorer.mechanism.rgb import OUTLINE, TUBE
from explorer.numerics.arrays import BoolArray, FloatArray
from explorer.numerics.number_text import format_number
from explorer.workspace.accessible.nodes import InvalidStartError, check_start
from explorer.workspace.limits.constraints import slacks
from explorer.workspace.workspace import Workspace

pytestmark = pytest.mark.usefixtures("warm_kernels")

OPTIMAL = PRESETS["paper-optimal"]
RADIUS = 0.2
Followed = TypeVar("Followed", bound=Follower)
# Rows of the rotation at home.
LEVEL = work.rows_of(open_state(OPTIMAL).pose.rotation)


def rows_of(html: str) -> list[list[str]]:
    """Return the cells of a table without a head, the numbers without their units."""
    rows = rows_below_head(f"<tr></tr>{html}")
    return [[re.sub(r" (cm³|mm|%)$", "", cell) for cell in row] for row in rows]


def show(state: State, **changes: Any) -> State:
    """Return the state with the accessible workspace shown."""
    values = {"solid": True, "region": "accessible", **changes}
    workspace = replace(state.view.workspace, **values)
    return Set("view", replace(state.view, workspace=workspace)).apply(state)


def with_limits(state: State, **limits: Any) -> State:
    return Set("design.limits", msgspec.structs.replace(state.design.limits, **limits)).apply(state)


def beyond_its_limits() -> State:
    """Return the optimum with a leg 4 that is too short for its home."""
    return with_limits(open_state(OPTIMAL), l4=(0.0, 12.5))


def follow(
    state: State, kind: Callable[[Services], Followed], services: Services | None = None
) -> tuple[Followed, StubJobs]:
    """Return the feed of a class, which has drawn a state, and its jobs."""
    services = services or services_for()
    feed, jobs = services.get(kind), services.jobs
    assert isinstance(jobs, StubJobs)
    feed.follow(Frame(state))
    answer(jobs)
    return feed, jobs


@cache
def execute(task: Callable[[Any], Any], request: object) -> Any:
    """Return what a task finds, computed once for all tests."""
    return task(request)


def answer(jobs: StubJobs) -> None:
    """Answer the newest order, if there is any."""
    for order in jobs.orders[-1:]:
        order.done(execute(order.task, order.request))


def drawing_of(state: State) -> work.WorkspaceDrawing:
    drawing = follow(state, WORKSPACE_FEED)[0].drawing
    assert drawing is not None
    return drawing


def clearance_at(state: State, points: FloatArray) -> FloatArray:
    """Return the least clearance of any two legs at positions (n, 3)."""
    return leg_clearances(Configuration(state.design, points, state.pose.rotation)).clearance.min(
        axis=-1
    )


untyped_trimesh: Any = trimesh
# Forces and moments of no load.
THICK = show(thick(open_state(OPTIMAL), RADIUS))


# The accessible workspace


def test_faces_where_legs_begin_to_collide_have_a_colour_of_their_own() -> None:
    shells = {shell.colour: shell for shell in drawing_of(THICK).surface.shells}
    assert set(shells) == {PLAIN, COLLIDING}
    collide = shells[COLLIDING].vertices[shells[COLLIDING].faces].reshape(-1, 3)
    # Where two pairs begin at once an edge cuts the corner, by less than a step of the grid.
    off = np.abs(clearance_at(THICK, collide))
    assert float(np.median(off)) < 1e-6
    assert float(np.quantile(off, 0.98)) < 0.1
    plain = shells[PLAIN].vertices[shells[PLAIN].faces].mean(axis=1)
    limits = Workspace(THICK.design, THICK.pose.rotation).limits
    on_limits = np.abs(slacks(limits, plain)).min(axis=-1)
    assert float(on_limits.max()) < 2.0 * work.PART_TOLERANCE * OPTIMAL.reach
    whole = drawing_of(show(THICK, region="limits"))
    assert [shell.colour for shell in whole.surface.shells] == [PLAIN]


@pytest.mark.parametrize("axis", [0, 1, 2])
def test_cut_takes_one_side_and_maps_the_accessible_part(axis: int) -> None:
    level = (12.0, -10.0, 0.3)[axis]
    state = show(THICK, cut="xyz"[axis], level=level)
    drawing = drawing_of(state)
    side = -1.0 if axis == 1 else 1.0
    vertices = np.concatenate([shell.vertices for shell in drawing.surface.shells])
    assert float((side * (vertices[:, axis] - level)).max()) == pytest.approx(0.0, abs=1e-9)
    assert drawing.slice_map is not None
    first, second = in_plane(drawing.slice_map.axis)
    lows, highs = np.array(drawing.slice_map.lows), np.array(drawing.slice_map.highs)
    points = np.full((3000, 3), level)
    flat = np.random.default_rng(axis).uniform(lows, highs, (len(points), 2))
    points[:, [first, second]] = flat
    limits = Workspace(THICK.design, THICK.pose.rotation).limits
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


def test_drawing_with_another_cut_colour_or_hull_computes_no_workspace_anew(
    monkeypatch: pytest.MonkeyPatch,
) -> None:
    drawing_of(THICK)
    monkeypatch.setattr("explorer.workspace.accessible.workspace._Carver", pytest.fail)
    for changes in ({"cut": "x", "level": 3.0}, {"colour": "margin"}, {"hull": True}):
        assert drawing_of(show(THICK, **changes)).part is not None


@pytest.mark.parametrize(
    ("start", "region", "orders"),
    [("home", "accessible", 1), ("pose", "accessible", 2), ("pose", "limits", 1)],
)
def test_move_requests_a_drawing_only_if_paths_start_at_the_pose(
    start: str, region: str, orders: int
) -> None:
    services = services_for()
    state = show(THICK, start=start, region=region)
    for each in (state, set_position(2, 8.0).apply(state)):
        services.get(WORKSPACE_FEED).follow(Frame(each))
    assert isinstance(services.jobs, StubJobs)
    assert len(services.jobs.orders) == orders


def test_failure_of_an_older_request_is_no_problem() -> None:
    feed, jobs = follow(THICK, WORKSPACE_FEED)
    feed.follow(Frame(show(THICK, colour="margin")))
    first, second = jobs.orders
    first.failed("too late")
    assert feed.problem is None
    second.failed("it failed")
    assert feed.problem == "it failed"
    answer(jobs)
    assert feed.problem is None
    assert feed.is_current


def summary(state: State) -> str:
    """Return all that the panel says of the drawing of a state."""
    frame, feed = Frame(state), follow(state, WORKSPACE_FEED)[0]
    return drawing_words(frame, feed) + workspace_details(frame, feed)


def test_home_in_trouble_leaves_the_solid_and_says_what_would_do() -> None:
    state = show(beyond_its_limits())
    home = np.array(state.pose.position)
    drawing, whole = drawing_of(state), drawing_of(show(state, region="limits"))
    trouble = drawing.trouble
    assert drawing.part is None
    assert trouble is not None
    with pytest.raises(InvalidStartError) as refused:
        check_start(Workspace(state.design, state.pose.rotation), home)
    assert trouble.reason == refused.value.in_millimetres
    assert "l4 = 130.1 mm is above its maximum 125 mm" in trouble.reason
    assert trouble.nearest is not None
    check_start(Workspace(state.design, state.pose.rotation), np.array(trouble.nearest))
    assert drawing.mesh_volume == pytest.approx(whole.mesh_volume, rel=1e-4)
    assert nothing_words(drawing) == "Nothing is accessible from the home position"
    # The alert of the panel has these words.
    assert nothing_words(drawing) not in summary(state)


def test_button_of_a_home_in_trouble_goes_to_the_nearest_start(
    services: Services, desk: Desk
) -> None:
    panel, before = WorkspacePanel(services), show(beyond_its_limits())
    desk.session.do(Set("design", before.design))
    desk.session.do(Set("view", before.view))
    feed, jobs = follow(before, WORKSPACE_FEED, services)
    words = [str(value) for *_, value in panel.updates(Frame(before))]
    (alert,) = (text for text in words if "Nothing is accessible from the home position" in text)
    assert "Go there" in alert
    drawing = feed.drawing
    assert drawing is not None
    assert drawing.trouble is not None
    desk.press(services.buttons, "workspace.start")
    after = desk.state
    assert desk.complaints == []
    assert after.pose.position == drawing.trouble.nearest
    np.testing.assert_allclose(after.pose.rotation, before.pose.rotation, atol=1e-12)
    assert after.view.workspace == replace(before.view.workspace, start="pose")
    assert after.design == before.design
    feed.follow(Frame(after))
    answer(jobs)
    assert feed.drawing is not None
    assert feed.drawing.part is not None
    assert not any("Go there" in str(value) for *_, value in panel.updates(Frame(after)))


@pytest.mark.parametrize("what", ["workspace", "hull"])
def test_exported_mesh_has_the_volume_of_the_drawing(what: str) -> None:
    drawing = drawing_of(show(THICK, hull=True))
    tolerance = work.PART_TOLERANCE * OPTIMAL.reach
    data = work.export_mesh(
        work.Selection(THICK.design, LEVEL, "accessible"), tolerance, what, "stl"
    )
    mesh = untyped_trimesh.load_mesh(io.BytesIO(data), file_type="stl")
    expected = drawing.mesh_volume if what == "workspace" else drawing.hull_volume
    assert expected is not None
    assert mesh.volume == pytest.approx(expected * OPTIMAL.unit_mm**3, rel=1e-4)
    assert work.file_words("accessible", what) == f"accessible {what}"
    assert work.file_words("limits", what) == what


@pytest.mark.parametrize(
    ("limits", "file_format", "reason"),
    [
        ({"l4": (0.0, 12.5)}, "stl", "no position is accessible from"),
        ({}, work.STEP, "begin to collide.*export it as 3mf, stl, glb"),
    ],
)
def test_file_that_cannot_be_written_is_refused_with_what_would_work(
    limits: dict[str, Any], file_format: str, reason: str
) -> None:
    design = with_limits(THICK, **limits).design
    with pytest.raises(InputError, match=reason):
        work.export_mesh(work.Selection(design, LEVEL, "accessible"), 0.1, "workspace", file_format)


END = Pose.of_yaw_pitch_roll((14.0, -2.0, 6.0), (-20.0, 0.0, 15.0))


def swept(start: State) -> State:
    """Return the state after a move to END, its swept tetrahedra shown."""
    return UserAction(set_pose(END), "drag", 100.0).apply(viewed(start, swept=True))


# With legs of different radii.
STATES = [
    thick(state, *radii)
    for state, radii in zip(
        random_states(12, seed=7),
        np.random.default_rng(7).uniform(0.0, 1.5, (12, 4)).tolist(),
        strict=True,
    )
]


def clearances(state: State) -> np.ndarray[Any, np.dtype[np.float64]]:
    return leg_clearances(Configuration.at(state.design, state.pose)).clearance


# Clearances in the panel


def in_column(values: list[float]) -> Any:
    """Return what equals the numbers of a column, with the digits of its largest one."""
    return pytest.approx(values, abs=0.51 * 10.0 ** (1 - DIGITS) * max(map(abs, values)))


def test_table_shows_the_clearance_of_each_pair() -> None:
    verdicts: set[bool] = set()
    for state in STATES:
        expected = clearances(state)
        html = render(pose_clearances(Frame(state).snapshot))
        rows = rows_of(html)
        assert [row[0] for row in rows] == [f"{i}–{j}" for i, j in PAIRS]
        millimetres = (expected * OPTIMAL.unit_mm).tolist()
        assert [number(row[1]) for row in rows] == in_column(millimetres)
        collides = bool((expected < 0.0).any())
        verdicts.add(collides)
        assert ("collide</div>" in html) is collides
        assert ("Legs are clear" in html) is not collides
        lines = re.findall(r"<tr.*?</tr>", html)
        assert ["ex-beyond" in line for line in lines] == (expected < 0.0).tolist()
        assert f"Least clearance: legs {rows[int(expected.argmin())][0]}," in html
    assert verdicts == {True, False}


@pytest.mark.parametrize("radius", [0.0, 0.3, 0.4])
def test_last_move_is_judged_by_both_tests(radius: float) -> None:
    state = thick(swept(open_state(OPTIMAL)), radius)
    home = open_state(OPTIMAL).pose
    exact = move_clearance(state.design, home, END)
    overlaps = step_overlaps(*(Configuration.at(OPTIMAL, pose) for pose in (home, END))).tolist()
    html = move_table(Frame(state))
    rows = rows_of(html)
    assert [row[0] for row in rows] == [f"{i}–{j}" for i, j in PAIRS]
    assert [row[1] == "overlap" for row in rows] == overlaps
    assert [number(row[2]) for row in rows] == in_column(
        (OPTIMAL.unit_mm * exact.clearance).tolist()
    )
    assert [number(row[3]) for row in rows] == pytest.approx(
        (100.0 * exact.share).tolist(), abs=0.5
    )
    assert ("Legs are clear on the way" in html) is exact.is_clear
    assert ("collide on the way" in html) is not exact.is_clear
    named = [f"{i}–{j}" for (i, j), is_so in zip(PAIRS, overlaps, strict=True) if is_so]
    assert f"overlap of {', '.join(named)}." in html


# Legs and clearances in the scene


def test_legs_that_collide_are_coloured(services: Services) -> None:
    legs = Legs(services)
    for state in STATES:
        colours = by_name(legs.updates(Placed(Frame(state))))["/legs/actuators"]["batched_colors"]
        pairs = zip(PAIRS, clearances(state).tolist(), strict=True)
        beyond = {leg for pair, clearance in pairs if clearance < 0.0 for leg in pair}
        expected = [OUTLINE if leg in beyond else TUBE for leg in (1, 2, 3, 4)]
        assert [tuple(colour) for colour in colours[:4].tolist()] == expected


def test_closest_pair_is_marked_wherever_the_platform_goes(services: Services) -> None:
    scene = ClearanceScene(services)
    marked: set[tuple[int, int]] = set()
    for state in STATES:
        placed = Placed(Frame(viewed(state, clearance=True)))
        drawn = by_name(scene.updates(placed))
        found = leg_clearances(Configuration.at(state.design, state.pose))
        pair = int(found.clearance.argmin())
        first, second = PAIRS[pair]
        marked.add(PAIRS[pair])
        line, label = drawn["/clearance/line"], drawn["/clearance/label"]
        assert line["visible"] is label["visible"] is True
        ends = line["points"][0]
        length = float(np.linalg.norm(ends[1] - ends[0]))
        assert length == pytest.approx(placed.scale * found.distance[pair], rel=1e-4)
        # Each end lies on the axis of its leg.
        axes = placed.scale * leg_axes(Configuration.at(state.design, state.pose))
        for end, leg in zip(ends, (first, second), strict=True):
            base, tip = axes[leg - 1]
            along = np.linalg.norm(end - base) + np.linalg.norm(tip - end)
            assert along == pytest.approx(float(np.linalg.norm(tip - base)), rel=1e-4)
        np.testing.assert_allclose(label["position"], ends.mean(axis=0), rtol=1e-5, atol=1e-5)
        clearance = format_number(OPTIMAL.unit_mm * float(found.clearance[pair]), 3)
        assert label["text"] == f"legs {first}–{second}: {clearance} mm"
    assert len(marked) > 1


def test_legs_are_drawn_with_the_radii_of_their_clearance_or_as_lines(services: Services) -> None:
    state = STATES[0]
    mixed = thick(state, 0.5, 0.3, 0.0, 0.2)
    for radii, each in (((0.5, 0.3, 0.0, 0.2), mixed), ((0.0,) * 4, thick(state, 0.0))):
        placed = Placed(Frame(each))
        actuators = by_name(Legs(services).updates(placed))["/legs/actuators"]
        # The cylinder, rod, collar and socket of each leg.
        drawn = actuators["batched_scales"][:, 0].reshape(4, 4)
        for leg, radius in enumerate(radii):
            most = placed.scale * radius if radius else AXIS_RADIUS
            assert drawn[:, leg].max() == pytest.approx(most)
        figure = clearance_figure(Frame(each))
        assert ("axes only" in figure) == (not any(radii))


def test_tetrahedra_of_the_last_move_are_drawn(services: Services) -> None:
    state, home = swept(open_state(OPTIMAL)), open_state(OPTIMAL).pose
    placed = Placed(Frame(state))
    drawn = by_name(SweptTetrahedra(services).updates(placed))
    assert all(each["visible"] is True for each in drawn.values())
    ends = Configuration.at(OPTIMAL, home), Configuration.at(OPTIMAL, END)
    bodies, overlaps = placed.scale * swept_tetrahedra(*ends), step_overlaps(*ends)
    beyond = [pair for pair, is_so in zip(PAIRS, overlaps, strict=True) if is_so]
    colours = [OUTLINE if any(leg in pair for pair in beyond) else SWEPT for leg in (1, 2, 3, 4)]
    # A move in which some overlap and some do not.
    assert set(colours) == {OUTLINE, SWEPT}
    for leg, body, colour in zip((1, 2, 3, 4), bodies, colours, strict=True):
        mesh = drawn[f"/swept/{leg}"]
        np.testing.assert_allclose(mesh["vertices"], body, rtol=1e-5, atol=1e-5)
        assert mesh["color"] == colour


@pytest.mark.parametrize(
    "state",
    [
        open_state(OPTIMAL),
        # Shown, but there is no move.
        viewed(open_state(OPTIMAL), swept=True),
        viewed(open_state(OPTIMAL), clearance=True, drawn_as="6-4 twin"),
        viewed(thick(swept(open_state(OPTIMAL)), 0.3), drawn_as="6-4 twin"),
        viewed(thick(swept(open_state(OPTIMAL)), 0.3), swept=False, legs=False),
    ],
)
def test_clearances_and_tetrahedra_are_hidden_where_they_are_not_wanted(
    services: Services, state: State
) -> None:
    for scene in (ClearanceScene(services), SweptTetrahedra(services)):
        drawn = by_name(scene.updates(Placed(Frame(state))))
        assert not any(values["visible"] for values in drawn.values())
