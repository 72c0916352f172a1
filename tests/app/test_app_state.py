"""The state, its actions and the session that makes them, with no browser."""

from __future__ import annotations

import threading
import time
from collections.abc import Generator
from concurrent.futures import ThreadPoolExecutor
from contextlib import contextmanager
from dataclasses import replace

import numpy as np
import pytest
from hypothesis import given, settings, strategies as st
from sample_states import Sample, samples, states_of
from strategies import designs

from explorer.app.session.session import Session
from explorer.app.state.actions import Action, Set, open_design, reset_design
from explorer.app.state.frame import Frame
from explorer.app.state.geometry import set_variable
from explorer.app.state.moves import (
    go_home,
    set_angle,
    set_joint,
    set_mode,
    set_position,
    use_nearest,
)
from explorer.app.state.state import State, joints_of, mode_at, open_state
from explorer.errors import DesignError, InputError
from explorer.mechanism.design import JOINTS, LENGTHS, VARIABLES, Design
from explorer.mechanism.design_file import PRESETS
from explorer.mechanism.kinematics import forward
from explorer.mechanism.pose import Pose

OPTIMAL = PRESETS["paper-optimal"]
PATIENCE = 60.0


def closes(state: State) -> bool:
    """Whether the joints asked for are those of the pose."""
    return np.allclose(state.joints, joints_of(state.design, state.pose), rtol=0, atol=1e-9)


@pytest.fixture
def state() -> State:
    return open_state(OPTIMAL)


@pytest.mark.parametrize("joint", range(6))
def test_joint_that_closes_takes_its_value_exactly_and_moves_the_platform(
    state: State, joint: int
) -> None:
    low, high = Frame(state).snapshot.intervals[joint][0]
    value = 0.5 * (low + high)
    moved = set_joint(joint, value).apply(state)
    assert moved.joints[joint] == value
    assert moved.pose != state.pose
    assert moved.mode == mode_at(moved.pose, 0) == state.mode
    assert closes(moved)


@pytest.mark.parametrize("joint", range(6))
def test_joint_that_cannot_close_keeps_the_pose_and_names_what_would_work(
    state: State, joint: int
) -> None:
    _, high = Frame(state).snapshot.intervals[joint][-1]
    stuck = set_joint(joint, high + 1.0).apply(state)
    assert stuck.pose == state.pose
    assert stuck.joints[joint] == high + 1.0
    assert stuck.unclosed is not None
    assert stuck.unclosed.nearest == pytest.approx(high, rel=1e-6)
    assert stuck.unclosed.failing
    assert JOINTS[joint] in stuck.unclosed.words(stuck.unit)
    freed = use_nearest().apply(stuck)
    assert freed.unclosed is None
    assert closes(freed)


@pytest.mark.parametrize("joint", [0, 1, 3])
def test_nearest_length_stays_clear_of_the_singularity_at_the_end_and_says_so(
    state: State, joint: int
) -> None:
    low, high = Frame(state).snapshot.intervals[joint][-1]
    at_the_end = set_joint(joint, high - 1e-9 * (high - low)).apply(state)
    assert Frame(at_the_end).verdict.kind != "clear"
    freed = use_nearest().apply(set_joint(joint, high + 1.0).apply(state))
    assert Frame(freed).verdict.kind == "clear"
    # No farther from the end than it needs to be.
    closer = set_joint(joint, 0.01 * high + 0.99 * freed.joints[joint]).apply(freed)
    assert Frame(closer).verdict.kind == "near"
    assert freed.remark is not None
    assert JOINTS[joint] in freed.remark
    assert f"{state.design.unit_mm * high:.4g} mm" in freed.remark
    assert set_position(0, 12.0).apply(freed).remark is None
    # With the pose held another design has other lengths.
    assert set_variable("b1x", state.design.b1[0] + 0.5).apply(freed).remark is None


def test_nearest_length_where_none_stays_clear_is_the_farthest_from_singular(
    state: State,
) -> None:
    _, high = Frame(state).snapshot.intervals[0][-1]
    wary = Set("view", replace(state.view, warn_below=1e3)).apply(state)
    freed = use_nearest().apply(set_joint(0, high + 1.0).apply(wary))
    assert closes(freed)
    assert Frame(freed).verdict.kind == "near"
    assert "none stays clear" in (freed.remark or "")


def test_joints_may_pass_through_what_cannot_close(state: State) -> None:
    target = set_position(0, 12.0).apply(state).joints
    walking = state
    for joint in range(6):
        walking = set_joint(joint, target[joint]).apply(walking)
    assert walking.unclosed is None
    assert walking.pose.position == pytest.approx((12.0, 5.0, 9.0))


@given(
    st.sampled_from(range(3)),
    st.floats(-25, 25),
    st.sampled_from(range(3)),
    st.floats(-89, 89),
)
def test_pose_controls_take_their_values_exactly_and_the_legs_follow(
    axis: int, length: float, angle_axis: int, angle: float
) -> None:
    moved = set_angle(angle_axis, angle).apply(
        set_position(axis, length).apply(open_state(OPTIMAL))
    )
    assert moved.pose.position[axis] == length
    assert moved.yaw_pitch_roll[angle_axis] == angle
    assert closes(moved)


