"""A headless Chromium, for pictures and for printing."""

from __future__ import annotations

import os
from collections.abc import Generator, Mapping, Sequence
from contextlib import contextmanager
from typing import TYPE_CHECKING

from explorer.app.browser.chromium import find_chromium
from explorer.errors import ExplorerError, MissingExtraError

if TYPE_CHECKING:
    from playwright.sync_api import Browser

# Flags of the software renderer that every Chromium brings along.
SWIFTSHADER = ("--use-angle=swiftshader", "--enable-unsafe-swiftshader")
CHROMIUM_FLAGS = (
    "--no-sandbox",
    "--disable-background-networking",
    "--disable-component-update",
    "--disable-sync",
    "--disable-quic",
    "--no-first-run",
    "--hide-scrollbars",
    "--force-color-profile=srgb",
)


class PictureError(ExplorerError):
    """The browser did not start or did not draw in time."""


@contextmanager
def headless_browser(
    graphics: Sequence[str] = SWIFTSHADER, environment: Mapping[str, str] | None = None
) -> Generator[Browser]:
    """Start a headless Chromium and close it in the end.

    Args:
        graphics: Flags that choose the renderer.
        environment: Environment variables to add to those of this process.

    Raises:
        MissingExtraError: Playwright or a Chromium is missing.
        PictureError: the browser did not start, or failed at what it was then told to do.
    """
    try:
        from playwright.sync_api import Error, sync_playwright
    except ImportError:
        raise MissingExtraError(
            'pictures need the extra "screenshot": pip install "flagged-explorer[screenshot]"'
        ) from None
    chromium = find_chromium()
    if chromium is None:
        raise MissingExtraError(
            "pictures need a Chromium: install chromium or google-chrome with the system's "
            "package manager, or run: playwright install chromium"
        )
    with sync_playwright() as playwright:
        try:
            browser = playwright.chromium.launch(
                executable_path=chromium,
                args=[*CHROMIUM_FLAGS, *graphics],
                env={**os.environ, **(environment or {})},
            )
        except Error as error:
            reason = str(error).splitlines()[0]
            raise PictureError(f"the browser {chromium} did not start: {reason}") from None
        try:
            yield browser
        except Error as error:
            reason = str(error).splitlines()[0]
            raise PictureError(f"the browser {chromium} failed: {reason}") from None
        finally:
            browser.close()
