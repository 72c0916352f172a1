"""Help: commands and keys, the theme, the tour, and the manual in a panel beside the scene."""

from __future__ import annotations

import re
import threading
from collections.abc import Callable, Iterable
from html import escape

import viser

from explorer.app.browser.viser_gaps import run_script_in
from explorer.app.features.feature import Feature, InBar, Services, Tab
from explorer.app.features.help.tour import TourGuide
from explorer.app.state.frame import Frame
from explorer.app.widgets import palette
from explorer.app.widgets.assigning import Updates
from explorer.app.widgets.buttons import open_button, press_button
from explorer.app.widgets.markup import box, caption, dim
from explorer.files.packaged import list_pages, read_page

PRESS = "page"
KEYS = {"Theme": (palette.shift("L"),), "Keys": (palette.Key("K"),)}
HINTS = {
    "Tour": "Do five steps, from the first move to an optimised design.",
    "Manual": "Read the manual beside the scene.",
    "Keys": "Show all keys.",
    "Theme": "Turn the page dark, or light again.",
}
# Keys and pointers with which viser moves the camera.
CAMERA = (
    ("drag, arrows", "Turn"),
    ("right drag", "Move"),
    ("wheel", "Zoom"),
    ("W A S D Q E", "Fly"),
)
TURN, CLOSE = "help.page", "help.close"
# Place and size of the manual's panel, in pixels.
LEFT, TOP, WIDTH, HEIGHT = 300, 60, 560, 640
PAGES = {page.title: page.file for page in list_pages()}
TITLES = {file: title for title, file in PAGES.items()}


class HelpButtons:
    """The palette, the theme and the help, as buttons of the bar."""

    def __init__(self, services: Services) -> None:
        self._services = services
        presses: dict[str, Callable[[viser.ClientHandle], None]] = {
            "Tour": services.get(TourGuide).begin,
            "Manual": services.get(ManualReader).toggle,
            "Keys": lambda client: run_script_in(client, 'window.explorer.open("Keys")'),
            "Theme": self._toggle_theme,
        }
        buttons = services.buttons
        buttons.on(PRESS, lambda name, client: presses[name](client), values=presses)
        for name in presses:
            keys = KEYS.get(name, ())
            buttons.offer(
                f"{palette.PAGE}{palette.STEP}{name}", HINTS[name], PRESS, name, keys=keys
            )
        commands = open_button(
            "commands",
            f"Commands {keycap(str(palette.PALETTE_KEY))}",
            hint="Search for anything that can be done, and do it.",
            class_name="ex-tool ex-commands",
        )
        theme = press_button(
            PRESS, "Theme", "◐", hint=hint_of("Theme"), label="Theme", class_name="ex-tool"
        )
        help_ = open_button("Help", "Help", hint="Tour, manual and keys.", class_name="ex-tool")
        self._markup = f"{commands}{theme}{help_}"

    def __call__(self, _: Frame) -> str:
        """Return the buttons as HTML."""
        return self._markup

    def _toggle_theme(self, client: viser.ClientHandle) -> None:
        theme = self._services.theme
        theme.choose(dark=not theme.is_dark)
        self._services.remember(client.client_id, dark=theme.is_dark)


class HelpDialog:
    """A row for each kind of help."""

    def __init__(self, services: Services) -> None:
        buttons = {
            name: press_button(PRESS, name, name, class_name="ex-button")
            for name in ("Tour", "Manual")
        }
        buttons["Keys"] = open_button("Keys", "Keys", class_name="ex-button")
        rows = "".join(
            f'<div class="ex-row">{button}{dim(hint_of(name))}</div>'
            for name, button in buttons.items()
        )
        services.gui.add_html(box(f"<div data-closes>{rows}</div>"))

    def updates(self, _: Frame) -> Updates:
        """Yield nothing: the dialog stays as it is."""
        return iter(())


