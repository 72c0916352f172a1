"""Optimising on the page, with a real session and a real process: runs, ends, and what stays."""

from __future__ import annotations

import os
import re
import signal
import time
from collections.abc import Callable, Iterator
from dataclasses import dataclass, replace
from html import unescape
from types import SimpleNamespace
from typing import Any

import msgspec
import numpy as np
import pytest
import viser
from desk import number, rows_of
from limited_designs import limited
from services import services_for

from explorer import Actuators, Payload, Struts
from explorer.app.features.optimise import runner as optimiser
from explorer.app.features.optimise.actions import (
    Accept,
    Advance,
    CancelRun,
    EndRun,
    LiftLimit,
    Revert,
    SetRequest,
    StartRun,
    TakePaperBox,
)
from explorer.app.features.optimise.buttons import (
    ACCEPT,
    CANCEL,
    HULL,
    LIFT,
    PAPER,
    PAPER_BOX,
    REVERT,
    START,
)
from explorer.app.features.optimise.limits import limit_rows
from explorer.app.features.optimise.panel import OptimisePanel
from explorer.app.features.optimise.plots import curves_of, data_of
from explorer.app.features.optimise.problem import (
    box_within,
    liftable,
    problem_of,
    refuted,
    requested_box,
    requested_reach,
    requested_volume,
)
from explorer.app.features.optimise.runner import Optimiser
from explorer.app.features.optimise.scene import FARTHEST, box_shown, edges_of, single
from explorer.app.features.optimise.tasks import compare, optimise
from explorer.app.features.optimise.words import (
    comparison_table,
    refused_words,
    result_words,
    search_notice,
    value_text,
    verdict_words,
)
from explorer.app.features.sharing.tasks import export_report
from explorer.app.session.session import UNDO, Session
from explorer.app.session.worker import Channel
from explorer.app.state.action import Action
from explorer.app.state.actions import (
    Open,
    Reset,
    Set,
    SetAngle,
    SetJoint,
    SetPosition,
    SetVariable,
)
from explorer.app.state.frame import Frame
from explorer.app.state.optimisation import PLACE, OptimisationRequest
from explorer.app.state.state import Run, State, opened
from explorer.app.widgets.assigning import Assigner
from explorer.app.widgets.buttons import Buttons
from explorer.errors import InputError, NoAnswerError
from explorer.measures.size import corners_of
from explorer.mechanism.design import VARIABLES, Design, Swing
from explorer.mechanism.design_file import PRESETS
from explorer.mechanism.home import home_pose
from explorer.mechanism.pose import Pose
from explorer.optimise.outcome import Iterate
from explorer.optimise.paper import paper_problem, paper_start
from explorer.optimise.problem import OBJECTIVES, YAW, ObjectiveName
from explorer.optimise.record import decode_record, encode_record, record_of
from explorer.optimise.refutation.lifting import MAXIMA, SWING_LIMIT
from explorer.optimise.search.trail import Trail
from explorer.optimise.solver import optimise_design
from explorer.workspace.limits.constraints import GAP, constraints, slacks
from explorer.workspace.slices.volume import workspace_volume

pytestmark = pytest.mark.usefixtures("warm_kernels")

INITIAL, OPTIMAL = PRESETS["paper-initial"], PRESETS["paper-optimal"]
PATIENCE = 240.0
SMALL = OptimisationRequest(volume=8000.0)
# With so many starts a search goes on until it is ended.
ENDLESS = OptimisationRequest(objective="smallest-reach", volume=7053.0, starts=10_000)


class Bench:
    """A session with an optimiser and the panel, as the page has them, and what was drawn."""

    def __init__(self, server: viser.ViserServer, state: State) -> None:
        self.complaints: list[str] = []
        self.reports: list[str] = []
        self.states: list[State] = []
        self._assigner = Assigner(server)
        self.session = Session(
            state, self._draw, lambda message, _: self.complaints.append(message), self._fail
        )
        self.services = services = services_for(
            server, self.session, buttons=Buttons(server), tell=self.reports.append
        )
        self.optimiser = services.get(Optimiser)
        self.panel: Any = OptimisePanel(services)

    @property
    def state(self) -> State:
        assert self.session.wait_until_idle()
        return self.session.state

    @property
    def run(self) -> Run:
        return run_of(self.state)

    def ask(self, *actions: Action) -> None:
        for action in actions:
            self.session.do(action)

    def do(self, *actions: Action) -> State:
        self.ask(*actions)
        return self.state

    def wait(self, condition: Callable[[State], bool]) -> State:
        deadline = time.monotonic() + PATIENCE
        # While a search goes on, and drawing is slow, the session is never idle.
        while not condition(state := self.session.state):
            assert time.monotonic() < deadline
            time.sleep(0.002)
        return state

    def wait_for_end(self) -> Run:
        self.wait(lambda state: not state.optimisation.is_on)
        return self.run

    def wait_for_comparison(self) -> Run:
        self.wait_for_end()
        self.wait(lambda state: run_of(state).comparison is not None)
        return self.run

    def wait_for_iterates(self, count: int) -> Run:
        def are_there(state: State) -> bool:
            run = state.optimisation.run
            return run is not None and len(run.iterates) >= count

        return run_of(self.wait(are_there))

    def find(self, request: OptimisationRequest = SMALL) -> Run:
        self.do(SetRequest("optimisation.request", request), StartRun())
        return self.wait_for_end()

    @property
    def result(self) -> str:
        """The column of the search as HTML."""
        assert self.session.wait_until_idle()
        return unescape(self.panel._result.content)

    @property
    def buttons(self) -> dict[str, str]:
        """How each button of the column stands, by its name."""
        return buttons_in(self.result)

    @property
    def filled(self) -> list[str]:
        """The names of the filled buttons."""
        return [name for name, look in self.buttons.items() if look == "filled"]

    def press(self, name: str, value: str = "") -> None:
        """Press a button, wherever it stands."""
        client: Any = SimpleNamespace(client_id=1)
        self.services.buttons.press(name, value, client)

    def stop(self) -> None:
        self.services.buttons.stop()
        self.session.stop()
        self.optimiser.stop()

    def _draw(self, frame: Frame) -> None:
        self.states.append(frame.state)
        self._assigner.assign(list(self.panel.updates(frame)))
        self.optimiser.follow(frame)

    def _fail(self, error: Exception) -> None:
        raise error


