"""The versions of Python and of the libraries on which results depend."""

from __future__ import annotations

import functools
import platform
from importlib import metadata

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
