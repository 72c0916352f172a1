"""The history: every step can be undone, redone and gone back to, and a drag is one step."""

from __future__ import annotations

import importlib
import itertools
import pkgutil
from contextlib import suppress
from dataclasses import replace

import pytest
from desk import Desk
from hypothesis import given, settings, strategies as st

import explorer.app
from explorer.app.features.optimise.actions import CancelRun, EndRun, StartRun
from explorer.app.features.paths.actions import Advance, CancelPlan, Go, Play, SetPathTime
from explorer.app.features.singularity.actions import GoToSingularity, GoToStratum, Jog
from explorer.app.features.studies.actions import BrushAxis, OpenStudy
from explorer.app.session import history
from explorer.app.session.gestures import PAUSE_SECONDS, UserAction
from explorer.app.session.history import restore, settle, start_history
from explorer.app.session.session import REDO, UNDO
from explorer.app.state.action import Action
from explorer.app.state.actions import (
    GoHome,
    Open,
    Reset,
    Set,
    SetAngle,
    SetJoint,
    SetMode,
    SetPose,
    SetPosition,
    SetVariable,
)
from explorer.app.state.optimisation import SearchResult
from explorer.app.state.presses import Press
from explorer.app.state.state import State, opened
from explorer.errors import ExplorerError, InputError
from explorer.mechanism.design import VARIABLES
from explorer.mechanism.design_file import PRESETS
from explorer.mechanism.pose import Pose

