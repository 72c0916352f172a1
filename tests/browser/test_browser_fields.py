"""Number fields in a real page: what is typed counts once it is entered, and as a whole."""

from __future__ import annotations

from typing import Any

import numpy as np
import pytest
from playwright.sync_api import expect
from tab import Tab

from explorer.app.state.actions import Set
from explorer.app.state.moves import set_position


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


def replace_all(tab: Tab, words: str) -> None:
    """Select all that is in a field."""
    tab.field(words).click()
    tab.page.keyboard.press("ControlOrMeta+a")


def wait_for_x(tab: Tab, value: float) -> None:
    """Wait until state and page have an x."""
    tab.wait_for(lambda: tab.state.pose.position[0] == pytest.approx(value), f"x = {value}")
    tab.wait_until_shown("x", tab.state.pose.position[0])


def has_focus(tab: Tab, words: str) -> bool:
    return bool(tab.field(words).evaluate("field => field === document.activeElement"))


def test_number_is_entered_whole_however_it_is_written_typed_or_pasted(tab: Tab) -> None:
    for text, key, value in ENTERED:
        before = len(words_of_steps(tab))
        tab.field("x").fill(text)
        tab.page.keyboard.press(key)
        wait_for_x(tab, value)
        # Within a moment of each other, numbers of one field are one step.
        assert len(words_of_steps(tab)) in (before, before + 1)
    tab.page.context.grant_permissions(["clipboard-read", "clipboard-write"])
    for text, value in (("3,25", 3.25), ("1,234.5", 3.25), ("32,5 mm", 3.25), ("−2", -2.0)):
        tab.page.evaluate("text => navigator.clipboard.writeText(text)", text)
        for empties in (True, False):
            replace_all(tab, "x")
            if empties:
                tab.page.keyboard.press("Delete")
            tab.page.keyboard.press("ControlOrMeta+v")
            expect(tab.field("x")).to_have_value(text)
            tab.page.keyboard.press("Tab")
            wait_for_x(tab, value)
    # The paper's own numbers have more digits than a slider has steps.
    tab.turn_to("Design")
    for name, value in (("a3x", 18.9372), ("b1y", -3.1415)):
        tab.type(name, f"{value}\n")
        tab.wait_for(lambda name=name, value=value: tab.stands(name, value), f"{name} = {value}")
    # A browser shows what was typed before the explorer has heard of it.
    tab.wait_for(lambda: tab.state.design.a3[0] == 18.9372, "a3x as it was typed")
    tab.wait_for(lambda: tab.state.design.b1[1] == -3.1415, "b1y as it was typed")


def test_field_keeps_what_is_typed_and_is_given_up_for_what_the_explorer_has(tab: Tab) -> None:
    """A range that followed the number before, a moment later, drew the field anew."""
    gui: Any = tab.running.viser.gui
    inputs: list[Any] = list(gui._gui_input_handle_from_uuid.values())
    # The first of that name is the slider of the pose.
    slider = next(each for each in inputs if each.label == "x")
    field, session = tab.field("x"), tab.running.page.session
    tab.settle()
    # No pause enters a number that is written in another way than the explorer's.
    field.fill("3,2")
    slider.max += 1.0
    tab.settle()
    expect(field).to_have_value("3,2")
    tab.page.keyboard.type("5")
    slider.max += 1.0
    tab.settle()
    tab.page.keyboard.press("Tab")
    wait_for_x(tab, 3.25)
    # Given up, the field shows what the explorer has by now, not what it had at first.
    field.fill("abc")
    session.do(set_position(0, 2.5))
    tab.wait_for(lambda: tab.shown("x") == 2.5, "x = 2.5")
    tab.settle()
    expect(field).to_have_value("abc")
    tab.page.keyboard.press("Tab")
    expect(field).to_have_value("2.5")
    # So does one that is emptied, after its own steps and after another tab's number.
    tab.type("x", "5")
    for _ in range(2):
        tab.page.keyboard.press("ArrowUp")
    wait_for_x(tab, 5.02)
    for z, elsewhere in ((8.0, None), (7.0, 4.0)):
        if elsewhere is not None:
            session.do(set_position(0, elsewhere))
            wait_for_x(tab, elsewhere)
        value = tab.state.pose.position[0]
        replace_all(tab, "x")
        tab.page.keyboard.press("Delete")
        tab.page.keyboard.press("Tab")
        # What is done next is done after it would have been.
        tab.type("z", f"{z:g}\n")
        tab.wait_for(lambda z=z: tab.state.pose.position[2] == z, "z")
        assert tab.state.pose.position[0] == value


