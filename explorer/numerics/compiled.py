"""Kernels: plain Python loops over arrays, which Numba compiles when they are needed.

A call with many rows compiles the kernel first. A call with few rows runs the plain Python
until the kernel has been compiled in the background: compiling takes seconds and importing
Numba half a second, too long for a single pose. `explorer.numerics.kernel_cache` stores the
compiled code.
"""

from __future__ import annotations

import functools
import threading
from collections.abc import Callable
from types import FunctionType
from typing import Any, Generic, ParamSpec, TypeVar

from explorer.numerics.kernel_cache import Entry, Locator, await_cached, fingerprint_of, is_writable

Arguments = ParamSpec("Arguments")
Result = TypeVar("Result")

# Number of rows from which compiling (or loading from the cache) is faster than interpreting.
MANY_ROWS = 256
# Numba's options for every kernel and helper.
OPTIONS: dict[str, Any] = {"nogil": True, "error_model": "numpy"}

_kernels: list[Kernel[...]] = []
# Functions that kernels call, with their compiled forms; None before they are compiled.
_helpers: dict[Callable[..., Any], Any] = {}
# One thread at a time configures Numba and compiles.
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
        (self._compiled or self._function)(*args, **kwargs)

    @functools.cached_property
    def entry(self) -> Entry:
        """The kernel's entry in the cache."""
        options = (self._signature, OPTIONS)
        return Entry(self._function, set(_helpers), options, self._compile_here)

    @property
    def ready(self) -> bool:
        """Whether the compiled form is in use."""
        return self._compiled is not None

    def compile(self) -> None:
        """Load the compiled form; wait while another process compiles it."""
        if self._compiled is None:
            for entry in await_cached([self.entry], urgent=True):
                entry.compile_here()

    def _compile_here(self) -> None:
        """Load the compiled form; compile it in this process if it is not in the cache."""
        with _compile_lock:
            if self._compiled is not None:
                return
            import numba
            from numba.core import config

            settings: Any = config
            before = settings.CACHE_LOCATOR_CLASSES
            settings.CACHE_LOCATOR_CLASSES = f"{Locator.__module__}.{Locator.__qualname__}"
            try:
                # A cache that cannot be written can still be read.
                is_cached = self.entry.is_filled or is_writable()
                source = _with_compiled_helpers(self._function, self.entry.fingerprint, is_cached)
                self._compiled = numba.njit(self._signature, cache=is_cached, **OPTIONS)(source)
            finally:
                settings.CACHE_LOCATOR_CLASSES = before
        self.entry.mark_used()


def kernel(signature: str) -> Callable[[Callable[Arguments, None]], Kernel[Arguments]]:
    """Make a `Kernel` of the decorated function."""
    return lambda function: Kernel(function, signature)


def helper(function: Callable[Arguments, Result]) -> Callable[Arguments, Result]:
    """Mark a function that kernels call, so that compiled kernels call its compiled form."""
    _helpers[function] = None
    return function


def _with_compiled_helpers(
    function: Callable[..., Any], fingerprint: str, is_cached: bool
) -> Callable[..., Any]:
    """Return a copy of a function that calls compiled helpers instead of plain ones.

    Args:
        function: Function of a kernel or a helper.
        fingerprint: Fingerprint under which the cache stores its code.
        is_cached: Whether the cache stores code at all.
    """
    import numba

    namespace = dict(function.__globals__)
    for name in function.__code__.co_names:
        called = namespace.get(name)
        if isinstance(called, FunctionType) and called in _helpers:
            if _helpers[called] is None:
                called_fingerprint, _ = fingerprint_of(called, set(_helpers), OPTIONS)
                plain = _with_compiled_helpers(called, called_fingerprint, is_cached)
                _helpers[called] = numba.njit(cache=is_cached, **OPTIONS)(plain)
            namespace[name] = _helpers[called]
    copy = FunctionType(function.__code__, namespace, function.__name__, function.__defaults__)
    copy.__module__, copy.__qualname__ = function.__module__, function.__qualname__
    copy.__dict__["fingerprint"] = fingerprint
    return copy


def fill_cache() -> None:
    """Compile every imported kernel into the cache, in another process."""
    for _ in await_cached(kernel.entry for kernel in _kernels if not kernel.ready):
        pass


def warm() -> None:
    """Load the compiled form of every imported kernel, so that small calls are fast too."""
    for entry in await_cached(kernel.entry for kernel in _kernels if not kernel.ready):
        entry.compile_here()


def warm_in_background(then: Callable[[], None] | None = None) -> threading.Thread:
    """Call `warm` in a thread; a kernel runs interpreted until its compiled form is loaded.

    Args:
        then: Callback in that thread, after every kernel is loaded.
    """

    def run() -> None:
        with _warm_lock:
            warm()
        if then is not None:
            then()

    thread = threading.Thread(target=run, name="warm kernels", daemon=True)
    thread.start()
    return thread
