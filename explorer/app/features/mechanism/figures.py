"""Whether the pose keeps the limits, for the bar."""

from __future__ import annotations

from explorer.app.state.frame import Frame
from explorer.app.widgets.buttons import figure


def limits_figure(frame: Frame) -> str:
    """Return how many limits the pose breaks, as HTML."""
    broken = [str(each) for each in frame.snapshot.violations]
    if broken:
        hint = f"Outside the limits: {'; '.join(broken)}."
        return figure("Design", "Limits", f"{len(broken)} broken", hint=hint, look="ex-beyond")
    if frame.snapshot.is_singular:
        hint = "The pose keeps all limits of the design, but it is singular."
        return figure("Design", "Limits", "kept, but singular", hint=hint)
    hint = "The pose keeps all limits of the design."
    return figure("Design", "Limits", "kept", hint=hint, look="ex-within")
