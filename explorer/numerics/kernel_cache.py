"""The object code of kernels: packaged for common processors, else in a cache on each machine.

The key of a kernel is a fingerprint of its own source, of the functions that it calls and of
the constants that it names. A change in other code, a second checkout and a new installation
therefore use the same entries. What is not packaged is compiled once on a machine, by a child
process, because compiling holds the interpreter lock for seconds; a lock in the cache keeps a
second process from compiling the same kernels. Kernels that a caller waits for are compiled
first, the others in the order of their code's length.
"""

from __future__ import annotations

import contextlib
import functools
import hashlib
import importlib
import linecache
import os
import re
import subprocess
import sys
import threading
import time
from collections.abc import Callable, Container, Iterable, Iterator
from importlib.resources.abc import Traversable
from pathlib import Path
from types import CodeType, FunctionType
from typing import Any

import platformdirs
from filelock import FileLock, Timeout

from explorer.errors import StorageError
from explorer.files.packaged import SOURCES, packaged_files
from explorer.files.writing import write_whole
from explorer.numerics.object_code import OPTIONS, processor

# Folder of the object code that comes with the explorer, a folder for each processor.
PACKAGED = "kernels"
# End of the names of files with object code.
SUFFIX = ".o"
# Number of bytes of the digest before the code in a file.
DIGEST = hashlib.sha256().digest_size
# Exit status of a compiling process if another one holds the lock.
BUSY = 75
# Number of hexadecimal digits of a fingerprint.
DIGITS = 16
# Seconds between two checks of the cache: while a caller waits for a kernel, and otherwise.
URGENT_SECONDS, POLL_SECONDS = 0.02, 0.2
# Seconds after which unused compiled code is removed.
UNUSED_SECONDS = 30 * 24 * 3600


class Entry:
    """The entry of a kernel in the cache.

    Args:
        function: Python function of the kernel.
        helpers: Functions that kernels may call.
        signature: The kernel's type signature for Numba.
        compile_here: Function that compiles the kernel in this process and returns its object code.

    Attributes:
        module: Name of the module that defines the kernel.
        name: Name of the kernel in its module.
        fingerprint: Hexadecimal digits that change with the compiled code.
        effort: Bytes of Python code to compile, a measure of the time that compiling takes.
    """

    def __init__(
        self,
        function: Callable[..., Any],
        helpers: Container[Callable[..., Any]],
        signature: str,
        compile_here: Callable[[], bytes],
    ) -> None:
        self.module, self.name = function.__module__, function.__name__
        self.fingerprint, self.effort = fingerprint_of(function, helpers, signature)
        self._compile_here = compile_here

    @property
    def is_filled(self) -> bool:
        """Whether the kernel is packaged, or in the cache of this machine."""
        return self.file_name in _stored_names()

    @property
    def label(self) -> str:
        """The kernel's module and name, as an argument of the compiling process."""
        return f"{self.module}:{self.name}"

    @property
    def file_name(self) -> str:
        """Name of the file with the kernel's object code."""
        return f"{self.name}-{self.fingerprint}{SUFFIX}"

    def code(self) -> bytes:
        """Return the kernel's object code; compile it in this process if there is none."""
        for file in _packaged():
            if file.name == self.file_name:
                code = _checked(file.read_bytes())
                if code is not None:
                    return code
        with contextlib.suppress(OSError):
            path = cache_folder() / self.file_name
            code = _checked(path.read_bytes())
            if code is not None:
                # What is not used is removed.
                os.utime(path)
                return code
        return self.compile_here()

    def compile_here(self) -> bytes:
        """Compile the kernel in this process; return its object code, and cache it if possible."""
        code = self._compile_here()
        with contextlib.suppress(OSError, StorageError):
            self.write_to(cache_folder(), code)
        return code

    def write_to(self, folder: Path, code: bytes) -> None:
        """Write object code into a folder, with a check of its bytes."""
        folder.mkdir(parents=True, exist_ok=True)
        write_whole(folder / self.file_name, hashlib.sha256(code).digest() + code)

    def request(self) -> None:
        """Request that the compiling process, even of another program, takes this kernel next."""
        with contextlib.suppress(OSError):
            _request_folder().mkdir(parents=True, exist_ok=True)
            self._request_file.write_text(self.label, encoding="utf-8")

    def withdraw_request(self) -> None:
        """Remove the request."""
        with contextlib.suppress(OSError):
            self._request_file.unlink(missing_ok=True)

    @property
    def _request_file(self) -> Path:
        return _request_folder() / f"{self.name}-{self.fingerprint}"


