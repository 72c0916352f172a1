"""The versions of Python and of the libraries that results depend on."""

from __future__ import annotations

import functools
import platform
from importlib import metadata

LIBRARIES = ("flagged-explorer", "numpy", "scipy", "numba")


def versions() -> dict[str, str]:
    """Return the versions of Python and of `LIBRARIES`, by name."""
    return dict(_found())


@functools.cache
def _found() -> dict[str, str]:
    # Read from files, which takes milliseconds.
    found = {"python": platform.python_version()}
    for name in LIBRARIES:
        try:
            found[name] = metadata.version(name)
        except metadata.PackageNotFoundError:
            # A checkout that was never installed has no metadata of its own.
            from explorer import __version__

            found[name] = __version__
    return found
