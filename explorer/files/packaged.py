"""The files that are part of the explorer, with its manual, and the versions of what it uses."""

from __future__ import annotations

import functools
import platform
from importlib import metadata, resources
from importlib.resources.abc import Traversable
from pathlib import Path
from typing import NamedTuple

from explorer import __version__
from explorer.errors import InputError

SOURCES = Path(__file__).parents[2]
"""The folder that holds the package `explorer`, for processes that must import the same sources."""


def packaged_file(folder: str, name: str) -> Traversable:
    """Return a file in one of the explorer's folders, which need not exist."""
    return _packaged_folder(folder).joinpath(name)


def packaged_files(folder: str, suffix: str) -> list[Traversable]:
    """Return the files with a suffix in one of the explorer's folders, ordered by name."""
    files = (file for file in _packaged_folder(folder).iterdir() if file.name.endswith(suffix))
    return sorted(files, key=lambda file: file.name)


def _packaged_folder(folder: str) -> Traversable:
    # In a wheel the folders lie inside the package, in a checkout beside it.
    packaged = resources.files("explorer").joinpath(folder)
    return packaged if packaged.is_dir() else SOURCES / "assets" / folder


@functools.cache
def versions() -> dict[str, str]:
    """Return the versions of Python, of this package and of its numerical libraries, by name.

    Callers do not change it.
    """
    # The metadata are files, and reading them takes milliseconds.
    numerical = {name: metadata.version(name) for name in ("numpy", "scipy", "numba")}
    return {"python": platform.python_version(), "flagged-explorer": __version__, **numerical}


class ManualPage(NamedTuple):
    """A page of the manual: its first heading, and its file's name, the argument of `read_page`."""

    title: str
    file: str


def list_pages() -> tuple[ManualPage, ...]:
    """Return the pages of the manual, the glossary first, the others by file name."""
    files = sorted(_manual_files().values(), key=lambda file: file.name != "glossary.md")
    return tuple(
        ManualPage(file.read_text("utf-8").split("\n")[0][2:], file.name) for file in files
    )


def read_page(file: str) -> str:
    """Return the Markdown of a page by the name of its file, such as "glossary.md".

    Raises:
        InputError: The manual has no such page.
    """
    files = _manual_files()
    if file not in files:
        raise InputError(f"the manual has no page {file!r}; its pages are {', '.join(files)}")
    return files[file].read_text("utf-8")


def _manual_files() -> dict[str, Traversable]:
    return {file.name: file for file in packaged_files("manual", ".md")}
