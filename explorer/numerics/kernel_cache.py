"""The cache of compiled kernels, and the one process on a machine that fills it.

The key of a kernel is a fingerprint of its own code, of the functions that it calls and of
the constants that it names; Numba's own key misses changes in the latter two. A change in
other code, a second checkout and a new installation therefore use the same entries. A child
process compiles, because compiling holds the interpreter lock for seconds; a lock in the cache
keeps a second process from compiling the same kernels. Kernels that a caller waits for are
compiled first, the others in the order of their code's length.
"""

from __future__ import annotations

import contextlib
import functools
import hashlib
import importlib
import os
import subprocess
import sys
import tempfile
import threading
import time
from collections.abc import Callable, Iterable, Iterator
from pathlib import Path
from types import FunctionType
from typing import Any

import platformdirs
from filelock import FileLock, Timeout

from explorer.files.packaged import SOURCES

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
        options: Other values on which the compiled code depends, such as its signature.
        compile_here: Function that compiles the kernel in this process, into the cache.

    Attributes:
        module: Name of the module that defines the kernel.
        name: Name of the kernel in its module.
        fingerprint: Hexadecimal digits that change with the compiled code.
        effort: Bytes of Python code to compile, a measure of the time that compiling takes.
    """

    def __init__(
        self,
        function: Callable[..., Any],
        helpers: set[Callable[..., Any]],
        options: object,
        compile_here: Callable[[], None],
    ) -> None:
        self.module, self.name = function.__module__, function.__name__
        self.fingerprint, self.effort = fingerprint_of(function, helpers, options)
        self.compile_here = compile_here

    @property
    def is_filled(self) -> bool:
        """Whether the cache holds the compiled kernel."""
        return self.fingerprint in _cached_fingerprints()

    @property
    def label(self) -> str:
        """The kernel's module and name, as an argument of the compiling process."""
        return f"{self.module}:{self.name}"

    def mark_used(self) -> None:
        """Set the time of last use of the compiled code, so that it is not removed."""
        for path in cache_folder().glob(f"*-{self.fingerprint}.*"):
            with contextlib.suppress(OSError):
                os.utime(path)

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


def fingerprint_of(
    function: Callable[..., Any], helpers: set[Callable[..., Any]], options: object
) -> tuple[str, int]:
    """Return a fingerprint of a function and the helpers that it calls, and their bytes of code.

    Args:
        function: The function.
        helpers: Functions whose code is part of the compiled code of those that call them.
        options: Other values on which the compiled code depends; their `repr` is hashed.
    """
    digest = hashlib.sha256(repr(options).encode())
    effort = 0
    visited: set[Callable[..., Any]] = {function}
    waiting = [function]
    while waiting:
        called = waiting.pop()
        assert isinstance(called, FunctionType)  # noqa: S101 - kernels and helpers are
        code = called.__code__
        # Compiled code holds the names of the modules that its functions come from.
        digest.update(called.__module__.encode())
        effort += len(code.co_code)
        digest.update(code.co_code)
        for part in (code.co_consts, code.co_varnames, code.co_names, called.__defaults__):
            digest.update(repr(part).encode())
        for name in code.co_names:
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


@functools.cache
def cache_folder() -> Path:
    """Return the folder for compiled code in the user's cache."""
    from importlib.metadata import version

    # Other versions of Numba or Python cannot load the code.
    versions = f"{sys.implementation.cache_tag}-numba-{version('numba')}"
    root = Path(os.environ.get("XDG_CACHE_HOME") or platformdirs.user_cache_dir())
    return root / "flagged-explorer" / "kernels" / versions


def is_writable() -> bool:
    """Return whether compiled code can be written to the cache."""
    try:
        cache_folder().mkdir(parents=True, exist_ok=True)
        tempfile.TemporaryFile(dir=cache_folder()).close()
    except OSError:
        return False
    return True


class Locator:
    """Numba's cache locator: the folder and the key of a function's compiled code.

    Numba creates one for each function that it caches. The key is the function's attribute
    `fingerprint`.
    """

    def __init__(self, function: FunctionType, file: str) -> None:
        self._fingerprint = str(function.__dict__["fingerprint"])
        # Numba reads this attribute for its warnings.
        self._py_file = file

    @classmethod
    def from_function(cls, function: FunctionType, file: str) -> Locator | None:
        """Return the locator of a function; None if the function has no fingerprint."""
        return cls(function, file) if "fingerprint" in function.__dict__ else None

    def ensure_cache_path(self) -> None:
        """Create the folder."""
        cache_folder().mkdir(parents=True, exist_ok=True)

    def get_cache_path(self) -> str:
        """Return the folder."""
        self.ensure_cache_path()
        return str(cache_folder())

    def get_source_stamp(self) -> str:
        """Return the fingerprint, which changes with the code."""
        return self._fingerprint

    def get_disambiguator(self) -> str:
        """Return the fingerprint, which distinguishes functions of the same name in file names."""
        return self._fingerprint


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
            cached = _cached_fingerprints()
            for entry in [entry for entry in waiting if entry.fingerprint in cached]:
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


def _cached_fingerprints() -> set[str]:
    """Return the fingerprints of all functions whose compiled code is in the cache."""
    try:
        names = [path.name for path in cache_folder().iterdir()]
    except OSError:
        return set()
    # Numba writes the index before the code, so only a file of code counts.
    return {name.rpartition("-")[2][:DIGITS] for name in names if name.endswith(".nbc")}


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
