"""Kernels: plain Python loops over arrays, which Numba compiles ahead of their calls.

A call with few rows runs the plain Python until the compiled form is loaded, because compiling
takes seconds. A call with many rows loads the compiled form first. That is object code in a file,
which comes with the explorer or lies in the user's cache (`explorer.numerics.object_code`). If
there is no such file, a child process compiles the kernel into the cache.
"""

from __future__ import annotations

import contextlib
import functools
import os
import pkgutil
import random
import subprocess
import sys
import threading
from collections.abc import Callable, Iterable
from typing import Any, Generic, ParamSpec, TypeVar

import numpy as np

from explorer.files.packaged import SOURCES
from explorer.numerics.object_code import (
    cache_folder,
    compile_object,
    fingerprint_of,
    load_object,
    read_code,
    write_code,
)

Arguments = ParamSpec("Arguments")
Result = TypeVar("Result")

# Number of rows from which compiling (or loading from the cache) is faster than interpreting.
MANY_ROWS = 256
KERNELS: list[Kernel[...]] = []

# Functions that kernels call, with their compiled forms; None before they are compiled.
_helpers: dict[Callable[..., Any], Any] = {}
# LLVM crashes if two threads compile or link at a time.
_llvm_lock = threading.RLock()
# Two threads that load all kernels would start two child processes.
_warm_lock = threading.Lock()


class Kernel(Generic[Arguments]):
    """A function over arrays that runs interpreted or compiled, with the same result.

    It is in the subset of Python that Numba compiles, and writes its results into arrays among its
    arguments; with the type signature it can be compiled before any call.
    """

    def __init__(self, function: Callable[Arguments, None], signature: str) -> None:
        self._function = function
        self._signature = signature
        self._compiled: Callable[Arguments, None] | None = None
        self.label = f"{function.__module__}:{function.__name__}"
        functools.update_wrapper(self, function)
        KERNELS.append(self)

    def __call__(self, rows: int, *args: Arguments.args, **kwargs: Arguments.kwargs) -> None:
        """Run over `rows` rows: compiled if they are many or the compiled form is loaded."""
        if rows >= MANY_ROWS:
            self.compile()
        if self._compiled is not None:
            self._compiled(*args, **kwargs)
            return
        # As the compiled form, which overflows to infinity without a warning.
        with np.errstate(all="ignore"):
            self._function(*args, **kwargs)

    @property
    def ready(self) -> bool:
        """Whether the compiled form is in use."""
        return self._compiled is not None

    @functools.cached_property
    def file_name(self) -> str:
        """Name of the file with the object code, which changes with the source."""
        fingerprint = fingerprint_of(self._function, _helpers, self._signature)
        return f"{self._function.__name__}-{fingerprint}.o"

    def compile(self) -> None:
        """Load the compiled form; wait while it is compiled if it is stored nowhere."""
        if self._compiled is None:
            _load([self])

    def load(self, code: bytes | None) -> None:
        """Use object code from now on, unless there is none."""
        with _llvm_lock:
            if code is not None and self._compiled is None:
                self._compiled = load_object(code, self._signature)

    def make_code(self) -> bytes:
        """Return the object code, compiled in this process."""
        with _llvm_lock:
            return compile_object(self._function, _helpers, self._signature)


def kernel(signature: str) -> Callable[[Callable[Arguments, None]], Kernel[Arguments]]:
    """Make a `Kernel` of the decorated function."""
    return lambda function: Kernel(function, signature)


def helper(function: Callable[Arguments, Result]) -> Callable[Arguments, Result]:
    """Mark a function that kernels call, so that compiled kernels call its compiled form."""
    _helpers[function] = None
    return function


def warm() -> None:
    """Load the compiled form of every imported kernel, so that small calls are fast too."""
    with _warm_lock:
        _load(kernel for kernel in KERNELS if not kernel.ready)


def warm_in_background() -> None:
    """Call `warm` in a thread; a kernel runs interpreted until its compiled form is loaded."""
    threading.Thread(target=warm, name="warm kernels", daemon=True).start()


def _load(kernels: Iterable[Kernel[...]]) -> None:
    missing: dict[str, Kernel[...]] = {}
    for each in kernels:
        each.load(read_code(each.file_name))
        if not each.ready:
            missing[each.label] = each
    if missing:
        with _start_child(missing) as child:
            for line in child.stdout or ():
                found = missing[line.strip()]
                found.load(read_code(found.file_name))
    for each in missing.values():
        # The child ends early if the cache cannot be written.
        if not each.ready:
            each.load(each.make_code())


def _start_child(labels: Iterable[str]) -> subprocess.Popen[str]:
    """Start a process that compiles kernels into the cache, even if this process ends."""
    # The child must import the same sources in any working folder. At higher levels of
    # optimisation compiling takes longer and the kernels are no faster.
    return subprocess.Popen(  # noqa: S603 - our own interpreter and names of our own modules
        [sys.executable, "-P", "-c", f"from {__name__} import main; main()", *labels],
        stdin=subprocess.DEVNULL,
        stdout=subprocess.PIPE,
        stderr=subprocess.DEVNULL,
        env={**os.environ, "PYTHONPATH": str(SOURCES), "NUMBA_OPT": "1"},
        text=True,
        # Ctrl-C in a terminal ends this process alone.
        start_new_session=True,
    )


def main() -> None:
    """Compile the kernels that the command line names; print the name of each that is cached."""
    labels = sys.argv[1:]
    # Two such processes at a time share most of the work, as their orders differ.
    random.shuffle(labels)
    for label in labels:
        found: Kernel[...] = pkgutil.resolve_name(label)
        if read_code(found.file_name) is None:
            write_code(cache_folder(), found.file_name, found.make_code())
        # Nobody reads it if the parent process has ended.
        with contextlib.suppress(OSError):
            os.write(1, f"{label}\n".encode())
