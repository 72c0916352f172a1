"""Two to four designs side by side: the laws of pinning, the numbers shown, what is drawn."""

from __future__ import annotations

import re
import time
from dataclasses import fields, replace
from html import unescape
from pathlib import Path
from typing import Any

import msgspec
import numpy as np
import pytest
import viser
from desk import Desk, number
from hypothesis import given, strategies as st
from services import StubWorker, services_for

from explorer.app.features.compare.actions import Pin, Unpin
from explorer.app.features.compare.bars import DRAWN, LOADS, bars
from explorer.app.features.compare.columns import Column, best_of, columns_of, notes, value_text
from explorer.app.features.compare.drawing import ComparedRequest, compared_drawing
from explorer.app.features.compare.feed import LIVE, CompareFeed
from explorer.app.features.compare.panel import MOST_BUTTONS, ComparePanel
from explorer.app.features.compare.scene import APART, ComparedScene
from explorer.app.features.compare.table import table
from explorer.app.features.designs.saved_designs import SavedDesigns
from explorer.app.features.feature import Services
from explorer.app.scene.placing import Placed
from explorer.app.session.jobs import Worker
from explorer.app.session.session import UNDO
from explorer.app.state.actions import Open, Set, SetVariable
from explorer.app.state.compared import SLOTS, Compared, Look, unnamed
from explorer.app.state.frame import Frame
from explorer.app.state.state import State, opened
from explorer.app.storage.library import Library
from explorer.app.storage.session_file import SessionFile
from explorer.app.storage.user_data import UserData
from explorer.app.widgets.assigning import Assigner
from explorer.app.widgets.buttons import Buttons
from explorer.app.widgets.colours import COMPARED
from explorer.app.widgets.commands import NO_OPTION
from explorer.errors import InputError
from explorer.measures.case import Case
from explorer.measures.catalogue import CATALOGUE, measures_in
from explorer.measures.measurements import Measurements, measure_design
from explorer.mechanism.design import JOINTS, Design
from explorer.mechanism.design_file import PRESETS
from explorer.mechanism.home import home_pose
from explorer.mechanism.machine import Actuators, Guide, Payload
from explorer.mechanism.pose import Pose
from explorer.statics.loaded import LoadedPose
from explorer.workspace.slices.volume import workspace_nodes, workspace_volume

INITIAL, OPTIMAL = PRESETS.values()
LISTED = measures_in("compare")


def variant(number: int, **changes: object) -> Design:
    return msgspec.structs.replace(
        OPTIMAL, name=f"variant {number}", b2=2.0 + 0.1 * number, **changes
    )


def measured(design: Design) -> Measurements:
    return measure_design(Case(design), LISTED)


def compared(*pinned: Design, look: Look | None = None, live: Design = OPTIMAL) -> State:
    state = opened(live)
    for design in pinned:
        state = Pin(design).apply(state)
    return Set("compared.look", look or Look()).apply(state)


def columns(state: State) -> tuple[Column, ...]:
    """Return the columns of a state, all of them found here and now."""
    unit = 1.0 if state.compared.look.millimetres else state.design.unit_mm
    return tuple(
        Column(number, design, measured(design), design.unit_mm / unit)
        for number, design in enumerate((state.design, *state.compared.pinned))
        if design is not None
    )


def cells(html: str) -> dict[str, list[str]]:
    """Return the cells of a table by the first words of its rows, changes left out."""
    found: dict[str, list[str]] = {}
    for row in re.findall(r"<tr.*?</tr>", html)[1:]:
        first, *rest = (
            unescape(re.sub("<.*?>", "", cell)) for cell in re.findall(r"<td.*?</td>", row)
        )
        # Behind each value but that of the live design stands its difference to that.
        found[first] = [rest[0], *rest[1::2]]
    return found