def test_angles_stay_as_given_at_gimbal_lock(state: State) -> None:
    locked = set_angle(1, 90.0).apply(state)
    turned = set_angle(2, 30.0).apply(locked)
    assert turned.yaw_pitch_roll == (state.yaw_pitch_roll[0], 90.0, 30.0)


@given(st.lists(st.sampled_from(range(8)), min_size=1, max_size=12))
def test_modes_are_poses_of_the_same_joints(modes: list[int]) -> None:
    state = start = open_state(OPTIMAL)
    for mode in modes:
        state = set_mode(mode).apply(state)
        assert state.mode == mode == mode_at(state.pose, 0)
        assert state.joints == pytest.approx(start.joints, abs=1e-9)


def test_mode_stays_on_the_singularity_where_its_sign_is_zero(state: State) -> None:
    flat = set_position(2, 0.0).apply(state)
    assert Frame(flat).snapshot.margins[2] == 0.0
    assert flat.mode == state.mode


@pytest.mark.parametrize("name", VARIABLES)
def test_held_pose_or_held_legs_stay_while_the_design_changes(state: State, name: str) -> None:
    value = OPTIMAL.variables[VARIABLES.index(name)] + 0.05
    by_pose = set_variable(name, value).apply(state)
    assert by_pose.pose == state.pose
    assert closes(by_pose)
    by_legs = set_variable(name, value).apply(Set("hold", "legs").apply(state))
    assert by_legs.joints == state.joints
    assert closes(by_legs)
    assert by_legs.mode == state.mode


def test_held_legs_that_cannot_be_assembled_refuse_the_design(state: State) -> None:
    with pytest.raises(InputError, match=r"a3x = 800 mm cannot be assembled .* stays 191\.829 mm"):
        set_variable("a3x", 80.0).apply(Set("hold", "legs").apply(state))


@pytest.mark.parametrize(("name", "value"), [("a3y", 0.0), ("b1y", 0.0), ("b2", OPTIMAL.b3)])
def test_degenerate_design_is_refused(state: State, name: str, value: float) -> None:
    with pytest.raises(DesignError, match="degenerate"):
        set_variable(name, value).apply(state)


def test_reset_and_home_lead_back_to_the_design_as_opened_and_its_home_pose(state: State) -> None:
    assert (state.pose, state.mode, state.unclosed) == (OPTIMAL.home, 1, None)
    assert closes(state)
    changed: State = state
    for action in (
        set_position(0, 3.0),
        set_variable("b2", 1.0),
        Set("design.unit_mm", 1.0),
        Set("view.drawn_as", "6-4 twin"),
    ):
        changed = action.apply(changed)
    assert go_home().apply(changed).pose == OPTIMAL.home
    back = reset_design().apply(changed)
    assert (back.design, back.pose, back.view.drawn_as) == (OPTIMAL, OPTIMAL.home, "6-4 twin")
    # Another design that is opened is what reset leads to.
    other = open_design(PRESETS["paper-initial"]).apply(state)
    assert reset_design().apply(set_variable("b2", 1.0).apply(other)).design.name == "paper-initial"


@pytest.mark.parametrize("length", [0.0, -1.0, float("nan"), 1e-8, 1e7])
def test_warning_length_that_is_not_positive_is_refused(state: State, length: float) -> None:
    with pytest.raises(InputError, match="the warning length must"):
        Set("view", replace(state.view, warn_below=length)).apply(state)


@given(samples())
def test_state_after_any_actions_does_not_contradict_itself(actions: list[Sample]) -> None:
    for state in states_of(actions):
        snapshot = Frame(state).snapshot
        assert np.isfinite(snapshot.margins).all()
        if state.unclosed is None:
            # The pose of joints near a singularity carries the square root of rounding.
            size = max(map(abs, (*state.joints, *state.design.variables)))
            assert np.allclose(
                state.joints, joints_of(state.design, state.pose), rtol=0, atol=1e-6 * size
            )
        else:
            assert not forward(state.design, state.joints).feasible
            assert state.unclosed.failing


def stuck_states(design: Design, seed: int) -> list[State]:
    """Return the states in which a joint was set beyond an interval in which it closes."""
    rng = np.random.default_rng(seed)
    place = rng.uniform(-0.6, 0.6, 3) * design.reach
    pose = Pose.of_yaw_pitch_roll(place.tolist(), rng.uniform(-80.0, 80.0, 3).tolist())
    state, found = open_state(design, pose), list[State]()
    for joint, name in enumerate(JOINTS):
        for low, high in Frame(state).snapshot.intervals[joint]:
            for value in (low - 0.1 * design.reach, high + 0.1 * design.reach):
                if value < 0.0 and name in LENGTHS:
                    continue
                after = set_joint(joint, value).apply(state)
                if after.unclosed is not None:
                    found.append(after)
    return found