class KeysDialog:
    """All keys of the page."""

    def __init__(self, services: Services) -> None:
        self._html = services.gui.add_html("")
        self._services = services
        self._table = ""

    def updates(self, _: Frame) -> Updates:
        """Yield the table of all keys, which are known once all features are made."""
        self._table = self._table or keys_table(self._services.commands())
        yield self._html, "content", self._table


def hint_of(name: str) -> str:
    """Return the hint of a button, with its keys."""
    return palette.with_keys(HINTS[name], KEYS.get(name, ()))


def keycap(key: str) -> str:
    """Return a drawn key, as HTML."""
    return f'<kbd class="ex-keycap">{escape(key)}</kbd>'


def keys_table(commands: Iterable[palette.Command]) -> str:
    """Return all keys as HTML, in the groups of their commands and in two columns."""
    groups = {palette.PAGE: [_row("Search all commands", keycap(str(palette.PALETTE_KEY)))]}
    for command in commands:
        if command.keys:
            caps = " ".join(keycap(str(key)) for key in command.keys)
            words = command.label.partition(palette.STEP)[2].replace(palette.STEP, ", ")
            groups.setdefault(palette.group_of(command), []).append(_row(words, caps))
    groups["Camera"] = [_row(words, keycap(keys)) for keys, words in CAMERA]
    blocks = (f"<div>{caption(name)}{''.join(rows)}</div>" for name, rows in groups.items())
    return f'<div class="ex-keys">{"".join(blocks)}</div>'


def _row(words: str, caps: str) -> str:
    return f'<div class="ex-line"><span>{escape(words)}</span><span>{caps}</span></div>'


class ManualReader:
    """The manual beside the scene, to read and try at the same time."""

    def __init__(self, services: Services) -> None:
        # The manual of each browser with its list of pages; presses and leaving browsers come on
        # threads of their own.
        self._manuals: dict[int, tuple[viser.PanelHandle, viser.GuiDropdownHandle[str]]] = {}
        self._lock = threading.Lock()
        services.buttons.on(TURN, self._turn, values=TITLES)
        services.buttons.on(CLOSE, lambda _, client: self.toggle(client))
        services.server.on_client_disconnect(self._forget)

    def toggle(self, client: viser.ClientHandle) -> None:
        """Open the manual in a browser, or close it there."""
        with self._lock:
            manual = self._manuals.pop(client.client_id, None)
            if manual is None:
                self._manuals[client.client_id] = _add_manual(client.gui)
            else:
                manual[0].remove()

    def _forget(self, client: viser.ClientHandle) -> None:
        self._manuals.pop(client.client_id, None)

    def _turn(self, file: str, client: viser.ClientHandle) -> None:
        manual = self._manuals.get(client.client_id)
        if manual is not None:
            manual[1].value = TITLES[file]


def _add_manual(gui: viser.GuiApi) -> tuple[viser.PanelHandle, viser.GuiDropdownHandle[str]]:
    panel = gui.add_panel()
    panel.float(x=LEFT, y=TOP, width=WIDTH, height=HEIGHT)
    with panel.add_tab("Manual"):
        choice = gui.add_dropdown("Page", tuple(PAGES), hint="Turn to another page.")
        page = gui.add_markdown(markdown_of(PAGES[choice.value]))
        gui.add_html(press_button(CLOSE, "", "Close the manual", class_name="ex-chip"))
    choice.on_update(lambda _: setattr(page, "content", markdown_of(PAGES[choice.value])))
    return panel, choice


def markdown_of(file: str) -> str:
    """Return the Markdown of a page with its links to other pages as buttons."""

    def button(match: re.Match[str]) -> str:
        words, target = match.groups()
        if target not in TITLES:
            return match.group()
        return press_button(TURN, target, words, class_name="ex-link").replace(
            ' class="', ' className="'
        )

    return re.sub(r"\[([^\]]+)\]\(([^)#]+)(?:#[^)]*)?\)", button, read_page(file))


HELP = Feature(
    "help",
    tabs=(Tab("dialog", "Help", HelpDialog), Tab("dialog", "Keys", KeysDialog)),
    bar=(InBar("right", HelpButtons),),
    runners=(TourGuide,),
)
