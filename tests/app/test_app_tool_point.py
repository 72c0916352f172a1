"""The tool point in the page: what is told of b4, set at b4 or drawn at b4 is so at the tool."""

from __future__ import annotations

import datetime as dt
import html
import io
import json
import re
import time
from dataclasses import replace
from typing import Any, Literal

import msgspec
import numpy as np
import pytest
import trimesh
import viser
from desk import Desk, by_name, number, rows_of
from hypothesis import given, strategies as st
from scipy.spatial.transform import Rotation
from services import StubDownloads, StubWorker
from strategies import Case, all_cases

from explorer.app.features.compare.actions import Pin
from explorer.app.features.compare.feed import CompareFeed
from explorer.app.features.compare.scene import ComparedScene
from explorer.app.features.feature import Services
from explorer.app.features.help.tour import STEPS
from explorer.app.features.mechanism.marks import DragHandle
from explorer.app.features.mechanism.modes import modes_table
from explorer.app.features.mechanism.pose_panel import MovePanel
from explorer.app.features.orientation.actions import GoToTilt, SetTiltTorsion
from explorer.app.features.orientation.feeds import PositionFeed, RangeFeed, TiltsFeed
from explorer.app.features.orientation.panel import OrientationPanel
from explorer.app.features.orientation.scene import OrientationScene
from explorer.app.features.orientation.tasks import orientations_over
from explorer.app.features.paths.actions import Go
from explorer.app.features.paths.panel import TYPED, PathsPanel, end_numbers
from explorer.app.features.paths.runner import PathRunner
from explorer.app.features.paths.scene import PathScene
from explorer.app.features.sharing.scene_html import caption_of
from explorer.app.features.singularity.jog_scene import motion_line
from explorer.app.features.singularity.performance import performance_table
from explorer.app.features.singularity.scene import BallScene, EllipsoidScene
from explorer.app.features.workspace.feed import WorkspaceFeed, workspace_request
from explorer.app.features.workspace.files import WorkspaceFiles
from explorer.app.features.workspace.orientation import workspace_pose, workspace_start
from explorer.app.features.workspace.panel import WorkspacePanel
from explorer.app.features.workspace.regions import rows_of as matrix_rows
from explorer.app.features.workspace.scene import WorkspaceScene
from explorer.app.features.workspace.tasks import (
    STEP,
    WorkspaceDrawing,
    export_mesh,
    exported_name,
)
from explorer.app.features.workspace.words import workspace_details
from explorer.app.inputs.ranges import position_span
from explorer.app.scene.placing import Placed, scene_scale
from explorer.app.session.history import start_history
from explorer.app.session.session import UNDO
from explorer.app.state.actions import GoHome, Set, SetAngle, SetMode, SetPose, SetPosition
from explorer.app.state.compared import Look
from explorer.app.state.frame import Frame
from explorer.app.state.state import State, angles_of, opened
from explorer.app.state.view import OrientationView
from explorer.app.storage.session_format import decode_session, encode_session
from explorer.app.widgets.assigning import Assigner
from explorer.app.widgets.pieces import widgets
from explorer.export.step import exact_workspace, step_bytes
from explorer.measures.snapshot import evaluate
from explorer.mechanism.design import Design
from explorer.mechanism.design_file import PRESETS
from explorer.mechanism.home import home_pose
from explorer.mechanism.machine import Tool
from explorer.mechanism.margins import margins
from explorer.mechanism.pose import Pose, Triple, rotation_from_quaternion
from explorer.mechanism.tool_point import Point
from explorer.numerics.arrays import FloatArray
from explorer.singularity.jacobian import jacobian
from explorer.singularity.uncoupled import UNCOUPLED
from explorer.workspace.limits.constraints import constraints

OPTIMAL = PRESETS["paper-optimal"]
TOOL: Triple = (1.0, 0.0, 3.0)
NO_LOAD = (0.0, 0.0, 0.0, 0.0, 0.0, 0.0)
TILTED = Pose.of_yaw_pitch_roll((9.0, 4.0, 8.0), (-60.0, 15.0, 10.0))


def with_tool(design: Design, tool: Triple = TOOL) -> Design:
    return msgspec.structs.replace(design, tool=Tool(position=tool))


def opened_at(
    at: Point = "tool", tool: Triple = TOOL, pose: Pose | None = TILTED, **view: Any
) -> State:
    """Return the paper's optimum with a tool, and the point that is shown."""
    state = opened(with_tool(OPTIMAL, tool), pose)
    return Set("view", replace(state.view, at=at, **view)).apply(state)


def tool_of(state: State) -> FloatArray:
    """Return the tool point in the base frame, from the matrix of the quaternion."""
    rotation = rotation_from_quaternion(state.pose.quaternion)
    return np.array(state.pose.position) + rotation @ np.array(state.design.tool.position)


@st.composite
def states(draw: st.DrawFn) -> tuple[State, float]:
    """Draw a state with a tool that is set, and the largest length of the computation."""
    case: Case = draw(all_cases())
    x, y, z = (case.design.reach * draw(st.floats(-2.0, 2.0)) for _ in range(3))
    state = opened(with_tool(case.design, (x, y, z)), case.pose)
    return Set("view.at", "tool").apply(state), max(case.size, abs(x), abs(y), abs(z))


# Positions and angles


