"""Values and presses of buttons in markup arrive; a tab has one filled button at most."""

from __future__ import annotations

import asyncio
import re
import threading
import time
from collections.abc import Generator
from contextlib import closing
from html import escape
from typing import Any, get_args

import numpy as np
import pytest
import viser
from client import (
    PATIENCE_SECONDS,
    client_of,
    press_update,
    presses_in,
    wait_for,
    wait_until_heard,
)
from desk import CLIENT
from page_props import shown_by
from sample_states import iterates_of
from server_clock import settle
from socket_tab import SocketTab

from explorer.app.features.compare.work import SLOTS, Compared
from explorer.app.features.optimise import runner
from explorer.app.features.optimise.actions import start_run
from explorer.app.features.optimise.state import Optimisation, OptimisationRequest, SearchResult
from explorer.app.features.paths.actions import go, play
from explorer.app.features.paths.state import journey_of
from explorer.app.features.studies.state import Studies
from explorer.app.features.view.feature import FORMS
from explorer.app.inputs.controls import MAIN
from explorer.app.server import Running
from explorer.app.session.session import UNDO, Session
from explorer.app.state.actions import Set, open_design
from explorer.app.state.moves import go_home, set_joint, set_position
from explorer.app.widgets.buttons import Buttons, extra_button, press_button
from explorer.files.extras import EXTRAS, LINUX_ALONE, install_command
from explorer.files.packaged import SOURCES
from explorer.measures.blocks.block import Look
from explorer.mechanism.design_file import PRESETS
from explorer.page import look
from explorer.page.widgets import assigning
from explorer.page.widgets.assigning import Assigner

pytestmark = pytest.mark.usefixtures("idle_jobs")

FILLED = "is-main"
# Of files with classes of the stylesheet.
SUFFIXES = (".py", ".js", ".svg")
ENDLESS = OptimisationRequest(objective="smallest-reach", volume=7053.0, starts=10_000)


@pytest.fixture(scope="module")
def tab(running: Running) -> Generator[SocketTab]:
    with closing(SocketTab(running.url)) as tab:
        wait_for(lambda: bool(running.viser.get_clients()))
        yield tab


def test_press_of_a_client_is_one_step(running: Running, tab: SocketTab) -> None:
    session = running.page.session
    tab.update(*press_update(running, "compare.pin"))
    wait_for(lambda: Compared.of(session.state).pinned[0] is not None)
    number = session.history.step.number
    # The same press again is another press.
    for on in (True, False, True):
        tab.update(*press_update(running, "compare.turn", "Outlines"))
        wait_for(lambda on=on: Compared.of(session.state).look.outlines is on)
    assert session.history.step.number == number + 3
    assert session.wait_until_idle()
    assert ("compare.open", SLOTS[0]) in presses_in(running)
    for _ in range(4):
        session.do(UNDO)
    assert session.wait_until_idle()
    assert Compared.of(session.state).is_empty


def test_form_of_the_mechanism_is_chosen_by_a_press_and_given_up_by_another(
    running: Running, tab: SocketTab
) -> None:
    session = running.page.session
    # A press on the form that is drawn goes back to the schematic.
    for form, drawn in [*((form, form) for form in FORMS), ("6-4 twin", "schematic")]:
        tab.update(*press_update(running, "view.form", form))
        wait_for(lambda drawn=drawn: session.state.view.drawn_as == drawn)


@pytest.mark.parametrize("extra", EXTRAS)
def test_button_of_a_missing_library_says_what_needs_it_and_copies_the_command(
    extra: str, monkeypatch: pytest.MonkeyPatch
) -> None:
    html = extra_button(extra)
    assert f'data-value="{extra}"' in html
    for words in (EXTRAS[extra][0][1:], escape(install_command(extra))):
        assert words in html
    # No button where there is nothing to install.
    monkeypatch.setattr("sys.platform", "win32")
    assert ("<button" in extra_button(extra)) == (extra not in LINUX_ALONE)


def test_press_that_nothing_offers_does_nothing(running: Running, tab: SocketTab) -> None:
    session = running.page.session
    before = session.history.step.number
    inbox, _ = press_update(running, "compare.pin")
    for name, value in (
        ("compare.gone", ""),
        ("compare.open", "D"),
        ("compare.turn", "../../x"),
        ("history.go", "-1"),
        ("history.go", "9" * 4000),
        ("strata.go", "5678"),
        ("tour", "Next"),
        ("x" * 101, ""),
    ):
        tab.update(*press_update(running, name, value))
    for text in (
        "",
        "null",
        "[" * 2000,
        '{"name":"compare.pin","value":""}',
        '{"name":"compare.pin","value":1,"count":1}',
        '{"name":"compare.pin","value":"","count":1,"more":1}',
    ):
        tab.update(inbox, text)
    # Presses are handled in their order: once this one is done, so are the others.
    tab.update(*press_update(running, "compare.turn", "Outlines"))
    wait_for(lambda: Compared.of(session.state).look.outlines)
    assert session.history.step.number == before + 1
    session.do(UNDO)


