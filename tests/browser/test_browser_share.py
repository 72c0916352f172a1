"""Pictures and pages out of a real browser, and the page in a notebook."""

from __future__ import annotations

import http.server
import threading
import time
import zipfile
from collections.abc import Callable, Generator
from contextlib import contextmanager
from pathlib import Path
from typing import Any, Literal
from xml.etree.ElementTree import fromstring

import imageio.v3
import numpy as np
import pytest
from likeness import blocks, decoded, likeness
from numpy.typing import NDArray
from playwright.sync_api import Browser, Download, Locator, Page, expect
from tab import Tab

import explorer
from explorer.app.features.sharing.links import Link, encode_link
from explorer.app.scene.placing import scene_scale
from explorer.app.screenshot import PATIENCE_SECONDS, SCENE_CANVAS
from explorer.app.state.actions import Set, open_design
from explorer.app.state.frame import Frame
from explorer.app.state.view import View
from explorer.export.controller import kernel_files
from explorer.export.linuxcnc import linuxcnc_files
from explorer.export.moving_page import moving_page
from explorer.mechanism.pose import Triple
from explorer.numerics.arrays import FloatArray, triple

untyped: Any = imageio.v3

# In milliseconds.
PATIENCE = 1000 * PATIENCE_SECONDS

# A difference of two pictures that the eye cannot miss.
PLAIN_TO_SEE = 5.0
# What a page of the scene asks for: itself, and what is inside it.
INSIDE = ("file:", "blob:", "data:")


def as_html(shown: Any) -> str:
    """Return what a notebook displays."""
    return shown._repr_html_()


def wait_until_drawn(page: Page, canvas: Locator, is_drawn: Callable[[FloatArray], bool]) -> None:
    """Wait until the picture of a scene is as a condition says."""
    deadline = time.monotonic() + PATIENCE_SECONDS
    while not is_drawn(decoded(canvas.screenshot())):
        assert time.monotonic() < deadline, "the scene is not drawn"
        page.wait_for_timeout(50)


def pixels_of(download: Download) -> NDArray[np.uint8]:
    return untyped.imread(download.path().read_bytes(), extension=".png")


