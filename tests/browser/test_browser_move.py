"""Moving the mechanism in a real page: by sliders, fields, modes and the gizmo."""

from __future__ import annotations

from contextlib import closing
from typing import cast

import numpy as np
import pytest
from kept_tab import OpenTab
from playwright.sync_api import Browser, Locator, expect
from tab import SIZE, TRACK, Tab

from explorer.app.features.mechanism.marks import ARROW_LENGTH
from explorer.app.features.mechanism.modes import HoveredMode
from explorer.app.features.mechanism.pose_panel import JOINT_LABELS
from explorer.app.scene.placing import Placed
from explorer.app.screenshot import settle
from explorer.app.server import Running
from explorer.app.state.actions import SetPosition
from explorer.app.state.frame import Frame
from explorer.app.state.state import State, joints_of
from explorer.mechanism.design import JOINTS
from explorer.mechanism.home import home_pose
from explorer.mechanism.kinematics import forward

LABELS = [JOINT_LABELS[name] for name in JOINTS]


def assert_page_shows_state(tab: Tab) -> None:
    """Wait until every slider of legs and pose stands where the state says."""
    # A slow browser may still be telling of a hand: what it shows in the end is meant.
    for index, label in enumerate((*LABELS, *"xyz", "yaw (°)", "pitch (°)", "roll (°)")):
        tab.wait_for(
            lambda index=index, label=label: tab.stands(label, values_of(tab.state)[index]),
            f"{label} as in the state",
        )


def values_of(state: State) -> tuple[float, ...]:
    return (*state.joints, *state.pose.position, *state.yaw_pitch_roll)


def test_page_loads_without_a_complaint_and_asks_nobody_else(
    browser: Browser, running: Running
) -> None:
    with closing(Tab(browser, running, draws=True)) as tab:
        assert_page_shows_state(tab)
        tab.picture()
        own = (tab.running.url, f"blob:{tab.running.url}", "data:")
        assert [url for url in tab.requests if not url.startswith(own)] == []
        assert tab.complaints() == []


@pytest.mark.parametrize(("joint", "typed"), [(0, 12.5), (1, 10.4), (5, 14.25)])
def test_a_length_typed_in_its_field_moves_the_mechanism(
    tab: Tab, joint: int, typed: float
) -> None:
    before = tab.state
    tab.type(LABELS[joint], f"{typed:g}")
    tab.wait_for(lambda: tab.state.joints[joint] == typed, "the length that was typed")
    state = tab.state
    others = [i for i in range(6) if i != joint]
    assert [state.joints[i] for i in others] == [before.joints[i] for i in others]
    assert state.pose != before.pose
    np.testing.assert_allclose(joints_of(state.design, state.pose), state.joints, atol=1e-9)
    assert_page_shows_state(tab)


def test_a_leg_slider_dragged_by_mouse_moves_the_mechanism(tab: Tab) -> None:
    before = tab.state
    goal = tab.drag(LABELS[5], 0.5)
    tab.wait_for(lambda: abs(tab.state.joints[5] - goal) < 0.2, "the length dragged to")
    assert tab.state.unclosed is None
    assert tab.state.pose != before.pose
    assert tab.state.joints[:5] == before.joints[:5]
    assert_page_shows_state(tab)


def test_a_pose_slider_moves_the_legs(tab: Tab) -> None:
    before = tab.state
    goal = tab.drag("y", 0.6)
    tab.wait_for(lambda: abs(tab.state.pose.position[1] - goal) < 0.4, "the y dragged to")
    assert tab.state.pose.position[::2] == before.pose.position[::2]
    assert tab.state.joints != before.joints
    tab.type("roll (°)", "12")
    tab.wait_for(lambda: tab.state.yaw_pitch_roll[2] == 12.0, "the roll that was typed")
    assert_page_shows_state(tab)


def test_choosing_a_mode_keeps_the_legs_and_takes_that_assembly(tab: Tab) -> None:
    before = tab.state
    other = before.mode ^ 0b101
    row_of_mode(tab, other).click()
    tab.wait_for(lambda: tab.state.mode == other, "the mode that was chosen")
    solution = forward(before.design, before.joints)
    np.testing.assert_allclose(tab.state.pose.position, solution.position[other], atol=1e-9)
    np.testing.assert_allclose(tab.state.joints, before.joints, atol=1e-9)
    assert_page_shows_state(tab)


