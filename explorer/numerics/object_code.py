"""Object code of kernels: machine code that Numba makes, and that runs without Numba.

Object code depends on the processor and the operating system, but neither on Numba nor on the
version of Python, so that it can be packaged: for common processors, else in the user's cache.
Loading it takes llvmlite alone and milliseconds. The name of a file has a fingerprint of the
kernel's own source, of the functions that it calls and of the constants that it names: a change in
other code, a second checkout and a new installation use the same files.
"""

from __future__ import annotations

import contextlib
import ctypes
import functools
import hashlib
import importlib
import linecache
import os
import re
import sys
from collections.abc import Callable, Container
from pathlib import Path
from types import CodeType, FunctionType
from typing import Any

import numpy as np
import platformdirs

from explorer.files.packaged import packaged_file
from explorer.files.writing import write_whole

Function = Callable[..., Any]
LLVM = "llvmlite.binding"

# Numba's options for every kernel and helper.
OPTIONS: dict[str, Any] = {"nogil": True, "error_model": "numpy"}
# The type of most x86 processors since 2013 (in LLVM, and in the psABI of x86-64), and what it has.
COMMON_TYPE = "x86-64-v3"
COMMON_FEATURES = ("avx2", "bmi", "bmi2", "f16c", "fma", "lzcnt", "movbe")
# Name of a kernel's function in its object code.
SYMBOL = "kernel"
# The types of a signature, their names in LLVM and their bytes.
LLVM_TYPES = {"f8": ("double", 8), "i8": ("i64", 8), "b1": ("i8", 1)}
SCALARS: dict[str, Any] = {"f8": ctypes.c_double, "i8": ctypes.c_int64}
# Bytes from the start of an array's C structure to its data and to its shape (NumPy's public
# structure PyArrayObject_fields, on 64-bit machines).
DATA_AT = object.__basicsize__
SHAPE_AT = DATA_AT + 16

# Numba and LLVM's binding have few types, and importing them takes half a second and a tenth.
_import: Callable[[str], Any] = importlib.import_module

# What compiled code calls for its scratch arrays. The structure is that of Numba's arrays: count
# of references, destructor and its argument, data, size.
RUNTIME = """
declare ptr @malloc(i64)
declare void @free(ptr)

define ptr @NRT_MemInfo_alloc_aligned(i64 %size, i32 %align) {
  %wide = zext i32 %align to i64
  %room = add i64 %wide, 40
  %all = add i64 %room, %size
  %info = call ptr @malloc(i64 %all)
  store i64 1, ptr %info
  %address = ptrtoint ptr %info to i64
  %least = add i64 %address, %room
  %mask = sub i64 0, %wide
  %aligned = and i64 %least, %mask
  %data = inttoptr i64 %aligned to ptr
  %destructor = getelementptr i8, ptr %info, i64 8
  store ptr null, ptr %destructor
  %data.at = getelementptr i8, ptr %info, i64 24
  store ptr %data, ptr %data.at
  %size.at = getelementptr i8, ptr %info, i64 32
  store i64 %size, ptr %size.at
  ret ptr %info
}

define void @NRT_MemInfo_call_dtor(ptr %info) {
  call void @free(ptr %info)
  ret void
}
"""


def arguments_of(signature: str) -> list[tuple[str, int]]:
    """Return the type and the number of axes of each argument of a signature of Numba."""
    arguments = re.findall(r"(\w\d)(\[[^\]]*\])?", signature)
    return [(kind, axes.count(":") - 1 if axes else 0) for kind, axes in arguments]


def compile_object(function: Function, helpers: dict[Function, Any], signature: str) -> bytes:
    """Return the object code of a function in the subset of Python that Numba compiles.

    Its function `SYMBOL` takes arrays as pointers to their C structures. The helpers are functions
    that it may call, with their compiled forms; None before they are made.
    """
    numba, llvm = _import("numba"), _import(LLVM)
    # The wrappers for calls from Python would need Numba at run time.
    options = {**OPTIONS, "no_cpython_wrapper": True, "no_cfunc_wrapper": True}
    dispatcher = numba.njit(signature, **options)(_with_compiled_helpers(function, helpers))
    overload = next(iter(dispatcher.overloads.values()))
    module = llvm.parse_assembly(overload.library.get_llvm_str())
    for each in (RUNTIME, _entry(overload.fndesc.llvm_func_name, arguments_of(signature))):
        module.link_in(llvm.parse_assembly(each))
    module.verify()
    return _target_machine().emit_object(module)


