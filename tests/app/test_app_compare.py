"""Two to four designs side by side: the laws of pinning, the numbers shown, what is drawn."""

from __future__ import annotations

import re
from functools import cache
from html import unescape
from pathlib import Path

import msgspec
import numpy as np
import pytest
import viser
from desk import Desk, number
from hypothesis import given, strategies as st
from limited_designs import scaled_design
from services import StubJobs, services_for

from explorer.app.features.compare.feature import COMPARE, ComparePanel, pin, unpin
from explorer.app.features.compare.scene import APART, SCENES
from explorer.app.features.compare.table import (
    ComparedDesign,
    best_of,
    columns_of,
    notes,
    table,
    value_text,
)
from explorer.app.features.compare.work import (
    FEEDS,
    LIVE,
    Compared,
    ComparedRequest,
    CompareFeed,
    CompareView,
    design_in,
    draw_compared,
    drawing_in,
)
from explorer.app.features.designs.feature import SavedDesigns
from explorer.app.features.feature import Services
from explorer.app.scene.placing import Placed
from explorer.app.scene.shapes import COMPARED
from explorer.app.session.history import History, HistoryStep
from explorer.app.state.actions import Set, open_design
from explorer.app.state.frame import Frame
from explorer.app.state.geometry import set_variable, without_name
from explorer.app.state.parts import with_value
from explorer.app.state.state import State, open_state
from explorer.app.storage.library import Library
from explorer.app.storage.session_file import SessionFile, decode_session, encode_session
from explorer.app.storage.user_data import UserData
from explorer.app.widgets.buttons import Buttons
from explorer.errors import InputError
from explorer.measures.catalogue import CATALOGUE, Measurements, measure_design, measures_in
from explorer.measures.measure import Case
from explorer.mechanism.design import JOINTS, Design
from explorer.mechanism.design_file import PRESETS
from explorer.mechanism.machine import Actuators, Guide, Payload
from explorer.mechanism.pose import Pose
from explorer.numerics.number_text import Unit
from explorer.page.widgets.assigning import Assigner
from explorer.six_legged.case import TableCase
from explorer.six_legged.files import TABLES, made_equal
from explorer.statics.loaded import LoadedPose
from explorer.workspace.slices.volume import node_count_of, workspace_volume
from explorer.workspace.workspace import Workspace

INITIAL, OPTIMAL = PRESETS["paper-initial"], PRESETS["paper-optimal"]
LISTED = measures_in("compare")


def variant(number: int, **changes: object) -> Design:
    return msgspec.structs.replace(
        OPTIMAL, name=f"variant {number}", b2=2.0 + 0.1 * number, **changes
    )


@cache
def measured(design: Design) -> Measurements:
    return measure_design(Case(design), LISTED)


def compared(*pinned: Design, look: CompareView | None = None, live: Design = OPTIMAL) -> State:
    state = open_state(live)
    for design in pinned:
        state = pin(design).apply(state)
    return Set("compared.look", look or CompareView()).apply(state)


def columns(
    *pinned: Design, live: Design = OPTIMAL, millimetres: bool = False
) -> tuple[ComparedDesign, ...]:
    """Return the columns of designs, all measured."""
    name, unit = ("mm", 1.0) if millimetres else ("units", live.unit_mm)
    return tuple(
        ComparedDesign(number, design, measured(design), Unit(name, design.unit_mm / unit))
        for number, design in enumerate((live, *pinned))
    )


def cells(html: str) -> dict[str, list[str]]:
    """Return the cells of a table by the first words of its rows, changes left out."""
    found: dict[str, list[str]] = {}
    for row in re.findall(r"<tr.*?</tr>", html)[1:]:
        texts = [re.sub("<.*?>", "", cell) for cell in re.findall(r"<td.*?</td>", row)]
        # Behind each value but that of the live design stands its difference to that.
        first, live, *others = map(unescape, texts)
        found[first] = [live, *others[::2]]
    return found