@given(st.lists(st.tuples(st.sampled_from(["pin", "unpin", "live"]), st.integers(0, 4))))
def test_three_are_pinned_at_most_and_none_twice_whatever_is_done(
    what: list[tuple[str, int]],
) -> None:
    state = opened(OPTIMAL)
    for kind, index in what:
        before = state
        try:
            if kind == "pin":
                state = Pin(variant(index)).apply(state)
            elif kind == "unpin":
                state = Unpin(index % 3).apply(state)
            else:
                state = Open(variant(index)).apply(state)
        except InputError:
            pinned = before.compared.pinned
            assert kind == "pin"
            assert variant(index) in pinned or None not in pinned
        kept = [each for each in state.compared.pinned if each is not None]
        assert len(state.compared.pinned) == 3
        assert len({unnamed(each) for each in kept}) == len(kept)
        if kind == "live":
            assert state.design == variant(index)
            assert state.compared == before.compared
        else:
            assert replace(state, compared=before.compared) == before


def test_a_design_keeps_its_place_and_its_colour_when_another_goes() -> None:
    state = compared(variant(1), variant(2), variant(3))
    state = Unpin(0).apply(state)
    assert state.compared.pinned == (None, variant(2), variant(3))
    assert Pin(variant(4)).apply(state).compared.pinned[0] == variant(4)
    assert Unpin(0).apply(state) == state


def test_what_cannot_be_pinned_is_told_in_one_line() -> None:
    state = compared(variant(1), variant(2), variant(3))
    with pytest.raises(InputError, match=r"^variant 4 cannot be pinned: A, B, C are taken; unpin"):
        Pin(variant(4)).apply(state)
    renamed = msgspec.structs.replace(variant(2), name="other")
    with pytest.raises(InputError, match=r"^other is pinned already, as B; change it, or pin"):
        Pin(renamed).apply(state)


def test_pins_are_steps_that_are_undone(desk: Desk) -> None:
    for action in (Pin(INITIAL), Set("compared.look.overlay", True), Unpin(0)):
        desk.session.do(action)
    assert desk.state.compared == Compared(look=Look(overlay=True))
    words = [step.words for step in desk.session.history.steps[1:]]
    assert words == ["Pin paper-initial", "Overlay on", "Unpin A"]
    for expected in (Look(overlay=True), Look()):
        desk.session.travel(UNDO)
        assert desk.state.compared == Compared((INITIAL, None, None), expected)
    assert desk.state.compared.slot_of(INITIAL) == 0
    assert desk.state.compared.slot_of(OPTIMAL) is None
    desk.session.travel(UNDO)
    assert desk.state.compared.is_empty


@pytest.mark.parametrize("millimetres", [False, True])
def test_the_table_tells_what_the_functions_tell(millimetres: bool) -> None:
    small = msgspec.structs.replace(INITIAL, unit_mm=12.0)
    state = compared(small, variant(3), look=Look(millimetres=millimetres))
    rows = cells(table(columns(state), millimetres=millimetres))
    # None of these designs has a load, limits of forces, or errors.
    assert len(rows) == sum(not measure.needs for measure in LISTED.values())
    unit = "mm" if millimetres else "units"
    for place, design in enumerate((OPTIMAL, small, variant(3))):
        factor = design.unit_mm if millimetres else design.unit_mm / OPTIMAL.unit_mm
        nodes = workspace_nodes(design)
        expected = {
            f"volume {unit}³": workspace_volume(design).volume * factor**3,
            "nodes": nodes.count,
            f"node volume {unit}³": nodes.volume * factor**3,
            f"reach {unit}": design.reach * factor,
            f"b2 {unit}": design.b2 * factor,
            f"clearance {unit}": (measured(design)["least_clearance"] or 0.0) * factor,
        }
        for name, value in expected.items():
            assert number(rows[name][place]) == pytest.approx(value, rel=1e-3, abs=1e-4)


def test_what_is_small_beside_the_others_is_not_told_as_nothing() -> None:
    volume = CATALOGUE["volume"]
    assert value_text(volume, 0.000999998, 8000.0) == "0.001"
    assert value_text(volume, -8.574e-9, 8000.0) == "−8.57 × 10⁻⁹"
    assert value_text(volume, 0.0, 8000.0) == "0"
    assert value_text(volume, 7992.0, 8000.0) == "7,992.00"
    # A difference by rounding is none.
    assert value_text(CATALOGUE["exact_extent_x"], -7.1e-15, 20.0, signed=True) == "0"