def load_object(code: bytes, signature: str) -> Function:
    """Return the function in object code, as one that takes arrays of NumPy and numbers.

    It raises a TypeError if an array is of another type or not contiguous, and releases the
    interpreter lock.
    """
    arguments = arguments_of(signature)
    llvm = _import(LLVM)
    engine = llvm.create_mcjit_compiler(llvm.parse_assembly(""), _target_machine())
    engine.add_object_file(llvm.ObjectFileRef.from_data(code))
    engine.finalize_object()
    types = [ctypes.py_object if axes else SCALARS[kind] for kind, axes in arguments]
    native = ctypes.CFUNCTYPE(ctypes.c_int32, *types)(engine.get_function_address(SYMBOL))
    arrays = [(place, np.dtype(kind), axes) for place, (kind, axes) in enumerate(arguments) if axes]

    def call(*given: Any) -> None:
        for place, dtype, axes in arrays:
            array = given[place]
            if not (
                type(array) is np.ndarray
                and array.dtype == dtype
                and array.ndim == axes
                and array.flags.c_contiguous
            ):
                raise TypeError(f"argument {place} does not fit the signature {signature}")
        if native(*given):
            raise RuntimeError(f"a kernel of the signature {signature} failed")

    # The engine owns the machine code.
    call.__dict__["engine"] = engine
    return call


def processor() -> str:
    """Return the name of this system and its kind of processor, which run the same object code."""
    return f"{sys.platform}-{_processor_type()}"


@functools.cache
def _processor_type() -> str:
    """Return LLVM's name of the kind of processor for which code is made."""
    features = _import(LLVM).get_host_cpu_features()
    is_common = all(features.get(each) for each in COMMON_FEATURES)
    return COMMON_TYPE if is_common else _import(LLVM).get_host_cpu_name()


@functools.cache
def _target_machine() -> Any:
    llvm = _import(LLVM)
    llvm.initialize_native_target()
    llvm.initialize_native_asmprinter()
    # As for Numba's own code: its calls of mathematical functions may go far.
    return llvm.Target.from_default_triple().create_target_machine(
        cpu=_processor_type(),
        reloc="static" if llvm.get_process_triple().startswith("x86") else "default",
        codemodel="jitdefault",
        jit=True,
    )


def _entry(native: str, arguments: list[tuple[str, int]]) -> str:
    """Return the function `SYMBOL` in LLVM's language, which calls Numba's own function.

    Numba passes an array as the owners of its memory, which kernels do not use, the numbers of
    its entries and of their bytes, the data, the shape and the strides.
    """
    taken: list[str] = []
    types = ["ptr", "ptr"]
    passed = ["ptr %returned", "ptr %raised"]
    lines = ["  %returned = alloca ptr", "  %raised = alloca ptr"]
    for index, (kind, axes) in enumerate(arguments):
        llvm_type, size = LLVM_TYPES[kind]
        name = f"%a{index}"
        taken.append(f"{'ptr' if axes else llvm_type} {name}")
        if not axes:
            types.append(llvm_type)
            passed.append(taken[-1])
            continue
        lines += [
            f"  {name}.data.at = getelementptr i8, ptr {name}, i64 {DATA_AT}",
            f"  {name}.data = load ptr, ptr {name}.data.at",
            f"  {name}.shape.at = getelementptr i8, ptr {name}, i64 {SHAPE_AT}",
            f"  {name}.shape = load ptr, ptr {name}.shape.at",
            f"  {name}.stride{axes} = add i64 0, {size}",
        ]
        for axis in reversed(range(axes)):
            lines += [
                f"  {name}.length{axis}.at = getelementptr i64, ptr {name}.shape, i64 {axis}",
                f"  {name}.length{axis} = load i64, ptr {name}.length{axis}.at",
                f"  {name}.stride{axis} = mul i64 {name}.stride{axis + 1}, {name}.length{axis}",
            ]
        lines.append(f"  {name}.count = udiv i64 {name}.stride0, {size}")
        lengths = [f"i64 {name}.length{axis}" for axis in range(axes)]
        strides = [f"i64 {name}.stride{axis + 1}" for axis in range(axes)]
        types += ["ptr", "ptr", "i64", "i64", "ptr", *["i64"] * (2 * axes)]
        passed += ["ptr null", "ptr null", f"i64 {name}.count", f"i64 {size}"]
        passed += [f"ptr {name}.data", *lengths, *strides]
    head = (
        f'declare i32 @"{native}"({", ".join(types)})\ndefine i32 @{SYMBOL}({", ".join(taken)}) {{'
    )
    lines.append(f'  %status = call i32 @"{native}"({", ".join(passed)})\n  ret i32 %status\n}}')
    return "\n".join([head, *lines])


def _with_compiled_helpers(function: Function, helpers: dict[Function, Any]) -> Function:
    """Return a copy of a function that calls compiled helpers instead of plain ones."""
    numba = _import("numba")
    names = dict(function.__globals__)
    for name in function.__code__.co_names:
        called = names.get(name)
        if isinstance(called, FunctionType) and called in helpers:
            if helpers[called] is None:
                helpers[called] = numba.njit(**OPTIONS)(_with_compiled_helpers(called, helpers))
            names[name] = helpers[called]
    # Compiled code names the file of an exception, which differs from machine to machine.
    code = function.__code__.replace(co_filename=function.__module__)
    copy = FunctionType(code, names, function.__name__, function.__defaults__)
    copy.__module__, copy.__qualname__ = function.__module__, function.__qualname__
    return copy


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
    """Return digits that change with a function, the helpers that it calls, and its signature."""
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
