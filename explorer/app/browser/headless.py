"""A headless Chromium, for pictures, printing and tests, and how it is found on this machine.

The search goes in this order: what EXPLORER_CHROMIUM names, the programs on the PATH, the usual
places of macOS and Windows, and the one that Playwright has downloaded.
"""

from __future__ import annotations

import itertools
import os
import shutil
import sys
from collections.abc import Generator, Iterator, Mapping, Sequence
from contextlib import contextmanager
from pathlib import Path
from typing import TYPE_CHECKING

from explorer.errors import ExplorerError, InputError, MissingExtraError

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
    try:
        from playwright.sync_api import Error, sync_playwright
    except ImportError:
        raise MissingExtraError(
            'pictures need the extra "screenshot": pip install "flagged-explorer[screenshot]"'
        ) from None
    found = find_chromium()
    with sync_playwright() as playwright:
        chromium = found or playwright.chromium.executable_path
        if not os.access(chromium, os.X_OK):
            raise MissingExtraError(
                "pictures need a Chromium: install chromium or google-chrome with the system's "
                "package manager, or run: playwright install chromium"
            )
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


VARIABLE = "EXPLORER_CHROMIUM"
"""The environment variable that names a Chromium, by its path or as found on the PATH."""

NAMES = ("chromium", "chromium-browser", "google-chrome", "google-chrome-stable")

_MAC_APPS = (
    "Chromium.app/Contents/MacOS/Chromium",
    "Google Chrome.app/Contents/MacOS/Google Chrome",
)
_WINDOWS_PROGRAMS = (
    "Google/Chrome/Application/chrome.exe",
    "Chromium/Application/chrome.exe",
    "Microsoft/Edge/Application/msedge.exe",
)


def find_chromium() -> str | None:
    """Return the path of a Chromium of this machine that can be started, or None.

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
    on_path = (path for path in map(shutil.which, NAMES) if path and not _is_snap_stub(path))
    return next(itertools.chain(on_path, _usual_places()), None)


def _is_snap_stub(program: str) -> bool:
    """Whether a program is Ubuntu's script that only says how to install Chromium."""
    with Path(program).open("rb") as file:
        start = file.read(4096)
    snap = "/snap/bin/chromium"
    return start.startswith(b"#!") and snap.encode() in start and not Path(snap).exists()


def _usual_places() -> Iterator[str]:
    places: list[Path] = []
    if sys.platform == "darwin":
        folders = (Path("/Applications"), Path.home() / "Applications")
        places = [folder / app for app in _MAC_APPS for folder in folders]
    elif sys.platform == "win32":
        roots = ("PROGRAMFILES", "PROGRAMFILES(X86)", "LOCALAPPDATA")
        folders = tuple(Path(os.environ[root]) for root in roots if root in os.environ)
        places = [folder / program for program in _WINDOWS_PROGRAMS for folder in folders]
    for place in places:
        if os.access(place, os.X_OK):
            yield str(place)
