"""Keys on keyboards of other scripts and layouts, as Chromium reports them there."""

from __future__ import annotations

from typing import Any, NamedTuple

from tab import Tab

from explorer.app.features.designs.feature import SavedDesigns
from explorer.app.state.actions import Set, set_name
from explorer.mechanism.pose import Pose

CTRL, SHIFT = 2, 8


class Stroke(NamedTuple):
    """A key: what it writes, where it is, and the modifiers that are held down."""

    key: str
    code: str
    modifiers: int = CTRL


UNDO_AND_REDO = {
    "Russian": (Stroke("я", "KeyZ"), Stroke("Я", "KeyZ", CTRL | SHIFT)),
    "Russian, the other redo": (Stroke("я", "KeyZ"), Stroke("н", "KeyY")),
    "Greek": (Stroke("ζ", "KeyZ"), Stroke("Ζ", "KeyZ", CTRL | SHIFT)),
    "QWERTZ": (Stroke("z", "KeyY"), Stroke("y", "KeyZ")),
    "AZERTY": (Stroke("z", "KeyW"), Stroke("Z", "KeyW", CTRL | SHIFT)),
}
# What stands in the place of H on the keyboards of six scripts.
AT_H = "hрηיا้"


def strike(tab: Tab, stroke: Stroke) -> None:
    inspector: Any = tab.page.context.new_cdp_session(tab.page)
    values = {"key": stroke.key, "code": stroke.code, "modifiers": stroke.modifiers}
    for kind in ("rawKeyDown", "keyUp"):
        inspector.send("Input.dispatchKeyEvent", {"type": kind, **values})
    inspector.detach()


def test_undo_and_redo_go_by_the_letter_or_by_its_place_in_other_scripts(tab: Tab) -> None:
    home = tab.state.pose
    away = Pose((10.0, 5.0, 11.0), home.quaternion)
    tab.running.page.session.do(Set("pose", away))
    tab.settle()
    for layout, (undo, redo) in UNDO_AND_REDO.items():
        strike(tab, undo)
        tab.wait_for(lambda: tab.state.pose == home, f"undone on {layout}")
        strike(tab, redo)
        tab.wait_for(lambda: tab.state.pose == away, f"redone on {layout}")
        # In a field, too, whose history is the explorer's.
        tab.field("x").click()
        strike(tab, undo)
        tab.wait_for(lambda: tab.state.pose == home, f"undone from a field on {layout}")
        tab.page.evaluate("document.activeElement.blur()")
        strike(tab, redo)
        tab.wait_for(lambda: tab.state.pose == away, f"redone again on {layout}")
    # The sign that Dvorak has in the place of Z is no letter of any script.
    strike(tab, Stroke(";", "KeyZ"))
    tab.settle()
    assert tab.state.pose == away


def test_letter_of_any_script_in_the_place_of_h_goes_home(tab: Tab) -> None:
    home = tab.state.pose
    away = Pose((10.0, 5.0, 11.0), home.quaternion)
    for letter in AT_H:
        tab.running.page.session.do(Set("pose", away))
        tab.settle()
        strike(tab, Stroke(letter, "KeyH", 0))
        tab.wait_for(lambda: tab.state.pose == home, f"home by {letter}")


def test_azerty_has_views_by_its_row_of_digits_and_no_letter_by_a_comma(tab: Tab) -> None:
    eye = tab.client.camera.position
    strike(tab, Stroke("&", "Digit1", 0))
    tab.wait_for(lambda: bool((tab.client.camera.position != eye).any()), "the front view")
    strike(tab, Stroke(",", "KeyM", 0))
    strike(tab, Stroke("m", "Semicolon", 0))
    tab.wait_for(lambda: tab.state.view.ghosts, "the other modes")
    tab.settle()
    assert tab.state.view.ghosts


def test_ctrl_s_saves_and_ctrl_z_undoes_wherever_the_focus_is(data_tab: Tab) -> None:
    tab = data_tab
    session, saved = tab.running.page.session, tab.running.page.services.get(SavedDesigns)
    session.do(set_name("mine"))
    tab.settle()
    eye = tab.client.camera.position
    home = tab.state.pose
    for place in ("body", "input", "[role=slider]", "[role=tab]"):
        tab.page.locator(place).first.evaluate("e => e.focus()")
        tab.page.keyboard.press("ControlOrMeta+s")
        tab.wait_for(lambda: saved.words_on(tab.state.design)[0] == "saved", f"saved from {place}")
        session.do(Set("pose", Pose((10.0, 5.0, 11.0), home.quaternion)))
        tab.settle()
        tab.page.locator(place).first.evaluate("e => e.focus()")
        tab.page.keyboard.press("ControlOrMeta+z")
        tab.wait_for(lambda: tab.state.pose == home, f"undone from {place}")
        saved.delete("mine")
        tab.settle()
    tab.page.keyboard.press("ControlOrMeta+z")
    tab.wait_for(lambda: saved.words_on(tab.state.design)[0] == "saved", "brought back")
    assert (tab.client.camera.position == eye).all(), "S moves the camera"


def test_found_text_opens_the_folders_that_it_stands_in(tab: Tab) -> None:
    page = tab.page
    for words, head in (("Warn below", "More"), ("yaw of home", "Free variables")):
        page.keyboard.press("ControlOrMeta+k")
        page.keyboard.type(words)
        # What was found for the text before is shown until then.
        tab.settle()
        page.locator(".ex-results > button[data-opens]").first.click()
        tab.settle()
        assert page.get_by_text(words).first.is_visible()
        assert not page.locator(f'[aria-expanded="false"]:text-is("{head}"):visible').count()
