"""A results folder while a study is computed in it: nobody else's, and of no other study."""

from __future__ import annotations

import contextlib
from collections.abc import Generator
from pathlib import Path

from filelock import FileLock, Timeout

from explorer.errors import InputError
from explorer.files.writing import make_folder, storage_error
from explorer.sweep.parts import BadPartError, part_paths, read_part
from explorer.sweep.study import Study, study_hash

LOCK_FILE = ".lock"
"""In a results folder; readers of Parquet folders pass over it."""


@contextlib.contextmanager
def claimed(folder: Path, study: Study) -> Generator[None]:
    """Keep a folder for a study and other processes from it meanwhile; make it if need be.

    Raises:
        InputError: it belongs to another study, or is in use.
        StorageError: it cannot be made, or not be read.
    """
    make_folder(folder)
    # Nothing is left, not even a lock, in a folder of somebody else's.
    _check(folder, study)
    with _locked(folder):
        _check(folder, study)
        _clear(folder)
        yield


@contextlib.contextmanager
def _locked(folder: Path) -> Generator[None]:
    """Keep other processes from the folder meanwhile."""
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
        yield
    finally:
        lock.release()


def _check(folder: Path, study: Study) -> None:
    """See that a folder is this study's, or empty."""
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
            more = f" and {len(parts) - 1} more" if len(parts) > 1 else ""
            raise InputError(
                f"{str(folder)!r} is not empty, and holds no results of a study that can be read: "
                f"{parts[0].name}{more} cannot be, and may be of any study; move what cannot be "
                "read away, and the same command computes it again"
            )
        try:
            is_used = any(not _is_scratch(each) for each in folder.iterdir())
        except OSError as error:
            raise storage_error("read", folder, error) from None
        if is_used:
            raise InputError(
                f"{str(folder)!r} is not empty, and holds no results of a study: use another folder"
            )


def _clear(folder: Path) -> None:
    """Remove what a killed process was writing."""
    for path in folder.iterdir():
        if _is_scratch(path) and path.name != LOCK_FILE:
            path.unlink(missing_ok=True)


def _is_scratch(path: Path) -> bool:
    return path.name == LOCK_FILE or (path.name.startswith(".part-") and path.suffix == ".part")
