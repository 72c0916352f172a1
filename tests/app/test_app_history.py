"""The history: every step can be undone, redone and gone back to, and a drag is one step."""

from __future__ import annotations

import importlib
import itertools
import pkgutil
from dataclasses import replace

import msgspec
import pytest
from desk import Desk
from hypothesis import given, strategies as st

import explorer.app
from explorer.app.features.optimise.actions import CancelRun, EndRun, SetWish, StartRun
from explorer.app.features.paths.actions import Advance, Play, SetPathTime, WatchModes
from explorer.app.features.singularity.actions import GoToSingularity, GoToStratum, Jog
from explorer.app.features.studies.actions import BrushAxis, OpenStudy
from explorer.app.session.gestures import PAUSE_SECONDS, ByHand
from explorer.app.session.history import MOST_STEPS, History, begun, document, restored
from explorer.app.session.session import REDO, UNDO
from explorer.app.state.action import Action
from explorer.app.state.actions import (
    GoHome,
    Open,
    Reset,
    SetAngle,
    SetHold,
    SetJoint,
    SetLimits,
    SetMode,
    SetPose,
    SetPosition,
    SetUnit,
    SetVariable,
    SetView,
)
from explorer.app.state.optimisation import SearchResult, Wish
from explorer.app.state.presses import Press
from explorer.app.state.state import Joints, State, opened
from explorer.errors import ExplorerError, InputError
from explorer.mechanism.design import VARIABLES
from explorer.mechanism.design_file import PRESETS
from explorer.mechanism.pose import Pose

OPTIMAL, OTHER = PRESETS["paper-optimal"], PRESETS["paper-initial"]

lengths = st.floats(0.5, 25.0)
actions = st.one_of(
    st.builds(SetJoint, st.integers(0, 5), lengths),
    st.builds(SetPosition, st.integers(0, 2), st.floats(-20.0, 20.0)),
    st.builds(SetAngle, st.integers(0, 2), st.floats(-180.0, 180.0)),
    st.builds(SetMode, st.integers(0, 7)),
    st.builds(SetVariable, st.sampled_from(VARIABLES), st.floats(-20.0, 20.0)),
    st.builds(SetUnit, st.floats(0.1, 100.0)),
    st.builds(SetHold, st.sampled_from(["pose", "legs"])),
    st.builds(Open, st.sampled_from([OPTIMAL, OTHER])),
    st.builds(Jog, st.integers(0, 5), st.floats(-3.0, 3.0)),
    st.builds(GoToSingularity, st.sampled_from([None, 1, 2, 3])),
    st.sampled_from([GoHome(), Reset(), Play(on=True), Play(on=False), Advance(0.5)]),
    st.builds(WatchModes),
    st.builds(SetPathTime, st.floats(0.0, 9.0)),
)


def done(
    history: History, state: State, action: Action, source: object, time: float
) -> tuple[History, State]:
    act = ByHand(action, source, time)
    after = act.apply(state)
    return history.recorded(act, after), after


@given(st.lists(st.tuples(actions, st.sampled_from("abc"), st.floats(0.0, 3.0)), max_size=25))
def test_undoing_goes_back_through_every_state_that_was_left_and_redoing_forth(
    events: list[tuple[Action, str, float]],
) -> None:
    state = opened(OPTIMAL)
    history, time = begun(state), 0.0
    for action, source, pause in events:
        time += pause
        try:
            history, state = done(history, state, action, source, time)
        except ExplorerError:
            continue
        # What the page shows is what the step holds.
        assert history.step.state == document(state)
        assert history.step.words
        assert not history.can_redo
    assert [step.number for step in history.steps] == [*range(len(history.steps))]
    states = [step.state for step in history.steps]
    assert all(a != b for a, b in itertools.pairwise(states))
    back = history
    for expected in states[-2::-1]:
        back = back.moved(-1)
        state = restored(back.step, state)
        assert document(state) == expected
    with pytest.raises(InputError, match="nothing to undo"):
        back.moved(-1)
    for expected in states[1:]:
        back = back.moved(1)
        assert back.step.state == expected
    with pytest.raises(InputError, match="nothing to redo"):
        back.moved(1)
    for step in history.steps:
        assert history.moved_to(step.number).step is step