def _checked(data: bytes) -> bytes | None:
    """Return the object code in a file's bytes; None if they are damaged."""
    code = data[DIGEST:]
    return code if hashlib.sha256(code).digest() == data[:DIGEST] else None


def fingerprint_of(
    function: Callable[..., Any], helpers: Container[Callable[..., Any]], signature: str
) -> tuple[str, int]:
    """Return a fingerprint of a function and the helpers that it calls, and their bytes of code.

    Args:
        function: The function.
        helpers: Functions whose code is part of the compiled code of those that call them.
        signature: The function's type signature for Numba.
    """
    digest = hashlib.sha256(repr((signature, OPTIONS)).encode())
    effort = 0
    visited: set[Callable[..., Any]] = {function}
    waiting = [function]
    while waiting:
        called = waiting.pop()
        assert isinstance(called, FunctionType)  # noqa: S101 - kernels and helpers are
        code = called.__code__
        effort += len(code.co_code)
        digest.update(_source_of(code).encode())
        for name in sorted(code.co_names):
            value = called.__globals__.get(name)
            if isinstance(value, FunctionType) and value in helpers:
                if value not in visited:
                    visited.add(value)
                    waiting.append(value)
            elif isinstance(value, bool | int | float | tuple):
                digest.update(f"{name}={value!r}".encode())
            elif isinstance(value, type):
                # Compiled code addresses the fields of a named tuple by their order.
                digest.update(f"{name}={getattr(value, '_fields', ())}".encode())
    return digest.hexdigest()[:DIGITS], effort


def _source_of(code: CodeType) -> str:
    """Return the source of a function without comments; its bytecode varies with Python."""
    last = max(end or line or 0 for line, end, _, _ in code.co_positions())
    lines = linecache.getlines(code.co_filename)[code.co_firstlineno - 1 : last]
    return "\n".join(re.sub(r"\s*(#.*)?\s$", "", line) for line in lines)


@functools.cache
def _packaged() -> list[Traversable]:
    """Return the files of object code that come with the explorer for this processor."""
    with contextlib.suppress(OSError):
        return packaged_files(f"{PACKAGED}/{processor()}", SUFFIX)
    return []


@functools.cache
def cache_folder() -> Path:
    """Return the folder for object code in the user's cache."""
    root = Path(os.environ.get("XDG_CACHE_HOME") or platformdirs.user_cache_dir())
    return root / "flagged-explorer" / "kernels" / processor()


def await_cached(entries: Iterable[Entry], *, urgent: bool = False) -> Iterator[Entry]:
    """Yield each entry as soon as it is filled; start a process that compiles missing kernels.

    If the compiling process ends without some kernels, for example because the cache cannot be
    written, their entries are yielded last, for the caller to compile.

    Args:
        entries: Entries of the kernels.
        urgent: Whether a caller waits for them, so that they are compiled before others.
    """
    waiting = list(entries)
    child: subprocess.Popen[bytes] | None = None
    requested: list[Entry] = []
    try:
        while True:
            stored = _stored_names()
            for entry in [entry for entry in waiting if entry.file_name in stored]:
                waiting.remove(entry)
                yield entry
            if not waiting:
                return
            if urgent and not requested:
                requested = waiting.copy()
                for entry in requested:
                    entry.request()
            if child is not None and child.poll() not in (None, BUSY):
                # The caller loads those that were compiled since the last check.
                yield from waiting
                return
            if (child is None or child.poll() == BUSY) and not _is_compiling_elsewhere():
                child = _start_compiling(waiting)
            time.sleep(URGENT_SECONDS if urgent else POLL_SECONDS)
    finally:
        for entry in requested:
            entry.withdraw_request()
        if child is not None and child.stdin is not None:
            child.stdin.close()
            child.wait()


