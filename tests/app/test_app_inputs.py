"""Ranges of sliders hold what is possible; refusals are told in the words of the page."""

from __future__ import annotations

import math
import re
from dataclasses import replace
from decimal import Decimal
from typing import Any

import msgspec
import pytest
import viser
from desk import Desk
from hypothesis import given, strategies as st
from page_widgets import widgets

from explorer.app.features.feature import Services
from explorer.app.features.machine.feature import MachinePanel
from explorer.app.features.mechanism.feature import DesignPanel, MovePanel
from explorer.app.inputs.bindings import in_unit, item
from explorer.app.inputs.limits import limit_span, push_other_end
from explorer.app.inputs.ranges import (
    Span,
    coordinate_span,
    in_whole_steps,
    joint_span,
    length_span,
    position_span,
    round_span,
    tint_marks,
    variable_span,
)
from explorer.app.session.session import UNDO
from explorer.app.state.actions import Set
from explorer.app.state.frame import Frame
from explorer.app.state.moves import set_joint, set_position
from explorer.app.state.state import open_state
from explorer.errors import DesignError
from explorer.measures.field_words import FIELD_WORDS, message_of
from explorer.mechanism.design import JOINTS, VARIABLES, Design, Limits
from explorer.mechanism.design_file import PRESETS, decode_design
from explorer.numerics.number_text import Unit
from explorer.workspace.limits.table import LIMITS

OPTIMAL = PRESETS["paper-optimal"]


@given(st.floats(1e-5, 1e5))
def test_ranges_are_round_and_hold_the_design_whatever_its_size(size: float) -> None:
    design = Design(
        a3=(size, 0.4 * size), b1=(0.4 * size, -0.1 * size), b2=0.3 * size, b3=0.1 * size
    )
    state = open_state(design)
    spans = {
        **{name: joint_span(state, i) for i, name in enumerate(JOINTS)},
        **{name: position_span(state, i) for i, name in enumerate("xyz")},
        **{f"variable {name}": variable_span(state, i) for i, name in enumerate(VARIABLES)},
        **{
            f"limit {entry.label}": limit_span(design, entry)
            for limit in LIMITS
            for entry in limit.entries
            if not entry.is_angle
        },
        "length": length_span(state),
        "coordinate": coordinate_span(state),
    }
    for name, span in spans.items():
        assert span.low < span.high, name
        assert span.step < size / 100.0, name
        if not name.startswith(("variable", "length", "coordinate")):
            # A slider's values are whole steps from its lower end.
            steps = span.low / span.step
            assert steps == pytest.approx(round(steps), abs=1e-6), name
    for name, value in zip(JOINTS, state.joints, strict=True):
        assert spans[name].low <= value <= spans[name].high, name
    for name, value in zip(VARIABLES, design.variables, strict=True):
        span = spans[f"variable {name}"]
        assert span.low <= value <= span.high, name


intervals = st.lists(st.floats(-40.0, 40.0), min_size=2, max_size=6, unique=True).map(
    lambda ends: tuple(zip(sorted(ends)[::2], sorted(ends)[1::2], strict=False))
)
WHOLE = Span(-30.0, 30.0, 0.01)


@given(intervals)
def test_marks_tint_what_lies_within_intervals_and_nothing_else(
    given_intervals: tuple[tuple[float, float], ...],
) -> None:
    assert tint_marks(((-math.inf, math.inf),), WHOLE) == (-30.0, 30.0)
    marks = tint_marks(given_intervals, WHOLE)
    assert list(marks) == sorted(marks)
    assert len(marks) % 2 == 0
    for value in (-29.99 + 0.73 * k for k in range(82)):
        is_tinted = sum(mark < value for mark in marks) % 2 == 1
        is_inside = any(low < value < high for low, high in given_intervals)
        is_at_an_end = any(abs(value - end) < 1e-9 for pair in given_intervals for end in pair)
        assert is_tinted == is_inside or is_at_an_end


@given(st.tuples(st.floats(-9, 9), st.floats(0, 9)), st.booleans(), st.floats(-20, 20))
def test_end_that_passes_the_other_pushes_it_along(
    place: tuple[float, float], is_high: bool, value: float
) -> None:
    before = (place[0], place[0] + place[1])
    after = (before[0], value) if is_high else (value, before[1])
    low, high = push_other_end(before, after)
    assert low <= high
    assert (high if is_high else low) == value
    if after[0] <= after[1]:
        assert (low, high) == after


def handles(panel: Any, desk: Desk, kind: type) -> dict[str, Any]:
    """Return the handles of a kind by their labels, after a panel has shown the state."""
    found: dict[str, Any] = {}
    for handle, name, value in panel.updates(Frame(desk.state)):
        setattr(handle, name, value)
        if isinstance(handle, kind):
            found[handle.label] = handle
    return found


@given(
    st.integers(-(10**6), 10**6).map(lambda count: Decimal(count) / 1000),
    st.sampled_from(["10", "1", "25.4", "1e-6", "1e6"]),
)
def test_length_typed_in_mm_is_the_state_of_its_value_in_design_units(
    value: Decimal, unit_mm: str
) -> None:
    design = msgspec.structs.replace(OPTIMAL, unit_mm=float(unit_mm))
    in_mm = open_state(design)
    in_units = Set("view.lengths", "design units").apply(in_mm)
    bound = in_unit(item(lambda frame: frame.state.position, 0, set_position), 1)
    typed = float(value * Decimal(unit_mm))
    action, same = bound.write(in_mm, typed), bound.write(in_units, float(value))
    assert action is not None
    assert same is not None
    after = action.apply(in_mm)
    assert after.pose == same.apply(in_units).pose
    assert bound.read(Frame(after)) == typed
    # Neither the switch nor a value that is typed as it stands changes a bit.
    assert replace(in_units, view=in_mm.view) == in_mm
    joint = in_unit(item(lambda frame: frame.state.joints, 0, set_joint), 1)
    again = joint.write(in_mm, joint.read(Frame(in_mm)))
    assert again == set_joint(0, in_mm.joints[0])


