"""The user's data folder and its locks."""

from __future__ import annotations

import contextlib
import os
import unicodedata
from pathlib import Path

from filelock import FileLock, Timeout
from platformdirs import user_data_path

from explorer.errors import StorageError
from explorer.files.writing import make_folder, storage_error

NAME = "flagged-explorer"

OVERRIDE = "EXPLORER_DATA"
"""The environment variable that names another folder."""


def data_folder() -> Path:
    """Return the folder of the user's data; it need not exist yet."""
    named = os.environ.get(OVERRIDE)
    if named:
        return Path(named).expanduser().absolute()
    return user_data_path(NAME, appauthor=False)


def plain_words(name: str, most: int) -> str:
    """Return the ASCII letters and digits of a name, words joined by hyphens; "" without any.

    They are as many characters as given at most.
    """
    plain = unicodedata.normalize("NFKD", name).encode("ascii", "ignore").decode()
    return "-".join("".join(c if c.isalnum() else " " for c in plain).split())[:most].strip("-")


def make_data_folder(folder: Path) -> Path:
    """Make a folder of the user's data unless it exists; return it.

    Raises:
        StorageError: It cannot be made.
    """
    try:
        make_folder(folder)
    except StorageError as error:
        raise StorageError(f"{error}; or name another folder in {OVERRIDE}") from None
    return folder


def newest_first(folder: Path) -> list[Path]:
    """Return the JSON files of a folder, the one changed last first."""
    files: list[tuple[int, Path]] = []
    # Another explorer may remove one meanwhile, and the folder need not be there.
    for path in folder.glob("[!.]*.json"):
        with contextlib.suppress(OSError):
            files.append((-path.lstat().st_mtime_ns, path))
    return [path for _, path in sorted(files)]


def try_lock(path: Path) -> FileLock | None:
    """Lock a file until the lock is released or this process ends; None if it is locked already.

    Raises:
        StorageError: The file of the lock beside it can be neither opened nor made.
    """
    lock = FileLock(path.with_suffix(".lock"), thread_local=False)
    try:
        lock.acquire(blocking=False)
    except Timeout:
        return None
    except OSError as error:
        raise storage_error("lock", path, error) from None
    return lock
