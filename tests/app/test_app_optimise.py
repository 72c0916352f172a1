"""Optimising on the page: problems and what rules them out, runs and their ends, what is shown.

A few tests search in a real process; the others go through the states of a run without one.
"""

from __future__ import annotations

import os
import re
import signal
from collections.abc import Iterator
from dataclasses import replace
from pathlib import Path
from typing import Any

import msgspec
import numpy as np
import pytest
import viser
from client import wait_for
from desk import Desk, number, rows_of
from limited_designs import limited
from sample_states import iterates_of
from services import services_for

from explorer.app.features.compare.table import ComparedDesign
from explorer.app.features.optimise import runner as optimiser
from explorer.app.features.optimise.actions import (
    accept,
    add_iterates,
    cancel_run,
    compare,
    end_run,
    lift_limit,
    revert,
    start_run,
)
from explorer.app.features.optimise.buttons import ACCEPT, CANCEL, LIFT, PAPER, REVERT, START
from explorer.app.features.optimise.feature import (
    OptimisePanel,
    charted_iterates,
    course,
)
from explorer.app.features.optimise.runner import Optimiser, result_of
from explorer.app.features.optimise.state import (
    REACHED,
    Optimisation,
    OptimisationRequest,
    SearchRun,
)
from explorer.app.features.optimise.words import (
    comparison_table,
    limit_rows,
    result_words,
    search_notice,
    search_words,
    verdict_words,
)
from explorer.app.features.optimise.work import (
    complete_request,
    find_refusals,
    liftable_limits,
    optimise,
    problem_of,
)
from explorer.app.features.prototype.building import BuildVerdict
from explorer.app.server import start as start_page
from explorer.app.session.session import UNDO
from explorer.app.state.actions import Action, Set, open_design, reset_design
from explorer.app.state.frame import Frame
from explorer.app.state.geometry import set_variable
from explorer.app.state.moves import set_angle, set_joint, set_position
from explorer.app.state.parts import with_value
from explorer.app.state.state import State, open_state
from explorer.app.state.view import View
from explorer.app.storage.user_data import open_user_data
from explorer.app.widgets.buttons import Buttons
from explorer.errors import InputError
from explorer.jobs.jobs import Jobs
from explorer.jobs.process import Channel
from explorer.measures.catalogue import CATALOGUE
from explorer.mechanism.design import VARIABLES, Design, Swing
from explorer.mechanism.design_file import PRESETS
from explorer.numerics.number_text import UNITS
from explorer.optimise.defaults import paper_problem, paper_start
from explorer.optimise.outcome import Iterate, compare_designs, curves_of
from explorer.optimise.problem import MAXIMA, OBJECTIVES, SWING_LIMIT, YAW
from explorer.optimise.search.sqp import Trail
from explorer.workspace.slices.volume import workspace_volume

pytestmark = pytest.mark.usefixtures("warm_kernels")

INITIAL, OPTIMAL = PRESETS["paper-initial"], PRESETS["paper-optimal"]
SMALL = OptimisationRequest(volume=8000.0)
# With so many starts a search goes on until it is ended.
ENDLESS = OptimisationRequest(objective="smallest-reach", volume=7053.0, starts=10_000)


def own_state() -> State:
    """Return the paper's start in a pose of its own, held by its legs."""
    turned = set_angle(1, 3.0).apply(set_position(0, 4.5).apply(open_state(paper_start())))
    return replace(turned, hold="legs")


def ask(request: OptimisationRequest, state: State) -> State:
    return Set("optimisation.request", request).apply(state)


def start(request: OptimisationRequest = SMALL, state: State | None = None) -> State:
    """Return a state with a run, without a process."""
    return start_run().apply(ask(request, own_state() if state is None else state))


def end(state: State, iterates: tuple[Iterate, ...] = ()) -> State:
    """Return the state after its run was ended by force, by default after three iterates."""
    iterates = iterates or iterates_of(state, 3)
    run = run_of(state)
    result = result_of(replace(run, phase="cancelling"), "", iterates)
    return end_run(run.number, result, iterates).apply(state)


