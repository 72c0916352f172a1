"""What counts as one move: all that one hand does with one control without a pause."""

from __future__ import annotations

from dataclasses import replace

import msgspec
import numpy as np
import pytest
from hypothesis import given, strategies as st

from explorer.app.session.gestures import PAUSE_SECONDS, ByHand
from explorer.app.session.session import Session
from explorer.app.state.action import Action
from explorer.app.state.actions import (
    GoHome,
    Open,
    Reset,
    SetAngle,
    SetJoint,
    SetLimits,
    SetMode,
    SetPosition,
    SetUnit,
    SetVariable,
    SetView,
)
from explorer.app.state.frame import Frame
from explorer.app.state.presses import Press
from explorer.app.state.state import State, opened
from explorer.errors import DesignError
from explorer.legs.moves import move_clearance
from explorer.mechanism.design import JOINTS, Limits
from explorer.mechanism.design_file import PRESETS
from explorer.mechanism.pose import Pose

OPTIMAL = PRESETS["paper-optimal"]
OTHER = PRESETS["paper-initial"]


@pytest.fixture
def moved() -> State:
    """The optimum after a move along x from its home pose, at the time 100."""
    return ByHand(SetPosition(0, 14.0), "x", 100.0).apply(opened(OPTIMAL))


def start_of(state: State) -> Pose:
    assert state.gesture is not None
    return state.gesture.start


def test_nothing_has_moved_in_a_design_just_opened() -> None:
    assert opened(OPTIMAL).gesture is None
    assert Frame(opened(OPTIMAL)).last_move is None


def test_a_drag_of_many_events_is_one_move_from_where_it_began() -> None:
    state = start = opened(OPTIMAL)
    for i in range(30):
        state = ByHand(SetPosition(0, 10.0 + 0.2 * (i + 1)), "x", 50.0 + 0.016 * i).apply(state)
    assert start_of(state) == start.pose
    move = Frame(state).last_move
    assert move is not None
    assert (move.start, move.end, move.steps) == (start.pose, state.pose, 1)
    expected = move_clearance(OPTIMAL, start.pose, state.pose)
    np.testing.assert_array_equal(move.clearance, expected.clearance)
    np.testing.assert_array_equal(move.overlaps, expected.overlaps)


@given(
    st.lists(st.tuples(st.sampled_from("ab"), st.floats(0.0, 2.0 * PAUSE_SECONDS)), min_size=1),
    st.booleans(),
)
def test_a_pause_or_another_control_begins_a_new_move(
    events: list[tuple[str, float]], is_turn: bool
) -> None:
    state = opened(OPTIMAL)
    time = 1e9
    # A slower bookkeeping: the whole list of events, cut wherever a move ends.
    moves: list[tuple[Pose, str, float]] = []
    for i, (source, gap) in enumerate(events):
        time += gap
        is_same = bool(moves) and moves[-1][1] == source and time - moves[-1][2] <= PAUSE_SECONDS
        moves.append((moves[-1][0] if is_same else state.pose, source, time))
        action = SetAngle(0, float(i)) if is_turn else SetPosition(0, 10.5 + 0.1 * i)
        state = ByHand(action, source, time).apply(state)
        assert start_of(state) == moves[-1][0]


def test_gesture_of_one_press_goes_on_after_a_rest_and_ends_with_it(moved: State) -> None:
    first, second = Press(1, 1), Press(1, 2)
    state = ByHand(SetPosition(0, 15.0), "y", 200.0, first).apply(moved)
    rested = ByHand(SetPosition(0, 16.0), "y", 200.0 + 60 * PAUSE_SECONDS, first).apply(state)
    assert start_of(rested) == start_of(state) == moved.pose
    again = ByHand(SetPosition(0, 17.0), "y", 200.1 + 60 * PAUSE_SECONDS, second).apply(rested)
    assert start_of(again) == rested.pose


def test_events_that_arrive_late_do_not_end_a_move(moved: State) -> None:
    late = ByHand(SetPosition(0, 15.0), "x", 99.0).apply(moved)
    on = ByHand(SetPosition(0, 16.0), "x", 100.0 + 0.99 * PAUSE_SECONDS).apply(late)
    assert start_of(late) == start_of(on) == OPTIMAL.home


@pytest.mark.parametrize(
    "action",
    [SetVariable("b1x", 4.4), Open(OTHER), Open(OPTIMAL), Reset(), SetMode(6)],
    ids=lambda action: type(action).__name__,
)
def test_after_a_change_of_design_or_of_mode_nothing_is_swept(moved: State, action: Action) -> None:
    for source in ("x", "other"):
        after = ByHand(action, source, 100.1).apply(moved)
        assert after.gesture is None
        assert Frame(after).last_move is None


