"""The tour: its steps, and what it takes back, which is what it has changed and nothing else."""

from __future__ import annotations

import numpy as np
import pytest
from hypothesis import given, settings, strategies as st
from tour_desk import BROWSER, ONE, TourDesk

from explorer.app.features.help.guide import OVER, STAYS, Card, end_course
from explorer.app.features.help.lessons import TOUR, Relation, arrange, list_courses
from explorer.app.features.optimise.actions import accept, end_run, start_run
from explorer.app.features.optimise.state import Optimisation, SearchResult
from explorer.app.features.paths.state import Paths
from explorer.app.state.actions import Action, Set
from explorer.app.state.frame import Frame
from explorer.app.state.geometry import set_variable
from explorer.app.state.moves import set_position
from explorer.app.state.state import State, open_state
from explorer.mechanism.design import Design
from explorer.mechanism.design_file import PRESETS

OPTIMAL, INITIAL = PRESETS["paper-optimal"], PRESETS["paper-initial"]


def parts(state: State) -> tuple[object, ...]:
    """Return what the tour changes of a state."""
    request, paths = Optimisation.of(state).request, Paths.of(state)
    return state.design, state.base, state.pose, state.joints, state.view, request, paths


@pytest.mark.parametrize("design", PRESETS.values(), ids=str)
def test_step_of_the_tour_is_done_by_what_it_shows_and_not_before(design: Design) -> None:
    state = start = open_state(design)
    tour = list_courses()[TOUR]
    card = Card(BROWSER, tour, 0, Frame(state))

    def apply(settings: tuple[Relation, ...]) -> State:
        after = arrange("", settings).apply(state)
        card.observe(after, card)
        return after

    card.turn(-1, Frame(state))
    for index, step in enumerate(tour.steps):
        assert card.at == index
        state = apply(step.first)
        card.follow(Frame(state))
        assert not card.is_done
        state = apply(step.shown)
        if Optimisation.of(state).is_on:
            card.follow(Frame(state))
            assert not card.is_done
            state = end_run(1, SearchResult("failed", "no answer")).apply(state)
        card.follow(Frame(state))
        assert card.is_done
        # Wherever the tour ends, all is as it was before.
        card.observe(state)
        assert parts(end_course("", card.own).apply(state)) == parts(start)
        # It comes close to a singularity without reaching it.
        assert np.abs(Frame(state).snapshot.margins).min() > 0.0
        # Once done it stays so, whatever is done next.
        card.follow(Frame(start))
        assert card.is_done
        state = apply(step.then)
        assert card.is_last == (index == len(tour.steps) - 1)
        card.turn(1, Frame(state))
    assert card.at == len(tour.steps) - 1


def test_change_of_another_browser_during_a_tour_stays() -> None:
    desk = TourDesk()
    desk.do(set_position(2, 7.0))
    desk.begin()
    present = desk.do(set_position(2, 6.4))
    desk.tour("Leave")
    assert desk.state == present
    assert desk.session.history.step.words != "End the tour"
    assert desk.told == []


def test_reload_within_a_tour_takes_back_nothing_that_was_done_by_hand() -> None:
    desk = TourDesk()
    desk.do(set_position(2, 7.9), ONE)
    desk.begin("Next")
    present = desk.do(set_position(2, 8.3), ONE)
    desk.leave()
    assert desk.state == present


OF_OTHERS = st.one_of(
    st.builds(set_position, st.integers(0, 2), st.sampled_from((3.25, 4.5, 6.75))),
    st.builds(set_variable, st.sampled_from(("a3y", "b1x", "b2")), st.sampled_from((2.25, 3.125))),
    st.builds(
        Set,
        st.sampled_from(("view.grid", "view.workspace.hull", "view.singular.ball")),
        st.booleans(),
    ),
)
PRESSES = st.sampled_from(("Show me", "Next", "Next", "Back"))


@settings(max_examples=40)
@given(st.lists(PRESSES | OF_OTHERS, max_size=14), st.sampled_from(("Leave", "leave")))
def test_tour_that_ends_leaves_what_others_did_as_if_there_had_been_none(
    events: list[str | Action], end: str
) -> None:
    desk, at, expected = TourDesk(), 0, open_state(OPTIMAL)
    desk.begin()
    for event in events:
        if isinstance(event, str):
            # The last step begins a search.
            if (at, event) != (4, "Show me"):
                desk.tour(event)
                at = min(max(at + {"Next": 1, "Back": -1}.get(event, 0), 0), 4)
            if at == 4 and event == "Next":
                break
        # A design that the tour has opened stays once it is changed.
        elif at < 4 or event.apply(expected).design == expected.design:
            desk.do(event)
            expected = event.apply(expected)
    desk.leave() if end == "leave" else desk.tour("Leave")
    left = desk.state
    assert (left.design, left.base, left.view) == (expected.design, expected.base, expected.view)
    assert left.pose.position == expected.pose.position
    assert left.pose.quaternion == pytest.approx(expected.pose.quaternion, abs=1e-15)
    np.testing.assert_allclose(left.joints, expected.joints, rtol=1e-12)
    assert desk.complaints == []


def test_design_that_the_tour_opened_stays_once_it_is_changed_and_the_user_is_told() -> None:
    desk = TourDesk()
    desk.begin(*["Next"] * 4)
    assert desk.state.design.variables == INITIAL.variables
    present = desk.do(set_variable("b2", 2.5))
    desk.tour("Leave")
    assert parts(desk.state) == parts(present)
    assert desk.told == [(STAYS, ONE)]


@pytest.mark.parametrize("is_shown", [True, False])
@pytest.mark.parametrize("with_result", [True, False])
def test_search_of_the_tour_is_taken_back_with_the_design_that_it_opened(
    is_shown: bool, with_result: bool
) -> None:
    desk = TourDesk()
    first = desk.state
    desk.begin(*["Next"] * 4)
    if is_shown:
        desk.tour("Show me")
    else:
        desk.do(start_run(), ONE)
    if with_result:
        desk.end_search(with_result=True)
        assert desk.state.design.variables != INITIAL.variables
        desk.tour("Next")
    else:
        desk.tour("Leave")
        run = Optimisation.of(desk.state).run
        assert run is not None
        assert run.phase == "cancelling"
        desk.end_search(with_result=False)
    assert desk.state.design == first.design
    assert desk.state.pose == first.pose
    assert Optimisation.of(desk.state).run is None
    assert Optimisation.of(desk.state).request == Optimisation.of(first).request
    assert desk.told == [(OVER, ONE)]
    desk.do(start_run())
    assert Optimisation.of(desk.state).count == 2


def test_search_of_another_browser_goes_on_and_an_accepted_result_stays() -> None:
    desk = TourDesk()
    desk.begin()
    desk.do(start_run())
    desk.tour("Leave")
    run = Optimisation.of(desk.state).run
    assert run is not None
    assert run.phase == "running"
    desk.end_search(with_result=True)
    desk.begin("Next")
    result = desk.do(accept())
    desk.leave()
    assert desk.state == result
