"""Designs side by side in a real page: pinned, told, drawn over one another, opened again."""

from __future__ import annotations

import time
from collections.abc import Callable

import numpy as np
from likeness import decoded
from playwright.sync_api import expect
from tab import Tab

from explorer.app.screenshot import PATIENCE_SECONDS
from explorer.app.state.actions import SetView
from explorer.app.state.view import View
from explorer.mechanism.design_file import PRESETS
from explorer.workspace.slices.volume import workspace_volume

# Pixels that tell a surface from edges.
MANY = 800
# Far longer than a press takes.
AGAIN_SECONDS = 8.0


def press(tab: Tab, name: str, done: Callable[[], bool]) -> None:
    """Press what is a label of a button, by what it says it does, and wait until that is done.

    The words are made anew when figures arrive: a press that meets those of before is lost.
    """
    deadline = time.monotonic() + PATIENCE_SECONDS
    while not done():
        assert time.monotonic() < deadline, f"never came about: {name}"
        tab.page.get_by_title(name).first.evaluate("label => label.click()")
        again = time.monotonic() + AGAIN_SECONDS
        while not done() and time.monotonic() < again:
            tab.page.wait_for_timeout(20)


def purple_pixels(tab: Tab) -> int:
    """Return how much of the scene has the colour of the first pinned design."""
    red, green, blue = (decoded(tab.picture())[..., i] for i in range(3))
    return int(((blue > green + 0.08) & (red > green + 0.02)).sum())


def test_designs_are_pinned_told_overlaid_and_opened(tab: Tab) -> None:
    tab.running.page.session.do(SetView(View(handle=False, tetrahedra=(False, False, False))))
    tab.turn_to("Compare")
    press(tab, "Pin this design", lambda: tab.state.compared.pinned[0] is not None)
    pinned = tab.state.design
    assert tab.state.compared.pinned == (pinned, None, None)
    tab.turn_to("Design")
    tab.choose("Preset", "paper-initial")
    tab.wait_for(lambda: tab.state.design == PRESETS["paper-initial"], "the other preset")
    page = tab.running.page
    assert page.wait_until_drawn(PATIENCE_SECONDS)
    for design in PRESETS.values():
        text = f"{workspace_volume(design).volume:.2f}"
        expect(tab.page.get_by_role("cell", name=text).first).to_be_attached(
            timeout=1000 * PATIENCE_SECONDS
        )
    before = purple_pixels(tab)
    press(tab, "Draw the workspaces over one another", lambda: tab.state.compared.look.overlay)
    assert page.wait_until_drawn(PATIENCE_SECONDS)
    assert purple_pixels(tab) > before + MANY
    press(tab, "Make paper-optimal the live design", lambda: tab.state.design == pinned)
    tab.push("Undo")
    tab.wait_for(lambda: tab.state.design == PRESETS["paper-initial"], "what was there before")
    press(tab, "Unpin paper-optimal", lambda: tab.state.compared.is_empty)
    assert page.wait_until_drawn(PATIENCE_SECONDS)
    assert np.abs(purple_pixels(tab) - before) < MANY
