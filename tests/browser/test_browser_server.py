"""The server without a browser: where it listens, what it refuses, how it ends."""

from __future__ import annotations

import re
import signal
import socket
import subprocess
import sys
import threading
import time
import urllib.request
from collections.abc import Callable, Generator, Iterator
from contextlib import closing, contextmanager
from typing import NoReturn

import msgspec
import pytest
import viser
from client import PROTOCOL, opened

from explorer.app import server as server_module
from explorer.app.browser.viser_server import start_viser
from explorer.app.security.guard import Serve
from explorer.app.server import Running, start
from explorer.errors import ServerError
from explorer.mechanism.design_file import PRESETS

DESIGN = PRESETS["paper-optimal"]
DESIGNED = ("--design", DESIGN.name)


@pytest.fixture
def taken() -> Iterator[int]:
    """A port on which somebody listens."""
    with socket.create_server(("127.0.0.1", 0)) as listener:
        yield listener.getsockname()[1]


def answers(host: str, port: int) -> bool:
    """Whether somebody accepts a connection there."""
    try:
        socket.create_connection((host, port), timeout=5.0).close()
    except OSError:
        return False
    return True


def other_address() -> str:
    """Return an address of this machine other than 127.0.0.1, as the network has one."""
    if sys.platform == "linux":
        return "127.0.0.2"
    return socket.gethostbyname(socket.gethostname())


def test_a_taken_port_is_an_error_of_one_line_and_starts_no_thread(
    taken: int, monkeypatch: pytest.MonkeyPatch
) -> None:
    started: list[threading.Thread] = []
    here, start_thread = threading.get_ident(), threading.Thread.start

    def recorded(thread: threading.Thread) -> None:
        # Explorers of other tests have threads that start others.
        if threading.get_ident() == here:
            started.append(thread)
        start_thread(thread)

    monkeypatch.setattr(threading.Thread, "start", recorded)
    with pytest.raises(ServerError, match=f"^port {taken} is taken; [^\n]*--port[^\n]*$"):
        start(DESIGN, port=taken)
    assert started == []


def test_a_port_that_is_taken_in_between_leaves_no_server(
    taken: int, monkeypatch: pytest.MonkeyPatch
) -> None:
    made: list[viser.ViserServer] = []

    def recorded(
        host: str, port: int, guarded: Callable[[Serve], Serve] | None
    ) -> viser.ViserServer:
        made.append(start_viser(host, port, guarded))
        return made[-1]

    def found_free(host: str, port: int) -> None:
        """Find the port free, as it was a moment ago."""

    monkeypatch.setattr(server_module, "_check_free", found_free)
    monkeypatch.setattr(server_module, "start_viser", recorded)
    with pytest.raises(ServerError, match=f"^port {taken} is taken"):
        start(DESIGN, port=taken)
    assert len(made) == 1
    assert not answers("127.0.0.1", made[0].get_port())


@pytest.mark.parametrize("host", ["no.such.host.invalid", "999.1.1.1", "a" * 300])
def test_an_unknown_host_is_an_error_of_one_line(host: str) -> None:
    with pytest.raises(ServerError, match=r"^no address for host [^\n]*$"):
        start(DESIGN, host=host, port=0)


def test_an_address_of_another_machine_is_an_error_of_one_line() -> None:
    # TEST-NET-1, which belongs to nobody.
    with pytest.raises(ServerError, match=r"^cannot listen on '192\.0\.2\.1': [^\n]*$"):
        start(DESIGN, host="192.0.2.1", port=0)


@pytest.mark.parametrize("port", [-1, 65536, 10**9])
def test_a_port_that_is_none_is_an_error(port: int) -> None:
    with pytest.raises(ServerError, match=f"between 0 and 65535; got {port}$"):
        start(DESIGN, port=port)


