"""Controls of a real page as a screen reader knows them: each has a name, also those that come."""

from __future__ import annotations

from contextlib import closing
from typing import Any

from legibility import open_folders
from monkey import explorer_with_data
from playwright.sync_api import Browser
from tab import Tab

from explorer.app.state.actions import Set

ROLES = {"slider", "spinbutton", "textbox", "searchbox", "combobox", "checkbox", "button", "tab"}
SIZE = (1280, 720)


def controls(tab: Tab) -> list[tuple[str, str]]:
    """Return role and name of every control of the page."""
    inspector: Any = tab.page.context.new_cdp_session(tab.page)
    nodes: list[dict[str, Any]] = inspector.send("Accessibility.getFullAXTree")["nodes"]
    inspector.detach()
    return [
        (node["role"]["value"], node.get("name", {}).get("value", "").strip())
        for node in nodes
        if not node.get("ignored") and node.get("role", {}).get("value") in ROLES
    ]


def test_every_control_has_a_name_in_every_tab(browser: Browser) -> None:
    with explorer_with_data() as running, closing(Tab(browser, running, size=SIZE)) as tab:
        for name in tab.page.get_by_role("tab").all_inner_texts():
            tab.turn_to(name.strip())
            open_folders(tab.page)
            tab.wait_for(
                lambda: all(named for _, named in controls(tab)), f"names of all controls in {name}"
            )
        for name in ("Designs", "History", "Export", "Help"):
            tab.open_dialog(name)
            tab.wait_for(
                lambda: all(named for _, named in controls(tab)), f"names of all controls in {name}"
            )
        tab.page.keyboard.press("Escape")
        tab.turn_to("Pose")
        tab.wait_for(lambda: ("slider", "l1 leg 1") in controls(tab), "the first slider")
        assert len([1 for role, _ in controls(tab) if role == "slider"]) >= 10
        for words in ("x", "yaw (°)"):
            assert ("slider", words) in controls(tab)
            assert ("textbox", words) in controls(tab)
        # Both ends of a range have names of their own.
        tab.turn_to("Design")
        tab.wait_for(lambda: ("textbox", "l1 most") in controls(tab), "the first range")
        found = controls(tab)
        for words in ("l1", "d1, d3", "b4 x"):
            for end in ("least", "most"):
                assert found.count(("textbox", f"{words} {end}")) == 1
        # What comes later has one too.
        tab.page.keyboard.press("k")
        tab.page.get_by_role("dialog").wait_for()
        running.page.session.do(Set("design.unit_mm", 0.0))
        # As the page says it.
        tab.page.get_by_text("The unit must be positive; got 0").wait_for()
        tab.wait_for(lambda: all(named for _, named in controls(tab)), "names of what came")
        assert tab.complaints() == []
