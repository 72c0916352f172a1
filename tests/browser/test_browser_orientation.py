"""Tilts in a real page: the map to click on, angles to type, positions to colour."""

from __future__ import annotations

import re

import pytest
from playwright.sync_api import expect
from tab import Tab

from explorer.app.features.orientation.feeds import RangeFeed, TiltsFeed
from explorer.app.features.orientation.polar_map import RADIUS, WIDTH, edge_of
from explorer.mechanism.home import home_pose
from explorer.mechanism.tilt_torsion import TiltTorsion, tilt_torsion_of
from explorer.workspace.orientations.tilts import tilt_map


def angles(tab: Tab) -> TiltTorsion:
    return tilt_torsion_of(tab.state.pose.rotation)


def test_a_click_on_the_map_tilts_there(tab: Tab) -> None:
    tab.turn_to("Tilt")
    chart = tab.page.locator("[data-tilts]")
    chart.scroll_into_view_if_needed()
    box = chart.bounding_box()
    assert box is not None
    scale = box["width"] / WIDTH
    torsion = angles(tab).torsion
    edge = edge_of(
        tilt_map(tab.state.design, tab.state.pose.position, torsion),
        angles(tab),
        tilt_torsion_of(home_pose(tab.state.design).rotation),
    )
    x, y = box["x"] + 0.5 * box["width"], box["y"] + 0.5 * box["height"]
    off = 20.0 / edge * RADIUS * scale
    tab.page.mouse.move(x, y - off)
    expect(tab.page.get_by_text("azimuth 90.0°, tilt", exact=False)).to_be_visible()
    tab.page.mouse.click(x, y - off)
    tab.wait_for(lambda: angles(tab).tilt > 1.0, "a tilt")
    assert angles(tab).azimuth == pytest.approx(90.0, abs=2.0)
    assert angles(tab).tilt == pytest.approx(20.0, abs=1.0)
    assert angles(tab).torsion == pytest.approx(torsion, abs=1e-9)
    expect(chart.locator(".home:not(.is-other)")).to_have_count(1)


def test_typed_angles_move_the_platform(tab: Tab) -> None:
    tab.turn_to("Tilt")
    tab.type("Tilt (°)", "12\n")
    tab.wait_for(lambda: abs(angles(tab).tilt - 12.0) < 1e-9, "a tilt of 12°")
    tab.type("Torsion (°)", "-60\n")
    tab.wait_for(lambda: abs(angles(tab).torsion + 60.0) < 1e-9, "a torsion of −60°")
    # In the map of another torsion home is dashed.
    expect(tab.page.locator("[data-tilts] .home.is-other")).to_have_count(1)


def test_a_click_on_the_torsions_turns_the_platform(tab: Tab) -> None:
    tab.turn_to("Tilt")
    strip = tab.page.locator("[data-torsions]")
    strip.scroll_into_view_if_needed()
    box = strip.bounding_box()
    assert box is not None
    # The middle of the strip is a little left of that of its axis.
    x, y = box["x"] + 0.5 * box["width"], box["y"] + 0.5 * box["height"]
    tab.page.mouse.move(x, y)
    expect(tab.page.get_by_text(re.compile("torsion −1[0-9].*, tilt"))).to_be_visible()
    tab.page.mouse.click(x, y)
    tab.wait_for(lambda: abs(angles(tab).torsion + 15.0) < 6.0, "a torsion near −15°")


def test_a_click_counts_on_the_chart_that_it_is_on(tab: Tab) -> None:
    tab.turn_to("Tilt")
    before = angles(tab)
    # The last move of the pointer was on the map; a press by a script has none.
    chart = tab.page.locator("[data-tilts]")
    chart.hover()
    tab.page.evaluate(
        """() => {
          const strip = document.querySelector("[data-torsions]");
          const box = strip.getBoundingClientRect();
          const [clientX, clientY] = [box.x + 0.5 * box.width, box.y + 0.5 * box.height];
          strip.dispatchEvent(new MouseEvent("click", { clientX, clientY, bubbles: true }));
        }"""
    )
    tab.wait_for(lambda: abs(angles(tab).torsion + 15.0) < 6.0, "a torsion near −15°")
    assert angles(tab).tilt == pytest.approx(before.tilt, abs=1e-9)


def test_positions_are_coloured_and_ranges_have_volumes(tab: Tab) -> None:
    tab.turn_to("Tilt")
    services = tab.running.page.services
    tab.switch("Greatest tilts", on=True)
    tab.wait_for(lambda: services.get(TiltsFeed).drawing is not None, "tilts at nodes")
    expect(tab.page.get_by_text("nodes, 0.", exact=False)).to_be_visible()
    tab.choose("Solid over tilts", "total")
    tab.wait_for(lambda: services.get(RangeFeed).drawing is not None, "the solid")
    expect(tab.page.get_by_text("Total workspace", exact=True)).to_be_visible()
    tab.switch("Greatest tilts", on=False)
    tab.wait_for(lambda: services.get(TiltsFeed).drawing is None, "no tilts")
