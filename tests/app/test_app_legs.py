"""The legs on the page: clearances, capsules, radii and the swept tetrahedra, without a browser."""

from __future__ import annotations

import re
from typing import Any

import numpy as np
import pytest
import viser
from desk import Desk, by_name, number, rows_of, thick, viewed

from explorer.app.features.feature import Services
from explorer.app.features.legs.clearance import ClearanceScene
from explorer.app.features.legs.panel import DIGITS, LegsPanel, clearance_table, move_table
from explorer.app.features.legs.swept import SweptTetrahedra
from explorer.app.features.mechanism.design_panel import DesignPanel
from explorer.app.features.mechanism.legs import Legs
from explorer.app.inputs.ranges import radius_span
from explorer.app.scene.placing import Placed
from explorer.app.session.gestures import UserAction
from explorer.app.state.actions import SetPose, SetPosition
from explorer.app.state.frame import Frame
from explorer.app.state.state import State, opened
from explorer.app.widgets.colours import OUTLINE, SWEPT, TUBE
from explorer.legs.clearance import PAIRS, leg_axes, leg_clearances
from explorer.legs.interference import step_overlaps, swept_tetrahedra
from explorer.legs.moves import move_clearance
from explorer.mechanism.design import Design
from explorer.mechanism.design_file import PRESETS
from explorer.mechanism.pose import Pose
from explorer.numerics.number_text import format_number

OPTIMAL = PRESETS["paper-optimal"]
JOINED = Design(a3=(10, 4), b1=(4, -1), b2=0.0, b3=2.0)
END = Pose.of_yaw_pitch_roll((14.0, -2.0, 6.0), (-20.0, 0.0, 15.0))


def swept(end: Pose = END, start: State | None = None) -> State:
    """Return the state after a move, its swept tetrahedra shown."""
    begin = opened(OPTIMAL) if start is None else start
    shown = viewed(begin, swept=True)
    return UserAction(SetPose(end), "drag", 100.0).apply(shown)


def random_states(count: int) -> list[State]:
    """Return the optimum in poses all about its home, with legs of different radii."""
    rng = np.random.default_rng(7)
    return [
        thick(
            opened(
                OPTIMAL,
                Pose.of_yaw_pitch_roll(rng.uniform(-8.0, 15.0, 3), rng.uniform(-80, 80, 3)),
            ),
            *rng.uniform(0.0, 1.5, 4).tolist(),
        )
        for _ in range(count)
    ]


STATES = random_states(12)


def clearances(state: State) -> np.ndarray[Any, np.dtype[np.float64]]:
    return leg_clearances(state.design, state.pose.position, state.pose.rotation).clearance


# The panel


def in_column(values: list[float]) -> Any:
    """Return what equals the numbers of a column, with the digits of its largest one."""
    return pytest.approx(values, abs=0.51 * 10.0 ** (1 - DIGITS) * max(map(abs, values)))


def test_table_shows_the_clearance_of_each_pair() -> None:
    verdicts: set[bool] = set()
    for state in STATES:
        expected = clearances(state)
        html = clearance_table(Frame(state))
        rows = rows_of(html)
        assert [row[0] for row in rows] == [f"{i} – {j}" for i, j in PAIRS]
        assert [number(row[1]) for row in rows] == in_column(expected.tolist())
        millimetres = (expected * OPTIMAL.unit_mm).tolist()
        assert [number(row[2]) for row in rows] == in_column(millimetres)
        collides = bool((expected < 0.0).any())
        verdicts.add(collides)
        assert ("Legs collide" in html) is collides
        assert ("Legs are clear" in html) is not collides
        lines = re.findall(r"<tr.*?</tr>", html)[1:]
        assert ["ex-beyond" in line for line in lines] == (expected < 0.0).tolist()
        strong = [i for i, line in enumerate(lines) if "ex-strong" in line]
        assert strong == [int(expected.argmin())]
    assert verdicts == {True, False}


def test_legs_that_share_a_joint_are_called_joined() -> None:
    index = PAIRS.index((2, 4))
    assert rows_of(clearance_table(Frame(opened(JOINED))))[index] == ["2 – 4", "joined", ""]
    state = swept(start=opened(JOINED))
    assert rows_of(move_table(Frame(state)))[index] == ["2 – 4", "", "joined", ""]


@pytest.mark.parametrize("radius", [0.0, 0.3, 0.4])
def test_last_move_is_judged_by_both_tests(radius: float) -> None:
    state = thick(swept(), radius)
    home = opened(OPTIMAL).pose
    exact = move_clearance(state.design, home, END)
    overlaps = step_overlaps(
        OPTIMAL, home.position, home.rotation, END.position, END.rotation
    ).tolist()
    html = move_table(Frame(state))
    rows = rows_of(html)
    assert [row[0] for row in rows] == [f"{i} – {j}" for i, j in PAIRS]
    assert [row[1] == "overlap" for row in rows] == overlaps
    assert [number(row[2]) for row in rows] == in_column(exact.clearance.tolist())
    assert [number(row[3]) for row in rows] == pytest.approx(
        (100.0 * exact.share).tolist(), abs=0.5
    )
    assert ("Clear all the way" in html) is exact.is_clear
    assert ("Legs collide on the way" in html) is not exact.is_clear
    named = [f"{i} – {j}" for (i, j), is_so in zip(PAIRS, overlaps, strict=True) if is_so]
    assert f"overlap of {', '.join(named)}<" in html


