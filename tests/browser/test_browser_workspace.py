"""The map of the workspace in a real page: what is read under the pointer, where a click goes."""

from __future__ import annotations

import math
import re
from collections.abc import Iterator

import msgspec
import numpy as np
import pytest
from machines import FULL, six
from playwright.sync_api import Browser, Locator, Page, expect
from tab import Tab

from explorer.app.features.workspace.feed import WorkspaceFeed
from explorer.app.features.workspace.slice_map import map_facts
from explorer.app.look import read_script
from explorer.app.scene.bands import Colouring
from explorer.app.state.action import Action
from explorer.app.state.actions import Open, Set
from explorer.mechanism.design_file import PRESETS
from explorer.mechanism.machine import Actuators, Struts, Tool
from explorer.mechanism.margins import margins
from explorer.mechanism.pose import rotation_from_yaw_pitch_roll
from explorer.numerics.arrays import FloatArray
from explorer.singularity.ellipsoids import planes_of_singularity
from explorer.singularity.jacobian import inverse_condition, jacobian
from explorer.statics.accuracy import worst_error
from explorer.statics.compliance import compliance, deflection, stiffness_of
from explorer.statics.held import largest_shares, load_case
from explorer.statics.reactions import PART_NAMES
from explorer.statics.weights import payload_wrench
from explorer.workspace.held import part_names
from explorer.workspace.position_bands import PartMeasure, PositionMeasure

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


@pytest.fixture
def script(browser: Browser) -> Iterator[Page]:
    """A blank page with the script that reads maps."""
    page = browser.new_page()
    page.evaluate(f"() => {{ {read_script('map')} }}")
    yield page
    page.close()


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
    expect(map_in(tab)).to_have_attribute("aria-label", f"Map of the slice at y = {level:g}")
    tab.settle()


def map_in(tab: Tab) -> Locator:
    return tab.page.locator("[data-map]")


def rest_on(tab: Tab, across: float, up: float) -> Locator:
    """Rest the pointer on a place of the map, in shares of its picture; return the reading."""
    box = map_in(tab).bounding_box()
    assert box is not None
    tab.page.mouse.move(box["x"] + across * box["width"], box["y"] + up * box["height"])
    return tab.page.locator(".ex-reading")


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


def test_map_script_margins_and_conditioning_are_those_of_the_library(script: Page) -> None:
    rng = np.random.default_rng(8)
    platform = np.array([[*OPTIMAL.b1, 0.0], [OPTIMAL.b2, 0.0, 0.0], [OPTIMAL.b3, 0.0, 0.0]])
    cases: list[dict[str, object]] = []
    expected: list[list[float]] = []
    for trial in range(60):
        rotation = rotation_from_yaw_pitch_roll(rng.uniform(-80.0, 80.0, 3))
        position = rng.uniform(-20.0, 20.0, 3)
        if trial % 4 == 0:
            # Near a singular position, or at one.
            position[2] = (0.0, 1e-9, 1e-4)[trial % 3]
        rates = jacobian(OPTIMAL, position, rotation)
        expected.append(
            [
                float(np.abs(margins(position, rotation)).min()),
                float(inverse_condition(rates, OPTIMAL.reach)),
            ]
        )
        facts = {
            "gradients": planes_of_singularity(rotation).tolist(),
            "arms": (platform @ rotation.T).tolist(),
            "a3": [*OPTIMAL.a3, 0.0],
            "reach": OPTIMAL.reach,
        }
        cases.append({"facts": facts, "p": position.tolist()})
    computed = script.evaluate(
        """cases => cases.map(({ facts, p }) => {
            const { leastMargin, inverseCondition, jacobian } = window.explorer.map;
            return [leastMargin(facts, p).least, inverseCondition(jacobian(facts, p))];
        })""",
        cases,
    )
    np.testing.assert_allclose(computed, expected, rtol=1e-9, atol=1e-12)


def test_map_script_utilisation_under_a_load_is_that_of_the_library(script: Page) -> None:
    rng = np.random.default_rng(3)
    load = np.array([4.0, -3.0, -6.0, 5.0, 10.0, -5.0])
    cases: list[dict[str, object]] = []
    expected: list[tuple[float, str]] = []
    for trial in range(60):
        rotation = rotation_from_yaw_pitch_roll(rng.uniform(-80.0, 80.0, 3))
        position = rng.uniform(-20.0, 20.0, 3)
        if trial % 4 == 0:
            # Near a singular position, or at one.
            position[2] = (0.0, 1e-6, 1e-3)[trial % 3]
        measure: PartMeasure = ("share", "force", "bending")[trial % 3]
        colouring = Colouring(FULL, rotation, measure, 1.0, load)
        case = colouring.bands.case
        assert case is not None
        of_load, of_part = largest_shares(case, rotation, position[None])
        share, part = float(of_load[0]), int(of_part[0])
        names = part_names(FULL) if measure == "share" else PART_NAMES
        expected.append((share, names[part]))
        cases.append({"facts": map_facts(colouring), "p": position.tolist()})
    found = script.evaluate(
        """cases => cases.map(({ facts, p }) => {
            const { value, part } = window.explorer.map.amount(facts, p);
            return [Number.isFinite(value) ? value : -1, part];
        })""",
        cases,
    )
    assert sum(math.isinf(share) for share, _ in expected) > 2
    for (share, part), (computed, of_page) in zip(expected, found, strict=True):
        if math.isinf(share):
            assert computed == -1
        else:
            assert computed == pytest.approx(share, rel=1e-6)
            assert of_page == part


