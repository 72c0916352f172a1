"""Designs side by side in a real page: pinned, told, drawn over one another, opened again."""

from __future__ import annotations

from collections.abc import Callable

import numpy as np
from likeness import decoded
from playwright.sync_api import expect
from server_clock import wait_until_drawn
from tab import Tab

from explorer.app.features.compare.feature import Pin
from explorer.app.screenshot import PATIENCE_SECONDS
from explorer.app.state.actions import Set
from explorer.app.state.view import View
from explorer.mechanism.design_file import PRESETS
from explorer.workspace.slices.volume import workspace_volume

# Pixels that tell a surface from edges.
MANY = 800


def press(tab: Tab, name: str, is_done: Callable[[], bool]) -> None:
    """Press a button in markup by its hint, once the page is at rest; wait until it has worked."""
    assert wait_until_drawn(tab.running.page, PATIENCE_SECONDS)
    tab.settle()
    tab.page.get_by_title(name).first.click()
    tab.wait_for(is_done, name)


def purple_pixels(tab: Tab) -> int:
    """Return how much of the scene has the colour of the first pinned design."""
    picture = decoded(tab.picture())
    red, green, blue = (picture[..., i] for i in range(3))
    return int(((blue > green + 0.08) & (red > green + 0.02)).sum())


def test_designs_are_pinned_measured_overlaid_and_opened(tab: Tab) -> None:
    tab.running.page.session.do(Set("view", View(handle=False, tetrahedra=(False, False, False))))
    tab.turn_to("Compare")
    press(tab, "Keep a copy as it is now", lambda: tab.state.compared.pinned[0] is not None)
    pinned = tab.state.design
    assert tab.state.compared.pinned == (pinned, None, None)
    tab.turn_to("Design")
    tab.choose("Preset", "paper-initial")
    tab.wait_for(lambda: tab.state.design == PRESETS["paper-initial"], "the other preset")
    page = tab.running.page
    assert wait_until_drawn(page, PATIENCE_SECONDS)
    for design in PRESETS.values():
        text = f"{workspace_volume(design).volume:,.2f}"
        expect(tab.page.get_by_role("cell", name=text).first).to_be_attached(
            timeout=1000 * PATIENCE_SECONDS
        )
    before = purple_pixels(tab)
    press(tab, "Draw the workspaces over one another", lambda: tab.state.compared.look.overlay)
    assert wait_until_drawn(page, PATIENCE_SECONDS)
    assert purple_pixels(tab) > before + MANY
    press(tab, "Make paper-optimal the live design", lambda: tab.state.design == pinned)
    tab.page.get_by_role("button", name="Undo").click()
    tab.wait_for(lambda: tab.state.design == PRESETS["paper-initial"], "what was there before")
    press(tab, "Unpin paper-optimal", lambda: tab.state.compared.is_empty)
    assert wait_until_drawn(page, PATIENCE_SECONDS)
    assert np.abs(purple_pixels(tab) - before) < MANY


def test_button_in_markup_that_is_pressed_by_a_key_keeps_the_focus(tab: Tab) -> None:
    tab.turn_to("Compare")
    tab.running.page.session.do(Pin(PRESETS["paper-initial"]))
    bars = tab.page.get_by_role("button", name="Bars", exact=True)
    bars.wait_for()
    tab.settle()
    tab.page.get_by_role("button", name="Pin this design").focus()
    for _ in range(2):
        tab.page.keyboard.press("Tab")
    expect(bars).to_be_focused()
    tab.page.keyboard.press("Enter")
    tab.wait_for(lambda: tab.state.compared.look.shows == "bars", "bars")
    # The markup is another by then.
    expect(bars).to_have_attribute("aria-pressed", "true")
    expect(bars).to_be_focused()
    # Neither is lost by what is pressed twice.
    outlines = tab.page.get_by_role("button", name="Outlines", exact=True)
    for pressed in ("true", "false"):
        outlines.click()
        expect(outlines).to_have_attribute("aria-pressed", pressed)
