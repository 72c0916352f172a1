"""The server: where it listens, what it refuses, how it ends."""

from __future__ import annotations

import asyncio
import re
import signal
import socket
import subprocess
import sys
import threading
import time
import urllib.request
from collections.abc import Callable, Generator, Iterator
from contextlib import ExitStack, closing, contextmanager
from typing import Any, NoReturn

import pytest
import viser
from client import client_of, wait_for

from explorer.app import server as server_module
from explorer.app.server import Running, start
from explorer.errors import ServerError
from explorer.mechanism.design_file import PRESETS
from explorer.page.browser.viser_server import start_viser, stop_viser
from explorer.page.security import Serve

DESIGN = PRESETS["paper-optimal"]


@pytest.fixture
def taken_port() -> Iterator[int]:
    """A port on which somebody listens."""
    with socket.create_server(("127.0.0.1", 0)) as listener:
        yield listener.getsockname()[1]


def answers(host: str, port: int) -> bool:
    """Whether somebody accepts a connection there."""
    try:
        socket.create_connection((host, port), timeout=60.0).close()
    except OSError:
        return False
    return True


def other_address() -> str:
    """Return an address of this machine other than 127.0.0.1, as the network has one."""
    if sys.platform == "linux":
        return "127.0.0.2"
    return socket.gethostbyname(socket.gethostname())


def test_server_on_a_taken_port_is_refused_in_one_line_without_a_thread(
    taken_port: int, monkeypatch: pytest.MonkeyPatch
) -> None:
    threads: list[threading.Thread] = []
    here, start_thread = threading.get_ident(), threading.Thread.start

    def record(thread: threading.Thread) -> None:
        # Explorers of other tests have threads that start others.
        if threading.get_ident() == here:
            threads.append(thread)
        start_thread(thread)

    monkeypatch.setattr(threading.Thread, "start", record)
    with pytest.raises(ServerError, match=f"^port {taken_port} is taken; [^\n]*--port[^\n]*$"):
        start(DESIGN, port=taken_port)
    assert threads == []


def test_server_whose_port_is_taken_as_it_starts_is_stopped(
    monkeypatch: pytest.MonkeyPatch,
) -> None:
    servers: list[viser.ViserServer] = []
    with socket.create_server(("127.0.0.1", 0)) as free:
        wanted = free.getsockname()[1]

    def take_and_start(
        host: str, port: int, guarded: Callable[[Serve], Serve] | None
    ) -> viser.ViserServer:
        with socket.create_server((host, port)):
            servers.append(start_viser(host, port, guarded))
        return servers[-1]

    monkeypatch.setattr(server_module, "start_viser", take_and_start)
    with pytest.raises(ServerError, match=f"^port {wanted} is taken"):
        start(DESIGN, port=wanted)
    assert len(servers) == 1
    assert not answers("127.0.0.1", servers[0].get_port())


@pytest.mark.parametrize(
    ("host", "port", "reason"),
    [
        *(
            (host, 0, "^no address for host [^\n]*$")
            for host in ("no.such.host.invalid", "a" * 300)
        ),
        # An address of TEST-NET-1, which belongs to nobody.
        ("192.0.2.1", 0, r"^cannot listen on '192\.0\.2\.1': [^\n]*$"),
        ("127.0.0.1", -1, "between 0 and 65535; got -1$"),
        ("127.0.0.1", 65536, "between 0 and 65535; got 65536$"),
    ],
)
def test_server_at_an_impossible_address_is_refused_in_one_line(
    host: str, port: int, reason: str
) -> None:
    with pytest.raises(ServerError, match=reason):
        start(DESIGN, host=host, port=port)


def test_server_listens_to_this_machine_alone_unless_it_is_started_for_all(
    running: Running,
) -> None:
    port = running.viser.get_port()
    assert running.url == f"http://127.0.0.1:{port}"
    assert answers("127.0.0.1", port)
    assert not answers(other_address(), port)
    for_all = start(DESIGN, host="0.0.0.0", port=0)
    try:
        assert answers(other_address(), for_all.viser.get_port())
    finally:
        for_all.stop()