@given(st.lists(st.tuples(st.sampled_from("ab"), st.floats(0.0, 2.0 * PAUSE_SECONDS)), min_size=1))
def test_a_pause_or_another_control_begins_a_new_step(events: list[tuple[str, float]]) -> None:
    state = opened(OPTIMAL)
    history, time = begun(state), 0.0
    steps, last = 0, None
    for index, (source, pause) in enumerate(events):
        time += pause
        # Never twice the same, so that no step ends where it began.
        history, state = done(history, state, SetPosition(0, 11.0 + 0.01 * index), source, time)
        if source != last or pause > PAUSE_SECONDS:
            steps += 1
        last = source
        assert len(history.steps) == steps + 1


presses = st.one_of(st.none(), st.builds(Press, st.integers(1, 2), st.integers(1, 3)))


@given(st.lists(st.tuples(presses, st.floats(0.0, 3.0 * PAUSE_SECONDS)), min_size=1))
def test_history_from_press_to_release_is_one_step_however_long_it_rests(
    events: list[tuple[Press | None, float]],
) -> None:
    state = opened(OPTIMAL)
    history, time = begun(state), 0.0
    steps, held = 0, None
    for index, (press, pause) in enumerate(events):
        time += pause
        act = ByHand(SetPosition(0, 11.0 + 0.01 * index), "x", time, press)
        state = act.apply(state)
        history = history.recorded(act, state)
        if press is not None and held is not None and press.client == held.client:
            is_new = press != held
        else:
            is_new = pause > PAUSE_SECONDS
        if is_new or index == 0:
            steps, held = steps + 1, None
        held = press or held
        assert len(history.steps) == steps + 1


def test_a_drag_that_ends_where_it_began_is_no_step() -> None:
    state = opened(OPTIMAL)
    history = begun(state)
    x = state.pose.position[0]
    for index, value in enumerate((x + 1.0, x + 2.0, x)):
        history, state = done(history, state, SetPosition(0, value), "x", 0.1 * index)
    assert len(history.steps) == 1
    history, state = done(history, state, GoHome(), "home", 5.0)
    assert len(history.steps) == 1


def test_what_is_changed_after_undoing_is_a_new_step_even_at_once() -> None:
    state = opened(OPTIMAL)
    history = begun(state)
    for index in range(3):
        action = SetPosition(index, 5.0 + index)
        history, state = done(history, state, action, index, 0.1 * index)
    history = history.moved(-1)
    state = restored(history.step, state)
    kept = history.step
    history, state = done(history, state, SetPosition(1, 3.0), 1, 0.3)
    assert [step.words for step in history.steps[1:]] == ["x = 5", "y = 6", "y = 3"]
    assert history.steps[2] is kept


def test_the_oldest_steps_are_forgotten_and_the_others_keep_their_numbers() -> None:
    state = opened(OPTIMAL)
    history = begun(state)
    for index in range(MOST_STEPS + 50):
        action = SetPosition(0, 10.5 + index * 1e-3)
        history, state = done(history, state, action, object(), float(index))
    assert len(history.steps) == MOST_STEPS
    assert history.steps[-1].number == MOST_STEPS + 50
    assert history.moved_to(history.steps[0].number).at == 0
    with pytest.raises(InputError, match="not kept"):
        history.moved_to(history.steps[0].number - 1)


def test_a_path_that_plays_belongs_to_the_step_that_began_it() -> None:
    state = opened(OPTIMAL)
    history, state = done(begun(state), state, WatchModes(), "watch", 0.0)
    for index in range(5):
        history, state = done(history, state, Advance(0.3), "player", 1.0 + index)
    assert len(history.steps) == 2
    journey = history.step.state.journey
    assert journey is not None
    assert journey.at == pytest.approx(1.5)
    assert not journey.is_playing
    back = history.moved(-1)
    assert document(restored(back.step, state)) == document(opened(OPTIMAL))


def test_a_search_is_one_step_and_nothing_is_undone_while_it_goes_on() -> None:
    state = opened(OTHER)
    history, state = done(begun(state), state, SetWish(Wish(volume=900.0)), "wish", 0.0)
    history, state = done(history, state, StartRun(), "start", 2.0)
    assert len(history.steps) == 2
    with pytest.raises(InputError, match="cancel that first"):
        restored(history.moved(-1).step, state)
    # Looking about meanwhile is allowed and belongs to it.
    view = replace(state.view, labels=False)
    history, state = done(history, state, SetView(view), "view", 3.0)
    history, state = done(history, state, CancelRun(), "start", 4.0)
    verdict = SearchResult("cancelled", "cancelled before the first iterate")
    history, state = done(history, state, EndRun(1, verdict), "optimiser", 5.0)
    assert len(history.steps) == 3
    after = restored(history.moved(-1).step, state)
    assert after.optimisation.run is None
    # The next run gets a number of its own.
    again = StartRun().apply(after)
    assert again.optimisation.run is not None
    assert again.optimisation.run.number == 2


