"""The tool point in the page: what is told of b4, set at b4 or drawn at b4 is so at the tool."""

from __future__ import annotations

import datetime as dt
import html
import io
import json
import re
from dataclasses import replace
from typing import Any

import msgspec
import numpy as np
import pytest
import trimesh
import viser
from desk import Desk, ScriptedBrowser, by_name, controls_of, markup_of, number, rows_of
from hypothesis import given, strategies as st
from services import StubDownloads, StubJobs
from strategies import Case, all_cases
from workspace_feeds import draw

from explorer.app.features.compare.feature import pin
from explorer.app.features.compare.scene import SCENES
from explorer.app.features.compare.work import FEEDS, CompareView
from explorer.app.features.feature import Services
from explorer.app.features.mechanism.feature import MovePanel
from explorer.app.features.mechanism.marks import DragHandle
from explorer.app.features.mechanism.modes import modes_table
from explorer.app.features.orientation.feature import OrientationPanel, OrientationScene
from explorer.app.features.orientation.work import TILTS_FEED, set_tilt_torsion
from explorer.app.features.paths.actions import go
from explorer.app.features.paths.editor import TYPED, numbers_of
from explorer.app.features.paths.feature import PathScene
from explorer.app.features.paths.panel import PathsPanel
from explorer.app.features.paths.state import Paths, Stop, journey_of
from explorer.app.features.sharing.scene_files import caption_of
from explorer.app.features.singularity.feature import performance_table
from explorer.app.features.singularity.scene import BallScene, EllipsoidScene
from explorer.app.features.workspace.feature import WorkspacePanel
from explorer.app.features.workspace.feeds import (
    WORKSPACE_FEED,
    send_workspace,
    workspace_pose,
    workspace_request,
    workspace_start,
)
from explorer.app.features.workspace.scene import WorkspaceScene
from explorer.app.features.workspace.words import workspace_details
from explorer.app.features.workspace.work import (
    Selection,
    WorkspaceDrawing,
    export_mesh,
    rows_of as matrix_rows,
)
from explorer.app.inputs.ranges import position_span
from explorer.app.scene.placing import Placed, scene_scale
from explorer.app.session.history import start_history
from explorer.app.session.session import UNDO
from explorer.app.state.actions import Set
from explorer.app.state.frame import Frame
from explorer.app.state.moves import set_angle, set_mode, set_pose, set_position
from explorer.app.state.state import State, open_state
from explorer.app.storage.session_file import decode_session, encode_session
from explorer.mechanism.configuration import Point
from explorer.mechanism.design import Design
from explorer.mechanism.design_file import PRESETS
from explorer.mechanism.kinematics import jacobian
from explorer.mechanism.machine import Tool
from explorer.mechanism.margins import margins
from explorer.mechanism.pose import Pose, Triple, rotation_from_quaternion
from explorer.numerics.arrays import FloatArray
from explorer.workspace.workspace import Workspace

OPTIMAL = PRESETS["paper-optimal"]
TOOL: Triple = (1.0, 0.0, 3.0)
TILTED = Pose.of_yaw_pitch_roll((9.0, 4.0, 8.0), (-60.0, 15.0, 10.0))


def with_tool(design: Design, tool: Triple = TOOL) -> Design:
    return msgspec.structs.replace(design, tool=Tool(position=tool))


def state_at(
    at: Point = "tool", tool: Triple = TOOL, pose: Pose | None = TILTED, **view: Any
) -> State:
    """Return the paper's optimum with a tool, and the point that is shown."""
    state = open_state(with_tool(OPTIMAL, tool), pose)
    return Set("view", replace(state.view, at=at, lengths="design units", **view)).apply(state)


def tool_of(state: State) -> FloatArray:
    """Return the tool point in the base frame, from the matrix of the quaternion."""
    rotation = rotation_from_quaternion(state.pose.quaternion)
    return np.array(state.pose.position) + rotation @ np.array(state.design.tool.position)


@st.composite
def states(draw: st.DrawFn) -> tuple[State, float]:
    """Draw a state with a tool that is set, and the largest length of the computation."""
    case: Case = draw(all_cases())
    x, y, z = (case.design.reach * draw(st.floats(-2.0, 2.0)) for _ in range(3))
    state = open_state(with_tool(case.design, (x, y, z)), case.pose)
    return Set("view.at", "tool").apply(state), max(case.size, abs(x), abs(y), abs(z))


