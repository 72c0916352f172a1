"""What is assigned arrives to the last bit; figures left out come with the next frame."""

from __future__ import annotations

import time
from typing import Any

import numpy as np
import pytest
import viser
from client import client_of
from monkey import explorer_with_data
from page_props import shown_by

from explorer.app.browser import viser_gaps
from explorer.app.browser.viser_gaps import PLACE
from explorer.app.features.mechanism.marks import DragHandle
from explorer.app.features.mechanism.pose_panel import JOINT_LABELS
from explorer.app.scene.placing import Placed
from explorer.app.session.session import Session
from explorer.app.state.actions import SetAngle, SetJoint, SetPosition
from explorer.app.state.frame import Frame
from explorer.app.widgets import assigning
from explorer.app.widgets.assigning import CROSSING_SECONDS, QUIET_SECONDS, Assigner


@pytest.mark.parametrize("size", [1e-12, 1e-6, 1.0, 1e6])
def test_nodes_follow_steps_that_are_small_beside_where_they_are(
    server: viser.ViserServer, size: float
) -> None:
    node, assigner = server.scene.add_frame(f"/follower{size}"), Assigner(server)
    rng = np.random.default_rng(1)
    position, wxyz = size * rng.normal(size=3), np.array([1.0, 0.0, 0.0, 0.0])
    for _ in range(50):
        position = position * (1.0 + 1e-7 * rng.normal(size=3))
        wxyz = wxyz + 1e-9 * rng.normal(size=4)
        updates = [(node, "position", position), (node, "wxyz", tuple(wxyz))]
        assert len(assigner.assign(updates)) == 2
        assert node.position.tolist() == position.tolist()
        assert node.wxyz.tolist() == wxyz.tolist()
        assert _sent(server, node.name) == (position.tolist(), wxyz.tolist())
        assert assigner.assign(updates) == []


def test_what_a_hand_sets_while_a_frame_is_computed_stays(server: viser.ViserServer) -> None:
    slider: Any = server.gui.add_slider("hand", min=0.0, max=10.0, step=0.1, initial_value=1.0)
    assigner, state = Assigner(server), slider._impl
    before = time.time()
    assert assigner.assign([(slider, "value", 2.0)], since=time.time())
    assert slider.value == 2.0
    # So long ago that even a coarse clock has gone on since.
    began = time.time() - 1.0
    # As viser does when a browser tells it.
    state.value, state.update_timestamp = 7.0, time.time()
    assert assigner.assign([(slider, "value", 3.0)], since=began) == []
    assert slider.value == 7.0
    # The next frame knows of it, and may say no.
    assert assigner.assign([(slider, "value", 3.0)], since=time.time())
    assert slider.value == 3.0
    # Before the clock was set back, it was later.
    state.value, state.update_timestamp = 7.0, time.time() + 3600.0
    assert assigner.assign([(slider, "value", 3.0)], since=before)
    assert slider.value == 3.0


@pytest.mark.parametrize("name", ["value", "position"])
def test_what_crossed_with_a_hand_is_told_again_when_it_rests(
    server: viser.ViserServer, monkeypatch: pytest.MonkeyPatch, name: str
) -> None:
    handle: Any
    if name == "value":
        handle = server.gui.add_slider("crossed", min=0.0, max=9.0, step=0.1, initial_value=1.0)
        values, state = (2.0, 7.0), handle._impl
    else:
        handle = server.scene.add_transform_controls("/crossed")
        values, state = ((2.0, 0.0, 0.0), (7.0, 0.0, 0.0)), handle._impl_aux
    assigner, told, now = Assigner(server), list[object](), 1000.0
    monkeypatch.setattr(assigning.time, "time", lambda: now)

    def resend(handle: object, name: str) -> None:
        told.append(getattr(handle, name))

    monkeypatch.setattr(assigning, "resend", resend)

    def frame(value: object, seconds: float) -> bool:
        nonlocal now
        now += seconds
        assigner.assign([(handle, name, np.array(value) if name in PLACE else value)])
        return assigner.settle()

    def hand(value: object, seconds: float) -> None:
        nonlocal now
        now += seconds
        if name == "value":
            state.value, state.update_timestamp = value, now
            viser_gaps.resend(handle, name)
        else:
            state.last_updated, handle.position[:] = now, value

    first, second = values
    # Nobody has touched it.
    assert not frame(first, 1.0)
    # A hand did, before it can have seen that.
    hand(second, 0.3)
    assert frame(second, 0.1)
    assert told == []
    assert not frame(second, QUIET_SECONDS)
    np.testing.assert_array_equal(told, [second])
    # Once is enough, unless that crosses too.
    assert not frame(second, 0.1)
    hand(first, 0.1)
    assert frame(first, 0.1)
    assert not frame(first, QUIET_SECONDS)
    assert len(told) == 2
    # What a hand sets long after is what it shows.
    assert not frame(second, 1.0)
    hand(first, CROSSING_SECONDS + 0.1)
    assert not frame(first, 2.0 * QUIET_SECONDS)
    assert len(told) == 2


