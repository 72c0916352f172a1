"""The live page inside a notebook, and the state behind it from Python.

A frame of the notebook shows the page of a server on this machine. The notebook's browser must run
on this machine too, or reach the server through a tunnel, for instance by `ssh -L`.
"""

from __future__ import annotations

import atexit
import threading
import weakref
from html import escape
from typing import Self

from explorer.app.server import Running, start
from explorer.app.state.actions import Action, open_design
from explorer.app.state.moves import set_pose
from explorer.errors import InputError
from explorer.mechanism.design import Design
from explorer.mechanism.design_file import load_design
from explorer.mechanism.pose import Pose

LEAST_HEIGHT = 100
STYLE = "border:1px solid rgba(128,128,128,0.35);border-radius:4px"


class Shown:
    """A running explorer that a notebook displays in a frame, with its height in pixels.

    It ends with the last reference to it.
    """

    def __init__(self, running: Running, height: int) -> None:
        self._running = running
        self._height = height
        self._end = weakref.finalize(self, _end, running)
        # This runs before viser stops its servers at exit, which prints a message.
        self._end.atexit = False
        atexit.register(self._end)

    @property
    def url(self) -> str:
        """The address of the page for a browser on this machine."""
        return self._running.url

    @property
    def is_running(self) -> bool:
        """Whether the page is still served."""
        return self._end.alive

    @property
    def design(self) -> Design:
        """The design on the page; assigning a design, a preset or a file opens it in its home pose.

        Raises:
            DesignError: No such preset or file, or a file that holds no design.
            InputError: The explorer is stopped, or the design is being optimised.
        """
        self._check_running()
        return self._running.page.session.state.design

    @design.setter
    def design(self, design: Design | str) -> None:
        self._do(open_design(_as_design(design)))

    @property
    def pose(self) -> Pose:
        """The pose on the page; assigning one moves the platform there.

        Raises:
            InputError: The explorer is stopped.
        """
        self._check_running()
        return self._running.page.session.state.pose

    @pose.setter
    def pose(self, pose: Pose) -> None:
        self._do(set_pose(_as_pose(pose)))

    def stop(self) -> None:
        """Stop the server; the notebook shows the last picture until it is loaded again."""
        if self._end.detach() is not None:
            atexit.unregister(self._end)
            self._running.stop()

    def _do(self, action: Action) -> None:
        """Do an action; its errors are raised here rather than shown on the page."""
        self._check_running()
        session = self._running.page.session
        session.wait_until_idle()
        action.apply(session.state)
        session.do(action)
        session.wait_until_idle()

    def _check_running(self) -> None:
        if not self.is_running:
            raise InputError("this explorer is stopped; call explorer.show again")

    def __enter__(self) -> Self:
        return self

    def __exit__(self, *error: object) -> None:
        self.stop()

    def __repr__(self) -> str:
        if not self.is_running:
            return "Flagged 4-4 explorer, stopped"
        return f"Flagged 4-4 explorer of {self.design.name!r}: {self.url}"

    def _repr_html_(self) -> str:
        if not self.is_running:
            return f"<p>{escape(repr(self))}</p>"
        return (
            f'<iframe src="{escape(self.url)}" title="{escape(repr(self))}" width="100%" '
            f'height="{self._height}" style="{STYLE}"></iframe>'
        )


def show(
    design: Design | str = "paper-optimal",
    pose: Pose | None = None,
    *,
    height: int = 600,
    port: int = 0,
) -> Shown:
    """Serve the live page and return a handle that displays it inline in a notebook.

    In a plain Python shell nothing opens; the handle has the address of the page.

    Args:
        design: Manipulator to open: a design, the name of a preset, or a design file.
        pose: Pose to open it in; its home pose if None.
        height: Height of the frame in the notebook, in pixels.
        port: Port to listen on; any free one if 0.

    Raises:
        InputError: A height that is too small, or a design or pose that cannot be drawn.
        DesignError: No such preset or file, or a file that holds no design.
        ServerError: The port is not available.
    """
    if height < LEAST_HEIGHT:
        raise InputError(f"the height must be {LEAST_HEIGHT} pixels at least; got {height}")
    at = None if pose is None else _as_pose(pose)
    return Shown(start(_as_design(design), at, port=port), height)


def _as_design(given: object) -> Design:
    """Return a design from itself, the name of a preset or a file; errors are those of `show`."""
    if isinstance(given, str):
        return load_design(given)
    if not isinstance(given, Design):
        raise InputError(
            f"a design is an explorer.Design, the name of a preset or a file; got {given!r:.50}"
        )
    return given


def _as_pose(given: object) -> Pose:
    if not isinstance(given, Pose):
        raise InputError(f"a pose is an explorer.Pose; got {given!r:.50}")
    return given


def _end(running: Running) -> None:
    if not threading.main_thread().is_alive():
        # A Python that ends starts no more threads.
        running.stop()
        return
    # The garbage collector may run on a thread of this server, which cannot wait for itself.
    threading.Thread(target=running.stop, name="explorer stops", daemon=True).start()
