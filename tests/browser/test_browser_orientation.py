"""Tilts in a real page: the charts to click on, and angles to type."""

from __future__ import annotations

import pytest
from playwright.sync_api import Locator, expect
from tab import Tab

from explorer.app.features.orientation.maps import RADIUS, WIDTH, edge_of
from explorer.mechanism.tilt_torsion import TiltTorsion, tilt_torsion_of
from explorer.workspace.orientations.tilts import tilt_map


def angles(tab: Tab) -> TiltTorsion:
    return tilt_torsion_of(tab.state.pose.rotation)


def middle_of(tab: Tab, chart: Locator) -> tuple[float, float, float]:
    """Scroll to a chart that is at rest; return its middle and its breadth."""
    chart.scroll_into_view_if_needed()
    tab.settle()
    box = chart.bounding_box()
    assert box is not None
    return box["x"] + 0.5 * box["width"], box["y"] + 0.5 * box["height"], box["width"]


def test_platform_is_tilted_by_clicks_on_the_map_and_by_typed_angles(tab: Tab) -> None:
    tab.turn_to("Tilt")
    chart = tab.page.locator(".ex-tilts[data-map]")
    torsion = angles(tab).torsion
    edge = edge_of(
        tilt_map(tab.state.design, tab.state.pose.position, torsion),
        angles(tab),
        tilt_torsion_of(tab.state.design.home_pose.rotation),
    )
    x, y, width = middle_of(tab, chart)
    off = 20.0 / edge * RADIUS * width / WIDTH
    tab.page.mouse.move(x, y - off)
    expect(tab.page.get_by_text("azimuth 90.0°, tilt", exact=False)).to_be_visible()
    tab.page.mouse.click(x, y - off)
    tab.wait_for(lambda: angles(tab).tilt > 1.0, "a tilt")
    assert angles(tab).azimuth == pytest.approx(90.0, abs=2.0)
    assert angles(tab).tilt == pytest.approx(20.0, abs=1.0)
    assert angles(tab).torsion == pytest.approx(torsion, abs=1e-9)
    expect(chart.locator(".home:not(.is-other)")).to_have_count(1)
    tab.type("Tilt (°)", "12\n")
    tab.wait_for(lambda: abs(angles(tab).tilt - 12.0) < 1e-9, "a tilt of 12°")
    tab.type("Torsion (°)", "-60\n")
    tab.wait_for(lambda: abs(angles(tab).torsion + 60.0) < 1e-9, "a torsion of −60°")
    # In the map of another torsion home is dashed.
    expect(chart.locator(".home.is-other")).to_have_count(1)
