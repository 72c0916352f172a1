"""Files that people take away, each sent to the browser that asked and to no other.

What takes computing is made in the worker; what the browser draws itself, on a thread here.
"""

from __future__ import annotations

import datetime as dt
import threading
from collections.abc import Callable
from concurrent.futures import ThreadPoolExecutor

import viser

from explorer.app.features.mechanism.marks import HANDLE_NAME
from explorer.app.features.prototype.panel import assembly_name
from explorer.app.features.prototype.tasks import export_assembly
from explorer.app.features.sharing.reporting import ReportFormat
from explorer.app.features.sharing.scene_html import Eye, scene_html
from explorer.app.features.sharing.session_log import SessionLog
from explorer.app.features.sharing.tasks import export_report, export_session
from explorer.app.features.sharing.view_picture import check_size, shown_size, view_picture
from explorer.app.features.workspace.feed import workspace_rows, workspace_start
from explorer.app.features.workspace.panel import tolerance_of
from explorer.app.features.workspace.reached import Rows
from explorer.app.features.workspace.tasks import Region, export_mesh, exported_name
from explorer.app.session.jobs import Worker
from explorer.app.session.session import Session, Who
from explorer.app.state.frame import Frame
from explorer.errors import ExplorerError
from explorer.export.trajectory import trajectory_csv
from explorer.mechanism.design_file import encode_design
from explorer.mechanism.home import home_pose
from explorer.mechanism.pose import Triple
from explorer.optimise.record import encode_record

# Browsers that are waited for at the same time.
MOST_WAITED_FOR = 4

# What viser's page has behind the scene, by whether it is dark.
BACKGROUNDS = {False: (255, 255, 255), True: (20, 20, 20)}

Made = tuple[str, bytes]
"""The name of a file and what is in it."""


