"""Optional libraries, by the extra of this project that installs them, and what needs them."""

from __future__ import annotations

import functools
import importlib
import sys
import warnings
from importlib.util import find_spec
from typing import Any

from explorer.errors import MissingExtraError

EXTRAS = {
    "cad": ("STEP files", ("OCP",)),
    "cluster": ("a scheduler and each of its workers", ("distributed",)),
    "planning": ("paths that are not straight in the folds", ("ompl",)),
    "screenshot": ("pictures and PDF files", ("playwright",)),
    "study": ("studies", ("pyarrow",)),
    "timing": ("paths in the shortest time", ("toppra",)),
}
"""What needs each extra, in the plural, and the packages that it installs."""
# OMPL and toppra have packages for Linux alone.
LINUX_ALONE = ("planning", "timing")


def install_command(extra: str) -> str:
    """Return the command that installs an extra, in a checkout of this project; "" for none."""
    is_offered = extra not in LINUX_ALONE or sys.platform == "linux"
    return f'pip install ".[{extra}]"' if is_offered else ""


def need_of(extra: str) -> str:
    """Return the features that need an extra, and how to install it, as the end of a sentence."""
    how = install_command(extra) or "it has packages for Linux alone"
    return f"{EXTRAS[extra][0]} need the extra {extra}: {how}"


@functools.cache
def is_missing(extra: str | None) -> bool:
    """Whether a package of an extra is not installed, if one is given; nothing is imported."""
    return extra is not None and any(find_spec(name) is None for name in EXTRAS[extra][1])


def check_extra(extra: str) -> None:
    """Check that an extra is installed.

    Raises:
        MissingExtraError: It is not.
    """
    if is_missing(extra):
        raise MissingExtraError(need_of(extra))


def load_extra(extra: str, *modules: str) -> list[Any]:
    """Return modules of an extra by their full names.

    Raises:
        MissingExtraError: One is not installed; the message says how to install it.
    """
    try:
        with warnings.catch_warnings(action="ignore"):  # Python's about the sources of toppra.
            return [importlib.import_module(name) for name in modules]
    except ImportError:
        raise MissingExtraError(need_of(extra)) from None
