"""Loads on the page: the verdict, the tables, the arrows, the handle and the nearest position."""

from __future__ import annotations

import math
import re
from dataclasses import replace
from typing import Any

import msgspec
import numpy as np
import pytest
import viser
from desk import Desk, by_name, number
from services import StubWorker, services_for

from explorer import Actuators, Guide, Payload, Struts, Tool
from explorer.app.features.feature import Services
from explorer.app.features.forces.actions import FITTING, SetForce, fitting_scale
from explorer.app.features.forces.load_figure import LoadFigure
from explorer.app.features.forces.loads import Loads, NearestFeed, WeightsFeed, load_of
from explorer.app.features.forces.panel import GO, WORST, ForcesPanel, largest, tables, verdict
from explorer.app.features.forces.scene import (
    LONGEST_REACTION,
    ForcesScene,
    LoadHandle,
    load_tip,
    reaction_vectors,
    tool_point,
)
from explorer.app.features.forces.words import share_colour, share_look, share_words
from explorer.app.scene.placing import SCENE_REACH, Placed
from explorer.app.scene.shapes import linear_colour
from explorer.app.state.actions import Set
from explorer.app.state.frame import Frame
from explorer.app.state.state import State, opened
from explorer.app.state.view import ForcesView
from explorer.app.widgets.buttons import Buttons
from explorer.app.widgets.colours import GHOST, SINGULAR
from explorer.errors import InputError
from explorer.mechanism.design import Design
from explorer.mechanism.design_file import PRESETS
from explorer.mechanism.pose import Pose
from explorer.statics.forces import actuator_forces, strut_bending
from explorer.statics.weights import Weights

OPTIMAL = PRESETS["paper-optimal"]
LIMITED = msgspec.structs.replace(
    OPTIMAL,
    tool=Tool((1.5, -1.0, 3.0)),
    payload=Payload(0.5, (1.5, -1.0, 1.5)),
    actuators=Actuators(push_n=(60, 60, 60, 60, 60, 60)),
    struts=Struts(moment_nm=3.0),
    guide=Guide(force_n=50.0),
)


def loaded_state(design: Design = LIMITED, **forces: Any) -> State:
    """Return a design at home, with forces shown."""
    state = opened(design)
    return Set("view", replace(state.view, forces=ForcesView(shown=True, **forces))).apply(state)


def moved_to(state: State, *position: float) -> State:
    """Return a state with b4 at a position."""
    x, y, z = position
    return replace(state, pose=Pose((x, y, z), state.pose.quaternion))


@pytest.fixture
def services(server: viser.ViserServer) -> Services:
    return services_for(server)


def contents(panel: ForcesPanel, frame: Frame) -> str:
    """Return the markup of the panel."""
    return " ".join(str(value) for _, name, value in panel.updates(frame) if name == "content")


def words_of(state: State) -> str:
    """Return the verdict as text."""
    return re.sub("<[^>]+>", " ", " ".join(verdict(loaded(state))))


def loaded(state: State, weights: Weights | None = None) -> Any:
    """Return the pose of a state under its load."""
    services = services_for()
    loads = services.get(Loads)
    assert services.get(WeightsFeed) is loads.weights
    found = loads.of(Frame(state))
    return found if weights is None else replace(found, own=weights)


def test_the_tables_tell_the_forces_that_hold_the_load() -> None:
    state = loaded_state(moment=(0.01, -0.02, 0.03))
    design, pose = state.design, state.pose
    force, moment = np.array([0.0, 0.0, -10.0]), 100.0 * np.array([0.01, -0.02, 0.03])
    tool, weight = np.array(design.tool.position), np.array([0.0, 0.0, -0.5 * 9.80665])
    arm = pose.rotation @ (np.array(design.payload.centre) - tool)
    load = np.concatenate([force + weight, moment + np.cross(arm, weight)])
    given = design, pose.position, pose.rotation, load, tool
    actuators, bending = actuator_forces(*given), strut_bending(*given)
    text = " ".join(tables(loaded(state)))
    cells = re.findall(r"<td>(?:<span[^>]*>)?([^<]*)", text)
    told = {cells[i]: cells[i + 1] for i in range(len(cells) - 1)}
    for name, value in zip(("l1", "d1", "d2", "d3", "d4", "l4"), actuators, strict=True):
        assert number(told[name].removesuffix(" N")) == pytest.approx(value, abs=6e-3)
    for leg, value in zip((2, 3), bending, strict=True):
        assert number(told[f"strut {leg}"].removesuffix(" N m")) == pytest.approx(
            0.01 * value, abs=6e-4
        )


