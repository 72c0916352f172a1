"""Every step can be undone and redone; a drag is one step, and a press of a browser too."""

from __future__ import annotations

import importlib
import inspect
import itertools
import pkgutil
from contextlib import closing, suppress
from dataclasses import replace
from typing import Any

import numpy as np
import pytest
from client import wait_for
from desk import Desk
from hypothesis import given, settings, strategies as st
from socket_tab import SocketTab

import explorer.app
from explorer.app.features.optimise.actions import cancel_run, end_run, start_run
from explorer.app.features.optimise.state import Optimisation, SearchResult
from explorer.app.features.paths.actions import advance_journey, go, play, set_path_time
from explorer.app.features.paths.panel import CANCEL
from explorer.app.features.paths.state import journey_of
from explorer.app.features.singularity.work import go_to_singularity
from explorer.app.features.studies.state import open_study
from explorer.app.server import Running
from explorer.app.session import history
from explorer.app.session.history import (
    PAUSE_SECONDS,
    History,
    UserAction,
    start_history,
)
from explorer.app.session.session import REDO, UNDO, move_to
from explorer.app.state.actions import Action, Set, open_design, reset_design
from explorer.app.state.frame import Frame
from explorer.app.state.geometry import set_variable
from explorer.app.state.moves import go_home, set_angle, set_joint, set_mode, set_position
from explorer.app.state.state import Hold, State, open_state
from explorer.errors import ExplorerError, InputError
from explorer.legs.moves import move_clearance
from explorer.mechanism.design import JOINTS, VARIABLES, Limits
from explorer.mechanism.design_file import PRESETS
from explorer.mechanism.pose import Pose
from explorer.page.state.presses import Press, Presses

