"""Loads on the page: the verdict, the tables, the arrows, the handle and the nearest position."""

from __future__ import annotations

import math
import re
from collections.abc import Generator
from dataclasses import replace
from itertools import pairwise
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
from explorer.mechanism.design import JOINTS, Design
from explorer.mechanism.design_file import PRESETS
from explorer.mechanism.pose import Pose
from explorer.statics.forces import actuator_forces, strut_bending

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


def move_to(state: State, *position: float) -> State:
    """Return a state with b4 at a position."""
    x, y, z = position
    return replace(state, pose=Pose((x, y, z), state.pose.quaternion))


@pytest.fixture
def services(server: viser.ViserServer) -> Services:
    return services_for(server)


@pytest.fixture
def desk() -> Generator[Desk]:
    desk = Desk(loaded_state())
    yield desk
    desk.session.stop()


def contents(panel: ForcesPanel, frame: Frame) -> str:
    """Return the markup of the panel."""
    return " ".join(str(value) for _, name, value in panel.updates(frame) if name == "content")


def words_of(state: State) -> str:
    """Return the verdict as text."""
    return re.sub("<[^>]+>", " ", " ".join(verdict(loaded_pose(state))))


def loaded_pose(state: State) -> Any:
    """Return the pose of a state under its load."""
    return services_for().get(Loads).of(Frame(state))


def test_tables_show_the_forces_that_hold_the_load() -> None:
    state = loaded_state(moment=(0.01, -0.02, 0.03))
    design, pose = state.design, state.pose
    force, moment = np.array([0.0, 0.0, -10.0]), 100.0 * np.array([0.01, -0.02, 0.03])
    tool, weight = np.array(design.tool.position), np.array([0.0, 0.0, -0.5 * 9.80665])
    arm = pose.rotation @ (np.array(design.payload.centre) - tool)
    load = np.concatenate([force + weight, moment + np.cross(arm, weight)])
    given = design, pose.position, pose.rotation, load, tool
    text = " ".join(tables(loaded_pose(state)))
    texts = re.findall(r"<td>(?:<span[^>]*>)?([^<]*)", text)
    shown = dict(pairwise(texts))
    for name, value in zip(JOINTS, actuator_forces(*given), strict=True):
        assert number(shown[name].removesuffix(" N")) == pytest.approx(value, abs=6e-3)
    for leg, value in zip((2, 3), 0.01 * np.array(strut_bending(*given)), strict=True):
        assert number(shown[f"strut {leg}"].removesuffix(" N m")) == pytest.approx(value, abs=6e-4)


@pytest.mark.parametrize(
    ("factor", "title", "look"),
    [(1.0, "Holds the load", "within"), (9.0, "Does not hold the load", "beyond")],
)
def test_verdict_and_bar_name_the_largest_share(factor: float, title: str, look: str) -> None:
    state = loaded_state(force=(0.0, 0.0, -10.0 * factor))
    share = share_words(loaded_pose(state).share)
    text = "".join(verdict(loaded_pose(state)))
    assert title in words_of(state)
    assert f"ex-{look}" in text
    assert "bending of strut 2" in text.lower()
    assert share in text
    bar = services_for().get(LoadFigure)(Frame(state))
    assert share in bar
    assert ("ex-beyond" in bar) == (look == "beyond")


def test_design_without_limits_shows_forces_and_no_shares() -> None:
    state = loaded_state(OPTIMAL)
    found = loaded_pose(state)
    assert not found.limited.any()
    assert "Machine" in words_of(state)
    assert "%" not in "".join(tables(found))
    assert "".join(largest(Frame(state), found)).count("no limit") == 2
    assert services_for().get(LoadFigure)(Frame(state)) == ""


def test_part_with_a_limit_and_no_force_uses_none_of_it() -> None:
    state = loaded_state(force=(0.0, 0.0, 0.0), weighed="none")
    assert "Holds the load" in words_of(state)
    text = "".join(tables(loaded_pose(state)))
    assert (text.count(">0\N{NO-BREAK SPACE}%<"), text.count("no limit")) == (10, 0)
    free = msgspec.structs.replace(LIMITED, guide=Guide(), struts=Struts())
    assert "".join(tables(loaded_pose(loaded_state(free)))).count("no limit") == 4


def test_force_of_any_direction_is_shown_beside_the_forces(
    server: viser.ViserServer, buttons: Buttons
) -> None:
    design = msgspec.structs.replace(LIMITED, payload=Payload(0.0, (0.0, 0.0, 0.0), 20.0))
    state = loaded_state(design, force=(0.0, 0.0, 0.0))
    found = loaded_pose(state)
    text = "".join(tables(found))
    assert text.count("±") == 10
    spread = number(re.findall(r"± ([0-9.]+) N<", text)[1])
    assert spread == pytest.approx(found.held.spread[1], rel=1e-2)
    panel = ForcesPanel(services_for(server, Desk(state).session, buttons=buttons))
    assert "20 N in any direction" in contents(panel, Frame(state))


def test_singular_pose_shows_infinite_forces() -> None:
    state = move_to(loaded_state(), 10.0, 5.0, 0.0)
    assert "infinite" in words_of(state)
    text = "".join(tables(loaded_pose(state)))
    assert "∞" in text
    assert "nan" not in text.lower()
    assert "pushes<" not in text
    assert "worst direction" not in "".join(largest(Frame(state), loaded_pose(state)))
    assert "∞" in services_for().get(LoadFigure)(Frame(state))