def test_number_that_arrives_leaves_a_field_selected_so_that_typing_replaces_it(tab: Tab) -> None:
    session = tab.running.page.session
    for arrives, text, value in ((2.5, "7", 7.0), (12.75, "9.5", 9.5)):
        replace_all(tab, "x")
        session.do(set_position(0, arrives))
        wait_for_x(tab, arrives)
        tab.page.keyboard.type(text)
        tab.page.keyboard.press("Enter")
        wait_for_x(tab, value)
    # Escape goes back to the number that arrived, and an own choice of digits counts.
    replace_all(tab, "x")
    session.do(set_position(0, 3.25))
    wait_for_x(tab, 3.25)
    tab.page.keyboard.type("8")
    tab.page.keyboard.press("Escape")
    wait_for_x(tab, 3.25)
    tab.page.keyboard.press("End")
    tab.page.keyboard.press("Backspace")
    tab.page.keyboard.press("Enter")
    wait_for_x(tab, 3.2)


def test_length_may_be_typed_in_another_unit_and_what_is_none_is_explained(tab: Tab) -> None:
    for lengths in ("mm", "design units"):
        tab.running.page.session.do(Set("view.lengths", lengths))
        tab.settle()
        for text, value in (("120 mm", 12.0), ("12,5 cm", 12.5), ("1 in", 2.54), ("4 units", 4.0)):
            tab.type("x", f"{text}\n")
            tab.wait_for(lambda value=value: tab.state.pose.position[0] == value, f"x = {text}")
    tab.type("yaw (°)", "30°\n")
    tab.wait_for(lambda: tab.state.yaw_pitch_roll[0] == 30.0, "yaw = 30°")
    tab.type("x", "abc\n")
    expect(tab.page.get_by_role("alert").filter(has_text="abc")).to_contain_text("type a number in")
    tab.field("y").focus()
    expect(tab.page.locator(".ex-refusal")).to_have_count(0)


def test_field_with_no_number_or_a_refused_one_gets_back_what_was_there(
    tab: Tab, monkeypatch: pytest.MonkeyPatch
) -> None:
    # The notice is there as long as the test, and is new to it.
    monkeypatch.setattr("explorer.app.page.NOTICE_SECONDS", 600.0)
    tab.advance(600.0)
    before = tab.state
    x = before.pose.position[0]
    tab.wait_until_shown("x", x)
    for text in NO_NUMBERS:
        tab.field("x").fill(text)
        tab.page.keyboard.press("Tab")
        tab.wait_until_shown("x", x)
    tab.type("x", "999999999999\n")
    notice = tab.page.get_by_text("too far to be drawn")
    notice.wait_for()
    tab.wait_until_shown("x", x)
    tab.settle()
    assert notice.count() == 1
    assert tab.state.pose == before.pose
    assert len(words_of_steps(tab)) == 1
    # Escape goes back even beyond what a pause has entered.
    tab.type("x", "7")
    tab.wait_for(lambda: tab.state.pose.position[0] == 7.0, "x after a pause")
    tab.page.keyboard.type("5")
    tab.page.keyboard.press("Escape")
    tab.wait_until_shown("x", x)
    tab.page.keyboard.press("Tab")
    tab.wait_for(lambda: tab.state.pose == before.pose, "the pose of before")


