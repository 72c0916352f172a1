"""All text of a page is legible: large enough, in contrast to what is behind it, not squeezed."""

from __future__ import annotations

from contextlib import closing

import pytest
from legibility import Text, open_folders, texts_of
from monkey import explorer_with_data
from playwright.sync_api import Browser, expect
from tab import Tab

SIZE = (1280, 720)
LEAST_SIZE, LEAST_CONTRAST = 11.0, 4.5
# Sizes of type of the stylesheet. The plots of Plotly set type of their own.
SIZES = {11.0, 12.5, 15.0}
# Sizes are computed in floating point.
ROUNDING = 0.02


def problems(texts: list[Text]) -> list[Text]:
    """Return the texts that are not legible; what is disabled may be pale."""
    return [
        text
        for text in texts
        if text.size < LEAST_SIZE - ROUNDING
        or text.spacing < 0.0
        or (text.contrast < LEAST_CONTRAST and not text.is_disabled)
    ]


@pytest.mark.parametrize("dark", [False, True], ids=["light", "dark"])
def test_all_text_of_all_tabs_is_legible(browser: Browser, dark: bool) -> None:
    with explorer_with_data() as running:
        running.page.services.theme.choose(dark=dark)
        with closing(Tab(browser, running, size=SIZE, dark=dark)) as tab:
            sizes: dict[float, str] = {}
            found = 0
            tabs = tab.page.get_by_role("tab")
            for index, name in enumerate(tabs.all_inner_texts()):
                tabs.nth(index).click()
                open_folders(tab.page)
                # A tab may be laid out and named a moment later.
                tab.wait_for(
                    lambda: not problems(texts_of(tab.page)),
                    f"legible text in {name}: {problems(texts_of(tab.page))}",
                )
                texts = texts_of(tab.page)
                found += len(texts)
                sizes |= {round(text.size, 1): text.text for text in texts}
            assert found > 500
            assert set(sizes) <= SIZES, sizes


@pytest.mark.parametrize("dark", [False, True], ids=["light", "dark"])
def test_all_text_of_the_bar_and_of_the_dialogs_is_legible(browser: Browser, dark: bool) -> None:
    with explorer_with_data() as running:
        running.page.services.theme.choose(dark=dark)
        with closing(Tab(browser, running, size=SIZE, dark=dark)) as tab:
            bar = texts_of(tab.page, ".ex-bar")
            assert len(bar) > 8
            places = {"bar": bar}
            for name in running.page.panels.titles("dialog"):
                tab.open_dialog(name)
                open_folders(tab.page)
                tab.wait_for(
                    lambda: not problems(texts_of(tab.page, "[role=dialog]")),
                    f"legible text in {name}: {problems(texts_of(tab.page, '[role=dialog]'))}",
                )
                places[name] = texts_of(tab.page, "[role=dialog]")
                assert places[name], name
                tab.page.keyboard.press("Escape")
                expect(tab.page.get_by_role("dialog", name=name)).to_have_count(0)
            assert {"Designs", "History", "Export", "Help"} <= places.keys()
            for name, texts in places.items():
                assert not problems(texts), name
                assert {round(text.size, 1) for text in texts} <= SIZES, name


def test_what_is_not_legible_is_found(tab: Tab) -> None:
    """The measures themselves, by texts that are too small, too pale, or too tight."""
    bad = {
        "font-size: 10px": "small",
        "color: #777; background: #fff; opacity: 0.9": "pale",
        "color: rgb(0 0 0 / 50%); background: #fff": "thin",
    }
    good = {
        "color: #757575; background: #fff": "dark enough",
        "color: #fff; background: #222": "ok",
    }
    markup = "".join(f'<p style="{style}">{word}</p>' for style, word in (bad | good).items())
    svg = '<svg width="60" viewBox="0 0 120 40"><text y="20" font-size="16">shrunk</text></svg>'
    tab.page.evaluate(
        """html => {
            const box = document.createElement("div");
            box.id = "samples";
            box.style = "position: fixed; top: 0; left: 0; z-index: 999; background: #fff";
            box.innerHTML = html;
            document.body.append(box);
        }""",
        # The stylesheet undoes the spacing of a style attribute.
        "<style>.squeezed { letter-spacing: -0.5px }</style><p class=squeezed>tight</p>"
        + markup
        + svg,
    )
    try:
        words = {text.text for text in problems(texts_of(tab.page))}
        assert words == {*bad.values(), "shrunk", "tight"}
    finally:
        tab.page.evaluate("() => document.getElementById('samples').remove()")