def test_the_best_of_a_row_is_bold_and_only_where_better_means_something() -> None:
    html = table(columns(compared(INITIAL)), millimetres=False)
    rows = {re.sub("<.*?>", "", row.partition("</td>")[0]): row for row in html.split("<tr")[2:]}
    (volume,) = (
        row for name, row in rows.items() if name.endswith("volume units³") and "node" not in name
    )
    assert re.findall(r'is-best"[^>]*>([^<]*)', volume) == ["7,053.04"]
    (extent,) = (row for name, row in rows.items() if name.endswith("extent x units"))
    assert "is-best" not in extent


def test_what_is_as_good_is_not_the_best() -> None:
    volume, reach, nodes = (CATALOGUE[name] for name in ("volume", "reach", "node_count"))
    assert best_of(volume, [1.0, 2.0, None, 2.0]) == {1, 3}
    assert best_of(reach, [1.0, 2.0]) == {0}
    assert best_of(volume, [2.0, 2.0 * (1.0 + 1e-12)]) == set()
    assert best_of(volume, [2.0, None]) == set()
    assert best_of(nodes, [1.0, 2.0]) == set()


def test_names_are_text_whatever_they_hold() -> None:
    state = compared(msgspec.structs.replace(INITIAL, name="<b onclick=x>&"))
    found = columns(state)
    for html in (table(found, millimetres=False), "".join(notes(state, found))):
        assert "<b onclick" not in html


def test_an_empty_workspace_is_told_with_its_reasons() -> None:
    limits = msgspec.structs.replace(OPTIMAL.limits, l1=(1.0, 2.0), l4=(1.0, 2.0))
    state = compared(msgspec.structs.replace(OPTIMAL, name="none", limits=limits))
    found = columns(state)
    rows = cells(table(found, millimetres=False))
    assert rows["volume units³"][1] == "empty"
    assert rows["clearance units"][1] == "–"
    (note,) = notes(state, found)
    assert "A (none) has an empty workspace; emptied by: " in note
    assert "–" in bars(found, millimetres=False)


def test_other_units_are_told_and_the_same_manipulator_is_the_same() -> None:
    # In units of half the size everything has twice the number.
    double: dict[str, tuple[float, float]] = {
        "a3": (2.0 * OPTIMAL.a3[0], 2.0 * OPTIMAL.a3[1]),
        "b1": (2.0 * OPTIMAL.b1[0], 2.0 * OPTIMAL.b1[1]),
    }
    box = OPTIMAL.limits.box
    assert box is not None
    lows, highs = (tuple(2.0 * value for value in corner) for corner in box)
    home = home_pose(OPTIMAL)
    x, y, z = home.position
    other = msgspec.structs.replace(
        OPTIMAL,
        **double,
        name="half units",
        b2=2.0 * OPTIMAL.b2,
        b3=2.0 * OPTIMAL.b3,
        unit_mm=0.5 * OPTIMAL.unit_mm,
        node_step=2.0 * (OPTIMAL.node_step or 1.0),
        limits=msgspec.structs.replace(OPTIMAL.limits, box=(lows, highs)),
        home=Pose((2.0 * x, 2.0 * y, 2.0 * z), home.quaternion),
    )
    state = compared(other)
    found = columns(state)
    for measure in LISTED.values():
        live, same = (column.value(measure) for column in found)
        if measure.needs and live is None:
            assert same is None
            continue
        assert same == pytest.approx(live, rel=1e-6, abs=1e-9), measure.name
    (note,) = notes(state, found)
    assert "One unit of the live design is 10 mm; A has 5 mm. Lengths are in units" in note


def test_bars_are_as_long_as_their_values() -> None:
    found = columns(compared(INITIAL, variant(2)))
    html = bars(found, millimetres=False)
    widths = [float(width) for width in re.findall(r'<rect[^>]* width="([\d.]+)"', html)]
    assert len(widths) == len(DRAWN) * len(found)
    per_drawing = np.array(widths).reshape(len(DRAWN), len(found))
    for name, drawn in zip(DRAWN, per_drawing, strict=True):
        values = np.array([column.value(CATALOGUE[name]) for column in found], dtype=np.float64)
        if values.max() > 0.0:
            expected = np.maximum(drawn.max() * values / values.max(), 0.8)
            assert drawn == pytest.approx(expected, abs=0.02), name