def test_the_session_undoes_and_redoes_exactly(desk: Desk) -> None:
    first = desk.state
    desk.session.do(SetVariable("a3x", 15.0))
    desk.session.do(SetUnit(3.0))
    last = desk.state
    desk.session.travel(UNDO)
    desk.session.travel(UNDO)
    assert desk.state == document(first)
    desk.session.travel(UNDO)
    assert desk.state == document(first)
    assert desk.complaints == ["there is nothing to undo"]
    desk.session.travel(REDO)
    desk.session.travel(REDO)
    assert document(desk.state) == document(last)
    desk.session.travel_to("slider", 1, stamp=None, who=None)
    assert desk.state.design.variables[0] == 15.0
    assert desk.state.design.unit_mm == OPTIMAL.unit_mm


def test_undoing_nothing_of_two_at_once(desk: Desk) -> None:
    """Two presses in one frame are two steps."""
    for value in (1.0, 2.0, 3.0):
        desk.session.do(SetUnit(value))
    assert desk.state.design.unit_mm == 3.0
    for _ in range(2):
        desk.session.travel(UNDO)
    assert desk.state.design.unit_mm == 1.0


def test_an_unclosed_length_is_undone_with_its_complaint() -> None:
    state = opened(OPTIMAL)
    history, state = done(begun(state), state, SetJoint(0, 1000.0), "l1", 0.0)
    assert state.unclosed is not None
    back = restored(history.moved(-1).step, state)
    joints: Joints = opened(OPTIMAL).joints
    assert (back.unclosed, back.joints) == (None, joints)


WORDED = [
    (SetJoint(0, 12.5), "l1 = 12.5"),
    (SetPosition(2, 9.25), "z = 9.25"),
    (SetAngle(0, -70.0), "yaw = -70°"),
    (SetPose(Pose((1.0, 2.0, 3.0), (1.0, 0.0, 0.0, 0.0))), "Move b4 to 1, 2, 3"),
    (SetMode(1), "Assembly mode 1 (− − +)"),
    (SetVariable("b3", 5.0), "b3 = 5"),
    (Jog(0, 2.0), "δ1 alone, by 2°"),
    (GoToStratum((3, 4, 2, 1)), "Go to stratum (3, 4, 2, 1)"),
    (GoToSingularity(2), "Go to the nearest pose with δ2 = 0"),
    (Open(OTHER), f"Open {OTHER.name}"),
    (OpenStudy("trade-off"), "Study trade-off"),
    (BrushAxis("mean_margin", ((1.0, 2.0),)), "Brush mean margin at nodes"),
]


@pytest.mark.parametrize(("action", "expected"), WORDED, ids=lambda each: str(each)[:20])
def test_steps_say_what_was_done(action: Action, expected: str) -> None:
    state = opened(OPTIMAL)
    history, _ = done(begun(state), state, action, None, 0.0)
    assert history.step.words == expected


def test_of_many_values_at_once_those_are_named_that_differ() -> None:
    state = opened(OPTIMAL)
    limits = msgspec.structs.replace(OPTIMAL.limits, gap=0.5, margin=None)
    history, state = done(begun(state), state, SetLimits(limits), None, 0.0)
    assert history.step.words in ("Limits: gap 0.5", "Limits: gap 0.5, margin by default")
    workspace = replace(state.view.workspace, solid=True)
    view = replace(state.view, labels=False, workspace=workspace)
    history, state = done(history, state, SetView(view), None, 9.0)
    assert history.step.words == "View: labels off, workspace solid on"


def test_every_action_has_words_of_its_own() -> None:
    # These end no step, or are described by what they lead to.
    silent = {StartRun, CancelRun, ByHand}
    for module in pkgutil.walk_packages(explorer.app.__path__, "explorer.app."):
        for name, kind in vars(importlib.import_module(module.name)).items():
            if not (isinstance(kind, type) and issubclass(kind, Action) and name[0] != "_"):
                continue
            if kind is not Action and kind not in silent and not kind.continues:
                own = {"words", "describe"} & set(vars(kind))
                worded = kind.template or own
                assert worded, f"{module.name}.{name}: no words for its step"