def run_of(state: State) -> SearchRun:
    run = Optimisation.of(state).run
    assert run is not None
    return run


def best_of(run: SearchRun) -> Iterate:
    assert run.best is not None
    return run.best


def mechanism_of(state: State) -> State:
    """Return all of a state that belongs to the mechanism."""
    fresh = open_state(OPTIMAL)
    plain = with_value(state, "optimisation", Optimisation.of(fresh))
    return replace(plain, view=fresh.view, hold=fresh.hold, gesture=None)


def buttons_of(state: State) -> dict[str, str]:
    """Return whether each button is filled, enabled or disabled, by its name, in their order."""
    looks: dict[str, str] = {}
    for tag in re.findall("<button[^>]*>", search_words(state)):
        (name,) = re.findall('data-press="([^"]*)"', tag)
        is_filled = "is-main" in tag
        looks[name] = "disabled" if " disabled" in tag else "filled" if is_filled else "enabled"
    return looks


def filled_buttons(state: State) -> list[str]:
    return [name for name, look in buttons_of(state).items() if look == "filled"]


@pytest.fixture(scope="module")
def found() -> State:
    """A state after a search for the paper's problem in this process, and its comparison."""
    state = start(replace(SMALL, clearance=0.2))
    run, iterates = run_of(state), list[Iterate]()
    outcome = optimise(run.problem, run.starts, Channel(iterates.append, lambda: False))
    result = result_of(run, outcome, ())
    ended = end_run(run.number, result, tuple(iterates)).apply(state)
    both = compare_designs(run.problem, run.own.design, outcome.design)
    return compare(run.number, both).apply(ended)


# Searches in a process


class Bench(Desk):
    """A session with an optimiser and its panel, and the states that were drawn."""

    def __init__(self, server: viser.ViserServer) -> None:
        self.reports: list[str] = []
        self.states: list[State] = []
        self.markup: list[object] = []
        super().__init__(open_state(OPTIMAL))
        self.jobs = Jobs(self.reports.append)
        self.services = services_for(server, self.session, self.jobs, buttons=Buttons(server))
        self.optimiser = self.services.get(Optimiser)
        self.panel = OptimisePanel(self.services)

    def draw(self, frame: Frame) -> None:
        self.states.append(frame.state)
        self.markup = [v for _, name, v in self.panel.updates(frame) if name == "content"]
        self.optimiser.follow(frame)

    def do(self, *actions: Action) -> None:
        for action in actions:
            self.session.do(action)

    def push(self, name: str) -> None:
        self.press(self.services.buttons, name)

    def search(self, request: OptimisationRequest, iterates: int) -> int:
        """Start a search, wait for some iterates, and return the number of its process."""
        self.do(open_design(paper_start()), Set("optimisation.request", request))
        self.push(START)
        self.wait(lambda s: Optimisation.of(s).is_on and len(run_of(s).iterates) >= iterates)
        return self.jobs.process_ids(optimiser.SEARCH)[0]

    def wait_for_end(self) -> SearchRun:
        return run_of(self.wait(lambda state: not Optimisation.of(state).is_on))


@pytest.fixture(scope="module")
def bench(server: viser.ViserServer) -> Iterator[Bench]:
    with pytest.MonkeyPatch.context() as patch:
        patch.setattr(optimiser, "PACE", 0.001)
        bench = Bench(server)
        yield bench
        bench.services.buttons.stop()
        bench.session.stop()
        bench.services.stop()
        bench.jobs.stop()


