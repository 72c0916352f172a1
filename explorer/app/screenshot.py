"""Pictures of the page or of the scene alone, taken by a headless browser.

The browser is a real one with a software renderer, so the pictures need no display and
no graphics card.
"""

from __future__ import annotations

import itertools
import time
from concurrent.futures import ThreadPoolExecutor
from pathlib import Path
from typing import TYPE_CHECKING

from explorer.files.writing import write_whole
from explorer.mechanism.design import Design
from explorer.mechanism.pose import Pose
from explorer.page.browser.headless import PictureError, headless_browser
from explorer.page.look import call_script, read_script

if TYPE_CHECKING:
    from playwright.sync_api import Browser, Page
    from viser import ClientHandle

    from explorer.app.scene.camera import ViewName
    from explorer.app.server import Running

# A software renderer on a busy machine takes seconds for a large picture.
PATIENCE_SECONDS = 60.0
# Selector of the canvas with the scene: charts have canvases too, but three.js marks its own.
SCENE_CANVAS = "canvas[data-engine]"
# Waits until a page has come to rest after a mark, see `look/clock.js`.
SETTLED = "mark => window.explorer?.settled?.(mark)"
# Has a page report its camera, and with it the size of the canvas.
REPORT_CAMERA = "() => window.__viserMutable.sendCamera?.()"
_marks = itertools.count(1)
# Relative difference of aspect ratios that count as equal; a panel that docks changes the shape
# of the canvas by far more.
SAME_SHAPE = 0.01
# Style that hides every element but the canvas and those around it.
SCENE_ALONE = (
    f"body *:not(:has({SCENE_CANVAS})):not({SCENE_CANVAS}) {{ visibility: hidden !important; }}"
)

# The script with the functions that pictures need, and the same with a call that holds the page:
# it then draws only frames that it is told to draw.
PICTURES = read_script("pictures")
HOLD = f"{PICTURES}{call_script('hold')}"
AWAIT_FRAMES = "(count) => window.explorer.awaitFrames(count)"


def take(
    design: Design,
    pose: Pose | None,
    *,
    view: ViewName,
    out: Path,
    size: tuple[int, int],
    panels: bool = False,
    handle: bool = False,
) -> None:
    """Write a picture of a design in a pose as a PNG file, whole or not at all.

    Args:
        design: The manipulator.
        pose: Pose of the platform; the home pose if None.
        view: Side from which to look.
        out: The file to write.
        size: Width and height in pixels.
        panels: Whether to show the page with its panels, rather than the scene alone.
        handle: Whether to show the handle by which the platform is dragged.

    Raises:
        MissingExtraError: Playwright or a Chromium is missing.
        PictureError: The browser did not start or did not draw in time.
        StorageError: The file cannot be written.
    """
    # The server starts while the browser does.
    with ThreadPoolExecutor(1) as executor:
        starting = executor.submit(_start, design, pose, panels=panels, handle=handle)
        try:
            with headless_browser() as browser:
                data = draw_page(browser, starting.result(), view=view, size=size, panels=panels)
        finally:
            if starting.exception() is None:
                starting.result().stop()
    write_whole(out, data)


def _start(design: Design, pose: Pose | None, *, panels: bool, handle: bool) -> Running:
    # What it imports takes longer than all else that happens before there is a browser.
    from explorer.app.server import start
    from explorer.app.state.view import View

    return start(design, pose, view=View(handle=handle), port=0, panels=panels)


def draw_page(
    browser: Browser,
    running: Running,
    *,
    view: ViewName,
    size: tuple[int, int],
    panels: bool,
    tab: str | None = None,
) -> bytes:
    """Return a picture of an explorer as `take` writes it, with a tab or a folder opened by title.

    Raises:
        PictureError: The browser did not draw in time.
    """
    page, client = open_page(browser, running, size, hold=True)
    try:
        if not panels:
            page.add_style_tag(content=SCENE_ALONE)
        if tab is not None:
            title = page.get_by_role("tab", name=tab, exact=True)
            title.or_(page.get_by_role("button", name=tab, exact=True)).first.click()
        # The size of the canvas, and with it the framing, is known only then.
        settle(page, client)
        running.page.point_cameras(view)
        settle(page, client)
        page.evaluate("window.explorer.drawFrame()")
        # Panels fade in; the scene alone is at rest.
        return stable_picture(page) if panels else page.screenshot()
    finally:
        page.close()


