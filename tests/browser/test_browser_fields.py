"""Number fields in a real page: what is typed counts once it is entered, and as a whole."""

from __future__ import annotations

from contextlib import closing
from typing import Any

import numpy as np
import pytest
from monkey import explorer_with_data
from playwright.sync_api import Browser, expect
from tab import Tab

from explorer.app.screenshot import settle
from explorer.app.state.actions import SetPosition


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
# Types faster than controls send, and presses a button, as seen by a page that was busy meanwhile.
TYPE_AND_PRESS = """(field, button) => {
    const write = Object.getOwnPropertyDescriptor(HTMLInputElement.prototype, "value").set;
    for (const text of ["a", "ab", "abc", "abcd"]) {
        write.call(field, text);
        field.dispatchEvent(new Event("input", { bubbles: true }));
    }
    button.click();
}"""
NO_NUMBERS = ("abc", "", "-", "1e", "1.2.3", "1e400", "9" * 30)


def test_a_number_is_taken_whole_and_is_one_step(tab: Tab) -> None:
    for text, key, value in ENTERED:
        before = len(words_of_steps(tab))
        tab.field("x").fill(text)
        tab.page.keyboard.press(key)
        tab.wait_for(lambda value=value: tab.state.pose.position[0] == value, f"x = {value}")
        tab.wait_until_shown("x", value)
        # Drawn before one goes on: what is drawn while all is selected takes the selection away.
        settle(tab.page, tab.client)
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


def test_enter_leaves_a_field_so_that_the_next_key_is_a_command(browser: Browser) -> None:
    with explorer_with_data() as running, closing(Tab(browser, running)) as tab:
        # Typed, typed and entered by a pause before, and not typed at all.
        for text, wait in (("5", 0), ("7", 1000), ("", 0)):
            tab.field("x").click()
            if text:
                tab.page.keyboard.press("ControlOrMeta+a")
                tab.page.keyboard.type(text)
            tab.page.wait_for_timeout(wait)
            tab.page.keyboard.press("Enter")
            before = tab.state.view.grid
            tab.page.keyboard.press("g")
            tab.wait_for(lambda before=before: tab.state.view.grid != before, "the grid")
            assert tab.state.pose.position[0] == float(text or 7)
            tab.wait_until_shown("x", float(text or 7))
        # What comes from the explorer later does not take the keys back.
        tab.running.page.session.do(SetPosition(0, 4.0))
        tab.wait_until_shown("x", 4.0)
        tab.page.keyboard.press("g")
        tab.wait_for(lambda: tab.state.view.grid, "the grid again")
        tab.open_dialog("Designs")
        name = tab.row("Name").locator("input")
        name.fill("mine")
        tab.page.keyboard.press("Enter")
        tab.page.keyboard.press("g")
        tab.wait_for(lambda: not tab.state.view.grid, "no grid")
        assert tab.state.design.name == "mine"
        assert tab.complaints() == []


def emptied(tab: Tab, words: str) -> None:
    tab.field(words).click()
    tab.page.keyboard.press("ControlOrMeta+a")
    tab.page.keyboard.press("Delete")


def test_an_emptied_field_gets_back_what_the_explorer_has_by_then(tab: Tab) -> None:
    tab.type("x", "5")
    for key in ("ArrowUp", "ArrowUp"):
        tab.page.keyboard.press(key)
    tab.wait_for(lambda: tab.state.pose.position[0] == pytest.approx(5.02), "two steps up")
    stepped = tab.state.pose
    # It may be another hand's.
    for meanwhile in (None, 4.0):
        if meanwhile is not None:
            tab.running.page.session.do(SetPosition(0, meanwhile))
        value = stepped.position[0] if meanwhile is None else meanwhile
        tab.wait_until_shown("x", value)
        settle(tab.page, tab.client)
        emptied(tab, "x")
        tab.page.keyboard.press("Tab")
        # What is done next is done after it would have been.
        tab.type("z", f"{8.0 if meanwhile is None else 7.0:g}")
        tab.page.keyboard.press("Tab")
        tab.wait_for(lambda: tab.state.pose.position[2] < 9.0, "z")
        assert tab.state.pose.position[0] == value


def test_undo_in_a_field_is_the_explorer_s(tab: Tab) -> None:
    """The browser's own undid what was written into its fields, of whichever it was."""
    before = tab.state.pose
    undo = "ControlOrMeta+z"
    field = tab.field("y")
    field.click()
    for key in ("End", *4 * ("Backspace",)):
        tab.page.keyboard.press(key)
    tab.page.keyboard.type("6.5")
    tab.page.keyboard.press("Enter")
    tab.wait_for(lambda: tab.state.pose.position[1] == 6.5, "y = 6.5")
    # What is half typed goes first.
    field.click()
    tab.page.keyboard.type("7,")
    tab.page.keyboard.press(undo)
    expect(field).to_have_value("6.5")
    assert tab.state.pose.position[1] == 6.5
    tab.page.keyboard.press(undo)
    tab.wait_for(lambda: tab.state.pose == before, "undone")
    tab.wait_until_shown("y", before.position[1])
    for _ in range(3):
        tab.page.keyboard.press(undo)
    tab.page.keyboard.press("ControlOrMeta+y")
    tab.wait_for(lambda: tab.state.pose.position[1] == 6.5, "redone")
    assert words_of_steps(tab)[1:] == ["y = 6.5"]


