"""Starting and stopping the local server."""

from __future__ import annotations

import contextlib
import signal
import socket
import sys
import threading
import webbrowser
from collections.abc import Sequence
from dataclasses import dataclass
from pathlib import Path

import viser

from explorer.app.browser.viser_gaps import (
    ControlsOf,
    refuse_tunnels,
    start_viser,
    stop_viser,
    tell_uploads_to_their_senders,
)
from explorer.app.features.studies.folders import STUDIES_FOLDER, StudyFolders
from explorer.app.page import TITLE, Page
from explorer.app.security.access import EVERYWHERE, Access, is_loopback
from explorer.app.security.guard import Guard
from explorer.app.session.memory import given_back, keep_for_good, limit_arenas
from explorer.app.state.drawable import check_drawable
from explorer.app.state.state import opened
from explorer.app.storage.folder import data_folder
from explorer.app.storage.keeping import Keep, history_of, take_up
from explorer.app.storage.preferences import PreferenceFile
from explorer.errors import ExplorerError, ServerError
from explorer.mechanism.design import Design
from explorer.mechanism.design_file import PRESETS
from explorer.mechanism.pose import Pose
from explorer.numerics.compiled import warm_in_background

# Opens where there is no session to go on with.
FIRST_DESIGN = "paper-optimal"
# How soon an interruption is heard where it does not end a wait.
WAKE_SECONDS = 1.0


@dataclass(frozen=True)
class Running:
    """A running explorer.

    Attributes:
        viser: The server that the page is drawn on.
        page: The page.
        access: Who may come in.
    """

    viser: viser.ViserServer
    page: Page
    access: Access

    @property
    def url(self) -> str:
        """Where a browser on this machine finds it, with the token if there is one."""
        return self.access.url(self.viser.get_port())

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
    token: str | None = None,
    docked: bool = True,
    keep: Keep | None = None,
    preferences: PreferenceFile | None = None,
    studies: StudyFolders | None = None,
) -> Running:
    """Start an explorer in this process and return at once.

    Args:
        design: The manipulator to open, unless a session is gone on with.
        pose: In which to open it; its home pose if None.
        host: The address to listen on.
        port: The port to listen on; any free one if 0.
        token: What has to be known to get in; if None a random one is made, but none for
            a host that only this machine reaches.
        docked: Whether the panels lie beside the scene, rather than over it.
        keep: The user's designs, where the session is kept and with which to go on; None
            to keep nothing.
        preferences: Where theme and tour are remembered; None to be light and to begin no
            tour by itself.
        studies: Where design studies lie; None to offer none.

    Raises:
        InputError: the design or the pose is too large to be drawn.
        ServerError: the address or the port cannot be had, or the token cannot be used.
    """
    left = None if keep is None else keep.left
    state = opened(design, pose) if left is None else left.present
    check_drawable(state)
    access = Access.to(host, token)
    guard = Guard(access)
    _check_free(host, port)
    server = start_viser(host, port, guard.guarded)
    if port not in (0, server.get_port()):
        stop_viser(server)
        raise _taken(port)
    refuse_tunnels(server)
    tell_uploads_to_their_senders(server)
    history = None if left is None else history_of(left)
    page = Page(
        server,
        state,
        docked=docked,
        keep=keep,
        history=history,
        preferences=preferences,
        studies=studies,
    )
    guard.let_in(ControlsOf(server), lambda: page.session.waiting)
    return Running(server, page, access)


def serve(
    design: Design | None,
    *,
    host: str = "127.0.0.1",
    port: int = 8080,
    token: str | None = None,
    open_browser: bool = True,
    studies: Sequence[Path] = (),
) -> None:
    """Serve the explorer until it is interrupted; all that is done in it is kept.

    Args:
        design: The manipulator to open; None to go on with the session that was left last.
        host: The address to listen on.
        port: The port to listen on; any free one if 0.
        token: What has to be known to get in; if None a random one is made, but none for
            a host that only this machine reaches.
        open_browser: Whether to show the page in the user's browser.
        studies: Folders of results that the page offers beside those of the user's data.

    Raises:
        ServerError: the address or the port cannot be had, or the token cannot be used.
    """
    limit_arenas()
    keep = take_up(resume=design is None)
    for message in keep.messages:
        sys.stderr.write(f"{message}\n")
    opening = PRESETS[FIRST_DESIGN] if design is None else design
    try:
        running = start(
            opening,
            host=host,
            port=port,
            token=token,
            keep=keep,
            preferences=PreferenceFile(data_folder()),
            studies=StudyFolders(data_folder() / STUDIES_FOLDER, studies),
        )
    except ExplorerError:
        keep.store.close()
        raise
    if keep.left is not None:
        name = keep.left.present.design.name
        sys.stderr.write(f"Going on with {name!r} where it was left.\n")
    try:
        with contextlib.suppress(KeyboardInterrupt), given_back():
            _attend(running, open_browser)
        sys.stderr.write("Stopped.\n")
    finally:
        running.stop()


def _attend(running: Running, open_browser: bool) -> None:
    """Say where the page is, make ready what it needs, and wait for an interruption."""
    interrupted = _interruption()
    sys.stderr.write(f"{TITLE}: {running.url}   (Ctrl-C stops it)\n")
    access = running.access
    if not is_loopback(access.host):
        elsewhere = socket.gethostname() if access.host in EVERYWHERE else access.host
        sys.stderr.write(
            f"Listening on {access.host}: other machines open "
            f"{access.url(running.viser.get_port(), elsewhere)}; who has no token is refused. "
            "Nothing is encrypted.\n"
        )
    sys.stderr.flush()
    keep_for_good()
    warm_in_background(then=keep_for_good)
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
            if is_loopback(host) or "in use" in str(error):
                raise _taken(port) from None
            raise ServerError(f"cannot listen on {host!r}: {error.strerror}") from None


def _taken(port: int) -> ServerError:
    return ServerError(f"port {port} is taken; choose another with --port, or any free one with 0")