def test_papers_problem_and_a_press_on_optimise_succeed_from_the_start_page(
    bench: Bench, found: State
) -> None:
    bench.do(set_position(0, 9.0))
    before = bench.state
    bench.push(PAPER)
    asked = bench.state
    assert problem_of(asked) == paper_problem()
    assert filled_buttons(asked) == [START]
    bench.push(START)
    run = run_of(bench.wait(lambda s: Optimisation.of(s).run is not None and not s.busy))
    assert run.has_converged
    best = best_of(run)
    assert best.objective <= 1e-6
    assert abs(workspace_volume(best.design).volume / 8000.0 - 1.0) <= 1e-6
    run = run_of(bench.wait(lambda state: run_of(state).comparison is not None))
    state, got, known = bench.state, run.comparison, run_of(found).comparison
    assert got is not None
    assert known is not None
    assert got[0].values == pytest.approx(known[0].values, rel=1e-6)
    assert got[1].values == pytest.approx(known[1].values, rel=1e-6)
    # Iterates are drawn in their order, all of them if they are few.
    steps = [each.design.variables for each in run.iterates]
    drawn = [each.design.variables for each in bench.states if each.busy]
    places = [steps.index(each) for each in dict.fromkeys(drawn)]
    assert places == sorted(places)
    assert len(places) >= min(len({*steps}), optimiser.STEPS)
    assert state.design.variables == best.design.variables
    assert state.design.name == "paper-initial-optimised"
    assert state.pose.quaternion == paper_start().home_pose.quaternion
    assert state.view.workspace.solid
    assert filled_buttons(state) == [ACCEPT]
    assert {buttons_of(state)[name] for name in (REVERT, START)} == {"enabled"}
    assert result_words(state, bench.services.get(BuildVerdict).html()) in bench.markup
    assert any(search_words(state) in str(each) for each in bench.markup)
    for design in (asked.design, before.design):
        bench.session.do(UNDO)
        assert bench.state.design == design
    assert Optimisation.of(bench.state).request == Optimisation.of(before).request
    assert bench.complaints == bench.reports == []


def test_cancel_ends_the_search_by_a_word_and_keeps_the_best_so_far(
    bench: Bench, monkeypatch: pytest.MonkeyPatch
) -> None:
    # However busy the machine is, it is not the force that ends it.
    monkeypatch.setattr(optimiser, "PATIENCE", 60.0)
    bench.states.clear()
    process = bench.search(ENDLESS, 60)
    notice = search_notice(bench.session.state)
    assert notice is not None
    assert notice.buttons == (CANCEL,)
    assert notice.share is not None
    bench.push(CANCEL)
    run = bench.wait_for_end()
    assert run.verdict is not None
    assert run.verdict.starts < 10_000
    assert Trail(run.problem).rank(best_of(run))[0] == 0.0
    assert run.best in run.iterates
    assert bench.state.design.variables == best_of(run).design.variables
    runs = [Optimisation.of(s).run for s in bench.states]
    phases = [run.phase for run in runs if run is not None]
    assert list(dict.fromkeys(phases)) == ["running", "cancelling", "ended"]
    bench.push(REVERT)
    assert bench.state.design == paper_start()
    # The process received the word, and so serves again.
    assert bench.search(SMALL, 1) == process
    bench.wait_for_end()
    assert bench.reports == []


