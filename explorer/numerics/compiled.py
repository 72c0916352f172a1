"""Kernels: plain Python loops over arrays, which Numba compiles when they are needed.

A call with many rows loads the compiled kernel first, or compiles it. A call with few rows runs
the plain Python until the compiled kernel is loaded in the background, because compiling takes
seconds and loading too long for a single pose. `explorer.numerics.kernel_cache` stores the
compiled code.
"""

from __future__ import annotations

import functools
import threading
from collections.abc import Callable
from typing import Any, Generic, ParamSpec, TypeVar

import numpy as np

from explorer.numerics.kernel_cache import Entry, await_cached
from explorer.numerics.object_code import compile_object, load_object, with_compiled_helpers

Arguments = ParamSpec("Arguments")
Result = TypeVar("Result")

# Number of rows from which compiling (or loading from the cache) is faster than interpreting.
MANY_ROWS = 256

_kernels: list[Kernel[...]] = []
# Functions that kernels call, with their compiled forms; None before they are compiled.
_helpers: dict[Callable[..., Any], Any] = {}
# One thread at a time compiles and loads.
_compile_lock = threading.RLock()
# One thread at a time compiles in the background.
_warm_lock = threading.Lock()


class Kernel(Generic[Arguments]):
    """A function over arrays that runs interpreted or compiled, with the same result.

    Args:
        function: Function in the subset of Python that Numba compiles; it writes its results
            into arrays among its arguments.
        signature: Numba's type signature, with which it can compile before any call.
    """

    def __init__(self, function: Callable[Arguments, None], signature: str) -> None:
        self._function = function
        self._signature = signature
        self._compiled: Callable[Arguments, None] | None = None
        functools.update_wrapper(self, function)
        _kernels.append(self)

    def __call__(self, rows: int, *args: Arguments.args, **kwargs: Arguments.kwargs) -> None:
        """Run over `rows` rows: compiled if they are many or the compiled form is loaded."""
        if self._compiled is None and rows >= MANY_ROWS:
            self.compile()
        if self._compiled is not None:
            self._compiled(*args, **kwargs)
            return
        # As the compiled form, which overflows to infinity without a warning.
        with np.errstate(all="ignore"):
            self._function(*args, **kwargs)

    @functools.cached_property
    def entry(self) -> Entry:
        """The kernel's entry in the cache."""
        return Entry(self._function, _helpers, self._signature, self._object)

    @property
    def ready(self) -> bool:
        """Whether the compiled form is in use."""
        return self._compiled is not None

    def compile(self) -> None:
        """Load the compiled form; wait while another process compiles it."""
        if self._compiled is None:
            for _ in await_cached([self.entry], urgent=True):
                self.load()

    def load(self) -> None:
        """Load the compiled form; compile it in this process if it is stored nowhere."""
        with _compile_lock:
            if self._compiled is None:
                self._compiled = load_object(self.entry.code(), self._signature)

    def _object(self) -> bytes:
        """Return the object code, compiled in this process."""
        with _compile_lock:
            return compile_object(with_compiled_helpers(self._function, _helpers), self._signature)


def kernel(signature: str) -> Callable[[Callable[Arguments, None]], Kernel[Arguments]]:
    """Make a `Kernel` of the decorated function."""
    return lambda function: Kernel(function, signature)


def helper(function: Callable[Arguments, Result]) -> Callable[Arguments, Result]:
    """Mark a function that kernels call, so that compiled kernels call its compiled form."""
    _helpers[function] = None
    return function


def all_kernels() -> tuple[Kernel[...], ...]:
    """Return every imported kernel."""
    return tuple(_kernels)


def fill_cache() -> None:
    """Compile every imported kernel into the cache, in another process."""
    for _ in await_cached(kernel.entry for kernel in _kernels if not kernel.ready):
        pass


def warm(tell: Callable[[float], None] | None = None) -> None:
    """Load the compiled form of every imported kernel, so that small calls are fast too.

    Args:
        tell: Callback with the share of the work of compiling that is done, 0 to 1; it is called
            only if some kernels are stored nowhere and have to be compiled.
    """
    waiting = {kernel.entry: kernel for kernel in _kernels if not kernel.ready}
    missing = {entry for entry in waiting if not entry.is_filled}
    effort, done = sum(entry.effort for entry in missing), 0
    if missing and tell is not None:
        tell(0.0)
    for entry in await_cached(waiting):
        waiting[entry].load()
        if entry in missing and tell is not None:
            missing.remove(entry)
            done += entry.effort
            tell(done / effort if missing else 1.0)


def warm_in_background(tell: Callable[[float], None] | None = None) -> threading.Thread:
    """Call `warm` in a thread; a kernel runs interpreted until its compiled form is loaded.

    Args:
        tell: Callback in that thread, for `warm`.
    """

    def run() -> None:
        with _warm_lock:
            warm(tell)

    thread = threading.Thread(target=run, name="warm kernels", daemon=True)
    thread.start()
    return thread
