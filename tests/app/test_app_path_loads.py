"""Loads along the paths of the page: demanded of planned ones, told and plotted of all."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import replace
from importlib.util import find_spec
from typing import Any

import msgspec
import numpy as np
import pytest
import viser
from desk import Desk
from services import StubWorker, services_for

from explorer.app.features.feature import Services
from explorer.app.features.forces.loads import load_of
from explorer.app.features.forces.tasks import WeightsRequest, weights_of_parts
from explorer.app.features.paths import runner
from explorer.app.features.paths.actions import Go
from explorer.app.features.paths.load_plot import LoadPlot, columns_of, top_of
from explorer.app.features.paths.loads import JourneyLoads, PathShares, demand_note, load_words
from explorer.app.features.paths.panel import PathsPanel
from explorer.app.features.paths.runner import PathRunner
from explorer.app.features.paths.tasks import PlanRequest, plan
from explorer.app.state.action import Action
from explorer.app.state.actions import Set
from explorer.app.state.frame import Frame
from explorer.app.state.paths import Journey
from explorer.app.state.state import State, opened
from explorer.app.widgets.assigning import Assigner
from explorer.app.widgets.pieces import widgets
from explorer.mechanism.design_file import PRESETS
from explorer.mechanism.home import home_pose
from explorer.mechanism.machine import Actuators, Guide, Payload, Struts, Tool
from explorer.mechanism.pose import Pose, Triple
from explorer.numerics.arrays import FloatArray
from explorer.paths.loads import TOLERANCE, path_loads

OPTIMAL = PRESETS["paper-optimal"]
PRESS = msgspec.structs.replace(
    OPTIMAL,
    tool=Tool((1.0, 0.0, 2.0)),
    payload=Payload(0.5, (1.0, 0.0, 1.0)),
    actuators=Actuators((150.0, 200.0, 150.0, 200.0, 150.0, 150.0)),
    struts=Struts(outer_mm=8.0, inner_mm=6.0, stress_mpa=200.0),
    guide=Guide(force_n=200.0, moment_nm=6.0),
)
# Both ends hold 40 N downwards; the straight move between them, low over the base, does not.
START = Pose.of_yaw_pitch_roll((2.4, 0.2, 1.7), (-53.0, -3.0, 2.0))
GOAL = Pose.of_yaw_pitch_roll((18.5, 9.2, 2.1), (-82.0, -5.0, 1.0))
DOWN = (0.0, 0.0, -40.0)
needs_ompl = pytest.mark.skipif(find_spec("ompl") is None, reason="OMPL is not installed")


def straight(*more: Action, force: Triple = DOWN) -> State:
    """Return a state with the straight path between the ends."""
    state = opened(PRESS, START)
    for action in (
        Set("view.forces.force", force),
        Set("paths.goal", GOAL),
        Set("paths.holds_load", True),
        Set("paths.seconds", 20.0),
        *more,
        Go(),
    ):
        state = action.apply(state)
    return state


def through_the_base() -> State:
    """Return a state with a straight path through a singular pose."""
    x, y, z = home_pose(PRESS).position
    return straight(Set("paths.goal", Pose((x, y, -z), home_pose(PRESS).quaternion)))


def journey_of(state: State) -> Journey:
    assert state.journey is not None
    return state.journey


@pytest.fixture
def request_plan(monkeypatch: pytest.MonkeyPatch) -> Callable[[State], PlanRequest]:
    """Return what the page asks the planner for in a state."""
    worker = StubWorker()

    def use_stub(*_: object, **__: object) -> StubWorker:
        return worker

    monkeypatch.setattr(runner, "Worker", use_stub)
    paths = PathRunner(services_for())

    def request(state: State) -> PlanRequest:
        paths.follow(Frame(state))
        return worker.orders[-1].request

    return request


@needs_ompl
@pytest.mark.parametrize(
    ("at", "weighed", "force"), [("tool", "payload", -40.0), ("b4", "payload and legs", -25.0)]
)
def test_planned_path_holds_load_and_weights_of_the_tab_forces(
    request_plan: Callable[[State], PlanRequest], at: str, weighed: str, force: float
) -> None:
    state = straight(
        Set("view.at", at),
        Set("view.forces.weighed", weighed),
        Set("view.prototype.density", 3000.0),
        force=(0.0, 0.0, force),
    )
    state = Go().apply(Set("paths.kind", "planned").apply(state))
    poses = plan(request_plan(state)).poses
    weights = None
    if weighed == "payload and legs":
        own = weights_of_parts(WeightsRequest(PRESS, 3000.0)).weights
        weights = replace(own, on_platform=(*own.on_platform, PRESS.payload))
    along = path_loads(PRESS, poses, load_of(state), tool=state.tool, weights=weights)
    assert 0.5 < along.largest.share <= 1.0 + TOLERANCE


def test_planned_path_without_the_demand_has_no_load_to_hold(
    request_plan: Callable[[State], PlanRequest],
) -> None:
    state = straight(Set("paths.holds_load", False))
    assert request_plan(Go().apply(Set("paths.kind", "planned").apply(state))).load is None


# What is told of the present path


def shares_of(services: Services, state: State) -> JourneyLoads:
    found = PathShares(services).of(Frame(state))
    assert found is not None
    return found


def test_shares_over_time_are_those_of_the_path(services: Services) -> None:
    state = straight(Set("view.at", "tool"))
    journey = journey_of(state)
    found = shares_of(services, state)
    expected = path_loads(PRESS, journey.poses, load_of(state), tool=journey.tool, samples=2001)
    assert found.largest == expected.largest
    largest: FloatArray = expected.shares.max(axis=1)
    most = np.interp(journey.trajectory.at, expected.at, largest)
    np.testing.assert_allclose(found.shares, most, atol=2e-3)
    pose = journey.pose_at(found.seconds)
    here = path_loads(PRESS, (pose, pose), load_of(state)).largest
    assert (here.share, here.part) == (pytest.approx(found.largest.share), found.largest.part)


def test_shares_follow_load_and_weights_but_not_the_time(services: Services) -> None:
    kept, state = PathShares(services), straight()
    first = kept.of(Frame(state))
    assert first is not None
    assert kept.of(Frame(Set("paths.seconds", 3.0).apply(state))) is first
    light = shares_of(services, Set("view.forces.weighed", "none").apply(state))
    half = shares_of(services, Set("view.forces.force", (0.0, 0.0, -20.0)).apply(state))
    assert first.largest.share > light.largest.share > half.largest.share


def test_words_name_the_largest_share_its_part_and_time(services: Services) -> None:
    found = shares_of(services, straight())
    words = load_words(found)
    assert "ex-beyond" in words
    assert f"Largest share {100.0 * found.largest.share:.0f} %: moment of carriage 2" in words
    assert f"at {found.seconds:.2f} s" in words
    idle = Set("view.forces.weighed", "none").apply(straight(force=(0.0, 0.0, 0.0)))
    assert "No part bears a load" in load_words(shares_of(services, idle))
    state = through_the_base()
    found = shares_of(services, state)
    crossing = journey_of(state).margins.crossings[0]
    assert found.largest.place == crossing.move + crossing.share
    assert f"Nothing holds a load at {found.seconds:.2f} s: singular" in load_words(found)


def test_design_without_limits_has_no_shares_and_the_demand_says_so(services: Services) -> None:
    state = Go().apply(Set("paths.goal", GOAL).apply(opened(OPTIMAL)))
    shares = PathShares(services)
    assert shares.of(Frame(state)) is None
    assert shares.of(Frame(opened(PRESS))) is None
    assert not shares.is_limited(Frame(state))
    assert demand_note(state, is_limited=False) == ""
    for action in (Set("paths.kind", "planned"), Set("paths.holds_load", True)):
        state = action.apply(state)
    assert "every load is held" in demand_note(state, is_limited=False)
    assert demand_note(state, is_limited=True) == ""


# The chart


def test_chart_has_the_shares_the_limit_and_what_is_beyond(services: Services) -> None:
    found = shares_of(services, straight())
    top = top_of(found)
    assert top == pytest.approx(115.0 * found.largest.share)
    x, limit, share, beyond, now = columns_of(found, 3.0, top)
    assert (np.diff(x) >= 0.0).all()
    assert (limit == 100.0).all()
    assert share.max() == pytest.approx(100.0 * found.largest.share)
    assert x[share.argmax()] == pytest.approx(found.seconds)
    expected: FloatArray = np.interp(x, found.time, 100.0 * found.shares)
    np.testing.assert_allclose(share, expected, atol=0.1)
    np.testing.assert_array_equal(np.isfinite(beyond), share > 100.0)
    assert x[np.isfinite(now)].tolist() == [3.0, 3.0]
    assert sorted(now[np.isfinite(now)].tolist()) == [0.0, top]


def test_chart_of_singular_path_is_finite_and_goes_beyond_its_top(services: Services) -> None:
    found = shares_of(services, through_the_base())
    top = top_of(found)
    _, _, share, beyond, _ = columns_of(found, 0.0, top)
    assert np.isfinite(share).all()
    assert share.max() == np.nanmax(beyond) > 2.0 * top


def test_chart_is_there_for_designs_with_limits_alone(services: Services) -> None:
    plot = LoadPlot(services.gui, PathShares(services))
    for state, is_visible in ((opened(OPTIMAL), False), (opened(PRESS), True), (straight(), True)):
        updates = plot.updates(Frame(state))
        shown: dict[str, Any] = {
            name: value for h, name, value in updates if isinstance(h, viser.GuiUplotHandle)
        }
        assert shown["visible"] is is_visible
        assert np.isfinite(shown["data"][1]).all() == (state.journey is not None)


def test_switch_is_offered_for_planned_paths(services: Services, desk: Desk) -> None:
    panel = PathsPanel(services)

    def shown() -> dict[str, Any]:
        Assigner(services.server).assign(panel.updates(Frame(desk.state)))
        last = {widget.label: widget.handle for widget in widgets(services.server)}
        return {label: handle for label, handle in last.items() if handle.visible}

    assert "Hold the load" not in shown()
    desk.session.do(Set("paths.kind", "planned"))
    desk.use(shown()["Hold the load"], True)
    assert desk.state.paths.holds_load
