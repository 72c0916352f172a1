"""The cache of compiled kernels, and the one process on a machine that fills it.

A kernel is kept under a fingerprint of its own code, of the functions that it calls and of
the constants that it names, since Numba's own key misses changes in the latter two. So a
change elsewhere, a second checkout and a new installation all find what is there. Kernels
are compiled by a child process, because compiling holds the interpreter lock for seconds; a
lock in the cache keeps a second process from compiling the same ones meanwhile. What
somebody waits for is compiled first, and the rest shortest first.
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
from typing import Any, Protocol, TypeVar

from filelock import FileLock, Timeout

from explorer.files.packaged import SOURCES

# Exit status of a compiling process that found another one at work.
BUSY = 75
# Hexadecimal digits of a fingerprint.
DIGITS = 16
# Seconds between two looks at what another process has compiled, while somebody waits for
# it and otherwise.
URGENT_SECONDS, POLL_SECONDS = 0.02, 0.2
# Seconds after which compiled code that nobody has loaded is removed.
KEPT_SECONDS = 30 * 24 * 3600


class Cacheable(Protocol):
    """What the cache needs to know of a kernel."""

    @property
    def entry(self) -> Entry:
        """The place of the kernel in the cache."""
        ...

    def compile_here(self) -> None:
        """Compile in this process, into the cache."""
        ...


Kind = TypeVar("Kind", bound=Cacheable)


class Entry:
    """The place of a kernel in the cache.

    Args:
        function: The kernel's Python function.
        helpers: The functions that kernels may call.
        options: What else the compiled code depends on, such as its signature.

    Attributes:
        module: The name of the module that defines the kernel.
        name: The kernel's name in its module.
        fingerprint: Hexadecimal digits that change with the compiled code.
        effort: Bytes of code to compile, which the time it takes grows with.
    """

    def __init__(
        self, function: Callable[..., Any], helpers: Iterable[Callable[..., Any]], options: object
    ) -> None:
        self.module, self.name = function.__module__, function.__name__
        self.fingerprint, self.effort = fingerprint_of(function, set(helpers), options)

    @property
    def is_filled(self) -> bool:
        """Whether some process has compiled the kernel."""
        return self.fingerprint in _compiled()

    @property
    def label(self) -> str:
        """The kernel's module and name, as the compiling process is told."""
        return f"{self.module}:{self.name}"

    def mark_used(self) -> None:
        """Note that the compiled code is in use, so that it is kept."""
        for path in cache_folder().glob(f"*-{self.fingerprint}.*"):
            with contextlib.suppress(OSError):
                os.utime(path)

    def request(self) -> None:
        """Ask whichever process is compiling to take this kernel next."""
        with contextlib.suppress(OSError):
            _requests().mkdir(parents=True, exist_ok=True)
            self._request.write_text(self.label, encoding="utf-8")

    def withdraw_request(self) -> None:
        """Remove the request, which has been answered or given up."""
        with contextlib.suppress(OSError):
            self._request.unlink(missing_ok=True)

    @property
    def _request(self) -> Path:
        return _requests() / f"{self.name}-{self.fingerprint}"


def fingerprint_of(
    function: Callable[..., Any], helpers: set[Callable[..., Any]], options: object
) -> tuple[str, int]:
    """Return a fingerprint of a function with all that it calls, and the bytes of its code.

    Args:
        function: The function.
        helpers: The functions whose code counts where they are called.
        options: What else the compiled code depends on; its `repr` counts.
    """
    digest = hashlib.sha256(repr(options).encode())
    effort = 0
    seen: set[Callable[..., Any]] = {function}
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
                if value not in seen:
                    seen.add(value)
                    waiting.append(value)
            elif isinstance(value, bool | int | float | tuple):
                digest.update(f"{name}={value!r}".encode())
    return digest.hexdigest()[:DIGITS], effort


@functools.cache
def cache_folder() -> Path:
    """Return the folder of the user's cache where compiled code is kept."""
    from importlib.metadata import version

    default = Path.home() / ".cache"
    if sys.platform == "darwin":
        default = Path.home() / "Library" / "Caches"
    elif sys.platform == "win32":
        default = Path(os.environ.get("LOCALAPPDATA", Path.home()))
    root = Path(os.environ.get("XDG_CACHE_HOME") or default)
    # Code of one Numba and one Python is of no use to another.
    made_by = f"{sys.implementation.cache_tag}-numba-{version('numba')}"
    return root / "flagged-explorer" / "kernels" / made_by


def is_writable() -> bool:
    """Whether compiled code can be kept."""
    try:
        cache_folder().mkdir(parents=True, exist_ok=True)
        tempfile.TemporaryFile(dir=cache_folder()).close()
    except OSError:
        return False
    return True


class Locator:
    """Tells Numba where the code of a function is kept, and under which fingerprint.

    Numba makes one for each function that it caches; the function carries its fingerprint.
    """

    def __init__(self, function: FunctionType, file: str) -> None:
        self._fingerprint = str(function.__dict__["fingerprint"])
        # Numba names it in warnings.
        self._py_file = file

    @classmethod
    def from_function(cls, function: FunctionType, file: str) -> Locator | None:
        """Return the locator of a function; None for one that is not ours."""
        return cls(function, file) if "fingerprint" in function.__dict__ else None

    def ensure_cache_path(self) -> None:
        """Make the folder."""
        cache_folder().mkdir(parents=True, exist_ok=True)

    def get_cache_path(self) -> str:
        """Return the folder."""
        self.ensure_cache_path()
        return str(cache_folder())

    def get_source_stamp(self) -> str:
        """Return what the code depends on."""
        return self._fingerprint

    def get_disambiguator(self) -> str:
        """Return what tells functions of one name apart in file names."""
        return self._fingerprint


