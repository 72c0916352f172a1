"""Atomic writing and moving of files, the folders for them, and archives.

A file is written to a scratch file in the same folder, forced to the disk and renamed in one
step, and the folder's entry is forced to the disk too: a kill or a power failure at any moment
leaves either the old file or the new one.
"""

from __future__ import annotations

import contextlib
import errno
import io
import os
import shutil
import sys
import time
import uuid
import zipfile
from collections.abc import Generator, Mapping
from pathlib import Path

from explorer.errors import StorageError

LARGEST_FILE = 200_000_000
"""Largest file that is read, in bytes; those that the explorer writes are much smaller."""

# Remedy for each error of the system.
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

# Number of characters of a file's name in the name of its scratch file.
_SCRATCH_CHARACTERS = 32


def check_writable(path: Path) -> None:
    """Check that a file can be written, for use before long work.

    Raises:
        StorageError: The folder does not exist or takes no file, or the path is no plain file.
    """
    with _storage_errors("write", path):
        scratch = _scratch_path(path)
        # Permission bits mislead on read-only disks and for superusers, so try it.
        scratch.open("xb").close()
        scratch.unlink()


def write_whole(path: Path, data: bytes) -> None:
    """Write or replace a file atomically: no reader sees a part of its contents.

    A file that replaces another one has its permissions.

    Raises:
        StorageError: The file cannot be written; one that existed is unchanged.
    """
    with _storage_errors("write", path):
        scratch = _scratch_path(path)
        # A link stays a link, and its target is replaced.
        target = _target_of(path)
        try:
            with scratch.open("xb") as file:
                if target.exists():
                    shutil.copymode(target, scratch)
                file.write(data)
                file.flush()
                os.fsync(file.fileno())
            _replace(scratch, target)
            _sync_folder(target.parent)
        finally:
            with contextlib.suppress(OSError):
                scratch.unlink()


def read_at_most(path: Path, largest: int = LARGEST_FILE) -> bytes:
    """Return the contents of a plain file that has no more than a number of bytes.

    Raises:
        StorageError: The file cannot be read, is no plain file, or is larger.
    """
    with _storage_errors("read", path):
        # Opening a pipe would block until another process writes to it.
        if path.exists() and not path.is_file():
            raise StorageError(f"cannot read {str(path)!r}: it is no plain file")
        with path.open("rb") as file:
            data = file.read(largest + 1)
    if len(data) > largest:
        raise StorageError(f"cannot read {str(path)!r}: it is larger than {largest} bytes")
    return data


def make_folder(path: Path, mode: int = 0o700) -> None:
    """Make a folder, and missing ones above it, by default accessible to its owner alone.

    A folder that exists is left unchanged.

    Raises:
        StorageError: The folder cannot be made.
    """
    with _storage_errors("make the folder", path):
        path.mkdir(mode, parents=True, exist_ok=True)


def move(source: Path, target: Path) -> None:
    """Move a file within a disk in one step; a file at the target is replaced.

    Raises:
        StorageError: The file cannot be moved; source and target are unchanged.
    """
    with _storage_errors("write", target):
        _replace(source, target)
        _sync_folder(target.parent)


def _replace(source: Path, target: Path) -> None:
    """Move a file in one step; retry on a system that refuses while the target is being read."""
    for attempt in range(1, _TRIES + 1):
        try:
            source.replace(target)
        except PermissionError:
            if attempt == _TRIES:
                raise
            time.sleep(_PAUSE_SECONDS)
        else:
            return


def _sync_folder(folder: Path) -> None:
    """Force the entries of a folder to the disk, if the system supports it."""
    if sys.platform == "win32":
        return
    # Some network file systems do not support it; the file has been moved all the same.
    with contextlib.suppress(OSError):
        descriptor = os.open(folder, os.O_RDONLY)
        try:
            os.fsync(descriptor)
        finally:
            os.close(descriptor)


def zip_bytes(files: Mapping[str, bytes]) -> bytes:
    """Return a ZIP archive of files by their names; equal files give equal archives."""
    data = io.BytesIO()
    with zipfile.ZipFile(data, "w", zipfile.ZIP_DEFLATED) as archive:
        for name, each in files.items():
            # An entry without a date.
            entry = zipfile.ZipInfo(name)
            entry.compress_type, entry.external_attr = zipfile.ZIP_DEFLATED, 0o644 << 16
            archive.writestr(entry, each)
    return data.getvalue()


def storage_error(operation: str, path: Path, error: OSError) -> StorageError:
    """Return the error, in one line: the failed operation, the path, the reason and the remedy."""
    remedy = _REMEDIES.get(error.errno or 0)
    reason = error.strerror or str(error) or type(error).__name__
    reason = broken_link(path) or reason + (f"; {remedy}" if remedy else "")
    return StorageError(f"cannot {operation} {str(path)!r}: {reason}")


def broken_link(path: Path) -> str:
    """Return a clause on the link that keeps a path from leading anywhere; "" if there is none.

    The path itself or a folder above it is a link whose target does not exist.
    """
    for each in (path, *path.parents):
        with contextlib.suppress(OSError, ValueError):
            if each.is_symlink() and not os.path.exists(each):  # noqa: PTH110 - takes loops
                name = "it" if each == path else repr(str(each))
                target = os.readlink(each)  # noqa: PTH115 - as the link has it
                return f"{name} is a link that leads nowhere, to {target!r}: mend or remove it"
    return ""


@contextlib.contextmanager
def _storage_errors(operation: str, path: Path) -> Generator[None]:
    """Raise the errors of an operation on a path as `StorageError` with one line."""
    try:
        yield
    except OSError as error:
        raise storage_error(operation, path, error) from None
    except StorageError:
        raise
    except ValueError as error:
        # Python refuses a name with null characters before the system does.
        raise StorageError(f"cannot {operation} {str(path)!r}: {error}") from None


def _scratch_path(path: Path) -> Path:
    """Return an unused path in the folder of a file to write, as a rename is atomic only there."""
    if path.is_dir():
        raise StorageError(f"cannot write {str(path)!r}: it is a folder")
    if path.exists() and not path.is_file():
        raise StorageError(f"cannot write {str(path)!r}: it is no plain file")
    target = _target_of(path)
    # Links in a circle lead to one of them.
    if target.is_symlink() or not target.parent.is_dir():
        missing = f"there is no folder {str(path.parent)!r}; make it first"
        raise StorageError(f"cannot write {str(path)!r}: {broken_link(path) or missing}")
    return target.parent / f".{path.name[:_SCRATCH_CHARACTERS]}.{uuid.uuid4().hex}.part"


def _target_of(path: Path) -> Path:
    """Return the path to which links lead; `Path.resolve` may raise where they form a circle."""
    return Path(os.path.realpath(path))
