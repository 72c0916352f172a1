"""The files that are part of the explorer, its sources, and the versions of what it uses."""

from __future__ import annotations

import functools
import platform
from importlib import metadata, resources
from importlib.resources.abc import Traversable
from pathlib import Path

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


LIBRARIES = ("flagged-explorer", "numpy", "scipy", "numba")


def versions() -> dict[str, str]:
    """Return the versions of Python and of `LIBRARIES`, by name."""
    return dict(_read_versions())


@functools.cache
def _read_versions() -> dict[str, str]:
    # The metadata are files, and reading them takes milliseconds.
    versions = {"python": platform.python_version()}
    for name in LIBRARIES:
        try:
            versions[name] = metadata.version(name)
        except metadata.PackageNotFoundError:
            # A checkout that was never installed has no metadata.
            from explorer import __version__

            versions[name] = __version__
    return versions