# Positions and angles


@given(states(), st.sampled_from((0, 1, 2)), st.floats(-3.0, 3.0), st.floats(0.0, 90.0))
def test_coordinate_of_the_tool_is_set_alone_and_angles_turn_about_the_tool(
    drawn: tuple[State, float], axis: int, to: float, angle: float
) -> None:
    state, size = drawn
    after = set_position(axis, to * size).apply(state)
    expected = tool_of(state)
    expected[axis] = to * size
    np.testing.assert_allclose(tool_of(after), expected, rtol=0.0, atol=1e-14 * size)
    assert after.pose.quaternion == state.pose.quaternion
    assert after.yaw_pitch_roll == state.yaw_pitch_roll
    others = [i for i in range(3) if i != axis]
    assert [after.pose.position[i] for i in others] == [state.pose.position[i] for i in others]
    by_angle = set_angle(axis, angle).apply(state)
    assert by_angle.yaw_pitch_roll[axis] == angle
    by_tilt = set_tilt_torsion(axis, angle).apply(state)
    assert by_tilt.tilt_torsion[axis] == angle
    for after in (by_angle, by_tilt):
        np.testing.assert_allclose(tool_of(after), tool_of(state), rtol=0.0, atol=1e-14 * size)


def test_choice_of_the_point_is_one_step_that_can_be_undone(desk: Desk, services: Services) -> None:
    panel = MovePanel(services)

    def has_tool_disabled() -> bool:
        markup = markup_of(panel, desk.state)
        return "disabled" in re.findall(r"<button[^>]*view\.at.*?</button>", markup)[1]

    assert has_tool_disabled()
    desk.session.do(Set("design", with_tool(OPTIMAL)))
    assert not has_tool_disabled()
    before = desk.state
    desk.press(services.buttons, "view.at", "tool")
    after = desk.state
    assert replace(after, view=before.view) == before
    assert desk.session.history.step.words == "Position of: tool point"
    assert "the tool in units" in modes_table(Frame(after), "")


def test_sliders_show_and_set_the_tool(desk: Desk, services: Services) -> None:
    panel = MovePanel(services)
    desk.session.do(Set("design", with_tool(OPTIMAL)))
    desk.session.do(Set("view.at", "tool"))

    def sliders() -> dict[str, Any]:
        return controls_of(services, panel, desk.state)

    shown = [sliders()[name].value for name in "xyz"]
    np.testing.assert_allclose(shown, tool_of(desk.state), atol=1e-12)
    desk.use(sliders()["y"], 2.5)
    expected = [shown[0], 2.5, shown[2]]
    np.testing.assert_allclose(tool_of(desk.state), expected, atol=1e-12)
    assert desk.session.history.step.words == "y of the tool = 2.5 units"
    # A field does not show 2.5 with the rounding of the computation.
    assert sliders()["y"].value == 2.5
    desk.use(sliders()["roll (°)"], 20.0)
    np.testing.assert_allclose(tool_of(desk.state), expected, atol=1e-12)


@pytest.mark.parametrize("tool", [TOOL, (0.0, -4.0, 0.0), (0.0, 0.0, 0.0)])
def test_span_of_a_coordinate_has_room_for_the_tool_at_any_orientation(tool: Triple) -> None:
    for axis in range(3):
        b4, at = (position_span(state_at(at, tool), axis) for at in ("b4", "tool"))
        room = float(np.linalg.norm(tool))
        # Ends are round numbers.
        assert at.low <= b4.low - 0.5 * room
        assert at.high >= b4.high + 0.5 * room
        assert (at == b4) == (room == 0.0)