@given(states(), st.sampled_from((0, 1, 2)), st.floats(-3.0, 3.0))
def test_coordinate_of_the_tool_is_set_alone(
    drawn: tuple[State, float], axis: int, to: float
) -> None:
    state, size = drawn
    after = SetPosition(axis, to * size).apply(state)
    expected = tool_of(state)
    expected[axis] = to * size
    np.testing.assert_allclose(tool_of(after), expected, rtol=0.0, atol=1e-14 * size)
    assert after.pose.quaternion == state.pose.quaternion
    assert after.yaw_pitch_roll == state.yaw_pitch_roll
    others = [i for i in range(3) if i != axis]
    assert [after.pose.position[i] for i in others] == [state.pose.position[i] for i in others]


@given(states(), st.sampled_from((0, 1, 2)), st.floats(0.0, 90.0))
def test_angles_turn_the_platform_about_the_tool(
    drawn: tuple[State, float], axis: int, to: float
) -> None:
    state, size = drawn
    by_angle = SetAngle(axis, to).apply(state)
    assert by_angle.yaw_pitch_roll[axis] == to
    by_tilt = SetTiltTorsion(axis, to).apply(state)
    assert by_tilt.tilt_torsion[axis] == to
    for after in (by_angle, by_tilt, GoToTilt(30.0, to).apply(state)):
        np.testing.assert_allclose(tool_of(after), tool_of(state), rtol=0.0, atol=1e-14 * size)


@given(states())
def test_choice_of_the_point_moves_nothing(drawn: tuple[State, float]) -> None:
    state, _ = drawn
    back = Set("view.at", "b4").apply(state)
    assert replace(back, view=state.view) == state
    np.testing.assert_array_equal(back.position, state.pose.position)


def test_choice_of_the_point_is_one_step_that_can_be_undone(desk: Desk, services: Services) -> None:
    panel = MovePanel(services)
    desk.session.do(Set("design", with_tool(OPTIMAL)))
    before = desk.state
    desk.press(services.buttons, "pose.point", "tool")
    after = desk.state
    assert (after.view.at, after.pose, after.joints) == ("tool", before.pose, before.joints)
    assert desk.session.history.step.words == "Position of: tool point"
    labels = {value for _, name, value in panel.updates(Frame(after)) if name == "label"}
    assert labels == {
        "Pose of the tool (design units, degrees)",
        "Assembly modes: the tool (design units)",
    }
    desk.session.travel(UNDO)
    assert desk.state.view.at == "b4"
    assert desk.state.pose == before.pose


def test_choice_of_the_tool_waits_for_a_tool_away_from_b4(desk: Desk, services: Services) -> None:
    panel = MovePanel(services)

    def chips(state: State) -> list[str]:
        markup = [str(v) for _, name, v in panel.updates(Frame(state)) if name == "content"]
        return re.findall(r"<button[^>]*pose\.point.*?</button>", "".join(markup))

    b4, tool = chips(desk.state)
    assert "disabled" not in b4
    assert "disabled" in tool
    assert "b4 until the design has a tool elsewhere" in tool
    assert "disabled" not in chips(opened_at())[1]


def test_sliders_show_and_set_the_tool(desk: Desk, services: Services) -> None:
    panel = MovePanel(services)
    desk.session.do(Set("design", with_tool(OPTIMAL)))
    desk.session.do(Set("view.at", "tool"))

    def sliders() -> dict[str, Any]:
        Assigner(services.server).assign(panel.updates(Frame(desk.state)))
        return {widget.label: widget.handle for widget in widgets(services.server)}

    shown = [sliders()[name].value for name in "xyz"]
    np.testing.assert_allclose(shown, tool_of(desk.state), atol=1e-12)
    desk.use(sliders()["y"], 2.5)
    expected = [shown[0], 2.5, shown[2]]
    np.testing.assert_allclose(tool_of(desk.state), expected, atol=1e-12)
    assert desk.session.history.step.words == "y of the tool = 2.5"
    # A field does not show 2.5 with the rounding of the computation.
    assert sliders()["y"].value == 2.5
    desk.use(sliders()["roll (°)"], 20.0)
    np.testing.assert_allclose(tool_of(desk.state), expected, atol=1e-12)


@pytest.mark.parametrize("tool", [TOOL, (0.0, -4.0, 0.0), (0.0, 0.0, 0.0)])
def test_span_of_a_coordinate_has_room_for_the_tool_at_any_orientation(tool: Triple) -> None:
    for axis in range(3):
        b4, at = (position_span(opened_at(at, tool), axis) for at in ("b4", "tool"))
        room = float(np.linalg.norm(tool))
        # Ends are round numbers.
        assert at.low <= b4.low - 0.5 * room
        assert at.high >= b4.high + 0.5 * room
        assert (at == b4) == (room == 0.0)


def test_table_of_modes_has_the_tool_of_each() -> None:
    state = opened_at()
    rows = re.findall(r"<button[^>]*modes\.go.*?</button>", modes_table(Frame(state), ""))
    assert len(rows) == 8
    for mode, row in enumerate(rows):
        cells = re.findall(r"<span(?: [^>]*)?>([^<]*)", row)
        there = tool_of(SetMode(mode).apply(state))
        np.testing.assert_allclose([number(cell) for cell in cells[1:4]], there, atol=0.06)


