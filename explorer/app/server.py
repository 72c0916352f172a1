"""Starting and stopping the local server."""

from __future__ import annotations

import contextlib
import gc
import signal
import socket
import sys
import threading
import webbrowser
from dataclasses import dataclass

import viser

from explorer.app.page import TITLE, Page
from explorer.app.state import opened
from explorer.app.viser_gaps import refuse_tunnels, start_viser, stop_viser
from explorer.compiled import warm_in_background
from explorer.design import Design
from explorer.errors import ServerError
from explorer.pose import Pose

# How soon an interruption is heard where it does not end a wait.
WAKE_SECONDS = 1.0
LOOPBACK = ("127.0.0.1", "localhost", "::1")


@dataclass(frozen=True)
class Running:
    """A running explorer.

    Attributes:
        viser: The server that the page is drawn on.
        page: The page.
        url: Where a browser on this machine finds it.
    """

    viser: viser.ViserServer
    page: Page
    url: str

    def stop(self) -> None:
        """Stop the server and the session."""
        self.page.stop()
        stop_viser(self.viser)


def start(
    design: Design,
    pose: Pose | None = None,
    *,
    host: str = "127.0.0.1",
    port: int = 8080,
    docked: bool = True,
) -> Running:
    """Start an explorer in this process and return at once.

    Args:
        design: The manipulator to open.
        pose: In which to open it; its home pose if None.
        host: The address to listen on.
        port: The port to listen on; any free one if 0.
        docked: Whether the panels lie beside the scene, rather than over it.

    Raises:
        ServerError: the address or the port cannot be had.
    """
    state = opened(design, pose)
    _check_free(host, port)
    server = start_viser(host, port)
    if port not in (0, server.get_port()):
        stop_viser(server)
        raise _taken(port)
    refuse_tunnels(server)
    page = Page(server, state, docked=docked)
    shown = "127.0.0.1" if host in ("0.0.0.0", "::") else host  # noqa: S104 - a comparison
    return Running(server, page, f"http://{shown}:{server.get_port()}")


def serve(
    design: Design,
    *,
    host: str = "127.0.0.1",
    port: int = 8080,
    open_browser: bool = True,
) -> None:
    """Serve the explorer until it is interrupted.

    Args:
        design: The manipulator to open.
        host: The address to listen on.
        port: The port to listen on; any free one if 0.
        open_browser: Whether to show the page in the user's browser.

    Raises:
        ServerError: the address or the port cannot be had.
    """
    running = start(design, host=host, port=port)
    try:
        with contextlib.suppress(KeyboardInterrupt):
            _attend(running, host, open_browser)
        sys.stderr.write("Stopped.\n")
    finally:
        running.stop()


def _attend(running: Running, host: str, open_browser: bool) -> None:
    """Say where the page is, make ready what it needs, and wait for an interruption."""
    interrupted = _interruption()
    sys.stderr.write(f"{TITLE}: {running.url}   (Ctrl-C stops it)\n")
    if host not in LOOPBACK:
        sys.stderr.write(
            f"Listening on {host}: whoever reaches this machine over the network can see and "
            "change what you do here, without a password.\n"
        )
    sys.stderr.flush()
    # What is there now stays; the collector need not look at it again in mid-drag.
    gc.collect()
    gc.freeze()
    warm_in_background()
    # One after the other, and what the page needs first.
    running.page.worker.start(then=running.page.optimiser.worker.start)
    if open_browser:
        threading.Thread(target=webbrowser.open, args=(running.url,), daemon=True).start()
    # Some systems hear of signals only between two waits.
    while not interrupted.wait(WAKE_SECONDS):
        pass


def _interruption() -> threading.Event:
    """Return what the first Ctrl-C sets; the next one interrupts as ever.

    Python would raise wherever it is, and what is raised while the collector or a finaliser
    runs is lost. Where nothing is to be interrupted, as in a background job, nothing changes.
    """
    asked = threading.Event()
    usual = signal.getsignal(signal.SIGINT)
    in_main = threading.current_thread() is threading.main_thread()
    if in_main and usual is signal.default_int_handler:

        def ask(*_: object) -> None:
            signal.signal(signal.SIGINT, usual)
            asked.set()

        signal.signal(signal.SIGINT, ask)
    return asked


def _check_free(host: str, port: int) -> None:
    # viser would move on to the next port without a word, and never return for a bad host.
    if not 0 <= port <= 65535:
        raise ServerError(f"a port lies between 0 and 65535; got {port}")
    try:
        family, kind, protocol, _, address = socket.getaddrinfo(
            host, port, type=socket.SOCK_STREAM, flags=socket.AI_PASSIVE
        )[0]
    except (OSError, UnicodeError):
        raise ServerError(f"no address for host {host!r}; this machine is 127.0.0.1") from None
    with socket.socket(family, kind, protocol) as trial:
        if sys.platform != "win32":
            trial.setsockopt(socket.SOL_SOCKET, socket.SO_REUSEADDR, 1)
        try:
            trial.bind(address)
        except PermissionError:
            raise ServerError(f"port {port} needs privileges; take one above 1023") from None
        except OSError as error:
            if host in LOOPBACK or "in use" in str(error):
                raise _taken(port) from None
            raise ServerError(f"cannot listen on {host!r}: {error.strerror}") from None


def _taken(port: int) -> ServerError:
    return ServerError(f"port {port} is taken; choose another with --port, or any free one with 0")