def test_search_under_way_is_kept_when_the_explorer_stops(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setenv("EXPLORER_DATA", str(tmp_path))
    running = start_page(paper_start(), port=0, user_data=open_user_data(resume=True))
    session = running.page.session
    for action in (Set("optimisation.request", ENDLESS), start_run()):
        session.do(action)
    wait_for(lambda: len(getattr(Optimisation.of(session.state).run, "iterates", ())) >= 3)
    running.stop()
    resumed = open_user_data(resume=True)
    assert resumed.history is not None
    state = resumed.history.step.state
    resumed.store.close()
    run = run_of(state)
    assert run.verdict is not None
    assert (run.phase, run.verdict.status) == ("ended", "cancelled")
    assert state.design.variables == best_of(run).design.variables
    assert revert().apply(state).design == paper_start()


def test_killed_process_leaves_the_design_and_the_panel_says_so(bench: Bench) -> None:
    process = bench.search(ENDLESS, 10)
    os.kill(process, signal.SIGKILL)
    run = bench.wait_for_end()
    state = bench.state
    assert mechanism_of(state) == mechanism_of(open_state(paper_start()))
    assert run.verdict is not None
    assert run.verdict.status == "failed"
    assert "died" in search_words(state)
    assert ACCEPT not in buttons_of(state)
    assert len(bench.reports) == 1
    bench.reports.clear()


# Runs and their ends


@pytest.mark.parametrize("own", [own_state(), set_joint(0, 25.0).apply(own_state())])
def test_revert_restores_design_and_pose_exactly_and_keeps_the_view(own: State) -> None:
    ended = end(start(state=own))
    assert ended.unclosed is None
    view = replace(ended.view, labels=False)
    state = ended
    for action in (Set("view", view), set_position(2, 8.0), set_variable("b2", 3.3)):
        state = action.apply(state)
    assert state.design != own.design
    after = revert().apply(state)
    assert mechanism_of(after) == mechanism_of(own)
    assert (after.hold, after.view) == (own.hold, view)
    assert Optimisation.of(after).run is None
    assert Optimisation.of(after).request == SMALL
    # There is nothing to return from any more.
    assert revert().apply(after) == after


def test_accept_keeps_the_result_and_reset_returns_to_the_design_that_was_opened(
    found: State,
) -> None:
    notice = search_notice(found)
    assert notice is not None
    assert (notice.title, notice.text) == ("Converged", "volume 8,000 cm³")
    assert "Volume 8,000 cm³ after" in search_words(found)
    assert notice.buttons == (ACCEPT, REVERT)
    assert (buttons_of(found)[ACCEPT], buttons_of(found)[REVERT]) == ("filled", "enabled")
    after = accept().apply(found)
    assert search_notice(after) is None
    assert after.design.variables == best_of(run_of(after)).design.variables
    assert not {ACCEPT, REVERT} & {*buttons_of(after)}
    assert "accepted" in search_words(after)
    record = Optimisation.of(after).record
    assert record is not None
    assert record.problem == run_of(after).problem
    assert record.design.variables == after.design.variables
    assert revert().apply(after) == after
    again = reset_design().apply(after)
    assert (again.design, Optimisation.of(again).record) == (paper_start(), None)


def test_run_from_an_undecided_result_still_reverts_to_the_own_design() -> None:
    ended = end(start())
    again = start_run().apply(ended)
    assert run_of(again).number == 2
    assert run_of(again).problem.start.variables == ended.design.variables
    assert mechanism_of(revert().apply(end(again))) == mechanism_of(own_state())
    accepted = start_run().apply(accept().apply(ended))
    assert run_of(accepted).own.design == ended.design


@pytest.mark.parametrize(
    "action",
    [
        set_variable("b2", 3.1),
        Set("design.unit_mm", 5.0),
        Set("design.limits", OPTIMAL.limits),
        open_design(OPTIMAL),
        reset_design(),
        lift_limit("box"),
    ],
)
def test_design_cannot_be_changed_while_a_run_goes_on(action: Action) -> None:
    state = start()
    for each in (state, cancel_run().apply(state)):
        with pytest.raises(InputError, match=r"being optimised: wait .* or cancel"):
            action.apply(each)
    action.apply(end(state))


def test_platform_moves_freely_during_a_run_and_iterates_keep_its_position() -> None:
    state = start(replace(SMALL, free=(*VARIABLES, YAW)))
    run = run_of(state)
    moved = set_position(0, 6.0).apply(state)
    last = iterates_of(state, 3)[-1]
    after = add_iterates(run.number, (last,)).apply(moved)
    assert after.pose.position[0] == 6.0
    assert after.pose.quaternion == last.design.home_pose.quaternion
    assert after.pose.quaternion != run.own.design.home_pose.quaternion
    assert after.joints == open_state(last.design, after.pose).joints
    # Iterates of another run change nothing.
    assert add_iterates(run.number + 1, (last,)).apply(moved) == moved


def test_opening_another_design_forgets_the_run_and_keeps_the_request() -> None:
    after = open_design(OPTIMAL).apply(end(start()))
    assert Optimisation.of(after).run is None
    assert Optimisation.of(after).request == SMALL
    assert run_of(start_run().apply(after)).number == 2


# Problems, and what rules them out


def test_only_free_variables_change() -> None:
    state = start(replace(SMALL, free=("a3x", "b1y")))
    last = iterates_of(state, 3)[-1]
    both = zip(VARIABLES, paper_start().variables, last.design.variables, strict=True)
    assert [name for name, old, new in both if old != new] == ["a3x", "b1y"]


@pytest.mark.parametrize("design", [INITIAL, OPTIMAL], ids=str)
def test_suggested_values_suit_the_design(design: Design) -> None:
    state = open_state(design)
    volume = workspace_volume(design).volume
    asked = complete_request(state)
    assert 1.05 * volume < (asked.volume or 0.0) < 2.3 * volume
    assert asked.reach == design.reach
    same = ask(OptimisationRequest(objective="smallest-reach"), state)
    assert complete_request(same).volume == pytest.approx(volume, rel=1e-5)


@pytest.mark.parametrize("design", [INITIAL, OPTIMAL], ids=str)
@pytest.mark.parametrize("objective", OBJECTIVES)
def test_default_demands_can_be_kept_by_the_papers_designs(design: Design, objective: Any) -> None:
    state = ask(OptimisationRequest(objective=objective), open_state(design))
    assert find_refusals(state) == ()
    assert liftable_limits(state) == ()
    assert start_run().apply(state).busy


@pytest.mark.parametrize(
    ("design", "request_", "limit", "title"),
    [
        (INITIAL, SMALL, "box", "Lift the box"),
        (
            limited(OPTIMAL, l1=(0.0, 12.0)),
            SMALL,
            "l1 maximum",
            "Tie the maximum of l1 to the reach",
        ),
        (
            limited(OPTIMAL, l1=(0.0, 25.0)),
            OptimisationRequest(objective="smallest-reach"),
            MAXIMA,
            "Tie all maximum lengths to the reach",
        ),
        (
            limited(OPTIMAL, swing=Swing(a1=30.0)),
            OptimisationRequest(),
            SWING_LIMIT,
            "Lift the bounds of the swing",
        ),
    ],
)
def test_limit_that_rules_a_search_out_is_lifted_by_one_press(
    design: Design, request_: OptimisationRequest, limit: str, title: str
) -> None:
    before = ask(request_, open_state(design))
    assert liftable_limits(before) == (limit,)
    assert filled_buttons(before) == [LIFT]
    assert buttons_of(before)[START] == "disabled"
    assert f">{title}<" in search_words(before)
    assert lift_limit(limit).describe(before) == title
    after = lift_limit(limit).apply(before)
    assert limit not in {refusal.limit for refusal in find_refusals(after)}
    assert after.design.home_pose == design.home_pose


def test_words_of_a_search_are_in_the_unit_of_the_page(found: State) -> None:
    run = run_of(found)
    assert run.verdict is not None
    best = best_of(run)
    told = "no design was found with a volume of 8,000 units³, such as at (1, −2.5, 0) units"
    for message in (told, result_of(replace(run, phase="cancelling"), "", (best,)).message):
        verdict = replace(run.verdict, status="infeasible", message=message)
        in_mm = with_value(with_value(found, "view.lengths", "mm"), "optimisation.run", run)
        words = verdict_words(in_mm, run, verdict)
        assert "units" not in words
        assert REACHED not in words
        assert "10 mm" not in words
    assert "of 8,000 cm³, such as at (10, −25, 0) mm" in verdict_words(
        in_mm, run, replace(verdict, message=told)
    )


def test_verdict_is_gone_with_the_design_that_it_is_about(found: State) -> None:
    assert "Converged" in search_words(found)
    after = set_variable("b2", 3.3).apply(found)
    assert "Converged" not in search_words(after)
    assert "changed by hand" in search_words(after)


def test_table_of_a_search_names_each_unit_once_and_writes_no_rounding(found: State) -> None:
    run = run_of(found)
    own = run.own.design
    demands = msgspec.structs.replace(run.problem.demands, clearance=0.2)
    problem = msgspec.structs.replace(run.problem, demands=demands)
    both = compare_designs(problem, own, best_of(run).design)
    ended = with_value(found, "optimisation.run.comparison", both)
    ended = with_value(ended, "view.lengths", "mm")
    words = re.sub(r"<[^>]*>", " ", comparison_table(run_of(ended), ended.view))
    assert not re.search(r"\bmm\s+mm\b", words)
    assert "|δ| ≥" in words
    tiny = replace(both[0], values={**both[0].values, "least_clearance": 2.05e-15})
    column = ComparedDesign(0, own, tiny, own.millimetres)
    assert column.value(CATALOGUE["least_clearance"]) == 0.0


def test_limits_in_force_are_listed_and_no_others() -> None:
    design = limited(
        OPTIMAL,
        l1=(1.5, 12.0),
        guide=(-3.0, 20.0),
        gap=0.25,
        box=None,
        margin=0.5,
        carriage_order="any",
        swing=Swing(b4=40.0),
        leg_radii=(0.1, 0.1, 0.3, 0.1),
    )
    assert dict(limit_rows(design, UNITS)) == {
        "l1": "1.5 to 12",
        "d2, d4, l4": f"at most {design.reach:.5g} (the reach)",
        "d1, d3": "−3 to 20",
        "gap |d1 − d3|": "at least 0.25",
        "δ1, δ2, δ3": "sign as at home, magnitude at least 0.5",
        "swing b4": "at most 40°",
        "leg radii": "0.1 to 0.3",
    }
    free = limited(OPTIMAL, box=None, carriage_order="any", margin=None)
    assert [row for row, _ in limit_rows(free, UNITS)] == ["l1, d2, d4, l4"]


# What is shown


def test_table_shows_old_and_new_and_their_difference(found: State) -> None:
    run = run_of(found)
    assert run.comparison is not None
    before, after = run.comparison
    rows = {
        row[0].partition(" ")[0]: row[1:]
        for row in rows_of(comparison_table(run, View(lengths="design units")))
    }
    volume = before["volume"] or 0.0
    assert [number(cell) for cell in rows["volume"]] == pytest.approx(
        [volume, 8000.0, 8000.0 - volume], abs=0.005
    )
    for index, name in enumerate(VARIABLES):
        old, new = before.design.variables[index], after.design.variables[index]
        assert [number(cell) for cell in rows[name]] == pytest.approx([old, new, new - old], 1e-3)
        assert rows[name][2][0] == ("+" if new > old else "−")
    old, new = (each["node_count"] or 0 for each in (before, after))
    assert [number(cell) for cell in rows["nodes"]] == [old, new, new - old]
    assert number(rows["clearance"][1]) >= 0.198
    assert number(rows["longest"][1]) == pytest.approx(best_of(run).design.reach, abs=1e-4)


def test_charts_are_of_one_start_and_of_the_demands() -> None:
    state = start(ENDLESS)
    run = run_of(state)
    assert charted_iterates(run) == []
    iterates = iterates_of(state, 8)
    assert {each.run for each in iterates} == {0, 1}
    last = [each for each in iterates if each.run == 1]
    drawn = charted_iterates(run_of(add_iterates(run.number, iterates).apply(state)))
    reach, volume, spare = curves_of(run.problem, drawn)
    assert reach.values.tolist() == [each.objective for each in last]
    assert volume.values.tolist() == [each.volume for each in last]
    assert (volume.level, spare.level) == (7053.0, 0.0)
    charts = "".join(course(run_of(add_iterates(run.number, iterates).apply(state)), state))
    assert charts.count('class="curve"') == charts.count("<svg") == 3
    assert charts.count('class="point"') == 3 * len(last)
    # An exact match is drawn as the least power.
    small = start()
    first, second = iterates_of(small, 2)
    ended = run_of(end(small, (first, msgspec.structs.replace(second, objective=0.0))))
    powers = curves_of(ended.problem, charted_iterates(ended))[0].values
    assert powers.tolist() == [np.log10(first.objective), -16.0]
