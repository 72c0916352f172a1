"""The map of the workspace in a real page: what is read under the pointer, where a click goes."""

from __future__ import annotations

import re

import msgspec
import numpy as np
import pytest
from playwright.sync_api import Locator, expect
from tab import Tab

from explorer.app.state.actions import Set
from explorer.app.state.moves import set_angle
from explorer.mechanism.configuration import Configuration
from explorer.mechanism.design_file import PRESETS
from explorer.mechanism.machine import Tool
from explorer.mechanism.margins import margins

OPTIMAL = PRESETS["paper-optimal"]
READING = re.compile(r"x ([−\d.]+), z ([−\d.]+) units: min \|δ\| ([\d.]+) \(δ(\d)\)")

# Sizes of the type of a map, in pixels.
TYPE_SIZES = """map => {
    const scale = map.getScreenCTM().a;
    return [...map.querySelectorAll("text")].map(
        (text) => scale * parseFloat(getComputedStyle(text).fontSize));
}"""


@pytest.fixture
def tab(tab: Tab) -> Tab:
    """A tab in a window of a small laptop."""
    tab.resize((1280, 720))
    tab.settle()
    return tab


def open_map(tab: Tab, level: float) -> None:
    """Cut the workspace at a y, and wait until its map is drawn and rests."""
    tab.turn_to("Workspace")
    tab.settle()
    tab.push("y")
    map_in(tab).wait_for()
    move_cut(tab, level)


def move_cut(tab: Tab, level: float) -> None:
    """Cut the workspace at another y, and wait until its map is drawn and rests."""
    tab.running.page.session.do(Set("view.workspace.level", level))
    expect(map_in(tab)).to_have_attribute("aria-label", f"Map of the slice at y = {level:g} units")
    tab.settle()


def map_in(tab: Tab) -> Locator:
    return tab.page.locator("[data-map]:not(.ex-tilts)")


def rest_on(tab: Tab, across: float, up: float) -> Locator:
    """Rest the pointer on a place of the map, in shares of its picture; return the reading."""
    box = map_in(tab).bounding_box()
    assert box is not None
    tab.page.mouse.move(box["x"] + across * box["width"], box["y"] + up * box["height"])
    return tab.page.locator(".ex-reading:visible")


def read_at(tab: Tab, across: float, up: float, words: re.Pattern[str]) -> re.Match[str]:
    """Return what is read at a place of the map."""
    reading = rest_on(tab, across, up)
    expect(reading).to_have_text(words)
    found = words.search(reading.inner_text())
    assert found is not None
    return found


def press(tab: Tab) -> None:
    tab.page.mouse.down()
    tab.page.mouse.up()


def number(text: str) -> float:
    return float(text.replace("−", "-").replace(",", ""))


def test_map_is_read_and_the_reading_stays_while_it_is_drawn_again(tab: Tab) -> None:
    open_map(tab, 6.0)
    # Its type is legible in a panel as narrow as this.
    assert min(map_in(tab).evaluate(TYPE_SIZES)) >= 11.0 - 1e-3
    hint = "Point at the map to read it, click to go there."
    expect(tab.page.locator(".ex-reading:visible")).to_have_text(hint)
    # Beside the outline, and beside the frame.
    expect(rest_on(tab, 0.2, 0.1)).to_contain_text("beyond the limits")
    expect(rest_on(tab, 0.02, 0.02)).to_have_text(hint)
    read_at(tab, 0.6, 0.4, READING)
    before = tab.page.locator(".ex-reading:visible").inner_text()
    move_cut(tab, 5.0)
    expect(tab.page.locator(".ex-reading:visible")).to_have_text(before)


def test_reading_follows_the_mechanism_while_the_pointer_rests(tab: Tab) -> None:
    session = tab.running.page.session
    session.do(Set("view.workspace.colour", "condition"))
    open_map(tab, 6.0)
    words = re.compile(r"x ([−\d.]+), z ([−\d.]+) units: 1 / cond J ([\d.]+)")
    reading = tab.page.locator(".ex-reading:visible")
    read_at(tab, 0.6, 0.4, words)

    def is_of_the_state() -> bool:
        found = words.match(reading.inner_text())
        if found is None:
            return False
        at, rotation = (number(found[1]), 6.0, number(found[2])), tab.state.pose.rotation
        expected = Configuration(OPTIMAL, at, rotation).inverse_condition
        return number(found[3]) == pytest.approx(float(expected), abs=5e-6 + 1e-9)

    tab.wait_for(is_of_the_state, "the reading of the first state")
    for yaw in np.arange(-70.0, -40.0, 2.0).tolist():
        session.do(set_angle(0, yaw))
    tab.wait_for(is_of_the_state, "the reading of the last state")
    # A load ten times as large has the same picture, with other numbers at its colours.
    force = re.compile(r"largest actuator force ([\d.,]+) N")
    session.do(Set("view.forces.force", (0.0, 0.0, -5.0)))
    session.do(Set("view.workspace.colour", "force"))
    expect(reading).to_contain_text(force)
    before = force.search(reading.inner_text())
    assert before is not None
    session.do(Set("view.forces.force", (0.0, 0.0, -50.0)))

    def is_ten_times_as_large() -> bool:
        found = force.search(reading.inner_text())
        return found is not None and number(found[1]) == pytest.approx(10 * number(before[1]), 5e-3)

    tab.wait_for(is_ten_times_as_large, "the reading of the larger load")


def test_map_of_the_tool_is_read_and_leads_the_tool_there(tab: Tab) -> None:
    session, tool = tab.running.page.session, (1.0, 0.0, 3.0)
    session.do(Set("design", msgspec.structs.replace(OPTIMAL, tool=Tool(position=tool))))
    tab.turn_to("Pose")
    tab.push("tool point")
    open_map(tab, 6.0)
    found = read_at(tab, 0.55, 0.6, READING)
    goal = np.array([number(found[1]), 6.0, number(found[2])])
    offset = tab.state.pose.rotation @ np.array(tool)
    sizes = np.abs(margins(goal - offset, tab.state.pose.rotation))
    assert number(found[3]) == pytest.approx(float(sizes.min()), abs=5e-3 + 1e-9)
    assert int(found[4]) == int(sizes.argmin()) + 1
    press(tab)

    def is_there() -> bool:
        pose = tab.state.pose
        return bool(np.allclose(pose.position + pose.rotation @ np.array(tool), goal, atol=0.006))

    tab.wait_for(is_there, "the position read")