def test_words_and_numbers_are_those_of_the_point() -> None:
    state = state_at()
    rows = re.findall(r"<button[^>]*modes\.go.*?</button>", modes_table(Frame(state), ""))
    for mode, row in enumerate(rows):
        cells = re.findall(r"<span(?: [^>]*)?>([^<]*)", row)
        there = tool_of(set_mode(mode).apply(state))
        np.testing.assert_allclose([number(cell) for cell in cells[1:4]], there, atol=0.06)
    caption = caption_of(state, dt.date(2026, 1, 1)).partition("the tool at (")[2]
    numbers = re.sub("<.*?>", "", numbers_of(state, None))
    for text in (caption.partition(")")[0], numbers.partition(" ·")[0]):
        shown = [number(part) for part in text.split(", ")]
        np.testing.assert_allclose(shown, tool_of(state), atol=0.06)
    assert "x, y, z of the tool in units" in numbers_of(state, None)


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
        desk.session.do(set_pose(handle.pose(desk.state)))
        np.testing.assert_allclose(scale * tool_of(desk.state), place, atol=1e-12)
        assert desk.state.pose.quaternion == quaternion
        written = by_name(handle.updates(Placed(Frame(desk.state))))["/handle"]
        assert "position" not in written
    # The gizmo goes to the other point, without the platform.
    desk.session.do(Set("view.at", "b4"))
    written = by_name(handle.updates(Placed(Frame(desk.state))))["/handle"]
    np.testing.assert_allclose(written["position"], scale * np.array(desk.state.pose.position))


def test_ellipsoid_and_gains_are_those_of_the_tool(services: Services) -> None:
    state = state_at()
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
    assert "speed of b4" in performance_table(Frame(state_at("b4")))


@pytest.mark.parametrize("tool", [TOOL, (0.0, 0.0, 0.0)])
def test_ball_is_about_the_tool_and_touches_where_the_tool_is_singular(
    services: Services, tool: Triple
) -> None:
    state = Set("view.singular.ball", True).apply(state_at(tool=tool))
    placed = Placed(Frame(state))
    drawn = by_name(BallScene(services).updates(placed))
    centre, touch = (np.array(drawn[f"/ball/{name}"]["position"]) for name in ("ball", "touch"))
    np.testing.assert_allclose(centre, placed.scale * tool_of(state), atol=1e-12)
    x, y, z = (touch / placed.scale).tolist()
    there = set_pose(state.pose_at((x, y, z), state.pose)).apply(state)
    incidence = placed.frame.free_ball.incidence
    assert abs(Frame(there).snapshot.margins[incidence - 1]) < 1e-9
    np.testing.assert_allclose(
        np.linalg.norm(touch - centre), placed.scale * placed.frame.free_ball.radius, rtol=1e-12
    )


# Paths


def test_straight_path_is_the_line_of_the_tool(services: Services) -> None:
    state = state_at(pose=None)
    state = go().apply(Set("paths.stops", (Stop(), Stop(TILTED))).apply(state))
    journey = journey_of(state)
    assert journey is not None
    placed = Placed(Frame(state))
    points = by_name(PathScene(services).updates(placed))["/path/line"]["points"]
    timed = journey.trajectory
    read = decode_session(encode_session(start_history(state)), "file").step.state
    assert (read.view.at, journey_of(read)) == ("tool", replace(journey, is_playing=False))
    # It goes straight, and ends are kept.
    along = points[-1, 1] - points[0, 0]
    off = np.cross(points[:, 0] - points[0, 0], along / np.linalg.norm(along))
    assert np.abs(off).max() < 1e-4
    assert journey.pose_at(timed.duration) == TILTED
    for index in (0, 40, 133, len(timed.time) - 2):
        there = replace(state, pose=journey.pose_at(float(timed.time[index])))
        np.testing.assert_allclose(
            points[index, 0], placed.scale * tool_of(there), rtol=0.0, atol=1e-5
        )
    # The choice of another point changes the line that is drawn and no move.
    of_b4 = Set("view.at", "b4").apply(state)
    assert journey_of(of_b4) == journey
    points = by_name(PathScene(services).updates(Placed(Frame(of_b4))))["/path/line"]["points"]
    expected = placed.scale * timed.position[:-1]
    np.testing.assert_allclose(points[:, 0], expected, rtol=0.0, atol=1e-5)


def test_typed_pose_of_a_path_is_where_the_tool_is(services: Services, desk: Desk) -> None:
    panel = PathsPanel(services)
    desk.session.do(Set("design", with_tool(OPTIMAL)))
    desk.session.do(Set("view.at", "tool"))

    def controls() -> dict[str, Any]:
        return controls_of(services, panel, desk.state)

    def typed() -> State:
        pose = Paths.of(desk.state).edited_pose
        assert pose is not None
        return replace(desk.state, pose=pose)

    desk.press(services.buttons, "paths.choose", "1")
    desk.use(controls()["Pose"], TYPED)
    before = typed()
    np.testing.assert_allclose(
        controls()["Pose x, y, z (units)"].value, tool_of(before), atol=1e-12
    )
    desk.use(controls()["Pose x, y, z (units)"], (9.0, 4.0, 8.0))
    assert typed().pose.quaternion == before.pose.quaternion
    desk.use(controls()["Pose angles (°)"], (-70.0, 10.0, 5.0))
    np.testing.assert_allclose(tool_of(typed()), (9.0, 4.0, 8.0), atol=1e-12)
    assert typed().pose.yaw_pitch_roll == pytest.approx((-70.0, 10.0, 5.0))
    assert controls()["Pose x, y, z (units)"].value == (9.0, 4.0, 8.0)


