"""Kernels: plain Python loops over arrays that Numba compiles, late and out of the way.

A kernel called with many rows is compiled first. One called with few runs as it is until
`warm` has been called, since compiling takes seconds and importing Numba half a second,
which a single pose does not repay. Compiled code is cached on disk under a fingerprint of
the package's sources, because Numba's own key misses changes in the kernels it calls.
"""

from __future__ import annotations

import functools
import hashlib
import os
import subprocess
import sys
import threading
from collections.abc import Callable
from pathlib import Path
from types import FunctionType
from typing import Any, Generic, ParamSpec, TypeVar

Arguments = ParamSpec("Arguments")
Result = TypeVar("Result")

# From this many rows on, compiling (or loading from the cache) beats interpreting.
MANY_ROWS = 256

_kernels: list[Kernel[...]] = []
# Functions that kernels call, and their compiled forms once there are any.
_helpers: dict[Callable[..., Any], Any] = {}
_compiling = threading.RLock()


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
        functools.update_wrapper(self, function)
        self.name = f"{function.__module__.rpartition('.')[2]}.{function.__name__}"
        _kernels.append(self)

    def __call__(self, rows: int, *args: Arguments.args, **kwargs: Arguments.kwargs) -> None:
        """Run over `rows` rows, compiled when that pays or when it is ready anyhow."""
        if self._compiled is None and rows >= MANY_ROWS:
            self.compile()
        (self._compiled or self._function)(*args, **kwargs)

    @property
    def ready(self) -> bool:
        """Whether the compiled form is in use."""
        return self._compiled is not None

    def compile(self) -> None:
        """Compile now, or load what an earlier process has compiled."""
        with _compiling:
            if self._compiled is not None:
                return
            import numba
            from numba.core import config

            settings: Any = config
            kept = settings.CACHE_DIR
            settings.CACHE_DIR = str(cache_folder())
            try:
                source = _with_compiled_helpers(self._function)
                self._compiled = numba.njit(
                    self._signature, cache=True, nogil=True, error_model="numpy"
                )(source)
            finally:
                settings.CACHE_DIR = kept


def kernel(signature: str) -> Callable[[Callable[Arguments, None]], Kernel[Arguments]]:
    """Make a `Kernel` of the decorated function."""

    def decorate(function: Callable[Arguments, None]) -> Kernel[Arguments]:
        return Kernel(function, signature)

    return decorate


def helper(function: Callable[Arguments, Result]) -> Callable[Arguments, Result]:
    """Mark a function that kernels call: plain where they are, compiled where they are."""
    _helpers[function] = None
    return function


def _with_compiled_helpers(function: Callable[..., Any]) -> Callable[..., Any]:
    """Return the function with compiled helpers in the place of the plain ones it names."""
    import numba

    namespace = dict(function.__globals__)
    for name in function.__code__.co_names:
        called = namespace.get(name)
        if isinstance(called, FunctionType) and called in _helpers:
            if _helpers[called] is None:
                plain = _with_compiled_helpers(called)
                _helpers[called] = numba.njit(cache=True, nogil=True, error_model="numpy")(plain)
            namespace[name] = _helpers[called]
    copy = FunctionType(function.__code__, namespace, function.__name__, function.__defaults__)
    copy.__module__, copy.__qualname__ = function.__module__, function.__qualname__
    return copy


def warm() -> None:
    """Compile every kernel that has been imported, so that small calls are fast too."""
    for each in _kernels:
        each.compile()


def warm_in_background() -> threading.Thread:
    """Warm without holding up this process; calls run interpreted meanwhile.

    Compiling would hold the interpreter lock for seconds. A child process does it and
    fills the cache, from which this process then loads in a fraction of a second.
    """

    def run() -> None:
        if not is_cached():
            modules = sorted({each.__module__ for each in _kernels})
            code = f"import {', '.join(modules)}; from explorer.compiled import warm; warm()"
            # The child must find these very sources, wherever it is started.
            paths = {"PYTHONPATH": str(Path(__file__).parents[1])}
            subprocess.run(  # noqa: S603 - our own interpreter and our own words
                [sys.executable, "-P", "-c", code],
                check=False,
                capture_output=True,
                env={**os.environ, **paths},
            )
        warm()

    thread = threading.Thread(target=run, name="warm kernels", daemon=True)
    thread.start()
    return thread


def is_cached() -> bool:
    """Whether the cache folder holds a compiled form of every imported kernel."""
    names = {path.name.split("-")[0] for path in cache_folder().glob("**/*.nbi")}
    return all(each.name in names for each in _kernels)


@functools.cache
def cache_folder() -> Path:
    """Where the compiled code of exactly these sources is kept, in the user's cache."""
    digest = hashlib.sha256()
    package = Path(__file__).parent
    for source in sorted(package.glob("*.py")):
        digest.update(source.name.encode())
        digest.update(source.read_bytes())
    default = Path.home() / ".cache"
    if sys.platform == "darwin":
        default = Path.home() / "Library" / "Caches"
    elif sys.platform == "win32":
        default = Path(os.environ.get("LOCALAPPDATA", Path.home()))
    root = Path(os.environ.get("XDG_CACHE_HOME") or default)
    return root / "flagged-explorer" / "kernels" / digest.hexdigest()[:16]
