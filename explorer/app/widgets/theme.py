"""The light and the dark theme of the page, one for all its browsers.

All browsers share the scene, whose grid must suit the background, so they share the theme too.
Until a user chooses one, it follows the first browser.
"""

from __future__ import annotations

from collections.abc import Callable

import viser

from explorer.singularity.colours import Rgb

# Colours of buttons and of the tab in front; the second is light enough for dark panels.
BRAND: Rgb = (24, 74, 150)
BRAND_ON_DARK: Rgb = (104, 162, 236)


class Theme:
    """The theme of the page, that of the first browser unless it is given at the start.

    `changed` is called after a change.
    """

    def __init__(
        self, gui: viser.GuiApi, *, dark: bool | None, changed: Callable[[], None]
    ) -> None:
        self._gui = gui
        self._changed = changed
        self._is_chosen = dark is not None
        self.is_dark = dark is True
        self._configure()

    def choose(self, *, dark: bool) -> None:
        """Make all pages dark, or light."""
        self._is_chosen = True
        if dark != self.is_dark:
            self.is_dark = dark
            self._configure()
            self._changed()

    def follow_browser(self, *, dark: bool) -> None:
        """Give all pages the theme that a browser prefers, unless a user has chosen one."""
        if not self._is_chosen:
            self.choose(dark=dark)

    def _configure(self) -> None:
        self._gui.configure_theme(
            show_logo=False,
            show_share_button=False,
            control_width="large",
            brand_color=BRAND_ON_DARK if self.is_dark else BRAND,
            dark_mode=self.is_dark,
        )
