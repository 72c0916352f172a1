"""Two long drags at once, each with the mouse in a tab of its own of a real browser.

The lag is the time from the last move of the mouse until the number fields of both
sliders in both tabs, and the server, show the same values and stay so. The browser draws
with a software renderer, so the two tabs compete with the server for the processor.
"""

from __future__ import annotations

import asyncio
import time
from collections.abc import AsyncGenerator, Iterator
from contextlib import asynccontextmanager
from dataclasses import dataclass
from typing import TYPE_CHECKING

from benchmarks.ready_page import ready_page
from benchmarks.socket_client import EVENTS_PER_SECOND, sweep
from benchmarks.table import Row, seconds
from explorer.app.browser.chromium import find_chromium
from explorer.app.browser.headless import CHROMIUM_FLAGS, SWIFTSHADER
from explorer.app.server import Running

if TYPE_CHECKING:
    from playwright.async_api import Browser, Page

SECONDS = 20.0
SIZE = (640, 400)
# The sliders of the Move panel that are dragged, one in each tab, and how far.
LABELS = ("x", "z")
REACH_PIXELS = 14.0
QUIET_SECONDS = 1.5
PATIENCE_SECONDS = 60.0
# Fields show two decimals.
SHOWN = 0.005 + 1e-9

TITLE = (
    f"{EVENTS_PER_SECOND:.0f}-move/s drags for {SECONDS:.0f} s in two browser tabs of "
    f"{SIZE[0]} × {SIZE[1]}, software renderer, lag at the end"
)
FIND_SLIDER = """
const sliderOf = (label) => {
    const found = [...document.querySelectorAll("label")].find((e) => e.textContent === label);
    return found && document.getElementById(found.htmlFor);
};
"""
READ_FIELDS = f"""(labels) => {{
    {FIND_SLIDER}
    return labels.map((label) => {{
        const slider = sliderOf(label);
        return slider ? Number(slider.parentElement.querySelector("input[type=text]").value) : null;
    }});
}}"""
FIND_THUMB = f"""(label) => {{
    {FIND_SLIDER}
    const box = sliderOf(label).querySelector("[role=slider]").getBoundingClientRect();
    return [box.x + box.width / 2, box.y + box.height / 2];
}}"""

# The page compiles its shaders for seconds; from so many frames in a second on it is done.
SMOOTH = 20
COUNT_FRAMES = """() => new Promise((resolve) => {
    const start = performance.now();
    let frames = 0;
    const next = () => {
        frames += 1;
        if (performance.now() - start > 1000) resolve(frames);
        else requestAnimationFrame(next);
    };
    requestAnimationFrame(next);
})"""


@dataclass(frozen=True)
class Drags:
    """What came of the drags.

    Attributes:
        lag: From the last move to the last change of what is shown, in seconds.
        server_lag: From the last move to the last change of the server's state.
        rate: Moves per second that the slower tab took.
    """

    lag: float
    server_lag: float
    rate: float


def run() -> Iterator[Row]:
    """Yield the row."""
    chromium = find_chromium()
    if chromium is None:
        yield Row(TITLE, "not measured: no Chromium", "150 ms")
        return
    with ready_page() as running:
        drags = asyncio.run(_drags(running, chromium))
    yield Row(
        TITLE,
        f"{seconds(drags.lag)}, of which to the server {seconds(drags.server_lag)}; "
        f"{drags.rate:.0f} moves/s taken",
        "150 ms",
    )


async def _drags(running: Running, chromium: str) -> Drags:
    async with _browser(chromium) as browser:
        tabs = [await _open(browser, running) for _ in LABELS]
        start = time.monotonic() + 0.5
        watch = asyncio.create_task(_watch(running))
        ends = await asyncio.gather(
            *(_drag(tab, label, start) for tab, label in zip(tabs, LABELS, strict=True))
        )
        settled = await _settled(running, tabs)
        last = max(sent for sent, _ in ends)
        taken = max(taken for _, taken in ends)
        return Drags(
            lag=settled - last,
            server_lag=max(0.0, await watch - last),
            rate=SECONDS * EVENTS_PER_SECOND / (taken - start),
        )


@asynccontextmanager
async def _browser(chromium: str) -> AsyncGenerator[Browser]:
    from playwright.async_api import async_playwright

    async with async_playwright() as playwright:
        browser = await playwright.chromium.launch(
            executable_path=chromium, args=[*CHROMIUM_FLAGS, *SWIFTSHADER]
        )
        try:
            yield browser
        finally:
            await browser.close()


async def _open(browser: Browser, running: Running) -> Page:
    page = await browser.new_page(viewport={"width": SIZE[0], "height": SIZE[1]})
    await page.goto(running.url)
    deadline = time.monotonic() + PATIENCE_SECONDS
    while (
        None in await page.evaluate(READ_FIELDS, LABELS)
        or await page.evaluate(COUNT_FRAMES) < SMOOTH
    ):
        if time.monotonic() > deadline:
            raise RuntimeError("the page does not come to rest")
    return page


async def _drag(page: Page, label: str, start: float) -> tuple[float, float]:
    """Drag a slider; return when the last move was sent and when it was taken."""
    x, y = await page.evaluate(FIND_THUMB, label)
    await page.mouse.move(x, y)
    await page.mouse.down()
    moves: list[asyncio.Task[None]] = []
    sent = start
    for count, at in enumerate(sweep(x, REACH_PIXELS, int(SECONDS * EVENTS_PER_SECOND))):
        await asyncio.sleep(start + count / EVENTS_PER_SECOND - time.monotonic())
        # A hand does not wait for the page either.
        sent = time.monotonic()
        moves.append(asyncio.create_task(page.mouse.move(at, y)))
    await asyncio.gather(*moves)
    return sent, time.monotonic()


async def _watch(running: Running) -> float:
    """Return when the server's state changed last, once it is at rest after the drags."""
    pose = running.page.session.state.pose
    since = time.monotonic()
    ends = since + SECONDS
    while time.monotonic() < max(ends, since) + QUIET_SECONDS:
        if running.page.session.state.pose != pose:
            pose, since = running.page.session.state.pose, time.monotonic()
        await asyncio.sleep(0.003)
    return since


async def _settled(running: Running, tabs: list[Page]) -> float:
    """Return when all began to show the same values, which stayed."""
    shown: list[list[float]] = []
    since = time.monotonic()
    deadline = since + PATIENCE_SECONDS
    while time.monotonic() < deadline:
        fields = await asyncio.gather(*(tab.evaluate(READ_FIELDS, LABELS) for tab in tabs))
        now = time.monotonic()
        x, _, z = running.page.session.state.pose.position
        if [*fields, [x, z]] != shown:
            shown, since = [*fields, [x, z]], now
        elif now - since > QUIET_SECONDS:
            if all(abs(a - x) < SHOWN and abs(b - z) < SHOWN for a, b in fields):
                return since
            raise RuntimeError(f"at rest, the tabs and the server show {shown}")
    raise RuntimeError("the tabs keep changing")
