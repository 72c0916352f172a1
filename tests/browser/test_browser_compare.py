"""Designs side by side in a real page: pinned, told, drawn over one another, opened again."""

from __future__ import annotations

from playwright.sync_api import expect
from tab import Tab

from explorer.app.features.compare.feature import pin
from explorer.app.features.compare.work import Compared
from explorer.mechanism.design_file import PRESETS
from explorer.six_legged.files import TABLES


def test_button_in_markup_that_is_pressed_by_a_key_keeps_the_focus(tab: Tab) -> None:
    tab.turn_to("Compare")
    tab.running.page.session.do(pin(PRESETS["paper-initial"]))
    overlay = tab.page.get_by_role("button", name="Overlay workspaces", exact=True)
    overlay.wait_for()
    tab.settle()
    tab.page.get_by_role("button", name="Pin this design").focus()
    # Behind it stand another preset and the tables on six legs.
    for _ in range(2 + len(TABLES)):
        tab.page.keyboard.press("Tab")
    expect(overlay).to_be_focused()
    tab.page.keyboard.press("Enter")
    tab.wait_for(lambda: Compared.of(tab.state).look.overlay, "overlay")
    # The markup is another by then.
    expect(overlay).to_have_attribute("aria-pressed", "true")
    expect(overlay).to_be_focused()
    # Neither is lost by what is pressed twice.
    outlines = tab.page.get_by_role("button", name="Outlines", exact=True)
    for pressed in ("true", "false"):
        outlines.click()
        expect(outlines).to_have_attribute("aria-pressed", pressed)
