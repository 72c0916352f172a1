"""The first screen in a real page: stops of the keyboard, folders that stay open, and the bar."""

from __future__ import annotations

import re
from contextlib import closing

from playwright.sync_api import Browser, expect
from tab import NOTICE, Tab

from explorer.app.features.paths.actions import go
from explorer.app.features.paths.state import Stop
from explorer.app.screenshot import HOLD
from explorer.app.server import Running
from explorer.app.state.actions import Set
from explorer.mechanism.design_file import PRESETS
from explorer.mechanism.pose import Pose

STOPS = """() => [...document.querySelectorAll("a[href], button, input, [tabindex]")]
    .filter((each) => each.tabIndex >= 0 && !each.disabled && each.getClientRects().length)
    .map((each) => each.ariaLabel || each.innerText)"""
# Most controls that the Tab key reaches before anything is done.
MOST = 40
# Figures of the bar that are drawn whole, with their names, and those that are drawn in part.
FIGURES = """() => {
    const room = document.querySelector(".ex-bar > [role=toolbar]").getBoundingClientRect();
    const within = (it) => {
        const { left, right, top, bottom } = it.getBoundingClientRect();
        if (top >= room.bottom) return "hidden";
        return left > room.left - 1 && right < room.right + 1 && bottom < room.bottom + 2;
    };
    return [...document.querySelectorAll(".ex-figure")].map((each) =>
        [each.innerText, [each, ...each.children].map(within)]);
}"""
# Whether a panel begins where the scene ends.
ADJOINS = """() => {
    const { right, bottom } = document.querySelector("canvas").getBoundingClientRect();
    const [above, below] = [bottom - 8, bottom + 8].map((y) =>
        document.elementFromPoint(right - 20, y).closest(".mantine-Paper-root"));
    return !above && !!below;
}"""
# Names of the buttons of the bar and of the views, and of the tabs, whose middle a pointer finds.
FOUND = """() => [...document.querySelectorAll(".ex-bar button, [role=tab]")].flatMap((each) => {
    const { x, y, width, height } = each.getBoundingClientRect();
    const found = document.elementFromPoint(x + width / 2, y + height / 2);
    const name = each.ariaLabel || each.textContent.trim();
    return each.contains(found) ? [name.split(" ")[0]] : [];
})"""
# Windows of a small laptop, half a screen, two laptops that enlarge all to 200 %, and a phone, with
# the figures that they show at least.
PHONE = (390, 844)
WINDOWS = {(1000, 700): 3, (820, 600): 2, (683, 384): 2, (640, 360): 1, PHONE: 1}
VIEWS = {"Isometric", "Front", "Side", "Top", "Fit", "Overlays"}
REACHED = {
    *("Undo", "Redo", "History", "Export", "Search", "Theme", "Help"),
    *("Pose", "Design", "Machine"),
    *("Singularity", "Workspace", "Tilt", "Loads", "Prototype"),
}
# The colour of a notice, and the one that tells something without a warning.
NOTE_COLOURS = """(notice) => {
    const [own, root] = [notice, document.documentElement].map((each) => getComputedStyle(each));
    return ["--notification-color", "--mantine-color-blue-filled"].map((name, at) =>
        [own, root][at].getPropertyValue(name));
}"""
HIGHER = Pose((10.0, 5.0, 11.0), PRESETS["paper-optimal"].home_pose.quaternion)


def test_notice_of_a_browser_without_graphics_card_is_blue(tab: Tab, browser: Browser) -> None:
    context = browser.new_context()
    with closing(context):
        context.add_init_script(HOLD)
        page = context.new_page()
        page.goto(tab.running.url)
        notice = page.locator(NOTICE, has_text="Drawn without a graphics card")
        notice.wait_for()
        own, blue = notice.evaluate(NOTE_COLOURS)
        assert own == blue != ""


def test_first_screen_is_short_for_the_keyboard_and_stays_as_it_was_opened(
    browser: Browser, running: Running
) -> None:
    with closing(Tab(browser, running, size=(1280, 720))) as tab:
        tab.settle()
        page, keyboard = tab.page, tab.page.keyboard
        stops = page.evaluate(STOPS)
        assert 20 < len(stops) <= MOST, stops
        expect(page).to_have_title("paper-optimal – Flagged 4-4 explorer")
        # A folder is opened by its head.
        strata = page.locator(".ex-nodes button")
        more = page.get_by_role("button", name="More", exact=True)
        expect(strata.first).to_be_hidden()
        more.focus()
        keyboard.press("Enter")
        expect(more).to_have_attribute("aria-expanded", "true")
        tab.settle()
        # The diagram is one stop, and arrows lead from a stratum to the one beside it.
        expect(strata.and_(page.locator(":not([tabindex='-1'])"))).to_have_count(1)
        page.get_by_role("button", name="Go to (3, 4, 2, 1)").focus()
        for key, stratum in {"Right": "(4, 2, 3, 1)", "Down": "(3, 4, 1, 2)"}.items():
            keyboard.press(f"Arrow{key}")
            expect(page.get_by_role("button", name=f"Go to {stratum}")).to_be_focused()
        tab.reload()
        expect(strata.first).to_be_visible()


def test_bar_of_any_window_shows_the_verdict_and_all_buttons_and_cuts_no_figure(
    browser: Browser, running: Running
) -> None:
    with closing(Tab(browser, running)) as tab:
        for size, least in WINDOWS.items():
            tab.resize(size)
            figures = tab.page.evaluate(FIGURES)
            shown = [words for words, parts in figures if parts[0] != "hidden"]
            assert all(parts in ([True] * 3, ["hidden"] * 3) for _, parts in figures), figures
            assert "Nearest singular pose\n1.03 units of motion" in shown
            assert len(shown) >= least
            # A phone has a list of the panels instead of tabs, which opens what the bar leaves out.
            reached = VIEWS if size == PHONE else VIEWS | REACHED
            assert set(tab.page.evaluate(FOUND)) >= reached, size
            expect(tab.page.locator("[data-document]")).to_be_in_viewport(ratio=1.0)
        # On a phone, the last of the windows, the panels are below the scene.
        tab.wait_for(lambda: tab.page.evaluate(ADJOINS), "a scene that ends at the panels")


def test_charts_of_a_path_are_no_wider_than_a_phone(browser: Browser, running: Running) -> None:
    for path, value in (
        ("design.actuators.speed_mm_s", (200.0,) * 6),
        ("paths.stops", (Stop(), Stop(HIGHER))),
    ):
        running.page.session.do(Set(path, value))
    running.page.session.do(go())
    with closing(Tab(browser, running)) as tab:
        tab.resize(PHONE)
        tab.page.get_by_text(re.compile("^Optimise · ")).click()
        tab.page.get_by_role("tab", name="Paths").click()
        charts = tab.page.locator(".ex-course:visible")
        expect(charts).not_to_have_count(0)
        expect(tab.page.locator(".ex-drives")).to_be_visible()
        tab.settle()
        boxes = [chart.bounding_box() for chart in charts.all()]
        assert all(box and box["width"] < PHONE[0] for box in boxes), boxes
