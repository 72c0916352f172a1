"""Changing the design in a real page: presets, variables, limits, the sketch."""

from __future__ import annotations

import re

import numpy as np
import pytest
from playwright.sync_api import Locator, expect
from tab import TRACK, Tab, middle

from explorer.app.screenshot import SCENE_CANVAS
from explorer.app.state.state import joints_of, open_state
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


def test_design_is_opened_changed_by_a_variable_and_reset_in_its_pose(tab: Tab) -> None:
    card = tab.page.locator(".ex-change-card")
    expect(card).to_have_count(0)
    tab.choose("Preset", "paper-initial")
    tab.wait_for(lambda: tab.state.design == INITIAL, "the preset")
    assert tab.state.pose == open_state(INITIAL).pose
    assert_variables_shown(tab)
    tab.choose("Preset", "paper-optimal")
    tab.wait_for(lambda: tab.state.design == OPTIMAL, "the other preset")
    assert tab.state.pose == open_state(OPTIMAL).pose
    # The pose is held, and the legs change.
    before = tab.state
    goal = tab.drag("b1x", 0.6)
    tab.wait_for(lambda: abs(tab.state.design.b1[0] - goal) < 0.5, "the b1x dragged to")
    assert_variables_shown(tab)
    state = tab.state
    assert state.pose == before.pose
    assert state.joints == pytest.approx(joints_of(state.design, state.pose))
    assert state.joints[0] != before.joints[0]
    # It is none of the presets any more.
    expect(tab.row("Preset").get_by_role("combobox")).to_have_value("—")
    # The differences last while the camera is turned, until a press outside of the scene.
    for name in ("Volume", "Reach", "Clearance here"):
        expect(card).to_contain_text(name)
    scene = tab.page.locator(SCENE_CANVAS).bounding_box()
    assert scene is not None
    x, y = scene["x"] + 0.5 * scene["width"], scene["y"] + 0.9 * scene["height"]
    tab.page.mouse.move(x, y)
    tab.page.mouse.down()
    tab.page.mouse.move(x + 20.0, y)
    tab.page.mouse.up()
    tab.settle()
    expect(card).to_contain_text("Reach")
    tab.turn_to("Machine")
    expect(card).to_have_count(0)
    tab.turn_to("Design")
    tab.push("Reset")
    tab.wait_for(lambda: tab.state.design == OPTIMAL, "the design as it was opened")
    assert tab.state.pose == open_state(OPTIMAL).pose
    assert_variables_shown(tab)


@pytest.fixture
def limits(tab: Tab) -> Tab:
    """A tab turned to the limits of the design."""
    # The test before may have left them open.
    tab.settle()
    if not tab.label("l1").is_visible():
        tab.page.get_by_text("Limits (units)", exact=True).click()
    tab.label("l1").wait_for()
    return tab


def type_end(tab: Tab, words: str, end: int, text: str) -> None:
    """Type the lower end (0) or the upper end (1) of a range."""
    tab.field(f"{words} ends").nth(end).fill(text)
    tab.page.keyboard.press("Tab")


def thumbs(tab: Tab, words: str) -> Locator:
    """Return the thumbs of a range."""
    # The sliders' own label names no input, so that their row is found by its parts.
    row = tab.label(words).locator("xpath=ancestor::*[.//*[contains(@class, 'multi-slider')]][1]")
    return row.locator(".multi-slider-thumb")


def drag_thumb(tab: Tab, words: str, end: int, by: float) -> None:
    """Drag a thumb of a range by pixels."""
    x, y = tab.grab(thumbs(tab, words).nth(end))
    tab.page.mouse.move(x + by, y, steps=12)
    tab.page.mouse.up()