def test_undo_leads_back_to_the_point_of_each_step_and_leaves_the_rest_of_the_view(
    desk: Desk,
) -> None:
    for action in (
        Set("design", with_tool(OPTIMAL)),
        Set("view.at", "tool"),
        set_position(0, 9.0),
        Set("view.grid", False),
        Set("view.at", "b4"),
    ):
        desk.session.do(action)
    for at in ("b4", "tool", "tool", "b4"):
        assert (desk.state.view.at, desk.state.view.grid) == (at, False)
        desk.session.do(UNDO)


# The workspace


def draw_workspace_of(
    services: Services, state: State
) -> tuple[dict[str, dict[str, Any]], WorkspaceDrawing]:
    """Return the nodes of the workspace of a state, and its drawing."""
    drawing = draw(services, WORKSPACE_FEED, state)
    return by_name(WorkspaceScene(services).updates(Placed(Frame(state)))), drawing


def corners_of(nodes: dict[str, dict[str, Any]], state: State) -> FloatArray:
    """Return the corners of the drawn solid and of its hull in design units, shape (n, 3)."""
    drawn = [
        np.asarray(node["vertices"], dtype=np.float64) + node["position"]
        for name, node in nodes.items()
        if name.startswith(("/workspace/shell/", "/workspace/hull")) and node["visible"]
    ]
    return np.concatenate(drawn) / scene_scale(state)


def in_workspace(state: State, **changes: Any) -> State:
    return Set("view.workspace", replace(state.view.workspace, **changes)).apply(state)


@pytest.mark.parametrize("orientation", ["pose", "home"])
def test_drawn_solid_and_hull_are_those_of_b4_moved_by_the_arm(
    services: Services, orientation: str
) -> None:
    state = in_workspace(state_at(), solid=True, orientation=orientation, hull=True)
    of_b4 = Set("view.at", "b4").apply(state)
    # The choice of the point computes nothing anew.
    assert workspace_request(Frame(of_b4)) == workspace_request(Frame(state))
    b4, corners = (corners_of(draw_workspace_of(services, s)[0], s) for s in (of_b4, state))
    arm = workspace_pose(Frame(state)).rotation @ np.array(TOOL)
    np.testing.assert_allclose(corners, b4 + arm, atol=1e-5)
    # The box that the camera frames holds it, and the numbers tell its extent.
    ends = np.array([corners.min(axis=0), corners.max(axis=0)])
    box = WorkspaceScene(services).corners(Placed(Frame(state))) / scene_scale(state)
    np.testing.assert_allclose([box.min(axis=0), box.max(axis=0)], ends, atol=0.05)
    rows = rows_of(workspace_details(Frame(state), services.get(WORKSPACE_FEED)))
    extents = [row[1] for row in rows if row[0].startswith("Extent of the tool")]
    numbers = [
        [number(end) for end in text.removesuffix(" units  ").split(" … ")] for text in extents
    ]
    np.testing.assert_allclose(numbers, ends.T, atol=0.05)


