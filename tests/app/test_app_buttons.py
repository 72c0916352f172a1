"""Buttons in markup: what the page sends of a press arrives, and nothing else does anything."""

from __future__ import annotations

import re
import threading
from collections.abc import Generator
from contextlib import closing

import pytest
import viser
from client import press_update, presses_in, wait_for
from desk import CLIENT
from socket_tab import SocketTab

from explorer.app import look
from explorer.app.server import Running, start
from explorer.app.session.session import UNDO
from explorer.app.state.compared import SLOTS
from explorer.app.widgets.buttons import LONGEST_VALUE, Buttons, press_button
from explorer.files.packaged import SOURCES
from explorer.mechanism.design_file import PRESETS

pytestmark = pytest.mark.usefixtures("idle_workers")


@pytest.fixture(scope="module")
def running() -> Generator[Running]:
    running = start(PRESETS["paper-optimal"], port=0)
    yield running
    running.stop()


@pytest.fixture(scope="module")
def tab(running: Running) -> Generator[SocketTab]:
    with closing(SocketTab(running.url)) as tab:
        wait_for(lambda: bool(running.viser.get_clients()))
        yield tab


def test_press_of_a_client_is_one_step(running: Running, tab: SocketTab) -> None:
    session = running.page.session
    tab.update(*press_update(running, "compare.pin"))
    wait_for(lambda: session.state.compared.pinned[0] is not None)
    number = session.history.step.number
    # The same press again is another press.
    for on in (True, False, True):
        tab.update(*press_update(running, "compare.turn", "Outlines"))
        wait_for(lambda on=on: session.state.compared.look.outlines is on)
    assert session.history.step.number == number + 3
    assert ("compare.open", SLOTS[0]) in presses_in(running)
    for _ in range(4):
        session.travel(UNDO)
    assert session.wait_until_idle()
    assert session.state.compared.is_empty


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
        ("compare.pin", "x" * (LONGEST_VALUE + 1)),
    ):
        tab.update(*press_update(running, name, value))
    for text in (
        "",
        "null",
        "[" * 2000,
        '{"name":"compare.pin","value":""}',
        '{"name":"compare.pin","value":1,"count":1}',
        '{"name":"compare.pin","value":"","count":-1}',
        '{"name":"compare.pin","value":"","count":1,"more":1}',
        '{"name":"compare.pin","value":"","count":1}' + " " * 100_000,
    ):
        tab.update(inbox, text)
    # Presses are handled in their order: once this one is done, so are the others.
    tab.update(*press_update(running, "compare.turn", "Outlines"))
    wait_for(lambda: session.state.compared.look.outlines)
    assert session.history.step.number == before + 1
    session.travel(UNDO)


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


def test_button_in_markup_is_escaped_and_labelled() -> None:
    html = press_button(
        "open", '"<b>', "Open", hint='"Open"', label="Open it", is_on=True, is_disabled=True
    )
    assert html == (
        '<button type="button" data-press="open" data-value="&quot;&lt;b&gt;" '
        'title="&quot;Open&quot;" aria-label="Open it" aria-pressed="true" disabled>Open</button>'
    )
    assert press_button("open", 3, "x") == (
        '<button type="button" data-press="open" data-value="3">x</button>'
    )


def test_every_class_of_the_markup_has_a_rule() -> None:
    sources = "".join(path.read_text("utf-8") for path in (SOURCES / "explorer/app").rglob("*.py"))
    used = set(re.findall(r"\bex-[a-z]+\b", sources))
    sheet = look.read_file("page.css")
    ruled = set(re.findall(r"\.(ex-[a-z]+)", sheet))
    variables = set(re.findall(r"--(ex-[a-z]+)", sheet))
    assert used <= ruled | variables