def test_unless_told_otherwise_only_this_machine_is_listened_to(running: Running) -> None:
    port = running.viser.get_port()
    assert running.url == f"http://127.0.0.1:{port}"
    assert answers("127.0.0.1", port)
    assert not answers(other_address(), port)


def test_told_to_listen_to_all_it_does() -> None:
    running = start(DESIGN, host="0.0.0.0", port=0)
    try:
        assert answers(other_address(), running.viser.get_port())
    finally:
        running.stop()


def ask_for_tunnel(url: str) -> None:
    """Send what viser's page sends when somebody pushes its share button."""
    with closing(opened(url)) as connection:
        assert connection.subprotocol == PROTOCOL
        connection.send(msgspec.msgpack.encode({"type": "ShareUrlRequest"}))


@pytest.mark.parametrize("is_ours", [False, True])
def test_a_request_for_a_public_tunnel_opens_none(
    monkeypatch: pytest.MonkeyPatch, capfd: pytest.CaptureFixture[str], is_ours: bool
) -> None:
    asked = threading.Event()

    def tunnel(*_: object) -> NoReturn:
        asked.set()
        raise OSError("no network")

    monkeypatch.setattr("viser._viser.ViserTunnel", tunnel)
    if is_ours:
        running = start(DESIGN, port=0)
        url, stop = running.url, running.stop
    else:
        # That the request is one: a bare viser server does what it says.
        bare = start_viser("127.0.0.1", 0)
        url, stop = f"http://127.0.0.1:{bare.get_port()}", bare.stop
    try:
        ask_for_tunnel(url)
        assert asked.wait(1.0 if is_ours else 30.0) is not is_ours
        # The bare server reports the failure when it is done with it: no later test must read it.
        deadline = time.monotonic() + 30.0
        while not is_ours and "no network" not in capfd.readouterr().err:
            assert time.monotonic() < deadline
            time.sleep(0.02)
    finally:
        stop()


@contextmanager
def serve(*argv: str) -> Generator[subprocess.Popen[str]]:
    """Run the command, and in the end make sure that it is gone."""
    with subprocess.Popen(
        # A design, since the session of another test would be told to go on.
        [sys.executable, "-m", "explorer", "serve", "--no-open", "--port", "0", *DESIGNED, *argv],
        stdout=subprocess.PIPE,
        stderr=subprocess.PIPE,
        encoding="utf-8",
    ) as process:
        try:
            yield process
        finally:
            process.kill()


@pytest.mark.parametrize("host", [None, "0.0.0.0"])
def test_serve_says_where_it_is_and_stops_quietly_when_interrupted(host: str | None) -> None:
    with serve(*([] if host is None else ["--host", host])) as process:
        assert process.stderr is not None
        said = process.stderr.readline()
        try:
            address = re.search(r"http://127\.0\.0\.1:\d+(/\?token=(?P<token>[\w-]+))?", said)
            assert address is not None, said
            with urllib.request.urlopen(address[0], timeout=30) as page:
                assert page.status == 200
                assert b"<html" in page.read()
            assert (host is None) == (address["token"] is None)
            if host is not None:
                token = address["token"]
                assert len(token) >= 32
                more = process.stderr.readline()
                assert more.startswith(f"Listening on {host}: other machines open http://")
                assert f"?token={token}; who has no token is refused." in more
        finally:
            process.send_signal(signal.SIGINT)
        out, rest = process.communicate(timeout=60)
    assert process.returncode in (0, 130)
    assert rest == "Stopped.\n"
    assert out == ""


@pytest.mark.parametrize("delay", [0.0, 0.03, 0.1, 0.3])
def test_an_interruption_is_heard_whenever_it_comes(delay: float) -> None:
    with serve() as process:
        assert process.stderr is not None
        process.stderr.readline()
        # The collector runs about now, and what is raised within it is lost.
        time.sleep(delay)
        process.send_signal(signal.SIGINT)
        _, rest = process.communicate(timeout=60)
    assert process.returncode in (0, 130)
    assert rest == "Stopped.\n"