def test_pointer_on_a_mode_shows_its_ghost_until_it_leaves_or_the_mode_is_chosen(tab: Tab) -> None:
    hovered = tab.running.page.services.get(HoveredMode)
    before, number = tab.state, tab.running.page.session.history.step.number
    row_of_mode(tab, 6).scroll_into_view_if_needed()
    for mode in (6, 2):
        row_of_mode(tab, mode).hover()
        tab.wait_for(lambda mode=mode: hovered.row == mode, f"the ghost of mode {mode}")
    tab.wait_for(lambda: ghosts_shown(tab) == 1, "one ghost in the scene")
    assert tab.state == before
    assert tab.running.page.session.history.step.number == number
    tab.page.mouse.move(SIZE[0] // 2, 4)
    tab.wait_for(lambda: hovered.row is None, "no ghost")
    tab.wait_for(lambda: ghosts_shown(tab) == 0, "no ghost in the scene")
    # A row that is replaced under the pointer, since its numbers change, is left later too.
    row_of_mode(tab, 2).hover()
    tab.wait_for(lambda: hovered.row == 2, "the ghost")
    tab.running.page.session.do(SetPosition(0, 11.0))
    expect(row_of_mode(tab, 2)).to_contain_text("11.0")
    tab.page.mouse.move(SIZE[0] // 2, 4)
    tab.wait_for(lambda: hovered.row is None, "no ghost any more")


def test_keyboard_on_a_mode_shows_its_ghost_and_chooses_it(tab: Tab) -> None:
    hovered = tab.running.page.services.get(HoveredMode)
    tab.page.get_by_role("button", name="Other modes as ghosts").focus()
    for _ in range(3):
        tab.page.keyboard.press("Tab")
    tab.wait_for(lambda: hovered.row == 2, "the ghost of the row with the focus")
    tab.page.keyboard.press("Enter")
    tab.wait_for(lambda: tab.state.mode == 2, "that mode")


def row_of_mode(tab: Tab, mode: int) -> Locator:
    return tab.page.get_by_role("button", name=f"Mode {mode}, ")


def ghosts_shown(tab: Tab) -> int:
    return tab.page.evaluate(
        """() => Object.entries(window.__viserMutable.nodeRefFromName)
            .filter(([name, node]) => /^\\/ghosts\\/platform\\/\\d$/.test(name) && node?.visible)
            .length"""
    )


def test_lengths_that_cannot_close_leave_the_pose_and_offer_the_nearest(tab: Tab) -> None:
    alert = tab.page.get_by_role("alert").filter(has_text="cannot close")
    button = tab.page.get_by_role("button", name="Use the nearest length")
    expect(alert).to_be_hidden()
    expect(button).to_be_disabled()
    places = [tab.slider(words).bounding_box() for words in (LABELS[5], "x", "roll (°)")]

    before = tab.state
    tab.type(LABELS[0], "25")
    # Not the first digit alone, which does not close either.
    tab.wait_for(lambda: tab.state.joints[0] == 25.0, "the length that was typed")
    alert.wait_for()
    unclosed = tab.state.unclosed
    assert unclosed is not None
    assert tab.state.pose == before.pose
    nearest = cast("float", unclosed.nearest)
    expect(alert).to_contain_text(f"{nearest:.6g}")
    # The message has room that was kept for it.
    after = [tab.slider(words).bounding_box() for words in (LABELS[5], "x", "roll (°)")]
    assert after == places
    # What was asked for stays in its field; all else is as it was.
    assert_page_shows_state(tab)

    button.click()
    expect(alert).to_be_hidden()
    expect(button).to_be_disabled()
    assert tab.state.unclosed is None
    # The nearest length that closes is singular: the one taken stops short of it, and says so.
    assert tab.state.joints[0] < nearest
    assert Frame(tab.state).verdict.kind == "clear"
    expect(tab.page.get_by_role("status").filter(has_text="stays clear")).to_be_visible()
    np.testing.assert_allclose(
        joints_of(tab.state.design, tab.state.pose), tab.state.joints, atol=1e-6
    )
    assert_page_shows_state(tab)


def test_a_track_holds_still_while_its_slider_is_dragged(tab: Tab) -> None:
    # Beyond what is possible, so that the track is longer than it would be of itself.
    tab.field("x").fill("60")
    tab.page.keyboard.press("Enter")
    tab.wait_until_shown("x", 60.0)
    thumb = tab.slider("x")
    ends: list[tuple[str | None, str | None]] = []
    at, track = thumb.bounding_box(), tab.row("x").locator(TRACK).bounding_box()
    assert at is not None
    assert track is not None
    y = at["y"] + 0.5 * at["height"]
    tab.page.mouse.move(at["x"] + 0.5 * at["width"], y)
    tab.page.mouse.down()
    for share in (0.8, 0.5, 0.3, 0.4):
        tab.page.mouse.move(track["x"] + share * track["width"], y, steps=4)
        settle(tab.page, tab.client)
        ends.append((thumb.get_attribute("aria-valuemin"), thumb.get_attribute("aria-valuemax")))
    tab.page.mouse.up()
    assert ends == [ends[0]] * len(ends)
    assert float(ends[0][1] or "") == 60.0
    # Once something else moves it, the track is what is possible again.
    tab.push("Home pose")
    tab.wait_for(lambda: thumb.get_attribute("aria-valuemax") == "21", "the track of before")


def test_the_tint_of_a_track_covers_what_closes(tab: Tab) -> None:
    """Where the track is tinted is read from the places of the marks, as the stylesheet does."""
    for joint, words in enumerate(LABELS):
        row = tab.row(words)
        track = row.locator(".mantine-Slider-track").bounding_box()
        assert track is not None
        low, high = (
            float(tab.slider(words).get_attribute(f"aria-value{end}") or "")
            for end in ("min", "max")
        )
        marks = [mark.bounding_box() for mark in row.locator(".mantine-Slider-markWrapper").all()]
        places = [
            low + (high - low) * (mark["x"] - track["x"]) / track["width"] for mark in marks if mark
        ]
        intervals = Frame(tab.state).snapshot.intervals[joint]
        expected = [min(max(end, low), high) for interval in intervals for end in interval]
        # A pixel is a hundredth of the track.
        assert places == pytest.approx(expected, abs=0.01 * (high - low))


def test_home_brings_back_the_home_pose(tab: Tab) -> None:
    tab.type("z", "6.5")
    tab.wait_for(lambda: tab.state.pose.position[2] == 6.5, "the z that was typed")
    tab.push("Home pose")
    home = home_pose(tab.state.design)
    tab.wait_for(lambda: tab.state.pose == home, "the home pose")
    assert_page_shows_state(tab)


@pytest.mark.parametrize("axis", [1, 2])
def test_dragging_an_arrow_of_the_gizmo_moves_the_platform_along_it(tab: Tab, axis: int) -> None:
    # Large enough for the hand to be as exact as asked for below.
    tab.page.set_viewport_size({"width": 1280, "height": 720})
    tab.look_from("isometric")
    before = tab.state
    placed = Placed(Frame(before))
    arrow = before.pose.rotation[:, axis]
    tip = placed.points["b4"] + 0.7 * ARROW_LENGTH * arrow
    mouse = tab.page.mouse
    mouse.move(*tab.on_screen(tip))
    mouse.down()
    mouse.move(*tab.on_screen(tip + 1.5 * arrow), steps=8)
    mouse.up()
    tab.wait_for(lambda: tab.state.pose != before.pose, "another pose")
    tab.picture()
    moved = placed.scale * (np.array(tab.state.pose.position) - before.pose.position)
    assert moved @ arrow == pytest.approx(1.5, abs=0.3)
    np.testing.assert_allclose(moved, (moved @ arrow) * arrow, atol=1e-3)
    np.testing.assert_allclose(tab.state.pose.rotation, before.pose.rotation, atol=1e-6)
    assert_page_shows_state(tab)


def test_a_reload_keeps_the_state(tab: Tab) -> None:
    tab.type(LABELS[2], "9.9")
    tab.wait_for(lambda: tab.state.joints[2] == 9.9, "the length that was typed")
    before = tab.state
    tab.reload()
    assert tab.state == before
    assert_page_shows_state(tab)


def test_two_tabs_stay_in_step(open_tab: OpenTab) -> None:
    one, other = open_tab(), open_tab()
    one.type(LABELS[3], "11.2")
    other.wait_until_shown(LABELS[3], 11.2)
    other.type("x", "9.5")
    one.wait_until_shown("x", 9.5)
    for tab in (one, other):
        assert_page_shows_state(tab)


def test_sixty_values_in_a_row_end_with_the_last_in_every_tab(open_tab: OpenTab) -> None:
    one, other = open_tab(), open_tab()
    field = one.field(LABELS[5])
    for hundredths in range(1241, 1301):
        field.fill(f"{hundredths / 100:g}")
    for tab in (one, other):
        tab.wait_until_shown(LABELS[5], 13.0)
    one.wait_for(lambda: one.state.joints[5] == 13.0, "the last length")
    for tab in (one, other):
        assert_page_shows_state(tab)


def test_a_slider_thrown_about_ends_where_the_mouse_left_it_in_every_tab(open_tab: OpenTab) -> None:
    one, other = open_tab(), open_tab()
    goal = one.drag("x", 0.62, steps=60)
    one.wait_for(lambda: abs(one.state.pose.position[0] - goal) < 0.4, "the x dragged to")
    assert one.running.page.session.wait_until_idle()
    for tab in (one, other):
        assert_page_shows_state(tab)
    assert abs(one.state.pose.position[0] - goal) < 0.4