def test_map_script_displacement_of_the_tool_is_that_of_the_library(script: Page) -> None:
    rng = np.random.default_rng(4)
    cases: list[dict[str, object]] = []
    expected: list[float] = []
    for trial in range(80):
        measure: PositionMeasure = ("error", "deflection")[trial % 2]
        design = msgspec.structs.replace(
            FULL,
            unit_mm=float(rng.uniform(1.0, 20.0)),
            actuators=Actuators(
                error_mm=six(rng.uniform(0.0, 0.1, 6)),
                stiffness_n_mm=six(rng.uniform(100.0, 2000.0, 6)) if trial % 3 else None,
            ),
            struts=Struts(outer_mm=None if trial % 3 == 1 else 12.0, inner_mm=10.0),
        )
        rotation = rotation_from_yaw_pitch_roll(rng.uniform(-80.0, 80.0, 3))
        position = rng.uniform(-20.0, 20.0, 3)
        if trial % 8 in (0, 1):
            # Near a singular position, or at one.
            position[2] = (0.0, 1e-6, 1e-3)[trial % 3]
        load = rng.uniform(-50.0, 50.0, 6)
        pose, tool = (design, position, rotation), design.tool.position
        if measure == "error":
            moved = worst_error(*pose, design.actuators.error_mm, tool).displacement
        else:
            wrench = load + payload_wrench(design, rotation)
            soft = compliance(*pose, *stiffness_of(design), tool)
            moved = design.unit_mm * np.linalg.norm(deflection(soft, wrench)[:3])
        expected.append(float(moved))
        facts = map_facts(Colouring(design, rotation, measure, 1.0, load))
        cases.append({"facts": facts, "p": position.tolist()})
    found = script.evaluate(
        """cases => cases.map(({ facts, p }) => {
            const { value } = window.explorer.map.amount(facts, p);
            return Number.isFinite(value) ? value : -1;
        })""",
        cases,
    )
    assert sum(map(math.isinf, expected)) > 2
    finite = [-1.0 if math.isinf(moved) else moved for moved in expected]
    np.testing.assert_allclose(found, finite, rtol=1e-6)


def test_map_of_each_measure_is_read_and_the_reading_stays_while_it_is_drawn_again(
    tab: Tab,
) -> None:
    session, load = tab.running.page.session, (0.0, 0.0, -50.0)
    open_map(tab, 6.0)
    # Its type is legible in a panel as narrow as this.
    assert min(map_in(tab).evaluate(TYPE_SIZES)) >= 11.0 - 1e-3
    hint = "Point at the map to read it, click to go there."
    expect(tab.page.locator(".ex-reading")).to_have_text(hint)
    # Beside the outline, and beside the frame.
    expect(rest_on(tab, 0.2, 0.1)).to_contain_text("beyond the limits")
    expect(rest_on(tab, 0.02, 0.02)).to_have_text(hint)
    read_at(tab, 0.6, 0.4, READING)
    before = tab.page.locator(".ex-reading").inner_text()
    move_cut(tab, 5.0)
    expect(tab.page.locator(".ex-reading")).to_have_text(before)

    def read(measure: str, words: str, *actions: Action) -> tuple[FloatArray, re.Match[str]]:
        for action in (*actions, Set("view.workspace.colour", measure)):
            session.do(action)
        tab.page.mouse.move(0, 0)
        move_cut(tab, 5.0)
        found = read_at(tab, 0.6, 0.4, re.compile(rf"x ([−\d.]+), z ([−\d.]+) units: {words}"))
        return np.array([number(found[1]), 5.0, number(found[2])]), found

    actuators = Actuators(error_mm=six([0.05] * 6), stiffness_n_mm=six([1000.0] * 6))
    stiff = msgspec.structs.replace(OPTIMAL, actuators=actuators)
    of_the_load = Set("view.forces.force", load)
    rotation = tab.state.pose.rotation
    at, found = read("error", r"worst error of the tool ([\d.,]+) mm", Open(stiff), of_the_load)
    moved = float(worst_error(OPTIMAL, at, rotation, [0.05] * 6).displacement)
    assert number(found[3]) == pytest.approx(moved, rel=0.02)
    at, found = read("deflection", r"deflection under the load ([\d.,]+) mm")
    soft = compliance(OPTIMAL, at, rotation, [1000.0] * 6)
    moved = float(np.linalg.norm(deflection(soft, [*load, 0.0, 0.0, 0.0])[:3]))
    assert number(found[3]) == pytest.approx(moved, rel=0.02)
    words = r"largest share of a limit ([\d.,]+) % \(([\w ]+)\)"
    at, found = read("share", words, Open(FULL))
    drawing = tab.running.page.services.get(WorkspaceFeed).drawing
    assert drawing is not None
    assert drawing.request.load is not None
    case = load_case(FULL, rotation, np.array(drawing.request.load))
    share = float(largest_shares(case, rotation, at[None])[0][0])
    assert 0.01 * number(found[3]) == pytest.approx(share, rel=0.02)
    assert found[4] in part_names(FULL)


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
    assert number(found[3]) == pytest.approx(float(sizes.min()), abs=0.02)
    assert int(found[4]) == int(sizes.argmin()) + 1
    press(tab)

    def is_there() -> bool:
        pose = tab.state.pose
        return bool(np.allclose(pose.position + pose.rotation @ np.array(tool), goal, atol=0.006))

    tab.wait_for(is_there, "the position read")
