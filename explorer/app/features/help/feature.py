"""Help: the search, the theme, and the dialog with the tour, the manual and the keys."""

from __future__ import annotations

from collections.abc import Callable, Iterable
from html import escape

import viser

from explorer.app.features.feature import Feature, Services, Tab
from explorer.app.features.help.search import TITLE, SearchDialog
from explorer.app.features.help.tour import TourGuide
from explorer.app.state.frame import Frame
from explorer.app.widgets.buttons import MANUAL, open_button, press_button
from explorer.app.widgets.markup import box, caption, dim
from explorer.page.browser.viser_gaps import run_script_in
from explorer.page.widgets import palette
from explorer.page.widgets.assigning import Updates

PRESS = "page"
KEYS = {"Theme": (palette.shift("L"),), "Keys": (palette.Key("K"),)}
HINTS = {
    "Tour": "Five steps, from the first move to a better design.",
    "Keys": "Show all keys.",
    "Theme": "Turn the page dark or light, or have it as the system is.",
}
# Keys and pointers with which viser moves the camera.
CAMERA = {"Turn": "drag, arrows", "Move": "right drag", "Zoom": "wheel", "Fly": "W A S D Q E"}


class HelpButtons:
    """The search, the theme and the help, as buttons of the bar."""

    def __init__(self, services: Services) -> None:
        presses: dict[str, Callable[[viser.ClientHandle], None]] = {
            "Tour": services.get(TourGuide).begin,
            "Keys": lambda client: run_script_in(client, 'window.explorer.open("Help")'),
            "Theme": services.theme.turn,
        }
        buttons = services.buttons
        buttons.on(PRESS, lambda name, client: presses[name](client), values=presses)
        for name, hint in HINTS.items():
            buttons.offer(f"Page › {name}", hint, PRESS, name, keys=KEYS.get(name, ()))
        commands = open_button(
            TITLE,
            f"Search {keycap(str(palette.PALETTE_KEY))}",
            hint="Search commands, all that stands on the page, and the manual.",
            class_name="ex-tool ex-commands",
        )
        theme = press_button(
            PRESS,
            "Theme",
            "",
            hint=palette.with_keys(HINTS["Theme"], KEYS["Theme"]),
            label="Theme",
            class_name="ex-tool ex-theme",
        )
        help_ = open_button("Help", "Help", hint="Tour, manual and keys.", class_name="ex-tool")
        self._markup = f"{commands}{theme}{help_}"

    def __call__(self, _: Frame) -> str:
        """Return the buttons as HTML."""
        return self._markup


class HelpDialog:
    """The tour, the manual, and all keys of the page."""

    def __init__(self, services: Services) -> None:
        buttons = (
            press_button(PRESS, "Tour", "Tour", class_name="ex-button") + dim(HINTS["Tour"]),
            press_button(MANUAL, "page.md", "Manual", class_name="ex-button")
            + dim("All pages, beside the scene."),
        )
        self._rows = "".join(f'<div class="ex-row" data-closes>{each}</div>' for each in buttons)
        self._html = services.gui.add_html("")
        self._services = services
        self._markup = ""

    def updates(self, _: Frame) -> Updates:
        """Yield the markup with the keys, which are known once all features are made."""
        self._markup = self._markup or box(self._rows + keys_table(self._services.commands.all))
        yield self._html, "content", self._markup


def keycap(key: str) -> str:
    """Return a drawn key, as HTML."""
    return f'<kbd class="ex-keycap">{escape(key)}</kbd>'


def keys_table(commands: Iterable[palette.Command]) -> str:
    """Return all keys as HTML, in the groups of their commands and in two columns."""
    groups = {"Page": [_row("Search commands, page and manual", keycap(str(palette.PALETTE_KEY)))]}
    for command in commands:
        if command.keys:
            caps = " ".join(keycap(str(key)) for key in command.keys)
            group, _, words = command.label.partition(palette.STEP)
            row = _row(words.replace(palette.STEP, ", "), caps)
            groups.setdefault(group, []).append(row)
    groups["Camera"] = [_row(words, keycap(keys)) for words, keys in CAMERA.items()]
    blocks = (f"<div>{caption(name)}{''.join(rows)}</div>" for name, rows in groups.items())
    return f'<div class="ex-keys">{"".join(blocks)}</div>'


def _row(words: str, caps: str) -> str:
    return f'<div class="ex-line"><span>{escape(words)}</span><span>{caps}</span></div>'


HELP = Feature(
    "help",
    tabs=(Tab("dialog", "Help", HelpDialog), Tab("dialog", TITLE, SearchDialog)),
    bar=(("right", HelpButtons),),
    runners=(TourGuide,),
)
