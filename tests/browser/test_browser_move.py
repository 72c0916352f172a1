"""Moving the mechanism in a real page: by sliders, fields, modes and the gizmo."""

from __future__ import annotations

from typing import cast

import numpy as np
import pytest
from kept_tab import OpenTab
from likeness import decoded, likeness
from playwright.sync_api import Locator, expect
from tab import SIZE, TRACK, Tab

from explorer.app.features.mechanism.feature import JOINT_HINTS
from explorer.app.features.mechanism.marks import ARROW_LENGTH
from explorer.app.features.mechanism.modes import mode_hover
from explorer.app.scene.placing import Placed
from explorer.app.state.frame import Frame
from explorer.app.state.moves import set_position
from explorer.app.state.state import State, joints_of
from explorer.mechanism.kinematics import forward
from explorer.numerics.arrays import FloatArray

LABELS = list(JOINT_HINTS)
# The sliders by the words that show them.
SLIDERS = {"Leg lengths": LABELS, "Pose": ["x", "y", "z", "yaw (°)", "pitch (°)", "roll (°)"]}


def assert_page_shows_state(tab: Tab) -> None:
    """Wait until every slider of legs and pose, which are left shown, stands as the state says."""
    # A slow browser may still be telling of a hand: what it shows in the end is meant.
    for words, labels in SLIDERS.items():
        tab.push(words)
        for index, label in enumerate(labels):
            tab.slider(label).wait_for()
            tab.wait_for(
                lambda words=words, index=index, label=label: tab.stands(
                    label, values_of(tab.state)[words][index]
                ),
                f"{label} as in the state",
            )


def values_of(state: State) -> dict[str, tuple[float, ...]]:
    return {
        "Leg lengths": state.joints,
        "Pose": (*state.pose.position, *state.yaw_pitch_roll),
    }


@pytest.mark.draws
def test_page_loaded_again_shows_and_draws_the_same_and_asks_nobody_else(tab: Tab) -> None:
    # Of a mesh that has got another shape, three.js may keep drawing the first one.
    drawn = decoded(tab.picture())
    tab.reload()
    assert likeness(drawn, decoded(tab.picture())).spot < 2.0
    tab.push("Leg lengths")
    tab.type(LABELS[2], "9.9\n")
    tab.wait_for(lambda: tab.state.joints[2] == 9.9, "the length that was typed")
    before = tab.state
    tab.reload()
    assert tab.state == before
    assert_page_shows_state(tab)
    own = (tab.running.url, f"blob:{tab.running.url}", "data:")
    assert [url for url in tab.requests if not url.startswith(own)] == []
    assert tab.complaints() == []


