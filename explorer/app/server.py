"""Starting and stopping the local server."""

from __future__ import annotations

import contextlib
import ctypes
import logging
import socket
import sys
import threading
import webbrowser
from collections.abc import Sequence
from dataclasses import dataclass
from logging.handlers import RotatingFileHandler
from pathlib import Path

import viser

from explorer.app.features.requirement.state import Required
from explorer.app.features.studies.folders import STUDIES_FOLDER, StudyFolders
from explorer.app.page import TITLE, Page
from explorer.app.session.history import check_drawable
from explorer.app.state.parts import with_value
from explorer.app.state.state import open_state
from explorer.app.state.view import View
from explorer.app.storage.user_data import UserData, open_user_data
from explorer.errors import ExplorerError, ServerError, StorageError
from explorer.files.writing import make_folder
from explorer.mechanism.design import Design
from explorer.mechanism.design_file import PRESETS
from explorer.mechanism.pose import Pose
from explorer.numerics.compiled import warm_in_background
from explorer.numerics.interruption import Interruption
from explorer.page.browser.viser_server import protect, start_viser, stop_viser
from explorer.page.security import EVERYWHERE, Access, Guard, is_loopback
from explorer.page.storage.folder import data_folder

# Preset that is opened if there is no session to continue.
FIRST_DESIGN = "buildable"
LOG = "explorer.log"
"""Name of the log of unexpected errors in the user's data folder."""
# Size in bytes at which a new log is begun, and number of older ones that are kept.
LARGEST_LOG, OLDER_LOGS = 1_000_000, 2
# glibc's parameters M_ARENA_MAX and M_MMAP_THRESHOLD, with their values. The page has dozens of
# threads: with an arena for each few of them, and large arrays in these, free memory lies scattered
# between used one, and the process grows by a fifth within an hour of use.
ALLOCATOR = {-8: 2, -3: 131_072}
# Longest delay of an interruption, on systems where it does not end a wait.
WAKE_SECONDS = 1.0


@dataclass(frozen=True)
class Running:
    """A running explorer: the server of its page, the page, and the rule for who may connect."""

    viser: viser.ViserServer
    page: Page
    access: Access

    @property
    def url(self) -> str:
        """The address for a browser on this machine, with the token if there is one."""
        return self.access.url(self.viser.get_port())

    def stop(self) -> None:
        """Stop the server and the session."""
        self.page.stop()
        stop_viser(self.viser)


def start(
    design: Design,
    pose: Pose | None = None,
    *,
    view: View | None = None,
    host: str = "127.0.0.1",
    port: int = 8080,
    token: str | None = None,
    allow_hosts: Sequence[str] = (),
    panels: bool = True,
    user_data: UserData | None = None,
    tour: bool = False,
    studies: StudyFolders | None = None,
    required: Required | None = None,
) -> Running:
    """Start an explorer in this process and return at once.

    Args:
        design: The manipulator to open if no session is continued.
        pose: Pose in which to open it; its home pose if None.
        view: What to show; the usual if None.
        host: The address to listen on.
        port: The port to listen on; any free one if 0.
        token: What has to be known to get in; if None a random one is made, but none for
            a host that only this machine reaches, without a proxy.
        allow_hosts: Names of hosts by which a proxy passes requests on.
        panels: Whether there are panels beside the scene; else the scene is alone.
        user_data: The user's designs, where the session is saved and the history to continue;
            None to save nothing.
        tour: Whether the tour begins by itself in a browser that has not seen it.
        studies: Where design studies lie; None to offer none.
        required: The requirement of the form, and whether the design is checked against it;
            the usual one, not checked, if None.

    Raises:
        InputError: The design or the pose is too large to be drawn.
        ServerError: The address or the port cannot be had, or the token or a name cannot be used.
    """
    history = None if user_data is None else user_data.history
    opening = with_value(open_state(design, pose, view), Required.in_state, required or Required())
    state = opening if history is None else history.step.state
    check_drawable(state)
    access = Access(host, token, allow_hosts)
    guard = Guard(access)
    _check_free(host, port)
    server = start_viser(host, port, guard.guarded)
    if port not in (0, server.get_port()):
        stop_viser(server)
        raise _port_error(port)
    protect(server)
    page = Page(server, state, panels=panels, user_data=user_data, tour=tour, studies=studies)
    guard.let_in()
    return Running(server, page, access)


