"""Requests to a worker that failed through no fault of theirs, kept to be run again.

Each is a JSON file: what people need to know is text, and the request itself is in it whole, as
a pickle. A request holds designs, poses and options, and that of a study the path of its folder, as
the traceback holds paths. Of each kind of fault the newest request is kept, and of many kinds the
newest.
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
"""The name of the folder in the user's data."""

MOST_FILES = 20
# Characters of the packed request, of the file, and of each argument as it is shown to people.
MOST_PACKED = 8_000_000
MOST_FILE = MOST_PACKED + 1_000_000
MOST_SHOWN = 2_000
# Characters of a traceback, of which the end says most.
MOST_TRACE = 100_000
# The lines of a traceback that tell a place in the code.
PLACE = re.compile(r'^  File ".*$', re.MULTILINE)


@dataclass(frozen=True)
class Fault:
    """A request that failed, and how.

    Attributes:
        module: The module that holds the task.
        task: The name of the task in it.
        arguments: All arguments of the task, but for its line to the parent.
        tells: Whether the task takes such a line.
        problem: The error in one line.
        trace: The traceback; "" if the process died.
    """

    module: str
    task: str
    arguments: tuple[Any, ...]
    tells: bool
    problem: str
    trace: str = ""

    @property
    def kind(self) -> str:
        """Sixteen characters, the same for faults that were raised in the same place."""
        # The message, which may have numbers in it, is left out.
        place = "\n".join(PLACE.findall(self.trace)) or self.problem
        text = "\n".join((self.module, self.task, place))
        return hashlib.sha256(text.encode()).hexdigest()[:16]


class Faults:
    """The folder in which requests that failed are kept.

    Args:
        folder: The folder; it is made when it is first needed.
    """

    def __init__(self, folder: Path) -> None:
        self.folder = folder

    def keep(self, fault: Fault) -> str:
        """Keep a request, and return in words where it is, or why it could not be kept."""
        path = self.folder / f"{fault.task}-{fault.kind}.json"
        try:
            make_folder(self.folder)
            write_whole(path, encode_fault(fault))
        # Text with half a character in it cannot be encoded.
        except (StorageError, OSError, UnicodeError) as error:
            return f"the request could not be kept: {error}"
        # Another explorer may remove the same files.
        with contextlib.suppress(OSError):
            self._forget_oldest()
        return f"the request is kept in {str(path)!r}"

    def _forget_oldest(self) -> None:
        paths = sorted(self.folder.glob("*.json"), key=lambda path: path.stat().st_mtime_ns)
        for path in paths[:-MOST_FILES]:
            path.unlink(missing_ok=True)


def log_fault(fault: Fault, message: str, faults: Faults | None) -> str:
    """Keep a fault, write its traceback and the message to the log, and return the message.

    The log is standard error. The message returned tells where the request is kept.

    Args:
        fault: The request, and how it failed.
        message: For people.
        faults: Where to keep the request; None to keep nothing.
    """
    if faults is not None:
        message = f"{message}; {faults.keep(fault)}"
    # A process started with its output closed has no log.
    log: TextIO | None = sys.stderr
    if log is not None:
        # What is raised here would end the thread that serves the worker.
        with contextlib.suppress(OSError, ValueError):
            log.write(f"{fault.trace}{message}\n")
    return message


class _File(msgspec.Struct, frozen=True, forbid_unknown_fields=True):
    """What a file holds; `packed` is None where the request was far too large."""

    problem: str
    module: str
    task: str
    tells: bool
    when: str
    versions: dict[str, str]
    traceback: tuple[str, ...]
    arguments: tuple[str, ...]
    packed: str | None


def encode_fault(fault: Fault) -> bytes:
    """Return the file of a fault; a request that is far too large is left out of it."""
    data = pickle.dumps(fault.arguments, protocol=pickle.HIGHEST_PROTOCOL)
    packed = base64.b64encode(zlib.compress(data)).decode()
    file = _File(
        problem=fault.problem,
        module=fault.module,
        task=fault.task,
        tells=fault.tells,
        when=dt.datetime.now(dt.UTC).isoformat(timespec="seconds"),
        versions=versions(),
        traceback=tuple(fault.trace[-MOST_TRACE:].splitlines()),
        arguments=tuple(map(_shown, fault.arguments)),
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
    return Fault(file.module, file.task, tuple(arguments), file.tells, file.problem, trace)


def _shown(argument: object) -> str:
    text = repr(argument)
    return text if len(text) <= MOST_SHOWN else f"{text[:MOST_SHOWN]} …"
