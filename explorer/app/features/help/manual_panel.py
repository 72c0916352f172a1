"""The manual in a panel of the browser that opened it, page by page."""

from __future__ import annotations

import re
import threading
from dataclasses import dataclass

import viser

from explorer.app.features.feature import Services
from explorer.app.widgets.buttons import press_button
from explorer.files.manual import list_pages, read_page

PRESS = "help.page"
CLOSE = "help.close"
# Place and size of the panel, in pixels.
LEFT, TOP, WIDTH, HEIGHT = 300, 60, 560, 640

PAGES = {page.title: page.file for page in list_pages()}
TITLES = {file: title for title, file in PAGES.items()}


@dataclass(frozen=True)
class _Open:
    panel: viser.PanelHandle
    choice: viser.GuiDropdownHandle[str]
    page: viser.GuiMarkdownHandle


class ManualReader:
    """The manual beside the scene, to read and try at the same time."""

    def __init__(self, services: Services) -> None:
        self._lock = threading.RLock()
        self._open: dict[int, _Open] = {}
        services.buttons.on(PRESS, self._turn, values=TITLES)
        services.buttons.on(CLOSE, lambda _, client: self.close(client))
        services.server.on_client_disconnect(self._disconnected)

    def toggle(self, client: viser.ClientHandle) -> None:
        """Open the manual in a browser, or close it there."""
        with self._lock:
            if client.client_id in self._open:
                self.close(client)
            else:
                self._open[client.client_id] = self._add(client)

    def close(self, client: viser.ClientHandle) -> None:
        """Close the manual in a browser, if it is open there."""
        with self._lock:
            opened = self._open.pop(client.client_id, None)
        if opened is not None:
            opened.panel.remove()

    def _add(self, client: viser.ClientHandle) -> _Open:
        gui = client.gui
        panel = gui.add_panel()
        panel.float(x=LEFT, y=TOP, width=WIDTH, height=HEIGHT)
        with panel.add_tab("Manual"):
            choice = gui.add_dropdown("Page", tuple(PAGES), hint="Turn to another page.")
            page = gui.add_markdown(markdown_of(PAGES[choice.value]))
            gui.add_html(press_button(CLOSE, "", "Close the manual", class_name="ex-chip"))
        choice.on_update(lambda _: setattr(page, "content", markdown_of(PAGES[choice.value])))
        return _Open(panel, choice, page)

    def _turn(self, file: str, client: viser.ClientHandle) -> None:
        with self._lock:
            opened = self._open.get(client.client_id)
        if opened is not None:
            opened.choice.value = TITLES[file]

    def _disconnected(self, client: viser.ClientHandle) -> None:
        with self._lock:
            self._open.pop(client.client_id, None)


def markdown_of(file: str) -> str:
    """Return the Markdown of a page with its links to other pages as buttons."""

    def button(match: re.Match[str]) -> str:
        words, target = match.groups()
        if target not in TITLES:
            return match.group()
        return press_button(PRESS, target, words, class_name="ex-link").replace(
            ' class="', ' className="'
        )

    return re.sub(r"\[([^\]]+)\]\(([^)#]+)(?:#[^)]*)?\)", button, read_page(file))