@pytest.mark.parametrize(
    ("factor", "title", "look"),
    [(1.0, "Holds the load", "within"), (9.0, "Does not hold the load", "beyond")],
)
def test_the_verdict_tells_the_part_that_is_nearest_to_its_limit(
    factor: float, title: str, look: str
) -> None:
    state = loaded_state(force=(0.0, 0.0, -10.0 * factor))
    found = loaded(state)
    text = "".join(verdict(found))
    assert title in words_of(state)
    assert f"ex-{look}" in text
    assert "bending of strut 2" in text.lower()
    assert share_words(found.share) in text


def test_without_limits_forces_are_told_and_no_shares() -> None:
    state = loaded_state(OPTIMAL)
    assert not loaded(state).limited.any()
    assert "Machine" in words_of(state)
    assert "%" not in "".join(tables(loaded(state)))
    assert "".join(largest(Frame(state), loaded(state))).count("no limit") == 2


def test_a_part_with_a_limit_and_no_force_uses_none_of_it() -> None:
    state = loaded_state(force=(0.0, 0.0, 0.0), weighed="none")
    assert "Holds the load" in words_of(state)
    text = "".join(tables(loaded(state)))
    assert (text.count(">0\N{NO-BREAK SPACE}%<"), text.count("no limit")) == (10, 0)
    free = msgspec.structs.replace(LIMITED, guide=Guide(), struts=Struts())
    text = "".join(tables(loaded(loaded_state(free))))
    assert text.count("no limit") == 4


def test_the_payloads_force_of_any_direction_is_told_beside_the_forces(
    server: viser.ViserServer,
) -> None:
    design = msgspec.structs.replace(LIMITED, payload=Payload(0.0, (0.0, 0.0, 0.0), 20.0))
    state = loaded_state(design, force=(0.0, 0.0, 0.0))
    found = loaded(state)
    text = "".join(tables(found))
    assert text.count("±") == 10
    told = number(re.findall(r"± ([0-9.]+) N<", text)[1])
    assert told == pytest.approx(found.held.spread[1], rel=1e-2)
    panel = ForcesPanel(services_for(server, Desk(state).session, buttons=Buttons(server)))
    assert "20 N in any direction" in contents(panel, Frame(state))


def test_in_a_singular_pose_the_page_says_that_forces_are_infinite() -> None:
    state = moved_to(loaded_state(), 10.0, 5.0, 0.0)
    assert "infinite" in words_of(state)
    text = "".join(tables(loaded(state)))
    assert "∞" in text
    assert "nan" not in text.lower()
    assert "pushes<" not in text
    assert "worst direction" not in "".join(largest(Frame(state), loaded(state)))


def test_weights_are_those_that_are_chosen(server: viser.ViserServer) -> None:
    worker = StubWorker()
    services = services_for(server, worker=worker)
    loads, feed = services.get(Loads), services.get(WeightsFeed)
    none, payload = (
        loads.of(Frame(loaded_state(force=(0.0, 0.0, 0.0), weighed=each)))
        for each in ("none", "payload")
    )
    assert np.abs(none.held.actuators).max() == 0.0
    assert np.abs(payload.held.actuators).max() > 1.0
    frame = Frame(loaded_state(force=(0.0, 0.0, 0.0), weighed="payload and legs"))
    feed.follow(frame)
    # Until the parts have masses, the payload alone counts.
    assert loads.of(frame).own is None
    worker.work()
    own = loads.of(frame).own
    assert own is not None
    assert min(own.rods) > 0.0
    held = loads.of(frame).held.actuators
    assert np.abs(held - payload.held.actuators).max() > 1e-3