def test_number_is_entered_by_a_pause_a_click_elsewhere_and_an_arrow(tab: Tab) -> None:
    tab.type("x", "7.25")
    tab.wait_for(lambda: tab.state.pose.position[0] == 7.25, "x after a pause")
    assert has_focus(tab, "x")
    # The caret is where it was, so that one may go on.
    tab.page.keyboard.type("5")
    tab.field("y").click()
    tab.wait_until_shown("x", 7.255, 0.006)
    tab.type("x", "8")
    tab.field("y").click()
    wait_for_x(tab, 8.0)
    assert has_focus(tab, "y")
    # From what was typed it steps on.
    tab.type("x", "5")
    tab.page.keyboard.press("ArrowUp")
    wait_for_x(tab, 5.01)
    # An input method is not disturbed, and its digits count.
    methods: Any = tab.page.context.new_cdp_session(tab.page)
    replace_all(tab, "x")
    for text in ("３", "３２", "３２．５"):
        ends = {"selectionStart": len(text), "selectionEnd": len(text)}
        methods.send("Input.imeSetComposition", {"text": text, **ends})
    tab.advance(1.0)
    expect(tab.field("x")).to_have_value("３２．５")
    methods.send("Input.insertText", {"text": "３２．５"})
    tab.page.keyboard.press("Enter")
    wait_for_x(tab, 32.5)


def test_field_that_is_left_takes_no_focus_with_its_next_number(tab: Tab) -> None:
    """Told of nothing, the page took it for the one that is typed into."""
    numbers = iter((8.0, 2.5, 3.25, 4.75))
    for leave in (lambda: tab.page.keyboard.press("Tab"), tab.field("y").click):
        value = next(numbers)
        tab.type("x", f"{value:g}")
        leave()
        wait_for_x(tab, value)
        value = next(numbers)
        tab.running.page.session.do(set_position(0, value))
        wait_for_x(tab, value)
        assert not has_focus(tab, "x")
        expect(tab.field("x")).to_have_value(f"{value:g}")
    # A hand gives it the focus at once, and so do its arrows.
    tab.type("x", "5")
    tab.wait_for(lambda: tab.state.pose.position[0] == 5.0, "x = 5")
    tab.turn_to("Design")
    unit = "1 unit (mm)"
    tab.type(unit, "5\n")
    tab.wait_for(lambda: tab.state.design.unit_mm == 5.0, "5 mm")
    tab.settle()
    tab.row(unit).locator("[data-direction=up]").click()
    tab.wait_for(lambda: tab.state.design.unit_mm == pytest.approx(5.001), "a step up")
    assert has_focus(tab, unit)


def test_field_left_by_enter_leaves_the_next_key_to_the_commands(tab: Tab) -> None:
    # Typed, typed and entered by a pause before, and not typed at all.
    for text, pauses in (("5", False), ("7", True), ("", False)):
        replace_all(tab, "x")
        tab.page.keyboard.type(text)
        value = float(text or 7)
        if pauses:
            tab.wait_for(lambda: tab.state.pose.position[0] == 7.0, "x after a pause")
        tab.page.keyboard.press("Enter")
        before = tab.state.view.grid
        tab.page.keyboard.press("g")
        tab.wait_for(lambda before=before: tab.state.view.grid != before, "the grid")
        wait_for_x(tab, value)
    # What comes from the explorer later does not take the keys back.
    tab.running.page.session.do(set_position(0, 4.0))
    wait_for_x(tab, 4.0)
    tab.page.keyboard.press("g")
    tab.wait_for(lambda: tab.state.view.grid, "the grid again")


