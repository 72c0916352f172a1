"""Twenty tabs at once, each dragging a control of its own.

Clients in another process send the events and read all that comes back. An event is matched
with the first frame that was begun after it had arrived, and ends when that frame's place of
the platform arrives at the tab that sent it.
"""

from __future__ import annotations

import gc
import time
from bisect import bisect_left
from collections import defaultdict
from collections.abc import Callable, Generator, Iterator, Sequence
from contextlib import contextmanager
from dataclasses import dataclass, field
from typing import Any

import numpy as np
import psutil

from benchmarks.ready_page import ready_page
from benchmarks.socket_client import PLATFORM, Seen, SliderDrag, dragging_process, sweep
from benchmarks.table import Row, seconds
from benchmarks.timing import Spread
from explorer.app.features.mechanism.pose_panel import JOINT_LABELS
from explorer.app.inputs.control import Slider
from explorer.app.server import Running
from explorer.app.session.session import Session
from explorer.app.state.state import State
from explorer.mechanism.design import JOINTS, VARIABLES
from explorer.mechanism.pose import Triple

TABS, RATE, SECONDS = 20, 10.0, 30.0
ANGLES = ("yaw (°)", "pitch (°)", "roll (°)")


@dataclass
class Log:
    """What the session did, by the clock that all processes share.

    Attributes:
        posted: When events arrived, by the label of their control.
        began: When each frame was begun.
        shown: The place of the platform in each frame.
        last: The stamps of the last event posted and of the last one done, by label.
    """

    posted: dict[str, list[float]] = field(default_factory=lambda: defaultdict(list))
    began: list[float] = field(default_factory=list[float])
    shown: list[Triple] = field(default_factory=list[Triple])
    last: dict[str, list[float]] = field(default_factory=lambda: defaultdict(lambda: [0.0, 0.0]))


def run() -> Iterator[Row]:
    """Yield the rows.

    Raises:
        RuntimeError: an event was lost.
    """
    process = psutil.Process()
    with ready_page() as running, dragging_process(RATE) as drag:
        drags = drags_of(running.page.session.state)
        # What is needed by one is not counted for twenty.
        drag(running.url, [SliderDrag("x", drags[0].values[:20])])
        before, sampled = memory(process), list[int]()
        with (
            logged(running) as log,
            sampling(lambda: sampled.append(process.memory_info().rss)),
        ):
            seen = drag(running.url, drags)
        after = max(sampled)
    check_last(log)
    delays = np.concatenate([delays_of(log, d, s) for d, s in zip(drags, seen, strict=True)])
    spread = Spread.of(delays.tolist())
    count = sum(len(each.events) for each in seen)
    yield Row(
        f"{TABS} tabs, each dragging at {RATE:.0f} events/s for {SECONDS:.0f} s: from event to "
        "scene message, p95",
        f"{seconds(spread.p95)} (p50 {seconds(spread.p50)}, max {seconds(spread.longest)})",
        "100 ms",
    )
    yield Row(
        f"  events that had no effect at the end, of {count}",
        f"0; {len(log.began):,} frames, {len(log.began) / SECONDS:.0f}/s",
        "none",
    )
    yield Row(
        "  memory of the server for each tab, at its most",
        f"{(after - before) / TABS / 1e6:.2f} MB",
        "10 MB",
    )


def drags_of(state: State) -> list[SliderDrag]:
    """Return twenty drags of sliders; two sliders are dragged by two tabs."""
    count = int(RATE * SECONDS)
    drags = [
        SliderDrag(label, sweep(value, 2.0, count))
        for label, value in zip("xyz", state.pose.position, strict=True)
    ]
    for label, value in zip(ANGLES, state.yaw_pitch_roll, strict=True):
        drags.append(SliderDrag(label, sweep(value, 5.0, count)))
    for name, value in zip(JOINTS, state.joints, strict=True):
        drags.append(SliderDrag(JOINT_LABELS[name], sweep(value, 0.5, count)))
    for name, value in zip(VARIABLES, state.design.variables, strict=True):
        drags.append(SliderDrag(name, sweep(value, 0.3, count)))
    return [*drags, *drags[: TABS - len(drags)]]


@contextmanager
def logged(running: Running) -> Generator[Log]:
    """Log what the session of an explorer does."""
    log = Log()
    session: Any = running.page.session
    scene: Any = running.viser.scene
    platform = scene._handle_from_node_name[PLATFORM]
    post, handle = Session.post, Session._handle  # pyright: ignore[reportPrivateUsage]

    def posting(self: Any, key: object, change: Any, *, stamp: Any = None, who: Any = None) -> None:
        if isinstance(key, Slider):
            label = key.handle.label
            log.posted[label].append(time.monotonic())
            log.last[label][0] = max(stamp, log.last[label][0])
        post(self, key, change, stamp=stamp, who=who)

    def handling(self: Any, items: Sequence[Any]) -> None:
        log.began.append(time.monotonic())
        handle(self, items)
        x, y, z = np.asarray(platform.position).tolist()
        log.shown.append((x, y, z))
        for item in items:
            if isinstance(item.key, Slider):
                log.last[item.key.handle.label][1] = item.stamp

    session.post = posting.__get__(session)
    session._jobs._handle = handling.__get__(session)
    try:
        yield log
    finally:
        del session.post
        session._jobs._handle = session._handle


@contextmanager
def sampling(sample: Callable[[], None]) -> Generator[None]:
    """Take samples all the while, ten a second."""
    import threading

    done = threading.Event()

    def take() -> None:
        while not done.wait(0.1):
            sample()

    thread = threading.Thread(target=take)
    thread.start()
    try:
        yield
    finally:
        done.set()
        thread.join()


def delays_of(log: Log, drag: SliderDrag, seen: Seen) -> np.ndarray[Any, np.dtype[np.float64]]:
    """Return from each event of a tab how long it took until the tab was told of its effect."""
    posted = log.posted[drag.label]
    delays: list[float] = []
    for event in seen.events:
        # The arrival at the session of this event, or of the other hand's just after it.
        arrival = posted[min(bisect_left(posted, event), len(posted) - 1)]
        frame = bisect_left(log.began, arrival)
        # Frames that leave the platform where it is send nothing of it.
        while frame < len(log.shown) and seen.arrivals.get(log.shown[frame], 0.0) < event:
            frame += 1
        if frame < len(log.shown):
            delays.append(seen.arrivals[log.shown[frame]] - event)
    return np.array(delays)


def check_last(log: Log) -> None:
    """Check that the last event of every control was done.

    Raises:
        RuntimeError: one was not.
    """
    for label, (posted, done) in log.last.items():
        if done < posted:
            raise RuntimeError(f"the last event of {label} was lost")


def memory(process: psutil.Process) -> int:
    """Return the resident memory of a process, in bytes, with nothing left to collect."""
    gc.collect()
    return process.memory_info().rss
