"""The page where something is missing: a fast network."""

from __future__ import annotations

import re
from contextlib import closing

from playwright.sync_api import Browser, expect

from explorer.app.server import Running

# Notes at each frame whether the start screen and the bar are there, and how much has come.
WATCH = """(() => {
    window.noted = [];
    const note = () => {
        const bar = document.querySelector(".ex-bar") !== null;
        const loaded = document.querySelector(".ex-start progress")?.value ?? null;
        const words = document.querySelector(".ex-start [role=status]")?.textContent;
        const dark = document.documentElement?.dataset.mantineColorScheme === "dark";
        if (document.body) window.noted.push({ bar, loaded, words, dark });
        requestAnimationFrame(note);
    };
    note();
})()"""
# Bytes of viser's page that came over the network.
TRANSFERRED = """performance.getEntriesByType("resource")
    .find(({ name }) => name.includes("viser.html")).transferSize"""


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
        assert all(each["bar"] and each["dark"] for each in noted[len(covered) :])
        # Viser's page does not come again.
        assert page.evaluate(TRANSFERRED) > 500_000
        page.reload()
        expect(page.locator(".ex-bar")).to_be_visible()
        assert page.evaluate(TRANSFERRED) == 0


def test_page_that_does_not_come_is_told_on_the_start_screen(
    browser: Browser, running: Running
) -> None:
    with closing(browser.new_context()) as context:
        page = context.new_page()
        page.route("**/viser.html*", lambda route: route.abort())
        page.goto(running.url)
        told = page.get_by_role("status")
        expect(told).to_have_text(re.compile(r"The page does not start: .+\. Load it again\."))