@given(st.lists(st.tuples(st.sampled_from(["pin", "unpin", "live"]), st.integers(0, 4))))
def test_actions_in_any_order_pin_at_most_three_designs_and_none_twice(
    actions: list[tuple[str, int]],
) -> None:
    state = open_state(OPTIMAL)
    for kind, index in actions:
        before, pinned = state, Compared.of(state).pinned
        if kind == "live":
            state = open_design(variant(index)).apply(state)
            assert Compared.of(state) == Compared.of(before)
            continue
        if kind == "unpin":
            state = unpin(index % 3).apply(state)
            # The others keep their places, and with them their colours.
            assert Compared.of(state).pinned == (
                *pinned[: index % 3],
                None,
                *pinned[index % 3 + 1 :],
            )
        elif variant(index) in pinned or None not in pinned:
            with pytest.raises(InputError, match=r"is pinned already, as|A, B, C are taken; unpin"):
                pin(variant(index)).apply(state)
        else:
            state = pin(variant(index)).apply(state)
            assert Compared.of(state).pinned[pinned.index(None)] == variant(index)
        assert len(Compared.of(state).pinned) == 3
        assert with_value(state, "compared", Compared.of(before)) == before
    renamed = msgspec.structs.replace(variant(2), name="other")
    with pytest.raises(InputError, match=r"^other is pinned already, as A; change it, or pin"):
        pin(renamed).apply(compared(variant(2)))


@pytest.mark.parametrize("millimetres", [False, True])
def test_table_shows_the_values_of_the_library(*, millimetres: bool) -> None:
    small = msgspec.structs.replace(INITIAL, unit_mm=12.0)
    html = table(columns(small, variant(3), millimetres=millimetres))
    rows = cells(html)
    # None of these designs has a load, limits of forces, or errors.
    assert len(rows) == sum(not measure.needs for measure in LISTED.values())
    unit, cubic = ("mm", "cm³") if millimetres else ("units", "units³")
    large = 1e-3 if millimetres else 1.0
    for place, design in enumerate((OPTIMAL, small, variant(3))):
        factor = design.unit_mm / (1.0 if millimetres else OPTIMAL.unit_mm)
        nodes = node_count_of(Workspace(design))
        expected = {
            f"volume {cubic}": large * workspace_volume(design).volume * factor**3,
            "nodes": nodes.count,
            f"node volume {cubic}": large * nodes.volume * factor**3,
            f"reach {unit}": design.reach * factor,
            f"b2 {unit}": design.b2 * factor,
            f"clearance {unit}": (measured(design)["least_clearance"] or 0.0) * factor,
        }
        for name, value in expected.items():
            assert number(rows[name][place]) == pytest.approx(value, rel=1e-3, abs=1e-4)


def test_value_that_is_small_beside_the_others_is_not_shown_as_zero() -> None:
    volume = CATALOGUE["volume"]
    values = [0.000999998, -8.574e-9, 0.0, 7992.0]
    texts = [value_text(volume, value, 8000.0) for value in values]
    assert texts == ["0.001", "−8.57 × 10⁻⁹", "0", "7,992.00"]
    # A difference by rounding is none.
    assert value_text(CATALOGUE["exact_extent_x"], -7.1e-15, 20.0, signed=True) == "0"


def test_best_value_is_better_than_another() -> None:
    volume, reach, nodes = (CATALOGUE[name] for name in ("volume", "reach", "node_count"))
    assert best_of(volume, [1.0, 2.0, None, 2.0]) == {1, 3}
    assert best_of(reach, [1.0, 2.0]) == {0}
    assert best_of(volume, [2.0, 2.0 * (1.0 + 1e-12)]) == set()
    assert best_of(volume, [2.0, None]) == set()
    assert best_of(nodes, [1.0, 2.0]) == set()
    html = table(columns(INITIAL))
    assert "7,053.04" in re.findall(r'is-best"[^>]*>([^<]*)', html)


def test_empty_workspace_of_a_name_with_markup_is_shown_with_its_reasons() -> None:
    limits = msgspec.structs.replace(OPTIMAL.limits, l1=(1.0, 2.0), l4=(1.0, 2.0))
    empty = msgspec.structs.replace(OPTIMAL, name="<b onclick=x>&", limits=limits)
    found = columns(empty)
    html = table(found)
    rows = cells(html)
    assert rows["volume units³"][1] == "empty"
    assert rows["clearance units"][1] == "–"
    (note,) = notes(compared(empty), found)
    assert "A (&lt;b onclick=x&gt;&amp;) has an empty workspace; emptied by: " in note
    assert "<b onclick" not in html + note