def test_words_name_the_point() -> None:
    state = opened_at()
    at_home = GoHome().apply(state)
    x, y, z = (f"{value:.4g}".replace("-", "−") for value in tool_of(at_home))
    words = SetPose(at_home.pose).describe(state, at_home)
    assert words == f"Move the tool to {x}, {y}, {z}"
    of_b4 = Set("view.at", "b4").apply(at_home)
    assert SetPose(of_b4.pose).describe(of_b4, of_b4).startswith("Move b4 to ")
    assert SetPosition(0, 3.0).describe(of_b4, SetPosition(0, 3.0).apply(of_b4)) == "x = 3"


# The scene


def test_handle_is_at_the_tool_moves_it_and_turns_about_it(services: Services, desk: Desk) -> None:
    handle = DragHandle(services)
    desk.session.do(Set("design", with_tool(OPTIMAL)))
    desk.session.do(Set("view.at", "tool"))
    scale = scene_scale(desk.state)
    drawn = by_name(handle.updates(Placed(Frame(desk.state))))["/handle"]
    np.testing.assert_allclose(drawn["position"], scale * tool_of(desk.state), atol=1e-12)
    # As a drag leaves it: the platform follows, and nothing is written back to the gizmo.
    for place, quaternion in (
        ((8.0, 3.0, 9.5), desk.state.pose.quaternion),
        ((8.0, 3.0, 9.5), TILTED.quaternion),
    ):
        handle.handle.position, handle.handle.wxyz = place, quaternion
        desk.session.do(SetPose(handle.pose(desk.state)))
        np.testing.assert_allclose(scale * tool_of(desk.state), place, atol=1e-12)
        assert desk.state.pose.quaternion == quaternion
        written = by_name(handle.updates(Placed(Frame(desk.state))))["/handle"]
        assert "position" not in written
    # The gizmo goes to the other point, without the platform.
    desk.session.do(Set("view.at", "b4"))
    written = by_name(handle.updates(Placed(Frame(desk.state))))["/handle"]
    np.testing.assert_allclose(written["position"], scale * np.array(desk.state.pose.position))


@pytest.mark.parametrize("index", range(len(UNCOUPLED)))
@pytest.mark.parametrize("tool", [TOOL, (0.0, 0.0, 3.0), (2.0, 0.0, 0.0)])
def test_motion_is_drawn_as_the_path_of_the_tool(index: int, tool: Triple) -> None:
    placed = Placed(Frame(opened_at(tool=tool)))
    state, motion, travel = placed.frame.state, UNCOUPLED[index], placed.frame.travels[index]
    line = motion_line(placed, motion, travel)
    on_axis = (motion.frame, motion.kind) == ("platform", "rotation") and not any(
        value for value, axis in zip(tool, "xyz", strict=True) if axis != motion.axis
    )
    if on_axis:
        # The tool stays, and is in the middle of the arc.
        np.testing.assert_allclose(line.spoke[0], placed.scale * tool_of(state), atol=1e-9)
        return
    low, high = travel.low, travel.high
    if motion.kind == "translation":
        # It is drawn as far as it fits.
        ends = line.points[[0, -1]] / placed.scale - tool_of(state)
        low, high = (ends @ motion.line(state.pose)[1]).tolist()
    amounts = np.linspace(low, high, len(line.points))
    for amount, point in zip(amounts[::6], line.points[::6], strict=True):
        there = replace(state, pose=motion.moved(state.pose, float(amount)))
        np.testing.assert_allclose(point, placed.scale * tool_of(there), atol=1e-9)


def test_ellipsoid_and_gains_are_those_of_the_tool(services: Services) -> None:
    state = opened_at()
    arm = tool_of(state) - state.pose.position
    twists = np.linalg.inv(jacobian(state.design, state.pose.position, state.pose.rotation))
    # Velocities of the tool: v + ω × arm.
    velocities = twists[:3] + np.cross(twists[3:].T, arm).T
    gains = np.linalg.svd(velocities, compute_uv=False)
    rows = rows_of(performance_table(Frame(state)))
    assert [row[0] for row in rows[:2]] == ["speed of the tool", "force at the tool"]
    np.testing.assert_allclose([number(c) for c in rows[0][1:]], gains[[2, 0]], rtol=1e-2)
    np.testing.assert_allclose([number(c) for c in rows[1][1:]], 1.0 / gains[[0, 2]], rtol=1e-2)
    shown = Set("view.singular.ellipsoid", "speed").apply(state)
    drawn = by_name(EllipsoidScene(services).updates(Placed(Frame(shown))))
    expected = scene_scale(state) * tool_of(state)
    np.testing.assert_allclose(drawn["/ellipsoid/body"]["position"], expected, atol=1e-12)
    assert "speed of b4" in performance_table(Frame(opened_at("b4")))


def test_ball_is_about_the_tool_and_touches_where_the_tool_is_singular(services: Services) -> None:
    state = Set("view.singular.ball", True).apply(opened_at())
    placed = Placed(Frame(state))
    drawn = by_name(BallScene(services).updates(placed))
    centre, touch = (np.array(drawn[f"/ball/{name}"]["position"]) for name in ("ball", "touch"))
    np.testing.assert_allclose(centre, placed.scale * tool_of(state), atol=1e-12)
    x, y, z = (touch / placed.scale).tolist()
    there = SetPose(state.pose_at((x, y, z), state.pose)).apply(state)
    incidence = placed.frame.free_ball.incidence
    assert abs(Frame(there).snapshot.margins[incidence - 1]) < 1e-9
    np.testing.assert_allclose(
        np.linalg.norm(touch - centre), placed.scale * placed.frame.free_ball.radius, rtol=1e-12
    )


