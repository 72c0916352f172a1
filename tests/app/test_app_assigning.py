"""What is assigned arrives to the last bit; figures left out come with the next frame."""

from __future__ import annotations

import time
from typing import Any

import numpy as np
import pytest
import viser
from client import client_of
from page_props import shown_by

from explorer.app.browser import viser_gaps
from explorer.app.browser.viser_gaps import PLACE
from explorer.app.features.mechanism.marks import DragHandle
from explorer.app.features.mechanism.pose_panel import JOINT_LABELS
from explorer.app.scene.placing import Placed
from explorer.app.server import Running
from explorer.app.session.session import Session
from explorer.app.state.actions import SetAngle, SetJoint, SetPosition
from explorer.app.state.frame import Frame
from explorer.app.widgets import assigning
from explorer.app.widgets.assigning import CROSSING_SECONDS, QUIET_SECONDS, Assigner

pytestmark = pytest.mark.usefixtures("idle_workers")


@pytest.mark.parametrize("size", [1e-12, 1.0, 1e6])
def test_nodes_follow_steps_that_are_small_beside_where_they_are(
    server: viser.ViserServer, size: float
) -> None:
    node, assigner = server.scene.add_frame(f"/follower{size}"), Assigner(server)
    rng = np.random.default_rng(1)
    position, wxyz = size * rng.normal(size=3), np.array([1.0, 0.0, 0.0, 0.0])
    for _ in range(5):
        position = position * (1.0 + 1e-7 * rng.normal(size=3))
        wxyz = wxyz + 1e-9 * rng.normal(size=4)
        updates = [(node, "position", position), (node, "wxyz", tuple(wxyz))]
        assert len(assigner.assign(updates)) == 2
        assert node.position.tolist() == position.tolist()
        assert node.wxyz.tolist() == wxyz.tolist()
        assert sent_place(server, node.name) == (position.tolist(), wxyz.tolist())
        assert assigner.assign(updates) == []


def test_value_that_a_user_sets_while_a_frame_is_computed_stays(server: viser.ViserServer) -> None:
    slider: Any = server.gui.add_slider("slider", min=0.0, max=10.0, step=0.1, initial_value=1.0)
    assigner, state = Assigner(server), slider._impl
    before = time.time()
    assert assigner.assign([(slider, "value", 2.0)], since=before)
    # As viser does when a browser tells it, for frames that began before, after, and before the
    # clock was set back.
    for set_at, began, expected in (
        (before, before - 1.0, 7.0),
        (before, time.time() + 1.0, 3.0),
        (before + 3600.0, before, 3.0),
    ):
        state.value, state.update_timestamp = 7.0, set_at
        assigner.assign([(slider, "value", 3.0)], since=began)
        assert slider.value == expected


@pytest.mark.parametrize("name", ["value", "position"])
def test_value_that_crossed_with_the_user_is_sent_again_when_the_user_rests(
    server: viser.ViserServer, monkeypatch: pytest.MonkeyPatch, name: str
) -> None:
    handle: Any
    if name == "value":
        handle = server.gui.add_slider("crossed", min=0.0, max=9.0, step=0.1, initial_value=1.0)
        first, second, state = 2.0, 7.0, handle._impl
    else:
        handle = server.scene.add_transform_controls("/crossed")
        first, second, state = (2.0, 0.0, 0.0), (7.0, 0.0, 0.0), handle._impl_aux
    assigner, sent, now = Assigner(server), list[object](), 1000.0
    monkeypatch.setattr(assigning.time, "time", lambda: now)

    def resend(handle: object, name: str) -> None:
        sent.append(getattr(handle, name))

    monkeypatch.setattr(assigning, "resend", resend)

    def draw(value: object, seconds: float) -> bool:
        nonlocal now
        now += seconds
        assigner.assign([(handle, name, np.array(value) if name in PLACE else value)])
        return assigner.settle()

    def use(value: object, seconds: float) -> None:
        nonlocal now
        now += seconds
        if name == "value":
            state.value, state.update_timestamp = value, now
            viser_gaps.resend(handle, name)
        else:
            state.last_updated, handle.position[:] = now, value

    # Nobody has touched it.
    assert not draw(first, 1.0)
    # A user did, before the browser can have shown that.
    use(second, 0.3)
    assert draw(second, 0.1)
    assert sent == []
    assert not draw(second, QUIET_SECONDS)
    np.testing.assert_array_equal(sent, [second])
    # Once is enough, unless that crosses too.
    assert not draw(second, 0.1)
    use(first, 0.1)
    assert draw(first, 0.1)
    assert not draw(first, QUIET_SECONDS)
    assert len(sent) == 2
    # What a user sets long after is what the browser shows.
    assert not draw(second, 1.0)
    use(first, CROSSING_SECONDS + 0.1)
    assert not draw(first, 2.0 * QUIET_SECONDS)
    assert len(sent) == 2