# Each example is a whole session.
few = settings(max_examples=settings().max_examples // 3)
OPTIMAL, OTHER = PRESETS["paper-optimal"], PRESETS["paper-initial"]

CANCELLED = SearchResult("cancelled", "cancelled before the first iterate")

lengths = st.floats(0.5, 25.0)
actions = st.one_of(
    st.builds(set_joint, st.integers(0, 5), lengths),
    st.builds(set_position, st.integers(0, 2), st.floats(-20.0, 20.0)),
    st.builds(set_angle, st.integers(0, 2), st.floats(-180.0, 180.0)),
    st.builds(set_mode, st.integers(0, 7)),
    st.builds(set_variable, st.sampled_from(VARIABLES), st.floats(-20.0, 20.0)),
    st.builds(Set, st.just("design.unit_mm"), st.floats(0.1, 100.0)),
    st.builds(Set, st.just("hold"), st.sampled_from(["pose", "legs"])),
    st.builds(open_design, st.sampled_from([OPTIMAL, OTHER])),
    st.builds(go_to_singularity, st.sampled_from([None, 1, 2, 3])),
    st.sampled_from([go_home(), reset_design(), play(True), play(False), advance_journey(0.5)]),
    st.builds(go),
    st.builds(set_path_time, st.floats(0.0, 9.0)),
)


class Recorder:
    """A state and its history, changed by actions; each of a control of its own by default."""

    def __init__(self, state: State | None = None) -> None:
        self.state = open_state(OPTIMAL) if state is None else state
        self.history = start_history(self.state)
        self.time = 0.0

    def do(
        self, action: Action, source: object = None, pause: float = 0.1, press: Press | None = None
    ) -> None:
        self.time += pause
        event = UserAction(action, object() if source is None else source, self.time, press)
        self.state = event.apply(self.state)
        self.history = self.history.record(event, self.state)

    def move(self, steps: int) -> None:
        self.history = self.history.move(steps).restore(self.state)
        self.state = self.history.step.state

    @property
    def words(self) -> list[str]:
        """Words of the steps, without the opening."""
        return [step.words for step in self.history.steps[1:]]


@pytest.fixture
def recorder() -> Recorder:
    return Recorder()


@few
@given(st.lists(st.tuples(actions, st.sampled_from("abc"), st.floats(0.0, 3.0)), max_size=25))
def test_history_undoes_and_redoes_every_step_exactly(
    events: list[tuple[Action, str, float]],
) -> None:
    recorder = Recorder()
    for action, source, pause in events:
        try:
            recorder.do(action, source, pause)
        except ExplorerError:
            continue
        # The step holds the state that the page shows.
        assert recorder.history.step.state == recorder.state.for_step()
        assert recorder.history.step.words
        assert recorder.history.at == len(recorder.history.steps) - 1
    before, steps = recorder.history, recorder.history.steps
    assert [step.number for step in steps] == [*range(len(steps))]
    states = [step.state for step in steps]
    assert all(a != b for a, b in itertools.pairwise(states))
    for step, expected, refusal in ((-1, states[-2::-1], "undo"), (1, states[1:], "redo")):
        for state in expected:
            recorder.move(step)
            assert recorder.state.for_step() == state
        with pytest.raises(InputError, match=f"nothing to {refusal}"):
            recorder.move(step)
    for step in steps:
        assert before.move_to(step.number).step is step


press_or_none = st.one_of(st.none(), st.builds(Press, st.integers(1, 2), st.integers(1, 3)))


@few
@given(
    st.lists(
        st.tuples(st.sampled_from("ab"), press_or_none, st.floats(0.0, 3.0 * PAUSE_SECONDS)),
        min_size=1,
    )
)
def test_step_ends_with_the_press_with_the_control_or_after_a_pause(
    events: list[tuple[str, Press | None, float]],
) -> None:
    recorder = Recorder()
    steps, last, held = 0, "", None
    for index, (source, press, pause) in enumerate(events):
        # Never twice the same, so that no step ends where it began.
        recorder.do(set_position(0, 11.0 + 0.01 * index), source, pause, press)
        if press is not None and held is not None and press.client == held.client:
            is_new = press != held
        else:
            is_new = pause > PAUSE_SECONDS
        if is_new or source != last:
            steps, held = steps + 1, None
        last, held = source, press or held
        assert len(recorder.words) == steps


def test_drag_that_ends_where_it_began_is_no_step(recorder: Recorder) -> None:
    x = recorder.state.pose.position[0]
    for value in (x + 1.0, x + 2.0, x):
        recorder.do(set_position(0, value), "x")
    recorder.do(go_home())
    assert recorder.words == []


def test_change_after_undoing_is_a_new_step_even_at_once(recorder: Recorder) -> None:
    for axis in range(3):
        recorder.do(set_position(axis, 5.0 + axis), axis)
    recorder.move(-1)
    kept = recorder.history.step
    recorder.do(set_position(1, 3.0), 1)
    assert recorder.words == ["x = 50 mm", "y = 60 mm", "y = 30 mm"]
    assert recorder.history.steps[2] is kept


def test_oldest_steps_are_dropped_and_the_others_keep_their_numbers(
    recorder: Recorder, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setattr(history, "MOST_STEPS", 10)
    for index in range(25):
        recorder.do(set_position(0, 10.5 + index * 1e-3))
    steps = recorder.history.steps
    assert [step.number for step in steps] == [*range(16, 26)]
    assert recorder.history.move_to(16).at == 0
    with pytest.raises(InputError, match="not kept"):
        recorder.history.move_to(15)


def test_playing_path_belongs_to_the_step_that_began_it(recorder: Recorder) -> None:
    recorder.do(go())
    for _ in range(5):
        recorder.do(advance_journey(0.3), "player", 1.0)
    assert len(recorder.words) == 1
    journey = journey_of(recorder.history.step.state)
    assert journey is not None
    assert journey.at == pytest.approx(1.5)
    assert not journey.is_playing
    recorder.move(-1)
    assert recorder.state.for_step() == open_state(OPTIMAL).for_step()


def test_search_is_one_step_and_no_step_is_undone_meanwhile() -> None:
    recorder = Recorder(open_state(OTHER))
    recorder.do(start_run())
    assert recorder.words == []
    with pytest.raises(InputError, match="cancel that first"):
        recorder.move(0)
    # A change of the view meanwhile belongs to the step.
    for action in (open_study("trade-off"), cancel_run(), end_run(1, CANCELLED)):
        recorder.do(action)
    assert len(recorder.words) == 1
    recorder.move(-1)
    assert Optimisation.of(recorder.state).run is None
    # The next run gets a number of its own.
    again = start_run().apply(recorder.state)
    run = Optimisation.of(again).run
    assert run is not None
    assert run.number == 2


def test_page_drawn_again_after_undo_leaves_what_can_be_redone(recorder: Recorder) -> None:
    planned = Set("paths.kind", "planned")
    for action in (planned, go(), CANCEL, start_run(), end_run(1, CANCELLED)):
        recorder.do(action)
    words = recorder.words
    recorder.move(-len(words))
    recorder.do(Set("hold", recorder.state.hold))
    assert recorder.words == words
    recorder.move(len(words))


def test_session_undoes_and_redoes_exactly(desk: Desk) -> None:
    first = desk.state
    # Each press is a step, also several in one frame.
    for value in (15.0, 15.5, 16.0):
        desk.session.do(set_variable("a3x", value))
    last = desk.state
    for _ in range(4):
        desk.session.do(UNDO)
    assert desk.state == first.for_step()
    assert desk.complaints == ["there is nothing to undo"]
    for _ in range(3):
        desk.session.do(REDO)
    assert desk.state.for_step() == last.for_step()
    desk.session.do(move_to(1))
    assert desk.state.design.variables[0] == 15.0


def test_thread_that_sees_a_new_state_finds_its_step(
    desk: Desk, monkeypatch: pytest.MonkeyPatch
) -> None:
    before = desk.state
    seen: list[State] = []
    record = History.record

    def watch(self: History, event: UserAction, state: State) -> History:
        seen.append(desk.session.state)
        return record(self, event, state)

    monkeypatch.setattr(History, "record", watch)
    desk.session.do(set_variable("a3x", 15.0))
    assert desk.state != before
    assert seen == [before]


VIEWS: list[Action] = [
    Set("view.flags", False, "Flags"),
    Set("view.warn_below", 0.5),
    Set("view.workspace.cut", "x", "Cut open", "across x"),
]
CHANGES: list[Action] = [set_position(0, 9.0), set_variable("a3x", 18.0), set_joint(0, 12.0)]


@few
@given(st.lists(st.sampled_from([*VIEWS, *CHANGES, "undo", "redo"]), max_size=20))
def test_what_is_shown_is_no_step_and_undo_leaves_it(done: list[Action | str]) -> None:
    recorder, alone = Recorder(open_state(OPTIMAL)), Recorder(open_state(OPTIMAL))
    view = recorder.state.view
    for each in done:
        if isinstance(each, Action):
            recorder.do(each)
            if each in VIEWS:
                view = each.apply(replace(recorder.state, view=view)).view
            else:
                alone.do(each)
        else:
            for one in (recorder, alone):
                with suppress(InputError):
                    one.move(-1 if each == "undo" else 1)
        assert recorder.state.view == view
        assert recorder.history.step.state.view == view
        assert recorder.words == alone.words
        assert recorder.state.for_step() == replace(alone.state, view=view).for_step()


def test_every_action_has_words() -> None:
    for module in pkgutil.walk_packages(explorer.app.__path__, "explorer.app."):
        for name, made in vars(importlib.import_module(module.name)).items():
            if getattr(made, "__code__", None) is set_mode.__code__:
                given = inspect.getclosurevars(made).nonlocals
                worded = given["words"] or given["kind"].get("continues")
                assert worded, f"{module.name}.{name}: no words for its step"


@pytest.fixture
def moved() -> State:
    """The optimum after a move along x from its home pose, at the time 100."""
    return UserAction(set_position(0, 14.0), "x", 100.0).apply(open_state(OPTIMAL))


def start_of(state: State) -> Pose:
    assert state.gesture is not None
    return state.gesture.start


def test_drag_of_many_events_is_one_move_from_where_it_began() -> None:
    state = start = open_state(OPTIMAL)
    assert start.gesture is None
    assert Frame(start).last_move is None
    for i in range(30):
        state = UserAction(set_position(0, 10.0 + 0.2 * (i + 1)), "x", 50.0 + 0.016 * i).apply(
            state
        )
    assert start_of(state) == start.pose
    move = Frame(state).last_move
    assert move is not None
    assert (move.start, move.end, move.steps) == (start.pose, state.pose, 1)
    expected = move_clearance(OPTIMAL, start.pose, state.pose)
    np.testing.assert_array_equal(move.clearance, expected.clearance)
    np.testing.assert_array_equal(move.overlaps, expected.overlaps)


@pytest.mark.parametrize(
    "action",
    [
        set_variable("b1x", 4.3),
        open_design(OTHER),
        open_design(OPTIMAL),
        reset_design(),
        set_mode(6),
    ],
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
    for action in (thick, Set("design.unit_mm", 3.0), Set("view", open_state(OTHER).view)):
        assert UserAction(action, "other", 100.1).apply(moved).gesture == moved.gesture


def test_last_move_has_the_radii_of_the_present_design(moved: State) -> None:
    thin = Frame(moved).last_move
    limits = Limits(leg_radii=(0.5, 0.1, 0.2, 0.4))
    thick = Frame(Set("design.limits", limits).apply(moved)).last_move
    assert thin is not None
    assert thick is not None
    sums = [0.6, 0.7, 0.9, 0.3, 0.5, 0.6]
    np.testing.assert_allclose(thick.clearance, thin.clearance - sums, atol=1e-9)


def test_move_back_to_the_start_sweeps_nothing(moved: State) -> None:
    back = UserAction(set_position(0, 10.0), "x", 100.2).apply(moved)
    assert back.pose == OPTIMAL.home
    assert Frame(back).last_move is None
    on = UserAction(set_position(0, 9.0), "x", 100.4).apply(back)
    assert start_of(on) == OPTIMAL.home
    assert Frame(on).last_move is not None


def test_drag_through_lengths_that_cannot_close_is_one_move(moved: State) -> None:
    joint = JOINTS.index("l1")
    low, high = Frame(moved).snapshot.intervals[joint][-1]
    state = UserAction(set_joint(joint, 0.5 * (low + high)), "l1", 200.0).apply(moved)
    for i in range(8):
        state = UserAction(set_joint(joint, high + 1.0 + i), "l1", 200.2 + 0.2 * i).apply(state)
        assert state.unclosed is not None
    state = UserAction(set_joint(joint, high - 0.01), "l1", 201.8).apply(state)
    assert start_of(state) == moved.pose


def test_button_begins_a_new_move_and_a_singularity_does_not(moved: State) -> None:
    home = UserAction(go_home(), object(), 100.1).apply(moved)
    assert start_of(home) == moved.pose
    again = UserAction(go_home(), object(), 100.2).apply(home)
    assert again.gesture == home.gesture
    through = UserAction(set_position(2, -4.0), "z", 300.0).apply(moved)
    assert through.mode != moved.mode
    assert start_of(through) == moved.pose


@pytest.fixture
def presses() -> Presses:
    return Presses()


def test_press_lasts_from_its_beginning_to_its_release(presses: Presses) -> None:
    presses.record(1, 7, 10.0)
    assert presses.at(1, 9.9) is None
    assert presses.at(1, 10.0) == presses.at(1, 1e6) == Press(1, 7)
    # Presses of other browsers last no longer than their own.
    presses.record(2, -3, 10.0)
    assert presses.at(2, 11.0) is presses.at(None, 11.0) is None
    presses.record(1, -7, 20.0)
    assert presses.at(1, 20.0) == Press(1, 7)
    assert presses.at(1, 20.1) is None
    # What was done before the release may be made after it.
    assert presses.at(1, 15.0) == Press(1, 7)
    presses.forget(1)
    presses.forget(3)
    assert presses.at(1, 15.0) is None


def test_press_ends_with_the_next_one_and_goes_on_after_its_window_was_left(
    presses: Presses,
) -> None:
    presses.record(1, 7, 10.0)
    presses.record(1, -7, 11.0)
    presses.record(1, 7, 15.0)
    assert presses.at(1, 16.0) == Press(1, 7)
    presses.record(1, 8, 20.0)
    # Its release was lost on the way.
    presses.record(1, -7, 20.1)
    assert presses.at(1, 19.0) == Press(1, 7)
    assert presses.at(1, 21.0) == Press(1, 8)


def test_changes_during_a_press_of_a_browser_are_one_step(
    running: Running, monkeypatch: pytest.MonkeyPatch
) -> None:
    # Every pause is too long.
    monkeypatch.setattr(history, "PAUSE_SECONDS", -1.0)
    gui: Any = running.viser.gui
    handles: list[Any] = list(gui._gui_input_handle_from_uuid.values())
    slider = next(each for each in handles if each.label == "x")
    session: Any = running.page.session
    with closing(SocketTab(running.url)) as tab:

        def inboxes() -> list[str]:
            clients: list[Any] = list(running.viser.get_clients().values())
            fields = [each.gui._gui_input_handle_from_uuid for each in clients]
            both = [pair for each in fields for pair in tuple(each.items())]
            # A field is there before the explorer listens to it.
            return [uuid for uuid, f in both if f.label == "Press" and f._impl.update_cb]

        wait_for(inboxes)
        (inbox,) = inboxes()
        begun = len(session.history.steps)
        values = (11.0 + 0.25 * number for number in itertools.count())

        def move() -> int:
            value = next(values)
            tab.update(slider._impl.uuid, OPTIMAL.unit_mm * value)
            wait_for(lambda: session.state.pose.position[0] == value)
            assert session.wait_until_idle()
            return len(session.history.steps) - begun

        tab.update(inbox, 1)
        assert [move() for _ in range(3)] == [1, 1, 1]
        tab.update(inbox, -1)
        tab.update(inbox, 2)
        assert [move() for _ in range(3)] == [2, 2, 2]
        # Without a press, as with keys, each is a step.
        tab.update(inbox, -2)
        wait_for(lambda: move() > 2)
        last = move()
        assert [move() for _ in range(2)] == [last + 1, last + 2]
