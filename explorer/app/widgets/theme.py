"""The theme of each browser: light or dark, as its user chose there or as the system is.

A script of the page knows which, and sends it. All browsers share the scene: where colours of it
must suit the background, each browser is sent its own.
"""

from __future__ import annotations

from collections.abc import Callable, Mapping

import viser

from explorer.app.session.session import Who
from explorer.app.widgets.buttons import Buttons
from explorer.mechanism.rgb import Rgb
from explorer.page.browser.viser_gaps import (
    SceneMessage,
    assign_in,
    assign_properties,
    run_script,
    run_script_in,
)
from explorer.page.look import call_script, read_script

# Colours of buttons and of the tab in front; the second is light enough for dark panels.
BRAND: Rgb = (24, 74, 150)
BRAND_ON_DARK: Rgb = (104, 162, 236)
PRESS = "theme"


class Theme:
    """The theme of each browser; `changed` is called after a change.

    Attributes:
        is_dark: Whether the browser that changed its theme last is dark, for what has the same
            colours in all of them.
    """

    def __init__(
        self, server: viser.ViserServer, buttons: Buttons, changed: Callable[[], None]
    ) -> None:
        self._changed = changed
        self._dark: set[int] = set()
        self._painted: list[tuple[viser.SceneNodeHandle, Mapping[bool, Mapping[str, Rgb]]]] = []
        self.is_dark = False
        _configure(server.gui, dark=False)
        buttons.on(PRESS, self._follow, values=("light", "dark"))
        server.on_client_disconnect(lambda client: self._dark.discard(client.client_id))

    def begin(self, server: viser.ViserServer) -> None:
        """Ask each browser for its theme, once it has all nodes of the scene and is connected."""
        run_script(server, read_script("theme") + call_script("theme"))
        server.on_client_connect(lambda client: run_script_in(client, "window.explorer.theme?.();"))

    def paint(self, node: viser.SceneNodeHandle, colours: Mapping[bool, Mapping[str, Rgb]]) -> None:
        """Give a node colours by name, by whether the page is dark."""
        assign_properties(node, colours[False])
        self._painted.append((node, colours))

    def is_dark_for(self, who: Who) -> bool:
        """Whether a browser is dark."""
        return who in self._dark

    def messages(self, *, dark: bool) -> list[SceneMessage]:
        """Return the messages that give the scene its colours."""
        return [
            {"type": "SceneNodeUpdateMessage", "name": node.name, "updates": dict(colours[dark])}
            for node, colours in self._painted
        ]

    def turn(self, client: viser.ClientHandle) -> None:
        """Turn a browser to the next theme: the other one, its own one, or that of the system."""
        run_script_in(client, "window.explorer.theme.turn();")

    def _follow(self, name: str, client: viser.ClientHandle) -> None:
        dark = name == "dark"
        (self._dark.add if dark else self._dark.discard)(client.client_id)
        _configure(client.gui, dark=dark)
        for node, colours in self._painted:
            assign_in(client, node, colours[dark])
        if dark != self.is_dark:
            self.is_dark = dark
            self._changed()


def _configure(gui: viser.GuiApi, *, dark: bool) -> None:
    gui.configure_theme(
        show_logo=False,
        show_share_button=False,
        control_width="large",
        brand_color=BRAND_ON_DARK if dark else BRAND,
        dark_mode=dark,
    )