def test_a_design_that_changes_with_the_legs_held_sweeps_nothing(moved: State) -> None:
    after = ByHand(SetVariable("b1x", 4.3), "b1x", 100.1).apply(replace(moved, hold="legs"))
    assert after.pose != moved.pose
    assert after.gesture is None


@pytest.mark.parametrize(
    "action",
    [SetLimits(Limits(leg_radii=(0.5, 0.5, 0.5, 0.5))), SetUnit(3.0), SetView(opened(OTHER).view)],
    ids=lambda action: type(action).__name__,
)
def test_what_moves_nothing_leaves_the_last_move(moved: State, action: Action) -> None:
    after = ByHand(action, "other", 100.1).apply(moved)
    assert after.gesture == moved.gesture


def test_radii_count_in_the_last_move_once_they_are_set(moved: State) -> None:
    thin = Frame(moved).last_move
    thick = Frame(SetLimits(Limits(leg_radii=(0.5, 0.1, 0.2, 0.4))).apply(moved)).last_move
    assert thin is not None
    assert thick is not None
    sums = [0.6, 0.7, 0.9, 0.3, 0.5, 0.6]
    np.testing.assert_allclose(thick.clearance, thin.clearance - sums, atol=1e-9)
    np.testing.assert_array_equal(thick.overlaps, thin.overlaps)


def test_there_and_back_again_sweeps_nothing_until_it_goes_on(moved: State) -> None:
    back = ByHand(SetPosition(0, 10.0), "x", 100.2).apply(moved)
    assert back.pose == OPTIMAL.home
    assert Frame(back).last_move is None
    on = ByHand(SetPosition(0, 9.0), "x", 100.4).apply(back)
    assert start_of(on) == OPTIMAL.home
    assert Frame(on).last_move is not None


def test_a_hand_that_passes_through_what_cannot_close_has_not_paused(moved: State) -> None:
    joint = JOINTS.index("l1")
    low, high = Frame(moved).snapshot.intervals[joint][-1]
    state = ByHand(SetJoint(joint, 0.5 * (low + high)), "l1", 200.0).apply(moved)
    for i in range(8):
        state = ByHand(SetJoint(joint, high + 1.0 + i), "l1", 200.2 + 0.2 * i).apply(state)
        assert state.unclosed is not None
    state = ByHand(SetJoint(joint, high - 0.01), "l1", 201.8).apply(state)
    assert start_of(state) == moved.pose


def test_a_button_is_a_move_of_its_own(moved: State) -> None:
    home = ByHand(GoHome(), object(), 100.1).apply(moved)
    assert start_of(home) == moved.pose
    again = ByHand(GoHome(), object(), 100.2).apply(home)
    assert again.gesture == home.gesture


def test_a_refused_change_raises_as_it_does_by_itself(moved: State) -> None:
    with pytest.raises(DesignError, match="degenerate"):
        ByHand(SetVariable("a3y", 0.0), "a3y", 100.1).apply(moved)


def test_a_move_through_a_singularity_is_still_one_move(moved: State) -> None:
    through = ByHand(SetPosition(2, -4.0), "z", 300.0).apply(moved)
    assert through.mode != moved.mode
    assert start_of(through) == moved.pose


def test_the_session_tells_gestures_by_key_and_time() -> None:
    faults: list[Exception] = []
    session = Session(opened(OPTIMAL), lambda _: None, lambda _, __: None, faults.append)

    def post(key: object, value: float, stamp: float) -> Pose:
        session.post(key, lambda _: SetPosition(0, value), stamp=stamp)
        assert session.wait_until_idle()
        return start_of(session.state)

    pauses = PAUSE_SECONDS
    assert post("x", 11.0, 10.0 * pauses) == OPTIMAL.home
    assert post("x", 12.0, 10.9 * pauses) == OPTIMAL.home
    session.redraw()
    assert post("x", 13.0, 11.8 * pauses) == OPTIMAL.home
    assert post("drag", 14.0, 11.9 * pauses).position[0] == 13.0
    assert post("drag", 15.0, 13.0 * pauses).position[0] == 14.0
    session.do(GoHome())
    assert session.wait_until_idle()
    assert start_of(session.state).position[0] == 15.0
    assert faults == []
    session.stop()


def test_the_last_move_is_that_of_the_design_as_it_is_now(moved: State) -> None:
    # Not of the design's name or unit, which sweep nothing.
    renamed = replace(moved, design=msgspec.structs.replace(OPTIMAL, name="mine"))
    first, second = Frame(moved).last_move, Frame(renamed).last_move
    assert first is not None
    assert second is not None
    np.testing.assert_array_equal(first.clearance, second.clearance)
