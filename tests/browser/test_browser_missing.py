"""The page where something is missing: the explorer's answers, WebGL, or a fast network."""

from __future__ import annotations

import re
import threading
from collections.abc import Generator
from contextlib import closing, contextmanager
from typing import Any

import pytest
from likeness import decoded, likeness
from playwright.sync_api import Browser, Locator, expect
from tab import Tab, middle

from explorer import PRESETS
from explorer.app.server import Running
from explorer.app.state.actions import open_design
from explorer.app.state.moves import set_position
from explorer.page.browser.headless import CHROMIUM_FLAGS, find_chromium

# Lets time pass by a pause after which the page looks whether it was answered.
PAUSE = 2.5
ADVANCE = """pause => {
    window.explorer.clock.advance(pause);
    return new Promise((resolve) => setTimeout(resolve));
}"""
# Lets time pass, and waits for what comes from the explorer after that.
ANSWER = """pause => new Promise((resolve) => {
    window.explorer.clock.advance(pause);
    window.explorer.socket.listen(({ type }) => resolve(type));
})"""
# Notes at each frame whether the start screen, the bar and parts of the scene are there, and how
# much has come.
WATCH = """(() => {
    window.noted = [];
    const note = () => {
        const bar = document.querySelector(".ex-bar") !== null;
        const loaded = document.querySelector(".ex-start progress")?.value ?? null;
        const words = document.querySelector(".ex-start [role=status]")?.textContent;
        const dark = document.documentElement?.dataset.mantineColorScheme === "dark";
        const parts = Object.keys(window.__viserMutable?.nodeRefFromName ?? {}).length;
        if (document.body) window.noted.push({ bar, parts, loaded, words, dark });
        requestAnimationFrame(note);
    };
    note();
})()"""
# Bytes of viser's page that came over the network.
TRANSFERRED = """performance.getEntriesByType("resource")
    .find(({ name }) => name.includes("viser.html")).transferSize"""


# What makes a Chromium one without WebGL, and what its console says of that.
WITHOUT_WEBGL = ("--disable-gpu", "--disable-3d-apis")
OF_WEBGL = re.compile(r"WebGL|not support|EXT_")
# Takes WebGL from the scene, and gives it back.
LOSE = """() => {
    const scene = document.querySelector("canvas[data-engine]").getContext("webgl2");
    window.graphics = scene.getExtension("WEBGL_lose_context");
    window.graphics.loseContext();
}"""
GIVE_BACK = "window.graphics.restoreContext()"


@contextmanager
def suspended(running: Running) -> Generator[None]:
    """Have an explorer read and send nothing meanwhile, as one whose process is stopped."""
    goes_on = threading.Event()
    server: Any = running.viser
    server._websock_server._background_event_loop.call_soon_threadsafe(goes_on.wait)
    try:
        yield
    finally:
        # The explorer could not even be stopped.
        goes_on.set()


def wait_in_vain(tab: Tab, seconds: float) -> None:
    """Let time pass for the page, and nobody answer it."""
    for _ in range(round(seconds / PAUSE)):
        tab.page.evaluate(ADVANCE, 1000.0 * PAUSE)


def lost(tab: Tab) -> Locator:
    """Return the message that the explorer does not answer."""
    words = re.compile(r"The explorer has not answered since \d\d:\d\d:\d\d")
    return tab.page.get_by_role("alert").filter(has_text=words)


def test_silent_explorer_is_told_and_its_numbers_are_marked_until_it_answers(tab: Tab) -> None:
    numbers = tab.page.locator("div[style*=opacity]:has(> * .ex-bar, > .ex-bar)").last
    tab.resize((1280, 720))
    with suspended(tab.running):
        wait_in_vain(tab, 7.5)
        expect(lost(tab)).to_have_count(0)
        wait_in_vain(tab, 7.5)
        expect(lost(tab)).to_be_visible()
        expect(numbers).to_have_css("opacity", "0.5")
        views = tab.page.locator(".ex-views").bounding_box()
        assert views
        assert middle(lost(tab))[1] > views["y"] + 2.0 * views["height"]
    expect(lost(tab)).to_have_count(0)
    expect(numbers).to_have_css("opacity", "1")
    # What the page asked meanwhile ends no step.
    assert len(tab.running.page.session.history.steps) == 1


def test_page_asks_an_explorer_that_has_nothing_to_say(tab: Tab) -> None:
    tab.settle()
    wait_in_vain(tab, PAUSE)
    assert tab.page.evaluate(ANSWER, 1000.0 * PAUSE) == "message_batch"
    expect(lost(tab)).to_have_count(0)


def test_page_connects_anew_to_an_explorer_that_stays_silent(
    browser: Browser, running: Running
) -> None:
    with closing(Tab(browser, running)) as tab:
        tab.settle()
        before = set(running.viser.get_clients())
        with suspended(running):
            wait_in_vain(tab, 35.0)
        tab.wait_for(lambda: bool(set(running.viser.get_clients()) - before), "a connection")
        expect(lost(tab)).to_have_count(0)
        expect(tab.label("y")).to_be_visible()