def test_the_nearest_position_is_searched_where_the_load_is_not_held_and_gone_to(
    server: viser.ViserServer,
) -> None:
    worker, desk, buttons = StubWorker(), Desk(loaded_state()), Buttons(server)
    services = services_for(server, desk.session, worker, buttons=buttons)
    panel, feed = ForcesPanel(services), services.get(NearestFeed)
    feed.follow(Frame(desk.state))
    assert feed.request is None
    desk.session.do(Set("view.forces", ForcesView(shown=True, force=(0.0, 0.0, -25.0))))
    frame = Frame(desk.state)
    feed.follow(frame)
    assert feed.request is not None
    assert "searching" in contents(panel, frame)
    worker.work()
    drawing = feed.drawing
    assert drawing is not None
    assert drawing.pose is not None
    assert "mm from here" in contents(panel, frame)
    desk.press(buttons, GO)
    assert desk.state.pose == drawing.pose
    assert services.get(Loads).of(Frame(desk.state)).share <= 1.0
    feed.follow(Frame(desk.state))
    assert feed.request is None


def test_a_press_turns_the_force_into_its_worst_direction(server: viser.ViserServer) -> None:
    desk, buttons = Desk(loaded_state()), Buttons(server)
    services = services_for(server, desk.session, buttons=buttons)
    ForcesPanel(services)
    before = services.get(Loads).of(Frame(desk.state)).share
    desk.press(buttons, WORST)
    state = desk.state
    assert math.hypot(*state.view.forces.force) == pytest.approx(10.0, rel=1e-3)
    after = services.get(Loads).of(Frame(state)).share
    assert after > before
    rng = np.random.default_rng(3)
    for direction in rng.normal(size=(200, 3)):
        x, y, z = (10.0 * direction / np.linalg.norm(direction)).tolist()
        other = services.get(Loads).of(Frame(SetForce((x, y, z)).apply(state)))
        assert other.share <= after * (1.0 + 1e-3)


def test_the_bar_tells_the_largest_share_where_there_are_limits() -> None:
    shown = services_for().get(LoadFigure)
    assert shown(Frame(loaded_state(OPTIMAL))) == ""
    state = loaded_state()
    assert share_words(loaded(state).share) in shown(Frame(state))
    assert "ex-beyond" in shown(Frame(SetForce((0.0, 0.0, -90.0)).apply(state)))
    assert "∞" in shown(Frame(moved_to(state, 10.0, 5.0, 0.0)))


# The scene


def test_the_load_is_an_arrow_from_the_tool_by_its_scale(services: Services) -> None:
    state = loaded_state(force=(3.0, 0.0, -4.0), scale=10.0)
    placed = Placed(Frame(state))
    vector = load_tip(placed) - tool_point(placed)
    np.testing.assert_allclose(vector, placed.reach * np.array([0.3, 0.0, -0.4]))
    nodes = by_name(services.get(ForcesScene).updates(placed))
    assert nodes["/forces/label/load"]["text"] == "5 N"
    assert nodes["/forces/label/l4"]["visible"]
    np.testing.assert_allclose(services.get(ForcesScene).corners(placed)[0], load_tip(placed))


def test_arrows_of_reactions_keep_their_order_and_a_bound() -> None:
    placed = Placed(Frame(loaded_state()))
    forces = np.array([[1e-3, 0, 0], [1.0, 0, 0], [0, 20.0, 0], [0, 0, 1e9]])
    lengths = np.linalg.norm(reaction_vectors(placed, forces), axis=1)
    assert (np.diff(lengths) > 0.0).all()
    assert lengths[-1] <= LONGEST_REACTION * placed.reach


def test_forces_are_drawn_in_the_colour_of_their_share(services: Services) -> None:
    state = moved_to(loaded_state(force=(0.0, 0.0, -60.0)), 10.0, 5.0, 3.0)
    found = loaded(state)
    nodes = by_name(services.get(ForcesScene).updates(Placed(Frame(state))))
    colours = nodes["/forces/sleeves"]["batched_colors"]
    # viser's client takes the colours of copies for linear ones.
    expected = [linear_colour(share_colour(found.shares[index])) for index in (0, 2, 4, 5)]
    assert colours.tolist() == [list(each) for each in expected]
    assert nodes["/forces/bending/2"]["color"] == SINGULAR
    without = by_name(services.get(ForcesScene).updates(Placed(Frame(loaded_state(OPTIMAL)))))
    assert without["/forces/sleeves"]["batched_colors"].tolist() == [list(linear_colour(GHOST))] * 4


