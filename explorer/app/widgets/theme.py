"""The light and the dark theme of the page, one for all its browsers.

The scene is shared by all browsers, and its grid has to suit what is behind it; so the theme
is the server's. Until somebody chooses, it is what the first browser's user prefers.
"""

from __future__ import annotations

from collections.abc import Callable

import viser

from explorer.app.widgets.colours import Rgb

# Of buttons and of the tab in front. The dark one is light enough to be read on dark panels.
BRAND: Rgb = (24, 74, 150)
BRAND_ON_DARK: Rgb = (104, 162, 236)


class Theme:
    """Which theme the page has.

    Args:
        gui: The page's.
        changed: Called after a change.
    """

    def __init__(self, gui: viser.GuiApi, *, dark: bool, changed: Callable[[], None]) -> None:
        self._gui = gui
        self._changed = changed
        self._dark = dark
        self._configure()

    @property
    def is_dark(self) -> bool:
        """Whether the page is dark."""
        return self._dark

    def choose(self, *, dark: bool) -> None:
        """Make all pages dark, or light."""
        if dark != self._dark:
            self._dark = dark
            self._configure()
            self._changed()

    def _configure(self) -> None:
        self._gui.configure_theme(
            show_logo=False,
            show_share_button=False,
            control_width="large",
            brand_color=BRAND_ON_DARK if self._dark else BRAND,
            dark_mode=self._dark,
        )