def test_row_of_a_mode_shows_its_ghost_while_it_is_pointed_at_and_is_chosen(tab: Tab) -> None:
    session, hovered = tab.running.page.session, tab.running.page.services.get(mode_hover)
    before, number = tab.state, session.history.step.number
    tab.unfold("8 modes")
    row_of_mode(tab, 6).scroll_into_view_if_needed()
    for mode in (6, 2):
        row_of_mode(tab, mode).hover()
        tab.wait_for(lambda mode=mode: hovered.row == mode, f"the ghost of mode {mode}")
    tab.wait_for(lambda: ghosts_in_scene(tab) == 1, "one ghost in the scene")
    assert tab.state == before
    assert session.history.step.number == number
    tab.page.mouse.move(SIZE[0] // 2, 4)
    tab.wait_for(lambda: hovered.row is None, "no ghost")
    tab.wait_for(lambda: ghosts_in_scene(tab) == 0, "no ghost in the scene")
    # A row that is replaced under the pointer, since its numbers change, is left later too.
    row_of_mode(tab, 2).hover()
    tab.wait_for(lambda: hovered.row == 2, "the ghost")
    session.do(set_position(0, 11.0))
    expect(row_of_mode(tab, 2)).to_contain_text("11.0")
    tab.page.mouse.move(SIZE[0] // 2, 4)
    tab.wait_for(lambda: hovered.row is None, "no ghost any more")
    # A press keeps the legs and takes that assembly.
    before = tab.state
    other = before.mode ^ 0b101
    tab.settle()
    row_of_mode(tab, other).click()
    tab.wait_for(lambda: tab.state.mode == other, "the mode that was chosen")
    solution = forward(before.design, before.joints)
    np.testing.assert_allclose(tab.state.pose.position, solution.position[other], atol=1e-9)
    np.testing.assert_allclose(tab.state.joints, before.joints, atol=1e-9)
    assert_page_shows_state(tab)
    # The keyboard does the same.
    tab.settle()
    tab.page.get_by_role("button", name="Other modes as ghosts").focus()
    for _ in range(3):
        tab.page.keyboard.press("Tab")
    tab.wait_for(lambda: hovered.row == 2, "the ghost of the row with the focus")
    tab.page.keyboard.press("Enter")
    tab.wait_for(lambda: tab.state.mode == 2, "the mode of the row with the focus")


def test_row_with_the_focus_keeps_its_ghost_until_the_pointer_moves(tab: Tab) -> None:
    hovered = tab.running.page.services.get(mode_hover)
    tab.unfold("8 modes")
    row_of_mode(tab, 6).scroll_into_view_if_needed()
    row_of_mode(tab, 6).hover()
    tab.wait_for(lambda: hovered.row == 6, "the ghost of the row under the pointer")
    tab.page.get_by_role("button", name="Other modes as ghosts").focus()
    for _ in range(3):
        tab.page.keyboard.press("Tab")
    tab.wait_for(lambda: hovered.row == 2, "the ghost of the row with the focus")
    # As a change of layout does under a pointer that rests, once beside a row and once on it.
    for place in (tab.page.get_by_role("button", name="Home pose"), row_of_mode(tab, 6)):
        place.dispatch_event("pointerover")
        tab.settle()
        assert hovered.row == 2
    row_of_mode(tab, 4).hover()
    tab.wait_for(lambda: hovered.row == 4, "the ghost of the row that the pointer moved to")
    tab.page.mouse.move(SIZE[0] // 2, 4)
    tab.wait_for(lambda: hovered.row == 2, "the ghost of the row that has kept the focus")


def row_of_mode(tab: Tab, mode: int) -> Locator:
    return tab.page.get_by_role("button", name=f"Mode {mode}, ")


def ghosts_in_scene(tab: Tab) -> int:
    return tab.page.evaluate(
        """() => Object.entries(window.__viserMutable.nodeRefFromName)
            .filter(([name, node]) => /^\\/ghosts\\/platform\\/\\d$/.test(name) && node?.visible)
            .length"""
    )


def test_length_that_cannot_close_leaves_the_pose_and_offers_the_nearest(tab: Tab) -> None:
    alert = tab.page.get_by_role("alert").filter(has_text="cannot close")
    button = tab.page.get_by_role("button", name="Use the nearest length")
    tab.push("Leg lengths")
    expect(alert).to_be_hidden()
    expect(button).to_be_disabled()
    below = tab.page.get_by_role("button", name="Home pose")
    tab.settle()
    place = below.bounding_box()

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
    assert below.bounding_box() == place
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


def test_track_is_tinted_where_the_legs_close_and_stays_while_it_is_dragged(tab: Tab) -> None:
    # Where it is tinted is read from the places of the marks, as the stylesheet does.
    tab.push("Leg lengths")
    tab.settle()
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
    # Beyond what is possible, so that the track is longer than it would be of itself.
    tab.push("Pose")
    tab.type("x", "60\n")
    tab.wait_until_shown("x", 60.0)
    tab.settle()
    thumb = tab.slider("x")
    ends: list[tuple[str | None, str | None]] = []
    _, y = tab.grab(thumb)
    track = tab.row("x").locator(TRACK).bounding_box()
    assert track is not None
    for share in (0.8, 0.3, 0.4):
        tab.page.mouse.move(track["x"] + share * track["width"], y, steps=4)
        tab.settle()
        ends.append((thumb.get_attribute("aria-valuemin"), thumb.get_attribute("aria-valuemax")))
    tab.page.mouse.up()
    assert ends == [ends[0]] * len(ends)
    assert float(ends[0][1] or "") == 60.0
    # Once something else moves it, the track is what is possible again.
    tab.push("Home pose")
    tab.wait_for(lambda: thumb.get_attribute("aria-valuemax") == "21", "the track of before")


def test_fold_is_dragged_to_its_walls_on_a_track_coloured_by_its_margin(tab: Tab) -> None:
    tab.page.get_by_role("button", name="Folds", exact=True).click()
    tab.slider("φ2 (°)").wait_for()
    expect(tab.slider("x")).to_have_count(0)
    before = Frame(tab.state).folds
    tab.settle()
    row = tab.row("φ2 (°)")
    track, strip = row.locator(".mantine-Slider-track").bounding_box(), None
    for each in tab.page.locator(".ex-track").all():
        box = each.bounding_box()
        if box and track and abs(box["y"] - track["y"]) < 2.0:
            strip = box
    assert track is not None
    assert strip is not None
    # Its colours go on a little beyond both ends of the track.
    end = track["height"]
    assert strip["x"] == pytest.approx(track["x"] - end, abs=0.2)
    assert strip["width"] == pytest.approx(track["width"] + 2.0 * end, abs=0.2)
    assert strip["height"] == pytest.approx(end, abs=0.2)
    for share, wall in ((0.0, -180.0), (1.0, 0.0)):
        tab.drag("φ2 (°)", share)
        tab.settle()
        assert Frame(tab.state).folds == (*before[:4], wall, before[5])
    tab.type("φ2 (°)", "-47.2\n")
    tab.wait_for(lambda: Frame(tab.state).folds[4] == -47.2, "the fold that was typed")
    assert Frame(tab.state).folds == (*before[:4], -47.2, before[5])


def test_arrow_of_the_gizmo_moves_the_platform_along_it(tab: Tab) -> None:
    # Large enough for the hand to be as exact as asked for below.
    tab.resize((1280, 720))
    tab.look_from("isometric")
    before = tab.state
    placed = Placed(Frame(before))
    arrow = before.pose.rotation[:, 1]
    tip = placed.points["b4"] + 0.7 * ARROW_LENGTH * arrow
    mouse = tab.page.mouse
    mouse.move(*tab.on_screen(tip))
    mouse.down()
    mouse.move(*tab.on_screen(tip + 1.5 * arrow), steps=8)
    mouse.up()

    def moved_by() -> FloatArray:
        return placed.scale * (np.array(tab.state.pose.position) - before.pose.position)

    # A slow browser may still be reporting the drag.
    tab.wait_for(lambda: abs(float(moved_by() @ arrow) - 1.5) < 0.3, "a platform as far along")
    tab.settle()
    np.testing.assert_allclose(moved_by(), (moved_by() @ arrow) * arrow, atol=1e-3)
    np.testing.assert_allclose(tab.state.pose.rotation, before.pose.rotation, atol=1e-6)
    assert_page_shows_state(tab)


def test_two_tabs_stay_in_step_through_many_values(open_tab: OpenTab) -> None:
    one, other = open_tab(), open_tab()
    one.push("Leg lengths")
    one.type(LABELS[3], "11.2\n")
    other.wait_until_shown(LABELS[3], 11.2)
    other.push("Pose")
    other.type("x", "9.5\n")
    one.wait_until_shown("x", 9.5)
    other.push("Home pose")
    one.wait_until_shown("x", 10.0)
    # Many values in a row end with the last.
    one.push("Leg lengths")
    field = one.field(LABELS[5])
    with one.slow_time():
        for hundredths in range(1281, 1301):
            field.fill(f"{hundredths / 100:g}")
        one.page.keyboard.press("Enter")
    one.wait_for(lambda: one.state.joints[5] == 13.0, "the last length")
    for tab in (one, other):
        tab.wait_until_shown(LABELS[5], 13.0)
    for tab in (one, other):
        assert_page_shows_state(tab)
    # A slider that is thrown about ends where the mouse leaves it.
    goal = one.drag("x", 0.62, steps=20)
    one.wait_for(lambda: abs(one.state.pose.position[0] - goal) < 0.4, "the x dragged to")
    for tab in (one, other):
        assert_page_shows_state(tab)
    assert abs(one.state.pose.position[0] - goal) < 0.4