def serve(
    design: Design | None,
    *,
    host: str = "127.0.0.1",
    port: int = 8080,
    token: str | None = None,
    allow_hosts: Sequence[str] = (),
    open_browser: bool = True,
    studies: Sequence[Path] = (),
) -> None:
    """Serve the explorer until it is interrupted, and save the session.

    Args:
        design: The manipulator to open; None to continue the newest session.
        host: The address to listen on.
        port: The port to listen on; any free one if 0.
        token: As for `start`.
        allow_hosts: As for `start`.
        open_browser: Whether to show the page in the user's browser.
        studies: Folders of results that the page offers beside those of the user's data.

    Raises:
        ServerError: The address or the port cannot be had, or the token or a name cannot be used.
    """
    set_allocator()
    start_log(data_folder())
    user_data = open_user_data(resume=design is None)
    for message in user_data.messages:
        sys.stderr.write(f"{message}\n")
    opening = PRESETS[FIRST_DESIGN] if design is None else design
    # The requirement of the form is the one that gave the first design.
    required = Required(is_checked=design is None)
    try:
        running = start(
            opening,
            host=host,
            port=port,
            token=token,
            allow_hosts=allow_hosts,
            user_data=user_data,
            tour=True,
            studies=StudyFolders(data_folder() / STUDIES_FOLDER, studies),
            required=required,
        )
    except ExplorerError:
        user_data.store.close()
        raise
    if user_data.history is not None:
        name = user_data.history.step.state.design.name
        sys.stderr.write(f"Going on with {name!r} where it was left.\n")
    try:
        with contextlib.suppress(KeyboardInterrupt), Interruption() as interruption:
            _wait_for_interruption(running, open_browser, interruption)
        sys.stderr.write("Stopped.\n")
    finally:
        running.stop()


def set_allocator() -> None:
    """Make glibc, where it allocates the memory of this process, return what is free."""
    with contextlib.suppress(AttributeError, OSError, TypeError):
        library = ctypes.CDLL(None)
        for parameter, value in ALLOCATOR.items():
            library.mallopt(parameter, value)


def start_log(folder: Path) -> None:
    """Write all that is logged in this process into a file of a folder."""
    # Where the folder cannot be made, the first error to log is reported on standard error.
    with contextlib.suppress(StorageError):
        make_folder(folder)
    log = RotatingFileHandler(
        folder / LOG, maxBytes=LARGEST_LOG, backupCount=OLDER_LOGS, encoding="utf-8", delay=True
    )
    log.setFormatter(logging.Formatter("%(asctime)s %(name)s %(message)s"))
    logging.getLogger().addHandler(log)


def _wait_for_interruption(
    running: Running, open_browser: bool, interruption: Interruption
) -> None:
    """Print the address of the page, start what it needs, and wait for an interruption."""
    sys.stderr.write(f"{TITLE}: {running.url}   (Ctrl-C stops it)\n")
    access = running.access
    if not is_loopback(access.host):
        elsewhere = socket.gethostname() if access.host in EVERYWHERE else access.host
        sys.stderr.write(
            f"Listening on {access.host}: other machines open "
            f"{access.url(running.viser.get_port(), elsewhere)}; who has no token is refused. "
            "Nothing is encrypted.\n"
        )
    for name in access.names:
        url = f"https://{name}/?token={access.token}"
        sys.stderr.write(f"Through a proxy: {url}   (http if the proxy does not encrypt)\n")
    sys.stderr.flush()
    warm_in_background()
    running.page.start_workers()
    if open_browser:
        threading.Thread(target=webbrowser.open, args=(running.url,), daemon=True).start()
    # Some systems handle signals only between two waits.
    while not interruption.wait(WAKE_SECONDS):
        pass


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
                raise _port_error(port) from None
            raise ServerError(f"cannot listen on {host!r}: {error.strerror}") from None


def _port_error(port: int) -> ServerError:
    return ServerError(f"port {port} is taken; choose another with --port, or any free one with 0")
