"""The prototype in a real page: parts that move, that are drawn apart, that are told and sent."""

from __future__ import annotations

from dataclasses import replace

from likeness import decoded, likeness
from playwright.sync_api import expect
from tab import Tab

from explorer.app.features.prototype.feed import PartsFeed
from explorer.app.features.prototype.tasks import export_simulation
from explorer.app.screenshot import PATIENCE_SECONDS
from explorer.app.state.actions import Open, Set, SetPosition
from explorer.workspace.accessible.radii import with_radius

# A difference of two pictures that the eye cannot miss.
PLAIN_TO_SEE = 5.0
# One that it does not see.
ALIKE = 1.0


def wait_until_drawn(tab: Tab) -> None:
    assert tab.running.page.wait_until_drawn(PATIENCE_SECONDS)


def difference(before: bytes, after: bytes) -> float:
    return likeness(decoded(before), decoded(after)).spot


def test_the_prototype_takes_the_place_of_the_schematic_moves_and_is_exported(tab: Tab) -> None:
    page, session = tab.running.page, tab.running.page.session
    bare = replace(tab.state.view, handle=False, flags=False, tetrahedra=(False, False, False))
    session.do(Set("view", bare))
    tab.turn_to("Prototype")
    schematic = tab.picture()
    expect(tab.label("Exploded")).to_be_hidden()
    tab.switch("Show the parts", on=True)
    tab.label("Exploded").wait_for()
    wait_until_drawn(tab)
    together = tab.picture()
    assert difference(schematic, together) > PLAIN_TO_SEE
    made = page.services.get(PartsFeed).parts

    home = tab.state.pose.position
    session.do(SetPosition(2, home[2] - 2.0))
    lower = tab.picture()
    assert difference(together, lower) > PLAIN_TO_SEE
    session.do(SetPosition(2, home[2]))
    assert difference(together, tab.picture()) < ALIKE

    goal = tab.drag("Exploded", 0.5)
    tab.wait_for(lambda: abs(tab.state.view.prototype.exploded - goal) < 0.05, "parts apart")
    assert difference(together, tab.picture()) > PLAIN_TO_SEE
    assert page.services.get(PartsFeed).parts is made

    assert made is not None
    expect(tab.page.get_by_text(f"{made.listed.mass(2700.0):.1f} g")).to_be_visible()
    tab.type("Density (kg/m³)", "7850")
    tab.wait_for(lambda: tab.state.view.prototype.density == 7850.0, "steel")
    expect(tab.page.get_by_text(f"{made.listed.mass(7850.0):.1f} g")).to_be_visible()
    for file_format, name in (("GLB", "mechanism.glb"), ("STL (zip)", "parts-stl.zip")):
        download = tab.export("Mechanism", file_format)
        assert download.suggested_filename == f"paper-optimal-{name}"
        assert download.path().stat().st_size > 10_000
    download = tab.export("Simulation", "MJCF")
    assert download.suggested_filename == "paper-optimal-simulation.xml"
    assert download.path().read_bytes() == export_simulation(tab.state.design, 7850.0)


def test_a_design_too_tight_is_told_and_stays_schematic(tab: Tab) -> None:
    tab.turn_to("Prototype")
    tab.running.page.session.do(Open(with_radius(tab.state.design, 0.4)))
    schematic = tab.picture()
    tab.switch("Show the parts", on=True)
    alert = tab.page.get_by_role("alert").filter(has_text="No prototype of this design")
    alert.wait_for()
    expect(alert).to_contain_text("carriages 2 and 3 at home are 6.69 mm apart and need 8.2 mm")
    expect(tab.label("Exploded")).to_be_hidden()
    wait_until_drawn(tab)
    # The hint of the switch stands over the scene.
    tab.page.mouse.move(0, 0)
    tab.page.get_by_role("tooltip").wait_for(state="hidden")
    assert difference(schematic, tab.picture()) < ALIKE
    tab.running.page.session.do(Open(with_radius(tab.state.design, 0.3)))
    tab.label("Exploded").wait_for()
    expect(alert).to_be_hidden()
    wait_until_drawn(tab)
    assert difference(schematic, tab.picture()) > PLAIN_TO_SEE
