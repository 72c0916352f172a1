"""The session outlasts its explorer: what is left is what the next one goes on with."""

from __future__ import annotations

from pathlib import Path

import pytest
from desk import Desk
from hypothesis import given, strategies as st

from explorer.app.features.optimise.actions import StartRun
from explorer.app.session.gestures import ByHand
from explorer.app.session.history import History, begun, document
from explorer.app.session.session import REDO, UNDO, Session
from explorer.app.state.actions import SetName, SetPosition, SetUnit
from explorer.app.state.state import State, opened
from explorer.app.storage.autosave import Autosave
from explorer.app.storage.keeping import MOST_KEPT, Keeper, document_of, history_of, take_up
from explorer.mechanism.design_file import PRESETS

OPTIMAL = PRESETS["paper-optimal"]


def walked(count: int, back: int) -> tuple[State, History]:
    """Return a session of so many steps, of which the last were undone."""
    state = opened(OPTIMAL)
    history = begun(state)
    for index in range(count):
        act = ByHand(SetUnit(1.0 + index), object(), float(index))
        state = act.apply(state)
        history = history.recorded(act, state)
    history = history.moved(-min(back, count))
    return history.step.state, history


@given(st.integers(0, 130), st.integers(0, 130))
def test_what_is_kept_is_where_one_was_with_the_steps_around_it(count: int, back: int) -> None:
    state, history = walked(count, back)
    kept = document_of(history)
    assert kept.present == state
    assert len(kept.steps) == min(MOST_KEPT, count + 1)
    again = history_of(kept)
    assert again is not None
    assert again.step.state == state
    assert again.step.number == history.step.number
    numbers = [step.number for step in again.steps]
    assert numbers == [step.number for step in history.steps if step.number in numbers]
    for step in again.steps:
        there = history.moved_to(step.number).step
        assert (step.words, step.state) == (there.words, there.state)


def test_the_next_explorer_undoes_what_the_last_one_did(desk: Desk, tmp_path: Path) -> None:
    first = Autosave(tmp_path)
    keeper = Keeper(first, desk.complaints.append)
    desk.session.do(SetName("mine"))
    desk.session.do(SetPosition(0, 12.0))
    state = desk.state
    keeper.follow(state, desk.session.history)
    assert keeper.flush()
    keeper.stop()

    found = Autosave(tmp_path).adopt()
    assert found.messages == ()
    assert found.document is not None
    assert found.document.present == document(state)
    history = history_of(found.document)
    assert history is not None
    next_one = Session(found.document.present, lambda _: None, print, print, history)
    try:
        for _ in range(2):
            next_one.travel(UNDO)
        assert next_one.wait_until_idle()
        assert next_one.state == document(opened(OPTIMAL))
        for _ in range(2):
            next_one.travel(REDO)
        assert next_one.wait_until_idle()
        assert next_one.state == document(state)
    finally:
        next_one.stop()
    assert desk.complaints == []


def test_until_a_search_ends_what_was_before_it_is_kept(desk: Desk, tmp_path: Path) -> None:
    keeper = Keeper(Autosave(tmp_path), desk.complaints.append)
    desk.session.do(SetName("mine"))
    before = desk.state
    keeper.follow(before, desk.session.history)
    desk.session.do(StartRun())
    keeper.follow(desk.state, desk.session.history)
    assert desk.state.optimisation.is_on
    keeper.stop()
    found = Autosave(tmp_path).adopt().document
    assert found is not None
    assert found.present == document(before)


def test_a_design_that_is_named_is_opened_instead_and_what_was_left_stays(
    desk: Desk, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setenv("EXPLORER_DATA", str(tmp_path))
    left = take_up(resume=True)
    keeper = Keeper(left.store, desk.complaints.append)
    desk.session.do(SetName("left behind"))
    keeper.follow(desk.state, desk.session.history)
    keeper.stop()
    fresh = take_up(resume=False)
    assert fresh.left is None
    again = take_up(resume=True)
    assert again.left is not None
    assert again.left.present.design.name == "left behind"
    again.store.close()
    fresh.store.close()
