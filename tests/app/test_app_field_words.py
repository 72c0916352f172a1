"""What the page refuses is told in its own words, and what a file holds in the file's."""

from __future__ import annotations

import re
from typing import Any

import msgspec
import pytest
import viser
from desk import Desk

from explorer.app.features.feature import Services
from explorer.app.features.machine.panel import MachinePanel
from explorer.app.features.mechanism.design_panel import DesignPanel
from explorer.app.features.mechanism.pose_panel import MovePanel
from explorer.app.session.field_words import FIELD_WORDS, message_of
from explorer.app.session.session import UNDO
from explorer.errors import DesignError, InputError
from explorer.mechanism.design import Design, Limits
from explorer.mechanism.design_file import decode_design

# What no text for people holds: names with an underscore or a point within, and JSON's.
CODE = re.compile(r"[a-z]_[a-z]|[a-z]\.[a-z]|\bnull\b|\bNone\b")
BAD = (-1.0, 0.0, 181.0, 1e9, 1e45)


def test_refusals_of_the_page_hold_no_names_of_the_code(
    server: viser.ViserServer, desk: Desk, services: Services
) -> None:
    gui: Any = server.gui
    before = set(gui._gui_input_handle_from_uuid)
    for panel in (DesignPanel, MovePanel, MachinePanel):
        panel(services)
    handles = [h for u, h in gui._gui_input_handle_from_uuid.items() if u not in before]
    start = desk.state
    for handle in handles:
        values: list[object] = []
        match handle.value:
            case float():
                values += BAD
            case (float(low), float(high)):
                values += [pair for bad in BAD for pair in ((bad, high), (low, bad))]
            case _:
                continue
        for value in values:
            desk.use(handle, value)
            if desk.state != start:
                desk.session.travel(UNDO)
                start = desk.state
    words = {each for each in FIELD_WORDS.values() if any(each in said for said in desk.complaints)}
    assert len(words) > 20
    assert [message for message in desk.complaints if CODE.search(message)] == []


@pytest.mark.parametrize(
    ("field", "message"),
    [
        ('"unit_mm": 0', "The unit must be positive; got 0"),
        ('"node_step": -1', "The step of the nodes must be positive; got -1"),
        ('"limits": {"l1": [3, 2]}', "The length l1: the minimum 3 exceeds the maximum 2"),
    ],
)
def test_refusal_of_a_file_names_its_field_and_the_page_says_it_in_words(
    field: str, message: str
) -> None:
    data = f'{{"schema": 2, "a3": [9, 4], "b1": [4, -1], "b2": 3, "b3": 1.5, {field}}}'
    with pytest.raises(DesignError, match=field.strip('"').partition('"')[0]):
        decode_design(data.encode(), "mine.json")
    fields: dict[str, Any] = msgspec.json.decode(data)
    limits = fields.pop("limits", {})
    with pytest.raises(DesignError) as refusal:
        Design(**fields, limits=Limits(**limits))
    assert message_of(refusal.value).startswith(message)


def test_message_without_a_field_stays_as_it_is() -> None:
    assert message_of(InputError("unit_mm")) == "unit_mm"
    assert message_of(DesignError("degenerate design")) == "degenerate design"