def test_caption_of_a_scene_has_the_position_of_the_tool() -> None:
    state = opened_at()
    caption = caption_of(state, dt.date(2026, 1, 1))
    found = re.search(r"the tool at \(([^)]*)\)", caption)
    assert found is not None
    np.testing.assert_allclose(
        [number(text) for text in found.group(1).split(", ")], tool_of(state), atol=0.06
    )


# Paths


def test_straight_path_is_the_line_of_the_tool(services: Services) -> None:
    state = opened_at(pose=None)
    state = Go().apply(Set("paths.goal", TILTED).apply(state))
    journey = state.journey
    assert journey is not None
    placed = Placed(Frame(state))
    points = by_name(PathScene(services).updates(placed))["/path/line"]["points"]
    timed = journey.trajectory
    # It goes straight, and ends are kept.
    along = points[-1, 1] - points[0, 0]
    off = np.cross(points[:, 0] - points[0, 0], along / np.linalg.norm(along))
    assert np.abs(off).max() < 1e-4
    assert journey.pose_at(timed.duration) == TILTED
    for crossing in journey.margins.crossings:
        at = crossing.pose
        assert abs(margins(at.position, at.rotation)[crossing.incidence - 1]) < 1e-9
    for index in (0, 40, 133, len(timed.time) - 2):
        there = replace(state, pose=journey.pose_at(float(timed.time[index])))
        np.testing.assert_allclose(
            points[index, 0], placed.scale * tool_of(there), rtol=0.0, atol=1e-5
        )


def test_path_keeps_its_moves_when_another_point_is_shown(services: Services) -> None:
    state = Go().apply(Set("paths.goal", TILTED).apply(opened_at(pose=None)))
    of_b4 = Set("view.at", "b4").apply(state)
    assert of_b4.journey == state.journey
    assert state.journey is not None
    placed = Placed(Frame(of_b4))
    points = by_name(PathScene(services).updates(placed))["/path/line"]["points"]
    expected = placed.scale * state.journey.trajectory.position
    np.testing.assert_allclose(points[:, 0], expected[:-1], rtol=0.0, atol=1e-5)


def test_file_keeps_the_point_and_the_path_of_the_tool() -> None:
    state = Go().apply(Set("paths.goal", TILTED).apply(opened_at(pose=None)))
    read = decode_session(encode_session(start_history(state), 3), "file").step.state
    assert read.journey is not None
    assert (read.view.at, read.journey.tool) == ("tool", TOOL)
    assert state.journey is not None
    assert read.journey.pose_at(1.5) == state.journey.pose_at(1.5)


def test_path_is_planned_for_the_tool(services: Services, desk: Desk) -> None:
    goal = Pose.of_yaw_pitch_roll((10.0, 4.0, 8.0), (-70.0, 8.0, 5.0))
    for action in (
        Set("design", with_tool(OPTIMAL)),
        Set("view.at", "tool"),
        Set("paths.goal", goal),
        Set("paths.kind", "planned"),
    ):
        desk.session.do(action)
    runner = PathRunner(services)
    desk.session.do(Go())
    runner.follow(Frame(desk.state))
    deadline = time.monotonic() + 120.0
    while desk.state.paths.is_planning:
        assert time.monotonic() < deadline
        time.sleep(0.05)
    journey = desk.state.journey
    assert journey is not None, desk.state.paths.problem
    corners = np.array([tool_of(replace(desk.state, pose=pose)) for pose in journey.poses])
    timed = journey.trajectory
    for share in range(25):
        seconds = timed.duration * share / 24.0
        place = float(np.interp(seconds, timed.time, timed.at))
        move = min(int(place), len(corners) - 2)
        between = corners[move] + (place - move) * (corners[move + 1] - corners[move])
        there = replace(desk.state, pose=journey.pose_at(seconds))
        np.testing.assert_allclose(tool_of(there), between, atol=1e-9)
        assert not Frame(there).snapshot.violations


@pytest.mark.parametrize("end", ["Start", "Goal"])
def test_typed_end_of_a_path_is_where_the_tool_is(services: Services, desk: Desk, end: str) -> None:
    panel = PathsPanel(services)
    desk.session.do(Set("design", with_tool(OPTIMAL)))
    desk.session.do(Set("view.at", "tool"))

    def shown() -> dict[str, Any]:
        Assigner(services.server).assign(panel.updates(Frame(desk.state)))
        return {widget.label: widget.handle for widget in widgets(services.server)}

    def typed() -> State:
        pose = getattr(desk.state.paths, end.lower())
        assert isinstance(pose, Pose)
        return replace(desk.state, pose=pose)

    desk.use(shown()[end], TYPED)
    before = typed()
    np.testing.assert_allclose(shown()[f"{end} x, y, z"].value, tool_of(before), atol=1e-12)
    desk.use(shown()[f"{end} x, y, z"], (9.0, 4.0, 8.0))
    assert typed().pose.quaternion == before.pose.quaternion
    desk.use(shown()[f"{end} angles (°)"], (-70.0, 10.0, 5.0))
    np.testing.assert_allclose(tool_of(typed()), (9.0, 4.0, 8.0), atol=1e-12)
    assert angles_of(typed().pose) == pytest.approx((-70.0, 10.0, 5.0))
    assert shown()[f"{end} x, y, z"].value == (9.0, 4.0, 8.0)


