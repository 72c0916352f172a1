"""A lesson in a real page: any way to a step counts, it is left without a trace, and printed."""

from __future__ import annotations

from pathlib import Path

from playwright.sync_api import Browser, Locator
from tab import Tab


def button_of(tab: Tab, words: str) -> Locator:
    return tab.page.get_by_role("button", name=words, exact=True)


def test_lesson_is_done_by_hand_left_and_printed(
    browser: Browser, tab: Tab, tmp_path: Path
) -> None:
    first = tab.state
    tab.open_dialog("Help")
    # The second step of the second lesson, then back.
    button_of(tab, "2 The two lines").click()
    card = tab.page.get_by_role("region", name="The three tetrahedra")
    card.get_by_text("step 2 of 4").wait_for()
    # The lesson has chosen the sliders, and the one that it names is ringed.
    tab.page.locator("[data-ex-ring]:visible", has=tab.slider("d2 leg 2")).wait_for()
    button_of(tab, "Back").click()
    card.get_by_text("Flattest tetrahedron: a1 a2 b2 b3; asked: b1 b2 b3 a1").wait_for()
    assert button_of(tab, "Next").is_disabled()
    tab.type("l1 leg 1", "11.4")
    card.get_by_text("Done", exact=True).wait_for()
    button_of(tab, "Next").click()
    card.get_by_text("step 2 of 4").wait_for()
    button_of(tab, "Leave").click()
    card.wait_for(state="detached")
    tab.wait_for(lambda: tab.state.view == first.view, "the view before the lesson")
    # What was typed stays, and is undone.
    assert tab.state.pose != first.pose
    tab.open_dialog("Help")
    with tab.page.expect_download() as download:
        button_of(tab, "Handout").nth(1).click()
    download.value.save_as(tmp_path / "handout.html")
    assert download.value.suggested_filename == "The three tetrahedra.html"
    # No page of the tab, whose requests other tests look at.
    sheets = browser.new_page()
    sheets.goto((tmp_path / "handout.html").as_uri())
    assert sheets.locator("img").evaluate_all("all => all.every((each) => each.naturalWidth > 0)")
    sheets.pdf(path=tmp_path / "handout.pdf", prefer_css_page_size=True)
    assert (tmp_path / "handout.pdf").read_bytes().count(b"/Type /Page\n") <= 2
    sheets.close()
