"""The accessible workspace in a real page: another mesh, and a page that stays alive."""

from __future__ import annotations

import os
import signal
from dataclasses import replace

import pytest
from likeness import decoded
from playwright.sync_api import expect
from server_clock import wait_until_drawn
from tab import Tab

from explorer.app.features.mechanism.feature import JOINT_LABELS
from explorer.app.features.workspace.feeds import WORKSPACE_FEED
from explorer.app.screenshot import PATIENCE_SECONDS, SCENE_CANVAS, settle
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
    """Return how much of the scene is red, as collisions are, and an axis of the triad.

    The page is at rest, whatever the worker does.
    """
    with tab.drawing():
        settle(tab.page, tab.client)
        picture = decoded(tab.page.locator(SCENE_CANVAS).screenshot())
    return int((picture[..., 0] > picture[..., 2] + 0.1).sum())


def await_drawing(tab: Tab) -> None:
    assert wait_until_drawn(tab.running.page, PATIENCE_SECONDS)


def test_accessible_solid_replaces_the_other_while_the_page_stays_alive(tab: Tab) -> None:
    page = tab.running.page
    tab.push("Solid")
    tab.page.get_by_text("within the limits, in the present orientation").wait_for()
    await_drawing(tab)
    tab.wait_for(lambda: red_pixels(tab) < MANY, "the solid, without collisions")
    process = page.worker.process_id
    assert process is not None
    # A worker that is never done: whatever happens now happens while it computes.
    os.kill(process, signal.SIGSTOP)
    try:
        tab.choose("Region", "accessible from home")
        tab.page.get_by_text("Computing …").wait_for()
        tab.turn_to("Pose")
        tab.push("Leg lengths")
        before = tab.state
        goal = tab.drag(JOINT_LABELS["l4"], 0.5)
        tab.wait_for(lambda: abs(tab.state.joints[5] - goal) < 0.2, "the length dragged to")
        # The last of the drag may still be on its way.
        tab.wait_for(
            lambda: tab.stands(JOINT_LABELS["l4"], tab.state.joints[5]), "the length of the state"
        )
        assert tab.state.pose != before.pose
        assert red_pixels(tab) < MANY
        assert not page.services.get(WORKSPACE_FEED).is_current
        tab.push("Home pose")
        tab.wait_for(lambda: tab.state.pose == before.pose, "the home pose")
    finally:
        os.kill(process, signal.SIGCONT)
    accessible = tab.page.get_by_text("units³ accessible")
    # It takes seconds of the processor, which are minutes on a busy machine.
    accessible.wait_for(timeout=240_000)
    await_drawing(tab)
    expect(tab.page.get_by_text("computing …")).to_be_hidden()
    drawing = page.services.get(WORKSPACE_FEED).drawing
    assert drawing is not None
    assert drawing.part is not None
    expect(accessible).to_contain_text(f"{format_number(drawing.part.volume, 6)} units³")
    tab.wait_for(lambda: red_pixels(tab) > MANY, "the collisions")

    download = tab.export("Workspace", "3MF")
    assert download.suggested_filename == "paper-optimal-accessible-workspace.3mf"
