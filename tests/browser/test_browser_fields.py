"""Number fields in a real page: what is typed counts once it is entered, and as a whole."""

from __future__ import annotations

from typing import Any

import pytest
from playwright.sync_api import expect
from tab import Tab

from explorer.app.actions import SetPosition
from explorer.app.screenshot import settle


def words_of_steps(tab: Tab) -> list[str]:
    return [step.words for step in tab.running.page.session.history.steps]


# What is typed, how it is entered, and the number that it is.
ENTERED = (
    # Beyond both ends of the slider, whose range follows.
    ("-100", "Tab", -100.0),
    ("100", "Tab", 100.0),
    ("1.5e1", "Enter", 15.0),
    ("3,25", "Tab", 3.25),
    # As the explorer itself writes it.
    ("−4.5", "Enter", -4.5),
    (".5", "Tab", 0.5),
)
NO_NUMBERS = ("abc", "", "-", "1e", "1.2.3", "1e400", "9" * 30)


def test_a_number_is_taken_whole_and_is_one_step(tab: Tab) -> None:
    for text, key, value in ENTERED:
        before = len(words_of_steps(tab))
        tab.field("x").fill(text)
        tab.page.keyboard.press(key)
        tab.wait_for(lambda value=value: tab.state.pose.position[0] == value, f"x = {value}")
        tab.wait_until_shown("x", value)
        # Within a moment of each other, numbers of one field are one step.
        assert len(words_of_steps(tab)) in (before, before + 1)


def test_what_comes_from_the_explorer_meanwhile_does_not_wipe_what_is_typed(tab: Tab) -> None:
    """A range that followed the number before, a moment later, drew the field anew."""
    gui: Any = tab.running.viser.gui
    inputs: list[Any] = list(gui._gui_input_handle_from_uuid.values())
    # The first of that name is the slider of the pose.
    slider = next(each for each in inputs if each.label == "x")
    field = tab.field("x")
    settle(tab.page, tab.client)
    # No pause enters a number that is written in another way than the explorer's.
    field.fill("3,2")
    slider.max += 1.0
    settle(tab.page, tab.client)
    expect(field).to_have_value("3,2")
    tab.page.keyboard.type("5")
    slider.max += 1.0
    settle(tab.page, tab.client)
    tab.page.keyboard.press("Tab")
    tab.wait_for(lambda: tab.state.pose.position[0] == 3.25, "x = 3.25")
    # Drawn before one goes on: what is drawn while all is selected takes the selection away.
    tab.wait_until_shown("x", 3.25)
    settle(tab.page, tab.client)
    # Given up, the field shows what the explorer has by now, not what it had at first.
    field.fill("abc")
    tab.running.page.session.do(SetPosition(0, 2.5))
    tab.wait_for(lambda: tab.shown("x") == 2.5, "x = 2.5")
    settle(tab.page, tab.client)
    expect(field).to_have_value("abc")
    tab.page.keyboard.press("Tab")
    expect(field).to_have_value("2.5")


def test_what_is_no_number_or_given_up_brings_back_what_was_there(tab: Tab) -> None:
    before = tab.state
    tab.wait_until_shown("x", before.pose.position[0])
    for text in NO_NUMBERS:
        tab.field("x").fill(text)
        tab.page.keyboard.press("Tab")
        tab.wait_until_shown("x", before.pose.position[0])
    assert len(words_of_steps(tab)) == 1
    # Escape goes back even beyond what a pause has entered.
    tab.type("x", "7")
    tab.wait_for(lambda: tab.state.pose.position[0] == 7.0, "x after a pause")
    tab.page.keyboard.type("5")
    tab.page.keyboard.press("Escape")
    tab.wait_until_shown("x", before.pose.position[0])
    tab.page.keyboard.press("Tab")
    tab.wait_for(lambda: tab.state.pose == before.pose, "the pose of before")


def test_a_pause_enters_a_number_and_so_do_a_click_elsewhere_and_an_arrow(tab: Tab) -> None:
    tab.type("x", "7.25")
    tab.wait_for(lambda: tab.state.pose.position[0] == 7.25, "x after a pause")
    assert tab.field("x").evaluate("field => field === document.activeElement")
    # The caret is where it was, so that one may go on.
    tab.page.keyboard.type("5")
    tab.field("y").click()
    tab.wait_until_shown("x", 7.25, 0.01)
    tab.type("x", "8")
    tab.field("y").click()
    tab.wait_for(lambda: tab.state.pose.position[0] == 8.0, "x after a click elsewhere")
    assert tab.field("y").evaluate("field => field === document.activeElement")
    # From what was typed it steps on.
    tab.type("x", "5")
    tab.page.keyboard.press("ArrowUp")
    tab.wait_for(lambda: tab.state.pose.position[0] == pytest.approx(5.01), "a step up")


def test_a_field_that_was_left_takes_no_focus_with_its_next_number(tab: Tab) -> None:
    """Told of nothing, the page took it for the one that is typed into."""
    numbers = iter((8.0, 2.5, 3.25, 4.75))
    for leave in (lambda: tab.page.keyboard.press("Tab"), tab.field("y").click):
        tab.type("x", f"{next(numbers):g}")
        leave()
        settle(tab.page, tab.client)
        value = next(numbers)
        tab.running.page.session.do(SetPosition(0, value))
        tab.wait_until_shown("x", value)
        settle(tab.page, tab.client)
        assert not tab.field("x").evaluate("field => field === document.activeElement")
        expect(tab.field("x")).to_have_value(f"{value:g}")
    # A hand gives it the focus at once, and so do its arrows.
    tab.type("x", "5")
    tab.wait_for(lambda: tab.state.pose.position[0] == 5.0, "x = 5")
    tab.turn_to("Design")
    unit = "1 unit (mm)"
    tab.type(unit, "5")
    tab.page.keyboard.press("Tab")
    tab.wait_for(lambda: tab.state.design.unit_mm == 5.0, "5 mm")
    tab.row(unit).locator("[data-direction=up]").click()
    tab.wait_for(lambda: tab.state.design.unit_mm == pytest.approx(5.001), "a step up")
    assert tab.field(unit).evaluate("field => field === document.activeElement")


def test_a_refused_number_is_told_once_and_leaves_no_step(tab: Tab) -> None:
    before = tab.state.pose
    tab.field("x").fill("999999999999")
    tab.page.keyboard.press("Tab")
    told = tab.page.get_by_text("too far to be drawn")
    told.wait_for()
    tab.wait_until_shown("x", before.position[0])
    assert told.count() == 1
    assert tab.state.pose == before
    assert len(words_of_steps(tab)) == 1


def test_the_paper_s_own_numbers_can_be_typed(tab: Tab) -> None:
    tab.turn_to("Design")
    for name, value in (("a3x", 18.9372), ("b1y", -3.1415)):
        tab.type(name, str(value))
        tab.page.keyboard.press("Tab")
        tab.wait_for(lambda name=name, value=value: tab.stands(name, value), f"{name} = {value}")
    assert tab.state.design.a3[0] == 18.9372
    assert tab.state.design.b1[1] == -3.1415