@pytest.fixture
def bench(server: viser.ViserServer, monkeypatch: pytest.MonkeyPatch) -> Iterator[Bench]:
    monkeypatch.setattr(optimiser, "PACE", 0.005)
    made = Bench(server, own())
    yield made
    process = made.optimiser.worker.process_id
    made.stop()
    if process is not None:
        # Neither alive nor a zombie.
        with pytest.raises(ProcessLookupError):
            os.kill(process, 0)


def buttons_in(markup: str) -> dict[str, str]:
    """Return whether each button is filled, enabled or disabled, by its name, in their order."""
    looks: dict[str, str] = {}
    for tag in re.findall("<button[^>]*>", markup):
        (name,) = re.findall('data-press="([^"]*)"', tag)
        is_filled = "is-main" in tag
        looks[name] = "disabled" if " disabled" in tag else "filled" if is_filled else "enabled"
    return looks


def run_of(state: State) -> Run:
    run = state.optimisation.run
    assert run is not None
    return run


def own() -> State:
    """The paper's start in a pose of its own, held by its legs."""
    moved = SetAngle(1, 3.0).apply(SetPosition(0, 4.5).apply(opened(paper_start())))
    return replace(moved, hold="legs")


def stripped(state: State) -> State:
    """Return all of a state that belongs to the mechanism."""
    fresh = opened(PRESETS["paper-optimal"])
    return replace(
        state, view=fresh.view, hold=fresh.hold, optimisation=fresh.optimisation, gesture=None
    )


def started(request: OptimisationRequest = SMALL, state: State | None = None) -> State:
    """Return a state with a run, without a process."""
    return StartRun().apply(SetRequest("optimisation.request", request).apply(state or own()))


def told_by(problem: Any, starts: int = 1) -> tuple[Iterate, ...]:
    told: list[Iterate] = []
    optimise(problem, starts, Channel(told.append, lambda: False))
    return tuple(told)


def test_it_finds_the_design_and_the_page_goes_through_all_iterates(bench: Bench) -> None:
    run = bench.find()
    assert run.verdict is not None
    assert run.verdict.status == "converged"
    assert run.best is not None
    assert run.best.value <= 1e-6
    assert abs(workspace_volume(run.best.design).volume / 8000.0 - 1.0) <= 1e-6
    # A short search is shown iterate by iterate.
    drawn = [state.design.variables for state in bench.states if state.optimisation.is_on]
    shown = list(dict.fromkeys(drawn))
    assert shown[-len(run.iterates) :] == [each.design.variables for each in run.iterates]
    assert [each.number for each in run.iterates] == list(range(len(run.iterates)))
    state = bench.state
    assert state.design.variables == run.best.design.variables
    assert state.design.name == "paper-initial-optimised"
    assert state.pose == Pose(own().pose.position, home_pose(paper_start()).quaternion)
    assert state.view.workspace.solid
    assert not bench.complaints
    assert not bench.reports


def test_the_search_ends_before_the_next_evaluation_once_it_is_cut() -> None:
    problem = problem_of(SetRequest("optimisation.request", ENDLESS).apply(own()))
    told: list[Iterate] = []
    outcome = optimise(problem, 10_000, Channel(told.append, lambda: len(told) >= 40))
    assert len(told) == 40
    assert told[-1].run == len(outcome.runs) - 1
    assert outcome.best in told
    # What comes first of all is an iterate too: there is always a best so far.
    outcome = optimise(problem, 1, Channel(told.append, lambda: True))
    assert outcome.status == "cancelled"
    assert outcome.design.variables == problem.start.variables


def test_cancel_ends_the_search_by_a_word_and_keeps_the_best_so_far(
    bench: Bench, monkeypatch: pytest.MonkeyPatch
) -> None:
    # However busy the machine is, it is not the force that ends it.
    monkeypatch.setattr(optimiser, "PATIENCE", 60.0)
    bench.ask(SetRequest("optimisation.request", ENDLESS), StartRun())
    bench.wait_for_iterates(60)
    process = bench.optimiser.worker.process_id
    bench.ask(CancelRun())
    run = bench.wait_for_end()
    assert run.best is not None
    assert run.verdict is not None
    assert run.verdict.starts < 10_000
    rank = Trail(run.problem, None, None).rank
    assert rank(run.best)[0] == 0.0
    assert run.best.value <= run.iterates[0].value * 10.0
    assert run.best in run.iterates
    assert bench.state.design.variables == run.best.design.variables
    phases = [s.optimisation.run.phase for s in bench.states if s.optimisation.run is not None]
    assert list(dict.fromkeys(phases)) == ["running", "cancelling", "ended"]
    # The process heard the word, and so serves again.
    assert bench.find(SMALL).verdict is not None
    assert bench.optimiser.worker.process_id == process
    assert not bench.reports