def test_nothing_is_drawn_where_no_forces_are(services: Services) -> None:
    scene, handle = services.get(ForcesScene), services.get(LoadHandle)
    hidden = Placed(Frame(opened(LIMITED)))
    nodes = by_name(scene.updates(hidden)) | by_name(handle.updates(hidden))
    assert not any(values["visible"] for values in nodes.values() if "visible" in values)
    assert not len(scene.corners(hidden))
    # In a singular pose there is the load, and nothing that holds it.
    singular = Placed(Frame(moved_to(loaded_state(), 10.0, 5.0, 0.0)))
    nodes = by_name(scene.updates(singular))
    assert nodes["/forces/arrows/shafts"]["visible"]
    assert not nodes["/forces/sleeves"]["visible"]
    assert np.isfinite(nodes["/forces/arrows/shafts"]["batched_positions"]).all()


def test_a_pull_at_the_handle_sets_the_force_and_leaves_the_handle(services: Services) -> None:
    state = loaded_state()
    handle = services.get(LoadHandle)
    for node, name, value in handle.updates(Placed(Frame(state))):
        setattr(node, name, value)
    np.testing.assert_allclose(handle.force(state), state.view.forces.force, atol=1e-12)
    rng = np.random.default_rng(1)
    for _ in range(5):
        handle.handle.position = tuple(rng.normal(size=3).tolist())
        force = handle.force(state)
        state = SetForce(force, keeps_scale=True).apply(state)
        updates = list(handle.updates(Placed(Frame(state))))
        assert "position" not in {name for _, name, _ in updates}
        tip = load_tip(Placed(Frame(state)))
        # Forces have few decimals, and the handle stays under the pointer.
        np.testing.assert_allclose(tip, handle.handle.position, atol=1e-3 * SCENE_REACH)


def test_a_typed_force_has_an_arrow_that_can_be_seen() -> None:
    assert fitting_scale(0.0, 20.0) == fitting_scale(5e-324, 20.0) == 20.0
    for force in np.geomspace(1e-6, 1e6, 40):
        scale = fitting_scale(float(force), 20.0)
        assert 0.1 <= force / scale <= 1.0
        assert scale == 20.0 or FITTING / 2 < force / scale < FITTING * 2


def test_moments_are_in_newton_metres_whatever_the_unit() -> None:
    for unit_mm in (1.0, 10.0, 1000.0):
        design = msgspec.structs.replace(OPTIMAL, unit_mm=unit_mm)
        assert load_of(loaded_state(design, moment=(0.0, 2.0, 0.0)))[4] == 2e3 / unit_mm


@pytest.mark.parametrize("force", [(math.nan, 0.0, 0.0), (math.inf, 0.0, 0.0), (0.0, 1e41, 0.0)])
def test_a_force_that_is_not_finite_is_refused_in_one_line(force: tuple[float, ...]) -> None:
    x, y, z = force
    with pytest.raises(InputError, match="force must be three finite numbers") as refused:
        SetForce((x, y, z)).apply(loaded_state())
    assert "\n" not in str(refused.value)


def test_shares_have_words_and_looks() -> None:
    assert [share_words(each) for each in (None, 0.004, 0.5, 1.234, 1e5, math.inf)] == [
        "no limit",
        "0\N{NO-BREAK SPACE}%",
        "50\N{NO-BREAK SPACE}%",
        "123\N{NO-BREAK SPACE}%",
        "∞",
        "∞",
    ]
    near = [share_words(each).replace("\N{NO-BREAK SPACE}", " ") for each in (0.9996, 1.0, 1.004)]
    assert near == ["100.0 %", "100.0 %", "100.4 %"]
    # What exceeds the limit never reads as the limit.
    assert share_words(1.0000001) == "above 100.0\N{NO-BREAK SPACE}%"
    assert [share_look(each) for each in (0.5, 0.9, 1.0, 1.001)] == [
        "within",
        "close",
        "close",
        "beyond",
    ]
    assert load_of(loaded_state())[:3] == (0.0, 0.0, -10.0)