@pytest.mark.parametrize(("axis", "flipped"), [("x", False), ("y", True), ("z", False)])
def test_cut_and_its_map_at_the_tool_are_those_of_b4_moved_by_the_arm(
    services: Services, axis: str, flipped: bool
) -> None:
    index, level, arm = "xyz".index(axis), 6.5, TILTED.rotation @ np.array(TOOL)
    panel = services.get(WorkspacePanel)
    corners: list[FloatArray] = []
    facts: list[dict[str, Any]] = []
    readings: list[str] = []
    crosses: list[list[str]] = []
    levels: dict[Point, float] = {"b4": level - float(arm[index]), "tool": level}
    for at, of_point in levels.items():
        state = in_workspace(
            state_at(at), solid=True, cut=axis, level=of_point, flipped=flipped, hull=False
        )
        corners.append(corners_of(draw_workspace_of(services, state)[0], state))
        updates = [*panel.updates(Frame(state))]
        shown: dict[str, Any] = {
            name: value
            for handle, name, value in updates
            if isinstance(handle, viser.GuiSliderHandle) and handle.label.startswith("Cut at")
        }
        assert shown["value"] == pytest.approx(of_point)
        assert shown["min"] <= of_point <= shown["max"]
        (picture,) = (str(value) for _, _, value in updates if "data-map" in str(value))
        (data,) = re.findall(r'data-map="([^"]*)"', picture)
        facts.append(json.loads(html.unescape(data)))
        crosses.append(re.findall(r'd="(M[\d.]+,[\d.]+h10m-5,-5v10)"', picture))
        assert facts[-1]["level"] == pytest.approx(of_point)
        place = np.array([12.0, 5.0, 8.0]) + (arm if at == "tool" else 0.0)
        client: Any = ScriptedBrowser()
        services.buttons.press("workspace.read", str(place.tolist()), client)
        readings += [script.partition(": ")[2] for script in client.scripts]
    np.testing.assert_allclose(corners[1], corners[0] + arm, atol=1e-5)
    b4, tool = facts
    # The measure at a place of the map is that of a pose with its point there.
    assert readings[0] == readings[1]
    others = [k for k in range(3) if k != index]
    np.testing.assert_allclose(np.subtract(tool["lows"], b4["lows"]), arm[others], atol=1e-9)
    assert crosses[0] == crosses[1] != []


@pytest.mark.parametrize(
    ("at", "orientation"), [("tool", "pose"), ("tool", "home"), ("b4", "home")]
)
def test_click_on_the_map_puts_the_point_there_in_one_step(
    services: Services, desk: Desk, at: Point, orientation: str
) -> None:
    WorkspacePanel(services)
    for action in (
        Set("design", with_tool(OPTIMAL)),
        Set("view.at", at),
        set_angle(1, 15.0),
        Set("view.workspace.orientation", orientation),
    ):
        desk.session.do(action)
    turned = workspace_pose(Frame(desk.state))
    steps = len(desk.session.history.steps)
    desk.press(services.buttons, "workspace.go", "[12.5,-3,7.25]")
    np.testing.assert_allclose(desk.state.position, (12.5, -3.0, 7.25), atol=1e-12)
    np.testing.assert_allclose(desk.state.pose.rotation, turned.rotation, atol=1e-12)
    assert len(desk.session.history.steps) == steps + 1
    point = "the tool" if at == "tool" else "b4"
    assert desk.session.history.step.words == f"Move {point} to 12.5, −3, 7.25 units"
    assert desk.complaints == []


def test_singular_planes_are_where_the_tool_is_singular(services: Services) -> None:
    state = in_workspace(state_at(), planes=True)
    nodes = by_name(WorkspaceScene(services).updates(Placed(Frame(state))))
    rng = np.random.default_rng(7)
    for index in range(3):
        corners = nodes[f"/singular/{index + 1}/plane"]["vertices"] / scene_scale(state)
        for shares in rng.dirichlet(np.ones(4), 5):
            x, y, z = (shares @ corners).tolist()
            there = state.pose_at((x, y, z), state.pose)
            assert margins(there.position, there.rotation)[index] == pytest.approx(0.0, abs=1e-5)


def test_paths_start_where_the_tool_is() -> None:
    state = in_workspace(state_at(), solid=True, region="accessible", start="pose")
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
    design, offset = with_tool(OPTIMAL), TILTED.rotation @ np.array(TOOL)
    selection = Selection(design, matrix_rows(TILTED.rotation))
    x, y, z = offset.tolist()
    bounds: list[FloatArray] = []
    for arm in (None, (x, y, z)):
        data = export_mesh(selection, 0.8, what, "stl", arm)
        untyped: Any = trimesh
        mesh = untyped.load(io.BytesIO(data), file_type="stl")
        bounds.append(np.array(mesh.bounds) / design.unit_mm)
    np.testing.assert_allclose(bounds[1], bounds[0] + offset, atol=1e-4)


