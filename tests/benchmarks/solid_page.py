"""From a change of a design slider to the updated solid, sent to a browser."""

from __future__ import annotations

import time
from collections.abc import Iterator
from dataclasses import replace

import numpy as np

from benchmarks.ready_page import ready_page
from benchmarks.table import Row, seconds
from benchmarks.timing import Spread
from explorer.app.features.workspace.feed import WorkspaceFeed
from explorer.app.server import Running
from explorer.app.state.actions import Set, SetVariable

CHANGES, WARM_UP, PAUSE = 120, 15, 0.02


def run() -> Iterator[Row]:
    """Yield the rows."""
    with ready_page() as running:
        session = running.page.session
        for shows_strata in (False, True):
            view = session.state.view
            workspace = replace(view.workspace, solid=True)
            singular = replace(view.singular, strata=shows_strata)
            session.do(Set("view", replace(view, workspace=workspace, singular=singular)))
            running.page.wait_until_drawn()
            beside = ", the diagram of strata open" if shows_strata else ""
            spread = _changes(running)
            yield Row(
                f"design slider to the updated solid, to its last message, p50{beside}",
                f"{seconds(spread.p50)} (p95 {seconds(spread.p95)}, max {seconds(spread.longest)})",
                "60 ms",
            )


def _changes(running: Running) -> Spread:
    """Return the durations of changes of a3x, from the slider to the last message of the solid."""
    session, feed = running.page.session, running.page.services.get(WorkspaceFeed)
    durations: list[float] = []
    for value in (19.0 + 0.5 * np.sin(np.arange(CHANGES + WARM_UP) / 9.0)).tolist():
        began = time.perf_counter()
        session.post("a3x", lambda _, value=value: SetVariable("a3x", value))
        while feed.surface is None or feed.surface.request.design.a3[0] != value:
            time.sleep(5e-4)
        session.wait_until_idle()
        durations.append(time.perf_counter() - began)
        running.page.wait_until_drawn()
        time.sleep(PAUSE)
    return Spread.of(durations[WARM_UP:])