def test_numbers_of_an_end_are_those_of_the_tool() -> None:
    state = opened_at()
    text = re.sub("<.*?>", "", end_numbers(state, "start"))
    shown = [number(part) for part in text.partition(" ·")[0].split(", ")]
    np.testing.assert_allclose(shown, tool_of(state), atol=0.006)
    assert "of the tool in design units" in end_numbers(state, "start")


def test_undo_leads_back_to_the_point_of_each_step_and_leaves_the_rest_of_the_view(
    desk: Desk,
) -> None:
    for action in (
        Set("design", with_tool(OPTIMAL)),
        Set("view.at", "tool"),
        SetPosition(0, 9.0),
        Set("view.grid", False),
        Set("view.at", "b4"),
    ):
        desk.session.do(action)
    ats: list[Point] = []
    for _ in range(4):
        ats.append(desk.state.view.at)
        assert not desk.state.view.grid
        desk.session.travel(UNDO)
    assert ats == ["b4", "tool", "tool", "b4"]


# The workspace


def workspace_drawn(
    services: Services, state: State
) -> tuple[dict[str, dict[str, Any]], WorkspaceDrawing]:
    """Return the nodes of the workspace of a state, and its drawing."""
    feed = services.get(WorkspaceFeed)
    feed.follow(Frame(state))
    assert isinstance(services.worker, StubWorker)
    services.worker.work()
    assert feed.drawing is not None
    return by_name(WorkspaceScene(services).updates(Placed(Frame(state)))), feed.drawing


def triangles_in(nodes: dict[str, dict[str, Any]], state: State) -> FloatArray:
    """Return the triangles of the drawn solid in design units, shape (n, 3, 3)."""
    shells = [
        np.asarray(node["vertices"], dtype=np.float64)[node["faces"]] + node["position"]
        for name, node in nodes.items()
        if name.startswith("/workspace/shell/") and node["visible"]
    ]
    return np.concatenate(shells) / scene_scale(state)


def winding(triangles: FloatArray, point: FloatArray) -> float:
    """Return how often a closed surface goes around a point (Van Oosterom and Strackee)."""
    a, b, c = np.moveaxis(triangles - point, 1, 0)
    la, lb, lc = (np.linalg.norm(each, axis=1) for each in (a, b, c))
    volume = (a * np.cross(b, c)).sum(axis=1)
    rest = la * lb * lc
    for one, other, length in ((a, b, lc), (b, c, la), (c, a, lb)):
        rest = rest + (one * other).sum(axis=1) * length
    return float(2.0 * np.arctan2(volume, rest).sum() / (4.0 * np.pi))


def is_within(state: State, tool: FloatArray, orientation: Pose) -> bool:
    """Return whether the limits let the tool be at a position, in an orientation."""
    x, y, z = (tool - orientation.rotation @ np.array(state.design.tool.position)).tolist()
    return not evaluate(state.design, Pose((x, y, z), orientation.quaternion)).violations


def in_workspace(state: State, **changes: Any) -> State:
    return Set("view.workspace", replace(state.view.workspace, **changes)).apply(state)


@pytest.mark.parametrize("orientation", ["pose", "home"])
def test_drawn_solid_is_of_the_positions_of_the_tool(services: Services, orientation: str) -> None:
    state = in_workspace(opened_at(), solid=True, orientation=orientation)
    nodes, drawing = workspace_drawn(services, state)
    triangles = triangles_in(nodes, state)
    turned = workspace_pose(Frame(state))
    corners = triangles.reshape(-1, 3)
    lows, highs = corners.min(axis=0), corners.max(axis=0)
    rng = np.random.default_rng(5)
    seen: list[bool] = []
    for point in rng.uniform(lows, highs, (150, 3)):
        expected = is_within(state, point, turned)
        ring = point + 0.1 * np.concatenate([np.eye(3), -np.eye(3)])
        if any(is_within(state, near, turned) != expected for near in ring):
            # Facets are chords of the surface.
            continue
        assert round(winding(triangles, point)) == expected
        seen.append(expected)
    assert {*seen} == {True, False}
    # The box that the camera frames holds it, and the numbers tell its extent.
    box = WorkspaceScene(services).corners(Placed(Frame(state))) / scene_scale(state)
    np.testing.assert_allclose([box.min(axis=0), box.max(axis=0)], [lows, highs], atol=0.05)
    rows = rows_of(workspace_details(Frame(state), services.get(WorkspaceFeed)))
    extents = [row[1] for row in rows if row[0].startswith("Extent of the tool")]
    ends = np.array([[number(end) for end in text.split(" … ")] for text in extents])
    np.testing.assert_allclose(ends, np.stack([lows, highs], axis=1), atol=0.05)
    # It is the drawing of b4: the choice of the point computes nothing anew.
    of_b4 = Set("view.at", "b4").apply(state)
    assert workspace_request(Frame(of_b4)) == drawing.request


def test_hull_is_about_the_solid(services: Services) -> None:
    state = in_workspace(opened_at(), solid=True, hull=True)
    nodes, _ = workspace_drawn(services, state)
    hull = nodes["/workspace/hull"]
    corners = triangles_in(nodes, state).reshape(-1, 3)
    around = (np.asarray(hull["vertices"]) + hull["position"]) / scene_scale(state)
    np.testing.assert_allclose(around.min(axis=0), corners.min(axis=0), atol=0.05)
    np.testing.assert_allclose(around.max(axis=0), corners.max(axis=0), atol=0.05)


