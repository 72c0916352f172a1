"""Paths on the page: straight, planned, played, plotted, exported, and their loads; no browser."""

from __future__ import annotations

import asyncio
import csv
import io
import math
import os
import re
import signal
import time
from collections.abc import Generator
from contextlib import suppress
from dataclasses import replace
from importlib.util import find_spec
from types import SimpleNamespace
from typing import Any

import msgspec
import numpy as np
import pytest
from desk import Desk, controls_of
from services import StubDownloads, StubJobs, services_for

from explorer.app.features.feature import Services
from explorer.app.features.loads.load import Loads, weights_of_parts
from explorer.app.features.mechanism.marks import DragHandle
from explorer.app.features.paths.actions import (
    SetLaw,
    advance_journey,
    draw_drives,
    go,
    play,
    request_for,
    set_path_time,
    take_plan,
)
from explorer.app.features.paths.editor import MODES, PRESENT, TYPED, numbers_of
from explorer.app.features.paths.feature import DIED, PathRunner, PathScene, path_chip
from explorer.app.features.paths.panel import (
    CANCEL,
    PathsPanel,
    drives_html,
    path_title,
    plan_words,
)
from explorer.app.features.paths.plots import (
    PLACE,
    crossing_time,
    crossing_words,
    loads_along,
    margins_html,
    margins_over,
)
from explorer.app.features.paths.state import (
    MOST_STOPS,
    WATCH_SECONDS,
    Journey,
    Paths,
    Stop,
    StopAt,
    journey_of,
)
from explorer.app.features.paths.stops import (
    add_present,
    close_path,
    copy_stop,
    lift_stop,
    poses_of,
    remove_stop,
    set_stop,
    set_stops,
    stops_in_table,
    stops_of,
)
from explorer.app.features.sharing.links import decode_link, open_link
from explorer.app.scene.placing import Placed
from explorer.app.state.actions import Action, Set, open_design
from explorer.app.state.frame import Frame
from explorer.app.state.geometry import set_variable
from explorer.app.state.moves import set_pose, set_position
from explorer.app.state.parts import value_at, with_value
from explorer.app.state.state import State, joints_of, open_state
from explorer.errors import InputError
from explorer.jobs.jobs import Jobs
from explorer.mechanism.design import Design
from explorer.mechanism.design_file import PRESETS
from explorer.mechanism.kinematics import forward
from explorer.mechanism.machine import Actuators, Guide, Payload, Struts, Tool
from explorer.mechanism.margins import margins, mode_of
from explorer.mechanism.pose import Pose, Triple
from explorer.numerics.arrays import FloatArray
from explorer.numerics.checks import LEAST, MOST
from explorer.numerics.number_text import UNITS
from explorer.paths.drives import TimedPath, drives_along, law_of_path
from explorer.paths.loads import path_loads
from explorer.workspace.accessible.radii import with_radius
from explorer.workspace.limits.valid_poses import poses_are_valid

OPTIMAL = PRESETS["paper-optimal"]
TILTED = Pose.of_yaw_pitch_roll((10.0, 5.0, 9.0), (-73.1, 12.0, 9.0))
GOAL = Pose.of_yaw_pitch_roll((14.0, -2.0, 6.0), (-73.0, 10.0, 0.0))


class Bench(Desk):
    """A session whose frames a path runner follows."""

    def __init__(self) -> None:
        self.reports: list[str] = []
        self.times: list[float] = []
        super().__init__(open_state(OPTIMAL))
        self.jobs = Jobs(self.reports.append)
        self.services = services_for(session=self.session, jobs=self.jobs)
        self.runner = PathRunner(self.services)

    def draw(self, frame: Frame) -> None:
        if (journey := journey_of(frame.state)) is not None:
            self.times.append(journey.at)
        self.runner.follow(frame)

    def do(self, *actions: Action) -> None:
        for action in actions:
            self.session.do(action)

    def wait_for_plan(self, request: int) -> State:
        return self.wait(lambda s: Paths.of(s).request == request and not Paths.of(s).is_planning)


@pytest.fixture
def bench() -> Generator[Bench]:
    bench = Bench()
    yield bench
    bench.session.stop()
    bench.services.stop()
    bench.jobs.stop()


def with_ends(state: State, start: StopAt = None, goal: StopAt = None) -> State:
    ends = (Stop(start),) if goal is None else (Stop(start), Stop(goal))
    return with_value(state, "paths", replace(Paths.of(state), stops=ends))


def goal_of(state: State) -> StopAt:
    return stops_of(state)[-1].at


def start_between(first: int, last: int, pose: Pose = TILTED) -> State:
    return go().apply(with_ends(open_state(OPTIMAL, pose), first, last))


def path_of(state: State) -> Journey:
    journey = journey_of(state)
    assert journey is not None
    return journey


def to_plan(goal: Pose = GOAL) -> State:
    state = with_ends(open_state(OPTIMAL), None, goal)
    return Set("paths.kind", "planned").apply(state)


# Straight paths


