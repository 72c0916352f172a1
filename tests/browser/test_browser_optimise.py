"""Optimising in a real page: one press, live charts, the result in every tab, and its files."""

from __future__ import annotations

from client import client_of
from playwright.sync_api import expect
from tab import Tab

from explorer.mechanism.design_file import PRESETS, decode_design
from explorer.optimise.outcome import decode_record
from explorer.workspace.slices.volume import workspace_volume

OPTIMAL = PRESETS["paper-optimal"]


def test_optimise_finds_a_design_shows_it_gives_its_files_and_takes_it(tab: Tab) -> None:
    tab.turn_to("Optimise")
    accept = tab.page.get_by_role("button", name="Accept", exact=True)
    expect(accept).to_have_count(0)
    tab.choose("Objective", "shortest legs for a volume")
    expect(tab.field("Volume (units³)")).to_have_value("7053.04")
    tab.settle()
    tab.push("Optimise")
    # A search takes minutes on a busy machine.
    tab.page.get_by_text("Converged", exact=True).first.wait_for(timeout=300_000)
    found = tab.state.design
    assert workspace_volume(found).volume >= 7053.04 * (1.0 - 1e-6)
    assert found.reach < 17.9
    expect(tab.page.get_by_text(f"longest leg {found.reach:.6g} units after")).to_be_visible()
    expect(tab.page.locator(".uplot canvas:visible")).to_have_count(3)
    for value in (OPTIMAL.reach, found.reach, found.reach - OPTIMAL.reach):
        text = f"{value:.4f}".replace("-", "−")
        expect(tab.page.get_by_role("cell", name=text, exact=True)).to_be_visible()
    # A tab that comes now is sent the result too.
    with client_of(tab.running) as other:
        other.read_all_sent(tab.running)
        contents = [str(props.get("content")) for props in other.controls.values()]
        assert any(f"{found.reach:.4f}" in content for content in contents)

    tab.settle()
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

    tab.settle()
    accept.first.click()
    expect(tab.page.get_by_role("button", name="Revert", exact=True)).to_have_count(0)
    expect(tab.page.get_by_text("accepted")).to_be_visible()
    assert tab.state.design == found
    assert tab.state.base == OPTIMAL
