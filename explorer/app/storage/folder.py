"""The user's data folder, and folders that several explorers share."""

from __future__ import annotations

import contextlib
import os
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
"""The file in a folder that is locked while one explorer changes what is in it."""

# What is done in a folder takes milliseconds; who holds it longer is stuck.
PATIENCE_SECONDS = 5.0


def data_folder() -> Path:
    """Return the folder of the user's data; it need not be there yet."""
    named = os.environ.get(OVERRIDE)
    if named:
        return Path(named).expanduser().absolute()
    return user_data_path(NAME, appauthor=False)


def made_folder(folder: Path) -> Path:
    """Return a folder of the user's data, made if it was not there.

    Raises:
        StorageError: it cannot be made.
    """
    try:
        make_folder(folder)
    except StorageError as error:
        raise StorageError(f"{error}; or name another folder in {OVERRIDE}") from None
    return folder


@contextlib.contextmanager
def alone_in(folder: Path, patience: float | None = None) -> Generator[None]:
    """Keep other explorers from changing what is in a folder, which is made if need be.

    Args:
        folder: The folder.
        patience: Seconds to wait for another explorer.

    Raises:
        StorageError: it cannot be had, or another explorer keeps it for too long.
    """
    made_folder(folder)
    patience = PATIENCE_SECONDS if patience is None else patience
    lock = FileLock(folder / LOCK, thread_local=False)
    try:
        lock.acquire(timeout=patience)
    except Timeout:
        raise StorageError(
            f"another explorer has been working in {str(folder)!r} for {patience:g} seconds; "
            "try again, or close it"
        ) from None
    except OSError as error:
        raise storage_error("lock", folder / LOCK, error) from None
    try:
        yield
    finally:
        lock.release()


def taken(path: Path) -> FileLock | None:
    """Return a lock file, locked until it is released or this process ends; None if it is taken.

    Raises:
        StorageError: it can be neither opened nor made.
    """
    lock = FileLock(path, thread_local=False)
    try:
        lock.acquire(blocking=False)
    except Timeout:
        return None
    except OSError as error:
        raise storage_error("lock", path, error) from None
    return lock