def test_same_manipulator_in_other_units_has_the_same_values_and_a_note() -> None:
    # In units of half the size everything has twice the number.
    double = scaled_design(OPTIMAL, 2.0)
    other = msgspec.structs.replace(double, name="half units", unit_mm=0.5 * OPTIMAL.unit_mm)
    found = columns(other)
    for measure in LISTED.values():
        live, same = (column.value(measure) for column in found)
        expected = None if live is None else pytest.approx(live, rel=1e-6, abs=1e-9)
        assert same == expected, measure.name
    state = compared(other)
    assert notes(state, found) == []
    (note,) = notes(Set("view.lengths", "design units").apply(state), found)
    assert "in units of the live design, of 10 mm" in note


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
    home = Pose((10.0, 5.0, 0.0), OPTIMAL.home_pose.quaternion)
    singular = msgspec.structs.replace(HEAVY, home=home)
    rows = cells(table(columns(singular, live=LIGHT, millimetres=True)))
    for name in ("load share at home %", "worst error at home mm", "worst turn at home °"):
        assert number(rows[name][0]) > 0.0
        assert rows[name][1] == "infinite"
    assert rows["worst actuator at home"][1] == "–"
    assert number(rows["largest payload at home kg"][1]) == 0.0


def test_table_compares_loads_of_the_designs_that_have_them() -> None:
    html = table(columns(HEAVY, INITIAL, live=LIGHT, millimetres=True))
    assert "nan" not in html
    assert "inf" not in re.sub("<.*?>", "", html)
    rows = cells(html)
    for design, place in ((LIGHT, 0), (HEAVY, 1)):
        pose = LoadedPose(design, design.home_pose)
        moments = pose.reactions.bending + pose.reactions.spread[6:8]
        for name, expected in (
            ("load share at home %", 100.0 * pose.share),
            ("largest payload at home kg", pose.largest_payload),
            ("largest bending at home N m", 1e-3 * design.unit_mm * moments.max()),
        ):
            assert number(rows[name][place]) == pytest.approx(expected, abs=0.01)
        assert rows["worst actuator at home"][place] == JOINTS[int(pose.shares[:6].argmax())]
    assert {"worst error at home mm", "held volume cm³"} <= {*rows}
    # A design without a machine has none of them.
    assert rows["load share at home %"][2] == rows["held volume cm³"][2] == "–"


def test_drawing_has_the_workspace_at_home_and_the_points_of_the_design() -> None:
    drawing = draw_compared(ComparedRequest(INITIAL, drawn=True))
    assert drawing.problem is None
    assert drawing.shell is not None
    assert drawing.measurements is not None
    spans = np.ptp(drawing.shell.vertices, axis=0)
    assert spans == pytest.approx(
        np.array([drawing.measurements[f"exact_extent_{axis}"] for axis in "xyz"]),
        abs=0.01 * INITIAL.reach,
    )
    ends = drawing.outline.reshape(-1, 3)
    for point in ((0.0, 0.0, 0.0), (*INITIAL.a3, 0.0), INITIAL.home_pose.position):
        assert np.abs(ends - np.array(point)).max(axis=1).min() < 1e-9
    assert draw_compared(ComparedRequest(INITIAL)).shell is None


def test_drawing_with_a_tolerance_that_is_too_fine_keeps_its_numbers() -> None:
    drawing = draw_compared(ComparedRequest(OPTIMAL, drawn=True, tolerance=1e-9))
    assert drawing.measurements is not None
    assert drawing.shell is None
    assert "tolerance" in (drawing.problem or "")


@pytest.fixture
def feeds(services: Services) -> list[CompareFeed]:
    return [services.get(feed) for feed in FEEDS]


def follow(feeds: list[CompareFeed], state: State) -> None:
    for feed in feeds:
        feed.follow(Frame(state))


def test_change_of_the_live_design_requests_its_drawing_alone(
    feeds: list[CompareFeed], jobs: StubJobs
) -> None:
    follow(feeds, open_state(OPTIMAL))
    assert jobs.orders == []
    state = compared(INITIAL, variant(2), look=CompareView(overlay=True))
    follow(feeds, state)
    designs = [without_name(each) for each in (OPTIMAL, INITIAL, variant(2))]
    assert [order.request.design for order in jobs.orders] == designs
    assert len({order.key for order in jobs.orders}) == 3
    jobs.work()
    assert all(feed.is_settled for feed in feeds)
    found = columns_of(state, feeds)
    assert [(each.letter, each.measured) for each in found] == [
        (letter, measured(design))
        for letter, design in zip(("live", "A", "B"), designs, strict=True)
    ]
    follow(feeds, set_variable("b2", 2.3).apply(state))
    (order,) = jobs.orders[3:]
    assert order.request.design == without_name(OPTIMAL.with_variable("b2", 2.3))
    # Until it comes the last one is shown, and said to be old.
    assert drawing_in(LIVE, feeds[LIVE]) is not None
    assert not feeds[LIVE].is_current
    assert feeds[1].is_current