def test_presses_of_one_client_are_handled_in_their_order(server: viser.ViserServer) -> None:
    buttons, handled, last = Buttons(server), list[str](), threading.Event()

    def handle(value: str, _: viser.ClientHandle) -> None:
        if value == "first":
            last.wait(60.0)
        handled.append(value)

    buttons.on("press", handle)
    with pytest.raises(ValueError, match="two buttons"):
        buttons.on("press", handle)
    for count, value in enumerate(("first", "second", "last")):
        buttons.receive(f'{{"name":"press","value":"{value}","count":{count}}}', CLIENT)
    last.set()
    wait_for(lambda: len(handled) == 3)
    assert handled == ["first", "second", "last"]
    buttons.stop()
    buttons.receive('{"name":"press","value":"late","count":9}', CLIENT)
    assert "late" not in handled


def test_button_in_markup_is_escaped() -> None:
    html = press_button("open", '"<b>', "Open", hint='"Open"', label='"Open')
    assert 'data-value="&quot;&lt;b&gt;" title="&quot;Open&quot;" aria-label="&quot;Open"' in html


def test_every_class_of_the_markup_has_a_rule_and_every_rule_a_class() -> None:
    rooms = [SOURCES / "explorer" / room for room in ("page", "app")]
    paths = [path for room in rooms for path in room.rglob("*") if path.suffix in SUFFIXES]
    sources = "".join(path.read_text("utf-8") for path in paths)
    used = set(re.findall(r"\b(?<!data-)ex-[a-z]+(?:-[a-z]+)*\b", sources))
    sheet = look.read_file("page.css")
    ruled = set(re.findall(r"\.(ex-[a-z]+(?:-[a-z]+)*)", sheet))
    variables = set(re.findall(r"--(ex-[a-z]+(?:-[a-z]+)*)", sheet))
    looks = {f"ex-{each}" for each in get_args(Look)}
    start = set(re.findall(r"\.(ex-[a-z]+)", look.read_file("start.css")))
    assert used <= ruled | variables | start
    assert ruled <= used | looks


def filled_by_place(running: Running) -> dict[str, list[str]]:
    """Return the words or markup of the filled buttons that a browser sees in each tab and dialog.

    Those of the bar, which is in none, are that of an empty name.
    """
    with client_of(running) as client:
        client.read_all_sent(running)
        controls = client.controls
    titles: dict[str, str] = {}
    for props in controls.values():
        titles |= zip(
            props.get("_tab_container_ids", ()), props.get("_tab_labels", ()), strict=True
        )
    found: dict[str, list[str]] = {title: [] for title in ("", *titles.values())}
    for props in controls.values():
        filled = [FILLED] * str(props.get("content")).count(FILLED)
        if props.get("color") == MAIN and not props["disabled"]:
            filled.append(props["label"])
        place = props
        while place["visible"] and place.get("container_uuid") in controls:
            place = controls[place["container_uuid"]]
        if place["visible"]:
            found[titles.get(place.get("container_uuid", ""), "")] += filled
    return found


def check_filled(running: Running, *expected: str) -> None:
    """Check that no place has two filled buttons, and that the expected ones have one."""
    assert running.page.session.wait_until_idle()
    found = filled_by_place(running)
    assert {"Pose", "Optimise", "Export", "Designs"} <= found.keys()
    assert {place: each for place, each in found.items() if len(each) > 1} == {}
    assert {place for place in expected if not found[place]} == set()


def test_each_tab_has_one_filled_button_at_most(running: Running) -> None:
    session, buttons = running.page.session, running.page.buttons
    check_filled(running, "Optimise", "Paths", "Studies")
    session.do(set_joint(0, 200.0))
    check_filled(running, "Pose")
    session.do(open_design(PRESETS["paper-optimal"]))
    buttons.press("compare.pin", "", CLIENT)
    wait_for(lambda: not Compared.of(session.state).is_empty)
    check_filled(running, "Compare")
    buttons.press("studies.start", "", CLIENT)
    wait_for(lambda: Studies.of(session.state).name is not None)
    check_filled(running)
    session.do(go())
    wait_for(lambda: journey_of(session.state) is not None)
    # The page does not come to rest while the path is played.
    session.do(play(False))
    check_filled(running, "Paths")
    session.do(open_design(PRESETS["paper-optimal"]))