@pytest.mark.parametrize(("first", "last"), [(0, 3), (3, 6), (6, 0)])
def test_path_between_modes_leads_from_one_to_the_other_with_the_same_joints(
    first: int, last: int
) -> None:
    state = start_between(first, last)
    journey = path_of(state)
    joints = joints_of(OPTIMAL, TILTED)
    modes = forward(OPTIMAL, joints)
    for pose, mode in zip(journey.poses, (first, last), strict=True):
        np.testing.assert_allclose(pose.position, modes.position[mode], atol=1e-12)
        assert int(mode_of(margins(pose.position, pose.rotation))) == mode
    assert state.pose == journey.poses[0]
    assert state.mode == first
    assert journey.is_playing
    end = set_path_time(journey.trajectory.duration).apply(state)
    assert end.pose == journey.poses[-1]
    assert end.mode == last
    assert end.joints == pytest.approx(joints, abs=1e-9)
    words = crossing_words(journey, UNITS)
    for crossing in journey.margins.crossings:
        assert f"δ{crossing.incidence} = 0" in words


@pytest.mark.parametrize(
    ("start", "goal"), [(None, GOAL), (TILTED, GOAL), (GOAL, 5), (2, GOAL), (None, None), (None, 6)]
)
def test_straight_path_leads_between_any_two_ends(start: StopAt, goal: StopAt) -> None:
    before = with_ends(open_state(OPTIMAL, TILTED), start, goal)
    expected = poses_of(before)
    state = go().apply(before)
    journey = path_of(state)
    assert (journey.kind, journey.poses) == ("straight", expected)
    assert journey.poses[0] == (TILTED if start is None else expected[0])
    if isinstance(goal, Pose):
        assert journey.poses[1] == goal
    assert journey.trajectory.duration == pytest.approx(WATCH_SECONDS)
    assert state.pose == journey.poses[0]


def test_goal_is_the_neighbouring_mode_until_one_is_chosen_and_stays_once_it_is_gone_to() -> None:
    state = open_state(OPTIMAL)
    assert (state.mode, goal_of(state)) == (1, 5)
    end = set_path_time(WATCH_SECONDS).apply(go().apply(state))
    assert (end.mode, Paths.of(end).stops[1].at, goal_of(end)) == (5, 5, 5)


@pytest.mark.parametrize(
    ("start", "goal"), [(None, TILTED), (GOAL, GOAL), (3, 3), (None, 1), (1, TILTED)]
)
def test_path_from_a_pose_to_itself_is_refused(start: StopAt, goal: StopAt) -> None:
    state = with_ends(open_state(OPTIMAL, TILTED), start, goal)
    for kind in ("straight", "planned"):
        with pytest.raises(InputError, match="a path needs two poses that differ"):
            go().apply(Set("paths.kind", kind).apply(state))


def test_path_between_poses_that_differ_by_rounding_is_refused() -> None:
    state = open_state(OPTIMAL)
    x, y, z = state.pose.position
    nearby = Pose((x + 1e-7, y, z), state.pose.quaternion)
    with pytest.raises(InputError, match="a path needs two poses that differ"):
        go().apply(with_ends(state, None, nearby))
    with pytest.raises(InputError, match="the path has no length"):
        Journey("planned", "Path", OPTIMAL, (state.pose, nearby))


def test_modes_on_the_way_are_those_of_the_legs_at_the_ends() -> None:
    state = set_path_time(0.3 * WATCH_SECONDS).apply(start_between(1, 4))
    again = go().apply(state)
    for pose, before in zip(path_of(again).poses, path_of(state).poses, strict=True):
        np.testing.assert_allclose(pose.position, before.position, atol=1e-9)
    # But elsewhere those of the present pose.
    elsewhere = go().apply(set_position(0, 9.0).apply(state))
    assert path_of(elsewhere).poses[0] != path_of(state).poses[0]
    # A path whose ends have other leg lengths gives its own place no other legs.
    free = set_path_time(4.0).apply(go().apply(with_ends(open_state(OPTIMAL, TILTED), None, GOAL)))
    modes = forward(OPTIMAL, joints_of(OPTIMAL, free.pose))
    assert poses_of(with_ends(free, None, 6))[1].position == pytest.approx(modes.position[6])


def test_path_is_of_its_design() -> None:
    state = start_between(1, 5)
    other = set_variable("b2", 2.7).apply(state)
    assert journey_of(other) is None
    heavier = Set("design.payload.mass_kg", 2.0).apply(state)
    assert path_of(heavier) == replace(path_of(state), design=heavier.design)
    for action in (set_path_time(1.0), play(True)):
        with pytest.raises(InputError, match="no path for this design"):
            action.apply(other)
    assert advance_journey(1.0).apply(other) is other
    assert journey_of(set_variable("b2", OPTIMAL.b2).apply(other)) == path_of(state)


# Playing