@settings(max_examples=settings().max_examples // 5)
@given(designs(sizes=(10.0, 1e-6, 1e6)), st.integers(0, 2**32 - 1))
def test_nearest_length_is_never_singular(design: Design, seed: int) -> None:
    for stuck in stuck_states(design, seed)[:1]:
        after = use_nearest().apply(stuck)
        assert after.unclosed is None
        assert forward(after.design, after.joints).feasible
        if after.pose == stuck.pose:
            # No length is regular: the mechanism stays as it was.
            continue
        frame = Frame(after)
        assert frame.verdict.kind != "singular"
        assert len(frame.snapshot.bordering_modes) == 1
        assert frame.snapshot.mode == stuck.mode
        reason = frame.verdict.reason(after.unit)
        assert after.remark is not None
        assert after.remark.endswith(f"short of it: {reason}.")
        assert ("nearest that stays clear," in after.remark) == (frame.verdict.kind == "clear")


class Watched:
    """A session whose frames, complaints and faults are kept."""

    def __init__(self) -> None:
        self.frames: list[Frame] = []
        self.complaints: list[tuple[str, int | None]] = []
        self.faults: list[Exception] = []
        self._drawing = threading.Event()
        self._gate = threading.Event()
        self._gate.set()
        self.session = Session(
            open_state(PRESETS["paper-optimal"]),
            self._draw,
            lambda message, who: self.complaints.append((message, who)),
            self.faults.append,
        )

    @contextmanager
    def busy(self) -> Generator[None]:
        """Keep the session at one frame, so that all that is posted meanwhile waits."""
        self._drawing.clear()
        self._gate.clear()
        self.session.do(set_position(0, 9.0))
        assert self._drawing.wait(PATIENCE)
        yield
        self._gate.set()
        assert self.session.wait_until_idle()

    def _draw(self, frame: Frame) -> None:
        self._drawing.set()
        self._gate.wait(PATIENCE)
        self.frames.append(frame)


@pytest.fixture
def watched() -> Watched:
    return Watched()


def test_only_the_newest_of_a_burst_is_computed(watched: Watched) -> None:
    with watched.busy():
        for i in range(100):
            value = 11.0 + 0.001 * i
            watched.session.post(
                "slider", lambda _, value=value: set_joint(0, value), stamp=float(i)
            )
    assert watched.session.state.joints[0] == 11.0 + 0.001 * 99
    # One that was under way, and one for all the rest.
    assert len(watched.frames) == 2
    assert watched.frames[-1].state is watched.session.state


def test_changes_of_one_burst_are_made_in_the_order_of_their_stamps(watched: Watched) -> None:
    now = time.time()
    with watched.busy():
        for stamp in (3.0, 1.0, 2.0):
            watched.session.post(
                "slider", lambda _, value=stamp: set_position(1, value), stamp=now + stamp
            )
        watched.session.post("a", lambda s: set_position(2, 2 * s.pose.position[2]), stamp=now + 2)
        watched.session.post("b", lambda _: set_position(2, 5.0), stamp=now + 1)
    assert watched.session.state.pose.position[1:] == (3.0, 10.0)


def test_refused_change_is_reported_to_its_client_and_the_state_is_drawn_again(
    watched: Watched,
) -> None:
    before = watched.session.state
    watched.session.do(set_variable("a3y", 0.0), who=7)
    assert watched.session.wait_until_idle()
    ((message, who),) = watched.complaints
    assert "degenerate" in message
    assert who == 7
    assert watched.session.state == before
    assert watched.frames[-1].state == before


def test_unexpected_fault_is_reported_and_the_session_continues(watched: Watched) -> None:
    def broken(_: State) -> Action:
        raise RuntimeError("broken on purpose")

    watched.session.post("broken", broken)
    assert watched.session.wait_until_idle()
    assert [str(fault) for fault in watched.faults] == ["broken on purpose"]
    watched.session.do(set_position(0, 9.0))
    assert watched.session.wait_until_idle()
    assert watched.session.state.pose.position[0] == 9.0


def test_settled_state_has_all_that_was_posted_before(watched: Watched) -> None:
    settled: list[State] = []
    with watched.busy():
        for x in (3.0, 4.0):
            watched.session.post("x", lambda _, x=x: set_position(0, x))
        reader = threading.Thread(target=lambda: settled.append(watched.session.latest_state()))
        reader.start()
    reader.join()
    assert settled[0].pose.position[0] == 4.0


def test_changes_from_many_threads_are_all_made(watched: Watched) -> None:
    def run(axis: int) -> None:
        for i in range(30):
            watched.session.post(axis, lambda _, i=i: set_position(axis, 5.0 + 0.01 * i))

    with ThreadPoolExecutor(3) as threads:
        list(threads.map(run, range(3)))
    assert watched.session.wait_until_idle()
    assert watched.session.state.pose.position == pytest.approx((5.29, 5.29, 5.29))