def open_page(
    browser: Browser, running: Running, size: tuple[int, int], *, hold: bool = False
) -> tuple[Page, ClientHandle]:
    """Open the explorer in a new tab and wait until it is connected.

    Args:
        browser: The browser.
        running: The explorer.
        size: Width and height of the tab in pixels.
        hold: Whether the tab draws only frames that it is told to draw.

    Raises:
        PictureError: It does not connect in time.
    """
    known = set(running.viser.get_clients())
    page = browser.new_page(viewport={"width": size[0], "height": size[1]})
    page.set_default_timeout(1000.0 * PATIENCE_SECONDS)
    page.add_init_script(HOLD if hold else PICTURES)
    page.goto(fixed_resolution_url(running))
    # viser warns of software rendering; no picture shows the warning.
    page.add_style_tag(content=".mantine-Notifications-root { display: none !important; }")
    deadline = time.monotonic() + PATIENCE_SECONDS
    while time.monotonic() < deadline:
        for number, client in running.viser.get_clients().items():
            if number not in known:
                return page, client
        page.wait_for_timeout(50)
    raise PictureError("the page did not connect to the explorer in time")


def fixed_resolution_url(running: Running) -> str:
    """Return the address of the page at a fixed resolution: viser lowers it on slow machines."""
    return f"{running.url}/?fixedDpr=1"


def settle(page: Page, client: ClientHandle) -> None:
    """Wait until a tab has drawn all that was sent to it, with its panels laid out.

    Raises:
        PictureError: It does not draw in time.
    """
    from explorer.page.browser.viser_gaps import mark_broadcasts, run_script_in

    deadline = time.monotonic() + PATIENCE_SECONDS
    mark = next(_marks)
    mark_broadcasts(client, mark)
    # What is sent to this browser alone takes a way of its own.
    run_script_in(client, f"(window.explorer ??= {{}}).ownMark = {mark};")
    _await_rest(page, SETTLED, mark)
    if not _is_size_known(page, client):
        page.evaluate(REPORT_CAMERA)
        while not _is_size_known(page, client):
            if time.monotonic() > deadline:
                raise PictureError("the size of the scene did not become known in time")
            page.wait_for_timeout(10)
    # A frame that has begun may show what was before, where any is drawn.
    page.evaluate("window.isReleased === false || window.explorer.awaitFrames(2)")


def _is_size_known(page: Page, client: ClientHandle) -> bool:
    """Whether the server knows the size of the canvas, which docked panels narrow.

    Aspect ratios are compared, since a busy browser draws fewer pixels than it shows.
    """
    box = page.locator(SCENE_CANVAS).bounding_box()
    if box is None:
        return False
    return abs(client.camera.aspect * box["height"] / box["width"] - 1.0) < SAME_SHAPE


def stable_picture(page: Page) -> bytes:
    """Return a PNG of a page that has settled, once what fades in or glides has arrived.

    Raises:
        PictureError: It keeps changing.
    """
    _await_rest(page, "window.explorer.isStill()")
    page.evaluate(AWAIT_FRAMES, 2)
    return page.screenshot()


def _await_rest(page: Page, condition: str, mark: int | None = None) -> None:
    """Wait until a condition of a page at rest holds, which is a function of a mark."""
    from playwright.sync_api import TimeoutError as BrowserTimeoutError

    try:
        page.wait_for_function(condition, arg=mark, timeout=1000.0 * PATIENCE_SECONDS)
    except BrowserTimeoutError:
        raise PictureError("the page did not come to rest in time") from None
