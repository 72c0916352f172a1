"""One filled button in a tab and in a dialog at most, in every state of the page."""

from __future__ import annotations

from typing import Any

import pytest
import viser
from client import wait_for
from desk import CLIENT
from sample_states import iterates_of

from explorer.app.features.optimise import runner
from explorer.app.features.optimise.actions import SetRequest, StartRun
from explorer.app.features.paths.actions import Go
from explorer.app.inputs.controls import MAIN
from explorer.app.server import Running
from explorer.app.state.actions import Open, Set, SetJoint
from explorer.app.state.optimisation import OptimisationRequest, SearchResult
from explorer.mechanism.design_file import PRESETS

PATIENCE_SECONDS = 120.0
FILLED = "is-main"
ENDLESS = OptimisationRequest(objective="smallest-reach", volume=7053.0, starts=10_000)


def filled(container: Any) -> list[str]:
    """Return the filled buttons that are visible in a container, by their words or markup."""
    found: list[str] = []
    for handle in container._children.values():
        props = handle._impl.props
        if not getattr(props, "visible", True):
            continue
        if isinstance(handle, viser.GuiHtmlHandle):
            found += [FILLED] * handle.content.count(FILLED)
        elif isinstance(handle, viser.GuiButtonHandle):
            found += [handle.label] * (handle.color == MAIN and not handle.disabled)
        if hasattr(handle, "_children"):
            found += filled(handle)
    return found


def filled_by_tab(running: Running) -> dict[str, list[str]]:
    """Return the filled buttons of each tab and dialog, by its title, and those of the bar."""
    gui: Any = running.viser.gui
    panels: dict[str, list[str]] = {"bar": filled(gui._container_handle_from_uuid["root"])}
    for handle in gui._panel_handle_from_uuid.values():
        for label, tab in zip(handle._tab_labels, handle._tab_handles, strict=True):
            panels[label] = filled(tab)
    return panels


def check(running: Running, *expected: str) -> None:
    """Check that no place has two filled buttons, and that the expected ones have one."""
    assert running.page.session.wait_until_idle()
    found = filled_by_tab(running)
    assert {"bar", "Pose", "Optimise", "Export", "Designs"} <= found.keys()
    assert {place: each for place, each in found.items() if len(each) > 1} == {}
    assert {place for place in expected if not found[place]} == set()


def test_each_tab_has_one_filled_button_at_most(running: Running) -> None:
    session, buttons = running.page.session, running.page.buttons
    check(running, "Optimise", "Paths", "Studies")
    session.do(SetJoint(0, 200.0))
    check(running, "Pose")
    session.do(Open(PRESETS["paper-optimal"]))
    buttons.press("compare.pin", "", CLIENT)
    wait_for(lambda: not session.state.compared.is_empty)
    check(running, "Compare")
    buttons.press("studies.start", "", CLIENT)
    wait_for(lambda: session.state.studies.name is not None)
    check(running)
    session.do(Go())
    wait_for(lambda: session.state.journey is not None)
    check(running, "Paths")
    session.do(Open(PRESETS["paper-optimal"]))


def test_search_and_its_answer_leave_one_filled_button_at_most(
    running: Running, monkeypatch: pytest.MonkeyPatch
) -> None:
    # No iterate is drawn, so that the page comes to rest during the search.
    monkeypatch.setattr(runner, "PACE", 600.0)
    session = running.page.session
    session.do(SetRequest("optimisation.request", ENDLESS))
    session.do(StartRun())
    wait_for(lambda: session.state.optimisation.is_on)
    check(running)
    running.page.buttons.press("optimise.cancel", "", CLIENT)
    wait_for(lambda: not session.state.optimisation.is_on)
    check(running)
    (best,) = iterates_of(session.state, 1)
    session.do(Set("optimisation.run.verdict", SearchResult("converged", "", best)))
    check(running, "Optimise")