def test_cancel_ends_a_search_that_hears_nothing_by_force(bench: Bench) -> None:
    # The word and the force together answer within a fifth of a second.
    assert optimiser.PATIENCE < 0.2
    bench.ask(SetRequest("optimisation.request", ENDLESS), StartRun())
    bench.wait_for_iterates(30)
    process = bench.optimiser.worker.process_id
    assert process is not None
    os.kill(process, signal.SIGSTOP)
    bench.ask(CancelRun())
    run = bench.wait_for_end()
    assert run.verdict is not None
    assert run.verdict.status == "cancelled"
    rank = Trail(run.problem, None, None).rank
    assert run.best == min(run.iterates, key=rank)
    assert run.best is not None
    assert bench.state.design.variables == run.best.design.variables
    assert not bench.reports
    assert bench.find(SMALL).verdict is not None
    assert bench.optimiser.worker.process_id != process


def test_a_process_killed_in_mid_run_leaves_the_design_and_the_panel_says_so(
    bench: Bench,
) -> None:
    before = stripped(bench.state)
    bench.ask(SetRequest("optimisation.request", ENDLESS), StartRun())
    bench.wait_for_iterates(10)
    assert bench.session.state.design.variables != before.design.variables
    process = bench.optimiser.worker.process_id
    assert process is not None
    os.kill(process, signal.SIGKILL)
    run = bench.wait_for_end()
    assert stripped(bench.state) == before
    assert run.verdict is not None
    assert run.verdict.status == "failed"
    assert "died" in bench.result
    assert ACCEPT not in bench.buttons
    assert len(bench.reports) == 1
    assert bench.find(SMALL).best is not None


def test_revert_brings_the_own_design_and_pose_back_exactly(bench: Bench) -> None:
    before = bench.state
    bench.find()
    view = replace(bench.state.view, labels=False)
    bench.do(Set("view", view), SetPosition(2, 8.0), SetVariable("b2", 3.3))
    assert bench.state.design != before.design
    after = bench.do(Revert())
    assert stripped(after) == stripped(before)
    assert (after.hold, after.view) == (before.hold, view)
    assert after.optimisation.run is None
    assert after.optimisation.request == SMALL
    # There is nothing to return from any more.
    assert bench.do(Revert()).design == before.design


def test_accept_keeps_the_result_and_reset_still_returns_to_the_design_opened(
    bench: Bench,
) -> None:
    best = bench.find().best
    assert best is not None
    assert (bench.buttons[ACCEPT], bench.buttons[REVERT]) == ("filled", "enabled")
    after = bench.do(Accept())
    assert after.design.variables == best.design.variables
    assert not {ACCEPT, REVERT} & {*bench.buttons}
    assert bench.buttons[HULL] == "enabled"
    assert "accepted" in bench.result
    assert bench.do(Revert()).design == after.design
    assert bench.do(Reset()).design == paper_start()


def test_what_was_found_can_be_found_again_and_is_told_in_the_report(bench: Bench) -> None:
    found = bench.find(replace(SMALL, starts=2)).best
    assert found is not None
    state = bench.do(Accept())
    record = state.optimisation.record
    assert record is not None
    again = decode_record(encode_record(record), "record")
    outcome = optimise_design(again.problem, **msgspec.structs.asdict(again.settings))
    assert outcome.design == record.design
    assert outcome.design.variables == found.design.variables == state.design.variables
    assert record_of(outcome, again.settings).history == record.history
    page = export_report(state.design, state.pose, record, "html").decode()
    assert "explorer optimise --repeat record.json" in page
    # A search of another design is none of this one.
    assert bench.do(Reset()).optimisation.record is None


def test_revert_brings_back_lengths_that_cannot_close_too() -> None:
    asked = SetJoint(0, 25.0).apply(own())
    assert asked.unclosed is not None
    state = started(state=asked)
    ended = ended_with(state, told_by(state.optimisation.run and state.optimisation.run.problem))
    assert ended.unclosed is None
    assert stripped(Revert().apply(ended)) == stripped(asked)


def test_a_run_from_an_undecided_result_still_reverts_to_the_own_design() -> None:
    state = started()
    first = told_by(state.optimisation.run and state.optimisation.run.problem)
    ended = ended_with(state, first)
    again = StartRun().apply(ended)
    assert again.optimisation.run is not None
    assert again.optimisation.run.number == 2
    assert again.optimisation.run.problem.start.variables == first[-1].design.variables
    assert stripped(Revert().apply(ended_with(again, first))) == stripped(own())
    accepted = StartRun().apply(Accept().apply(ended))
    assert accepted.optimisation.run is not None
    assert accepted.optimisation.run.own.design == ended.design


def ended_with(state: State, iterates: tuple[Iterate, ...]) -> State:
    run = state.optimisation.run
    assert run is not None
    verdict = optimiser.killed_result(run.problem, iterates)
    return EndRun(run.number, verdict, iterates).apply(state)


