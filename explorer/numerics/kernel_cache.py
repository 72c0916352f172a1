"""The files of kernels' object code: packaged for common processors, else in the user's cache.

The name of a file has a fingerprint of the kernel's own source, of the functions that it calls and
of the constants that it names. A change in other code, a second checkout and a new installation
therefore use the same files.
"""

from __future__ import annotations

import contextlib
import functools
import hashlib
import linecache
import os
import re
from collections.abc import Callable, Container
from pathlib import Path
from types import CodeType, FunctionType
from typing import Any

import platformdirs

from explorer.files.packaged import packaged_file
from explorer.files.writing import write_whole
from explorer.numerics.object_code import OPTIONS, processor

# Folder of the object code that comes with the explorer, a folder for each processor.
PACKAGED = "kernels"
# Number of bytes of the digest before the code in a file.
DIGEST = hashlib.sha256().digest_size
# Number of hexadecimal digits of a fingerprint.
DIGITS = 16


def read_code(file_name: str) -> bytes | None:
    """Return the object code in a packaged or cached file; None if it is missing or damaged."""
    for path in (packaged_file(f"{PACKAGED}/{processor()}", file_name), cache_folder() / file_name):
        with contextlib.suppress(OSError):
            data = path.read_bytes()
            code = data[DIGEST:]
            if hashlib.sha256(code).digest() == data[:DIGEST]:
                return code
    return None


def write_code(folder: Path, file_name: str, code: bytes) -> None:
    """Write object code atomically into a folder, after a digest of it."""
    folder.mkdir(parents=True, exist_ok=True)
    write_whole(folder / file_name, hashlib.sha256(code).digest() + code)


@functools.cache
def cache_folder() -> Path:
    """Return the folder for object code in the user's cache."""
    root = Path(os.environ.get("XDG_CACHE_HOME") or platformdirs.user_cache_dir())
    return root / "flagged-explorer" / "kernels" / processor()


def fingerprint_of(
    function: Callable[..., Any], helpers: Container[Callable[..., Any]], signature: str
) -> str:
    """Return hexadecimal digits that change with a function and with the helpers that it calls.

    Args:
        function: The function.
        helpers: Functions whose code is part of the compiled code of those that call them.
        signature: The function's type signature for Numba.
    """
    digest = hashlib.sha256(repr((signature, OPTIONS)).encode())
    visited: set[Callable[..., Any]] = {function}
    waiting = [function]
    while waiting:
        called = waiting.pop()
        assert isinstance(called, FunctionType)  # noqa: S101 - kernels and helpers are
        code = called.__code__
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
    return digest.hexdigest()[:DIGITS]


def _source_of(code: CodeType) -> str:
    """Return the source of a function without comments; its bytecode varies with Python."""
    last = max(end or line or 0 for line, end, _, _ in code.co_positions())
    lines = linecache.getlines(code.co_filename)[code.co_firstlineno - 1 : last]
    return "\n".join(re.sub(r"\s*(#.*)?\s$", "", line) for line in lines)