def test_time_goes_on_while_a_path_is_played_and_stops_at_its_end() -> None:
    state = start_between(1, 5)
    duration = path_of(state).trajectory.duration
    assert duration == pytest.approx(WATCH_SECONDS)
    for _ in range(4):
        state = advance_journey(0.3 * duration).apply(state)
        assert state.pose == path_of(state).pose
    assert (path_of(state).at, path_of(state).is_playing) == (duration, False)
    assert advance_journey(1.0).apply(state) is state
    again = play(True).apply(state)
    assert (path_of(again).at, path_of(again).is_playing) == (0.0, True)
    paused = play(False).apply(advance_journey(1.0).apply(again))
    assert (path_of(paused).at, path_of(paused).is_playing) == (1.0, False)
    assert path_of(set_path_time(1e9).apply(paused)).at == duration
    assert path_of(set_path_time(-1.0).apply(paused)).at == 0.0
    with pytest.raises(InputError, match="finite"):
        set_path_time(float("nan")).apply(paused)


def test_runner_plays_in_real_time_until_it_is_paused(bench: Bench) -> None:
    began = time.monotonic()
    bench.do(go())
    state = bench.wait(
        lambda state: Paths.of(state).journey is not None and path_of(state).at > 0.1
    )
    assert path_of(state).at <= time.monotonic() - began
    bench.do(play(False))
    paused = bench.state
    assert advance_journey(1.0).apply(paused) is paused
    assert bench.times == sorted(bench.times)


# The charts


def margins_of(pose: Pose) -> FloatArray:
    return margins(pose.position, pose.rotation)


@pytest.mark.parametrize(("first", "last"), [(0, 7), (1, 4), (1, 5)])
def test_chart_shows_margins_of_the_poses_over_time(first: int, last: int) -> None:
    journey = path_of(set_path_time(3.0).apply(start_between(first, last)))
    times, shown, singular = margins_over(journey, UNITS)
    assert (np.diff(times) >= 0.0).all()
    crossings = journey.margins.crossings
    crossed = [crossing_time(journey, i) for i in range(len(crossings))]
    assert singular[:, 0].tolist() == crossed
    for t, values in zip(times.tolist(), shown, strict=True):
        if t not in crossed:
            np.testing.assert_allclose(values, margins_of(journey.pose_at(t)), atol=1e-6)
    # A singular pose is marked where its curve meets the line of a flat fold.
    for crossing, (at, marked) in zip(crossings, singular.tolist(), strict=True):
        values = margins_of(crossing.pose)
        assert np.abs(shown[times == at] - values).max(axis=1).min() < 1e-12
        assert abs(marked - values[crossing.incidence - 1]) < 1e-12
        assert abs(marked) < 1e-5
    chart = margins_html(journey, UNITS)
    assert chart.count("<circle") == len(crossings)
    assert chart.count("<path") == 3
    (now,) = re.findall('<line [^>]*class="now"', chart)
    (x,) = {float(each) for each in re.findall('x[12]="([^"]*)"', now)}
    assert x == pytest.approx(PLACE[0] + PLACE[1] * journey.at / times[-1], abs=1e-3)


def test_path_and_its_crossings_are_drawn(services: Services) -> None:
    scene = PathScene(services)
    state = start_between(1, 7)
    drawn = {(h.name, n): v for h, n, v in scene.updates(Placed(Frame(state)))}
    scale = Placed(Frame(state)).scale
    line: Any = drawn["/path/line", "points"]
    ends = [path_of(state).poses[i].position for i in (0, -1)]
    np.testing.assert_allclose([line[0, 0], line[-1, 1]], scale * np.array(ends), atol=1e-4)
    crossings = path_of(state).margins.crossings
    balls: Any = drawn["/path/crossings", "batched_positions"]
    expected = scale * np.array([c.pose.position for c in crossings])
    np.testing.assert_allclose(balls[: len(crossings)], expected, atol=1e-4)
    hidden = [v for _, n, v in scene.updates(Placed(Frame(open_state(OPTIMAL)))) if n == "visible"]
    assert hidden == [False, False, False]
    label: Any = drawn["/path/label", "position"]
    assert np.abs(line - np.float32(label)).max(axis=-1).min() < 1e-5


# Planning


