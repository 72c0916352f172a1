"""The prototype on the page: new parts after a design slider, and their moves with a pose."""

from __future__ import annotations

import time
from collections.abc import Iterator

import numpy as np

from benchmarks.ready_page import ready_page, timed_changes
from benchmarks.table import Row, seconds
from benchmarks.timing import Spread
from explorer.app.features.prototype.feed import PartsFeed
from explorer.app.features.prototype.scene import PrototypeScene
from explorer.app.scene.placing import Placed
from explorer.app.server import Running
from explorer.app.state.actions import SetPosition, draw_as
from explorer.app.state.frame import Frame
from explorer.app.widgets.assigning import Assigner

CHANGES, MOVES, WARM_UP = 60, 300, 10


def run() -> Iterator[Row]:
    """Yield the rows."""
    with ready_page() as running:
        session = running.page.session
        session.do(draw_as("prototype"))
        running.page.wait_until_drawn()
        rebuilt, moved = timed_changes(running, CHANGES, WARM_UP), Spread.of(_moved(running))
    yield Row("design slider to the new parts of the prototype", _words(rebuilt), "300 ms")
    yield Row("move of all parts, computed and assigned", _words(moved), "1 ms")


def _moved(running: Running) -> list[float]:
    services, state = running.page.services, running.page.session.state
    scene, assigner = PrototypeScene(services), Assigner(running.viser)
    floor = services.get(PartsFeed).floor
    durations: list[float] = []
    for z in (9.0 + np.sin(np.arange(MOVES + WARM_UP) / 9.0)).tolist():
        state = SetPosition(2, z).apply(state)
        frame = Frame(state)
        # What other parts of the scene need too is not counted.
        _ = frame.snapshot
        began = time.perf_counter()
        assigner.assign(list(scene.updates(Placed(frame, floor=floor))))
        durations.append(time.perf_counter() - began)
    return durations[WARM_UP:]


def _words(spread: Spread) -> str:
    return f"{seconds(spread.p95)} p95 (p50 {seconds(spread.p50)})"
