"""The manual in a panel of the browser that opened it, page by page."""

from __future__ import annotations

import re
import threading
from typing import NamedTuple

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


class _Manual(NamedTuple):
    panel: viser.PanelHandle
    choice: viser.GuiDropdownHandle[str]


class ManualReader:
    """The manual beside the scene, to read and try at the same time."""

    def __init__(self, services: Services) -> None:
        # The manual of each browser; presses and leaving browsers come on threads of their own.
        self._manuals: dict[int, _Manual] = {}
        self._lock = threading.Lock()
        services.buttons.on(PRESS, self._turn, values=TITLES)
        services.buttons.on(CLOSE, lambda _, client: self.toggle(client))
        services.server.on_client_disconnect(self._forget)

    def toggle(self, client: viser.ClientHandle) -> None:
        """Open the manual in a browser, or close it there."""
        with self._lock:
            manual = self._manuals.pop(client.client_id, None)
            if manual is None:
                self._manuals[client.client_id] = _add_manual(client.gui)
            else:
                manual.panel.remove()

    def _forget(self, client: viser.ClientHandle) -> None:
        self._manuals.pop(client.client_id, None)

    def _turn(self, file: str, client: viser.ClientHandle) -> None:
        manual = self._manuals.get(client.client_id)
        if manual is not None:
            manual.choice.value = TITLES[file]


def _add_manual(gui: viser.GuiApi) -> _Manual:
    panel = gui.add_panel()
    panel.float(x=LEFT, y=TOP, width=WIDTH, height=HEIGHT)
    with panel.add_tab("Manual"):
        choice = gui.add_dropdown("Page", tuple(PAGES), hint="Turn to another page.")
        page = gui.add_markdown(markdown_of(PAGES[choice.value]))
        gui.add_html(press_button(CLOSE, "", "Close the manual", class_name="ex-chip"))
    choice.on_update(lambda _: setattr(page, "content", markdown_of(PAGES[choice.value])))
    return _Manual(panel, choice)


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
