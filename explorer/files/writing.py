"""Files written whole or not at all, and folders made for them.

A file is written beside its place, forced to the disk and moved there in one step, and the
move is forced to the disk too: a kill or a power failure at any moment leaves the old file
or the new one.
"""

from __future__ import annotations

import contextlib
import errno
import os
import sys
import time
import uuid
from collections.abc import Generator
from pathlib import Path

from explorer.errors import StorageError

# What would work, by what the system says.
_REMEDIES = {
    errno.ENOSPC: "make room on that disk, or write elsewhere",
    errno.EDQUOT: "make room within your quota, or write elsewhere",
    errno.EFBIG: "write to a disk that takes larger files",
    errno.EACCES: "choose a folder in which you may write",
    errno.EPERM: "choose a folder in which you may write",
    errno.EROFS: "choose a folder on a disk that can be written",
    errno.ENAMETOOLONG: "choose a shorter name",
    errno.EEXIST: "a file lies where the folder is meant: move it away",
    errno.ENOTDIR: "a file lies where a folder is meant: move it away",
}

# Windows refuses to replace a file while anything else, such as a virus scanner, reads it.
_TRIES, _PAUSE_SECONDS = (20, 0.05) if sys.platform == "win32" else (1, 0.0)

# Characters of a file's name that its scratch file begins with.
_BEGINNING = 32


def check_writable(path: Path) -> None:
    """Find out before the work whether a file can be written.

    Raises:
        StorageError: no such folder, one that takes no file, or no plain file.
    """
    with _refusing("write", path):
        _refuse_odd(path)
        scratch = _beside(path)
        # Permission bits tell less than trying: superusers and read-only disks.
        scratch.open("xb").close()
        scratch.unlink()


def write_whole(path: Path, data: bytes) -> None:
    """Write a file, or replace one: it is never seen with only a part of its contents.

    Raises:
        StorageError: it cannot be written; what was there before is unchanged.
    """
    with _refusing("write", path):
        _refuse_odd(path)
        scratch = _beside(path)
        try:
            with scratch.open("xb") as file:
                file.write(data)
                file.flush()
                os.fsync(file.fileno())
            # A link stays one, and what it points to is replaced.
            target = path.resolve()
            _replace(scratch, target)
            _sync_folder(target.parent)
        finally:
            with contextlib.suppress(OSError):
                scratch.unlink()


def read_at_most(path: Path, largest: int) -> bytes:
    """Return the contents of a plain file.

    Args:
        path: The file.
        largest: Number of bytes that it may have.

    Raises:
        StorageError: it cannot be read, is no plain file, or is larger.
    """
    with _refusing("read", path):
        # To open a pipe would wait for someone to write to it.
        if path.exists() and not path.is_file():
            raise StorageError(f"cannot read {str(path)!r}: it is no plain file")
        with path.open("rb") as file:
            data = file.read(largest + 1)
    if len(data) > largest:
        raise StorageError(f"cannot read {str(path)!r}: it is larger than {largest} bytes")
    return data


def make_folder(path: Path) -> None:
    """Make a folder for its owner alone, and those above it, unless it is there.

    Raises:
        StorageError: it cannot be made.
    """
    with _refusing("make the folder", path):
        path.mkdir(mode=0o700, parents=True, exist_ok=True)


def move(source: Path, target: Path) -> None:
    """Move a file within a disk in one step; a file in its place is replaced.

    Raises:
        StorageError: it cannot be moved; both are unchanged.
    """
    with _refusing("write", target):
        _replace(source, target)
        _sync_folder(target.parent)


def _replace(source: Path, target: Path) -> None:
    """Move a file in one step, waiting for readers where the system cannot do without."""
    for last in range(1, _TRIES + 1):
        try:
            source.replace(target)
        except PermissionError:
            if last == _TRIES:
                raise
            time.sleep(_PAUSE_SECONDS)
        else:
            return


def _sync_folder(folder: Path) -> None:
    """Force the entries of a folder to the disk, where the system can."""
    if sys.platform == "win32":
        return
    # Some network file systems cannot, and what was moved is there all the same.
    with contextlib.suppress(OSError):
        descriptor = os.open(folder, os.O_RDONLY)
        try:
            os.fsync(descriptor)
        finally:
            os.close(descriptor)


def refusal(doing: str, path: Path, error: OSError) -> StorageError:
    """Return in one line what could not be done with a path, why, and what would work."""
    remedy = _REMEDIES.get(error.errno or 0)
    reason = error.strerror or str(error) or type(error).__name__
    return StorageError(
        f"cannot {doing} {str(path)!r}: {reason}" + (f"; {remedy}" if remedy else "")
    )


@contextlib.contextmanager
def _refusing(doing: str, path: Path) -> Generator[None]:
    """Tell what fails in one line for people."""
    try:
        yield
    except OSError as error:
        raise refusal(doing, path, error) from None
    except StorageError:
        raise
    except ValueError as error:
        # A name with null characters, which no system gets to see.
        raise StorageError(f"cannot {doing} {str(path)!r}: {error}") from None


def _beside(path: Path) -> Path:
    """Return an unused name in the same folder, since only there replacing is atomic."""
    return path.resolve().parent / f".{path.name[:_BEGINNING]}.{uuid.uuid4().hex}.part"


def _refuse_odd(path: Path) -> None:
    if path.is_dir():
        raise StorageError(f"cannot write {str(path)!r}: it is a folder")
    if path.exists() and not path.is_file():
        raise StorageError(f"cannot write {str(path)!r}: it is no plain file")
    if not path.resolve().parent.is_dir():
        raise StorageError(
            f"cannot write {str(path)!r}: there is no folder {str(path.parent)!r}; make it first"
        )
