"""An explorer as the command has it once it is ready, for what is measured of its page."""

from __future__ import annotations

from explorer import PRESETS
from explorer.app.server import Running, start
from explorer.app.session.memory import keep_for_good
from explorer.mechanism.design import Design
from explorer.numerics.compiled import warm


def ready_page(design: Design = PRESETS["paper-optimal"]) -> Running:
    """Return a running explorer, its kernels compiled and the collector at rest."""
    running = start(design, port=0)
    warm()
    keep_for_good()
    return running
