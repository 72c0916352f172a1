"""Presses as browsers tell of them: which one a change at some time comes from."""

from __future__ import annotations

import itertools
from contextlib import closing
from typing import Any

import pytest
from client import wait_for
from socket_tab import SocketTab

from explorer.app.server import Running
from explorer.app.session import gestures
from explorer.app.state.presses import MOST_PRESSES, Press, Presses


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


def test_presses_keep_the_last_ones(presses: Presses) -> None:
    last = 3 * MOST_PRESSES - 1
    for number in range(1, last + 1):
        presses.record(1, number, float(number))
        presses.record(1, -number, number + 0.1)
    assert presses.at(1, last) == Press(1, last)
    assert presses.at(1, 1.0) is None


def test_changes_during_a_press_of_a_browser_are_one_step(
    running: Running, monkeypatch: pytest.MonkeyPatch
) -> None:
    # Every pause is too long.
    monkeypatch.setattr(gestures, "PAUSE_SECONDS", -1.0)
    gui: Any = running.viser.gui
    handles: list[Any] = list(gui._gui_input_handle_from_uuid.values())
    slider = next(each for each in handles if each.label == "x")
    session: Any = running.page.session
    with closing(SocketTab(running.url)) as tab:

        def inboxes() -> list[str]:
            clients: list[Any] = list(running.viser.get_clients().values())
            fields = [each.gui._gui_input_handle_from_uuid for each in clients]
            both = [pair for each in fields for pair in tuple(each.items())]
            return [uuid for uuid, field in both if field.label == "Press"]

        wait_for(inboxes)
        (inbox,) = inboxes()
        begun = len(session.history.steps)
        values = (11.0 + 0.25 * number for number in itertools.count())

        def move() -> int:
            value = next(values)
            tab.update(slider._impl.uuid, value)
            wait_for(lambda: session.state.pose.position[0] == value)
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