def test_start_screen_says_how_much_has_come_and_covers_the_page_until_all_is_there(
    browser: Browser, running: Running
) -> None:
    with closing(browser.new_context(color_scheme="dark")) as context:
        context.add_init_script(WATCH)
        page = context.new_page()
        page.goto(running.url)
        expect(page.locator(".ex-start")).to_have_count(0)
        noted = page.evaluate("window.noted")
        covered = [each for each in noted if each["loaded"] is not None]
        loaded = [each["loaded"] for each in covered]
        assert loaded == sorted(loaded)
        assert min(loaded) < 0.6 < max(loaded) <= 1.0
        assert {each["words"] for each in covered} == {"Loading the page", "Loading the design"}
        # What it leaves behind is whole, in the colours that its user likes.
        for each in noted[len(covered) :]:
            assert (each["bar"], each["dark"], each["parts"] > 50) == (True, True, True), each
        # Viser's page does not come again.
        assert page.evaluate(TRANSFERRED) > 500_000
        page.reload()
        expect(page.locator(".ex-bar")).to_be_visible()
        assert page.evaluate(TRANSFERRED) == 0


@pytest.mark.parametrize(
    ("path", "folder"),
    [("/index.html", ""), ("/of/a/proxy", "/of/a/proxy"), ("/of/a/proxy/", "/of/a/proxy")],
)
def test_page_asks_for_that_of_viser_beside_itself(
    browser: Browser, running: Running, path: str, folder: str
) -> None:
    # A proxy may have a path of its own before that of the explorer.
    address = re.compile(f"^{re.escape(running.url + folder)}/viser\\.html")
    with closing(browser.new_context()) as context:
        page = context.new_page()
        page.route(f"**{path}", lambda route: route.fulfill(response=route.fetch(url=running.url)))
        page.route(address, lambda route: route.abort())
        with page.expect_request(address):
            page.goto(f"{running.url}{path}")


def test_page_that_does_not_come_is_told_on_the_start_screen(
    browser: Browser, running: Running
) -> None:
    with closing(browser.new_context(forced_colors="active")) as context:
        page = context.new_page()
        page.route("**/viser.html*", lambda route: route.abort())
        page.goto(running.url)
        told = page.get_by_role("status")
        expect(told).to_have_text(re.compile(r"The page does not start: .+\. Load it again\."))
        # The bar is seen where the system has colours of its own.
        bar = page.get_by_role("progressbar")
        expect(bar).to_have_css("background-color", "rgba(128, 136, 148, 0.25)")


def test_page_without_webgl_lacks_the_scene_alone_and_says_what_to_switch_on(
    browser: Browser, running: Running
) -> None:
    launch = browser.browser_type.launch
    arguments = [*CHROMIUM_FLAGS, *WITHOUT_WEBGL]
    with (
        closing(launch(executable_path=find_chromium(), args=arguments)) as plain,
        closing(Tab(plain, running)) as tab,
    ):
        told = tab.page.get_by_role("status").filter(has_text="The scene needs WebGL")
        expect(told).to_contain_text("switch on graphics acceleration")
        figures = tab.page.get_by_role("toolbar", name="Figures")
        before = figures.inner_text()
        z = tab.drag("z", 0.8)
        tab.settle()
        assert tab.state.pose.position[2] == pytest.approx(z, abs=0.5)
        expect(figures).not_to_have_text(before, use_inner_text=True)
        assert tab.export("Figure", "SVG 85 mm").suggested_filename == "paper-optimal-figure.svg"
        # A picture is no empty file.
        tab.open_dialog("Export")
        tab.push("Export Picture as PNG 1920 × 1080")
        refused = tab.page.get_by_role("alert").filter(has_text="The browser draws no scene")
        expect(refused).to_be_visible()
        assert [each for each in tab.complaints() if not OF_WEBGL.search(each)] == []


@pytest.mark.draws
def test_scene_is_whole_again_once_the_browser_has_its_graphics_back(tab: Tab) -> None:
    told = tab.page.get_by_role("status").filter(has_text="The browser has lost its graphics")
    session, before = tab.running.page.session, decoded(tab.picture())
    for _ in range(2):
        tab.page.evaluate(LOSE)
        expect(told).to_be_visible()
        # What changes meanwhile is drawn too.
        for x in (4.0, 10.0):
            session.do(set_position(0, x))
            session.wait_until_idle()
        tab.page.evaluate(GIVE_BACK)
        expect(told).to_have_count(0)
        assert likeness(before, decoded(tab.picture())).spot < 2.0
    # What was made before is not deleted from the new graphics, of which the console would tell.
    session.do(open_design(PRESETS["paper-initial"]))
    tab.picture()