def test_plan_of_a_process_keeps_everything_and_can_be_cancelled_and_begun_again(
    bench: Bench,
) -> None:
    bench.do(Set("design.limits", with_radius(OPTIMAL, 0.2).limits))
    bench.do(Set("paths.stops", (Stop(), Stop(GOAL))), Set("paths.kind", "planned"), go())
    state = bench.wait_for_plan(1)
    assert Paths.of(state).problem is None
    journey = path_of(state)
    assert journey.kind == "planned"
    assert (journey.poses[0], journey.poses[-1]) == (open_state(OPTIMAL).pose, GOAL)
    # It is played at once, as a straight one.
    assert bench.wait(lambda state: path_of(state).at > 0.0).pose != GOAL
    assert not journey.margins.crossings
    least = np.array(journey.margins.least)
    closest = int(least.argmin())
    assert f"|δ{closest + 1}| = {least[closest]:.3g}" in crossing_words(journey, UNITS)
    inner = [journey.pose_at(float(t)) for t in np.linspace(0, journey.trajectory.duration, 50)]
    positions, rotations = ([p.position for p in inner], [p.rotation for p in inner])
    assert poses_are_valid(state.design, np.array(positions), np.array(rotations)).all()
    process = bench.jobs.process_ids("plan")[0]
    assert process != os.getpid()
    # A plan that would never be ready.
    os.kill(process, signal.SIGSTOP)
    bench.do(set_pose(open_state(OPTIMAL).pose), go())
    assert "Planning, for 2 s at most" in str(
        plan_words(bench.wait(lambda s: Paths.of(s).is_planning))
    )
    bench.do(CANCEL)
    bench.wait_for_plan(2)
    assert bench.jobs.wait_until_idle(60.0, "plan")
    assert Paths.of(bench.state).problem is None
    # Cancelled before it was begun, it leaves the process.
    with suppress(ProcessLookupError):
        os.kill(process, signal.SIGCONT)
    bench.do(go())
    assert path_of(bench.wait_for_plan(3)).poses[-1] == GOAL
    assert bench.complaints == bench.reports == []


def test_plan_that_comes_late_or_for_another_design_is_not_taken() -> None:
    state = go().apply(to_plan())
    journey = Journey("planned", "", OPTIMAL, (open_state(OPTIMAL).pose, GOAL))
    for late in (CANCEL.apply(state), go().apply(state)):
        assert take_plan(1, journey, None).apply(late) == late
    assert take_plan(1, journey, None).apply(state).pose == journey.poses[0]
    changed = set_variable("b2", 2.7).apply(state)
    after = take_plan(1, journey, None).apply(changed)
    assert after.pose == changed.pose
    assert "design has changed" in str(Paths.of(after).problem)
    failed = take_plan(1, None, DIED).apply(state)
    assert Paths.of(failed).problem == DIED


# The panel


def test_panel_goes_plays_cancels_and_exports(services: Services, desk: Desk) -> None:
    paths, buttons = PathsPanel(services), services.buttons
    time_slider = paths.time.handle

    def values_of(handle: Any) -> dict[str, Any]:
        return {n: v for h, n, v in paths.updates(Frame(desk.state)) if h is handle}

    assert values_of(time_slider)["visible"] is False
    # Without a path no chart is drawn.
    assert not any("<svg" in str(v) for *_, v in paths.updates(Frame(desk.state)))
    desk.click(paths.go)
    assert path_of(desk.state).is_playing
    assert any("ex-course" in str(v) for *_, v in paths.updates(Frame(desk.state)))
    slider = values_of(time_slider)
    assert slider["visible"] is True
    assert slider["max"] == pytest.approx(WATCH_SECONDS, abs=0.011)
    desk.press(buttons, "paths.play", "off")
    assert not path_of(desk.state).is_playing
    desk.press(buttons, "paths.play", "on")
    assert path_of(desk.state).is_playing
    for name, value in slider.items():
        setattr(time_slider, name, value)
    desk.use(time_slider, 2.5)
    assert path_of(desk.state).at == 2.5
    assert desk.state.pose == path_of(desk.state).pose
    desk.press(buttons, "paths.export")
    assert isinstance(services.downloads, StubDownloads)
    assert services.downloads.sent == [(1, "paper-optimal-path.csv")]
    # Its lengths are in the unit that the page shows.
    course = path_of(desk.state).trajectory
    for lengths, unit, factor in (("mm", "mm", 10.0), ("design units", "10 mm", 1.0)):
        desk.session.do(Set("view.lengths", lengths))
        desk.press(buttons, "paths.export")
        rows = list(csv.DictReader(io.StringIO(services.downloads.data.decode())))
        assert [float(row[f"l1 [{unit}]"]) for row in rows] == pytest.approx(
            factor * course.joints[:, 0], rel=1e-15
        )
    desk.press(buttons, "paths.clear")
    assert journey_of(desk.state) is None
    desk.press(buttons, "paths.kind", "planned")
    desk.session.do(Set("paths.stops", (Stop(), Stop(GOAL))))
    desk.click(paths.go)
    assert Paths.of(desk.state).is_planning
    assert values_of(paths.go) == {"disabled": True}
    desk.press(buttons, "paths.cancel")
    assert not Paths.of(desk.state).is_planning


def chosen(state: State, index: int) -> State:
    return with_value(state, "paths.chosen", index)


