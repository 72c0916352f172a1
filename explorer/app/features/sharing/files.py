"""The view, the scene, the session and the report as files for one browser."""

from __future__ import annotations

import datetime as dt

import viser

from explorer.app.browser.downloads import File
from explorer.app.features.feature import Runner, Services
from explorer.app.features.mechanism.marks import HANDLE_NAME
from explorer.app.features.sharing.reporting import ReportFormat
from explorer.app.features.sharing.scene_html import FileCamera, scene_html
from explorer.app.features.sharing.session_log import SessionLog
from explorer.app.features.sharing.tasks import export_report, export_session
from explorer.app.features.sharing.view_picture import check_size, shown_size, view_picture
from explorer.app.session.session import Who
from explorer.app.state.frame import Frame

# Background of the scene on viser's page, by whether it is dark.
BACKGROUNDS = {False: (255, 255, 255), True: (20, 20, 20)}


class SessionRecorder(Runner):
    """Recorder of the poses of the platform, frame by frame, in its `log`."""

    def __init__(self, services: Services) -> None:
        self._session = services.session
        self.log = SessionLog()

    def follow(self, frame: Frame) -> None:
        """Record the pose of a frame."""
        step = self._session.history.step
        self.log.record(frame.state, step.number, step.words)


class SharedFiles:
    """Sends pictures, scenes, sessions and reports."""

    def __init__(self, services: Services) -> None:
        self._services = services
        self._session = services.session
        self._downloads = services.downloads
        self._recorder = services.get(SessionRecorder)

    def picture(
        self, size: tuple[float, float] | float, *, transparent: bool, client_id: Who
    ) -> None:
        """Send the view of a browser as PNG, drawn by that browser.

        Args:
            size: Width and height in pixels, or a factor on the size in the browser.
            transparent: Whether the scene has no background.
            client_id: Client of the browser.
        """

        def make(client: viser.ClientHandle) -> File:
            sides = check_size(*size) if isinstance(size, tuple) else shown_size(client, size)
            background = None if transparent else BACKGROUNDS[self._services.theme.is_dark]
            data = view_picture(client, sides, background, without=(HANDLE_NAME,))
            return f"{self._session.state.design.name}-{sides[0]}x{sides[1]}.png", data

        self._downloads.make(client_id, "Drawing the picture", make)

    def scene(self, client_id: Who) -> None:
        """Send the scene as an HTML file with the present camera of the browser."""

        def make(client: viser.ClientHandle) -> File:
            state, date = self._session.settled(), dt.datetime.now().astimezone().date()
            data = scene_html(self._services.server, state, FileCamera.of(client), date=date)
            return f"{state.design.name}-scene.html", data

        self._downloads.make(client_id, "Packing the scene", make)

    def session(self, client_id: Who) -> None:
        """Send the poses of the session as a table."""
        name = f"{self._session.state.design.name}-session.csv"
        table = self._recorder.log.table()
        self._downloads.compute(client_id, name, export_session, (table,))

    def report(self, file_format: ReportFormat, client_id: Who) -> None:
        """Send the report of the design in its present pose."""
        state = self._session.settled()
        self._downloads.compute(
            client_id,
            f"{state.design.name}-report.{file_format}",
            export_report,
            (state.design, state.pose, state.optimisation.record, file_format),
            ("Writing the report", "This takes some seconds."),
        )