def test_undo_in_a_field_is_that_of_the_explorer(tab: Tab) -> None:
    """The browser's own undid what was written into its fields, of whichever it was."""
    before = tab.state.pose
    tab.settle()
    undo = "ControlOrMeta+z"
    field = tab.field("y")
    field.click()
    with tab.slow_time():
        for key in ("End", *4 * ("Backspace",)):
            tab.page.keyboard.press(key)
        tab.page.keyboard.type("6.5")
        tab.page.keyboard.press("Enter")
    tab.wait_for(lambda: tab.state.pose.position[1] == 6.5, "y = 6.5")
    # What is half typed goes first.
    field.click()
    with tab.slow_time():
        tab.page.keyboard.type("7,")
        tab.page.keyboard.press(undo)
    expect(field).to_have_value("6.5")
    assert tab.state.pose.position[1] == 6.5
    tab.page.keyboard.press(undo)
    tab.wait_for(lambda: tab.state.pose == before, "undone")
    tab.wait_until_shown("y", before.position[1])
    for _ in range(3):
        tab.page.keyboard.press(undo)
    # viser runs commands in no order.
    tab.settle()
    tab.page.keyboard.press("ControlOrMeta+y")
    tab.wait_for(lambda: tab.state.pose.position[1] == 6.5, "redone")
    assert words_of_steps(tab)[1:] == ["y = 6.5 units"]


def test_name_may_hold_blanks_be_emptied_and_be_saved_right_after_typing(data_tab: Tab) -> None:
    tab = data_tab
    tab.open_dialog("Designs")
    name = tab.row("Name").locator("input")

    def type_slowly(*texts: str) -> None:
        # What comes back meanwhile is drawn.
        for text in texts:
            tab.page.keyboard.type(text)
            tab.settle()

    def wait_for_name(expected: str) -> None:
        tab.wait_for(lambda: tab.state.design.name == expected, expected)
        expect(name).to_have_value(expected)

    name.click()
    tab.page.keyboard.press("ControlOrMeta+a")
    type_slowly("two", " ", "words", " ")
    tab.page.keyboard.press("Tab")
    wait_for_name("two words")
    name.click()
    tab.page.keyboard.press("ControlOrMeta+a")
    tab.page.keyboard.press("Delete")
    type_slowly("", "fre", "sh")
    wait_for_name("fresh")
    # Left empty it has the name that it had when one came to it.
    for _ in "fresh":
        tab.page.keyboard.press("Backspace")
    tab.page.keyboard.press("Tab")
    wait_for_name("two words")
    expect(tab.page.get_by_text("The name must be")).to_have_count(0)
    # Enter leaves it, so that the next key is a command.
    name.fill("mine")
    tab.page.keyboard.press("Enter")
    tab.page.keyboard.press("g")
    tab.wait_for(lambda: not tab.state.view.grid, "no grid")
    wait_for_name("mine")
    # A button gets the last that was typed before it is pressed.
    saves = tab.page.get_by_role("button", name="Save", exact=True)
    name.evaluate(TYPE_AND_PRESS, saves.element_handle())
    tab.page.get_by_text("Saved.", exact=True).wait_for()
    tab.wait_for(lambda: tab.state.design.name == "abcd", "the name")
    expect(tab.page.get_by_role("button", name="Duplicate abcd")).to_be_visible()


def test_arrows_on_a_slider_leave_the_camera_and_turn_it_over_the_scene(tab: Tab) -> None:
    tab.drag("x", 0.5)
    tab.settle()
    eye, x = tab.client.camera.position.copy(), tab.shown("x")
    for _ in range(4):
        tab.page.keyboard.press("ArrowRight", delay=90)
    tab.wait_for(lambda: tab.shown("x") > x, "a step to the right")
    tab.settle()
    # Waiting may move the camera by a ten-thousandth.
    np.testing.assert_allclose(tab.client.camera.position, eye, rtol=1e-3)
    tab.page.mouse.click(430, 240)
    # A slow frame may take longer than a short press.
    tab.page.keyboard.down("ArrowRight")
    tab.wait_for(lambda: np.abs(tab.client.camera.position - eye).max() > 1.0, "a turn")
    tab.page.keyboard.up("ArrowRight")