def test_place_with_another_design_shows_nothing_of_the_one_before(
    feeds: list[CompareFeed], jobs: StubJobs
) -> None:
    state = compared(INITIAL)
    follow(feeds, state)
    jobs.work()
    assert drawing_in(1, feeds[1]) is not None
    follow(feeds, pin(variant(2)).apply(unpin(0).apply(state)))
    assert drawing_in(1, feeds[1]) is None
    jobs.work()
    assert drawing_in(1, feeds[1]) is not None


def test_workspaces_are_drawn_to_true_size_in_their_colours(
    services: Services, feeds: list[CompareFeed], jobs: StubJobs
) -> None:
    large = msgspec.structs.replace(INITIAL, unit_mm=25.0)
    state = compared(large, look=CompareView(overlay=True, outlines=True))
    follow(feeds, state)
    scenes = [services.get(part) for part in SCENES]
    assigner = Assigner(services.server)
    jobs.work()
    follow(feeds, state)
    placed = Placed(Frame(state))
    assigner.assign(update for scene in scenes for update in scene.updates(placed))
    shown = {
        handle.name: handle
        for scene in scenes
        for handle, name, value in scene.updates(placed)
        if name == "visible" and value
    }
    assert {"/compared/live/workspace", "/compared/A/workspace", "/compared/A/outline"} <= {*shown}
    assert "/compared/live/outline" not in shown
    drawing = drawing_in(1, feeds[1])
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
    hidden = Frame(compared(large, look=CompareView()))
    follow(feeds, hidden.state)
    assigner.assign(update for scene in scenes for update in scene.updates(Placed(hidden)))
    assert not mesh.visible


def test_panel_pins_opens_unpins_and_switches(
    server: viser.ViserServer, desk: Desk, buttons: Buttons, tmp_path: Path
) -> None:
    user_data = UserData(Library(tmp_path / "designs"), SessionFile())
    user_data.library.save("variant 7", variant(7))
    services = services_for(server, desk.session, buttons=buttons, user_data=user_data)
    assert services.get(SavedDesigns).wait_until_idle()
    ComparePanel(services)
    own = desk.state.design
    desk.press(buttons, "compare.pin")
    desk.press(buttons, "compare.pin", "variant 7")
    desk.press(buttons, "compare.open", "B")
    assert desk.state.design == variant(7)
    desk.press(buttons, "compare.pin")
    desk.press(buttons, "compare.open", "C")
    assert desk.state.design == variant(7)
    assert [line.partition(";")[0] for line in desk.complaints] == [
        "variant 7 is pinned already, as B",
        "nothing is pinned as C",
    ]
    assert Compared.of(desk.state).pinned == (own, variant(7), None)
    desk.press(buttons, "compare.turn", "Overlay workspaces")
    assert Compared.of(desk.state).look == CompareView(overlay=True)
    desk.press(buttons, "compare.unpin", "A")
    assert Compared.of(desk.state).pinned == (None, variant(7), None)


def content_of(panel: ComparePanel, state: State) -> str:
    updates = panel.updates(Frame(state))
    return [str(value) for handle, _, value in updates if handle is panel.html][-1]


def test_design_is_pinned_by_one_press(services: Services, desk: Desk) -> None:
    panel = ComparePanel(services)
    words = content_of(panel, desk.state)
    assert re.findall('data-press="compare.pin" data-value="([^"]*)"', words) == [
        "buildable",
        "paper-initial",
        *TABLES,
    ]
    for name in ("paper-initial", "nothing of this name"):
        desk.press(services.buttons, "compare.pin", name)
        assert Compared.of(desk.state).pinned == (INITIAL, None, None)
    # Nor is a design offered that is there already, under whatever name.
    desk.session.do(open_design(msgspec.structs.replace(OPTIMAL, name="other")))
    assert 'data-value="paper' not in content_of(panel, desk.state)
    assert desk.complaints == []