def test_words_of_a_move_say_whether_it_is_free() -> None:
    # With the two lines perpendicular both carriages stand in one place.
    turned = Pose(opened(OPTIMAL).pose.position, (1.0, 0.0, 0.0, -1.0))
    assert "Legs touch on the way" in move_table(Frame(swept(turned)))
    assert "Move the platform" in move_table(Frame(opened(OPTIMAL)))
    html = move_table(Frame(swept(Pose((10.0, 5.0, 8.0), opened(OPTIMAL).pose.quaternion))))
    assert "no overlap" in html
    assert "ex-within" in html
    assert "ex-beyond" not in html


def test_last_move_is_shown_on_request(services: Services, desk: Desk) -> None:
    panel = LegsPanel(services)
    checkbox: Any = next(
        handle
        for handle, _, _ in panel.updates(Frame(desk.state))
        if isinstance(handle, viser.GuiCheckboxHandle)
    )
    for on in (True, False):
        desk.use(checkbox, on)
        assert desk.state.view.swept is on
        updates = list(panel.updates(Frame(desk.state)))
        shown = [v for h, n, v in updates if isinstance(h, viser.GuiHtmlHandle) and n == "visible"]
        # The words of the radius curve are not shown.
        assert shown == [on, False]


# The scene


def test_legs_that_collide_are_coloured(services: Services) -> None:
    legs = Legs(services)
    for state in STATES:
        colours = by_name(legs.updates(Placed(Frame(state))))["/legs/actuators"]["batched_colors"]
        pairs = zip(PAIRS, clearances(state).tolist(), strict=True)
        beyond = {leg for pair, clearance in pairs if clearance < 0.0 for leg in pair}
        expected = [OUTLINE if leg in beyond else TUBE for leg in (1, 2, 3, 4)]
        assert [tuple(colour) for colour in colours[:4].tolist()] == expected


def test_closest_pair_is_marked_wherever_the_platform_goes(services: Services) -> None:
    scene = ClearanceScene(services)
    marked: set[tuple[int, int]] = set()
    for state in STATES:
        placed = Placed(Frame(viewed(state, clearance=True)))
        drawn = by_name(scene.updates(placed))
        found = leg_clearances(state.design, state.pose.position, state.pose.rotation)
        pair = int(found.clearance.argmin())
        first, second = PAIRS[pair]
        marked.add(PAIRS[pair])
        line, label = drawn["/clearance/line"], drawn["/clearance/label"]
        assert line["visible"] is label["visible"] is True
        ends = line["points"][0]
        length = float(np.linalg.norm(ends[1] - ends[0]))
        assert length == pytest.approx(placed.scale * found.distance[pair], rel=1e-4)
        # Each end lies on the axis of its leg.
        axes = placed.scale * leg_axes(state.design, state.pose.position, state.pose.rotation)
        for end, leg in zip(ends, (first, second), strict=True):
            base, tip = axes[leg - 1]
            along = np.linalg.norm(end - base) + np.linalg.norm(tip - end)
            assert along == pytest.approx(float(np.linalg.norm(tip - base)), rel=1e-4)
        np.testing.assert_allclose(label["position"], ends.mean(axis=0), rtol=1e-5, atol=1e-5)
        clearance = format_number(float(found.clearance[pair]), 3)
        assert label["text"] == f"legs {first}–{second}: {clearance}"
    assert len(marked) > 1


def test_legs_with_radii_are_drawn_as_capsules(services: Services) -> None:
    state = STATES[0]
    placed = Placed(Frame(state))
    drawn = by_name(ClearanceScene(services).updates(placed))
    rods, ends = drawn["/clearance/rods"], drawn["/clearance/ends"]
    axes = placed.scale * leg_axes(OPTIMAL, state.pose.position, state.pose.rotation)
    radii = placed.scale * np.array(state.design.limits.leg_radii)
    assert rods["visible"] is ends["visible"] is True
    np.testing.assert_allclose(rods["batched_positions"], axes[:, 0], rtol=1e-5, atol=1e-5)
    lengths = np.linalg.norm(axes[:, 1] - axes[:, 0], axis=1)
    expected = np.stack([radii, radii, lengths], axis=1)
    np.testing.assert_allclose(rods["batched_scales"], expected, rtol=1e-5)
    np.testing.assert_allclose(ends["batched_positions"], axes.reshape(8, 3), rtol=1e-5, atol=1e-5)
    np.testing.assert_allclose(ends["batched_scales"][:, 0], np.repeat(radii, 2), rtol=1e-5)


