"""Optimising in a real page: one press, live charts, the verdict in every tab, and its files."""

from __future__ import annotations

from kept_tab import OpenTab
from playwright.sync_api import expect

from explorer.mechanism.design_file import PRESETS, decode_design
from explorer.optimise.record import decode_record
from explorer.workspace.slices.volume import workspace_volume

OPTIMAL = PRESETS["paper-optimal"]


def test_one_press_finds_a_design_that_is_seen_in_every_tab_and_accepted(
    open_tab: OpenTab,
) -> None:
    tab, other = open_tab(), open_tab()
    for each in (tab, other):
        each.turn_to("Optimise")
    accept = tab.page.get_by_role("button", name="Accept", exact=True)
    expect(accept).to_have_count(0)
    tab.choose("Objective", "shortest legs for a volume")
    expect(tab.field("Volume")).to_have_value("7053.04")
    tab.push("Optimise")
    # The process starts first, so that there is time to change one's mind in any tab.
    other.page.get_by_role("button", name="Cancel", exact=True).first.wait_for()
    tab.page.get_by_text("Converged", exact=True).first.wait_for()
    found = tab.state.design
    assert workspace_volume(found).volume >= 7053.04 * (1.0 - 1e-6)
    assert found.reach < 17.9
    reaches = (OPTIMAL.reach, found.reach, found.reach - OPTIMAL.reach)
    for each in (tab, other):
        expect(each.page.get_by_text(f"longest leg = {found.reach:.6g}")).to_be_visible()
        expect(each.page.locator(".uplot canvas:visible")).to_have_count(3)
        for value in reaches:
            text = f"{value:.4f}".replace("-", "−")
            expect(each.page.get_by_role("cell", name=text, exact=True)).to_be_visible()

    with tab.page.expect_download() as hull:
        tab.push("Hull")
    assert hull.value.suggested_filename == "paper-optimal-optimised-hull.3mf"
    with tab.page.expect_download() as saved:
        tab.push("Design")
    assert decode_design(saved.value.path().read_bytes(), "saved") == found

    with tab.page.expect_download() as search:
        tab.push("Record")
    assert search.value.suggested_filename == "paper-optimal-optimised.record.json"
    record = decode_record(search.value.path().read_bytes(), "search")
    assert record.design.variables == found.variables

    other.push("Accept")
    for each in (tab, other):
        expect(each.page.get_by_role("button", name="Revert", exact=True)).to_have_count(0)
        expect(each.page.get_by_text("accepted")).to_be_visible()
    assert tab.state.design == found
    assert tab.state.base == OPTIMAL


def test_the_papers_problem_is_solved_by_two_presses_and_its_hull_lies_beside_the_result(
    open_tab: OpenTab,
) -> None:
    tab = open_tab()
    tab.page.set_viewport_size({"width": 1280, "height": 720})
    tab.turn_to("Optimise")
    filled = tab.page.locator("[data-ex=drawer] .ex-button.is-main:visible")
    tab.push("The paper's problem")
    tab.wait_for(lambda: tab.state.design.name == "paper-initial", "the initial row")
    expect(tab.page.get_by_text("x 0 to 20, y −12 to 22, z 0 to 18")).to_be_visible()
    tab.push("Optimise")
    tab.page.get_by_text("Converged", exact=True).first.wait_for()
    expect(filled).to_have_text(["Accept"])
    volume = tab.page.get_by_role("cell", name="8,000.00", exact=True)
    for each in (filled, tab.page.get_by_role("button", name="Hull", exact=True), volume):
        expect(each).to_be_in_viewport(ratio=1.0)
    assert abs(workspace_volume(tab.state.design).volume / 8000.0 - 1.0) <= 1e-6
    with tab.page.expect_download() as hull:
        tab.push("Hull")
    assert hull.value.suggested_filename == "paper-initial-optimised-hull.3mf"
