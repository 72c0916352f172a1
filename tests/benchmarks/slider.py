"""From the arrival of an event at the server to the last message of the scene it makes.

A tab in another process sends the events over a real websocket and reads all that comes back.
An event ends when the scene with its value, or with a newer one, is assigned; the figures of the
panels follow. The processor's time is that of both.
"""

from __future__ import annotations

import math
import multiprocessing
import time
from collections import deque
from collections.abc import Callable, Generator, Iterable, Iterator, Sequence
from concurrent.futures import ProcessPoolExecutor
from contextlib import contextmanager
from dataclasses import dataclass, replace
from functools import partial
from itertools import chain
from typing import Any

import viser
from machines import PRESS
from socket_tab import SocketTab

from benchmarks.page import ready_page
from benchmarks.samples import DESIGN
from benchmarks.table import Row, seconds
from benchmarks.timing import Spread
from explorer.app.features.mechanism.feature import JOINT_HINTS
from explorer.app.scene.placing import scene_scale
from explorer.app.server import Running
from explorer.app.state.actions import Set, open_design
from explorer.app.state.state import State
from explorer.app.state.view import PrecisionView
from explorer.mechanism.design_file import typical_machine
from explorer.page.widgets.assigning import Assigner, Update

ROUNDS, EVENTS, WARM_UP_EVENTS = 3, 100, 20
EVENTS_PER_SECOND = 30.0
SHORT = {"ROUNDS": 1, "EVENTS": 20, "WARM_UP_EVENTS": 5}
Message = dict[str, Any]


@dataclass(frozen=True)
class Kind:
    """A way to move the mechanism: its events, and where their values arrive.

    Attributes:
        name: In the table.
        drag: The messages of a drag of so many events.
        sent: The value in a message of it.
        arrived: The same value in a state.
        is_loaded: Whether the machine has limits, errors and stiffness, and all is drawn.
    """

    name: str
    drag: Callable[[Running, int], list[Message]]
    sent: Callable[[Any], float]
    arrived: Callable[[State], float]
    is_loaded: bool = False


def _value(message: Any) -> float:
    return float(message.updates["value"])


def sweep(middle: float, count: int) -> list[float]:
    """Return values that swing by 1 about the middle, in periods of two seconds."""
    return [middle + math.sin(k / 10.0) for k in range(1, count + 1)]


def _handle_drag(running: Running, count: int) -> list[Message]:
    state = running.page.session.state
    scale, message = scene_scale(state), "TransformControlsUpdateMessage"
    x, y, z = (scale * v for v in state.pose.position)
    return [
        {"type": message, "name": "/handle", "position": (v, y, z), "wxyz": state.pose.quaternion}
        for v in sweep(x, count)
    ]


def _slider_drag(running: Running, count: int) -> list[Message]:
    handles: Any = running.viser.gui
    (uuid,) = (
        uuid
        for uuid, handle in handles._gui_input_handle_from_uuid.items()
        if getattr(handle, "label", None) == next(iter(JOINT_HINTS))
    )
    state = running.page.session.state
    return [
        {
            "type": "GuiUpdateMessage",
            "uuid": uuid,
            "updates": {"value": state.unit_of(1).convert(length)},
        }
        for length in sweep(state.joints[0], count)
    ]


def drag(url: str, messages: Sequence[Message]) -> None:
    """Send messages from a tab at an even pace."""
    tab = SocketTab(url)
    start = time.monotonic() + 0.1
    for count, message in enumerate(messages):
        time.sleep(max(0.0, start + count / EVENTS_PER_SECOND - time.monotonic()))
        tab.send(message)
    tab.flush()
    tab.close()


DRAG = Kind(
    "drag handle",
    _handle_drag,
    lambda message: float(message.position[0]),
    lambda state: state.pose.position[0] * scene_scale(state),
)
KINDS = (
    Kind(
        "leg slider l1",
        _slider_drag,
        _value,
        lambda state: state.unit_of(1).convert(state.joints[0]),
    ),
    DRAG,
    replace(DRAG, name="drag handle, forces and precision drawn", is_loaded=True),
)


