"""The manual: its pages beside the scene, and its headings and terms for the search."""

from __future__ import annotations

import re
import threading
import unicodedata
from collections.abc import Iterator
from typing import NamedTuple

import viser

from explorer.app.features.feature import Services
from explorer.app.widgets.buttons import MANUAL, press_button
from explorer.files.packaged import list_pages, read_page
from explorer.page.browser.viser_gaps import run_script_in, show_value
from explorer.page.look import read_script
from explorer.page.widgets.palette import STEP

CLOSE = "help.close"
# Place and size of the manual's panel, in pixels.
LEFT, TOP, WIDTH, HEIGHT = 300, 60, 560, 640
PAGES = {page.title: page.file for page in list_pages()}
TITLES = {file: title for title, file in PAGES.items()}
PICTURE = re.compile(r"!\[[^\]]*\]\([^)]*\)")
LINK = re.compile(r"\[([^\]]+)\]\(([^)#]+)(?:#[^)]*)?\)")
# A heading, or a term with the first sentence on it; an initial with its point ends no sentence.
HEADING = re.compile(r"^##+ (.+)$", re.MULTILINE)
TERM = re.compile(r"\*\*([^*]+)\.\*\* (.+?[^A-Z]\.)(?:\s|$)", re.DOTALL)
SYMBOL = re.compile(r",? (?=[α-ω])")


def list_entries() -> Iterator[tuple[str, str, str]]:
    """Yield pages, headings and terms of the manual as the search finds them.

    Each has its name in the search, a sentence, and what opens it, see `MANUAL`.
    """
    for title, file in PAGES.items():
        text, name = read_page(file), f"Manual{STEP}{title}"
        yield name, "Read this page of the manual.", file
        for heading in HEADING.findall(text):
            yield f"{name}{STEP}{heading}", "Read this in the manual.", f"{file}#{heading}"
        for term, sentence in TERM.findall(text) if title == "Glossary" else ():
            words = " ".join(LINK.sub(r"\1", sentence).replace("*", "").split())
            for one in SYMBOL.split(term):
                yield f"{one} (glossary)", f"{spelling(one)}{words}", f"{file}#{term}."


def spelling(name: str) -> str:
    """Return how a Greek symbol is typed, such as "delta2, d2: " for δ2; "" for other words."""
    letter = unicodedata.name(name[0]).lower().removeprefix("greek small letter ")
    return f"{letter}{name[1:]}, {letter[0]}{name[1:]}: " if " " not in letter else ""


class ManualReader:
    """The manual beside the scene, to read and try at the same time."""

    def __init__(self, services: Services) -> None:
        # The manual of each browser; presses and leaving browsers come on threads of their own.
        self._manuals: dict[int, _Manual] = {}
        self._lock = threading.Lock()
        services.buttons.on(MANUAL, self.open, values={target for _, _, target in list_entries()})
        services.buttons.on(CLOSE, lambda _, client: self._close(client))
        services.server.on_client_disconnect(self._forget)

    def open(self, target: str, client: viser.ClientHandle) -> None:
        """Open a page of the manual in a browser, at its heading or term if the target has one."""
        file, _, words = target.partition("#")
        title = TITLES[file]
        with self._lock:
            manual = self._manuals.get(client.client_id)
            if manual is None:
                manual = self._manuals[client.client_id] = self._add_manual(client)
            show_value(manual.choice, title)
            manual.page.content = markdown_of(file)
        run_script_in(client, read_script("manual", title, words or title))

    def _close(self, client: viser.ClientHandle) -> None:
        manual = self._manuals.pop(client.client_id, None)
        if manual is not None:
            manual.panel.remove()

    def _forget(self, client: viser.ClientHandle) -> None:
        self._manuals.pop(client.client_id, None)

    def _add_manual(self, client: viser.ClientHandle) -> _Manual:
        panel = client.gui.add_panel()
        panel.float(x=LEFT, y=TOP, width=WIDTH, height=HEIGHT)
        with panel.add_tab("Manual"):
            choice = client.gui.add_dropdown("Page", tuple(PAGES), hint="Turn to another page.")
            choice.on_update(lambda _: self.open(PAGES[choice.value], client))
            return _Manual(panel, choice, client.gui.add_markdown(""))


class _Manual(NamedTuple):
    """The manual in one browser: its panel, the list of its pages, and the present one."""

    panel: viser.PanelHandle
    choice: viser.GuiDropdownHandle[str]
    page: viser.GuiMarkdownHandle


def markdown_of(file: str) -> str:
    """Return the Markdown of a page without pictures, and with its links as buttons."""

    def button(match: re.Match[str]) -> str:
        link = press_button(MANUAL, match[2], match[1], class_name="ex-link")
        return link.replace(' class="', ' className="')

    return LINK.sub(button, PICTURE.sub("", read_page(file)))
