"""Singularities in a real page: the diagram to click on, and the gap."""

from __future__ import annotations

from playwright.sync_api import expect
from tab import SIZE, Tab

from explorer.app.features.mechanism.incidences import margin_hover
from explorer.app.state.frame import Frame
from explorer.mechanism.margins import INCIDENCES


def test_stratum_is_entered_from_the_diagram_and_shows_its_motions(tab: Tab) -> None:
    nodes = tab.page.locator("button[title^='(']")
    tab.unfold("More")
    expect(nodes).to_have_count(23)
    tab.switch("Diagram", on=False)
    expect(nodes).to_have_count(0)
    tab.switch("Diagram", on=True)
    expect(nodes).to_have_count(23)
    tab.page.get_by_role("button", name="Go to (3, 4, 1, 2)").click()
    tab.wait_for(lambda: Frame(tab.state).snapshot.stratum == (3, 4, 1, 2), "the stratum")
    expect(tab.page.get_by_text("δ3 = 0: b4 on the base plane", exact=False).first).to_be_visible()
    # Both turns that are free there are offered, and swing a ghost until it is moved.
    buttons = tab.page.get_by_role("button", name="Show the motion")
    expect(buttons).to_have_count(2)
    with tab.slow_time():
        buttons.first.click()
        tab.wait_for(lambda: is_visible(tab, "/freedom/platform"), "the ghost")
    tab.push("Home pose")
    tab.wait_for(lambda: not is_visible(tab, "/freedom/platform"), "no ghost")
    expect(buttons).to_have_count(0)


def test_margin_that_is_pointed_at_fills_its_tetrahedron(tab: Tab) -> None:
    before, number = tab.state, tab.running.page.session.history.step.number
    hovered = tab.running.page.services.get(margin_hover)
    assert not is_visible(tab, "/tetrahedra/faces")
    for row in (3, 1):
        words = tab.page.locator(".ex-margin-row").nth(row - 1).get_by_text(INCIDENCES[row - 1])
        words.hover()
        tab.wait_for(lambda row=row: hovered.row == row, f"the pointer on δ{row}")
        tab.wait_for(lambda: is_visible(tab, "/tetrahedra/faces"), "a filled tetrahedron")
        tab.wait_for(lambda: is_visible(tab, "/gaps/dashes"), "its gap")
    # Its button shows it to the keyboard too.
    tab.page.mouse.move(SIZE[0] // 2, 4)
    tab.wait_for(lambda: not is_visible(tab, "/tetrahedra/faces"), "no filled tetrahedron")
    tab.page.get_by_role("button", name="Go to δ1 = 0").focus()
    tab.page.keyboard.press("Tab")
    tab.wait_for(lambda: hovered.row == 2, "the row of the button with the focus")
    tab.wait_for(lambda: is_visible(tab, "/tetrahedra/faces"), "its tetrahedron")
    assert tab.state == before
    assert tab.running.page.session.history.step.number == number


def is_visible(tab: Tab, node: str) -> bool:
    return bool(
        tab.page.evaluate("name => !!window.__viserMutable.nodeRefFromName[name]?.visible", node)
    )