def test_search_and_its_answer_leave_one_filled_button_at_most(
    running: Running, monkeypatch: pytest.MonkeyPatch
) -> None:
    # No iterate is drawn, so that the page comes to rest during the search.
    monkeypatch.setattr(runner, "PACE", 600.0)
    session = running.page.session
    session.do(Set("optimisation.request", ENDLESS))
    session.do(start_run())
    wait_for(lambda: Optimisation.of(session.state).is_on)
    check_filled(running)
    running.page.buttons.press("optimise.cancel", "", CLIENT)
    wait_for(lambda: not Optimisation.of(session.state).is_on)
    check_filled(running)
    (best,) = iterates_of(session.state, 1)
    session.do(Set("optimisation.run.verdict", SearchResult("converged", "", best)))
    check_filled(running, "Optimise")


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


@pytest.mark.parametrize("seconds", [3600.0, -1.0])
def test_browser_is_told_again_once_of_what_crossed_with_its_user_and_of_nothing_else(
    running: Running, monkeypatch: pytest.MonkeyPatch, seconds: float
) -> None:
    page, session = running.page, running.page.session
    # However slow the machine is, the browser's answer counts as one that crossed, or as none.
    monkeypatch.setattr(assigning, "CROSSING_SECONDS", seconds)
    session.do(go_home())
    with client_of(running) as client:
        slider = client.find("x")

        def told() -> tuple[list[float], list[list[float]]]:
            """Return what the browser is told of the slider and of the gizmo, once all rests."""
            assert settle(page, PATIENCE_SECONDS)
            messages = client.read_all_sent(running)
            of_slider = [m["updates"] for m in messages if m.get("uuid") == slider]
            of_gizmo = [m for m in messages if m.get("name") == "/handle"]
            values = [each["value"] for each in of_slider if "value" in each]
            return values, [list(each["position"]) for each in of_gizmo if "position" in each]

        told()
        session.do(set_position(0, 11.5))
        values, places = told()
        assert values == [115.0]
        (place,) = places
        # Told of one value, it sends another before it has shown that.
        client.update(slider, 125.0)
        wait_until_heard(running, client)
        values, places = told()
        assert values == [125.0] * (seconds > 0.0)
        assert session.state.position[0] == 12.5
        (place,) = places
        moved = [place[0] + 1.5, *place[1:]]
        gizmo = {"type": "TransformControlsUpdateMessage", "name": "/handle", "owner": ""}
        client.send(gizmo | {"position": moved, "wxyz": session.state.pose.quaternion})
        wait_until_heard(running, client)
        values, places = told()
        assert places == [moved] * (seconds > 0.0)
        assert session.state.position[0] > 12.5


def test_panels_that_a_drag_leaves_no_time_for_are_drawn_with_the_next_frame(
    running: Running, monkeypatch: pytest.MonkeyPatch
) -> None:
    session = running.page.session

    def controls() -> dict[str, object]:
        assert session.wait_until_idle()
        return {key: value for key, value in shown_by(running).items() if not key.startswith("/")}

    with monkeypatch.context() as drag:
        drag.setattr(Session, "has_changes", property(lambda _: True))
        drag.setattr("explorer.app.page.PANELS_SECONDS", -1.0)
        before = controls()
        session.do(set_position(0, 1.5))
        assert controls() == before
    session.redraw()
    assert controls() != before


def sent_place(server: viser.ViserServer, name: str) -> tuple[list[float], list[float]]:
    """Return position and orientation that a browser would get that comes now."""
    found: dict[str, list[float]] = {}
    serializer: Any = server.get_scene_serializer()
    for _, message in serializer._messages:
        if message.get("name") == name:
            found |= {key: list(message[key]) for key in ("position", "wxyz") if key in message}
    return found["position"], found["wxyz"]


def test_message_sent_as_a_tab_begins_to_wait_wakes_it(server: viser.ViserServer) -> None:
    internals: Any = server
    buffer = internals._websock_server.get_message_buffer()
    loop: asyncio.AbstractEventLoop = buffer.event_loop
    plain = loop.create_future

    def create_future() -> asyncio.Future[Any]:
        # Who waits has seen that nothing is there, and cannot be woken yet.
        del loop.create_future
        sender = threading.Thread(target=lambda: server.scene.add_frame("/sent"))
        sender.start()
        sender.join()
        return plain()

    async def wait() -> bool:
        # What woke the loop before this has been done by now.
        buffer.message_event.clear()
        loop.create_future = create_future  # type: ignore[method-assign]
        return await buffer.message_event.wait()

    assert asyncio.run_coroutine_threadsafe(wait(), loop).result(60.0)
