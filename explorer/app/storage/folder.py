"""The user's data folder, and folders that several explorers share."""

from __future__ import annotations

import contextlib
import os
import unicodedata
from collections.abc import Generator
from pathlib import Path

from filelock import FileLock, Timeout
from platformdirs import user_data_path

from explorer.errors import StorageError
from explorer.files.writing import make_folder, storage_error

NAME = "flagged-explorer"

OVERRIDE = "EXPLORER_DATA"
"""The environment variable that names another folder."""

LOCK = ".lock"
"""Name of the file in a folder that is locked while one explorer changes the folder."""

# Changes to a folder take milliseconds; an explorer that locks it for longer is stuck.
PATIENCE_SECONDS = 5.0


def data_folder() -> Path:
    """Return the folder of the user's data; it need not exist yet."""
    named = os.environ.get(OVERRIDE)
    if named:
        return Path(named).expanduser().absolute()
    return user_data_path(NAME, appauthor=False)


def plain_words(name: str, most: int) -> str:
    """Return the ASCII letters and digits of a name, words joined by hyphens; "" without any.

    Args:
        name: Any name.
        most: Number of characters at most.
    """
    plain = unicodedata.normalize("NFKD", name).encode("ascii", "ignore").decode()
    return "-".join("".join(c if c.isalnum() else " " for c in plain).split())[:most].strip("-")


def make_data_folder(folder: Path) -> Path:
    """Make a folder of the user's data unless it exists; return it.

    Raises:
        StorageError: it cannot be made.
    """
    try:
        make_folder(folder)
    except StorageError as error:
        raise StorageError(f"{error}; or name another folder in {OVERRIDE}") from None
    return folder


@contextlib.contextmanager
def lock_folder(folder: Path) -> Generator[None]:
    """Keep other explorers from changing a folder, which is made if need be.

    Raises:
        StorageError: it cannot be made or locked, or another explorer locks it for too long.
    """
    make_data_folder(folder)
    lock = _lock(folder / LOCK, PATIENCE_SECONDS)
    if lock is None:
        raise StorageError(
            f"another explorer has been working in {str(folder)!r} for {PATIENCE_SECONDS:g} "
            "seconds; try again, or close it"
        )
    try:
        yield
    finally:
        lock.release()


def try_lock(path: Path) -> FileLock | None:
    """Lock a file until the lock is released or this process ends; None if it is locked already.

    Raises:
        StorageError: it can be neither opened nor made.
    """
    return _lock(path, 0.0)


def _lock(path: Path, patience: float) -> FileLock | None:
    lock = FileLock(path, thread_local=False)
    try:
        lock.acquire(timeout=patience, blocking=patience > 0.0)
    except Timeout:
        return None
    except OSError as error:
        raise storage_error("lock", path, error) from None
    return lock
