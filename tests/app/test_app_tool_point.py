"""The tool point in the page: what is told of b4, set at b4 or drawn at b4 is so at the tool."""

from __future__ import annotations

import datetime as dt
import re
from dataclasses import replace
from typing import Any

import msgspec
import numpy as np
import pytest
from desk import Desk, by_name, number, rows_of
from hypothesis import given, strategies as st
from strategies import Case, all_cases

from explorer.app.features.feature import Services
from explorer.app.features.mechanism.marks import DragHandle
from explorer.app.features.mechanism.modes import modes_table
from explorer.app.features.mechanism.pose_panel import MovePanel
from explorer.app.features.orientation.actions import GoToTilt, SetTiltTorsion
from explorer.app.features.paths.actions import Go
from explorer.app.features.paths.panel import TYPED, PathsPanel, end_numbers
from explorer.app.features.paths.scene import PathScene
from explorer.app.features.sharing.scene_html import caption_of
from explorer.app.features.singularity.jog_scene import motion_line
from explorer.app.features.singularity.performance import performance_table
from explorer.app.features.singularity.scene import BallScene, EllipsoidScene
from explorer.app.inputs.ranges import position_span
from explorer.app.scene.placing import Placed, scene_scale
from explorer.app.session.session import UNDO
from explorer.app.state.actions import GoHome, Set, SetAngle, SetMode, SetPose, SetPosition
from explorer.app.state.frame import Frame
from explorer.app.state.state import State, angles_of, opened
from explorer.app.widgets.assigning import Assigner
from explorer.app.widgets.pieces import widgets
from explorer.mechanism.design import Design
from explorer.mechanism.design_file import PRESETS
from explorer.mechanism.machine import Tool
from explorer.mechanism.pose import Pose, Triple, rotation_from_quaternion
from explorer.mechanism.tool_point import Point
from explorer.numerics.arrays import FloatArray
from explorer.singularity.jacobian import jacobian
from explorer.singularity.uncoupled import UNCOUPLED

OPTIMAL = PRESETS["paper-optimal"]
TOOL: Triple = (1.0, 0.0, 3.0)
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
    np.testing.assert_allclose(drawn["/ellipsoid/speed"]["position"], expected, atol=1e-12)
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


def test_path_is_drawn_as_the_track_of_the_tool(services: Services) -> None:
    state = opened_at(pose=None)
    state = Go().apply(Set("paths.goal", TILTED).apply(state))
    journey = state.journey
    assert journey is not None
    placed = Placed(Frame(state))
    points = by_name(PathScene(services).updates(placed))["/path/line"]["points"]
    timed = journey.trajectory
    for index in (0, 40, 133, len(timed.time) - 2):
        there = replace(state, pose=journey.pose_at(float(timed.time[index])))
        np.testing.assert_allclose(
            points[index, 0], placed.scale * tool_of(there), rtol=0.0, atol=1e-5
        )


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
