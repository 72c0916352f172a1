"""The view, the scene and the report as files for one browser."""

from __future__ import annotations

import datetime as dt

import viser

from explorer.app.browser.downloads import File
from explorer.app.features.feature import Services
from explorer.app.features.mechanism.marks import HANDLE_NAME
from explorer.app.features.sharing.reporting import ReportFormat, make_report
from explorer.app.features.sharing.scene_html import FileCamera, scene_html
from explorer.app.features.sharing.view_picture import check_size, shown_size, view_picture
from explorer.app.session.session import Who

# Background of the scene on viser's page, by whether it is dark.
BACKGROUNDS = {False: (255, 255, 255), True: (20, 20, 20)}


class SharedFiles:
    """Sends pictures, scenes and reports."""

    def __init__(self, services: Services) -> None:
        self._services = services
        self._session = services.session
        self._downloads = services.downloads

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

    def report(self, file_format: ReportFormat, client_id: Who) -> None:
        """Send the report of the design in its present pose."""
        state = self._session.settled()
        self._downloads.compute(
            client_id,
            f"{state.design.name}-report.{file_format}",
            make_report,
            (state.design, state.pose, state.optimisation.record, file_format),
            ("Writing the report", "This takes some seconds."),
        )
