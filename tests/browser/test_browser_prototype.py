"""The prototype in a real page: parts that move, are drawn exploded, and are exported."""

from __future__ import annotations

from dataclasses import replace

from likeness import decoded, likeness
from playwright.sync_api import expect
from tab import Tab

from explorer.app.features.prototype.work import PARTS_FEED, export_simulation, parts_to_draw
from explorer.app.state.actions import Set, SetPosition

# A difference of two pictures that the eye cannot miss.
PLAIN_TO_SEE = 5.0
# One that it does not see.
ALIKE = 1.0


def difference(before: bytes, after: bytes) -> float:
    return likeness(decoded(before), decoded(after)).spot


def test_prototype_replaces_the_schematic_moves_with_it_and_is_drawn_exploded(tab: Tab) -> None:
    page, session = tab.running.page, tab.running.page.session
    bare = replace(tab.state.view, handle=False, flags=False, tetrahedra=(False, False, False))
    session.do(Set("view", bare))
    tab.turn_to("Prototype")
    schematic = tab.picture()
    expect(tab.label("Exploded")).to_be_hidden()
    tab.switch("Show the parts", on=True)
    tab.label("Exploded").wait_for()
    together = tab.picture()
    assert difference(schematic, together) > PLAIN_TO_SEE
    parts = parts_to_draw(page.services.get(PARTS_FEED))
    home = tab.state.pose.position
    session.do(SetPosition(2, home[2] - 2.0))
    assert difference(together, tab.picture()) > PLAIN_TO_SEE
    session.do(SetPosition(2, home[2]))
    assert difference(together, tab.picture()) < ALIKE
    goal = tab.drag("Exploded", 0.5)
    tab.wait_for(lambda: abs(tab.state.view.prototype.exploded - goal) < 0.05, "parts apart")
    assert difference(together, tab.picture()) > PLAIN_TO_SEE
    assert parts_to_draw(page.services.get(PARTS_FEED)) is parts
    for file_format, name in (("GLB", "mechanism.glb"), ("STL (zip)", "parts-stl.zip")):
        download = tab.export("Mechanism", file_format)
        assert download.suggested_filename == f"paper-optimal-{name}"
        assert download.path().stat().st_size > 10_000
    download = tab.export("Simulation", "MJCF")
    assert download.suggested_filename == "paper-optimal-simulation.xml"
    density = tab.state.view.prototype.density
    assert download.path().read_bytes() == export_simulation(tab.state.design, density)