LIGHT = msgspec.structs.replace(
    OPTIMAL,
    name="light",
    payload=Payload(0.5, (1.0, 0.0, 1.0)),
    actuators=Actuators(
        push_n=(150.0, 200.0, 150.0, 200.0, 150.0, 150.0),
        error_mm=(0.05, 0.05, 0.05, 0.05, 0.05, 0.05),
    ),
    guide=Guide(force_n=200.0, moment_nm=6.0),
)
HEAVY = msgspec.structs.replace(LIGHT, name="heavy", payload=Payload(2.0, force_n=10.0))


def test_table_of_a_singular_home_shows_infinite_loads_and_errors() -> None:
    home = Pose((10.0, 5.0, 0.0), home_pose(OPTIMAL).quaternion)
    found = columns(compared(msgspec.structs.replace(HEAVY, home=home), live=LIGHT))
    rows = cells(table(found, millimetres=True))
    for name in ("load share at home %", "worst error at home mm", "worst turn at home °"):
        assert number(rows[name][0]) > 0.0
        assert rows[name][1] == "infinite"
    assert rows["worst actuator at home"][1] == "–"
    assert number(rows["largest payload at home kg"][1]) == 0.0


def test_the_table_compares_loads_of_the_designs_that_have_them() -> None:
    found = columns(compared(HEAVY, INITIAL, live=LIGHT))
    html = table(found, millimetres=True)
    assert "nan" not in html
    assert "inf" not in re.sub("<.*?>", "", html)
    rows = cells(html)
    for design, place in ((LIGHT, 0), (HEAVY, 1)):
        pose = LoadedPose(design, home_pose(design))
        share, part = pose.share, JOINTS[int(pose.shares[:6].argmax())]
        assert number(rows["load share at home %"][place]) == pytest.approx(100.0 * share, abs=0.01)
        assert rows["worst actuator at home"][place] == part
        payload = number(rows["largest payload at home kg"][place])
        assert payload == pytest.approx(pose.largest_payload, abs=1e-3)
        moments = pose.held.bending + pose.held.spread[6:8]
        bending = number(rows["largest bending at home N m"][place])
        assert bending == pytest.approx(1e-3 * design.unit_mm * moments.max(), abs=1e-3)
    assert {"worst error at home mm", "held volume mm³"} <= {*rows}
    # A design without a machine has none of them, and two without one have no such rows.
    assert rows["load share at home %"][2] == rows["held volume mm³"][2] == "–"
    plain = cells(table(columns(compared(INITIAL)), millimetres=True))
    assert not any("load" in name or "payload" in name for name in plain)


def test_bars_have_a_row_of_loads_if_a_design_has_them() -> None:
    html = bars(columns(compared(HEAVY, live=LIGHT)), millimetres=False)
    widths = re.findall(r'<rect[^>]* width="([\d.]+)"', html)
    assert len(widths) == 2 * (len(DRAWN) + len(LOADS))
    assert "nan" not in html
    for words in (">load share<", ">largest payload<", ">largest bending<", ">held volume<"):
        assert words in html
    assert ">load share<" not in bars(columns(compared(INITIAL)), millimetres=False)


def test_a_drawing_has_the_workspace_at_the_home_of_the_design_and_its_points() -> None:
    drawing = compared_drawing(ComparedRequest(INITIAL, drawn=True))
    assert drawing.problem is None
    assert drawing.shell is not None
    assert drawing.measurements is not None
    spans = np.ptp(drawing.shell.vertices, axis=0)
    assert spans == pytest.approx(
        np.array([drawing.measurements[f"exact_extent_{axis}"] for axis in "xyz"]),
        abs=0.01 * INITIAL.reach,
    )
    ends = drawing.outline.reshape(-1, 3)
    for point in ((0.0, 0.0, 0.0), (*INITIAL.a3, 0.0), home_pose(INITIAL).position):
        assert np.abs(ends - np.array(point)).max(axis=1).min() < 1e-9
    assert compared_drawing(ComparedRequest(INITIAL)).shell is None


