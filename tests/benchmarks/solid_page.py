"""From a change of a design slider to the updated solid, sent to a browser."""

from __future__ import annotations

import time
from collections.abc import Iterator
from dataclasses import replace

import numpy as np

from benchmarks.ready_page import ready_page
from benchmarks.samples import DESIGN
from benchmarks.table import Row, seconds
from benchmarks.timing import Spread
from explorer.app.state.actions import SetVariable, SetView
from explorer.app.state.state import State

CHANGES, WARM_UP = 120, 15


def run() -> Iterator[Row]:
    """Yield the rows."""
    running = ready_page(DESIGN)
    page = running.page
    try:
        session = page.session
        workspace = replace(session.state.view.workspace, solid=True)
        session.do(SetView(replace(session.state.view, workspace=workspace)))
        page.wait_until_drawn()
        durations: list[float] = []
        values = 19.0 + 0.5 * np.sin(np.arange(CHANGES + WARM_UP) / 9.0)
        for value in values.tolist():

            def change(_: State, value: float = value) -> SetVariable:
                return SetVariable("a3x", value)

            began = time.perf_counter()
            session.post("a3x", change)
            page.wait_until_drawn()
            durations.append(time.perf_counter() - began)
            time.sleep(0.02)
    finally:
        running.stop()
    spread = Spread.of(durations[WARM_UP:])
    yield Row(
        "design slider to the updated solid, to its last message, p95",
        f"{seconds(spread.p95)} (p50 {seconds(spread.p50)}, max {seconds(spread.longest)})",
        "150 ms",
    )