class Stopwatch:
    """Runs from the arrival of each event to the first scene drawn that is not older than it."""

    def __init__(self, kind: Kind) -> None:
        self._kind = kind
        self._waiting: deque[tuple[float, float]] = deque()
        self._worked: float | None = None
        self.durations: list[float] = []
        # Of the processor, per frame: other work on the machine does not show in it.
        self.work: list[float] = []

    def arrive(self, message: Any) -> None:
        """Note the arrival of a message."""
        now = time.perf_counter()
        if type(message).__name__ in ("GuiUpdateMessage", "TransformControlsUpdateMessage"):
            self._waiting.append((now, self._kind.sent(message)))

    def drawn(self, state: State) -> None:
        """Note what is drawn, the scene of a frame or its figures, on the thread of all."""
        now, worked = time.perf_counter(), time.thread_time()
        shown = self._kind.arrived(state)
        waiting = list(self._waiting)
        for index, (_, value) in enumerate(waiting):
            if abs(value - shown) < 1e-9:
                if self._worked is not None:
                    self.work.append(worked - self._worked)
                self._worked = worked
                self.durations += [now - arrival for arrival, _ in waiting[: index + 1]]
                for _ in range(index + 1):
                    self._waiting.popleft()
                return


@contextmanager
def timed(running: Running, stopwatch: Stopwatch) -> Generator[None]:
    """Let the stopwatch hear of every message that arrives and of every frame's end."""
    internals: Any = running.viser
    server = internals._websock_server
    handle, assign = server._handle_incoming_message, Assigner.assign

    def arriving(client_id: int, message: Any) -> Any:
        stopwatch.arrive(message)
        return handle(client_id, message)

    def assigning(
        self: Assigner, updates: Iterable[Update], *, since: float | None = None
    ) -> list[Update]:
        assigned = assign(self, updates, since=since)
        stopwatch.drawn(running.page.session.state)
        return assigned

    server._handle_incoming_message = arriving
    Assigner.assign = assigning
    try:
        yield
    finally:
        Assigner.assign = assign
        del server._handle_incoming_message


def run() -> Iterator[Row]:
    """Yield a row of the slowest kind and one of each kind."""
    found = measure()
    for kind, watches in found.items():
        assert all(watch.durations for watch in watches), f"{kind}: its events make no frames"
    spreads = {
        kind: Spread.of(list(chain(*(watch.durations for watch in watches))))
        for kind, watches in found.items()
    }
    worst = max(spreads, key=lambda kind: spreads[kind].p95)
    calmest = min(Spread.of(watch.durations).p95 for watch in found[worst])
    yield Row(
        "event to last message of the scene, p95 of the slowest kind",
        f"{seconds(spreads[worst].p95)} ({worst}); best of {ROUNDS} rounds {seconds(calmest)}",
        "5 ms",
    )
    for kind, spread in spreads.items():
        count = sum(len(watch.durations) for watch in found[kind])
        work = Spread.of(list(chain(*(watch.work for watch in found[kind]))))
        yield Row(
            f"  {kind}, {count} of {ROUNDS * EVENTS} events",
            f"p50 {seconds(spread.p50)}, p95 {seconds(spread.p95)}, max {seconds(spread.longest)}; "
            f"processor p50 {seconds(work.p50)}",
        )


def _press(page: Any, client: viser.ClientHandle) -> None:
    """Note that the user of a tab holds the mouse down, as its browser would report."""
    page._presses.record(client.client_id, 1, time.time())


def measure() -> dict[str, list[Stopwatch]]:
    """Return the stopwatch of every round, by kind."""
    watches: dict[str, list[Stopwatch]] = {kind.name: [] for kind in KINDS}
    context = multiprocessing.get_context("spawn")
    with ready_page() as running, ProcessPoolExecutor(1, mp_context=context) as tabs:
        session = running.page.session
        running.viser.on_client_connect(partial(_press, running.page))
        # The kinds take turns, so that no disturbance falls on one alone.
        for events in (WARM_UP_EVENTS, *[EVENTS] * ROUNDS):
            for kind in KINDS:
                session.do(open_design(typical_machine(PRESS)[0] if kind.is_loaded else DESIGN))
                session.do(Set("view.forces.shown", kind.is_loaded))
                session.do(Set("view.coordinates", "lengths"))
                drawn = PrecisionView(ellipsoid=kind.is_loaded, deflected=kind.is_loaded)
                session.do(Set("view.precision", drawn))
                session.wait_until_idle()
                stopwatch = Stopwatch(kind)
                with timed(running, stopwatch):
                    tabs.submit(drag, running.url, kind.drag(running, events)).result()
                    session.wait_until_idle()
                if events == EVENTS:
                    watches[kind.name].append(stopwatch)
    return watches