@pytest.mark.parametrize(
    ("text", "value"), [("3,25", 3.25), ("1,234.5", None), ("3,25 mm", None), ("−2", -2.0)]
)
def test_what_is_pasted_counts_as_if_it_was_typed(tab: Tab, text: str, value: float | None) -> None:
    before = tab.state.pose.position[0]
    tab.page.context.grant_permissions(["clipboard-read", "clipboard-write"])
    tab.page.evaluate("text => navigator.clipboard.writeText(text)", text)
    for empties in (True, False):
        if empties:
            emptied(tab, "x")
        else:
            tab.field("x").click()
            tab.page.keyboard.press("ControlOrMeta+a")
        tab.page.keyboard.press("ControlOrMeta+v")
        expect(tab.field("x")).to_have_value(text)
        tab.page.keyboard.press("Tab")
        expected = before if value is None else value
        tab.wait_until_shown("x", expected)
        tab.wait_for(lambda expected=expected: tab.state.pose.position[0] == expected, text)
    assert len(words_of_steps(tab)) == (1 if value is None else 2)


def test_an_input_method_is_not_disturbed_and_its_digits_count(tab: Tab) -> None:
    methods: Any = tab.page.context.new_cdp_session(tab.page)
    tab.field("x").click()
    tab.page.keyboard.press("ControlOrMeta+a")
    for text in ("３", "３２", "３２．５"):
        ends = {"selectionStart": len(text), "selectionEnd": len(text)}
        methods.send("Input.imeSetComposition", {"text": text, **ends})
    tab.page.wait_for_timeout(900)
    expect(tab.field("x")).to_have_value("３２．５")
    methods.send("Input.insertText", {"text": "３２．５"})
    tab.page.keyboard.press("Enter")
    tab.wait_for(lambda: tab.state.pose.position[0] == 32.5, "x = 32.5")


def test_a_name_may_hold_blanks_and_be_typed_anew(browser: Browser) -> None:
    with explorer_with_data() as running:
        tab = Tab(browser, running)
        tab.open_dialog("Designs")
        name = tab.row("Name").locator("input")

        def named(expected: str) -> None:
            tab.wait_for(lambda: tab.state.design.name == expected, expected)
            tab.wait_for(lambda: name.input_value() == expected, expected)

        name.click()
        tab.page.keyboard.press("ControlOrMeta+a")
        # Slowly enough for what comes back meanwhile.
        tab.page.keyboard.type("two words ", delay=100)
        tab.page.keyboard.press("Tab")
        named("two words")
        name.click()
        tab.page.keyboard.press("ControlOrMeta+a")
        tab.page.keyboard.press("Delete")
        settle(tab.page, tab.client)
        tab.page.keyboard.type("fresh", delay=100)
        named("fresh")
        # Left empty it has the name that it had when one came to it.
        for _ in "fresh":
            tab.page.keyboard.press("Backspace")
        tab.page.keyboard.press("Tab")
        named("two words")
        expect(tab.page.get_by_text("needs a name")).to_have_count(0)
        assert tab.complaints() == []
        tab.close()


def test_a_button_pressed_right_after_typing_gets_the_last_of_it(browser: Browser) -> None:
    with explorer_with_data() as running:
        tab = Tab(browser, running)
        tab.open_dialog("Designs")
        saves = tab.page.get_by_role("button", name="Save", exact=True)
        tab.row("Name").locator("input").evaluate(TYPE_AND_PRESS, saves.element_handle())
        tab.page.get_by_text("Saved.", exact=True).wait_for()
        tab.wait_for(lambda: tab.state.design.name == "abcd", "the name")
        expect(tab.page.get_by_role("button", name="Duplicate abcd")).to_be_visible()
        assert tab.complaints() == []
        tab.close()


def test_arrows_on_a_slider_leave_the_camera(tab: Tab) -> None:
    tab.drag("x", 0.5)
    settle(tab.page, tab.client)
    eye, x = tab.client.camera.position.copy(), tab.shown("x")
    for _ in range(4):
        tab.page.keyboard.press("ArrowRight", delay=90)
    tab.wait_for(lambda: tab.shown("x") > x, "a step to the right")
    settle(tab.page, tab.client)
    np.testing.assert_array_equal(tab.client.camera.position, eye)
    # Over the scene they turn it.
    tab.page.mouse.click(430, 240)
    # A slow frame may take longer than a short press.
    tab.page.keyboard.down("ArrowRight")
    tab.wait_for(lambda: np.abs(tab.client.camera.position - eye).max() > 1.0, "a turn")
    tab.page.keyboard.up("ArrowRight")


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
    # A browser shows what was typed before the explorer has heard of it.
    tab.wait_for(lambda: tab.state.design.a3[0] == 18.9372, "a3x as it was typed")
    tab.wait_for(lambda: tab.state.design.b1[1] == -3.1415, "b1y as it was typed")