@pytest.mark.parametrize(
    "action",
    [
        SetVariable("b2", 3.1),
        Set("design.unit_mm", 5.0),
        Set("design.limits", OPTIMAL.limits),
        Open(OPTIMAL),
        Reset(),
    ],
)
def test_the_design_belongs_to_the_run_while_it_goes_on(action: Action) -> None:
    state = started()
    for each in (state, CancelRun().apply(state)):
        with pytest.raises(InputError, match=r"being optimised: wait .* or cancel"):
            action.apply(each)
    first = told_by(state.optimisation.run and state.optimisation.run.problem)
    action.apply(ended_with(state, first))


def test_the_platform_moves_freely_meanwhile_and_iterates_keep_its_position() -> None:
    state = started(replace(SMALL, free=(*VARIABLES, YAW)))
    run = state.optimisation.run
    assert run is not None
    moved = SetPosition(0, 6.0).apply(state)
    last = told_by(run.problem)[-1]
    after = Advance(run.number, (last,)).apply(moved)
    assert after.pose.position[0] == 6.0
    assert after.pose.quaternion == home_pose(last.design).quaternion
    assert after.pose.quaternion != home_pose(run.own.design).quaternion
    assert after.joints == opened(last.design, after.pose).joints
    # Of another run nothing is shown.
    assert Advance(run.number + 1, (last,)).apply(moved) == moved


def test_opening_another_design_forgets_the_run_but_not_the_wish() -> None:
    state = started()
    first = told_by(state.optimisation.run and state.optimisation.run.problem)
    after = Open(OPTIMAL).apply(ended_with(state, first))
    assert after.optimisation.run is None
    assert after.optimisation.request == SMALL
    again = StartRun().apply(after).optimisation.run
    assert again is not None
    assert again.number == 2


SWINGING = msgspec.structs.replace(
    OPTIMAL, limits=msgspec.structs.replace(OPTIMAL.limits, swing=Swing(a1=30.0))
)


@pytest.mark.parametrize(
    ("values", "words"),
    [
        ({"volume": float("nan")}, "volume demanded must be"),
        ({"volume": -1.0}, "volume demanded must be"),
        ({"objective": "largest-volume", "reach": 0.0}, "reach demanded must be"),
        ({"clearance": -0.1}, "clearance demanded must be"),
        ({"clearance": float("inf")}, "clearance demanded must be"),
        ({"starts": -3}, "number of starts must lie within 1 to 10000; got -3"),
        ({"starts": 10_001}, "number of starts must lie within"),
    ],
)
def test_wish_with_an_unusable_number_is_refused(values: dict[str, Any], words: str) -> None:
    with pytest.raises(InputError, match=words):
        OptimisationRequest(**values)


def test_a_design_whose_volume_has_no_gradient_is_told_of() -> None:
    state = opened(SWINGING)
    with pytest.raises(NoAnswerError, match="swing"):
        StartRun().apply(state)
    assert liftable(state) == (SWING_LIMIT,)
    assert StartRun().apply(LiftLimit(SWING_LIMIT).apply(state)).optimisation.is_on


def test_what_the_process_refuses_leaves_the_design(bench: Bench) -> None:
    before = stripped(bench.state)

    @dataclass(frozen=True)
    class AskForNoStart(Action):
        """What no hand can ask for."""

        def apply(self, state: State) -> State:
            request = replace(SMALL)
            # Past the checks of the request, which refuse it.
            object.__setattr__(request, "starts", 0)
            return replace(state, optimisation=replace(state.optimisation, request=request))

    bench.do(AskForNoStart(), StartRun())
    run = bench.wait_for_end()
    assert run.verdict is not None
    assert run.verdict.status == "failed"
    assert "number of starts" in run.verdict.message
    assert stripped(bench.state) == before
    assert not bench.reports


def test_margins_ask_for_what_has_an_influence_on_them() -> None:
    state = SetRequest(
        "optimisation.request", OptimisationRequest(objective="largest-margin")
    ).apply(own())
    assert {YAW, PLACE} <= {*state.optimisation.request.free}
    run = started(OptimisationRequest(objective="largest-margin")).optimisation.run
    assert run is not None
    assert {"shift-x", "shift-y", "shift-z", YAW} <= {*run.problem.names}


def test_only_what_is_chosen_may_change(bench: Bench) -> None:
    run = bench.find(replace(SMALL, free=("a3x", "b1y")))
    assert run.problem.names == ("a3x", "b1y")
    assert run.best is not None
    changed = [
        name
        for name, old, new in zip(
            VARIABLES, paper_start().variables, run.best.design.variables, strict=True
        )
        if old != new
    ]
    assert changed == ["a3x", "b1y"]


@pytest.mark.parametrize("name", PRESETS)
def test_what_is_suggested_suits_the_design(name: str) -> None:
    state = opened(PRESETS[name])
    design, home = state.design, home_pose(state.design)
    volume = workspace_volume(design).volume
    assert 1.05 * volume < requested_volume(state) < 2.3 * volume
    same = SetRequest(
        "optimisation.request", OptimisationRequest(objective="smallest-reach")
    ).apply(state)
    assert requested_volume(same) == pytest.approx(volume, rel=1e-5)
    assert requested_reach(state) == design.reach
    box = requested_box(state)
    assert box == box_within(design)
    lows, highs = np.array(box)
    assert (lows < home.position).all()
    assert (home.position < highs).all()
    for corner in corners_of(box):
        assert slacks(constraints(design, home.rotation), corner).min() >= 0.0


