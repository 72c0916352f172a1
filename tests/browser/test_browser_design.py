"""Changing the design in a real page: presets, variables, what is held, refusals, limits."""

from __future__ import annotations

import numpy as np
import pytest
from playwright.sync_api import expect
from tab import Tab

from explorer.app.state.state import joints_of, opened
from explorer.mechanism.design import VARIABLES
from explorer.mechanism.design_file import PRESETS

OPTIMAL, INITIAL = PRESETS["paper-optimal"], PRESETS["paper-initial"]


@pytest.fixture
def tab(tab: Tab) -> Tab:
    """A tab turned to the design."""
    tab.turn_to("Design")
    return tab


def assert_variables_shown(tab: Tab) -> None:
    # A slow browser may still be telling of the drag: what it shows in the end is meant.
    for index, name in enumerate(VARIABLES):
        tab.wait_for(
            lambda name=name, index=index: tab.stands(name, tab.state.design.variables[index]),
            f"{name} as in the state",
        )


def test_a_preset_opens_in_its_home_pose(tab: Tab) -> None:
    tab.choose("Preset", "paper-initial")
    tab.wait_for(lambda: tab.state.design == INITIAL, "the preset")
    assert tab.state.pose == opened(INITIAL).pose
    assert_variables_shown(tab)
    tab.turn_to("Pose")
    for axis, name in enumerate("xyz"):
        tab.wait_until_shown(name, tab.state.pose.position[axis])


def test_a_variable_changes_the_legs_when_the_pose_is_held(tab: Tab) -> None:
    before = tab.state
    goal = tab.drag("b1x", 0.6)
    tab.wait_for(lambda: abs(tab.state.design.b1[0] - goal) < 0.5, "the b1x dragged to")
    state = tab.state
    assert state.pose == before.pose
    assert state.joints == pytest.approx(joints_of(state.design, state.pose))
    assert state.joints[0] != before.joints[0]
    assert_variables_shown(tab)
    # It is none of the presets any more.
    expect(tab.row("Preset").get_by_role("combobox")).to_have_value("—")


def test_a_variable_changes_the_pose_when_the_legs_are_held(tab: Tab) -> None:
    tab.choose("On a change", "hold the legs")
    tab.wait_for(lambda: tab.state.hold == "legs", "that the legs are held")
    before = tab.state
    tab.type("a3x", "19.4")
    tab.wait_for(lambda: tab.state.design.a3[0] == 19.4, "the a3x that was typed")
    assert tab.state.joints == before.joints
    assert tab.state.pose != before.pose
    np.testing.assert_allclose(joints_of(tab.state.design, tab.state.pose), before.joints)


def test_reset_returns_to_the_design_as_it_was_opened(tab: Tab) -> None:
    tab.type("b3", "5.5")
    tab.wait_for(lambda: tab.state.design.b3 == 5.5, "the b3 that was typed")
    tab.push("Reset")
    tab.wait_for(lambda: tab.state.design == OPTIMAL, "the design as it was opened")
    assert tab.state.pose == opened(OPTIMAL).pose
    assert_variables_shown(tab)


def test_a_degenerate_value_is_refused_with_a_reason_and_the_old_one_returns(tab: Tab) -> None:
    before = tab.state
    tab.type("a3y", "0")
    notice = tab.page.get_by_role("alert").filter(has_text="That is not possible")
    notice.wait_for()
    expect(notice).to_contain_text("degenerate design: a3y = 0")
    assert tab.state == before
    tab.wait_until_shown("a3y", 7.0062)


def test_limits_follow_their_switches(tab: Tab) -> None:
    tab.page.get_by_text("Limits (design units)", exact=True).click()
    tab.switch("Maxima at the reach", on=False)
    tab.wait_for(lambda: tab.state.design.limits.l1[1] is not None, "a maximum of its own")
    tab.type("l1 most", "11")
    tab.wait_for(lambda: tab.state.design.limits.l1[1] == 11.0, "the maximum that was typed")
    expect(tab.page.get_by_text("Outside the limits")).to_be_visible()