def test_end_that_is_typed_is_a_limit_and_is_disabled_where_nothing_is_bounded(
    limits: Tab,
) -> None:
    type_end(limits, "l1", 1, "11")
    limits.wait_for(lambda: limits.state.design.limits.l1 == (0.0, 11.0), "the maximum")
    expect(limits.page.get_by_text("1 broken")).to_be_visible()
    # The others are the reach still, and so is that of a leg whose minimum alone changes.
    type_end(limits, "d2", 0, "2.5")
    limits.wait_for(lambda: limits.state.design.limits.d2 == (2.5, None), "the minimum")
    assert limits.state.design.limits.l4 == (0.0, None)
    reach = limits.row("Maxima at the reach").locator("input[type=checkbox]")
    expect(reach).not_to_be_checked()
    limits.switch("Maxima at the reach", on=True)
    limits.wait_for(lambda: limits.state.design.limits.l1 == (0.0, None), "at the reach")
    field = limits.field("d1, d3 ends").first
    expect(field).to_be_disabled()
    limits.switch("Bounded guide", on=True)
    limits.wait_for(lambda: limits.state.design.limits.guide is not None, "a guide")
    expect(field).to_be_enabled()
    type_end(limits, "d1, d3", 0, "2")
    limits.wait_for(lambda: (limits.state.design.limits.guide or (0, 0))[0] == 2.0, "its end")
    # The names of what is side by side tell which is which.
    expect(limits.page.get_by_role("textbox", name="d1, d3 least", exact=True)).to_have_value("2")


def test_thumb_stops_at_the_other_and_a_typed_end_pushes_it(limits: Tab) -> None:
    def x_range() -> tuple[float, float]:
        box = limits.state.design.limits.box
        assert box is not None
        return box[0][0], box[1][0]

    assert x_range() == (0.0, 20.0)
    drag_thumb(limits, "b4 x", 0, 400.0)
    limits.wait_for(lambda: x_range()[0] > 19.0, "a thumb at the other")
    assert x_range()[0] <= 20.0
    assert x_range()[1] == 20.0
    # An end that is typed before the page shows the answer would cross with it.
    expect(limits.field("b4 x ends").nth(0)).to_have_value(re.compile("^(19|20)"))
    type_end(limits, "b4 x", 1, "5")
    limits.wait_for(lambda: x_range() == (5.0, 5.0), "both ends at the typed one")
    expect(limits.field("b4 x ends").nth(0)).to_have_value("5")
    type_end(limits, "b4 x", 0, "-40")
    limits.wait_for(lambda: x_range() == (-40.0, 5.0), "an end beyond the track")
    # The track has become longer, and the thumbs stand in it.
    limits.wait_for(
        lambda: np.ptp([middle(each)[0] for each in thumbs(limits, "b4 x").all()]) > 5.0,
        "thumbs apart",
    )
    drag_thumb(limits, "b4 x", 1, 10.0)
    limits.wait_for(lambda: x_range()[1] > 5.0, "the upper thumb dragged")
    assert x_range()[0] == -40.0


def test_row_in_use_is_marked_in_the_sketch_and_its_hint_stands_beside_the_panel(
    tab: Tab,
) -> None:
    dimension = tab.page.locator(".ex-sketch [data-variable=b1x] text")
    plain = dimension.evaluate("each => getComputedStyle(each).fill")

    def is_marked() -> bool:
        return bool(dimension.evaluate("each => getComputedStyle(each).fill") != plain)

    assert not is_marked()
    tab.row("b1x").locator(TRACK).hover()
    tab.wait_for(is_marked, "the variable under the pointer")
    tab.field("b1y").focus()
    tab.wait_for(lambda: not is_marked(), "the variable with the focus")
    tab.field("b1x").focus()
    tab.wait_for(is_marked, "this one with the focus")
    # Drawn anew as the design changes, it still is.
    tab.field("b1x").fill("3")
    tab.page.keyboard.press("ArrowUp")
    tab.wait_for(lambda: tab.state.design.b1[0] > 3.0, "another design")
    tab.settle()
    assert is_marked()
    tab.row("b2").locator(TRACK).hover()
    row = tab.row("b2").bounding_box()
    assert row is not None

    def is_beside() -> bool:
        # The hint of the row before may still be there.
        box = tab.page.get_by_role("tooltip").last.bounding_box()
        return (
            box is not None
            # The panel is on the left, and the scene beside it.
            and box["x"] > row["x"] + row["width"]
            and box["y"] < row["y"] + row["height"]
            and row["y"] < box["y"] + box["height"]
        )

    tab.wait_for(is_beside, "the hint beside its row")
    # Without the focus in a row, the pointer's is marked, which has not moved.
    assert is_marked()
    tab.field("b1x").blur()
    tab.wait_for(lambda: not is_marked(), "no mark of the row that has lost the focus")
    expect(tab.page.locator(".ex-sketch .is-here")).to_have_attribute("data-variable", "b2")