@pytest.mark.parametrize("index", [0, 1])
def test_pose_is_the_present_one_a_mode_or_six_numbers(
    services: Services, desk: Desk, index: int
) -> None:
    paths = PathsPanel(services)
    desk.session.do(set_pose(TILTED))
    desk.session.do(Set("paths.stops", (Stop(), Stop(3))))

    def controls() -> dict[str, Any]:
        controls = controls_of(services, paths, desk.state)
        return {label: handle for label, handle in controls.items() if handle.visible}

    def numbers() -> Pose:
        return poses_of(desk.state)[index]

    typed = ("Pose x, y, z (units)", "Pose angles (°)")
    assert not {"Pose", "Pause (s)", *typed} & {*controls()}
    desk.press(services.buttons, "paths.choose", str(index))
    assert not {*typed} & {*controls()}
    for mode, option in enumerate(MODES):
        desk.use(controls()["Pose"], option)
        assert value_at(desk.state, f"paths.stops.{index}.at") == mode
        expected = forward(OPTIMAL, joints_of(OPTIMAL, TILTED)).position[mode]
        assert numbers().position == pytest.approx(expected)
        x = f"{numbers().position[0]:.2f}".replace("-", "−")
        assert x in numbers_of(desk.state, mode)
    # Typed numbers begin as those that were shown, and each of the six can be set.
    before = numbers()
    desk.use(controls()["Pose"], TYPED)
    steps = len(desk.session.history.steps)
    assert numbers() == before
    assert {*typed} <= {*controls()}
    desk.use(controls()[typed[0]], (9.0, 4.0, 8.0))
    desk.use(controls()[typed[1]], (-70.0, 10.0, 5.0))
    assert len(desk.session.history.steps) == steps
    assert numbers().position == (9.0, 4.0, 8.0)
    assert numbers().yaw_pitch_roll == pytest.approx((-70.0, 10.0, 5.0))
    assert controls()[typed[1]].value == (-70.0, 10.0, 5.0)
    desk.use(controls()["Pause (s)"], 0.3)
    assert stops_of(desk.state)[index].pause == 0.3
    desk.use(controls()["Pose"], PRESENT)
    assert numbers() == TILTED
    desk.session.do(set_pose(GOAL))
    # The first goes with the platform, another stays behind.
    assert numbers() == (TILTED if index else GOAL)
    desk.press(services.buttons, "paths.choose", str(index))
    assert "Pose" not in controls()


def test_poses_are_added_copied_moved_and_removed() -> None:
    state = open_state(OPTIMAL, TILTED)
    assert [stop.at for stop in stops_of(state)] == [None, state.mode ^ 4]
    # The first press keeps the present pose, the next ones add those of the platform.
    taught = add_present(state).apply(state)
    assert Paths.of(taught).stops == (Stop(TILTED),)
    taught = set_pose(GOAL).apply(taught)
    taught = add_present(taught).apply(taught)
    assert poses_of(taught) == (TILTED, GOAL)
    # Behind the chosen one.
    between = set_position(2, 8.0).apply(chosen(taught, 0))
    between = add_present(between).apply(between)
    assert poses_of(between) == (TILTED, between.pose, GOAL)
    copied = copy_stop(between, 2).apply(between)
    assert poses_of(copied)[2:] == (GOAL, GOAL)
    assert Paths.of(copied).chosen == 3
    changed = set_stop(copied, "", at=TILTED, pause=0.5)
    assert changed is not None
    changed = changed.apply(copied)
    assert stops_of(changed)[3] == Stop(TILTED, 0.5)
    lifted = lift_stop(changed, 3)
    assert lifted is not None
    assert poses_of(lifted.apply(changed)) == (TILTED, between.pose, TILTED, GOAL)
    assert lift_stop(changed, 0) is None
    for _ in range(5):
        changed = remove_stop(changed, 0).apply(changed)
    assert Paths.of(changed).stops == (Stop(),)
    # A goal that is only proposed becomes one when it is copied.
    proposed = copy_stop(state, 1).apply(state)
    assert [type(stop.at) for stop in stops_of(proposed)] == [type(None), int, Pose]
    assert poses_of(proposed)[1] == poses_of(proposed)[2]
    full = with_value(state, "paths.stops", (Stop(TILTED),) * MOST_STOPS)
    with pytest.raises(InputError, match="explorer drives takes longer ones"):
        add_present(full).apply(full)
    with pytest.raises(InputError, match="only the first pose"):
        Set("paths.stops", (Stop(), Stop())).apply(state)
    with pytest.raises(InputError, match="a pause must not be below zero"):
        Stop(TILTED, -0.1)
    with pytest.raises(InputError, match="or above 1,000,000 s; got 1e\\+07 s"):
        Stop(TILTED, 1e7)


def test_closed_path_between_modes_is_told_with_its_singular_poses() -> None:
    state = with_ends(open_state(OPTIMAL, TILTED), 1, 5)
    closed = close_path(state)
    assert closed is not None
    state = go().apply(closed.apply(state))
    assert close_path(state) is None
    assert path_of(state).is_closed
    words = crossing_words(path_of(state), UNITS)
    assert "Closed path through modes 1 → 5 → 1. Singular 2 times: δ1 = 0" in words
    start = path_of(state).poses[0]
    assert set_path_time(1e9).apply(state).pose == start
    # Half way through, modes are still those of the legs at its poses.
    on_the_way = set_path_time(0.3 * WATCH_SECONDS).apply(state)
    again = zip(poses_of(on_the_way), path_of(state).poses, strict=True)
    for pose, before in again:
        np.testing.assert_allclose(pose.position, before.position, atol=1e-9)
    plain = crossing_words(path_of(go().apply(with_ends(state, TILTED, GOAL))), UNITS)
    assert "Closed" not in plain
    there_and_back = close_path(with_ends(state, TILTED, GOAL))
    assert there_and_back is not None
    words = crossing_words(path_of(go().apply(there_and_back.apply(state))), UNITS)
    assert "Closed path. No singular pose" in words


