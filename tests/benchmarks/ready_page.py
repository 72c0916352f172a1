"""An explorer that is ready: its kernels compiled, its collector at rest."""

from __future__ import annotations

from collections.abc import Generator
from contextlib import contextmanager

from explorer import PRESETS
from explorer.app.server import Running, start
from explorer.app.session.memory import freeze_objects
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
