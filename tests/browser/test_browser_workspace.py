"""The workspace in a real page: its volume, a cut in the middle, a map that is read and clicked."""

from __future__ import annotations

import math
import re
from collections.abc import Iterator

import msgspec
import numpy as np
import pytest
from machines import FULL, six
from playwright.sync_api import Browser, Locator, expect
from tab import Tab

from explorer.app.features.workspace.feed import WorkspaceFeed
from explorer.app.features.workspace.slice_map import map_facts
from explorer.app.scene.bands import Colouring
from explorer.app.screenshot import PATIENCE_SECONDS
from explorer.app.server import Running
from explorer.app.state.actions import Open, Set, SetVariable
from explorer.mechanism.design_file import PRESETS
from explorer.mechanism.machine import Actuators, Struts, Tool
from explorer.mechanism.margins import margins
from explorer.mechanism.pose import rotation_from_yaw_pitch_roll
from explorer.numerics.number_text import format_number
from explorer.singularity.ellipsoids import planes_of_singularity
from explorer.singularity.jacobian import inverse_condition, jacobian
from explorer.statics.accuracy import worst_error
from explorer.statics.compliance import compliance, deflection, stiffness_of
from explorer.statics.held import largest_shares, load_case
from explorer.statics.reactions import PART_NAMES
from explorer.statics.weights import payload_wrench
from explorer.workspace.held import part_names
from explorer.workspace.position_bands import PartMeasure, PositionMeasure
from explorer.workspace.slices.volume import workspace_volume

OPTIMAL = PRESETS["paper-optimal"]
READING = re.compile(r"x ([−\d.]+), z ([−\d.]+) units: min \|δ\| ([\d.]+) \(δ(\d)\)")


@pytest.fixture
def tab(browser: Browser, running: Running) -> Iterator[Tab]:
    """A tab in a window of a small laptop."""
    tab = Tab(browser, running, size=(1280, 720), draws=True)
    yield tab
    assert tab.complaints() == []
    tab.close()


def map_in(tab: Tab) -> Locator:
    return tab.page.locator("[data-map]")


def rest_on(tab: Tab, across: float, up: float) -> None:
    """Rest the pointer on a place of the map, in shares of its picture."""
    box = map_in(tab).bounding_box()
    assert box is not None
    tab.page.mouse.move(box["x"] + across * box["width"], box["y"] + up * box["height"])


def number(text: str) -> float:
    return float(text.replace("−", "-"))


def test_workspace_is_seen_cut_read_and_left_as_a_file(tab: Tab) -> None:
    page = tab.running.page
    page.session.do(SetVariable("a3x", 17.0))
    assert page.wait_until_drawn(PATIENCE_SECONDS)
    # Its volume is in sight without any press, and its solid after two.
    volume = f"{format_number(workspace_volume(tab.state.design).volume, 6)} units³"
    expect(tab.page.get_by_text(volume).first).to_be_visible()
    tab.turn_to("Workspace")
    expect(tab.page.get_by_text(volume).last).to_be_visible()
    tab.push("Solid")
    tab.wait_for(lambda: page.services.get(WorkspaceFeed).drawing is not None, "the solid")
    # One more cuts it in its middle, and the pointer reads the map.
    tab.push("y")
    map_in(tab).wait_for()
    drawing = page.services.get(WorkspaceFeed).drawing
    assert drawing is not None
    assert drawing.extent is not None
    middle = 0.5 * float(drawing.extent[0][1] + drawing.extent[1][1])
    assert drawing.level == pytest.approx(middle)
    reading = tab.page.locator(".ex-reading")
    expect(reading).to_have_text("Point at the map to read it, click to go there.")
    rest_on(tab, 0.5, 0.5)
    expect(reading).to_have_text(READING)
    found = READING.match(reading.inner_text())
    assert found is not None
    position = np.array([number(found[1]), middle, number(found[2])])
    sizes = np.abs(margins(position, tab.state.pose.rotation))
    assert number(found[3]) == pytest.approx(float(sizes.min()), abs=0.02)
    assert int(found[4]) == int(sizes.argmin()) + 1
    # Beside the outline, and beside the frame.
    rest_on(tab, 0.2, 0.1)
    expect(reading).to_contain_text("beyond the limits")
    rest_on(tab, 0.02, 0.02)
    expect(reading).to_have_text("Point at the map to read it, click to go there.")
    # A click goes to what is read.
    rest_on(tab, 0.6, 0.6)
    expect(reading).to_have_text(READING)
    found = READING.match(reading.inner_text())
    assert found is not None
    tab.page.mouse.down()
    tab.page.mouse.up()
    goal = [number(found[1]), middle, number(found[2])]
    tab.wait_for(
        lambda: bool(np.allclose(tab.state.pose.position, goal, atol=0.006)), "the position read"
    )
    # Its type is legible in a panel as narrow as this.

    def sizes_of_type() -> list[float]:
        return map_in(tab).evaluate(
            """map => {
                const scale = map.getScreenCTM().a;
                return [...map.querySelectorAll("text")].map(
                    (text) => scale * parseFloat(getComputedStyle(text).fontSize));
            }"""
        )

    # A map that is replaced meanwhile has no sizes, and no comparison with them holds.
    tab.wait_for(lambda: min(sizes_of_type()) >= 11.0 - 1e-3, "a map in type of 11 pixels")
    download = tab.export("Workspace", "STEP")
    assert download.suggested_filename.endswith("-workspace.step")