def test_poses_and_pauses_are_taken_from_a_table() -> None:
    state = open_state(OPTIMAL)
    head = b"x_mm,y_mm,z_mm,yaw_deg,pitch_deg,roll_deg,pause_s"
    table = b"%b\n100,50,90,-70,5,0,0.2\n120,50,90,-70,5,0,\n" % head
    taken = stops_in_table(state, table, "pick.csv").apply(state)
    expected = Pose.of_yaw_pitch_roll((10.0, 5.0, 9.0), (-70.0, 5.0, 0.0))
    assert [stop.pause for stop in stops_of(taken)] == [0.2, 0.0]
    assert poses_of(taken)[0].position == pytest.approx(expected.position)
    np.testing.assert_allclose(poses_of(taken)[0].rotation, expected.rotation, atol=1e-12)
    assert path_of(go().apply(taken)).pauses == (0.2, 0.0)
    named = table.replace(b"pause_s", b"note,dwell_s").replace(b"0,0.2", b"0,a,0.2")
    words = "Poses of the path from pick.csv: 2"
    assert stops_in_table(state, table, "pick.csv").describe(state) == words
    words += ", without its columns note, dwell_s"
    assert stops_in_table(state, named, "pick.csv").describe(state) == words
    for data, words in (
        (b"x,y\n1,2\n", "no column z"),
        (b"x,y,z\n" + 51 * b"1,2,3\n", "at most 50"),
        (b"x,y,z,time_s\n" + 51 * b"1,2,3,0\n", "a path in time already"),
    ):
        with pytest.raises(InputError, match=words):
            stops_in_table(state, data, "pick.csv")


def test_chosen_pose_has_the_handle_and_is_dragged_by_it(services: Services, desk: Desk) -> None:
    handle = DragHandle(services)
    gizmo: Any = handle.handle

    def place() -> list[float]:
        updates: Any = handle.updates(Placed(Frame(desk.state)))
        (position,) = [list(value) for _, name, value in updates if name == "position"]
        return position

    desk.session.do(Set("paths.stops", (Stop(TILTED), Stop(GOAL))))
    scale = Placed(Frame(desk.state)).scale
    assert place() == pytest.approx(scale * np.array(desk.state.pose.position))
    desk.session.do(Set("paths.chosen", 1))
    assert place() == pytest.approx(scale * np.array(GOAL.position))
    before = desk.state.pose
    gizmo.position, gizmo.wxyz = tuple(scale * np.array((9.0, 4.0, 8.0))), TILTED.quaternion
    gizmo._impl_aux.last_updated = time.time() + 1.0
    for callback in gizmo._impl_aux.update_cb:
        asyncio.run(callback(SimpleNamespace(client_id=1)))
    assert stops_of(desk.state)[0].at == TILTED
    dragged = poses_of(desk.state)[1]
    assert dragged.position == pytest.approx((9.0, 4.0, 8.0))
    assert dragged.quaternion == TILTED.quaternion
    assert desk.state.pose == before
    # Once the path is made, the handle is that of the platform again.
    desk.session.do(go())
    assert place() == pytest.approx(scale * np.array(TILTED.position))


def test_opened_design_and_link_have_the_handle_at_their_platform() -> None:
    stops = (Stop(TILTED), Stop(GOAL))
    state = set_stops(stops, 1, "two").apply(open_state(OPTIMAL))
    assert Paths.of(state).edited_pose == GOAL
    for action in (open_design(PRESETS["buildable"]), open_link(decode_link("buildable"))):
        paths = Paths.of(action.apply(state))
        assert (len(paths.stops), paths.handled, paths.edited_pose) == (2, "", None)


def test_pauses_of_a_planned_path_are_at_its_poses(services: Services) -> None:
    del services
    between = Pose.of_yaw_pitch_roll((12.0, 2.0, 8.0), (-73.0, 5.0, 0.0))
    stops = (Stop(None, 0.1), Stop(between, 0.2), Stop(GOAL, 0.3))
    state = Set("paths.stops", stops).apply(Set("paths.kind", "planned").apply(open_state(OPTIMAL)))
    state, jobs = go().apply(state), StubJobs()
    runner = PathRunner(services_for(jobs=jobs))
    runner.follow(Frame(state))
    (order,) = jobs.orders
    corners, places = order.task(*order.arguments)
    assert [corners[place] for place in places] == [*poses_of(state)]
    assert places[0] == 0
    assert places[-1] == len(corners) - 1