def facts_of(picture: str) -> dict[str, Any]:
    (data,) = re.findall(r'data-map="([^"]*)"', picture)
    return json.loads(html.unescape(data))


@pytest.mark.parametrize("axis", ["x", "y", "z"])
@pytest.mark.parametrize("flipped", [False, True])
def test_cut_is_at_the_coordinate_of_the_tool(services: Services, axis: str, flipped: bool) -> None:
    index, level = "xyz".index(axis), 6.5
    state = in_workspace(opened_at(), solid=True, cut=axis, level=level, flipped=flipped)
    nodes, drawing = workspace_drawn(services, state)
    along = triangles_in(nodes, state)[..., index]
    ends = float(along.min()), float(along.max())
    cut, other = ends if (axis == "y") != flipped else ends[::-1]
    assert cut == pytest.approx(level, abs=1e-5)
    assert abs(other - level) > 1.0
    updates = [*WorkspacePanel(services).updates(Frame(state))]
    shown: dict[str, Any] = {
        name: value
        for handle, name, value in updates
        if isinstance(handle, viser.GuiSliderHandle) and handle.label == "Cut at"
    }
    assert shown["value"] == pytest.approx(level)
    assert shown["min"] <= level <= shown["max"]
    # The map is read in coordinates of the tool, and its margins are those of poses there.
    (picture,) = (str(value) for _, _, value in updates if "data-map" in str(value))
    facts = facts_of(picture)
    assert facts["level"] == pytest.approx(level)
    for point in np.random.default_rng(6).normal(0.0, 8.0, (20, 3)):
        x, y, z = point.tolist()
        there = state.pose_at((x, y, z), state.pose)
        np.testing.assert_allclose(
            np.array(facts["gradients"]) @ (point - facts["offset"]),
            margins(there.position, there.rotation),
            atol=1e-12,
        )
    first, second = (k for k in range(3) if k != index)
    assert drawing.slice_map is not None
    for k, (one, at) in enumerate(((first, "lows"), (second, "lows"))):
        moved = drawing.slice_map.lows[k] + (tool_of(state) - state.pose.position)[one]
        assert facts[at][k] == pytest.approx(moved)
    # The cross is where the tool is.
    left, bottom, scale = facts["place"]
    (x, y) = re.findall(r'd="M([\d.]+),([\d.]+)h10m-5,-5v10"', picture)[0]
    tool = tool_of(state)
    assert float(x) + 5.0 == pytest.approx(
        left + scale * (tool[first] - facts["lows"][0]), abs=0.01
    )
    assert float(y) == pytest.approx(bottom - scale * (tool[second] - facts["lows"][1]), abs=0.01)


@pytest.mark.parametrize("orientation", ["pose", "home"])
def test_click_on_the_map_puts_the_tool_there(
    services: Services, desk: Desk, orientation: str
) -> None:
    WorkspacePanel(services)
    for action in (
        Set("design", with_tool(OPTIMAL)),
        Set("view.at", "tool"),
        SetAngle(1, 15.0),
        Set("view.workspace.orientation", orientation),
    ):
        desk.session.do(action)
    turned = workspace_pose(Frame(desk.state))
    desk.press(services.buttons, "workspace.go", "[12.5,-3,7.25]")
    np.testing.assert_allclose(tool_of(desk.state), (12.5, -3.0, 7.25), atol=1e-12)
    np.testing.assert_allclose(desk.state.pose.rotation, turned.rotation, atol=1e-12)
    assert desk.session.history.step.words == "Move the tool to 12.5, −3, 7.25"
    assert desk.complaints == []


@pytest.mark.parametrize("index", range(3))
def test_singular_planes_are_where_the_tool_is_singular(services: Services, index: int) -> None:
    state = in_workspace(opened_at(), planes=True)
    nodes = by_name(WorkspaceScene(services).updates(Placed(Frame(state))))
    corners = nodes[f"/singular/{index + 1}/plane"]["vertices"] / scene_scale(state)
    for shares in np.random.default_rng(7).dirichlet(np.ones(4), 5):
        x, y, z = (shares @ corners).tolist()
        there = state.pose_at((x, y, z), state.pose)
        assert margins(there.position, there.rotation)[index] == pytest.approx(0.0, abs=1e-5)


@pytest.mark.parametrize("orientation", ["pose", "home"])
def test_broken_limit_is_marked_from_the_tool_on(services: Services, orientation: str) -> None:
    state = in_workspace(opened_at(), solid=True, orientation=orientation)
    x, y, z = (2.5 * tool_of(state)).tolist()
    state = SetPose(state.pose_at((x, y, z), state.pose)).apply(state)
    nodes, _ = workspace_drawn(services, state)
    line = nodes["/workspace/broken/lines"]
    assert line["visible"]
    (start, end) = line["points"][0] / scene_scale(state)
    np.testing.assert_allclose(start, tool_of(state), atol=1e-5)
    name = nodes["/workspace/broken/label"]["text"].partition(":")[0]
    # On the surface of the limit the pose breaks it by nothing.
    turned = workspace_pose(Frame(state))
    (limit,) = (each for each in constraints(OPTIMAL, turned.rotation) if each.name == name)
    b4 = end - turned.rotation @ np.array(TOOL)
    assert float(limit.slack(b4)) == pytest.approx(0.0, abs=1e-4)


