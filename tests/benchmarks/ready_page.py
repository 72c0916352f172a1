"""An explorer that is ready, and changes of its design that are timed to the end of the drawing."""

from __future__ import annotations

import time
from collections.abc import Generator
from contextlib import contextmanager

import numpy as np

from benchmarks.timing import Spread
from explorer import PRESETS
from explorer.app.server import Running, start
from explorer.app.session.memory import freeze_objects
from explorer.app.state.actions import SetVariable
from explorer.numerics.compiled import warm


@contextmanager
def ready_page(*, panels: bool = True) -> Generator[Running]:
    """Run an explorer meanwhile, its kernels compiled and the collector at rest."""
    running = start(PRESETS["paper-optimal"], port=0, panels=panels)
    warm()
    freeze_objects()
    try:
        yield running
    finally:
        running.stop()


def timed_changes(running: Running, count: int, warm_up: int, pause: float = 0.0) -> Spread:
    """Return the durations of changes of a3x, from the slider to the last message.

    Args:
        running: The explorer.
        count: Number of changes that count.
        warm_up: Number of changes before them.
        pause: Time between changes, in seconds.
    """
    session, durations = running.page.session, list[float]()
    for value in (19.0 + 0.5 * np.sin(np.arange(count + warm_up) / 9.0)).tolist():
        began = time.perf_counter()
        session.post("a3x", lambda _, value=value: SetVariable("a3x", value))
        running.page.wait_until_drawn()
        durations.append(time.perf_counter() - began)
        time.sleep(pause)
    return Spread.of(durations[warm_up:])