def test_the_required_box_is_drawn_where_it_is(bench: Bench) -> None:
    request = OptimisationRequest(objective="largest-margin", free=(PLACE,))
    assert box_shown(bench.state) is None
    state = bench.do(SetRequest("optimisation.request", request))
    box = requested_box(state)
    assert box_shown(state) == box
    edges = edges_of(box)
    sides = np.ptp(np.array(box), axis=0)
    assert np.sort(np.linalg.norm(edges[:, 1] - edges[:, 0], axis=1)) == pytest.approx(
        np.sort(np.repeat(sides, 4))
    )
    run = bench.find(request)
    assert run.best is not None
    shown = box_shown(bench.state)
    assert shown is not None
    assert np.ptp(np.array(shown), axis=0) == pytest.approx(sides)
    assert shown == run.problem.required_box_at(run.best.values)
    assert shown != box


def test_the_table_shows_old_and_new_and_their_difference(bench: Bench) -> None:
    bench.find(replace(SMALL, clearance=0.2))
    run = bench.wait_for_comparison()
    found = run.comparison
    assert found is not None
    assert run.best is not None
    margin = run.problem.demands.clearance_margin
    expected = compare(paper_start(), run.best.design, margin, (None, None))
    # Compiled or not, the last bit may differ.
    for got, known in ((found.before, expected.before), (found.after, expected.after)):
        assert replace(got, values=known.values) == known
        assert got.values == pytest.approx(known.values, rel=1e-9)
    rows = {row[0].partition(" ")[0]: row[1:] for row in rows_of(comparison_table(run))}
    volume = found.before["volume"] or 0.0
    assert [number(cell) for cell in rows["volume"]] == pytest.approx(
        [volume, 8000.0, 8000.0 - volume], abs=0.005
    )
    for index, name in enumerate(VARIABLES):
        old, new = found.before.design.variables[index], found.after.design.variables[index]
        assert [number(cell) for cell in rows[name]] == pytest.approx([old, new, new - old], 1e-3)
        assert rows[name][2][0] == ("+" if new > old else "−")
    old, new = (each["node_count"] or 0 for each in (found.before, found.after))
    assert [number(cell) for cell in rows["nodes"]] == [old, new, new - old]
    assert number(rows["clearance"][1]) >= 0.198
    assert number(rows["longest"][1]) == pytest.approx(run.best.design.reach, abs=1e-4)
    assert unescape(comparison_table(run)) in bench.result


def test_the_charts_are_of_one_start_and_of_what_was_asked() -> None:
    state = started(ENDLESS)
    run = state.optimisation.run
    assert run is not None
    assert curves_of(run) == []
    iterates = told_by(run.problem, 3)
    assert {each.run for each in iterates} == {0, 1, 2}
    shown = Advance(run.number, iterates).apply(state).optimisation.run
    assert shown is not None
    reach, volume, spare = curves_of(shown)
    last = [each for each in iterates if each.run == 2]
    assert reach.values.tolist() == [each.objective for each in last]
    assert volume.values.tolist() == [each.volume for each in last]
    assert (volume.level, spare.level) == (7053.0, 0.0)
    best = ended_with(state, iterates).optimisation.run
    assert best is not None
    assert best.best is not None
    assert len(curves_of(best)[0].values) == sum(each.run == best.best.run for each in iterates)
    x, y, level = data_of(volume)
    assert x.tolist() == list(range(len(last)))
    assert len(y) == len(level) == len(x)
    small = started()
    ran = small.optimisation.run
    assert ran is not None
    matched = ended_with(small, told_by(ran.problem)).optimisation.run
    assert matched is not None
    powers = curves_of(matched)[0].values
    # Down to rounding, where exactly zero is drawn as the least power.
    assert powers[0] == pytest.approx(np.log10(matched.iterates[0].value))
    assert -16.0 <= powers[-1] <= -10.0


def test_a_design_changed_since_is_told_of() -> None:
    state = started()
    run = state.optimisation.run
    assert run is not None
    ended = ended_with(state, told_by(run.problem))
    now = ended.optimisation.run
    assert now is not None
    assert now.verdict is not None
    assert "by hand" not in verdict_words(ended, now, now.verdict)
    changed = SetVariable("b2", 3.3).apply(replace(ended, hold="pose"))
    assert "by hand" in verdict_words(changed, now, now.verdict)


def test_unattainable_volume_is_shown_with_the_largest_found(bench: Bench) -> None:
    run = bench.find(replace(SMALL, volume=1400.0, free=("b2", "b3")))
    assert run.verdict is not None
    assert run.verdict.status == "infeasible"
    assert "largest found" in bench.result
    assert "No design keeps all demands" in bench.result
    # Nothing that fell short is to be accepted by the first press that meets the eye.
    assert bench.buttons[ACCEPT] == "enabled"
    assert bench.filled == [START]


@pytest.mark.parametrize("scale", [1.0, 1e-6, 50.0, 1e9])
@pytest.mark.parametrize("size", [1.0, 1e25, 1e39, 1e300, 1.7e308])
def test_a_required_box_beyond_single_precision_is_drawn_at_its_end(
    size: float, scale: float
) -> None:
    points = single(np.array([[-size, 0.0, size]]), scale)
    assert np.isfinite(points).all()
    assert points[0].tolist() == pytest.approx(
        [-min(size * scale, FARTHEST), 0.0, min(size * scale, FARTHEST)], rel=1e-6
    )