def test_what_a_hand_sets_while_viser_takes_a_value_misleads_no_browser(
    server: viser.ViserServer, monkeypatch: pytest.MonkeyPatch
) -> None:
    gui: Any = server.gui
    slider = gui.add_slider("misled", min=0.0, max=9.0, step=0.1, initial_value=1.0)
    assigner, state, interface = Assigner(server), slider._impl, gui._websock_interface
    now, told = 1000.0, list[float]()
    monkeypatch.setattr(assigning.time, "time", lambda: now)
    tell = interface.queue_message

    def queue_message(message: Any) -> None:
        tell(message)
        told.append(message.updates["value"])
        if told == [2.0]:
            # viser holds a value after it has told of it: here a hand comes in between.
            state.value, state.update_timestamp = 7.0, now
            viser_gaps.resend(slider, "value")

    monkeypatch.setattr(interface, "queue_message", queue_message)
    assigner.assign([(slider, "value", 2.0)])
    assert slider.value == 2.0
    assert told == [2.0, 7.0]
    assert assigner.settle()
    now += QUIET_SECONDS
    assert not assigner.settle()
    assert told == [2.0, 7.0, 2.0]
    # Once is enough.
    now += QUIET_SECONDS
    assert not assigner.settle()
    assert len(told) == 3


def test_a_browser_that_crossed_with_the_explorer_shows_what_its_user_set() -> None:
    with explorer_with_data() as running, client_of(running) as client:
        client.read_until_quiet()
        uuid = client.find(JOINT_LABELS["l1"])
        # Told of one value, it sends another before it has read that.
        running.page.session.do(SetJoint(0, 11.5))
        running.page.wait_until_drawn()
        time.sleep(0.2)
        client.update(uuid, 12.5)
        values: list[float] = []
        while values[-1:] != [12.5]:
            values += [
                message["updates"]["value"]
                for message in client.read()
                if message.get("uuid") == uuid and "value" in message.get("updates", {})
            ]
        assert values[0] == 11.5
        assert values[-1] == 12.5
        assert running.page.session.state.joints[0] == 12.5


@pytest.mark.parametrize("step", [1e-9, 1e-7, 1.0])
def test_the_gizmo_follows_the_smallest_steps_of_the_pose(step: float) -> None:
    with explorer_with_data() as running:
        page, gizmo = running.page, running.page.services.get(DragHandle)
        page.session.do(SetPosition(0, 9.0))
        page.session.do(SetAngle(0, 20.0))
        page.wait_until_drawn()
        for action in (SetPosition(0, 9.0 + step), SetAngle(0, 20.0 + step)):
            page.session.do(action)
            page.wait_until_drawn()
            placed, handle = Placed(Frame(page.session.state)), gizmo.handle
            assert handle.position.tolist() == placed.points["b4"].tolist()
            assert tuple(handle.wxyz) == page.session.state.pose.quaternion


def test_figures_that_a_hand_leaves_no_time_for_come_with_the_next_frame(
    monkeypatch: pytest.MonkeyPatch,
) -> None:
    def controls() -> dict[str, object]:
        return {key: value for key, value in shown_by(running).items() if not key.startswith("/")}

    with explorer_with_data() as running:
        page = running.page
        page.wait_until_drawn()
        before = controls()
        with monkeypatch.context() as hand:
            hand.setattr(Session, "has_more", property(lambda _: True))
            hand.setattr("explorer.app.page.PANELS_SECONDS", np.inf)
            page.session.do(SetPosition(0, 1.5))
            page.wait_until_drawn()
            assert controls() == before
        page.session.redraw()
        page.wait_until_drawn()
        after = controls()
        page.session.redraw()
        page.wait_until_drawn()
        assert after != before
        assert controls() == after


def _sent(server: viser.ViserServer, name: str) -> tuple[list[float], list[float]]:
    """Return position and orientation that a browser would get that comes now."""
    found: dict[str, list[float]] = {}
    serializer: Any = server.get_scene_serializer()
    for _, message in serializer._messages:
        if message.get("name") == name:
            found.update(
                {key: list(message[key]) for key in ("position", "wxyz") if key in message}
            )
    return found["position"], found["wxyz"]