def test_paths_start_where_the_tool_is() -> None:
    state = in_workspace(opened_at(), solid=True, region="accessible", start="pose")
    assert workspace_start(Frame(state)) == state.pose.position
    at_home = in_workspace(state, orientation="home")
    start = workspace_start(Frame(at_home))
    turned = workspace_pose(Frame(at_home))
    there = np.array(start) + turned.rotation @ np.array(TOOL)
    np.testing.assert_allclose(there, tool_of(state), atol=1e-12)
    of_b4 = Set("view.at", "b4").apply(at_home)
    assert workspace_start(Frame(of_b4)) == state.pose.position


@pytest.mark.parametrize("what", ["workspace", "hull"])
def test_file_holds_the_positions_of_the_tool(what: str) -> None:
    rows = matrix_rows(TILTED.rotation)
    design, offset = with_tool(OPTIMAL), TILTED.rotation @ np.array(TOOL)
    x, y, z = offset.tolist()
    read: list[FloatArray] = []
    for moved in (None, (x, y, z)):
        data = export_mesh(design, rows, 0.2, "limits", None, NO_LOAD, what, "stl", moved)
        untyped: Any = trimesh
        mesh = untyped.load(io.BytesIO(data), file_type="stl")
        read.append(np.array(mesh.bounds) / design.unit_mm)
    np.testing.assert_allclose(read[1], read[0] + offset, atol=1e-4)
    assert exported_name("limits", what, (x, y, z)) == f"{what} of the tool"
    assert exported_name("accessible", what, (x, y, z)) == f"accessible {what} of the tool"


def test_step_file_holds_the_positions_of_the_tool() -> None:
    rows = matrix_rows(TILTED.rotation)
    design, offset = with_tool(OPTIMAL), TILTED.rotation @ np.array(TOOL)
    x, y, z = offset.tolist()
    data = export_mesh(design, rows, 0.2, "limits", None, NO_LOAD, "workspace", STEP, (x, y, z))
    solid = exact_workspace(design, TILTED.rotation).shifted(design.unit_mm * offset)
    # The head tells the time.
    expected = step_bytes(solid, f"workspace of the tool of {design.name}")
    assert data.partition(b"DATA;")[2] == expected.partition(b"DATA;")[2]


def test_sent_file_is_named_after_the_tool(services: Services, desk: Desk) -> None:
    files = WorkspaceFiles(services)
    desk.session.do(Set("design", with_tool(OPTIMAL)))
    downloads = services.downloads
    assert isinstance(downloads, StubDownloads)
    for at in ("b4", "tool"):
        desk.session.do(Set("view.at", at))
        files.send("workspace", "stl", 1)
        files.send_hull_at_home("stl", 1)
    names = [name.removeprefix(f"{OPTIMAL.name}-") for _, name in downloads.sent]
    assert names == [
        "workspace.stl",
        "hull.stl",
        "workspace-of-the-tool.stl",
        "hull-of-the-tool.stl",
    ]


# Orientations