def test_value_that_a_user_sets_while_viser_sends_one_reaches_every_browser(
    server: viser.ViserServer, monkeypatch: pytest.MonkeyPatch
) -> None:
    gui: Any = server.gui
    slider = gui.add_slider("misled", min=0.0, max=9.0, step=0.1, initial_value=1.0)
    assigner, state, interface = Assigner(server), slider._impl, gui._websock_interface
    now, sent = 1000.0, list[float]()
    monkeypatch.setattr(assigning.time, "time", lambda: now)
    send = interface.queue_message

    def queue_message(message: Any) -> None:
        send(message)
        sent.append(message.updates["value"])
        if sent == [2.0]:
            # viser keeps a value after it has sent it: here a user comes in between.
            state.value, state.update_timestamp = 7.0, now
            viser_gaps.resend(slider, "value")

    monkeypatch.setattr(interface, "queue_message", queue_message)
    assigner.assign([(slider, "value", 2.0)])
    assert slider.value == 2.0
    assert sent == [2.0, 7.0]
    assert assigner.settle()
    # Once is enough.
    for _ in range(2):
        now += QUIET_SECONDS
        assert not assigner.settle()
        assert sent == [2.0, 7.0, 2.0]


def test_browser_that_crossed_with_the_explorer_shows_what_its_user_set(
    running: Running, monkeypatch: pytest.MonkeyPatch
) -> None:
    page = running.page
    # However slow the machine is, the browser's answer counts as one that crossed.
    monkeypatch.setattr(assigning, "CROSSING_SECONDS", 3600.0)
    with client_of(running) as client:
        uuid = client.find(JOINT_LABELS["l1"])
        values: list[float] = []

        def read_until(value: float) -> None:
            while values[-1:] != [value]:
                values.extend(
                    message["updates"]["value"]
                    for message in client.read()
                    if message.get("uuid") == uuid and "value" in message.get("updates", {})
                )

        # Told of one value, it sends another before it has shown that.
        page.session.do(SetJoint(0, 11.5))
        read_until(11.5)
        client.update(uuid, 12.5)
        read_until(12.5)
        assert page.session.state.joints[0] == 12.5


@pytest.mark.parametrize("step", [1e-9, 1e-7, 1.0])
def test_handle_follows_the_smallest_steps_of_the_pose(running: Running, step: float) -> None:
    page, handle = running.page, running.page.services.get(DragHandle).handle
    for action in (
        SetPosition(0, 9.0),
        SetAngle(0, 20.0),
        SetPosition(0, 9.0 + step),
        SetAngle(0, 20.0 + step),
    ):
        page.session.do(action)
        assert page.session.wait_until_idle()
        placed = Placed(Frame(page.session.state))
        assert handle.position.tolist() == placed.points["b4"].tolist()
        assert tuple(handle.wxyz) == page.session.state.pose.quaternion


def test_panels_that_a_drag_leaves_no_time_for_are_drawn_with_the_next_frame(
    running: Running, monkeypatch: pytest.MonkeyPatch
) -> None:
    session = running.page.session

    def controls() -> dict[str, object]:
        assert session.wait_until_idle()
        return {key: value for key, value in shown_by(running).items() if not key.startswith("/")}

    before = controls()
    with monkeypatch.context() as drag:
        drag.setattr(Session, "has_more", property(lambda _: True))
        drag.setattr("explorer.app.page.PANELS_SECONDS", np.inf)
        session.do(SetPosition(0, 1.5))
        assert controls() == before
    session.redraw()
    after = controls()
    assert after != before
    session.redraw()
    assert controls() == after


def sent_place(server: viser.ViserServer, name: str) -> tuple[list[float], list[float]]:
    """Return position and orientation that a browser would get that comes now."""
    found: dict[str, list[float]] = {}
    serializer: Any = server.get_scene_serializer()
    for _, message in serializer._messages:
        if message.get("name") == name:
            found |= {key: list(message[key]) for key in ("position", "wxyz") if key in message}
    return found["position"], found["wxyz"]
