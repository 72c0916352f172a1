"""Kernels: plain Python loops over arrays that Numba compiles, late and out of the way.

A kernel called with many rows is compiled first. One called with few runs as it is until
it has been compiled in the background, since compiling takes seconds and importing Numba
half a second, which a single pose does not repay. For where compiled code is kept, see
`explorer.numerics.kernel_cache`.
"""

from __future__ import annotations

import functools
import threading
from collections.abc import Callable
from types import FunctionType
from typing import Any, Generic, ParamSpec, TypeVar

from explorer.numerics.kernel_cache import Entry, Locator, fingerprint_of, is_writable, when_cached

Arguments = ParamSpec("Arguments")
Result = TypeVar("Result")

# From this many rows on, compiling (or loading from the cache) beats interpreting.
MANY_ROWS = 256
# How Numba compiles all of them.
OPTIONS: dict[str, Any] = {"nogil": True, "error_model": "numpy"}

_kernels: list[Kernel[...]] = []
# Functions that kernels call, and their compiled forms once there are any.
_helpers: dict[Callable[..., Any], Any] = {}
# Numba is configured, and compiled forms are made, by one thread at a time.
_loading = threading.RLock()
# Held by the thread that warms in the background.
_warming = threading.Lock()


class Kernel(Generic[Arguments]):
    """A function over arrays that runs interpreted or compiled, with the same result.

    Args:
        function: Plain Python in the subset that Numba compiles; it writes its results
            into arrays that it is given.
        signature: Numba's type signature, so that compiling needs no call.
    """

    def __init__(self, function: Callable[Arguments, None], signature: str) -> None:
        self._function = function
        self._signature = signature
        self._compiled: Callable[Arguments, None] | None = None
        self._entry: Entry | None = None
        functools.update_wrapper(self, function)
        _kernels.append(self)

    def __call__(self, rows: int, *args: Arguments.args, **kwargs: Arguments.kwargs) -> None:
        """Run over `rows` rows, compiled when that pays or when it is ready anyhow."""
        if self._compiled is None and rows >= MANY_ROWS:
            self.compile()
        (self._compiled or self._function)(*args, **kwargs)

    @property
    def entry(self) -> Entry:
        """The place of the kernel in the cache."""
        if self._entry is None:
            self._entry = Entry(self._function, _helpers, (self._signature, OPTIONS))
        return self._entry

    @property
    def ready(self) -> bool:
        """Whether the compiled form is in use."""
        return self._compiled is not None

    def compile(self) -> None:
        """Load the compiled form, waiting until there is one."""
        if self._compiled is None:
            for _ in when_cached([self], urgent=True):
                self.compile_here()

    def compile_here(self) -> None:
        """Load the compiled form, which is made in this process if the cache lacks it."""
        with _loading:
            if self._compiled is not None:
                return
            import numba
            from numba.core import config

            settings: Any = config
            before = settings.CACHE_LOCATOR_CLASSES
            settings.CACHE_LOCATOR_CLASSES = f"{Locator.__module__}.{Locator.__qualname__}"
            try:
                # A full cache that cannot be written is still of use.
                kept = self.entry.is_filled or is_writable()
                source = _with_compiled_helpers(self._function, self.entry.fingerprint, kept=kept)
                self._compiled = numba.njit(self._signature, cache=kept, **OPTIONS)(source)
            finally:
                settings.CACHE_LOCATOR_CLASSES = before
        self.entry.mark_used()


def kernel(signature: str) -> Callable[[Callable[Arguments, None]], Kernel[Arguments]]:
    """Make a `Kernel` of the decorated function."""

    def decorate(function: Callable[Arguments, None]) -> Kernel[Arguments]:
        return Kernel(function, signature)

    return decorate


def helper(function: Callable[Arguments, Result]) -> Callable[Arguments, Result]:
    """Mark a function that kernels call: plain where they are, compiled where they are."""
    _helpers[function] = None
    return function


def _with_compiled_helpers(
    function: Callable[..., Any], fingerprint: str, *, kept: bool
) -> Callable[..., Any]:
    """Return the function with compiled helpers in the place of the plain ones it names.

    Args:
        function: A kernel's or a helper's.
        fingerprint: Under which its code is kept.
        kept: Whether code is kept in the cache at all.
    """
    import numba

    namespace = dict(function.__globals__)
    for name in function.__code__.co_names:
        called = namespace.get(name)
        if isinstance(called, FunctionType) and called in _helpers:
            if _helpers[called] is None:
                own, _ = fingerprint_of(called, set(_helpers), OPTIONS)
                plain = _with_compiled_helpers(called, own, kept=kept)
                _helpers[called] = numba.njit(cache=kept, **OPTIONS)(plain)
            namespace[name] = _helpers[called]
    copy = FunctionType(function.__code__, namespace, function.__name__, function.__defaults__)
    copy.__module__, copy.__qualname__ = function.__module__, function.__qualname__
    copy.__dict__["fingerprint"] = fingerprint
    return copy


def fill_cache() -> None:
    """Have every kernel that has been imported compiled by another process, for all to load."""
    for _ in when_cached([each for each in _kernels if not each.ready]):
        pass


def warm() -> None:
    """Make every kernel that has been imported compiled, so that small calls are fast too."""
    for each in when_cached([each for each in _kernels if not each.ready]):
        each.compile_here()


def warm_in_background(then: Callable[[], None] | None = None) -> threading.Thread:
    """Warm in a thread; calls run interpreted until their kernel is compiled.

    Args:
        then: Called there once all is warm.
    """

    def run() -> None:
        with _warming:
            warm()
        if then is not None:
            then()

    thread = threading.Thread(target=run, name="warm kernels", daemon=True)
    thread.start()
    return thread
