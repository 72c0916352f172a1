"""The accessible workspace in a real page: another mesh, a page alive, messages, files."""

from __future__ import annotations

import os
import signal
from dataclasses import replace

import msgspec
import pytest
from likeness import decoded
from playwright.sync_api import expect
from tab import Tab

from explorer.app.features.mechanism.pose_panel import JOINT_LABELS
from explorer.app.features.workspace.feed import WorkspaceFeed
from explorer.app.screenshot import PATIENCE_SECONDS
from explorer.app.state.actions import Set
from explorer.numerics.number_text import format_number
from explorer.workspace.accessible.radii import with_radius

# Pixels that tell a surface from the edges that a moved leg brings.
MANY = 800


@pytest.fixture
def tab(tab: Tab) -> Tab:
    """A tab with legs of radius 0.2, little but the legs drawn, the tab of the workspace open."""
    limits = with_radius(tab.state.design, 0.2).limits
    bare = replace(tab.state.view, handle=False, flags=False, tetrahedra=(False, False, False))
    tab.running.page.session.do(Set("design.limits", limits))
    tab.running.page.session.do(Set("view", bare))
    tab.turn_to("Workspace")
    return tab


def red_pixels(tab: Tab) -> int:
    """Return how much of the scene is red, as collisions are, and an axis of the triad."""
    red, _, blue = (decoded(tab.picture())[..., i] for i in range(3))
    return int((red > blue + 0.1).sum())


def wait_until_drawn(tab: Tab) -> None:
    assert tab.running.page.wait_until_drawn(PATIENCE_SECONDS)


def test_the_accessible_solid_takes_the_place_of_the_other_and_the_page_stays_alive(
    tab: Tab,
) -> None:
    page = tab.running.page
    tab.push("Solid")
    tab.page.get_by_text("within the limits, in the present orientation").wait_for()
    wait_until_drawn(tab)
    tab.wait_for(lambda: red_pixels(tab) < MANY, "the solid, without collisions")
    process = page.worker.process_id
    assert process is not None
    # A worker that is never done: whatever happens now happens while it computes.
    os.kill(process, signal.SIGSTOP)
    try:
        tab.choose("Region", "accessible from home")
        tab.page.get_by_text("Computing …").wait_for()
        tab.turn_to("Pose")
        before = tab.state
        goal = tab.drag(JOINT_LABELS["l4"], 0.5)
        tab.wait_for(lambda: abs(tab.state.joints[5] - goal) < 0.2, "the length dragged to")
        tab.wait_until_shown(JOINT_LABELS["l4"], tab.state.joints[5])
        assert tab.state.pose != before.pose
        assert red_pixels(tab) < MANY
        assert not page.services.get(WorkspaceFeed).is_current
        tab.push("Home pose")
        tab.wait_for(lambda: tab.state.pose == before.pose, "the home pose")
    finally:
        os.kill(process, signal.SIGCONT)
    accessible = tab.page.get_by_text("units³ accessible")
    accessible.wait_for()
    wait_until_drawn(tab)
    expect(tab.page.get_by_text("computing …")).to_be_hidden()
    drawing = page.services.get(WorkspaceFeed).drawing
    assert drawing is not None
    assert drawing.accessible is not None
    expect(accessible).to_contain_text(f"{format_number(drawing.accessible.volume, 6)} units³")
    tab.wait_for(lambda: red_pixels(tab) > MANY, "the collisions")

    download = tab.export("Workspace", "3MF")
    assert download.suggested_filename == "paper-optimal-accessible-workspace.3mf"


def test_a_home_that_is_no_start_is_told_and_the_button_goes_to_one(tab: Tab) -> None:
    limits = msgspec.structs.replace(tab.state.design.limits, l4=(0.0, 12.5))
    tab.running.page.session.do(Set("design.limits", limits))
    tab.push("Solid")
    tab.choose("Region", "accessible from home")
    alert = tab.page.get_by_role("alert").filter(
        has_text="Nothing is accessible from the home position"
    )
    alert.wait_for()
    expect(alert).to_contain_text(
        "l4 = 13.01 is above its maximum 12.5; the nearest valid position"
    )
    home = tab.state.pose
    tab.push("Go there")
    tab.wait_for(lambda: tab.state.pose != home, "another pose")
    expect(alert).to_be_hidden()
    tab.page.get_by_text("units³ accessible").wait_for()


def test_the_curve_is_drawn_when_it_is_asked_for(tab: Tab) -> None:
    tab.turn_to("Legs")
    chart = tab.page.locator(".uplot canvas")
    expect(chart).to_be_hidden()
    tab.switch("Volume against radius", on=True)
    chart.wait_for()
    expect(tab.page.get_by_text("no loss up to")).to_be_visible()
    expect(tab.page.get_by_text("legs 1 and 4 at (0, 0, 0)")).to_be_visible()
    tab.switch("Volume against radius", on=False)
    expect(chart).to_be_hidden()
