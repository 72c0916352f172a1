"""The distance to the nearest singular pose, for the bar."""

from __future__ import annotations

from explorer.app.state.frame import Frame
from explorer.app.widgets.buttons import figure
from explorer.measures.blocks.singularity import LOOKS


def distance_figure(frame: Frame) -> str:
    """Return the distance to the nearest singular pose, and which margin is zero there."""
    verdict = frame.verdict
    unit_mm = frame.state.design.unit_mm
    hint = f"{verdict.title}: {verdict.reason(unit_mm)}."
    look = f"ex-{LOOKS[verdict.kind]}"
    words = verdict.brief(unit_mm)
    return figure("Singularity", "Nearest singular pose", words, hint=hint, look=look)