def compile_all(labels: Iterable[str]) -> int:
    """Compile kernels that are not in the cache, requested ones first; return the exit status.

    The compiling process runs this function. The labels are those of `Entry.label`.
    """
    cache_folder().mkdir(parents=True, exist_ok=True)
    try:
        with _lock().acquire(blocking=False):
            _compile_by_urgency(labels)
    except Timeout:
        return BUSY
    _remove_unused()
    return 0


def main() -> None:
    """Compile the kernels named on the command line; exit early if the parent process ends."""

    def end_with_parent() -> None:
        sys.stdin.buffer.read()
        os._exit(1)

    threading.Thread(target=end_with_parent, daemon=True).start()
    sys.exit(compile_all(sys.argv[1:]))


def _compile_by_urgency(labels: Iterable[str]) -> None:
    rest = sorted(filter(None, map(_entry_of, labels)), key=lambda entry: entry.effort)
    while True:
        entry = next(_requested_entries(), None)
        while entry is None and rest:
            candidate = rest.pop(0)
            entry = None if candidate.is_filled else candidate
        if entry is None:
            return
        entry.compile_here()
        entry.withdraw_request()


def _requested_entries() -> Iterator[Entry]:
    """Yield the entries of requested kernels; withdraw the requests of compiled ones."""
    for path in sorted(_request_folder().glob("*"), key=lambda path: path.name):
        with contextlib.suppress(OSError):
            entry = _entry_of(path.read_text(encoding="utf-8"))
            # Another version of the explorer requests another fingerprint.
            if entry and path.name.endswith(entry.fingerprint):
                if entry.is_filled:
                    entry.withdraw_request()
                else:
                    yield entry


def _entry_of(label: str) -> Entry | None:
    module, _, name = label.partition(":")
    if not module.startswith("explorer."):
        return None
    try:
        return getattr(getattr(importlib.import_module(module), name, None), "entry", None)
    except ImportError:
        return None


def _start_compiling(entries: Iterable[Entry]) -> subprocess.Popen[bytes]:
    # The child must import the same sources in any working folder. At higher levels of
    # optimisation compiling takes longer and the kernels are no faster.
    variables = {"PYTHONPATH": str(SOURCES), "NUMBA_OPT": "1"}
    return subprocess.Popen(  # noqa: S603 - our own interpreter and names of our own modules
        [
            *(sys.executable, "-P", "-c"),
            f"from {__name__} import main; main()",
            *(entry.label for entry in entries),
        ],
        stdin=subprocess.PIPE,
        stdout=subprocess.DEVNULL,
        stderr=subprocess.DEVNULL,
        env={**os.environ, **variables},
    )


def _is_compiling_elsewhere() -> bool:
    try:
        with _lock().acquire(blocking=False):
            return False
    except Timeout:
        return True
    except OSError:
        # There is no folder yet, or it cannot be written: the child's result shows which.
        return False


def _stored_names() -> set[str]:
    """Return the names of all files of object code that are packaged or in the cache."""
    names = {file.name for file in _packaged()}
    with contextlib.suppress(OSError):
        names.update(path.name for path in cache_folder().iterdir())
    return names


def _lock() -> FileLock:
    return FileLock(cache_folder() / "compiling.lock", is_singleton=False)


def _request_folder() -> Path:
    return cache_folder() / "requests"


def _remove_unused() -> None:
    """Remove compiled code of any version that has not been loaded for a month."""
    for path in cache_folder().parent.glob("**/*"):
        with contextlib.suppress(OSError):
            if path.is_file() and time.time() - path.stat().st_mtime > UNUSED_SECONDS:
                path.unlink()
