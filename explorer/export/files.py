"""Files written whole or not at all."""

from __future__ import annotations

import contextlib
import os
import uuid
from pathlib import Path

from explorer.errors import InputError


def check_writable(path: Path) -> None:
    """Find out before the work whether a file can be written.

    Raises:
        InputError: no such folder, one that takes no file, or no plain file.
    """
    _refuse_odd(path)
    scratch = _beside(path)
    try:
        # Permission bits tell less than trying: superusers and read-only disks.
        scratch.open("xb").close()
        scratch.unlink()
    except OSError as error:
        raise _refusal(path, error) from None


def write_whole(path: Path, data: bytes) -> None:
    """Write a file, or replace one: it is never seen with only a part of its contents.

    Raises:
        InputError: it cannot be written; what was there before is unchanged.
    """
    _refuse_odd(path)
    scratch = _beside(path)
    try:
        with scratch.open("xb") as file:
            file.write(data)
            file.flush()
            os.fsync(file.fileno())
        # A link stays one, and what it points to is replaced.
        scratch.replace(path.resolve())
    except OSError as error:
        raise _refusal(path, error) from None
    finally:
        with contextlib.suppress(OSError):
            scratch.unlink()


def _beside(path: Path) -> Path:
    """Return an unused name in the same folder, since only there replacing is atomic."""
    return path.resolve().parent / f".{uuid.uuid4().hex}.part"


def _refuse_odd(path: Path) -> None:
    if path.is_dir():
        raise InputError(f"cannot write {str(path)!r}: it is a folder")
    if path.exists() and not path.is_file():
        raise InputError(f"cannot write {str(path)!r}: it is no plain file")
    if not path.resolve().parent.is_dir():
        raise InputError(
            f"cannot write {str(path)!r}: there is no folder {str(path.parent)!r}; make it first"
        )


def _refusal(path: Path, error: OSError) -> InputError:
    return InputError(f"cannot write {str(path)!r}: {error.strerror}")