HELD = "the box holds at most 2,499 of the 8,000 units³ asked for"


def test_limits_that_cannot_give_a_volume_say_so_before_a_press_and_refuse_one(
    bench: Bench,
) -> None:
    bench.do(Open(INITIAL), SetRequest("optimisation.request", OptimisationRequest(volume=2400.0)))
    assert bench.buttons[START] == "filled"
    bench.do(SetRequest("optimisation.request", SMALL))
    assert f"T{HELD[1:]}." in bench.result
    assert bench.buttons[START] == "disabled"
    assert bench.filled == [LIFT]
    assert bench.buttons[PAPER_BOX] == "enabled"
    before = bench.state
    assert bench.do(StartRun()) == before
    assert bench.complaints == [HELD]
    bench.do(LiftLimit("box"))
    assert bench.filled == [START]
    assert not {LIFT, PAPER_BOX} & {*bench.buttons}
    bench.session.travel(UNDO)
    assert bench.state.design == INITIAL
    assert bench.filled == [LIFT]
    # What no box of the paper's holds is not to be had by taking it.
    bench.do(SetRequest("optimisation.request", OptimisationRequest(volume=20_000.0)))
    assert bench.filled == [LIFT]
    assert PAPER_BOX not in bench.buttons


def refuting(**limits: Any) -> State:
    """Return the paper's problem without a box, with limits that rule it out."""
    return opened(limited(OPTIMAL, box=None, **limits))


@pytest.mark.parametrize(
    ("state", "request_", "limit", "title"),
    [
        (opened(INITIAL), SMALL, "box", "Lift the box"),
        (refuting(guide=(0.0, 0.1)), SMALL, "guide", "Lift the guide"),
        (refuting(gap=30.0), SMALL, GAP, "Lift the gap"),
        (refuting(l1=(0.0, 9.0)), SMALL, "l1 maximum", "Tie the maximum of l1 to the reach"),
        (refuting(d2=(0.0, 1.0)), SMALL, "d2 maximum", "Tie the maximum of d2 to the reach"),
        (
            refuting(l4=(0.0, 20.0)),
            replace(SMALL, objective="smallest-reach"),
            MAXIMA,
            "Tie all maximum lengths to the reach",
        ),
        (
            refuting(margin=9.0),
            OptimisationRequest(
                objective="largest-margin",
                box=((8.0, 3.0, 7.0), (12.0, 7.0, 11.0)),
                free=(YAW,),
            ),
            "margin",
            "Lift the least margin",
        ),
        (opened(SWINGING), SMALL, SWING_LIMIT, "Lift the bounds of the swing"),
    ],
)
def test_a_limit_that_rules_a_search_out_is_lifted_by_one_press_and_brought_back_by_undo(
    bench: Bench, state: State, request_: OptimisationRequest, limit: str, title: str
) -> None:
    bench.do(Open(state.design), SetRequest("optimisation.request", request_))
    before = bench.state
    assert liftable(before) == (limit,)
    assert bench.filled == [LIFT]
    assert bench.buttons[START] == "disabled"
    assert f">{title}<" in bench.result
    bench.press(LIFT, limit)
    after = bench.state
    assert limit not in {refusal.limit for refusal in refuted(after)}
    assert home_pose(after.design) == home_pose(before.design)
    assert bench.session.history.step.words == title
    bench.session.travel(UNDO)
    assert bench.state == before
    assert not bench.complaints


def test_lifting_a_limit_that_is_not_there_is_refused() -> None:
    for limit in ("", "guide", "l1 minimum", "longest leg"):
        with pytest.raises(InputError, match="no limit named"):
            LiftLimit(limit).apply(opened(OPTIMAL))


def test_tilt_is_demanded_over_the_required_box() -> None:
    state = SetRequest("optimisation.request.tilt", 20.0).apply(opened(OPTIMAL))
    problem = problem_of(state)
    assert problem.demands.tilt == 20.0
    assert problem.demands.required_box == requested_box(state)
    state = SetRequest("optimisation.request.tilt", 95.0).apply(state)
    (refutation,) = refuted(state)
    assert "the tilt demanded must be below 90°" in refutation.message


@pytest.mark.parametrize(
    ("asked", "words"),
    [
        ({"objective": "smallest-load"}, "no load: give its payload a mass.* in the tab Machine"),
        ({"held": True}, "no load: give its payload a mass.* in the tab Machine"),
        ({"objective": "smallest-error"}, "no errors: give them.* errors .* in the tab Machine"),
        (
            {"objective": "smallest-deflection"},
            "no load: give its payload a mass.* in the tab Machine",
        ),
        ({"deflection": 0.1}, "no load: give its payload a mass.* in the tab Machine"),
        ({"error": 0.1}, "no errors: give them.* errors of the actuators in the tab Machine"),
    ],
)
def test_a_machine_that_is_lacking_is_told_with_where_to_give_it(
    asked: dict[str, Any], words: str
) -> None:
    request = OptimisationRequest(**asked)
    state = SetRequest("optimisation.request", request).apply(opened(OPTIMAL))
    assert liftable(state) == ()
    text = re.sub("<.*?>", " ", refused_words(refuted(state), liftable(state)))
    assert "This cannot be optimised" in text
    assert re.search(words, text), text
    assert "tab Design" not in text


