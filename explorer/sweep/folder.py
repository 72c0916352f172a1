"""The lock and the checks of a results folder while a study is computed in it."""

from __future__ import annotations

import contextlib
from collections.abc import Generator
from pathlib import Path

from filelock import FileLock, Timeout

from explorer.errors import InputError
from explorer.files.writing import make_folder, storage_error
from explorer.sweep.parts import BadPartError, part_paths, read_part, words_of_paths
from explorer.sweep.study import Study, study_hash

LOCK_FILE = ".lock"
"""Name of the lock in a results folder; readers of Parquet folders ignore it."""


@contextlib.contextmanager
def claim(folder: Path, study: Study) -> Generator[None]:
    """Make a folder if needed, and lock it for a study within a `with` block.

    Raises:
        InputError: the folder belongs to another study, or is in use.
        StorageError: the folder cannot be made or read.
    """
    make_folder(folder)
    # A folder of other files is left alone: not even a lock goes into it.
    _check_owner(folder, study)
    lock = FileLock(folder / LOCK_FILE, timeout=0)
    try:
        lock.acquire()
    except Timeout:
        raise InputError(
            f"another process is computing in {str(folder)!r}: wait for it, or use another folder"
        ) from None
    except OSError as error:
        raise InputError(f"cannot lock {str(folder)!r}: {error.strerror}") from None
    try:
        _check_owner(folder, study)
        for path in folder.iterdir():
            # A killed process was writing it.
            if _is_scratch(path) and path.name != LOCK_FILE:
                path.unlink(missing_ok=True)
        yield
    finally:
        lock.release()


def _check_owner(folder: Path, study: Study) -> None:
    """Raise an `InputError` unless a folder is this study's, or empty."""
    parts = part_paths(folder)
    for path in parts:
        with contextlib.suppress(BadPartError):
            if read_part(path, [])[0].study_hash != study_hash(study):
                raise InputError(
                    f"{str(folder)!r} holds the results of another study; use another folder, or "
                    "move them away"
                )
            break
    else:
        if parts:
            raise InputError(
                f"{str(folder)!r} is not empty, and holds no results of a study that can be read: "
                f"{words_of_paths(parts)} cannot be read and may belong to any study; move such "
                "files away, and the same command computes them again"
            )
        try:
            is_used = any(not _is_scratch(path) for path in folder.iterdir())
        except OSError as error:
            raise storage_error("read", folder, error) from None
        if is_used:
            raise InputError(
                f"{str(folder)!r} is not empty, and holds no results of a study: use another folder"
            )


def _is_scratch(path: Path) -> bool:
    return path.name == LOCK_FILE or (path.name.startswith(".part-") and path.suffix == ".part")