def test_a_tolerance_that_is_too_fine_is_told_and_the_figures_stay() -> None:
    drawing = compared_drawing(ComparedRequest(OPTIMAL, drawn=True, tolerance=1e-9))
    assert drawing.measurements is not None
    assert drawing.shell is None
    assert "tolerance" in (drawing.problem or "")


@pytest.fixture
def feed(services: Services) -> CompareFeed:
    return services.get(CompareFeed)


def test_a_slider_asks_for_the_live_design_alone_and_nothing_without_pins(
    feed: CompareFeed, worker: StubWorker
) -> None:
    feed.follow(Frame(opened(OPTIMAL)))
    assert worker.orders == []
    state = compared(INITIAL, variant(2), look=Look(overlay=True))
    feed.follow(Frame(state))
    assert [order.request.design for order in worker.orders] == [
        unnamed(each) for each in (OPTIMAL, INITIAL, variant(2))
    ]
    assert len({order.key for order in worker.orders}) == 3
    worker.work()
    assert feed.is_settled
    feed.follow(Frame(SetVariable("b2", 2.3).apply(state)))
    (order,) = worker.orders[3:]
    assert order.request.design == unnamed(OPTIMAL.with_variable("b2", 2.3))
    # Until it comes the last one is shown, and said to be old.
    assert feed.drawing(LIVE) is not None
    assert not feed.is_current(LIVE)
    assert feed.is_current(1)


def test_a_place_never_shows_the_design_that_was_there_before(
    feed: CompareFeed, worker: StubWorker
) -> None:
    state = compared(INITIAL)
    feed.follow(Frame(state))
    worker.work()
    assert feed.drawing(1) is not None
    feed.follow(Frame(Pin(variant(2)).apply(Unpin(0).apply(state))))
    assert feed.drawing(1) is None
    worker.work()
    found = feed.drawing(1)
    assert found is not None
    assert found.request.design == unnamed(variant(2))


def test_workspaces_are_drawn_to_true_size_in_their_colours(
    services: Services, feed: CompareFeed, worker: StubWorker
) -> None:
    large = msgspec.structs.replace(INITIAL, unit_mm=25.0)
    state = compared(large, look=Look(overlay=True, outlines=True))
    feed.follow(Frame(state))
    scene = ComparedScene(services)
    assigner = Assigner(services.server)
    worker.work()
    feed.follow(Frame(state))
    placed = Placed(Frame(state))
    updates = scene.updates(placed)
    assigner.assign(updates)
    shown = {
        handle.name: handle
        for handle, name, value in scene.updates(placed)
        if name == "visible" and value
    }
    assert {"/compared/live/workspace", "/compared/A/workspace", "/compared/A/outline"} <= {*shown}
    assert "/compared/live/outline" not in shown
    drawing = feed.drawing(1)
    assert drawing is not None
    assert drawing.shell is not None
    mesh = shown["/compared/A/workspace"]
    assert isinstance(mesh, viser.MeshHandle)
    assert tuple(np.asarray(mesh.color).tolist()) == COMPARED[1]
    expected = drawing.shell.vertices * placed.scale * 2.5
    # No face lies in the plane of another workspace's, be the designs ever so alike.
    close = 0.5 * APART * np.ptp(expected, axis=0).max()
    off = np.abs(np.asarray(mesh.vertices) - expected).max()
    assert 0.5 * close < off <= 1.001 * close
    hidden = Frame(compared(large, look=Look()))
    feed.follow(hidden)
    assigner.assign(scene.updates(Placed(hidden)))
    assert not mesh.visible