def test_deflection_of_a_rigid_machine_is_refused_with_where_to_give_its_stiffness() -> None:
    design = msgspec.structs.replace(OPTIMAL, payload=Payload(force_n=1.0))
    request = OptimisationRequest(deflection=0.1)
    state = SetRequest("optimisation.request", request).apply(opened(design))
    text = re.sub("<.*?>", " ", refused_words(refuted(state), liftable(state)))
    assert re.search("The design is rigid: .* in the tab Machine", text), text


def test_the_chart_of_a_load_or_an_error_has_its_unit() -> None:
    design = msgspec.structs.replace(
        OPTIMAL,
        payload=Payload(force_n=1.0),
        actuators=Actuators((50.0, 50.0, 50.0, 50.0, 50.0, 50.0), error_mm=(0.01,) * 6),  # pyright: ignore[reportArgumentType]
        struts=Struts(outer_mm=12.0),
    )
    captions: tuple[tuple[ObjectiveName, str], ...] = (
        ("smallest-load", "Load share over the box: 0.4"),
        ("smallest-error", "Worst error over the box (units): 0.4"),
        ("smallest-deflection", "Deflection over the box (units): 0.4"),
        ("largest-margin", "Margin over the box (units): 0.4"),
    )
    for objective, caption in captions:
        request = OptimisationRequest(objective=objective)
        state = StartRun().apply(SetRequest("optimisation.request", request).apply(opened(design)))
        run = state.optimisation.run
        assert run is not None
        step = replace(told_by(run.problem)[0], objective=0.4)
        run = Advance(run.number, (step,)).apply(state).optimisation.run
        assert run is not None
        assert curves_of(run)[0].caption == caption
        last = Advance(run.number, (replace(step, objective=None),)).apply(state).optimisation.run
        assert last is not None
        assert curves_of(last)[0].caption == caption.replace("0.4", "infinite")
        assert value_text(last.problem, last.iterates[-1]).endswith(" infinite")


def test_table_shows_infinite_loads_beside_finite_ones() -> None:
    design = msgspec.structs.replace(
        OPTIMAL,
        payload=Payload(force_n=1.0),
        actuators=Actuators((50.0, 50.0, 50.0, 50.0, 50.0, 50.0)),
        limits=msgspec.structs.replace(OPTIMAL.limits, box=None),
    )
    on_plane, off_plane = ((8.0, 3.0, 0.0), (12.0, 7.0, 8.0)), ((8.0, 3.0, 1.0), (12.0, 7.0, 9.0))
    request = OptimisationRequest(objective="smallest-load", box=off_plane)
    state = SetRequest("optimisation.request", request).apply(opened(design))
    for boxes, cells in (
        ((on_plane, off_plane), ("infinite", "0.")),
        ((off_plane, on_plane), ("0.", "infinite")),
    ):
        run = StartRun().apply(state).optimisation.run
        assert run is not None
        run = replace(run, comparison=compare(design, design, None, boxes))
        rows = {row[0]: row[1:] for row in rows_of(comparison_table(run))}
        before, after, change = rows["load share over the box"]
        assert before.startswith(cells[0])
        assert after.startswith(cells[1])
        assert change == ""


@pytest.mark.parametrize("name", PRESETS)
@pytest.mark.parametrize("objective", OBJECTIVES)
def test_demands_by_default_can_be_kept_by_every_preset(name: str, objective: Any) -> None:
    design = msgspec.structs.replace(
        PRESETS[name],
        payload=Payload(force_n=1.0),
        actuators=Actuators(
            push_n=(50.0, 50.0, 50.0, 50.0, 50.0, 50.0),
            error_mm=(0.01, 0.01, 0.01, 0.01, 0.01, 0.01),
        ),
        struts=Struts(outer_mm=12.0),
    )
    request = OptimisationRequest(objective=objective)
    state = SetRequest("optimisation.request", request).apply(opened(design))
    assert refuted(state) == ()
    assert liftable(state) == ()
    assert StartRun().apply(state).optimisation.is_on


@pytest.mark.parametrize(
    ("start", "request_", "words"),
    [
        (
            INITIAL,
            OptimisationRequest(volume=2500.0),
            "the box holds at most 2,499 of the 2,500 units³ asked for",
        ),
        (
            INITIAL,
            OptimisationRequest(objective="smallest-reach", volume=8000.0),
            "the box holds at most 2,499 of the 8,000 units³ asked for",
        ),
        (
            OPTIMAL,
            OptimisationRequest(objective="smallest-reach", volume=13_000.0),
            "the box holds at most 12,240 of the 13,000 units³ asked for",
        ),
        (
            limited(OPTIMAL, l1=(0.0, 30.0)),
            OptimisationRequest(objective="largest-volume", reach=25.0),
            "the longest leg is at least 30 units within the bounds, and 25 units are asked for",
        ),
        (
            OPTIMAL,
            OptimisationRequest(
                objective="largest-margin", box=((8.0, 3.0, 7.0), (12.0, 7.0, 30.0)), free=(YAW,)
            ),
            "the required box lies beyond the box along z: from 7 to 30 units",
        ),
    ],
)
def test_what_limits_rule_out_is_known_for_every_objective_with_the_most_they_allow(
    start: Design, request_: OptimisationRequest, words: str
) -> None:
    state = SetRequest("optimisation.request", request_).apply(opened(start))
    with pytest.raises(NoAnswerError, match=re.escape(words)):
        StartRun().apply(state)