@pytest.mark.parametrize(
    ("radius", "view", "hidden"),
    [
        (0.0, {}, ("line", "label", "rods", "ends")),
        (0.0, {"clearance": True, "drawn_as": "6-4 twin"}, ("line", "label")),
        (0.3, {"drawn_as": "6-4 twin"}, ("rods", "ends")),
        (0.3, {"legs": False}, ("rods", "ends")),
    ],
)
def test_clearances_and_capsules_are_hidden_where_they_are_not_wanted(
    services: Services, radius: float, view: dict[str, Any], hidden: tuple[str, ...]
) -> None:
    shown = viewed(thick(opened(OPTIMAL), radius), **view)
    drawn = by_name(ClearanceScene(services).updates(Placed(Frame(shown))))
    for name in hidden:
        assert drawn[f"/clearance/{name}"] == {"visible": False}


def test_tetrahedra_of_the_last_move_are_drawn(services: Services) -> None:
    state, home = swept(), opened(OPTIMAL).pose
    placed = Placed(Frame(state))
    drawn = by_name(SweptTetrahedra(services).updates(placed))
    assert all(each["visible"] is True for each in drawn.values())
    bodies = placed.scale * swept_tetrahedra(
        OPTIMAL, home.position, home.rotation, END.position, END.rotation
    )
    overlaps = step_overlaps(OPTIMAL, home.position, home.rotation, END.position, END.rotation)
    beyond = [pair for pair, is_so in zip(PAIRS, overlaps, strict=True) if is_so]
    colours = [OUTLINE if any(leg in pair for pair in beyond) else SWEPT for leg in (1, 2, 3, 4)]
    # A move in which some overlap and some do not.
    assert set(colours) == {OUTLINE, SWEPT}
    for leg, body, colour in zip((1, 2, 3, 4), bodies, colours, strict=True):
        mesh = drawn[f"/swept/{leg}"]
        np.testing.assert_allclose(mesh["vertices"], body, rtol=1e-5, atol=1e-5)
        assert mesh["color"] == colour
    lines = drawn["/swept/edges"]
    assert lines["points"].shape == lines["colors"].shape == (20, 2, 3)
    assert [tuple(c) for c in lines["colors"][::5, 0].tolist()] == colours
    # The legs where they were, over the edges.
    starts = placed.scale * leg_axes(OPTIMAL, home.position, home.rotation)
    np.testing.assert_allclose(drawn["/swept/starts"]["points"], starts, rtol=1e-5, atol=1e-5)


def test_swept_tetrahedra_are_hidden_and_cost_nothing_where_they_are_not_wanted(
    services: Services,
) -> None:
    scene = SweptTetrahedra(services)
    for view in ({"swept": False}, {"swept": True, "drawn_as": "6-4 twin"}):
        frame = Frame(viewed(swept(), **view))
        assert list(by_name(scene.updates(Placed(frame))).values()) == [{"visible": False}] * 6
        assert "last_move" not in vars(frame)
    back = UserAction(SetPosition(0, 10.0), "x", 0.1)
    there = UserAction(SetPosition(0, 12.0), "x", 0.0)
    shown = viewed(opened(OPTIMAL), swept=True)
    for state in (shown, back.apply(there.apply(shown))):
        drawn = by_name(scene.updates(Placed(Frame(state))))
        assert list(drawn.values()) == [{"visible": False}] * 6


# The order of the carriages


def test_checkbox_says_whether_the_carriages_keep_their_order(
    services: Services, desk: Desk
) -> None:
    panel = DesignPanel(services)
    boxes = {
        handle.label: handle
        for handle, _, _ in panel.updates(Frame(desk.state))
        if isinstance(handle, viser.GuiCheckboxHandle)
    }
    for on, order in ((False, "any"), (True, "home")):
        desk.use(boxes["Carriages keep their order"], on)
        assert desk.state.design.limits.carriage_order == order
    assert desk.complaints == []


# The radii


def test_each_radius_has_a_slider_that_sets_it_alone_and_refuses_what_cannot_be(
    services: Services, desk: Desk
) -> None:
    sliders: dict[str, Any] = {}
    for handle, name, value in DesignPanel(services).updates(Frame(desk.state)):
        setattr(handle, name, value)
        if isinstance(handle, viser.GuiSliderHandle):
            sliders[handle.label] = handle
    expected, span = [0.0] * 4, radius_span(desk.state)
    for leg in range(4):
        slider = sliders[f"leg {leg + 1}"]
        assert (slider.min, slider.max, slider.value) == (0.0, span.high, 0.0)
        expected[leg] = 0.1 * (leg + 1)
        desk.use(slider, expected[leg])
        assert desk.state.design.limits.leg_radii == pytest.approx(expected)
    assert desk.complaints == []
    before = desk.state
    sums = [expected[i - 1] + expected[j - 1] for i, j in PAIRS]
    np.testing.assert_allclose(clearances(before), clearances(opened(OPTIMAL)) - sums)
    # What no slider offers may still be typed, or sent by anyone.
    for radius in (-0.5, float("nan")):
        desk.use(sliders["leg 3"], radius)
        assert desk.state == before
        assert desk.complaints.pop().startswith("The radius of a leg must ")