def test_panel_pins_opens_unpins_and_switches(
    server: viser.ViserServer, desk: Desk, buttons: Buttons, tmp_path: Path
) -> None:
    user_data = UserData(Library(tmp_path / "designs"), SessionFile())
    user_data.library.save("variant 7", variant(7))
    services = services_for(server, desk.session, buttons=buttons, user_data=user_data)
    assert services.get(SavedDesigns).wait_until_idle()
    panel = ComparePanel(services)
    own = desk.state.design
    desk.press(buttons, "compare.pin")
    assert desk.state.compared.pinned == (own, None, None)
    options = (NO_OPTION, "variant 7", *PRESETS)
    given = {
        name: value
        for handle, name, value in panel.updates(Frame(desk.state))
        if handle is panel.another
    }
    # Few designs have a button each, and need no list.
    assert (given["options"], given["visible"]) == (options, False)
    panel.another.options = options
    desk.use(panel.another, "variant 7")
    assert desk.state.compared.pinned == (own, variant(7), None)
    desk.press(buttons, "compare.open", "B")
    assert desk.state.design == variant(7)
    assert desk.state.compared.pinned == (own, variant(7), None)
    desk.press(buttons, "compare.pin")
    desk.press(buttons, "compare.open", "C")
    assert desk.state.design == variant(7)
    assert [line.partition(";")[0] for line in desk.complaints] == [
        "variant 7 is pinned already, as B",
        "nothing is pinned as C",
    ]
    desk.press(buttons, "compare.turn", "Overlay workspaces")
    desk.press(buttons, "compare.turn", "Bars")
    assert desk.state.compared.look == Look(shows="bars", overlay=True)
    desk.press(buttons, "compare.unpin", "A")
    assert desk.state.compared.pinned == (None, variant(7), None)


def content_of(panel: ComparePanel, state: State) -> str:
    contents: list[Any] = [
        value for handle, _, value in panel.updates(Frame(state)) if handle is panel.html
    ]
    return contents[-1]


def test_each_design_is_pinned_by_one_press(services: Services, desk: Desk) -> None:
    panel = ComparePanel(services)
    words = content_of(panel, desk.state)
    assert "Pin this design, then change it" in words
    assert re.findall('data-press="compare.pin" data-value="([^"]*)"', words) == ["paper-initial"]
    desk.press(services.buttons, "compare.pin", "paper-initial")
    assert desk.state.compared.pinned == (INITIAL, None, None)
    # Nor is a design offered that is there already, under whatever name.
    desk.session.do(Open(msgspec.structs.replace(OPTIMAL, name="other")))
    assert 'data-value="paper' not in content_of(panel, desk.state)
    desk.press(services.buttons, "compare.pin", "nothing of this name")
    assert desk.state.compared.pinned == (INITIAL, None, None)
    assert desk.complaints == []


def test_many_designs_are_pinned_from_a_list(
    server: viser.ViserServer, desk: Desk, buttons: Buttons, tmp_path: Path
) -> None:
    user_data = UserData(Library(tmp_path / "designs"), SessionFile())
    for index in range(MOST_BUTTONS):
        user_data.library.save(f"variant {index}", variant(index))
    services = services_for(server, desk.session, buttons=buttons, user_data=user_data)
    assert services.get(SavedDesigns).wait_until_idle()
    panel = ComparePanel(services)
    updates = [*panel.updates(Frame(desk.state))]
    assert (panel.another, "visible", True) in updates
    assert "variant" not in content_of(panel, desk.state)


def test_progress_counts_the_designs_that_are_measured(
    services: Services, feed: CompareFeed, worker: StubWorker
) -> None:
    state = compared(INITIAL, variant(2))
    feed.follow(Frame(state))
    panel = ComparePanel(services)
    assert "measured: 0 of 3" in content_of(panel, state)
    worker.work()
    assert "measured:" not in content_of(panel, state)
    changed = SetVariable("b2", 2.3).apply(state)
    feed.follow(Frame(changed))
    assert "measured: 2 of 3" in content_of(panel, changed)


def test_the_worker_finds_the_columns() -> None:
    state = compared(INITIAL)
    worker = Worker(lambda _: None)
    feed = CompareFeed(services_for(worker=worker))
    try:
        feed.follow(Frame(state))
        assert worker.wait_until_idle(120.0)
        deadline = time.monotonic() + 10.0
        while not feed.is_settled and time.monotonic() < deadline:
            time.sleep(0.01)
    finally:
        worker.stop()
    live, pinned = columns_of(state, feed)
    # Compiled or not, the last bit may differ.
    for column, design in ((live, OPTIMAL), (pinned, INITIAL)):
        assert column.measured is not None
        expected = measured(unnamed(design))
        for each in fields(expected):
            found, known = (getattr(f, each.name) for f in (column.measured, expected))
            assert found == known or found == pytest.approx(known, rel=1e-9), each.name
    assert [each.letter for each in (live, pinned)] == ["live", SLOTS[0]]