def reds(pixels: NDArray[Any]) -> int:
    """Return how many pixels are as red as nothing but the handle is, and the axes in a corner."""
    pixels = pixels[: pixels.shape[0] * 3 // 4]
    red, green, blue = (pixels[..., i] for i in range(3))
    return int(((red > 200) & (green < 60) & (blue < 160)).sum())


def test_picture_has_the_size_and_background_that_are_asked_for_and_no_handle(tab: Tab) -> None:
    height, width = (2 * side for side in decoded(tab.picture()).shape[:2])
    with tab.drawing():
        opaque = pixels_of(tab.export("Picture", "PNG twice as shown"))
        clear = pixels_of(tab.export("Picture", "PNG transparent"))
    assert opaque.shape == (height, width, 3)
    assert (opaque[0, 0] > 240).all()
    assert clear.shape == (height, width, 4)
    assert clear[..., 3].min() == 0
    assert clear[..., 3].max() == 255
    # On white, the one is the other.
    share = clear[..., 3:] / 255.0
    assert np.abs(clear[..., :3] * share + 255.0 * (1.0 - share) - opaque).mean() < 0.5
    # The handle that is on the page, and red, is in no picture.
    assert tab.state.view.handle
    with tab.drawing():
        with_handle = tab.client.get_render(
            240, 320, transport_format="png", timeout=PATIENCE_SECONDS
        )
    assert reds(with_handle) > 0
    assert reds(opaque) == 0
    # A picture twice as large as the scene shows the same.
    tab.page.keyboard.press("Escape")
    # A margin under the pointer would be drawn in bold.
    tab.page.mouse.move(0, 0)
    tab.close_notices()
    tab.running.page.session.do(Set("view", View(handle=False)))
    shown = decoded(tab.picture())
    with tab.drawing():
        taken = pixels_of(tab.export("Picture", "PNG twice as shown")) / 255.0
    height, width = shown.shape[:2]
    assert taken.shape == (2 * height, 2 * width, 3)
    # The buttons of the views lie over the scene.
    found = likeness(shown[height // 4 :], blocks(taken, 2)[height // 4 :])
    assert found.spot < PLAIN_TO_SEE
    assert found.structure < 0.05


def _direction(tab: Tab) -> Triple:
    (client,) = tab.running.viser.get_clients().values()
    away = np.asarray(client.camera.position) - np.asarray(client.camera.look_at)
    return triple(away / np.linalg.norm(away))


def _look_from(tab: Tab, towards: Triple) -> None:
    (client,) = tab.running.viser.get_clients().values()
    tab.running.page.services.cameras.turn(client, towards)
    tab.wait_for(lambda: _direction(tab) == pytest.approx(towards, abs=1e-4), "the camera")


def test_link_is_copied_and_opened_and_a_damaged_one_is_refused(tab: Tab) -> None:
    tab.page.context.grant_permissions(["clipboard-read", "clipboard-write"])
    session = tab.running.page.session
    tab.type("z", "77.7")
    session.do(Set("view.leaves", True))
    tab.settle()
    wanted, address = Link.of(tab.state), tab.page.url.partition("?")[0]
    turned = (0.6, -0.48, 0.64)
    _look_from(tab, turned)
    tab.page.get_by_role("button", name="Copy link").click()

    def copied() -> str:
        return str(tab.page.evaluate("navigator.clipboard.readText()"))

    tab.wait_for(lambda: copied() == f"{address}#{encode_link(tab.state, turned)}", "the link")
    fragment = copied().partition("#")[2]
    # In a page that is open, and in one that opens.
    for opens in ("location.hash = it", "history.replaceState(null, '', `#${it}`)"):
        session.do(open_design(explorer.PRESETS["buildable"]))
        tab.settle()
        _look_from(tab, (-0.48, 0.6, 0.64))
        tab.page.evaluate(f"it => {{ {opens} }}", fragment)
        if "replaceState" in opens:
            tab.reload()
        tab.wait_for(lambda: Link.of(tab.state) == wanted, "the state of the link")
        tab.wait_for(lambda: _direction(tab) == pytest.approx(turned, abs=1e-3), "the direction")
        tab.wait_for(lambda: "#" not in tab.page.url, "an address without the state")
    tab.page.evaluate("it => { location.hash = it }", fragment[:-1])
    expect(tab.page.get_by_text("The link is damaged")).to_be_visible()
    assert Link.of(tab.state) == wanted
    tab.close_notices()


def test_moving_page_kernel_and_configuration_are_those_of_the_design(tab: Tab) -> None:
    download = tab.export("Moving page", "HTML")
    assert download.suggested_filename == "paper-optimal-moving.html"
    assert download.path().read_bytes() == moving_page(tab.state.design)
    for title, file_format, name, make in (
        ("Kernel for controllers", "C (zip)", "kernel", kernel_files),
        ("Configuration for LinuxCNC", "INI (zip)", "linuxcnc", linuxcnc_files),
    ):
        download = tab.export(title, file_format)
        assert download.suggested_filename == f"paper-optimal-{name}.zip"
        with zipfile.ZipFile(download.path()) as archive:
            files = {name: archive.read(name) for name in archive.namelist()}
        assert files == make(tab.state.design)


# Where the page's camera sees points of the scene: its own matrices, as they draw the next frame.
MATRICES = """() => {
  const { nodeRefFromName, cameraControl } = window.__viserMutable, { camera } = cameraControl;
  camera.updateMatrixWorld();
  const all = [camera.projectionMatrix, camera.matrixWorldInverse, nodeRefFromName[""].matrixWorld];
  return all.map((matrix) => matrix.elements);
}"""


@pytest.mark.draws
@pytest.mark.parametrize("view", ["isometric", "front", None])
def test_figure_points_are_where_the_camera_of_the_page_sees_them(
    tab: Tab, browser: Browser, view: Literal["isometric", "front"] | None
) -> None:
    if view is None:
        box = tab.page.locator(SCENE_CANVAS).bounding_box()
        assert box is not None
        x, y = box["x"] + 0.5 * box["width"], box["y"] + 0.8 * box["height"]
        tab.page.mouse.move(x, y)
        tab.page.mouse.down()
        tab.page.mouse.move(x + 150.0, y - 120.0, steps=6)
        tab.page.mouse.up()
    else:
        tab.look_from(view)
    tab.picture()
    download = tab.export("Figure", "SVG 85 mm, black")
    assert download.suggested_filename == "paper-optimal-figure.svg"
    root = fromstring(download.path().read_text(encoding="utf-8"))
    circles = [*root.iter("{http://www.w3.org/2000/svg}circle")]
    paper = np.array([[float(each.get(key, "")) for key in ("cx", "cy")] for each in circles])
    points = Frame(tab.state).snapshot.points
    names = ("a1", "a3", "b1", "b2", "b3", "b4")
    scene = scene_scale(tab.state) * np.array([getattr(points, name) for name in names])
    place = np.column_stack([scene, np.ones(6)])
    project, look, turn = (np.reshape(each, (4, 4)).T for each in tab.page.evaluate(MATRICES))
    clip = place @ (project @ look @ turn).T
    # The matrix stretches the picture to a square.
    flat = clip[:, :2] / clip[:, 3:] / np.diag(project)[:2] * [1.0, -1.0]
    slope = np.ptp(paper, axis=0).max() / np.ptp(flat, axis=0).max()
    offset = (paper - slope * flat).mean(axis=0)
    # The file has four decimals.
    np.testing.assert_allclose(slope * flat + offset, paper, atol=1e-4)
    page = browser.new_page(viewport={"width": 400, "height": 400})
    try:
        page.set_content(download.path().read_text(encoding="utf-8").partition("?>")[2])
        drawn = untyped.imread(page.locator("svg").screenshot(), extension=".png")[..., :3]
    finally:
        page.close()
    assert np.ptp(drawn.astype(np.int64), axis=-1).max() <= 2
    assert drawn.min() == 0


def test_scene_as_one_page_works_without_network_and_asks_for_nothing(
    tab: Tab, browser: Browser
) -> None:
    tab.running.page.session.do(Set("view", View(handle=False)))
    tab.look_from("front")
    download = tab.export("Scene", "HTML")
    assert download.suggested_filename == "paper-optimal-scene.html"
    file = download.path().rename(download.path().with_suffix(".html"))
    asked: list[str] = []
    said: list[str] = []
    context = browser.new_context(offline=True, viewport={"width": 640, "height": 480})
    try:
        page = context.new_page()
        page.on("request", lambda request: asked.append(request.url))
        page.on("console", lambda m: said.append(m.text) if m.type == "error" else None)
        page.on("pageerror", lambda error: said.append(str(error)))
        page.goto(file.as_uri())
        expect(page).to_have_title("paper-optimal – flagged 4-4 manipulator", timeout=PATIENCE)
        expect(page.locator("#caption")).to_contain_text(
            "b4 at (10.000, 5.000, 9.000)", timeout=PATIENCE
        )
        expect(page.locator("#caption")).to_contain_text("1 unit = 10 mm", timeout=PATIENCE)
        page.locator("#webgl-software-rendering").get_by_role("button").click()
        canvas = page.locator(SCENE_CANVAS)
        wait_until_drawn(page, canvas, lambda picture: picture.std() > 0.05)
        drawn = decoded(canvas.screenshot())
        # As it was looked at: from the front the guide is level, and a3 is behind it.
        page.mouse.move(320, 240)
        page.mouse.down()
        page.mouse.move(420, 300, steps=5)
        page.mouse.up()
        wait_until_drawn(page, canvas, lambda picture: likeness(drawn, picture).spot > PLAIN_TO_SEE)
        # No panel and no way to a server.
        expect(page.get_by_role("slider")).to_have_count(0)
    finally:
        context.close()
    assert asked[0] == file.as_uri()
    assert all(url.startswith(INSIDE) for url in asked)
    assert said == []


@contextmanager
def notebook(html: str, tmp_path: Path) -> Generator[str]:
    """Serve a page with some HTML in it from a port of its own; yield its address."""
    (tmp_path / "index.html").write_text(f"<!doctype html><body>{html}</body>", encoding="utf-8")

    class Quiet(http.server.SimpleHTTPRequestHandler):
        def __init__(self, *args: Any) -> None:
            super().__init__(*args, directory=str(tmp_path))

        def log_message(self, format: str, *args: object) -> None:  # noqa: A002 - its name
            """Say nothing."""

    with http.server.ThreadingHTTPServer(("127.0.0.1", 0), Quiet) as server:
        thread = threading.Thread(target=server.serve_forever)
        thread.start()
        try:
            yield f"http://127.0.0.1:{server.server_address[1]}"
        finally:
            server.shutdown()
            thread.join()


@pytest.mark.parametrize("host", [pytest.param("127.0.0.1", marks=pytest.mark.long), "localhost"])
def test_page_in_a_notebook_is_live_both_ways(browser: Browser, tmp_path: Path, host: str) -> None:
    context = browser.new_context(viewport={"width": 1000, "height": 640})
    context.set_default_timeout(PATIENCE)
    try:
        with explorer.show() as shown, notebook(as_html(shown), tmp_path) as address:
            page = context.new_page()
            errors: list[str] = []
            page.on("pageerror", lambda error: errors.append(str(error)))
            page.goto(address.replace("127.0.0.1", host))
            frame = page.frame_locator("iframe")
            frame.get_by_role("button", name="Leg lengths").click()
            field = frame.locator("label", has_text="l4 leg 4").locator(
                "xpath=ancestor::*[.//input][1]//input[@inputmode='decimal']"
            )
            expect(field).to_have_value("130.1", timeout=PATIENCE)
            # From Python to the page.
            shown.pose = explorer.Pose((10.0, 5.0, 8.0), shown.pose.quaternion)
            joints = explorer.inverse(shown.design, shown.pose.position, shown.pose.rotation)
            expect(field).to_have_value(f"{10.0 * joints[5]:.1f}", timeout=PATIENCE)
            # From the page to Python.
            field.fill("125")
            field.press("Enter")
            expect(field).to_have_value("125", timeout=PATIENCE)
            deadline = time.monotonic() + PATIENCE_SECONDS
            while shown.pose.position[2] == 8.0:
                assert time.monotonic() < deadline, "the pose has not changed"
                page.wait_for_timeout(20)
            moved = explorer.inverse(shown.design, shown.pose.position, shown.pose.rotation)
            assert moved[5] == pytest.approx(12.5, abs=1e-9)
            canvas = frame.locator(SCENE_CANVAS)
            wait_until_drawn(page, canvas, lambda picture: picture.std() > 0.05)
            # A frame of another site has no storage. An error at one message loses those after it.
            assert errors == []
    finally:
        context.close()
