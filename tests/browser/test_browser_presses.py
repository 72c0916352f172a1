"""Presses in a real page: from press to release is one step of undo, however long a hand rests."""

from __future__ import annotations

import pytest
from tab import TRACK, Tab

from explorer.app.features.mechanism.marks import ARROW_LENGTH
from explorer.app.scene.placing import Placed
from explorer.app.session.history import PAUSE_SECONDS
from explorer.app.state.frame import Frame
from explorer.app.state.moves import set_position

# Longer than the pause after which an event begins a step of its own, where no press is known.
REST_SECONDS = PAUSE_SECONDS + 0.3

# The page moves on as the pointer is released, and then does nothing for a second.
BUSY_AT_RELEASE = """() => {
    const move = () => {
        const place = {bubbles: true, clientX: innerWidth, clientY: 0};
        document.dispatchEvent(new MouseEvent("mousemove", place));
        for (const end = performance.now() + 1000; performance.now() < end;);
    };
    addEventListener("pointerup", move, {capture: true, once: true});
}"""

# What viser does to markup whose numbers change.
REPLACE = """selector => {
    const button = document.querySelector(selector);
    button.replaceWith(button.cloneNode(true));
}"""


def steps(tab: Tab) -> int:
    assert tab.running.page.session.wait_until_idle()
    return len(tab.running.page.session.history.steps) - 1


def grab(tab: Tab, words: str) -> tuple[float, float, float]:
    """Press the thumb of a slider; return its place, and how wide the slider is."""
    x, y = tab.grab(tab.slider(words))
    track = tab.row(words).locator(TRACK).bounding_box()
    assert track is not None
    return x, y, track["width"]


def move(tab: Tab, x: float, y: float) -> None:
    """Move the pointer, and wait until the platform has followed."""
    before = tab.state.pose
    tab.page.mouse.move(x, y, steps=3)
    tab.wait_for(lambda: tab.state.pose != before, "a move")


@pytest.fixture
def tab(tab: Tab) -> Tab:
    """A tab at rest."""
    tab.settle()
    return tab


def test_drag_of_a_slider_or_of_the_gizmo_is_one_step_however_long_it_rests(tab: Tab) -> None:
    first = tab.state.pose
    for drag in (1, 2):
        x, y, width = grab(tab, "x")
        for share in (0.02, 0.04, 0.06):
            move(tab, x + share * width, y)
            tab.advance(REST_SECONDS)
        # The window may lose the focus while a hand holds.
        tab.page.evaluate("dispatchEvent(new Event('blur'))")
        tab.advance(REST_SECONDS)
        move(tab, x + 0.08 * width, y)
        tab.page.mouse.up()
        # The last of the moves may arrive after the release.
        tab.settle()
        assert steps(tab) == drag
    for _ in range(2):
        tab.page.keyboard.press("ControlOrMeta+z")
    tab.wait_for(lambda: tab.state.pose == first, "the pose of before")
    tab.look_from("isometric")
    placed = Placed(Frame(tab.state))
    arrow = tab.state.pose.rotation[:, 0]
    tip = placed.points["b4"] + 0.7 * ARROW_LENGTH * arrow
    tab.page.mouse.move(*tab.on_screen(tip))
    tab.page.mouse.down()
    for share in (0.5, 1.0, 1.5):
        move(tab, *tab.on_screen(tip + share * arrow))
        tab.advance(REST_SECONDS)
    tab.page.mouse.up()
    tab.settle()
    assert steps(tab) == 1


def test_release_that_is_reported_late_or_lost_ends_the_press(tab: Tab) -> None:
    x, y, width = grab(tab, "x")
    move(tab, x + 0.05 * width, y)
    tab.settle()
    # The last value that a busy page sends late belongs to the press.
    tab.page.evaluate(BUSY_AT_RELEASE)
    before = tab.state.pose
    tab.page.mouse.up()
    tab.wait_for(lambda: tab.state.pose != before, "the last value")
    tab.settle()
    assert steps(tab) == 1
    tab.push("Home pose")
    tab.wait_until_shown("x", 10.0)
    tab.settle()
    before_drag = steps(tab)
    x, y, width = grab(tab, "x")
    move(tab, x + 0.05 * width, y)
    # A release in another window is not heard; the next move of the pointer tells of it.
    tab.page.evaluate(
        "addEventListener('pointerup', event => event.stopImmediatePropagation(),"
        " {capture: true, once: true})"
    )
    tab.page.mouse.up()
    tab.page.mouse.move(x, y + 40, steps=2)
    tab.advance(REST_SECONDS)
    tab.slider("x").focus()
    tab.page.keyboard.press("ArrowRight")
    tab.wait_for(lambda: steps(tab) == before_drag + 2, "a step of its own")


def test_press_counts_after_a_reload_and_on_markup_that_is_replaced_meanwhile(tab: Tab) -> None:
    # It is the first press of its page each time.
    for value in (11.0, 12.0):
        tab.running.page.session.do(set_position(0, value))
        tab.page.get_by_role("button", name=f"Undo x = {value:g}").click()
        tab.wait_for(lambda: tab.state.pose.position[0] == 10.0, "the pose of before")
        tab.wait_until_shown("x", 10.0)
        tab.reload()
    tab.page.get_by_role("button", name="Help", exact=True).hover()
    tab.page.mouse.down()
    tab.page.evaluate(REPLACE, "[data-opens=Help]")
    tab.page.mouse.up()
    tab.page.get_by_role("dialog", name="Help").wait_for()


@pytest.mark.parametrize(
    ("title", "commands"),
    [
        ("Loads", ("forces", "accuracy")),
        ("Singularity", ("singularity",)),
        ("Workspace", ("interference",)),
    ],
)
def test_command_of_an_answer_is_copied(tab: Tab, title: str, commands: tuple[str, ...]) -> None:
    tab.page.context.grant_permissions(["clipboard-read", "clipboard-write"])
    tab.turn_to(title)
    tab.settle()
    buttons = tab.page.get_by_role("button", name="Copy the command line").locator("visible=true")
    for button, command in zip(buttons.all(), commands, strict=True):
        button.click()

        def is_copied(start: str = f"explorer {command} --design ") -> bool:
            text = str(tab.page.evaluate("navigator.clipboard.readText()"))
            return text.startswith(start) and "\n" not in text

        tab.wait_for(is_copied, "the command in the clipboard")
