"""What a page offers its features, without a page: for tests of panels, feeds and scene parts."""

from __future__ import annotations

import pickle
from collections.abc import Callable
from types import SimpleNamespace
from typing import Any, NamedTuple

import viser

from explorer.app.features.feature import Feature, Services
from explorer.app.session.session import Session, Who
from explorer.app.storage.user_data import UserData
from explorer.app.widgets.buttons import Buttons
from explorer.app.widgets.downloads import Downloads, File
from explorer.errors import ExplorerError
from explorer.jobs.jobs import Jobs, LongJob
from explorer.jobs.process import Call
from explorer.page.widgets.palette import Commands


def _ignore(message: str, who: Who) -> None:
    del message, who


class StubOrder(NamedTuple):
    """An order of `StubJobs`: its key, task and arguments, and how it is answered."""

    key: object
    task: Callable[..., Any]
    arguments: tuple[Any, ...]
    done: Callable[[Any], None]
    failed: Callable[[str], None]

    @property
    def request(self) -> Any:
        """The first argument."""
        return self.arguments[0]


class StubJobs(Jobs):
    """Jobs that start no process: they keep their orders and execute them in `work`.

    Args:
        at_once: Whether an order is executed when it is given.
        real: Names of processes that are started all the same.
    """

    def __init__(self, *, at_once: bool = False, real: tuple[str, ...] = ()) -> None:
        super().__init__(lambda _: None)
        self._real = real
        self.orders: list[StubOrder] = []
        self._at_once = at_once
        self._waiting: list[Callable[[], None]] = []

    def start(
        self,
        task: Callable[..., Any],
        arguments: tuple[Any, ...],
        done: Callable[[Any], None] = lambda _: None,
        failed: Callable[[str], None] = lambda _: None,
        receive: Callable[[Any], None] | None = None,
        **more: Any,
    ) -> LongJob:
        if more.get("process") in self._real:
            return super().start(task, arguments, done, failed, receive, **more)
        self.orders.append(StubOrder(more.get("key"), task, arguments, done, failed))

        def execute() -> None:
            try:
                # Arguments and results cross the border of a process.
                result = _sent(task(*_sent(arguments)))
            except ExplorerError as error:
                failed(str(error))
            else:
                done(result)

        self._waiting.append(execute)
        if self._at_once:
            self.work()
        return LongJob(Call(task, arguments, {}, is_sending=False), receive, None)

    def work(self) -> None:
        """Execute the orders that wait."""
        while self._waiting:
            self._waiting.pop(0)()


class StubDownloads(Downloads):
    """Downloads that are kept as pairs of a client and the name of a file, or what is made.

    The last one that is sent as it is stays as `data`.
    """

    data = b""

    def __init__(self, server: viser.ViserServer, jobs: Jobs) -> None:
        super().__init__(server, jobs, _ignore)
        self.sent: list[tuple[Who, str]] = []

    def send(self, who: Who, name: str, data: bytes) -> None:
        self.data = data
        self.sent.append((who, name))

    def compute(
        self,
        who: Who,
        name: str,
        task: Callable[..., bytes],
        arguments: tuple[Any, ...],
        notice: tuple[str, str] | None = None,
    ) -> None:
        del task, arguments, notice
        self.sent.append((who, name))

    def make(self, who: Who, doing: str, make: Callable[[viser.ClientHandle], File]) -> None:
        del make
        self.sent.append((who, doing))


def _paint_nothing(*_: object) -> None:
    """Leave a node without colours of a theme."""


def services_for(
    server: viser.ViserServer | None = None,
    session: Session | None = None,
    jobs: Jobs | None = None,
    *,
    buttons: Buttons | None = None,
    complain: Callable[[str, Who], None] = _ignore,
    tell: Callable[[str], None] = lambda _: None,
    redraw: Callable[[], None] = lambda: None,
    user_data: UserData | None = None,
    declared: tuple[Feature, ...] = (),
) -> Services:
    """Return services for what needs only some of them; the others are missing.

    Args:
        server: On which everything is drawn.
        session: To which changes are posted.
        jobs: Which compute; jobs that keep their orders if None.
        buttons: The buttons in markup.
        complain: Called with a message for people and the client it is for.
        tell: Called with a message for everybody.
        redraw: Called in place of the redraw of a session that is missing.
        user_data: The user's designs and session.
        declared: The features of the page.
    """
    working = StubJobs() if jobs is None else jobs
    some_server: Any = server
    some_session: Any = SimpleNamespace(redraw=redraw) if session is None else session
    missing: Any = None
    no_buttons: Any = SimpleNamespace(commands=Commands())
    no_theme: Any = SimpleNamespace(paint=_paint_nothing)
    return Services(
        server=some_server,
        session=some_session,
        jobs=working,
        buttons=no_buttons if buttons is None else buttons,
        downloads=StubDownloads(some_server, working),
        complain=complain,
        tell=tell,
        theme=no_theme,
        cameras=missing,
        user_data=user_data,
        offers_tour=False,
        declared=declared,
    )


def _sent(value: Any) -> Any:
    return pickle.loads(pickle.dumps(value))
