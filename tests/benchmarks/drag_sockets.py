"""Two long drags at once, each in a client of its own, seen by the other client.

The lag is the time from the last event to the last message about the scene; the scene
must then show the last value of both. A queue that grows would show as a long lag.
"""

from __future__ import annotations

from collections.abc import Iterator

from benchmarks.ready_page import ready_page
from benchmarks.socket_client import EVENTS_PER_SECOND, SliderDrag, dragging_process, sweep
from benchmarks.table import Row, seconds
from explorer.app.scene.placing import scene_scale

SECONDS = 20.0


def run() -> Iterator[Row]:
    """Yield the row.

    Raises:
        RuntimeError: a client does not see the last value of the other.
    """
    with ready_page() as running, dragging_process() as drag:
        state = running.page.session.state
        scale = scene_scale(state)
        count = int(SECONDS * EVENTS_PER_SECOND)
        x = SliderDrag("x", sweep(state.pose.position[0], 2.0, count))
        b1x = SliderDrag("b1x", sweep(state.design.b1[0], 1.0, count))
        first, second = drag(running.url, [x, b1x])
    for shown, sent in (
        (second.positions["/platform"][0], x.values[-1]),
        (first.positions["/platform/label/b1"][0], b1x.values[-1]),
    ):
        if abs(shown - scale * sent) > 1e-6:
            raise RuntimeError(f"a client shows {shown / scale:g} at the end of a drag to {sent:g}")
    lag = max(second.drawn - first.sent, first.drawn - second.sent)
    yield Row(
        f"{EVENTS_PER_SECOND:.0f}-event/s drags for {SECONDS:.0f} s in two websocket clients, "
        "lag at the end",
        seconds(lag),
        "150 ms",
    )
