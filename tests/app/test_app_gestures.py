"""One move is a gesture with one control without a pause."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest
from desk import Desk

from explorer.app.session.gestures import PAUSE_SECONDS, UserAction
from explorer.app.state.action import Action
from explorer.app.state.actions import (
    GoHome,
    Open,
    Reset,
    Set,
    SetJoint,
    SetMode,
    SetPosition,
    SetVariable,
)
from explorer.app.state.frame import Frame
from explorer.app.state.presses import Press
from explorer.app.state.state import Hold, State, opened
from explorer.legs.moves import move_clearance
from explorer.mechanism.design import JOINTS, Limits
from explorer.mechanism.design_file import PRESETS
from explorer.mechanism.pose import Pose

OPTIMAL = PRESETS["paper-optimal"]
OTHER = PRESETS["paper-initial"]


@pytest.fixture
def moved() -> State:
    """The optimum after a move along x from its home pose, at the time 100."""
    return UserAction(SetPosition(0, 14.0), "x", 100.0).apply(opened(OPTIMAL))


def start_of(state: State) -> Pose:
    assert state.gesture is not None
    return state.gesture.start


def test_drag_of_many_events_is_one_move_from_where_it_began() -> None:
    state = start = opened(OPTIMAL)
    assert start.gesture is None
    assert Frame(start).last_move is None
    for i in range(30):
        state = UserAction(SetPosition(0, 10.0 + 0.2 * (i + 1)), "x", 50.0 + 0.016 * i).apply(state)
    assert start_of(state) == start.pose
    move = Frame(state).last_move
    assert move is not None
    assert (move.start, move.end, move.steps) == (start.pose, state.pose, 1)
    expected = move_clearance(OPTIMAL, start.pose, state.pose)
    np.testing.assert_array_equal(move.clearance, expected.clearance)
    np.testing.assert_array_equal(move.overlaps, expected.overlaps)


def test_gesture_of_one_press_continues_after_a_rest_and_ends_with_it(moved: State) -> None:
    first, second = Press(1, 1), Press(1, 2)
    state = UserAction(SetPosition(0, 15.0), "y", 200.0, first).apply(moved)
    rested = UserAction(SetPosition(0, 16.0), "y", 200.0 + 60 * PAUSE_SECONDS, first).apply(state)
    assert start_of(rested) == start_of(state) == moved.pose
    again = UserAction(SetPosition(0, 17.0), "y", 200.1 + 60 * PAUSE_SECONDS, second).apply(rested)
    assert start_of(again) == rested.pose


def test_event_that_arrives_late_does_not_end_a_move(moved: State) -> None:
    late = UserAction(SetPosition(0, 15.0), "x", 99.0).apply(moved)
    on = UserAction(SetPosition(0, 16.0), "x", 100.0 + 0.99 * PAUSE_SECONDS).apply(late)
    assert start_of(late) == start_of(on) == OPTIMAL.home


@pytest.mark.parametrize(
    "action",
    [SetVariable("b1x", 4.3), Open(OTHER), Open(OPTIMAL), Reset(), SetMode(6)],
    ids=lambda action: type(action).__name__,
)
@pytest.mark.parametrize("hold", ["pose", "legs"])
def test_change_of_design_or_mode_ends_the_move(moved: State, action: Action, hold: Hold) -> None:
    for source in ("x", "other"):
        after = UserAction(action, source, 100.1).apply(replace(moved, hold=hold))
        assert after.gesture is None
        assert Frame(after).last_move is None


def test_action_that_moves_nothing_leaves_the_last_move(moved: State) -> None:
    thick = Set("design.limits", Limits(leg_radii=(0.5, 0.5, 0.5, 0.5)))
    for action in (thick, Set("design.unit_mm", 3.0), Set("view", opened(OTHER).view)):
        assert UserAction(action, "other", 100.1).apply(moved).gesture == moved.gesture


def test_last_move_has_the_radii_of_the_present_design(moved: State) -> None:
    thin = Frame(moved).last_move
    thick = Frame(
        Set("design.limits", Limits(leg_radii=(0.5, 0.1, 0.2, 0.4))).apply(moved)
    ).last_move
    assert thin is not None
    assert thick is not None
    sums = [0.6, 0.7, 0.9, 0.3, 0.5, 0.6]
    np.testing.assert_allclose(thick.clearance, thin.clearance - sums, atol=1e-9)
    np.testing.assert_array_equal(thick.overlaps, thin.overlaps)


def test_move_back_to_the_start_sweeps_nothing(moved: State) -> None:
    back = UserAction(SetPosition(0, 10.0), "x", 100.2).apply(moved)
    assert back.pose == OPTIMAL.home
    assert Frame(back).last_move is None
    on = UserAction(SetPosition(0, 9.0), "x", 100.4).apply(back)
    assert start_of(on) == OPTIMAL.home
    assert Frame(on).last_move is not None


def test_drag_through_lengths_that_cannot_close_is_one_move(moved: State) -> None:
    joint = JOINTS.index("l1")
    low, high = Frame(moved).snapshot.intervals[joint][-1]
    state = UserAction(SetJoint(joint, 0.5 * (low + high)), "l1", 200.0).apply(moved)
    for i in range(8):
        state = UserAction(SetJoint(joint, high + 1.0 + i), "l1", 200.2 + 0.2 * i).apply(state)
        assert state.unclosed is not None
    state = UserAction(SetJoint(joint, high - 0.01), "l1", 201.8).apply(state)
    assert start_of(state) == moved.pose


def test_button_begins_a_new_move_and_a_singularity_does_not(moved: State) -> None:
    home = UserAction(GoHome(), object(), 100.1).apply(moved)
    assert start_of(home) == moved.pose
    again = UserAction(GoHome(), object(), 100.2).apply(home)
    assert again.gesture == home.gesture
    through = UserAction(SetPosition(2, -4.0), "z", 300.0).apply(moved)
    assert through.mode != moved.mode
    assert start_of(through) == moved.pose


def test_session_separates_gestures_by_key_and_time(desk: Desk) -> None:
    def post(key: object, value: float, pauses: float) -> Pose:
        desk.session.post(key, lambda _: SetPosition(0, value), stamp=pauses * PAUSE_SECONDS)
        return start_of(desk.state)

    assert post("x", 11.0, 10.0) == OPTIMAL.home
    assert post("x", 12.0, 10.9) == OPTIMAL.home
    desk.session.redraw()
    assert post("x", 13.0, 11.8) == OPTIMAL.home
    assert post("drag", 14.0, 11.9).position[0] == 13.0
    assert post("drag", 15.0, 13.0).position[0] == 14.0
    desk.session.do(GoHome())
    assert start_of(desk.state).position[0] == 15.0
