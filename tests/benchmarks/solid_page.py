"""From a change of a design slider to the updated solid, sent to a browser."""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import replace

from benchmarks.ready_page import ready_page, timed_changes
from benchmarks.table import Row, seconds
from explorer.app.state.actions import Set

CHANGES, WARM_UP, PAUSE = 120, 15, 0.02


def run() -> Iterator[Row]:
    """Yield the row."""
    with ready_page() as running:
        session = running.page.session
        workspace = replace(session.state.view.workspace, solid=True)
        session.do(Set("view", replace(session.state.view, workspace=workspace)))
        running.page.wait_until_drawn()
        spread = timed_changes(running, CHANGES, WARM_UP, PAUSE)
    yield Row(
        "design slider to the updated solid, to its last message, p95",
        f"{seconds(spread.p95)} (p50 {seconds(spread.p50)}, max {seconds(spread.longest)})",
        "150 ms",
    )
