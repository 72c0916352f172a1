"""A headless Chromium, for pictures, printing and tests, and how it is found on this machine.

The search goes in this order: what EXPLORER_CHROMIUM names, the programs on the PATH, the one that
Playwright has downloaded, and Chrome, or Edge on Windows, where Playwright finds it.
"""

from __future__ import annotations

import os
import shutil
import sys
from collections.abc import Generator, Mapping, Sequence
from contextlib import contextmanager
from pathlib import Path
from typing import TYPE_CHECKING

from explorer.errors import ExplorerError, InputError, MissingExtraError
from explorer.files.extras import load_extra

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
        PictureError: The browser did not start, or failed at what it was then told to do.
    """
    (api,) = load_extra("screenshot", "playwright.sync_api")
    found = find_chromium()
    with api.sync_playwright() as playwright:
        chromium = found or playwright.chromium.executable_path
        is_known = os.access(chromium, os.X_OK)
        try:
            browser = playwright.chromium.launch(
                executable_path=chromium if is_known else None,
                channel=None if is_known else "msedge" if sys.platform == "win32" else "chrome",
                args=[*CHROMIUM_FLAGS, *graphics],
                env={**os.environ, **(environment or {})},
            )
        except api.Error as error:
            if not is_known:
                raise MissingExtraError(
                    "pictures need a Chromium: install chromium or google-chrome with the system's "
                    "package manager, or run: playwright install chromium"
                ) from None
            reason = str(error).splitlines()[0]
            raise PictureError(f"the browser {chromium} did not start: {reason}") from None
        try:
            yield browser
        except api.Error as error:
            reason = str(error).splitlines()[0]
            raise PictureError(f"the browser {chromium} failed: {reason}") from None
        finally:
            browser.close()


VARIABLE = "EXPLORER_CHROMIUM"
"""The environment variable that names a Chromium, by its path or as found on the PATH."""

NAMES = ("chromium", "chromium-browser", "google-chrome", "google-chrome-stable")


def find_chromium() -> str | None:
    """Return the path of the Chromium that the environment names or the PATH has, or None.

    Raises:
        InputError: EXPLORER_CHROMIUM is set, but names no program.
    """
    name = os.environ.get(VARIABLE)
    if name:
        program = shutil.which(name)
        if program is None:
            raise InputError(
                f"{VARIABLE} names no program: {name!r}; set it to the path of a Chromium, "
                "or unset it to have one looked for"
            )
        return program
    on_path = filter(None, map(shutil.which, NAMES))
    return next((path for path in on_path if not _is_snap_stub(path)), None)


def _is_snap_stub(program: str) -> bool:
    """Whether a program is Ubuntu's script that only says how to install Chromium."""
    with Path(program).open("rb") as file:
        start = file.read(4096)
    snap = "/snap/bin/chromium"
    return start.startswith(b"#!") and snap.encode() in start and not Path(snap).exists()