def when_cached(kernels: Iterable[Kind], *, urgent: bool = False) -> Iterator[Kind]:
    """Yield each kernel as soon as the cache holds it, having what is missing compiled.

    Kernels that could not be compiled elsewhere, because the cache cannot be written say,
    are yielded in the end, for the caller to compile.

    Args:
        kernels: The kernels.
        urgent: Whether somebody waits for them, so that they are compiled before others.
    """
    waiting = list(kernels)
    child: subprocess.Popen[bytes] | None = None
    asked: list[Entry] = []
    try:
        while True:
            compiled = _compiled()
            for each in [each for each in waiting if each.entry.fingerprint in compiled]:
                waiting.remove(each)
                yield each
            if not waiting:
                return
            if urgent and not asked:
                asked = [each.entry for each in waiting]
                for entry in asked:
                    entry.request()
            if child is not None and child.poll() not in (None, BUSY):
                # Between the last look and its end it may have compiled some.
                yield from waiting
                return
            if (child is None or child.poll() == BUSY) and not _is_somebody_compiling():
                child = _start_compiling(waiting)
            time.sleep(URGENT_SECONDS if urgent else POLL_SECONDS)
    finally:
        for entry in asked:
            entry.withdraw_request()
        if child is not None and child.stdin is not None:
            child.stdin.close()
            child.wait()


def compile_all(labels: Iterable[str]) -> int:
    """Compile kernels that the cache lacks, those first that are asked for meanwhile.

    The work of the compiling process.

    Args:
        labels: The labels of the kernels, see `Entry.label`.

    Returns:
        The exit status of the process.
    """
    cache_folder().mkdir(parents=True, exist_ok=True)
    try:
        with _lock().acquire(blocking=False):
            _compile_by_urgency(labels)
    except Timeout:
        return BUSY
    _forget_unused()
    return 0


def main() -> None:
    """Compile the kernels named on the command line until done, or until the parent ends."""

    def end_with_parent() -> None:
        sys.stdin.buffer.read()
        os._exit(1)

    threading.Thread(target=end_with_parent, daemon=True).start()
    sys.exit(compile_all(sys.argv[1:]))


def _compile_by_urgency(labels: Iterable[str]) -> None:
    given = [_kernel_named(label) for label in labels]
    rest = sorted((each for each in given if each), key=lambda each: each.entry.effort)
    while True:
        chosen = next(iter(_requested()), None)
        while chosen is None and rest:
            candidate = rest.pop(0)
            chosen = None if candidate.entry.is_filled else candidate
        if chosen is None:
            return
        chosen.compile_here()
        chosen.entry.withdraw_request()


def _requested() -> Iterator[Cacheable]:
    """Yield the kernels that processes wait for and the cache lacks."""
    for path in sorted(_requests().glob("*"), key=lambda path: path.name):
        with contextlib.suppress(OSError):
            kernel = _kernel_named(path.read_text(encoding="utf-8"))
            # Another version of the explorer asks for another fingerprint.
            if kernel and path.name.endswith(kernel.entry.fingerprint):
                if not kernel.entry.is_filled:
                    yield kernel
                else:
                    kernel.entry.withdraw_request()


def _kernel_named(label: str) -> Cacheable | None:
    module, _, name = label.partition(":")
    if not module.startswith("explorer."):
        return None
    try:
        return getattr(importlib.import_module(module), name, None)
    except ImportError:
        return None


def _start_compiling(kernels: Iterable[Cacheable]) -> subprocess.Popen[bytes]:
    # The child must find these very sources, wherever it is started. A higher level of
    # optimisation takes longer for kernels that run no faster.
    changed = {"PYTHONPATH": str(SOURCES), "NUMBA_OPT": "1"}
    return subprocess.Popen(  # noqa: S603 - our own interpreter and our own words
        [
            *(sys.executable, "-P", "-c"),
            f"from {__name__} import main; main()",
            *(each.entry.label for each in kernels),
        ],
        stdin=subprocess.PIPE,
        stdout=subprocess.DEVNULL,
        stderr=subprocess.DEVNULL,
        env={**os.environ, **changed},
    )


def _is_somebody_compiling() -> bool:
    try:
        with _lock().acquire(blocking=False):
            return False
    except Timeout:
        return True
    except OSError:
        # No folder yet, or none that can be written: the child finds out.
        return False


def _compiled() -> set[str]:
    """Return the fingerprints of all functions whose compiled code is in the cache."""
    try:
        names = [path.name for path in cache_folder().iterdir()]
    except OSError:
        return set()
    # Numba writes the index before the code, so an index alone tells nothing.
    return {name.rpartition("-")[2][:DIGITS] for name in names if name.endswith(".nbc")}


def _lock() -> FileLock:
    return FileLock(cache_folder() / "compiling.lock", is_singleton=False)


def _requests() -> Path:
    return cache_folder() / "requests"


def _forget_unused() -> None:
    """Remove compiled code that has not been loaded for a month, of any version."""
    for path in cache_folder().parent.glob("**/*"):
        with contextlib.suppress(OSError):
            if path.is_file() and time.time() - path.stat().st_mtime > KEPT_SECONDS:
                path.unlink()