def test_the_papers_problem_and_a_press_on_optimise_succeed_from_the_start_page(
    bench: Bench,
) -> None:
    bench.do(Open(OPTIMAL), SetPosition(0, 9.0))
    before = bench.state
    bench.press(PAPER)
    state = bench.state
    assert problem_of(state) == paper_problem()
    assert bench.session.history.step.words == "The paper's problem"
    assert bench.filled == [START]
    bench.press(START)
    run = bench.wait_for_comparison()
    assert run.has_converged
    assert run.best is not None
    assert abs(workspace_volume(run.best.design).volume / 8000.0 - 1.0) <= 1e-6
    assert bench.state
    assert bench.filled == [ACCEPT]
    assert bench.buttons[REVERT] == bench.buttons[START] == bench.buttons[HULL] == "enabled"
    assert not bench.complaints
    # Each was one step.
    bench.session.travel(UNDO)
    assert bench.state.design == state.design
    bench.session.travel(UNDO)
    assert bench.state.design == before.design
    assert bench.state.optimisation.request == before.optimisation.request


def test_presses_elsewhere_do_what_those_of_the_tab_do(bench: Bench) -> None:
    assert search_notice(bench.state) is None
    bench.do(SetRequest("optimisation.request", ENDLESS))
    bench.press(START)
    bench.wait_for_iterates(3)
    notice = search_notice(bench.session.state)
    assert notice is not None
    assert notice.buttons == (CANCEL,)
    assert notice.share is not None
    bench.press(CANCEL)
    bench.wait_for_end()
    notice = search_notice(bench.state)
    assert notice is not None
    assert notice.buttons == (ACCEPT, REVERT)
    bench.press(REVERT)
    assert bench.state.design == paper_start()
    assert search_notice(bench.state) is None
    bench.find()
    notice = search_notice(bench.state)
    assert notice is not None
    assert (notice.title, notice.text) == ("Converged", "volume 8,000 units³")
    bench.press(ACCEPT)
    assert run_of(bench.state).accepted
    assert search_notice(bench.state) is None


@pytest.mark.parametrize("name", PRESETS)
def test_limits_in_force_are_told_and_no_others(name: str) -> None:
    design = PRESETS[name]
    assert [row for row, _ in limit_rows(design)] == [
        "l1, d2, d4, l4",
        "b4",
        "carriages",
        "δ1, δ2, δ3",
    ]
    held = limited(
        design,
        l1=(1.5, 12.0),
        guide=(-3.0, 20.0),
        gap=0.25,
        box=None,
        margin=0.5,
        carriage_order="any",
        swing=Swing(b4=40.0),
        leg_radii=(0.1, 0.1, 0.3, 0.1),
    )
    assert dict(limit_rows(held)) == {
        "l1": "1.5 to 12",
        "d2, d4, l4": f"at most the reach |a3| = {design.reach:.5g}",
        "d1, d3": "−3 to 20",
        "|d1 − d3|": "at least 0.25",
        "|δ1|, |δ2|, |δ3|": "at least 0.5, signs of home",
        "swing": "at most b4 40°",
        "leg radii": "0.1 to 0.3",
    }
    free = limited(design, box=None, carriage_order="any", margin=None)
    assert [row for row, _ in limit_rows(free)] == ["l1, d2, d4, l4"]


@pytest.mark.parametrize("remedy", [LiftLimit("box"), TakePaperBox()])
def test_one_press_and_another_solve_the_papers_problem_from_its_initial_row(
    bench: Bench, remedy: Action
) -> None:
    bench.do(
        Open(INITIAL),
        SetRequest("optimisation.request", OptimisationRequest(volume=8000.0, clearance=0.2)),
        remedy,
        StartRun(),
    )
    run = bench.wait_for_end()
    assert run.verdict is not None
    assert run.verdict.status == "converged"
    assert run.best is not None
    assert run.best.value <= 1e-9
    assert run.own.design.home == INITIAL.home
    assert not bench.complaints
    assert not {LIFT, PAPER_BOX} & {*bench.buttons}
    # Undone, it is the design as it was.
    assert remedy.describe(own(), own()) in ("Lift the box", "Take the paper's box")


def test_a_design_without_a_home_of_its_own_keeps_its_pose_where_its_box_is_lifted() -> None:
    design = msgspec.structs.replace(INITIAL, home=None)
    state = opened(design)
    for remedy in (LiftLimit("box"), TakePaperBox()):
        after = remedy.apply(state)
        assert home_pose(after.design) == home_pose(design)
        assert after.pose == state.pose
        with pytest.raises(InputError, match="being optimised"):
            remedy.apply(started())


def test_a_search_that_the_box_kept_from_its_volume_offers_to_lift_it(bench: Bench) -> None:
    verdict = optimiser.SearchResult("infeasible", "the box is too small", holding="box")
    state = bench.do(
        Open(INITIAL), SetRequest("optimisation.request", OptimisationRequest(volume=2400.0))
    )
    run = run_of(StartRun().apply(state))
    best = told_by(run.problem)[0]
    ended = replace(run, phase="ended", verdict=replace(verdict, best=best))
    shown = replace(state, optimisation=replace(state.optimisation, run=ended))
    buttons = buttons_in(result_words(shown))
    assert (buttons[LIFT], buttons[PAPER_BOX], buttons[START]) == ("filled", "enabled", "enabled")
    assert "ex-alert" not in result_words(shown)
