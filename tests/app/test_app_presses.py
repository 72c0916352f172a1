"""Presses as browsers tell of them: which one a change at some time comes from."""

from __future__ import annotations

import time
from collections.abc import Iterator
from contextlib import closing
from typing import Any

import pytest
from socket_tab import SocketTab

from explorer.app.server import Running, start
from explorer.app.session import gestures
from explorer.app.state.presses import MOST_PRESSES, Press, Presses
from explorer.mechanism.design_file import PRESETS

PATIENCE = 30.0


@pytest.fixture
def presses() -> Presses:
    return Presses()


def test_press_holds_from_its_beginning_to_its_release(presses: Presses) -> None:
    presses.record(1, 7, 10.0)
    assert presses.at(1, 9.9) is None
    assert presses.at(1, 10.0) == presses.at(1, 1e6) == Press(1, 7)
    presses.record(1, -7, 20.0)
    assert presses.at(1, 20.0) == Press(1, 7)
    assert presses.at(1, 20.1) is None
    # What was done before the release may be made after it.
    assert presses.at(1, 15.0) == Press(1, 7)


def test_press_that_goes_on_after_its_window_was_left_is_the_same(presses: Presses) -> None:
    presses.record(1, 7, 10.0)
    presses.record(1, -7, 11.0)
    presses.record(1, 7, 15.0)
    assert presses.at(1, 16.0) == Press(1, 7)


def test_next_press_ends_one_whose_release_was_lost(presses: Presses) -> None:
    presses.record(1, 7, 10.0)
    presses.record(1, 8, 20.0)
    presses.record(1, -7, 20.1)
    assert presses.at(1, 19.0) == Press(1, 7)
    assert presses.at(1, 21.0) == Press(1, 8)


def test_presses_of_other_browsers_and_of_those_gone_hold_nothing(presses: Presses) -> None:
    presses.record(1, 7, 10.0)
    presses.record(2, -3, 10.0)
    assert presses.at(2, 11.0) is None
    assert presses.at(None, 11.0) is None
    presses.forget(1)
    presses.forget(3)
    assert presses.at(1, 11.0) is None


def test_presses_keep_the_last_ones(presses: Presses) -> None:
    for number in range(1, 3 * MOST_PRESSES):
        presses.record(1, number, float(number))
        presses.record(1, -number, number + 0.1)
    last = 3 * MOST_PRESSES - 1
    assert presses.at(1, last) == Press(1, last)
    assert presses.at(1, 1.0) is None


@pytest.fixture
def running() -> Iterator[Running]:
    running = start(PRESETS["paper-optimal"], port=0)
    yield running
    running.stop()


def test_server_makes_one_step_of_each_press_of_a_browser(
    running: Running, monkeypatch: pytest.MonkeyPatch
) -> None:
    # Every pause is too long.
    monkeypatch.setattr(gestures, "PAUSE_SECONDS", -1.0)
    gui: Any = running.viser.gui
    handles: list[Any] = list(gui._gui_input_handle_from_uuid.values())
    slider = next(each for each in handles if each.label == "x")
    session: Any = running.page.session
    with closing(SocketTab(running.url)) as tab:
        deadline = time.monotonic() + PATIENCE

        def inboxes() -> list[str]:
            clients: list[Any] = list(running.viser.get_clients().values())
            fields = [each.gui._gui_input_handle_from_uuid for each in clients]
            both = [pair for each in fields for pair in tuple(each.items())]
            return [uuid for uuid, field in both if field.label == "Press"]

        while not inboxes():
            assert time.monotonic() < deadline
            time.sleep(0.01)
        (inbox,) = inboxes()
        value = 11.0

        def move() -> int:
            nonlocal value
            value += 0.25
            tab.update(slider._impl.uuid, value)
            while session.state.pose.position[0] != value:
                assert time.monotonic() < deadline
                time.sleep(0.01)
            return len(session.history.steps) - 1

        tab.update(inbox, 1)
        assert [move() for _ in range(3)] == [1, 1, 1]
        tab.update(inbox, -1)
        tab.update(inbox, 2)
        assert [move() for _ in range(3)] == [2, 2, 2]
        # Nothing is held, as with keys.
        session._press_at.__self__.forget(next(iter(running.viser.get_clients())))
        assert [move() for _ in range(3)] == [3, 4, 5]
