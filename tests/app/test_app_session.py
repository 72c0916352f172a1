"""The session makes the newest of the changes that many threads post at once."""

from __future__ import annotations

import threading
import time
from collections.abc import Generator, Sequence
from concurrent.futures import ThreadPoolExecutor
from contextlib import contextmanager

import pytest
from client import wait_for

from explorer.app.session.latest import LatestWins
from explorer.app.session.session import Session
from explorer.app.state.action import Action
from explorer.app.state.actions import SetJoint, SetPosition, SetVariable
from explorer.app.state.frame import Frame
from explorer.app.state.state import State, opened
from explorer.mechanism.design_file import PRESETS

PATIENCE = 60.0


class Watched:
    """A session whose frames, complaints and faults are kept."""

    def __init__(self) -> None:
        self.frames: list[Frame] = []
        self.complaints: list[tuple[str, int | None]] = []
        self.faults: list[Exception] = []
        self._drawing = threading.Event()
        self._gate = threading.Event()
        self._gate.set()
        self.session = Session(
            opened(PRESETS["paper-optimal"]),
            self._draw,
            lambda message, who: self.complaints.append((message, who)),
            self.faults.append,
        )

    @contextmanager
    def busy(self) -> Generator[None]:
        """Keep the session at one frame, so that all that is posted meanwhile waits."""
        self._drawing.clear()
        self._gate.clear()
        self.session.do(SetPosition(0, 9.0))
        assert self._drawing.wait(PATIENCE)
        yield
        self._gate.set()
        assert self.session.wait_until_idle()

    def _draw(self, frame: Frame) -> None:
        self._drawing.set()
        self._gate.wait(PATIENCE)
        self.frames.append(frame)


@pytest.fixture
def watched() -> Watched:
    return Watched()


def test_only_the_newest_of_a_burst_is_computed(watched: Watched) -> None:
    with watched.busy():
        for i in range(100):
            value = 11.0 + 0.001 * i
            watched.session.post(
                "slider", lambda _, value=value: SetJoint(0, value), stamp=float(i)
            )
    assert watched.session.state.joints[0] == 11.0 + 0.001 * 99
    # One that was under way, and one for all the rest.
    assert len(watched.frames) == 2
    assert watched.frames[-1].state is watched.session.state


def test_changes_of_one_burst_are_made_in_the_order_of_their_stamps(watched: Watched) -> None:
    now = time.time()
    with watched.busy():
        for stamp in (3.0, 1.0, 2.0):
            watched.session.post(
                "slider", lambda _, value=stamp: SetPosition(1, value), stamp=now + stamp
            )
        watched.session.post("a", lambda s: SetPosition(2, 2 * s.pose.position[2]), stamp=now + 2)
        watched.session.post("b", lambda _: SetPosition(2, 5.0), stamp=now + 1)
    assert watched.session.state.pose.position[1:] == (3.0, 10.0)


def test_refused_change_is_reported_to_its_client_and_the_state_is_drawn_again(
    watched: Watched,
) -> None:
    before = watched.session.state
    watched.session.do(SetVariable("a3y", 0.0), who=7)
    assert watched.session.wait_until_idle()
    ((message, who),) = watched.complaints
    assert "degenerate" in message
    assert who == 7
    assert watched.session.state == before
    assert watched.frames[-1].state == before


def test_unexpected_fault_is_reported_and_the_session_continues(watched: Watched) -> None:
    def broken(_: State) -> Action:
        raise RuntimeError("broken on purpose")

    watched.session.post("broken", broken)
    assert watched.session.wait_until_idle()
    assert [str(fault) for fault in watched.faults] == ["broken on purpose"]
    watched.session.do(SetPosition(0, 9.0))
    assert watched.session.wait_until_idle()
    assert watched.session.state.pose.position[0] == 9.0


def test_settled_state_has_all_that_was_posted_before(watched: Watched) -> None:
    settled: list[State] = []
    with watched.busy():
        for x in (3.0, 4.0):
            watched.session.post("x", lambda _, x=x: SetPosition(0, x))
        reader = threading.Thread(target=lambda: settled.append(watched.session.settled()))
        reader.start()
    reader.join()
    assert settled[0].pose.position[0] == 4.0


def test_changes_from_many_threads_are_all_made(watched: Watched) -> None:
    def run(axis: int) -> None:
        for i in range(30):
            watched.session.post(axis, lambda _, i=i: SetPosition(axis, 5.0 + 0.01 * i))

    with ThreadPoolExecutor(3) as threads:
        list(threads.map(run, range(3)))
    assert watched.session.wait_until_idle()
    assert watched.session.state.pose.position == pytest.approx((5.29, 5.29, 5.29))


def test_stopped_queue_drops_the_items_that_wait_and_ends_its_thread() -> None:
    handled: list[int] = []
    gate = threading.Event()

    def handle(items: Sequence[int]) -> None:
        gate.wait(PATIENCE)
        handled.extend(items)

    queue: LatestWins[int] = LatestWins(handle, "test queue")
    queue.post("a", 0.0, 1)
    wait_for(lambda: not queue.is_waiting("a"))
    queue.post("a", 1.0, 2)
    stopper = threading.Thread(target=queue.stop)
    stopper.start()
    wait_for(lambda: not queue.is_waiting("a"))
    gate.set()
    stopper.join()
    assert handled == [1]
    assert "test queue" not in [thread.name for thread in threading.enumerate()]