def test_mode_at_a_singular_pose_is_refused_in_words_or_a_pose_with_the_same_legs() -> None:
    flat = Pose.of_yaw_pitch_roll((10.0, 5.0, 0.0), (-73.1, 12.0, 9.0))
    for mode in range(8):
        state = with_ends(open_state(OPTIMAL, flat), None, mode)
        if forward(OPTIMAL, joints_of(OPTIMAL, flat)).feasible:
            goal = poses_of(state)[1]
            expected = pytest.approx(joints_of(OPTIMAL, flat), abs=1e-6)
            assert joints_of(OPTIMAL, goal) == expected
        else:
            with pytest.raises(InputError, match="edge of what closes"):
                poses_of(state)
            assert "ex-close" in numbers_of(state, mode)


# Loads along a path


PRESS = msgspec.structs.replace(
    OPTIMAL,
    tool=Tool((1.0, 0.0, 2.0)),
    payload=Payload(0.5, (1.0, 0.0, 1.0)),
    actuators=Actuators((150.0, 200.0, 150.0, 200.0, 150.0, 150.0)),
    struts=Struts(outer_mm=8.0, inner_mm=6.0, stress_mpa=200.0),
    guide=Guide(force_n=200.0, moment_nm=6.0),
)
# Both ends hold 40 N downwards; the straight move between them, low over the base, does not.
START = Pose.of_yaw_pitch_roll((2.4, 0.2, 1.7), (-53.0, -3.0, 2.0))
FAR = Pose.of_yaw_pitch_roll((18.5, 9.2, 2.1), (-82.0, -5.0, 1.0))
DOWN = (0.0, 0.0, -40.0)


def straight(*more: Action, force: Triple = DOWN) -> State:
    """Return a state with the straight path between the ends."""
    state = open_state(PRESS, START)
    for action in (
        Set("view.forces.force", force),
        Set("paths.stops", (Stop(), Stop(FAR))),
        Set("paths.holds_load", True),
        Set("paths.seconds", 20.0),
        *more,
        go(),
    ):
        state = action.apply(state)
    return state


@pytest.mark.skipif(find_spec("ompl") is None, reason="OMPL is not installed")
def test_planned_path_holds_load_and_weights_of_the_tab_forces() -> None:
    state = straight(
        Set("view.at", "tool"),
        Set("view.forces.weighed", "payload and legs"),
        Set("view.prototype.density", 3000.0),
        force=(0.0, 0.0, -25.0),
    )
    state = go().apply(Set("paths.kind", "planned").apply(state))
    jobs = StubJobs()
    PathRunner(services_for(jobs=jobs)).follow(Frame(state))
    (order,) = jobs.orders
    poses, places = order.task(*order.arguments)
    assert places == (0, len(poses) - 1)
    weights = weights_of_parts((PRESS, 3000.0)).with_payload(PRESS)
    along = path_loads(PRESS, poses, state.load, tool=state.tool, weights=weights)
    assert 0.5 < along.utilisation <= 1.0 + 1e-4


def test_shares_over_time_are_those_of_the_path(services: Services) -> None:
    state = straight(Set("view.at", "tool"))
    journey = path_of(state)
    found = loads_along(journey, services.get(Loads).of(Frame(state)))
    assert found is not None
    expected = path_loads(PRESS, journey.poses, state.load, tool=journey.tool)
    np.testing.assert_array_equal(found.utilisations, expected.utilisations)
    pose = journey.pose_at(journey.time_at(found.place))
    here = path_loads(PRESS, (pose, pose), state.load)
    assert (here.utilisation, here.part) == (pytest.approx(expected.utilisation), expected.part)


# Speeds and forces along the path


def drives_request(state: State) -> tuple[Design, TimedPath]:
    request = request_for(state)
    assert request is not None
    return request


def test_drives_are_those_of_the_path_as_it_is_played_and_exported() -> None:
    state = with_ends(open_state(OPTIMAL), None, GOAL)
    assert request_for(state) is None
    state = go().apply(state)
    for law, seconds in (("watchable", WATCH_SECONDS), ("duration", 1.0)):
        state = SetLaw("paths.law", law).apply(state)
        design, path = drives_request(state)
        found, journey = drives_along(design, path), path_of(state)
        assert found.law.duration == pytest.approx(seconds, rel=1e-12)
        assert journey.trajectory.duration == found.law.duration
        time, joints = journey.trajectory.time, journey.trajectory.joints
        gone = np.trapezoid(found.at(time).speed, time, axis=0)
        np.testing.assert_allclose(gone / OPTIMAL.unit_mm, joints[-1] - joints[0], atol=1e-3)
    for seconds in (0.0, 1e-200, 1e200, math.inf):
        with pytest.raises(InputError, match="a path needs a time above zero, 1e-07 to 1,000,000"):
            Set("paths.duration", seconds).apply(state)
    for seconds in (LEAST, MOST):
        allowed = path_of(Set("paths.duration", seconds).apply(state))
        assert (allowed.problem, allowed.trajectory.duration) == (None, pytest.approx(seconds))