def test_page_computes_margins_and_conditioning_as_the_library_does(tab: Tab) -> None:
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
    tab.wait_for(lambda: bool(tab.page.evaluate("!!window.explorer?.map")), "the script")
    computed = tab.page.evaluate(
        """cases => cases.map(({ facts, p }) => {
            const { leastMargin, inverseCondition, jacobian } = window.explorer.map;
            return [leastMargin(facts, p).least, inverseCondition(jacobian(facts, p))];
        })""",
        cases,
    )
    np.testing.assert_allclose(computed, expected, rtol=1e-9, atol=1e-12)


def test_page_computes_what_a_load_asks_as_the_library_does(tab: Tab) -> None:
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
    tab.wait_for(lambda: bool(tab.page.evaluate("!!window.explorer?.map")), "the script")
    found = tab.page.evaluate(
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


@pytest.mark.parametrize("measure", ["error", "deflection"])
def test_page_computes_how_far_the_tool_moves_as_the_library_does(
    tab: Tab, measure: PositionMeasure
) -> None:
    rng = np.random.default_rng(4)
    cases: list[dict[str, object]] = []
    expected: list[float] = []
    for trial in range(40):
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
        if trial % 4 == 0:
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
    tab.wait_for(lambda: bool(tab.page.evaluate("!!window.explorer?.map")), "the script")
    found = tab.page.evaluate(
        """cases => cases.map(({ facts, p }) => {
            const { value } = window.explorer.map.amount(facts, p);
            return Number.isFinite(value) ? value : -1;
        })""",
        cases,
    )
    assert sum(map(math.isinf, expected)) > 2
    finite = [-1.0 if math.isinf(moved) else moved for moved in expected]
    np.testing.assert_allclose(found, finite, rtol=1e-6)


@pytest.mark.parametrize("measure", ["error", "deflection"])
def test_map_of_displacements_is_read_under_the_pointer(tab: Tab, measure: str) -> None:
    page, load = tab.running.page, (0.0, 0.0, -50.0)
    actuators = Actuators(error_mm=six([0.05] * 6), stiffness_n_mm=six([1000.0] * 6))
    page.session.do(Open(msgspec.structs.replace(OPTIMAL, actuators=actuators)))
    page.session.do(Set("view.forces.force", load))
    page.session.do(Set("view.workspace.colour", measure))
    tab.turn_to("Workspace")
    tab.push("y")
    map_in(tab).wait_for()
    reading = tab.page.locator(".ex-reading")
    name = {"error": "worst error of the tool", "deflection": "deflection under the load"}[measure]
    words = re.compile(rf"x ([−\d.]+), z ([−\d.]+) units: {name} ([\d.,]+) mm")
    rest_on(tab, 0.6, 0.4)
    expect(reading).to_have_text(words)
    found = words.match(reading.inner_text())
    drawing = page.services.get(WorkspaceFeed).drawing
    assert found is not None
    assert drawing is not None
    assert drawing.level is not None
    at = np.array([number(found[1]), drawing.level, number(found[2])])
    rotation = np.array(drawing.request.rotation)
    if measure == "error":
        moved = worst_error(OPTIMAL, at, rotation, [0.05] * 6).displacement
    else:
        soft = compliance(OPTIMAL, at, rotation, [1000.0] * 6)
        moved = np.linalg.norm(deflection(soft, [*load, 0.0, 0.0, 0.0])[:3])
    assert number(found[3].replace(",", "")) == pytest.approx(float(moved), rel=0.02)


def test_map_of_shares_is_read_under_the_pointer(tab: Tab) -> None:
    page = tab.running.page
    page.session.do(Open(FULL))
    page.session.do(Set("view.workspace.colour", "share"))
    tab.turn_to("Workspace")
    tab.push("y")
    map_in(tab).wait_for()
    reading = tab.page.locator(".ex-reading")
    words = re.compile(r"largest share of a limit ([\d.,]+) % \(([\w ]+)\)")
    rest_on(tab, 0.6, 0.4)
    expect(reading).to_have_text(words)
    found = words.search(reading.inner_text())
    where = re.match(r"x ([−\d.]+), z ([−\d.]+) units", reading.inner_text())
    drawing = page.services.get(WorkspaceFeed).drawing
    assert found is not None
    assert where is not None
    assert drawing is not None
    assert drawing.level is not None
    assert drawing.request.load is not None
    at = np.array([number(where[1]), drawing.level, number(where[2])])
    rotation = np.array(drawing.request.rotation)
    case = load_case(FULL, rotation, np.array(drawing.request.load))
    share = float(largest_shares(case, rotation, at[None])[0][0])
    assert 0.01 * float(found[1].replace(",", "")) == pytest.approx(share, rel=0.02)
    assert found[2] in part_names(FULL)


def test_reading_stays_while_the_map_is_drawn_anew(tab: Tab) -> None:
    tab.turn_to("Workspace")
    tab.push("y")
    map_in(tab).wait_for()
    rest_on(tab, 0.5, 0.5)
    reading = tab.page.locator(".ex-reading")
    expect(reading).to_have_text(READING)
    before = reading.inner_text()
    tab.running.page.session.do(Set("view.workspace.level", 9.0))
    assert tab.running.page.wait_until_drawn(PATIENCE_SECONDS)
    expect(map_in(tab)).to_have_attribute("aria-label", "Map of the slice at y = 9")
    expect(reading).to_have_text(before)


def test_map_of_the_tool_is_read_and_leads_the_tool_there(tab: Tab) -> None:
    page, tool = tab.running.page, (1.0, 0.0, 3.0)
    page.session.do(Set("design", msgspec.structs.replace(OPTIMAL, tool=Tool(position=tool))))
    tab.turn_to("Pose")
    tab.push("tool point")
    tab.turn_to("Workspace")
    tab.push("y")
    map_in(tab).wait_for()
    page.session.do(Set("view.workspace.level", 6.0))
    expect(map_in(tab)).to_have_attribute("aria-label", "Map of the slice at y = 6")
    reading = tab.page.locator(".ex-reading")
    rest_on(tab, 0.55, 0.6)
    expect(reading).to_have_text(READING)
    found = READING.match(reading.inner_text())
    assert found is not None
    goal = np.array([number(found[1]), 6.0, number(found[2])])
    offset = tab.state.pose.rotation @ np.array(tool)
    sizes = np.abs(margins(goal - offset, tab.state.pose.rotation))
    assert number(found[3]) == pytest.approx(float(sizes.min()), abs=0.02)
    assert int(found[4]) == int(sizes.argmin()) + 1
    tab.page.mouse.down()
    tab.page.mouse.up()

    def is_there() -> bool:
        pose = tab.state.pose
        return bool(np.allclose(pose.position + pose.rotation @ np.array(tool), goal, atol=0.006))

    tab.wait_for(is_there, "the position read")