def test_weights_are_those_that_are_chosen() -> None:
    worker = StubWorker()
    services = services_for(worker=worker)
    loads = services.get(Loads)
    none, payload = (
        loads.of(Frame(loaded_state(force=(0.0, 0.0, 0.0), weighed=each))).held.actuators
        for each in ("none", "payload")
    )
    assert np.abs(none).max() == 0.0
    assert np.abs(payload).max() > 1.0
    frame = Frame(loaded_state(force=(0.0, 0.0, 0.0), weighed="payload and legs"))
    services.get(WeightsFeed).follow(frame)
    # Until the parts have masses, the payload alone counts.
    assert loads.of(frame).own is None
    worker.work()
    own = loads.of(frame).own
    assert own is not None
    assert min(own.rods) > 0.0
    assert np.abs(loads.of(frame).held.actuators - payload).max() > 1e-3


def test_nearest_position_that_holds_the_load_is_searched_and_gone_to(
    server: viser.ViserServer, buttons: Buttons, desk: Desk
) -> None:
    worker = StubWorker()
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


def test_press_turns_the_force_into_its_worst_direction(
    server: viser.ViserServer, buttons: Buttons, desk: Desk
) -> None:
    ForcesPanel(services_for(server, desk.session, buttons=buttons))
    desk.press(buttons, WORST)
    state = desk.state
    assert math.hypot(*state.view.forces.force) == pytest.approx(10.0, rel=1e-3)
    worst = loaded_pose(state).share
    for direction in np.random.default_rng(3).normal(size=(30, 3)):
        x, y, z = (10.0 * direction / np.linalg.norm(direction)).tolist()
        assert loaded_pose(SetForce((x, y, z)).apply(state)).share <= worst * (1.0 + 1e-3)


def test_load_is_an_arrow_from_the_tool_by_its_scale(services: Services) -> None:
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
    state = move_to(loaded_state(force=(0.0, 0.0, -60.0)), 10.0, 5.0, 3.0)
    shares, scene = loaded_pose(state).shares, services.get(ForcesScene)
    nodes = by_name(scene.updates(Placed(Frame(state))))
    # viser's client takes the colours of copies for linear ones.
    expected = [list(linear_colour(share_colour(shares[index]))) for index in (0, 2, 4, 5)]
    assert nodes["/forces/sleeves"]["batched_colors"].tolist() == expected
    assert nodes["/forces/bending/2"]["color"] == SINGULAR
    without = by_name(scene.updates(Placed(Frame(loaded_state(OPTIMAL)))))
    assert without["/forces/sleeves"]["batched_colors"].tolist() == [list(linear_colour(GHOST))] * 4


def test_scene_without_forces_draws_nothing(services: Services) -> None:
    scene, handle = services.get(ForcesScene), services.get(LoadHandle)
    hidden = Placed(Frame(opened(LIMITED)))
    nodes = by_name(scene.updates(hidden)) | by_name(handle.updates(hidden))
    assert not any(values["visible"] for values in nodes.values() if "visible" in values)
    assert not len(scene.corners(hidden))
    # In a singular pose there is the load, and nothing that holds it.
    singular = Placed(Frame(move_to(loaded_state(), 10.0, 5.0, 0.0)))
    nodes = by_name(scene.updates(singular))
    assert nodes["/forces/arrows/shafts"]["visible"]
    assert not nodes["/forces/sleeves"]["visible"]
    assert np.isfinite(nodes["/forces/arrows/shafts"]["batched_positions"]).all()


def test_pull_at_the_handle_sets_the_force_and_leaves_the_handle(services: Services) -> None:
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


def test_typed_force_has_an_arrow_that_can_be_seen() -> None:
    assert fitting_scale(0.0, 20.0) == fitting_scale(5e-324, 20.0) == 20.0
    for force in np.geomspace(1e-6, 1e6, 40):
        scale = fitting_scale(float(force), 20.0)
        assert 0.1 <= force / scale <= 1.0
        assert scale == 20.0 or FITTING / 2 < force / scale < FITTING * 2


@pytest.mark.parametrize("unit_mm", [1.0, 10.0, 1000.0])
def test_moment_is_in_newton_metres_whatever_the_unit(unit_mm: float) -> None:
    design = msgspec.structs.replace(OPTIMAL, unit_mm=unit_mm)
    load = load_of(loaded_state(design, moment=(0.0, 2.0, 0.0)))
    assert tuple(load[:5]) == (0.0, 0.0, -10.0, 0.0, 2e3 / unit_mm)


@pytest.mark.parametrize("force", [(math.nan, 0.0, 0.0), (math.inf, 0.0, 0.0), (0.0, 1e41, 0.0)])
def test_force_that_is_not_finite_is_refused(force: tuple[float, float, float]) -> None:
    with pytest.raises(InputError, match=r"^the force must be three finite numbers[^\n]*$"):
        SetForce(force).apply(loaded_state())


def test_share_has_words() -> None:
    shares = [None, 0.004, 0.5, 0.9996, 1.0, 1.0000001, 1.004, 1.234, 1e5, math.inf]
    words = [share_words(share).replace("\N{NO-BREAK SPACE}", " ") for share in shares]
    # What exceeds the limit never reads as the limit.
    assert words[:6] == ["no limit", "0 %", "50 %", "100.0 %", "100.0 %", "above 100.0 %"]
    assert words[6:] == ["100.4 %", "123 %", "∞", "∞"]


def test_share_has_a_look_for_within_close_and_beyond() -> None:
    looks = [share_look(share) for share in (0.5, 0.9, 1.0, 1.001)]
    assert looks == ["within", "close", "close", "beyond"]
