"""From the address to a page that has drawn all, beside viser's smallest page.

A page is ready once it has applied every message that was sent before it connected, shows its
scene, and has drawn the next frame: viser hides a scene until its environment map is loaded. The
two pages are opened in turn, in one browser with a software renderer.
"""

from __future__ import annotations

import itertools
import statistics
import time
from collections.abc import Iterator
from typing import TYPE_CHECKING

import viser

from benchmarks.frame_cost import hello_server
from benchmarks.ready_page import ready_page
from benchmarks.table import Row, seconds
from explorer.app.browser.chromium import find_chromium
from explorer.app.browser.headless import headless_browser
from explorer.app.browser.viser_gaps import mark_broadcasts
from explorer.app.screenshot import AWAIT_FRAMES, PATIENCE_SECONDS, SCENE_CANVAS

if TYPE_CHECKING:
    from playwright.sync_api import Browser

RUNS = 5
SIZE = (1280, 800)
TARGET = 1.4
TITLE = f"page of {SIZE[0]} × {SIZE[1]} ready, software renderer, over viser's hello-world"
IS_COMPLETE = f"""(mark) => window.explorer?.mark >= mark
    && getComputedStyle(document.querySelector("{SCENE_CANVAS}")).opacity === "1"
"""
REST_MILLISECONDS = 2000
_marks = itertools.count(1)


def run() -> Iterator[Row]:
    """Yield the row."""
    if find_chromium() is None:
        yield Row(TITLE, "not measured: no Chromium", f"{TARGET}")
        return
    with headless_browser() as browser, hello_server() as hello, ready_page() as running:
        running.page.wait_until_drawn()
        servers = (hello, running.viser)
        # The first page of each compiles what the browser keeps.
        for server in servers:
            _ready(browser, server)
        times = [[_ready(browser, server) for server in servers] for _ in range(RUNS)]
    base, ours = (statistics.median(column) for column in zip(*times, strict=True))
    yield Row(
        f"{TITLE}, medians of {RUNS}",
        f"{ours / base:.2f}: {seconds(ours)}",
        f"{TARGET}",
        f"hello-world: {seconds(base)}",
    )


def _ready(browser: Browser, server: viser.ViserServer) -> float:
    """Return the seconds until a new page of a server is ready."""
    known = set(server.get_clients())
    page = browser.new_page(viewport={"width": SIZE[0], "height": SIZE[1]})
    page.set_default_timeout(1000.0 * PATIENCE_SECONDS)
    start = time.perf_counter()
    page.goto(f"http://127.0.0.1:{server.get_port()}/?fixedDpr=1")
    while not (new := set(server.get_clients()) - known):
        page.wait_for_timeout(5)
    mark = next(_marks)
    mark_broadcasts(server.get_clients()[new.pop()], mark)
    page.wait_for_function(IS_COMPLETE, arg=mark)
    page.evaluate(AWAIT_FRAMES, 1)
    duration = time.perf_counter() - start
    # What the renderer has not done yet would be done while the other page opens.
    page.wait_for_timeout(REST_MILLISECONDS)
    page.evaluate(AWAIT_FRAMES, 2)
    page.close()
    return duration
