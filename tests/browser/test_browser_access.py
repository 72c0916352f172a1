"""The page for everyone: what axe-core finds, what a screen reader hears, and one sheet."""

from __future__ import annotations

from importlib.metadata import distribution
from pathlib import Path
from typing import Any

import pytest
from legibility import open_folders
from playwright.sync_api import expect
from tab import Tab

# The package is there for the script that it carries.
PACKAGE = distribution("axe-playwright-python")
AXE = Path(str(PACKAGE.locate_file("axe_playwright_python/axe.min.js"))).read_text("utf-8")
# The rules of WCAG 2.2, levels A and AA, and that all content lies in landmarks.
RULES = ["wcag2a", "wcag2aa", "wcag21a", "wcag21aa", "wcag22aa"]
RUN = """async (tags) => {
    const rules = { region: { enabled: true }, "page-has-heading-one": { enabled: true } };
    const { violations } = await axe.run(document, { runOnly: tags, rules });
    return violations.flatMap(({ id, nodes }) => nodes.map((each) => [id, each.html]));
}"""
SCHEME = "document.documentElement.dataset.mantineColorScheme"
# Width and height of what a finger meets, in pixels.
FINGER = 24.0
SIZES = """(selector) => [...document.querySelectorAll(selector)]
    .filter((each) => each.checkVisibility())
    .map((each) => each.getBoundingClientRect())
    .map(({ width, height }) => Math.min(width, height))"""


@pytest.mark.parametrize(
    "dark",
    [pytest.param(False, id="light"), pytest.param(True, id="dark", marks=pytest.mark.long)],
)
def test_axe_finds_nothing_in_all_tabs_and_dialogs(data_tab: Tab, *, dark: bool) -> None:
    tab, scheme = data_tab, "dark" if dark else "light"
    tab.resize((1280, 720))
    tab.page.emulate_media(color_scheme=scheme)
    tab.wait_for(lambda: tab.page.evaluate(SCHEME) == scheme, "the theme")
    tab.page.evaluate(AXE)
    found: list[Any] = []

    def look(place: str) -> None:
        open_folders(tab.page)
        tab.settle()
        found.extend([place, *each] for each in tab.page.evaluate(RUN, RULES))
        assert min(tab.page.evaluate(SIZES, ".mantine-Slider-thumb, .multi-slider-thumb")) >= FINGER

    for name in tab.page.get_by_role("tab").all_inner_texts():
        tab.turn_to(name.strip())
        look(name)
    for name in tab.running.page.panels.titles("dialog"):
        tab.open_dialog(name)
        look(name)
        tab.page.keyboard.press("Escape")
        expect(tab.page.get_by_role("dialog", name=name)).to_have_count(0)
    tab.page.emulate_media(color_scheme="light")
    assert found == []


def test_sliders_tell_their_unit_and_groups_and_places_have_names(tab: Tab) -> None:
    page = tab.page
    assert page.get_by_role("heading").all_inner_texts()[:1] == ["Flagged 4-4 explorer"]
    expect(page.get_by_role("heading", level=1)).to_have_count(1)
    expect(page.get_by_role("banner")).to_have_count(1)
    expect(page.get_by_role("main", name="Scene").get_by_role("img")).to_have_attribute(
        "aria-label", "The mechanism. Arrow keys turn it, W, A, S, D, Q and E move it."
    )
    expect(page.get_by_role("region", name="Pose, Design, Machine")).to_be_visible()
    # The value with the unit of its brackets, or else of its folder, also after a change.
    yaw, x = tab.slider("yaw (°)"), tab.slider("x")
    expect(yaw).to_have_attribute("aria-valuetext", "-73.1 degrees")
    expect(x).to_have_attribute("aria-valuetext", "10 units")
    tab.type("yaw (°)", "20")
    expect(yaw).to_have_attribute("aria-valuetext", "20 degrees")
    for name in ("position: x, y, z", "angles: yaw, pitch, roll"):
        group = page.get_by_role("group", name=name)
        owned = (group.get_attribute("aria-owns") or "").split()
        sliders = [page.locator(f"[id='{each}']").get_by_role("slider") for each in owned]
        names = [(each.get_attribute("aria-label") or "").split()[0] for each in sliders]
        assert names == name.partition(": ")[2].split(", ")


def test_paper_has_scene_verdict_and_numbers_on_one_sheet(tab: Tab, tmp_path: Path) -> None:
    page = tab.page
    page.pdf(path=tmp_path / "page.pdf", prefer_css_page_size=True)
    assert (tmp_path / "page.pdf").read_bytes().count(b"/Type /Page\n") == 1
    # A sheet of A4 across, less its margins.
    tab.resize((1047, 718))
    page.emulate_media(media="print")
    scene = page.locator("canvas[data-engine]").bounding_box()
    assert scene is not None
    assert scene["width"] > 0.4 * 1047
    expect(page.get_by_text("Clear of singularities")).to_be_visible()
    for name in ("x", "yaw (°)"):
        expect(tab.field(name)).to_be_visible()
    for words in ("Export", "Isometric", "Undo"):
        expect(page.get_by_role("button", name=words, exact=True)).to_be_hidden()
    page.emulate_media(media="screen")