def test_server_asked_for_a_public_tunnel_opens_none(
    running: Running, monkeypatch: pytest.MonkeyPatch
) -> None:
    asked = threading.Event()

    def ask(*_: object) -> NoReturn:
        asked.set()
        raise OSError("no network")

    monkeypatch.setattr("viser._viser.ViserTunnel", ask)
    with client_of(running) as client:
        # What viser's page sends when somebody pushes its share button.
        client.send({"type": "ShareUrlRequest"})
        # The server reads in order.
        client.update(client.find("x"), 92.5)
        wait_for(lambda: running.page.session.state.pose.position[0] == 9.25)
    assert not asked.is_set()


@contextmanager
def serve(*arguments: str) -> Generator[subprocess.Popen[str]]:
    """Run the command, and in the end make sure that it is gone."""
    command = [sys.executable, "-m", "explorer", "serve", "--no-open", "--port", "0"]
    with subprocess.Popen(
        # With a design, since the session of another test would be resumed.
        [*command, "--design", DESIGN.name, *arguments],
        stdout=subprocess.PIPE,
        stderr=subprocess.PIPE,
        encoding="utf-8",
    ) as process:
        try:
            yield process
        finally:
            process.kill()


def assert_stops_quietly(process: subprocess.Popen[str], number: int = signal.SIGINT) -> None:
    process.send_signal(number)
    out, rest = process.communicate(timeout=60)
    assert process.returncode in (0, 130)
    assert (out, rest) == ("", "Stopped.\n")


def test_serve_for_all_says_where_it_is_and_stops_quietly_when_interrupted() -> None:
    with serve("--host", "0.0.0.0") as process:
        assert process.stderr is not None
        said = process.stderr.readline()
        address = re.search(r"http://127\.0\.0\.1:\d+/\?token=(?P<token>[\w-]+)", said)
        assert address is not None, said
        assert len(address["token"]) >= 32
        with urllib.request.urlopen(address[0], timeout=60) as page:
            assert page.status == 200
            assert b"<html" in page.read()
        more = process.stderr.readline()
        assert more.startswith("Listening on 0.0.0.0: other machines open http://")
        assert f"?token={address['token']}; who has no token is refused." in more
        assert_stops_quietly(process)


@pytest.mark.skipif(sys.platform == "win32", reason="there such signals end it at once")
def test_serve_that_is_interrupted_at_once_or_ended_by_the_system_stops_quietly() -> None:
    with ExitStack() as stack:
        # They start side by side.
        names = "SIGINT", "SIGTERM", "SIGHUP"
        processes = [stack.enter_context(serve()) for _ in names]
        for name, process in zip(names, processes, strict=True):
            assert process.stderr is not None
            assert re.search(r"http://127\.0\.0\.1:\d+(?!/\?token)", process.stderr.readline())
            assert_stops_quietly(process, getattr(signal, name))


# The collector runs soon after the start, and what is raised within it is lost.
@pytest.mark.long
@pytest.mark.parametrize("delay", [0.03, 0.1, 0.3])
def test_serve_interrupted_soon_stops_quietly(delay: float) -> None:
    with serve() as process:
        assert process.stderr is not None
        process.stderr.readline()
        time.sleep(delay)
        assert_stops_quietly(process)


def test_server_that_stops_leaves_no_connection_open() -> None:
    server = start_viser("127.0.0.1", 0)
    internals: Any = server
    loop = internals._websock_server._background_event_loop
    accepted: list[asyncio.BaseTransport] = []

    class Accepting(asyncio.Protocol):
        def connection_made(self, transport: asyncio.BaseTransport) -> None:
            accepted.append(transport)

    listening = loop.create_server(Accepting, "127.0.0.1", 0)
    listener = asyncio.run_coroutine_threadsafe(listening, loop).result(60.0)
    with closing(socket.create_connection(listener.sockets[0].getsockname())):
        wait_for(lambda: accepted)
        stop_viser(server)
        assert accepted[0].is_closing()
        assert loop.is_closed()
    listener.close()
