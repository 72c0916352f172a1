"""The page in a browser with a software renderer, beside viser's smallest page.

Frames are those that the page shows, one after the other, as while something moves; the two
pages take turns, and the other one draws nothing meanwhile. A page is ready once it has applied
every message that was sent before it connected, shows its scene, and has drawn the next frame:
viser hides a scene until its environment map is loaded.
"""

from __future__ import annotations

import itertools
import statistics
import time
from collections.abc import Generator, Iterator
from contextlib import contextmanager

import viser
from playwright.sync_api import Browser, Page
from server_clock import wait_until_drawn

from benchmarks.table import Row, seconds
from explorer import PRESETS
from explorer.app.screenshot import (
    AWAIT_FRAMES,
    PATIENCE_SECONDS,
    PICTURES,
    SCENE_CANVAS,
    open_page,
    settle,
)
from explorer.app.server import Running, start
from explorer.numerics.compiled import warm
from explorer.page.browser.headless import find_chromium, headless_browser
from explorer.page.browser.viser_gaps import mark_broadcasts

RUNS = 5
SIZE = (1280, 800)
# Frames of one run, after one that may have waited for the last of the other page.
FRAMES = 4
SHORT = {"RUNS": 1}
# three.js hands its renderer to a scene that is drawn; from then on it draws only on demand.
HOLD_RENDERER = """() => new Promise((resolve) => {
    const { scene, requestRender } = window.__viserMutable;
    const before = scene.onBeforeRender;
    scene.onBeforeRender = (renderer, ...others) => {
        scene.onBeforeRender = before;
        before(renderer, ...others);
        const render = renderer.render.bind(renderer);
        renderer.render = (...parts) => window.isDrawing && render(...parts);
        resolve();
    };
    requestRender();
})"""
TIME_FRAMES = """(frames) => new Promise((resolve) => {
    window.isDrawing = true;
    let [count, start] = [0, 0];
    const next = () => {
        window.__viserMutable.requestRender();
        if (count === 1) start = performance.now();
        if (count <= frames) {
            count += 1;
            requestAnimationFrame(next);
        } else {
            window.isDrawing = false;
            resolve((performance.now() - start) / 1000 / frames);
        }
    };
    requestAnimationFrame(next);
})"""
CANVAS_SIZE = f"""() => {{
    const canvas = document.querySelector("{SCENE_CANVAS}");
    return [canvas.width, canvas.height];
}}"""
IS_COMPLETE = f"""(mark) => window.explorer?.mark >= mark
    && getComputedStyle(document.querySelector("{SCENE_CANVAS}")).opacity === "1"
"""
REST_MILLISECONDS = 2000
_marks = itertools.count(1)


def run() -> Iterator[Row]:
    """Yield a row of a frame and one of a page that opens."""
    if find_chromium() is None:
        yield Row("the page", "not measured: no Chromium")
        return
    with headless_browser() as browser:
        yield _row("frame", "1.6", _frames(browser))
        yield _row("page ready", "1.4", _openings(browser))


def _row(what: str, target: str, runs: list[list[float]]) -> Row:
    """Return the row of times of viser's page and of ours, shape (runs, 2)."""
    base, ours = (statistics.median(column) for column in zip(*runs, strict=True))
    return Row(
        f"{what}, {SIZE[0]} × {SIZE[1]}, software renderer, over viser's, medians of {RUNS}",
        f"{ours / base:.2f}: {seconds(ours)}",
        target,
        f"hello-world: {seconds(base)}",
    )


def _frames(browser: Browser) -> list[list[float]]:
    with hello_page(browser) as hello, _own_page(browser) as own:
        pages = (hello, own)
        for page in pages:
            assert page.evaluate(CANVAS_SIZE) == list(SIZE)
            page.evaluate(HOLD_RENDERER)
        return [[float(page.evaluate(TIME_FRAMES, FRAMES)) for page in pages] for _ in range(RUNS)]


def _openings(browser: Browser) -> list[list[float]]:
    with hello_server() as hello, ready_page() as running:
        wait_until_drawn(running.page)
        servers = (hello, running.viser)
        # The first page of each compiles what the browser keeps.
        for server in servers:
            _ready(browser, server)
        return [[_ready(browser, server) for server in servers] for _ in range(RUNS)]


@contextmanager
def ready_page(*, panels: bool = True) -> Generator[Running]:
    """Run an explorer meanwhile, its kernels compiled."""
    running = start(PRESETS["paper-optimal"], port=0, panels=panels)
    warm()
    try:
        yield running
    finally:
        running.stop()


@contextmanager
def hello_server() -> Generator[viser.ViserServer]:
    """Serve viser's hello-world: one sphere."""
    server = viser.ViserServer(host="127.0.0.1", port=0, verbose=False)
    server.scene.add_icosphere(
        "/hello_sphere", radius=0.5, color=(255, 0, 0), position=(0.0, 0.0, 0.0)
    )
    try:
        yield server
    finally:
        server.stop()


@contextmanager
def hello_page(browser: Browser) -> Generator[Page]:
    """Open viser's hello-world, drawn to the end."""
    with hello_server() as server:
        page = browser.new_page(viewport={"width": SIZE[0], "height": SIZE[1]})
        page.goto(f"http://127.0.0.1:{server.get_port()}/?fixedDpr=1")
        page.wait_for_function("window.__viserMutable?.nodeRefFromName['/hello_sphere']")
        # The environment map is loaded after the scene, and fades in.
        page.wait_for_function("window.__viserMutable.scene.environment !== null")
        page.wait_for_timeout(2000)
        yield page
        page.close()


@contextmanager
def _own_page(browser: Browser) -> Generator[Page]:
    with ready_page(panels=False) as running:
        wait_until_drawn(running.page)
        page, client = open_page(browser, running, SIZE)
        settle(page, client)
        running.page.point_cameras("isometric")
        settle(page, client)
        yield page
        page.close()


def _ready(browser: Browser, server: viser.ViserServer) -> float:
    """Return the seconds until a new page of a server is ready."""
    known = set(server.get_clients())
    page = browser.new_page(viewport={"width": SIZE[0], "height": SIZE[1]})
    page.set_default_timeout(1000.0 * PATIENCE_SECONDS)
    page.add_init_script(PICTURES)
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