def test_file_of_the_workspace_is_named_after_the_tool(services: Services, desk: Desk) -> None:
    downloads = services.downloads
    assert isinstance(downloads, StubDownloads)
    desk.session.do(Set("design", with_tool(OPTIMAL)))
    for at in ("b4", "tool"):
        desk.session.do(Set("view.at", at))
        send_workspace(services, "workspace", "stl", 1)
        send_workspace(services, "hull", "stl", 1)
    assert [name.removeprefix(f"{OPTIMAL.name}-") for _, name in downloads.sent] == [
        "workspace.stl",
        "hull.stl",
        "workspace-of-the-tool.stl",
        "hull-of-the-tool.stl",
    ]


# Orientations


def test_nodes_of_tilts_are_where_the_tool_is_at_tilt_zero(services: Services) -> None:
    state = Set("view.tilts", True).apply(state_at())
    drawing = draw(services, TILTS_FEED, state)
    scene, scale = OrientationScene(services), scene_scale(state)

    def nodes(state: State) -> FloatArray:
        drawn = by_name(scene.updates(Placed(Frame(state))))["/orientation/tilts"]["points"]
        return np.asarray(drawn, dtype=np.float64) / scale

    upright = set_tilt_torsion(1, 0.0).apply(state)
    tools = nodes(state)
    assert len(tools) == len(drawing.positions)
    for index in range(0, len(tools), len(tools) // 40):
        x, y, z = tools[index].tolist()
        there = replace(upright, pose=state.pose_at((x, y, z), upright.pose))
        assert not Frame(there).snapshot.violations
    # The cut is at the coordinate of the tool.
    level = float(np.median(tools[:, 0])) + 0.01
    parts = [
        nodes(in_workspace(state, cut="x", level=level, flipped=flipped))[:, 0]
        for flipped in (False, True)
    ]
    below, above = sorted(parts, key=lambda part: float(part.max()))
    assert below.max() < level < above.min()
    assert len(below) + len(above) == len(tools)


def test_tab_of_tilts_has_the_largest_tilt_about_the_tool(services: Services) -> None:
    state = state_at(tool=(0.5, 0.0, 2.0), pose=None)
    panel = OrientationPanel(services)

    def largest_tilt(state: State) -> str:
        return re.findall(r'ex-large">([\d.]+)°', markup_of(panel, state))[0]

    text = largest_tilt(state)
    assert largest_tilt(Set("view.at", "b4").apply(state)) != text
    inside, beyond = (
        [
            Frame(set_tilt_torsion(1, float(text) + change).apply(towards)).snapshot.violations
            for towards in (set_tilt_torsion(0, each).apply(state) for each in range(-180, 180, 4))
        ]
        for change in (-0.1, 0.1)
    )
    assert not any(inside)
    assert any(beyond)


# Elsewhere


def test_compared_workspaces_are_of_the_tool_of_each_design(services: Services) -> None:
    initial = with_tool(PRESETS["paper-initial"], (0.0, 2.0, 1.0))
    other = msgspec.structs.replace(initial, unit_mm=20.0)
    for at in ("b4", "tool"):
        state = Set("compared.look", CompareView(overlay=True)).apply(
            pin(other).apply(state_at(at))
        )
        for feed in FEEDS:
            services.get(feed).follow(Frame(state))
        assert isinstance(services.jobs, StubJobs)
        services.jobs.work()
        placed = Placed(Frame(state))
        scenes = [services.get(part) for part in SCENES]
        nodes = by_name(update for scene in scenes for update in scene.updates(placed))
        boxes = [scene.corners(placed) for scene in scenes[:2]]
        for design, name, box in zip((state.design, other), ("live", "A"), boxes, strict=True):
            home = design.home_pose
            unit = scene_scale(state) * design.unit_mm / state.design.unit_mm
            node = nodes[f"/compared/{name}/workspace"]
            points = (np.asarray(node["vertices"]) + node["position"]) / unit
            if at == "tool":
                points = points - home.rotation @ np.array(design.tool.position)
            for p in points[:: len(points) // 50]:
                slack = min(limit.slack(p) for limit in Workspace(design, home.rotation).limits)
                assert abs(float(slack)) < 0.05 * design.reach
            corners = np.asarray(node["vertices"]) + node["position"]
            ends = [corners.min(axis=0), corners.max(axis=0)]
            np.testing.assert_allclose([box.min(axis=0), box.max(axis=0)], ends, atol=0.02)
