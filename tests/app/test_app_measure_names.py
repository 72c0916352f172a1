"""A measure of the page has one value: what is defined otherwise has another name."""

from __future__ import annotations

import re
from collections.abc import Iterator

from client import wait_for
from monkey import explorer_with_data
from page_props import shown_by

from explorer.app.features.compare.actions import Pin
from explorer.app.features.optimise.actions import Accept, SetRequest, StartRun
from explorer.app.server import Running
from explorer.app.state.actions import Set, SetAngle, SetPosition
from explorer.app.state.optimisation import OptimisationRequest
from explorer.app.state.state import State
from explorer.mechanism.design_file import PRESETS

PATIENCE_SECONDS = 120.0
FIGURE = re.compile(r'class="ex-figure"[^>]*><span class="ex-dim">(.*?)</span><b[^>]*>(.*?)</b>')
ROW = re.compile("<tr[^>]*>(.*?)</tr>")
CELL = re.compile("<td[^>]*>(.*?)</td>")
TAG = re.compile("<[^>]*>")
UNITS = re.compile(r",? (units[²³]?|mm[²³]?|u[²³]?|°|%)$")
NUMBER = re.compile(r"−?[\d,]+(\.\d+)?")
# Columns of the live design: after the old one in Optimise, the first in Compare.
COLUMN = {"old": 2}
# Measures of which the page has several, in different definitions or of the same.
WATCHED = {"volume", "clearance", "nodes", "node volume", "node step", "reach", "longest leg"}


def pairs(running: Running) -> Iterator[tuple[str, str]]:
    """Yield each label with its number, of the live design, from the bar and from all tables."""
    for place, value in shown_by(running).items():
        if not isinstance(value, str) or not place.endswith(" content"):
            continue
        yield from FIGURE.findall(value)
        column = 1
        for row in ROW.findall(value):
            cells = [TAG.sub("", cell).strip() for cell in CELL.findall(row)]
            column = COLUMN.get(cells[1], column) if len(cells) > 1 else column
            if len(cells) > column:
                yield cells[0], cells[column]


def values_by_name(running: Running) -> dict[str, set[str]]:
    """Return the numbers of each watched measure, without the zeros at their ends."""
    found: dict[str, set[str]] = {}
    for label, text in pairs(running):
        name, number = UNITS.sub("", label).lower(), NUMBER.match(text)
        if number is not None and name in WATCHED:
            plain = float(number[0].replace(",", "").replace("−", "-"))
            found.setdefault(name, set()).add(f"{plain:.4g}")
    return found


def is_compared(state: State) -> bool:
    run = state.optimisation.run
    return run is not None and run.comparison is not None


def test_name_has_one_value_after_an_optimum_and_after_a_turn() -> None:
    with explorer_with_data() as running:
        page, session = running.page, running.page.session
        request = OptimisationRequest(objective="smallest-reach", volume=7053.0)
        session.do(SetRequest("optimisation.request", request))
        session.do(StartRun())
        wait_for(lambda: is_compared(session.state))
        for action in (
            Accept(),
            Pin(PRESETS["paper-initial"]),
            Set("view.workspace.solid", True),
            Set("view.drawn_as", "prototype"),
            SetPosition(0, 9.0),
        ):
            session.do(action)
        for turn, orientation, region in (
            (0.0, "home", "limits"),
            (35.0, "home", "accessible"),
            (0.0, "pose", "limits"),
            (0.0, "pose", "accessible"),
        ):
            session.do(SetAngle(0, session.state.yaw_pitch_roll[0] + turn))
            session.do(Set("view.workspace.orientation", orientation))
            session.do(Set("view.workspace.region", region))
            assert page.wait_until_drawn(PATIENCE_SECONDS)
            found = values_by_name(running)
            assert {"volume", "clearance", "nodes", "node volume"} <= found.keys()
            several = {name: values for name, values in found.items() if len(values) > 1}
            assert several == {}, (orientation, region)
            labels = {label for label, _ in pairs(running)}
            assert ("Volume, turned" in labels) is (orientation == "pose")