def test_nodes_of_tilts_are_where_the_tool_is_at_tilt_zero(services: Services) -> None:
    state = Set("view.orientation.tilts", True).apply(opened_at())
    feed = services.get(TiltsFeed)
    feed.follow(Frame(state))
    assert isinstance(services.worker, StubWorker)
    services.worker.work()
    assert feed.drawing is not None
    scene, scale = OrientationScene(services), scene_scale(state)

    def nodes(state: State) -> FloatArray:
        drawn = by_name(scene.updates(Placed(Frame(state))))["/orientation/tilts"]["points"]
        return np.asarray(drawn, dtype=np.float64) / scale

    upright = SetTiltTorsion(1, 0.0).apply(state)
    tools = nodes(state)
    assert len(tools) == len(feed.drawing.positions)
    for index in range(0, len(tools), len(tools) // 40):
        assert is_within(state, tools[index], upright.pose)
        x, y, z = tools[index].tolist()
        there = replace(upright, pose=state.pose_at((x, y, z), upright.pose))
        tilt = float(feed.drawing.tilts[index]) - 1e-3
        tilted = (GoToTilt(azimuth, max(0.0, tilt)).apply(there) for azimuth in range(0, 360, 24))
        assert not any(Frame(each).snapshot.violations for each in tilted)
    box = scene.corners(Placed(Frame(state))) / scale
    np.testing.assert_allclose(
        [box.min(axis=0), box.max(axis=0)], [tools.min(axis=0), tools.max(axis=0)], atol=1e-5
    )
    # The cut is at the coordinate of the tool.
    level = float(np.median(tools[:, 0])) + 0.01
    parts = [
        nodes(in_workspace(state, cut="x", level=level, flipped=flipped))[:, 0]
        for flipped in (False, True)
    ]
    below, above = sorted(parts, key=lambda part: float(part.max()))
    assert below.max() < level < above.min()
    assert len(below) + len(above) == len(tools)


@pytest.mark.parametrize("over", ["inclusive", "total"])
def test_solid_over_tilts_is_of_the_positions_of_the_tool(
    services: Services, over: Literal["inclusive", "total"]
) -> None:
    state = opened_at(orientation=OrientationView(over=over, range=12.0))
    feed = services.get(RangeFeed)
    feed.follow(Frame(state))
    assert isinstance(services.worker, StubWorker)
    services.worker.work()
    assert feed.drawing is not None
    solid, turned = feed.drawing.solid, orientations_over(feed.drawing.request)
    triangles = np.asarray(solid.vertices)[solid.faces]
    poses = [Pose.of((0.0, 0.0, 0.0), rotation) for rotation in turned]
    has = any if over == "inclusive" else all
    lows, highs = solid.vertices.min(axis=0) - 1.0, solid.vertices.max(axis=0) + 1.0
    seen: list[bool] = []
    for point in np.random.default_rng(9).uniform(lows, highs, (25, 3)):
        ring = point + np.concatenate([np.zeros((1, 3)), 0.3 * np.eye(3), -0.3 * np.eye(3)])
        near = {has(is_within(state, each, pose) for pose in poses) for each in ring}
        if len(near) == 1:
            (expected,) = near
            assert round(winding(triangles, point)) == expected
            seen.append(expected)
    assert {*seen} == {True, False}


def test_tab_of_tilts_tells_how_far_the_platform_tilts_about_the_tool(services: Services) -> None:
    state = opened_at(tool=(0.5, 0.0, 2.0), pose=None)
    panel = OrientationPanel(services)
    texts = " ".join(str(v) for _, name, v in panel.updates(Frame(state)) if name == "content")
    (text,) = re.findall(r'ex-large">([\d.]+)°', texts)
    of_b4 = " ".join(
        str(v)
        for _, name, v in panel.updates(Frame(Set("view.at", "b4").apply(state)))
        if name == "content"
    )
    assert re.findall(r'ex-large">([\d.]+)°', of_b4) != [text]
    inside, beyond = (
        [
            Frame(GoToTilt(azimuth, float(text) + change).apply(state)).snapshot.violations
            for azimuth in range(-180, 180, 2)
        ]
        for change in (-0.1, 0.1)
    )
    assert not any(inside)
    assert any(beyond)
    feed = services.get(PositionFeed)
    feed.follow(Frame(state))
    assert isinstance(services.worker, StubWorker)
    services.worker.work()
    assert feed.drawing is not None
    # The same position as random orientations find it.
    x, y, z = tool_of(state).tolist()
    turns = Rotation.random(4000, random_state=np.random.default_rng(10)).as_matrix()
    poses = (state.pose_at((x, y, z), Pose.of(state.pose.position, turn)) for turn in turns)
    share = float(np.mean([not evaluate(state.design, pose).violations for pose in poses]))
    error = np.sqrt(share * (1.0 - share) / 4000)
    assert share > 0.0
    assert feed.drawing.share.share == pytest.approx(share, abs=4.0 * error)


# Elsewhere


def test_compared_workspaces_are_of_the_tool_of_each_design(services: Services) -> None:
    initial = with_tool(PRESETS["paper-initial"], (0.0, 2.0, 1.0))
    other = msgspec.structs.replace(initial, unit_mm=20.0)
    for at in ("b4", "tool"):
        state = Set("compared.look", Look(overlay=True)).apply(Pin(other).apply(opened_at(at)))
        feed = services.get(CompareFeed)
        feed.follow(Frame(state))
        assert isinstance(services.worker, StubWorker)
        services.worker.work()
        placed = Placed(Frame(state))
        scene = ComparedScene(services)
        nodes = by_name(scene.updates(placed))
        boxes = scene.corners(placed).reshape(-1, 8, 3)
        for design, name, box in zip((state.design, other), ("live", "A"), boxes, strict=True):
            home = home_pose(design)
            unit = scene_scale(state) * design.unit_mm / state.design.unit_mm
            node = nodes[f"/compared/{name}/workspace"]
            points = (np.asarray(node["vertices"]) + node["position"]) / unit
            if at == "tool":
                points = points - home.rotation @ np.array(design.tool.position)
            for p in points[:: len(points) // 50]:
                slack = min(limit.slack(p) for limit in constraints(design, home.rotation))
                assert abs(float(slack)) < 0.05 * design.reach
            corners = np.asarray(node["vertices"]) + node["position"]
            np.testing.assert_allclose(box.min(axis=0), corners.min(axis=0), atol=0.02)
            np.testing.assert_allclose(box.max(axis=0), corners.max(axis=0), atol=0.02)
            top = nodes[f"/compared/{name}/label"]["position"]
            assert top[2] == pytest.approx(corners[:, 2].max())


def test_tour_leads_near_a_singular_pose_with_the_tool_too() -> None:
    for step in STEPS:
        frame = Frame(opened_at(pose=None))
        after = step.show(frame).apply(frame.state)
        assert step.is_done(frame, Frame(after))


# A tool at b4


def test_tool_at_b4_shows_what_b4_shows(services: Services) -> None:
    shown: list[list[object]] = []
    for at in ("b4", "tool"):
        state = opened_at(at, (0.0, 0.0, 0.0))
        state = in_workspace(state, solid=True, planes=True, cut="y")
        workspace_drawn(services, state)
        placed = Placed(Frame(state))
        shown.append(
            [
                state.position,
                [position_span(state, axis) for axis in range(3)],
                SetAngle(0, 20.0).apply(state).pose,
                modes_table(placed.frame, ""),
                workspace_request(placed.frame),
                placed.frame.performance.translation.gain.tolist(),
                [
                    (name, key, np.asarray(value).tolist())
                    for name, node in by_name(WorkspaceScene(services).updates(placed)).items()
                    for key, value in node.items()
                ],
            ]
        )
    assert shown[0] == shown[1]