def test_pauses_however_long_take_nothing_from_the_moves() -> None:
    x, y, z = TILTED.position
    lifted = Pose((x, y, z + 3.0), TILTED.quaternion)
    stops = (Stop(TILTED, 30.0), Stop(lifted), Stop(GOAL, 300.0), Stop(TILTED))
    state = SetLaw("paths.duration", 330.5).apply(open_state(OPTIMAL, TILTED))
    state = SetLaw("paths.law", "duration").apply(set_stops(stops, None, "").apply(state))
    journey = path_of(go().apply(state))
    law, timed = law_of_path(OPTIMAL, journey.path), journey.trajectory
    assert timed.duration == pytest.approx(330.5, rel=1e-12)
    assert timed.position[:, 2].max() == pytest.approx(z + 3.0, abs=1e-12)
    # Each of the three moves has its share of the rows, and the fastest of them is no slower.
    assert np.diff(timed.at, prepend=-1.0).astype(bool).sum() >= 150
    rates = np.abs(np.diff(timed.joints, axis=0) / np.diff(timed.time)[:, None])
    fastest = drives_along(OPTIMAL, journey.path).summary.peak_speed.max() / OPTIMAL.unit_mm
    assert rates.max() == pytest.approx(fastest, rel=0.05)
    moves = np.flatnonzero(law.pause == 0.0)
    for start, end in zip(law.time[moves], law.time[moves + 1], strict=True):
        seconds = 0.7 * start + 0.3 * end
        motion = law.at(np.array([seconds]))
        p, r = law.travel.moves.poses(motion.number, motion.share)
        np.testing.assert_allclose(journey.pose_at(seconds).position, p[0], atol=1e-12)
        np.testing.assert_allclose(journey.pose_at(seconds).rotation, r[0], atol=1e-12)
        assert journey.time_at(journey.place_at(seconds)) == pytest.approx(seconds, abs=1e-9)
    assert {journey.pose_at(seconds) for seconds in (0.0, 7.0, 29.9, 330.5)} == {TILTED}
    assert journey.pose_at(200.0) == GOAL


def test_list_of_one_pose_that_is_not_the_present_one_is_no_path() -> None:
    state = set_stops((Stop(TILTED),), None, "").apply(open_state(OPTIMAL, TILTED))
    with pytest.raises(InputError, match=r"two poses that differ: add one to the list$"):
        go().apply(state)


def test_change_of_the_law_keeps_the_place_on_the_path() -> None:
    state = set_path_time(3.0).apply(go().apply(with_ends(open_state(OPTIMAL), None, GOAL)))
    before = path_of(state)
    fast = SetLaw("paths.law", "duration").apply(SetLaw("paths.duration", 0.5).apply(state))
    after = path_of(fast)
    assert after.trajectory.duration == pytest.approx(0.5)
    assert after.at == pytest.approx(3.0 * 0.5 / WATCH_SECONDS)
    assert after.pose.position == pytest.approx(before.pose.position, abs=1e-6)
    assert fast.pose == state.pose
    back = SetLaw("paths.law", "watchable").apply(fast)
    assert path_of(back).at == pytest.approx(3.0)


def test_law_that_there_is_not_is_told_and_the_path_takes_a_time_to_watch() -> None:
    state = Set("paths.law", "shortest").apply(go().apply(with_ends(open_state(OPTIMAL), 1, 5)))
    assert path_of(state).trajectory.duration == pytest.approx(WATCH_SECONDS)
    assert "Takes 8 s, slow enough to watch, since it cannot be" in path_title(state, None)
    assert str(path_of(state).problem) in path_title(state, None)
    paused = replace(path_of(state), pauses=(0.6, 0.6))
    asked = Set("paths.law", "duration").apply(
        with_value(state, "paths.journey", replace(paused, seconds=1.0))
    )
    assert "the pauses take 1.2 s of the 1 s" in path_title(asked, None)
    assert path_of(asked).trajectory.duration == pytest.approx(WATCH_SECONDS + 1.2)


def test_playback_is_slower_than_the_path_only_if_told() -> None:
    state = go().apply(with_ends(open_state(OPTIMAL), None, GOAL))
    assert "slower" not in path_chip(Frame(state)) + path_title(state, None)
    assert path_of(advance_journey(1.0).apply(state)).at == 1.0
    slow = Set("paths.slower", 10.0).apply(state)
    assert path_of(advance_journey(1.0).apply(slow)).at == pytest.approx(0.1)
    for words in (path_chip(Frame(slow)), path_title(slow, None)):
        assert "10 times slower" in words


def test_drives_are_drawn_or_the_reason_is_told_in_a_sentence() -> None:
    html = drives_html(
        draw_drives(drives_request(go().apply(with_ends(open_state(OPTIMAL), None, GOAL))))
    )
    assert "One motor for all six needs at least" in html
    # A line of each actuator in the three charts over time and in that of force and speed.
    assert html.count('<path d="M') == 24
    between = start_between(0, 3)
    assert "leaves the limits" in drives_html(draw_drives(drives_request(between)))