def test_tables_on_six_legs_stand_beside_designs(services: Services, desk: Desk) -> None:
    panel, jobs = ComparePanel(services), services.jobs
    assert isinstance(jobs, StubJobs)
    desk.press(services.buttons, "compare.pin", "octahedral")
    desk.press(services.buttons, "compare.pin", "paper-initial")
    desk.press(services.buttons, "compare.pin", "octahedral")
    table = TABLES["octahedral"]
    assert Compared.of(desk.state).places == (table, INITIAL, None)
    assert 'data-value="octahedral"' not in content_of(panel, desk.state)
    desk.press(services.buttons, "compare.open", "A")
    assert desk.state.design == OPTIMAL
    twice, unopened = desk.complaints
    assert "octahedral is pinned already, as A" in twice
    assert "nothing is pinned as A" in unopened
    desk.session.do(Set("view.lengths", "mm"))
    desk.press(services.buttons, "compare.turn", "Outlines")
    desk.press(services.buttons, "compare.turn", "Overlay workspaces")
    found = [services.get(feed) for feed in FEEDS]
    follow(found, desk.state)
    jobs.work()
    content = content_of(panel, desk.state)
    assert "Make octahedral the live design" not in content
    assert "The sign of det J is no assembly mode of a table" in content
    assert "D. Stewart" in content
    rows = cells(content)
    case = TableCase(table)
    # An upper bound, which is never the best.
    bound = rows["volume cm³"][1]
    assert bound.startswith("≤ ")
    assert number(bound[2:]) == pytest.approx(1e-3 * case.volume.volume, rel=1e-6)
    assert not re.search(r'is-best"[^>]*>≤', content)
    assert number(rows["largest force per newton at home"][1]) == pytest.approx(0.619, abs=1e-3)
    assert rows["clearance mm"][1] == rows["b2 mm"][1] == "–"
    placed, scene = Placed(Frame(desk.state)), services.get(SCENES[1])
    Assigner(services.server).assign(scene.updates(placed))
    shown = {handle.name for handle, name, on in scene.updates(placed) if name == "visible" and on}
    assert shown == {"/compared/A/outline"}
    lines = [value for _, name, value in scene.updates(placed) if name == "points"]
    millimetre = placed.scale / OPTIMAL.unit_mm
    assert np.asarray(lines[0])[0, 0] == pytest.approx(millimetre * np.array(table.base_mm[0]))
    # Session files hold tables as they hold designs.
    history = History((HistoryStep(0, "", desk.state),), 0)
    assert decode_session(encode_session(history), "it").steps[0].state == desk.state


def test_pinned_tables_are_made_equal_to_the_live_design(services: Services, desk: Desk) -> None:
    panel = ComparePanel(services)
    desk.press(services.buttons, "compare.pin", "two circles")
    # The measures that only the live design has are left out.
    assert "clearance" not in content_of(panel, desk.state)
    table = TABLES["two circles"]
    assert design_in(1, desk.state) is table
    desk.press(services.buttons, "compare.turn", "Equal strokes and cones")
    assert design_in(1, desk.state) == made_equal(table, OPTIMAL)
    words = "made equal to {}: strokes of {:.4g} mm about home's lengths, no cones"
    content = unescape(content_of(panel, desk.state))
    assert content.count(words.format("paper-optimal", 10.0 * OPTIMAL.reach)) == 1
    # It follows the live design, and the table stays pinned as it is.
    desk.session.do(open_design(INITIAL))
    assert design_in(1, desk.state) == made_equal(table, INITIAL)
    content = unescape(content_of(panel, desk.state))
    assert content.count(words.format("paper-initial", 10.0 * INITIAL.reach)) == 1
    desk.press(services.buttons, "compare.pin", "two circles")
    assert Compared.of(desk.state).tables == (table, None, None)
    desk.press(services.buttons, "compare.turn", "Equal strokes and cones")
    assert design_in(1, desk.state) is table
    desk.press(services.buttons, "compare.unpin", "A")
    assert Compared.of(desk.state).is_empty


def test_table_that_is_dropped_is_pinned(
    server: viser.ViserServer, desk: Desk, buttons: Buttons, tmp_path: Path
) -> None:
    user_data = UserData(Library(tmp_path / "designs"), SessionFile())
    page = services_for(
        server,
        desk.session,
        buttons=buttons,
        complain=desk.complain,
        user_data=user_data,
        declared=(COMPARE,),
    )
    saved = page.get(SavedDesigns)
    for data, name in (
        (msgspec.json.encode(TABLES["Dietmaier"]), "dietmaier.json"),
        (b"setp genhexkins.base.0.x -30\n", "machine.hal"),
        (b"loadrt trivkins\n", "other.HAL"),
    ):
        saved.take(data, name)
        assert saved.wait_until_idle()
    tables = Compared.of(desk.state).tables
    assert [table and table.name for table in tables] == ["Dietmaier", "genhexkins", None]
    (complaint,) = desk.complaints
    assert complaint.startswith("other.HAL: the file holds no table on six legs")
