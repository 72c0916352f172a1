"""Singularities in a real page: the diagram to click on, and the gap."""

from __future__ import annotations

import numpy as np
from playwright.sync_api import expect
from tab import SIZE, Tab

from explorer.app.features.mechanism.incidences import margin_hover
from explorer.app.features.mechanism.marks import (
    ARROW_LENGTH,
    CLEAR_HANDLE,
    FAINT_HANDLE,
    DragHandle,
)
from explorer.app.scene.placing import Placed
from explorer.app.state.actions import SetPosition
from explorer.app.state.frame import Frame
from explorer.mechanism.margins import INCIDENCES


def test_stratum_is_entered_from_the_diagram_and_shows_its_motions(tab: Tab) -> None:
    nodes = tab.page.locator("button[title^='(']")
    # It is open from the start.
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
        assert is_visible(tab, "/gaps/dashes")
    # Its button shows it to the keyboard too.
    tab.page.mouse.move(SIZE[0] // 2, 4)
    tab.wait_for(lambda: not is_visible(tab, "/tetrahedra/faces"), "no filled tetrahedron")
    tab.page.get_by_role("button", name="Go to δ1 = 0").focus()
    tab.page.keyboard.press("Tab")
    tab.wait_for(lambda: hovered.row == 2, "the row of the button with the focus")
    tab.wait_for(lambda: is_visible(tab, "/tetrahedra/faces"), "its tetrahedron")
    assert tab.state == before
    assert tab.running.page.session.history.step.number == number


def test_gizmo_that_gives_way_to_a_gap_is_dragged_on(tab: Tab) -> None:
    tab.resize((1280, 720))
    session, gizmo = tab.running.page.session, tab.running.page.services.get(DragHandle)
    # So high that the gap comes within the gizmo on the way down.
    session.do(SetPosition(2, 5.0))
    tab.look_from("isometric")
    before = tab.state
    assert gizmo.handle.scale == CLEAR_HANDLE[0]
    placed = Placed(Frame(before))
    arrow = np.array([0.0, 0.0, 1.0])
    tip = placed.points["b4"] + 0.7 * ARROW_LENGTH * arrow

    def wait_until_moved(by: float) -> None:
        # A slow browser reports the drag long after it.
        def is_there() -> bool:
            way = placed.scale * (np.array(tab.state.pose.position) - before.pose.position)
            return bool(np.allclose(way, by * arrow, atol=0.3))

        tab.wait_for(is_there, f"the pose at {by}")

    mouse = tab.page.mouse
    mouse.move(*tab.on_screen(tip))
    mouse.down()
    mouse.move(*tab.on_screen(tip - 3.5 * arrow), steps=12)
    tab.wait_for(lambda: gizmo.handle.scale == FAINT_HANDLE[0], "the small gizmo")
    wait_until_moved(-3.5)
    mouse.move(*tab.on_screen(tip - 1.0 * arrow), steps=12)
    mouse.up()
    wait_until_moved(-1.0)
    tab.wait_for(lambda: gizmo.handle.scale == CLEAR_HANDLE[0], "the gizmo as it was")
    tab.settle()
    # The camera turns again with the next drag beside the gizmo.
    eye = np.array(tab.client.camera.position)
    mouse.move(640, 600)
    mouse.down()
    mouse.move(700, 600, steps=5)
    mouse.up()
    tab.wait_for(lambda: not np.allclose(tab.client.camera.position, eye), "another view")


def is_visible(tab: Tab, node: str) -> bool:
    return bool(
        tab.page.evaluate("name => !!window.__viserMutable.nodeRefFromName[name]?.visible", node)
    )
