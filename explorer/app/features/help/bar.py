"""Commands, theme and help in the bar, and the dialog of all help."""

from __future__ import annotations

from collections.abc import Callable, Iterator

import viser

from explorer.app.features.feature import Services
from explorer.app.features.help.keys_panel import KeysCard, keycap
from explorer.app.features.help.manual_panel import ManualReader
from explorer.app.features.help.tour_panel import TourGuide
from explorer.app.state.frame import Frame
from explorer.app.widgets.assigning import Update
from explorer.app.widgets.buttons import open_button, press_button
from explorer.app.widgets.commands import PAGE, PALETTE_KEY, STEP, Key, shift, with_keys
from explorer.app.widgets.markup import box, dim

PRESS = "page"
KEYS = {"Theme": (shift("L"),), "Keys": (Key("K"),)}
HINTS = {
    "Tour": "Do five steps, from the first move to an optimised design.",
    "Manual": "Read the manual beside the scene.",
    "Keys": "Show all keys on a card.",
    "Theme": "Turn the page dark, or light again.",
}

Press = Callable[[viser.ClientHandle], None]


class HelpButtons:
    """The palette, the theme and the help, as buttons of the bar."""

    def __init__(self, services: Services) -> None:
        self._services = services
        self._keys = KeysCard()
        services.server.on_client_disconnect(self._keys.disconnected)
        presses: dict[str, Press] = {
            "Tour": services.get(TourGuide).begin,
            "Manual": services.get(ManualReader).toggle,
            "Keys": self._show_keys,
            "Theme": self._toggle_theme,
        }
        buttons = services.buttons
        buttons.on(PRESS, lambda name, client: presses[name](client), values=presses)
        for name in presses:
            label = f"{PAGE}{STEP}{name}"
            buttons.offer(label, HINTS[name], PRESS, name, keys=KEYS.get(name, ()))
        commands = open_button(
            "commands",
            f"Commands {keycap(str(PALETTE_KEY))}",
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

    def _show_keys(self, client: viser.ClientHandle) -> None:
        self._keys.toggle(client, self._services.commands())

    def _toggle_theme(self, client: viser.ClientHandle) -> None:
        theme = self._services.theme
        theme.choose(dark=not theme.is_dark)
        self._services.remember(client.client_id, dark=theme.is_dark)


class HelpDialog:
    """A row for each kind of help."""

    def __init__(self, services: Services) -> None:
        rows = "".join(
            f'<div class="ex-row">{press_button(PRESS, name, name, class_name="ex-button")}'
            f"{dim(hint_of(name))}</div>"
            for name in ("Tour", "Manual", "Keys")
        )
        services.gui.add_html(box(f"<div data-closes>{rows}</div>"))

    def updates(self, _: Frame) -> Iterator[Update]:
        """Yield nothing: the dialog stays as it is."""
        return iter(())


def hint_of(name: str) -> str:
    """Return what a button does, with its keys."""
    return with_keys(HINTS[name], KEYS.get(name, ()))