# Each example is a whole session.
few = settings(max_examples=settings().max_examples // 3)
OPTIMAL, OTHER = PRESETS["paper-optimal"], PRESETS["paper-initial"]

CANCELLED = SearchResult("cancelled", "cancelled before the first iterate")

lengths = st.floats(0.5, 25.0)
actions = st.one_of(
    st.builds(SetJoint, st.integers(0, 5), lengths),
    st.builds(SetPosition, st.integers(0, 2), st.floats(-20.0, 20.0)),
    st.builds(SetAngle, st.integers(0, 2), st.floats(-180.0, 180.0)),
    st.builds(SetMode, st.integers(0, 7)),
    st.builds(SetVariable, st.sampled_from(VARIABLES), st.floats(-20.0, 20.0)),
    st.builds(Set, st.just("design.unit_mm"), st.floats(0.1, 100.0)),
    st.builds(Set, st.just("hold"), st.sampled_from(["pose", "legs"])),
    st.builds(Open, st.sampled_from([OPTIMAL, OTHER])),
    st.builds(Jog, st.integers(0, 5), st.floats(-3.0, 3.0)),
    st.builds(GoToSingularity, st.sampled_from([None, 1, 2, 3])),
    st.sampled_from([GoHome(), Reset(), Play(on=True), Play(on=False), Advance(0.5)]),
    st.builds(Go),
    st.builds(SetPathTime, st.floats(0.0, 9.0)),
)


class Recorder:
    """A state and its history, changed by actions; each of a control of its own by default."""

    def __init__(self, state: State | None = None) -> None:
        self.state = opened(OPTIMAL) if state is None else state
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
        self.state, self.history = restore(self.history.move(steps), self.state)

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
        assert recorder.history.step.state == settle(recorder.state)
        assert recorder.history.step.words
        assert recorder.history.at == len(recorder.history.steps) - 1
    before, steps = recorder.history, recorder.history.steps
    assert [step.number for step in steps] == [*range(len(steps))]
    states = [step.state for step in steps]
    assert all(a != b for a, b in itertools.pairwise(states))
    for step, expected, refusal in ((-1, states[-2::-1], "undo"), (1, states[1:], "redo")):
        for state in expected:
            recorder.move(step)
            assert settle(recorder.state) == state
        with pytest.raises(InputError, match=f"nothing to {refusal}"):
            recorder.move(step)
    for step in steps:
        assert before.move_to(step.number).step is step


presses = st.one_of(st.none(), st.builds(Press, st.integers(1, 2), st.integers(1, 3)))


@few
@given(
    st.lists(
        st.tuples(st.sampled_from("ab"), presses, st.floats(0.0, 3.0 * PAUSE_SECONDS)), min_size=1
    )
)
def test_step_ends_with_the_press_with_the_control_or_after_a_pause(
    events: list[tuple[str, Press | None, float]],
) -> None:
    recorder = Recorder()
    steps, last, held = 0, "", None
    for index, (source, press, pause) in enumerate(events):
        # Never twice the same, so that no step ends where it began.
        recorder.do(SetPosition(0, 11.0 + 0.01 * index), source, pause, press)
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
        recorder.do(SetPosition(0, value), "x")
    recorder.do(GoHome())
    assert recorder.words == []


def test_change_after_undoing_is_a_new_step_even_at_once(recorder: Recorder) -> None:
    for axis in range(3):
        recorder.do(SetPosition(axis, 5.0 + axis), axis)
    recorder.move(-1)
    kept = recorder.history.step
    recorder.do(SetPosition(1, 3.0), 1)
    assert recorder.words == ["x = 5", "y = 6", "y = 3"]
    assert recorder.history.steps[2] is kept


def test_oldest_steps_are_dropped_and_the_others_keep_their_numbers(
    recorder: Recorder, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setattr(history, "MOST_STEPS", 10)
    for index in range(25):
        recorder.do(SetPosition(0, 10.5 + index * 1e-3))
    steps = recorder.history.steps
    assert [step.number for step in steps] == [*range(16, 26)]
    assert recorder.history.move_to(16).at == 0
    with pytest.raises(InputError, match="not kept"):
        recorder.history.move_to(15)


def test_playing_path_belongs_to_the_step_that_began_it(recorder: Recorder) -> None:
    recorder.do(Go())
    for _ in range(5):
        recorder.do(Advance(0.3), "player", 1.0)
    assert len(recorder.words) == 1
    journey = recorder.history.step.state.journey
    assert journey is not None
    assert journey.at == pytest.approx(1.5)
    assert not journey.is_playing
    recorder.move(-1)
    assert settle(recorder.state) == settle(opened(OPTIMAL))


def test_search_is_one_step_and_no_step_is_undone_meanwhile() -> None:
    recorder = Recorder(opened(OTHER))
    recorder.do(StartRun())
    assert recorder.words == []
    with pytest.raises(InputError, match="cancel that first"):
        recorder.move(0)
    # A change of the view meanwhile belongs to the step.
    for action in (OpenStudy("trade-off"), CancelRun(), EndRun(1, CANCELLED)):
        recorder.do(action)
    assert len(recorder.words) == 1
    recorder.move(-1)
    assert recorder.state.optimisation.run is None
    # The next run gets a number of its own.
    again = StartRun().apply(recorder.state)
    assert again.optimisation.run is not None
    assert again.optimisation.run.number == 2


def test_page_drawn_again_after_undo_leaves_what_can_be_redone(recorder: Recorder) -> None:
    planned = Set("paths.kind", "planned")
    for action in (planned, Go(), CancelPlan(), StartRun(), EndRun(1, CANCELLED)):
        recorder.do(action)
    words = recorder.words
    recorder.move(-len(words))
    recorder.do(Set("hold", recorder.state.hold))
    assert recorder.words == words
    recorder.move(len(words))


def test_unclosed_length_is_undone_with_its_message(recorder: Recorder) -> None:
    recorder.do(SetJoint(0, 1000.0))
    assert recorder.state.unclosed is not None
    recorder.move(-1)
    assert (recorder.state.unclosed, recorder.state.joints) == (None, opened(OPTIMAL).joints)


def test_session_undoes_and_redoes_exactly(desk: Desk) -> None:
    first = desk.state
    # Each press is a step, also several in one frame.
    for value in (15.0, 15.5, 16.0):
        desk.session.do(SetVariable("a3x", value))
    last = desk.state
    for _ in range(4):
        desk.session.travel(UNDO)
    assert desk.state == settle(first)
    assert desk.complaints == ["there is nothing to undo"]
    for _ in range(3):
        desk.session.travel(REDO)
    assert settle(desk.state) == settle(last)
    desk.session.travel_to("slider", 1, stamp=None, who=None)
    assert desk.state.design.variables[0] == 15.0


VIEWS: list[Action] = [
    Set("view.flags", False, "Flags"),
    Set("view.warn_below", 0.5),
    Set("view.workspace.cut", "x", "Cut open", "across x"),
]
CHANGES: list[Action] = [SetPosition(0, 9.0), SetVariable("a3x", 18.0), SetJoint(0, 12.0)]


@few
@given(st.lists(st.sampled_from([*VIEWS, *CHANGES, "undo", "redo"]), max_size=20))
def test_what_is_shown_is_no_step_and_undo_leaves_it(done: list[Action | str]) -> None:
    recorder, alone = Recorder(opened(OPTIMAL)), Recorder(opened(OPTIMAL))
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
        assert settle(recorder.state) == settle(replace(alone.state, view=view))


@pytest.mark.parametrize(
    ("action", "expected"),
    [
        (SetJoint(0, 12.5), "l1 = 12.5"),
        (SetPosition(2, 9.25), "z = 9.25"),
        (SetAngle(0, -70.0), "yaw = −70°"),
        (SetPose(Pose((1.0, 2.0, 3.0), (1.0, 0.0, 0.0, 0.0))), "Move b4 to 1, 2, 3"),
        (SetMode(1), "Assembly mode 1 (− − +)"),
        (SetVariable("b3", 5.0), "b3 = 5"),
        (Jog(0, 2.0), "δ1 alone, by 2°"),
        (GoToStratum((3, 4, 2, 1)), "Go to stratum (3, 4, 2, 1)"),
        (GoToSingularity(2), "Go to the nearest pose with δ2 = 0"),
        (Open(OTHER), f"Open {OTHER.name}"),
        (OpenStudy("trade-off"), "Study trade-off"),
        (BrushAxis("mean_margin", ((1.0, 2.0),)), "Brush mean margin at nodes"),
    ],
    ids=lambda each: str(each)[:20],
)
def test_step_names_its_action(recorder: Recorder, action: Action, expected: str) -> None:
    recorder.do(action)
    assert recorder.words == [expected]


def test_every_action_has_words() -> None:
    # These end no step, or are described by what they lead to.
    silent = {StartRun, CancelRun, UserAction}
    for module in pkgutil.walk_packages(explorer.app.__path__, "explorer.app."):
        for name, kind in vars(importlib.import_module(module.name)).items():
            if not (isinstance(kind, type) and issubclass(kind, Action) and name[0] != "_"):
                continue
            if kind is not Action and kind not in silent and not kind.continues:
                own = kind.words is not Action.words or kind.describe is not Action.describe
                worded = kind.template or own
                assert worded, f"{module.name}.{name}: no words for its step"
