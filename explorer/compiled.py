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
import shutil
import subprocess
import sys
import threading
import time
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
        self.module = function.__module__
        self._name = f"{function.__module__.rpartition('.')[2]}.{function.__name__}"
        _kernels.append(self)

    def __call__(self, rows: int, *args: Arguments.args, **kwargs: Arguments.kwargs) -> None:
        """Run over `rows` rows, compiled when that pays or when it is ready anyhow."""
        if self._compiled is None and rows >= MANY_ROWS:
            self.compile()
        (self._compiled or self._function)(*args, **kwargs)

    @property
    def is_cached(self) -> bool:
        """Whether an earlier process has compiled it."""
        return any(cache_folder().glob(f"**/{self._name}-*.nbi"))

    @property
    def ready(self) -> bool:
        """Whether the compiled form is in use."""
        return self._compiled is not None

    def compile(self, *, here: bool = False) -> None:
        """Load what has been compiled before, or have it compiled and load it.

        Args:
            here: Compile in this process, rather than in a child that fills the cache.
        """
        with _compiling:
            if self._compiled is not None:
                return
            if not here and not self.is_cached:
                _compile_in_child([self.module])
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


def fill_cache() -> None:
    """Have every kernel that has been imported compiled by another process, for all to load."""
    missing = sorted({each.module for each in _kernels if not (each.ready or each.is_cached)})
    if missing:
        _compile_in_child(missing)


def warm() -> None:
    """Make every kernel that has been imported compiled, so that small calls are fast too."""
    fill_cache()
    for each in _kernels:
        each.compile()


def compile_here() -> None:
    """Compile every kernel that has been imported in this process, into the cache."""
    for each in _kernels:
        each.compile(here=True)


def warm_in_background(then: Callable[[], None] | None = None) -> threading.Thread:
    """Warm in a thread; calls run interpreted meanwhile.

    Args:
        then: Called there once all is warm.
    """

    def run() -> None:
        warm()
        if then is not None:
            then()

    thread = threading.Thread(target=run, name="warm kernels", daemon=True)
    thread.start()
    return thread


def _compile_in_child(modules: list[str]) -> None:
    """Have another process fill the cache; should it fail, this one compiles for itself.

    Compiling here would hold the interpreter lock for seconds, and at a level of
    optimisation that takes three times as long for kernels that run no faster.
    """
    code = f"import {', '.join(modules)}; from explorer.compiled import compile_here as c; c()"
    # The child must find these very sources, wherever it is started.
    changed = {"PYTHONPATH": str(Path(__file__).parents[1]), "NUMBA_OPT": "1"}
    subprocess.run(  # noqa: S603 - our own interpreter and our own words
        [sys.executable, "-P", "-c", code],
        check=False,
        capture_output=True,
        env={**os.environ, **changed},
    )
    _forget_old_caches()


def _forget_old_caches() -> None:
    """Remove what was compiled for sources that have not been used for a month."""
    month = 30 * 24 * 3600
    for folder in cache_folder().parent.glob("*"):
        if folder != cache_folder() and time.time() - folder.stat().st_mtime > month:
            shutil.rmtree(folder, ignore_errors=True)


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
