"""Requests to a worker that failed unexpectedly, saved to be run again.

Each is a JSON file: text for people, and the whole request as a pickle. A request holds designs,
poses and options, and that of a study the path of its folder, as the traceback holds paths. Of
each kind of fault the newest request is kept, and of many kinds the newest.
"""

from __future__ import annotations

import base64
import binascii
import contextlib
import datetime as dt
import hashlib
import pickle
import re
import sys
import zlib
from dataclasses import dataclass
from pathlib import Path
from typing import Any, TextIO

import msgspec

from explorer.errors import InputError, StorageError
from explorer.files.json_text import decode_strictly
from explorer.files.versions import versions
from explorer.files.writing import make_folder, read_at_most, write_whole

FAULTS_FOLDER = "faults"
"""Name of the folder in the user's data folder."""

MOST_FILES = 20
# Largest number of characters of the packed request, of the file, and of each argument's text.
MOST_PACKED = 8_000_000
MOST_FILE = MOST_PACKED + 1_000_000
MOST_TEXT = 2_000
# Number of characters of a traceback that are kept, those at its end.
MOST_TRACE = 100_000
# A line of a traceback that names a place in the code.
PLACE = re.compile(r'^  File ".*$', re.MULTILINE)


@dataclass(frozen=True)
class Fault:
    """A request that failed, and how.

    Attributes:
        module: Module of the task.
        task: Name of the task in its module.
        arguments: All arguments of the task, except its channel.
        is_sending: Whether the task takes a channel to its parent.
        problem: The error in one line.
        trace: The traceback; "" if the process died.
    """

    module: str
    task: str
    arguments: tuple[Any, ...]
    is_sending: bool
    problem: str
    trace: str = ""

    @property
    def kind(self) -> str:
        """Sixteen hexadecimal digits, the same for faults that were raised in the same place."""
        # The message is left out, as it may have numbers in it.
        place = "\n".join(PLACE.findall(self.trace)) or self.problem
        text = "\n".join((self.module, self.task, place))
        return hashlib.sha256(text.encode()).hexdigest()[:16]


class Faults:
    """The folder in which requests that failed are saved.

    Args:
        folder: The folder, made when it is first needed.
    """

    def __init__(self, folder: Path) -> None:
        self.folder = folder

    def save(self, fault: Fault) -> str:
        """Save a request; return a message that says where it is, or why it is not saved."""
        path = self.folder / f"{fault.task}-{fault.kind}.json"
        try:
            make_folder(self.folder)
            write_whole(path, encode_fault(fault))
        # Text with half of a surrogate pair cannot be encoded.
        except (StorageError, OSError, UnicodeError) as error:
            return f"the request could not be kept: {error}"
        # Another explorer may remove the same files.
        with contextlib.suppress(OSError):
            self._remove_oldest()
        return f"the request is kept in {str(path)!r}"

    def _remove_oldest(self) -> None:
        paths = sorted(self.folder.glob("*.json"), key=lambda path: path.stat().st_mtime_ns)
        for path in paths[:-MOST_FILES]:
            path.unlink(missing_ok=True)


def log_fault(fault: Fault, message: str, faults: Faults | None) -> str:
    """Save a fault, write its traceback and the message to standard error; return the message.

    Args:
        fault: The request, and how it failed.
        message: Message for people; it is extended by where the request is saved.
        faults: Where to save the request; None to save nothing.
    """
    if faults is not None:
        message = f"{message}; {faults.save(fault)}"
    # A process started with its output closed has no log.
    log: TextIO | None = sys.stderr
    if log is not None:
        # An exception here would end the thread that serves the worker.
        with contextlib.suppress(OSError, ValueError):
            log.write(f"{fault.trace}{message}\n")
    return message


class _File(msgspec.Struct, frozen=True, forbid_unknown_fields=True):
    """The contents of a file; `packed` is None where the request was far too large."""

    problem: str
    module: str
    task: str
    is_sending: bool = msgspec.field(name="tells")
    when: str
    versions: dict[str, str]
    traceback: tuple[str, ...]
    arguments: tuple[str, ...]
    packed: str | None


def encode_fault(fault: Fault) -> bytes:
    """Return the file of a fault, without the request if that is far too large."""
    data = pickle.dumps(fault.arguments, protocol=pickle.HIGHEST_PROTOCOL)
    packed = base64.b64encode(zlib.compress(data)).decode()
    file = _File(
        problem=fault.problem,
        module=fault.module,
        task=fault.task,
        is_sending=fault.is_sending,
        when=dt.datetime.now(dt.UTC).isoformat(timespec="seconds"),
        versions=versions(),
        traceback=tuple(fault.trace[-MOST_TRACE:].splitlines()),
        arguments=tuple(map(_short_text, fault.arguments)),
        packed=packed if len(packed) <= MOST_PACKED else None,
    )
    return msgspec.json.format(msgspec.json.encode(file), indent=1)


def read_fault(path: Path) -> Fault:
    """Return the fault in a file.

    Unpickling can run code, so only a file that one's own explorer wrote may be read.

    Raises:
        InputError: not the file of a fault, or one without the request.
        StorageError: it cannot be read.
    """
    file = decode_strictly(read_at_most(path, MOST_FILE), _File, str(path))
    if file.packed is None:
        raise InputError(f"{str(path)!r} lacks the request, which was too large to be kept")
    try:
        data = zlib.decompress(base64.b64decode(file.packed, validate=True))
        arguments = pickle.loads(data)  # noqa: S301 - see above
    except (binascii.Error, zlib.error, pickle.UnpicklingError, EOFError) as error:
        raise InputError(f"the request in {str(path)!r} cannot be read: {error}") from None
    except (AttributeError, ImportError, TypeError) as error:
        made_by = ", ".join(f"{name} {number}" for name, number in file.versions.items())
        raise InputError(
            f"the request in {str(path)!r} was made by other versions ({made_by}): {error}"
        ) from None
    trace = "\n".join(file.traceback)
    return Fault(file.module, file.task, tuple(arguments), file.is_sending, file.problem, trace)


def _short_text(argument: object) -> str:
    text = repr(argument)
    return text if len(text) <= MOST_TEXT else f"{text[:MOST_TEXT]} …"
