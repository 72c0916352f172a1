"""What one frame of the scene costs in the software renderer, beside viser's smallest page.

Both canvases have the same size. Frames are those that the page shows, one after the other, as
while something moves; the two pages take turns, and the other one draws nothing meanwhile.
"""

from __future__ import annotations

import statistics
from collections.abc import Generator, Iterator
from contextlib import contextmanager
from typing import TYPE_CHECKING

import viser

from benchmarks.ready_page import ready_page
from benchmarks.table import Row, seconds
from explorer.app.browser.chromium import find_chromium
from explorer.app.browser.headless import headless_browser
from explorer.app.screenshot import SCENE_CANVAS, open_page, settle

if TYPE_CHECKING:
    from playwright.sync_api import Browser, Page

RUNS = 5
SIZE = (1280, 800)
TARGET = 1.6
TITLE = f"frame of {SIZE[0]} × {SIZE[1]} in the software renderer over viser's hello-world"
# Frames of one run, after one that may have waited for the last of the other page.
FRAMES = 4
# three.js hands its renderer to a scene that is drawn; from then on it draws only on demand.
HOLD_RENDERER = """() => new Promise((resolve) => {
    const { scene, requestRender } = window.__viserMutable;
    scene.onBeforeRender = (renderer) => {
        scene.onBeforeRender = () => {};
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


def run() -> Iterator[Row]:
    """Yield the row."""
    if find_chromium() is None:
        yield Row(TITLE, "not measured: no Chromium", f"{TARGET}")
        return
    with headless_browser() as browser, hello_page(browser) as hello, _own_page(browser) as own:
        pages = (hello, own)
        for page in pages:
            assert page.evaluate(CANVAS_SIZE) == list(SIZE)
            page.evaluate(HOLD_RENDERER)
        runs = [[float(page.evaluate(TIME_FRAMES, FRAMES)) for page in pages] for _ in range(RUNS)]
    base, ours = (statistics.median(column) for column in zip(*runs, strict=True))
    yield Row(
        f"{TITLE}, medians of {RUNS}",
        f"{ours / base:.2f}: {seconds(ours)}",
        f"{TARGET}",
        f"hello-world: {seconds(base)}",
    )


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
        running.page.wait_until_drawn()
        page, client = open_page(browser, running, SIZE)
        settle(page, client)
        running.page.point_cameras("isometric")
        settle(page, client)
        yield page
        page.close()
