"""Text of the page is large enough, in contrast and not squeezed; each control has a name."""

from __future__ import annotations

from typing import Any

import pytest
from legibility import Text, mark_contrasts, open_folders, texts_of
from playwright.sync_api import expect
from tab import Tab

from explorer.app.state.actions import Set

SIZE = (1280, 720)
LEAST_SIZE, LEAST_CONTRAST = 11.0, 4.5
# Sizes of type of the stylesheet.
SIZES = {11.0, 12.5, 15.0, 20.0}
# Sizes are computed in floating point.
ROUNDING = 0.02
DIALOG = "[role=dialog]"
SCHEME = "document.documentElement.dataset.mantineColorScheme"
# Least contrast of what is seen by its shape, as WCAG 2 demands it of controls. Numbers stand by
# meters, and names beside swatches.
MARKS = {
    ".mantine-Slider-thumb:not([data-disabled])": 3.0,
    ".mantine-Slider-track::before": 3.0,
    ".multi-slider:not(.disabled) .multi-slider-thumb": 3.0,
    ".multi-slider-track": 3.0,
    "[data-checked] .mantine-Checkbox-icon": 3.0,
    ".ex-chip[aria-pressed=true]": 3.0,
    ".ex-meter": 1.5,
    ".ex-swatch": 1.5,
}
ROLES = {"slider", "spinbutton", "textbox", "searchbox", "combobox", "checkbox", "button", "tab"}


@pytest.fixture
def tab(data_tab: Tab) -> Tab:
    """A tab of an explorer that offers saved designs, in a window of a small laptop."""
    data_tab.resize(SIZE)
    return data_tab


def problems(texts: list[Text]) -> list[Text]:
    """Return the texts that are not legible; what is disabled may be pale."""
    return [
        text
        for text in texts
        if text.size < LEAST_SIZE - ROUNDING
        or text.spacing < 0.0
        or (text.contrast < LEAST_CONTRAST and not text.is_disabled)
    ]


def controls(tab: Tab) -> list[tuple[str, str]]:
    """Return role and name of every control of the page, as a screen reader knows them."""
    inspector: Any = tab.page.context.new_cdp_session(tab.page)
    nodes: list[dict[str, Any]] = inspector.send("Accessibility.getFullAXTree")["nodes"]
    inspector.detach()
    return [
        (node["role"]["value"], node.get("name", {}).get("value", "").strip())
        for node in nodes
        if not node.get("ignored") and node.get("role", {}).get("value") in ROLES
    ]


def nameless(tab: Tab) -> list[str]:
    """Return the roles of the controls without a name."""
    return [role for role, name in controls(tab) if not name]


@pytest.mark.parametrize(
    "dark",
    [pytest.param(False, id="light"), pytest.param(True, id="dark", marks=pytest.mark.long)],
)
def test_text_is_legible_and_every_control_named_in_all_tabs_and_dialogs(
    tab: Tab, *, dark: bool
) -> None:
    scheme = "dark" if dark else "light"
    tab.page.emulate_media(color_scheme=scheme)
    tab.wait_for(lambda: tab.page.evaluate(SCHEME) == scheme, "the theme")
    sizes: dict[float, str] = {}
    count = 0

    def read(place: str, within: str = "") -> None:
        nonlocal count
        open_folders(tab.page)
        tab.settle()
        texts = texts_of(tab.page, within)
        assert texts, place
        assert problems(texts) == [], place
        assert nameless(tab) == [], place
        count += len(texts)
        sizes.update({round(text.size, 1): text.text for text in texts})

    for name in tab.page.get_by_role("tab").all_inner_texts():
        tab.turn_to(name.strip())
        read(name)
    assert count > 500
    assert len(texts_of(tab.page, ".ex-bar")) > 8
    names = tab.running.page.panels.titles("dialog")
    assert {"Designs", "History", "Export", "Help"} <= set(names)
    for name in names:
        tab.open_dialog(name)
        read(name, DIALOG)
        tab.page.keyboard.press("Escape")
        expect(tab.page.get_by_role("dialog", name=name)).to_have_count(0)
    assert set(sizes) <= SIZES, sizes
    tab.page.emulate_media(color_scheme="light")


def test_control_has_the_words_beside_it_as_its_name_whenever_it_comes(tab: Tab) -> None:
    found = controls(tab)
    assert len([1 for role, _ in found if role == "slider"]) == 6
    for words in ("x", "yaw (°)"):
        assert ("slider", words) in found
        assert ("textbox", words) in found
    # Both ends of a range have names of their own.
    tab.turn_to("Design")
    open_folders(tab.page)
    tab.settle()
    found = controls(tab)
    for words in ("l1", "d1, d3", "b4 x"):
        for end in ("least", "most"):
            assert found.count(("textbox", f"{words} {end}")) == 1
    # What comes later has one too.
    tab.turn_to("Pose")
    tab.page.get_by_role("button", name="Folds", exact=True).click()
    tab.slider("φ1 (°)").wait_for()
    tab.settle()
    found = controls(tab)
    for words in ("r", "β (°)", "ε (°)", "φ1 (°)", "φ2 (°)", "φ3 (°)"):
        assert ("slider", words) in found
        assert ("textbox", words) in found
    assert problems(texts_of(tab.page)) == []
    tab.page.keyboard.press("k")
    tab.page.get_by_role("dialog").wait_for()
    tab.running.page.session.do(Set("design.unit_mm", 0.0))
    # As the page says it.
    tab.page.get_by_text("The unit must be positive; got 0").wait_for()
    tab.settle()
    assert nameless(tab) == []


def test_forced_colours_leave_sliders_ticks_and_choices_to_be_seen(tab: Tab) -> None:
    """As in Windows' high contrast, whose own colours replace those of texts and backgrounds."""
    tab.turn_to("Design")
    tab.unfold("Limits (units)")
    # Chosen of several there, and in the menu over the scene.
    tab.open_dialog("Overlays")
    tab.settle()
    for scheme in ("light", "dark"):
        tab.page.emulate_media(forced_colors="active", color_scheme=scheme)
        tab.wait_for(lambda scheme=scheme: tab.page.evaluate(SCHEME) == scheme, "the theme")
        tab.settle()
        for selector, least in MARKS.items():
            contrasts = mark_contrasts(tab.page, selector)
            assert contrasts, selector
            assert min(contrasts) >= least, (scheme, selector, contrasts)
    tab.page.emulate_media(forced_colors="none", color_scheme="light")


@pytest.mark.long
def test_text_that_is_not_legible_is_found(tab: Tab) -> None:
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