@given(st.floats(-1e3, 0.0), st.floats(1e-2, 1e3), st.floats(1e-6, 1e6))
def test_range_in_mm_holds_that_in_design_units_in_whole_steps(
    low: float, width: float, unit_mm: float
) -> None:
    step = 10.0 ** (math.floor(math.log10(width)) - 3)
    span, unit = round_span(low, low + width, step), Unit("mm", unit_mm)
    shown = in_whole_steps(span, unit)
    room = 0.2 * shown.step
    assert shown.low - room <= span.low * unit_mm
    assert span.high * unit_mm <= shown.high + room
    assert shown.high - shown.low <= span.high * unit_mm - span.low * unit_mm + 22.0 * shown.step
    assert 0.099 * span.step * unit_mm <= shown.step <= 1.001 * span.step * unit_mm


def test_track_only_grows_while_its_own_slider_moves(services: Services, desk: Desk) -> None:
    panel = MovePanel(services)
    slider = handles(panel, desk, viser.GuiSliderHandle)["x"]
    usual = (slider.min, slider.max)
    for value in (60.0, 40.0, 10.0, 12.0):
        desk.use(slider, value)
        handles(panel, desk, viser.GuiSliderHandle)
        assert (slider.min, slider.max) == (usual[0], 60.0)
    desk.session.do(set_position(0, 11.0))
    handles(panel, desk, viser.GuiSliderHandle)
    assert (slider.min, slider.max) == usual


def test_leg_that_is_typed_beyond_its_track_is_on_it(services: Services, desk: Desk) -> None:
    panel = MovePanel(services)
    desk.session.do(Set("view.coordinates", "lengths"))
    sliders = [
        each for each in handles(panel, desk, viser.GuiSliderHandle).values() if each.visible
    ]
    for joint, value in enumerate((40.0, -30.0, 45.0, 60.0, 50.0, 41.0)):
        desk.session.do(set_joint(joint, value))
        handles(panel, desk, viser.GuiSliderHandle)
        assert sliders[joint].value == value
        assert all(slider.min <= slider.value <= slider.max for slider in sliders)


@pytest.mark.parametrize(
    ("value", "shown"),
    [(5.0 + 1e-15, 5.0), (-7.5e-16, 0.0), (math.nextafter(4.25, 0.0), 4.25), (1 / 3, 1 / 3)],
)
def test_field_shows_no_rounding_error(
    services: Services, desk: Desk, value: float, shown: float
) -> None:
    panel = MovePanel(services)
    desk.session.do(set_position(0, value))
    assert repr(handles(panel, desk, viser.GuiSliderHandle)["x"].value) == repr(shown)


def test_inputs_of_a_range_set_it_and_show_it(services: Services, desk: Desk) -> None:
    panel = DesignPanel(services)
    thumbs = handles(panel, desk, viser.GuiMultiSliderHandle)
    fields = handles(panel, desk, viser.GuiVector2Handle)
    assert [f"{name} ends" for name in thumbs] == list(fields)
    assert thumbs["l1"].value == (0.0, OPTIMAL.reach)
    desk.use(thumbs["l1"], (2.0, OPTIMAL.reach))
    # The maximum is the reach still, whatever the reach will be.
    assert desk.state.design.limits.l1 == (2.0, None)
    handles(panel, desk, viser.GuiVector2Handle)
    assert fields["l1 ends"].value == (2.0, OPTIMAL.reach)
    desk.use(fields["l1 ends"], (2.0, 9.0))
    assert desk.state.design.limits.l1 == (2.0, 9.0)
    handles(panel, desk, viser.GuiVector2Handle)
    assert thumbs["l1"].value == (2.0, 9.0)
    desk.use(fields["b4 y ends"], (30.0, 22.0))
    assert desk.state.design.limits.box == ((0.0, 30.0, 0.0), (20.0, 30.0, 18.0))
    assert desk.complaints == []


def test_limit_that_is_switched_on_excludes_nothing_at_first(
    services: Services, desk: Desk
) -> None:
    desk.session.do(Set("design.limits.box", None))
    panel = DesignPanel(services)
    boxes = handles(panel, desk, viser.GuiCheckboxHandle)
    desk.use(boxes["Box for b4"], True)
    desk.use(boxes["Bounded guide"], True)
    limits = desk.state.design.limits
    free = Set("design.limits.box", None).apply(Set("design.limits.guide", None).apply(desk.state))
    assert limits.box is not None
    assert limits.guide is not None
    for axis in range(3):
        span = position_span(free, axis)
        room = 0.1 * (span.high - span.low)
        assert limits.box[0][axis] <= span.low + room
        assert limits.box[1][axis] >= span.high - room
    assert limits.guide[0] < 0.0
    assert limits.guide[1] > 20.0


# What no text for people holds: names with an underscore or a point within, and JSON's.
CODE = re.compile(r"[a-z]_[a-z]|[a-z]\.[a-z]|\bnull\b|\bNone\b")
BAD = (-1.0, 0.0, 181.0, 1e9, 1e45)


def test_refusals_of_the_page_hold_no_names_of_the_code(desk: Desk, services: Services) -> None:
    for panel in (DesignPanel, MovePanel, MachinePanel):
        panel(services)
    handles = [each.handle for each in widgets(services.server)]
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
                desk.session.do(UNDO)
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