class Downloads:
    """Sends files, each to one browser; `log` keeps where the platform was.

    Args:
        server: That knows the browsers.
        session: Whose state is exported.
        worker: Which makes what takes time.
        complain: Called with a message for people and the client it is for.
        is_dark: Whether the page is dark.
    """

    def __init__(
        self,
        server: viser.ViserServer,
        session: Session,
        worker: Worker,
        complain: Callable[[str, Who], None],
        is_dark: Callable[[], bool],
    ) -> None:
        self._server = server
        self._session = session
        self._worker = worker
        self.log = SessionLog()
        self._complain = complain
        self._is_dark = is_dark
        self._waiting = ThreadPoolExecutor(MOST_WAITED_FOR, thread_name_prefix="downloads")
        self._lock = threading.Lock()
        self._busy: set[int] = set()

    def stop(self) -> None:
        """Begin nothing more."""
        self._waiting.shutdown(wait=False, cancel_futures=True)

    def workspace(self, what: str, file_format: str, client_id: int | None) -> None:
        """Send the workspace as it is shown, or its hull."""
        state = self._session.state
        frame, region = Frame(state), state.view.workspace.region
        start = workspace_start(frame)
        self._send_mesh(client_id, what, file_format, workspace_rows(frame), region, start)

    def hull(self, file_format: str, client_id: int | None) -> None:
        """Send the hull of the workspace that is optimised: at the orientation of home."""
        rotation = home_pose(self._session.state.design).rotation
        rows = tuple(tuple(row) for row in rotation.tolist())
        self._send_mesh(client_id, "hull", file_format, rows, "limits", None)

    def _send_mesh(
        self,
        client_id: int | None,
        what: str,
        file_format: str,
        rotation: Rows,
        region: Region,
        start: Triple | None,
    ) -> None:
        client = self._client(client_id)
        if client is None:
            return
        state = self._session.state
        name = f"{state.design.name}-{exported_name(region, what).replace(' ', '-')}"
        self._worker.submit(
            ("export", client_id, what),
            export_mesh,
            (state.design, rotation, tolerance_of(state), region, start, what, file_format),
            lambda data: client.send_file_download(
                f"{name}.{file_format}", data, save_immediately=True
            ),
            lambda problem: self._complain(problem, client_id),
        )

    def assembly(self, file_format: str, client_id: int | None) -> None:
        """Send the parts of the prototype."""
        client = self._client(client_id)
        if client is None:
            return
        design = self._session.state.design
        name = f"{design.name}-{assembly_name(file_format)}"
        self._worker.submit(
            ("export", client_id, "assembly"),
            export_assembly,
            (design, file_format),
            lambda data: client.send_file_download(name, data, save_immediately=True),
            lambda problem: self._complain(problem, client_id),
        )

    def design(self, client_id: int | None) -> None:
        """Send the design as a file."""
        client = self._client(client_id)
        if client is not None:
            design = self._session.state.design
            data = encode_design(design)
            client.send_file_download(f"{design.name}.json", data, save_immediately=True)

    def search(self, client_id: int | None) -> None:
        """Send the record of the last search, by which it can be repeated."""
        client, state = self._client(client_id), self._session.state
        if client is None:
            return
        record = state.optimisation.record
        if record is None:
            self._complain("a search that had to be ended leaves no record", client_id)
            return
        name = f"{state.design.name}.record.json"
        client.send_file_download(name, encode_record(record), save_immediately=True)

    def path(self, client_id: int | None) -> None:
        """Send the path that is played, over time."""
        client, journey = self._client(client_id), self._session.state.journey
        if client is not None and journey is not None:
            data = trajectory_csv(journey.trajectory).encode()
            name = f"{journey.design.name}-path.csv"
            client.send_file_download(name, data, save_immediately=True)

    def picture(
        self, size: tuple[float, float] | float, *, transparent: bool, client_id: int | None
    ) -> None:
        """Send the view of a browser as PNG, drawn by that browser.

        Args:
            size: Width and height in pixels, or how many times as large as it is shown.
            transparent: Whether there is nothing behind the scene, rather than the page.
            client_id: The browser.
        """

        def made(client: viser.ClientHandle) -> Made:
            sides = check_size(*size) if isinstance(size, tuple) else shown_size(client, size)
            background = None if transparent else BACKGROUNDS[self._is_dark()]
            data = view_picture(client, sides, background, without=(HANDLE_NAME,))
            return f"{self._session.state.design.name}-{sides[0]}x{sides[1]}.png", data

        self._send_made(client_id, "Drawing the picture", made)

    def scene(self, client_id: int | None) -> None:
        """Send the scene as an HTML file, to be seen as the browser sees it now."""

        def made(client: viser.ClientHandle) -> Made:
            state, date = self._session.state, dt.datetime.now().astimezone().date()
            data = scene_html(self._server, state, Eye.of(client), date=date)
            return f"{state.design.name}-scene.html", data

        self._send_made(client_id, "Packing the scene", made)

    def session(self, client_id: int | None) -> None:
        """Send the poses of the session as a table."""
        client = self._client(client_id)
        if client is not None:
            name = f"{self._session.state.design.name}-session.csv"
            self._worker.submit(
                ("export", client_id, "session"),
                export_session,
                (self.log.table(),),
                lambda data: client.send_file_download(name, data, save_immediately=True),
                lambda problem: self._complain(problem, client_id),
            )

    def report(self, file_format: ReportFormat, client_id: int | None) -> None:
        """Send the report of the design in its present pose."""
        client = self._client(client_id)
        if client is None:
            return
        state = self._session.state
        notice = client.add_notification(
            "Writing the report", "This takes some seconds.", loading=True, with_close_button=False
        )

        def done(data: bytes) -> None:
            notice.remove()
            name = f"{state.design.name}-report.{file_format}"
            client.send_file_download(name, data, save_immediately=True)

        def failed(problem: str) -> None:
            notice.remove()
            self._complain(problem, client_id)

        arguments = (state.design, state.pose, state.optimisation.record, file_format)
        self._worker.submit(("report", object()), export_report, arguments, done, failed)

    def _send_made(
        self, client_id: int | None, doing: str, made: Callable[[viser.ClientHandle], Made]
    ) -> None:
        """Make a file on a thread and send it; each browser has one made at a time."""
        client = self._client(client_id)
        if client is None:
            return
        with self._lock:
            is_busy = client.client_id in self._busy
            self._busy.add(client.client_id)
        if is_busy:
            self._complain("the last file is still being made; wait for it", client_id)
            return

        def work() -> None:
            notice = client.add_notification(doing, "", loading=True, with_close_button=False)
            try:
                name, data = made(client)
                client.send_file_download(name, data, save_immediately=True)
            except ExplorerError as error:
                self._complain(str(error), client_id)
            finally:
                notice.remove()
                with self._lock:
                    self._busy.discard(client.client_id)

        self._waiting.submit(work)

    def _client(self, client_id: int | None) -> viser.ClientHandle | None:
        return self._server.get_clients().get(-1 if client_id is None else client_id)
