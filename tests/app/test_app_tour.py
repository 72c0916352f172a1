"""The tour: its steps, and what it takes back, which is what it has changed and nothing else."""

from __future__ import annotations

from collections.abc import Callable
from types import SimpleNamespace
from typing import Any

import numpy as np
import pytest
from desk import Desk
from hypothesis import given, settings, strategies as st
from sample_states import iterates_of
from services import services_for

from explorer.app.features.help.tour import OVER, STAYS, STEPS, Tour, TourGuide, end_tour
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
ONE, OTHER = 1, 2
"""Ids of the browser with the tour, and of one without."""


class TourDesk(Desk):
    """A desk with the tour of one browser, whose messages are kept with the browser's id."""

    def __init__(self) -> None:
        self.told: list[tuple[str, int | None]] = []
        self._client: Any = SimpleNamespace(client_id=ONE, _websock_connection=self)
        self._press: Callable[[str, Any], None]
        self._leave: Callable[[Any], None]
        self._guide: TourGuide | None = None
        super().__init__(open_state(OPTIMAL))
        server: Any = SimpleNamespace(on_client_disconnect=self._keep_leave)
        buttons: Any = SimpleNamespace(on=self._keep_press)
        tell: Any = self._keep_message
        services = services_for(server, self.session, buttons=buttons, tell=tell)
        self._guide = TourGuide(services)

    def queue_message(self, message: object) -> None:
        """Drop what is sent to the browser."""

    def draw(self, frame: Frame) -> None:
        """Let the tour follow a frame."""
        if self._guide is not None:
            self._guide.follow(frame)

    def begin(self, *presses: str) -> None:
        """Begin the tour, and press buttons of its card."""
        assert self._guide is not None
        self._guide.begin(self._client)
        for name in presses:
            self.tour(name)

    def leave(self) -> None:
        """Close or reload the browser with the tour."""
        self._leave(self._client)

    def tour(self, name: str) -> None:
        """Press a button of the card."""
        self._press(name, self._client)
        assert self.session.wait_until_idle()

    def do(self, action: Action, who: int = OTHER) -> State:
        """Do an action, by default of the other browser; return the state after it."""
        self.session.do(action, who=who)
        return self.state

    def end_search(self, *, with_result: bool) -> None:
        """End the present search."""
        run = Optimisation.of(self.state).run
        assert run is not None
        iterates = iterates_of(self.state, 2) if with_result else ()
        status, best = ("converged", iterates[-1]) if iterates else ("cancelled", None)
        self.do(end_run(run.number, SearchResult(status, "It ended.", best), iterates))

    def _keep_message(self, message: str, who: int | None = None) -> None:
        self.told.append((message, who))

    def _keep_press(self, _: str, press: Callable[[str, Any], None], **__: object) -> None:
        self._press = press

    def _keep_leave(self, leave: Callable[[Any], None]) -> None:
        self._leave = leave


def parts(state: State) -> tuple[object, ...]:
    """Return what the tour changes of a state."""
    request, paths = Optimisation.of(state).request, Paths.of(state)
    return state.design, state.base, state.pose, state.joints, state.view, request, paths


@pytest.mark.parametrize("design", PRESETS.values(), ids=str)
def test_step_of_the_tour_is_done_by_what_it_shows_and_not_before(design: Design) -> None:
    state = start = open_state(design)
    tour, changes = Tour(0, Frame(state)), list[tuple[State, State]]()

    def apply(action: Action) -> State:
        changes.append((state, action.apply(state)))
        return changes[-1][1]

    assert tour.step_by(-1, Frame(state)).at == 0
    for index, step in enumerate(STEPS):
        assert tour.at == index
        if step.before is not None:
            state = apply(step.before)
        assert not tour.after_frame(Frame(state)).is_done
        state = apply(tour.step.show(Frame(state)))
        if Optimisation.of(state).is_on:
            assert not tour.after_frame(Frame(state)).is_done
            state = end_run(1, SearchResult("failed", "no answer")).apply(state)
        tour = tour.after_frame(Frame(state))
        assert tour.is_done
        # Wherever the tour ends, all is as it was before.
        assert parts(end_tour(tuple(changes)).apply(state)) == parts(start)
        # It comes close to a singularity without reaching it.
        assert np.abs(Frame(state).snapshot.margins).min() > 0.0
        # Once done it stays so, whatever is done next.
        assert tour.after_frame(Frame(start)).is_done
        if step.after is not None:
            state = apply(step.after)
        assert tour.is_last == (index == len(STEPS) - 1)
        tour = tour.step_by(1, Frame(state))
    assert tour.at == len(STEPS) - 1


def test_change_of_another_browser_during_a_tour_stays() -> None:
    desk = TourDesk()
    desk.do(set_position(2, 7.0))
    desk.begin()
    present = desk.do(set_position(2, 6.4))
    desk.tour("Skip")
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
@given(st.lists(PRESSES | OF_OTHERS, max_size=14), st.sampled_from(("Skip", "leave")))
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
    desk.leave() if end == "leave" else desk.tour("Skip")
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
    desk.tour("Skip")
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
        desk.tour("Skip")
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
    desk.tour("Skip")
    run = Optimisation.of(desk.state).run
    assert run is not None
    assert run.phase == "running"
    desk.end_search(with_result=True)
    desk.begin("Next")
    result = desk.do(accept())
    desk.leave()
    assert desk.state == result
