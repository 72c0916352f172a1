"""Object code of kernels: packaged, else compiled once on a machine."""

from __future__ import annotations

import hashlib
import importlib
import os
import runpy
import subprocess
import sys
from functools import partial
from importlib.metadata import version
from pathlib import Path

import kernels
import numpy as np
import pytest

from explorer.files.packaged import SOURCES
from explorer.legs import clearance
from explorer.numerics.compiled import KERNELS
from explorer.numerics.object_code import DIGEST, PACKAGED, fingerprint_of, processor

# The processors for which object code is packaged.
COMMON = "linux-x86-64-v3"
# The versions of the compilers that made it; others make other code.
COMPILERS = {"numba": "0.68.1", "llvmlite": "0.50.0"}

SOURCE = """
from typing import NamedTuple
class Sides(NamedTuple):
    {fields}: float
def square(x):
    return {body}
def unused(x):
    return {other}
SCALE = {scale}
def area(x):
    return SCALE * (
        square(Sides(x)[0])  {note}
    )
"""


def fingerprint(folder: Path, signature: str = "f8(f8)", **changed: str) -> str:
    """Return the fingerprint of the function `area` in changed source code."""
    code = {"scale": "2.0", "body": "x * x", "other": "x", "fields": "a", "note": ""} | changed
    path = folder / f"{len(list(folder.iterdir()))}.py"
    path.write_text(SOURCE.format(**code), encoding="utf-8")
    names = runpy.run_path(str(path))
    return fingerprint_of(names["area"], {names["square"], names["unused"]}, signature)


def test_fingerprint_changes_with_the_code_and_constants_that_a_kernel_uses(tmp_path: Path) -> None:
    print_of = partial(fingerprint, tmp_path)
    assert print_of() == print_of(other="x + 1.0") == print_of(note="# A square.")
    assert print_of() != print_of(body="x * x * x")
    assert print_of() != print_of(scale="3.0")
    assert print_of() != print_of(signature="f4(f4)")
    assert print_of() != print_of(fields="b")


def is_whole(path: Path) -> bool:
    """Return whether a file holds object code after the digest of it."""
    data = path.read_bytes()
    return hashlib.sha256(data[DIGEST:]).digest() == data[:DIGEST]


def test_object_code_of_every_kernel_is_packaged_for_common_processors() -> None:
    # To be mended by python tests/tools/kernels.py on such a machine.
    kernels.import_all()
    folder = kernels.FOLDER.with_name(COMMON)
    assert {each.file_name for each in KERNELS} == {path.name for path in folder.iterdir()}
    assert all(map(is_whole, folder.iterdir()))


def instructions(code: bytes) -> list[bytes]:
    """Return the instructions and the scalar constants in object code.

    The rest depends on the numbers that Numba gives to names, and on the folder of the sources.
    """
    file = importlib.import_module("llvmlite.binding").ObjectFileRef.from_data(code)
    sections = ((each.name() or b"", each.data()) for each in file.sections())
    return [data for name, data in sections if name.startswith((b".text", b".ltext", b".rodata"))]


@pytest.mark.long
@pytest.mark.skipif(processor() != COMMON, reason="another processor")
@pytest.mark.skipif(
    tuple(map(version, COMPILERS)) != tuple(COMPILERS.values()), reason="other compilers"
)
def test_packaged_code_is_what_the_compilers_make_of_the_source() -> None:
    kernels.import_all()
    assert KERNELS
    for each in KERNELS:
        packaged = (kernels.FOLDER / each.file_name).read_bytes()[DIGEST:]
        assert any(instructions(packaged))
        assert instructions(packaged) == instructions(each.make_code()), each.file_name


@pytest.fixture
def unpackaged(tmp_path: Path) -> Path:
    """Return a folder with the sources of the explorer, and no packaged object code."""
    folder = tmp_path / "sources"
    (folder / "assets").mkdir(parents=True)
    (folder / "explorer").symlink_to(SOURCES / "explorer")
    for each in (SOURCES / "assets").iterdir():
        if each.name != PACKAGED:
            (folder / "assets" / each.name).symlink_to(each)
    return folder


def run_program(program: str, sources: Path, cache: Path) -> None:
    """Run a program in a process of its own, with its sources and its cache in folders."""
    environment = {**os.environ, "XDG_CACHE_HOME": str(cache), "PYTHONPATH": str(sources)}
    subprocess.run([sys.executable, "-c", program], check=True, env=environment, cwd=sources)


PROGRAM = """
import sys
import numpy as np
from explorer.legs.clearance import pair_rows
axes = np.random.default_rng(0).normal(size=(300, 4, 2, 3))
found, same, points = np.zeros((300, 6)), np.zeros((300, 6)), np.zeros((300, 6, 2, 3))
pair_rows(1, axes, same, points)
assert not pair_rows.ready
pair_rows(300, axes, found, points)
assert pair_rows.ready
np.testing.assert_allclose(found, same, rtol=1e-12)
"""


def test_kernel_without_packaged_code_is_compiled_into_the_cache_and_made_again_if_damaged(
    unpackaged: Path, tmp_path: Path
) -> None:
    cache = tmp_path / "cache"
    run_program(f"{PROGRAM}assert 'numba' not in sys.modules", unpackaged, cache)
    (made,) = cache.rglob("*.o")
    assert "pair_rows" in made.name
    made.write_bytes(made.read_bytes()[:-1])
    run_program(PROGRAM, unpackaged, cache)
    assert is_whole(made)


def test_packaged_kernel_needs_neither_numba_nor_a_cache(tmp_path: Path) -> None:
    cache = tmp_path / "cache"
    run_program(f"{PROGRAM}assert 'numba' not in sys.modules", SOURCES, cache)
    assert not cache.exists()


ENDING = """
import os, subprocess
from explorer.legs.clearance import pair_rows
start = subprocess.Popen
def start_and_end(*args, **options):
    start(*args, **options | {"stderr": None})
    os._exit(0)
subprocess.Popen = start_and_end
pair_rows.compile()
"""


def test_kernel_that_two_processes_compile_at_a_time_is_cached_whole_although_they_end_early(
    unpackaged: Path, tmp_path: Path
) -> None:
    cache = tmp_path / "cache"
    environment = {**os.environ, "XDG_CACHE_HOME": str(cache), "PYTHONPATH": str(unpackaged)}
    command = [sys.executable, "-c", ENDING]
    runs = [
        subprocess.Popen(command, env=environment, cwd=unpackaged, stderr=subprocess.PIPE)
        for _ in range(2)
    ]
    for run in runs:
        # The pipe is closed when the compiling process has ended too.
        run.communicate()
    (made,) = (path for path in cache.rglob("*") if path.is_file())
    assert is_whole(made)


@pytest.mark.long
def test_kernel_is_compiled_if_the_cache_cannot_be_written(
    unpackaged: Path, tmp_path: Path
) -> None:
    blocked = tmp_path / "file"
    blocked.touch()
    run_program(PROGRAM, unpackaged, blocked)


def test_kernel_takes_no_arrays_of_another_kind() -> None:
    axes, found = np.zeros((1, 4, 2, 3)), np.zeros((1, 6))
    points = np.zeros((1, 6, 2, 3))
    clearance.pair_rows.compile()
    clearance.pair_rows(1, axes, found, points)
    for wrong in (axes[..., ::-1], axes.astype(np.float32), axes[0], axes.tolist(), None):
        with pytest.raises(TypeError, match="argument 0"):
            clearance.pair_rows(1, wrong, found, points)  # pyright: ignore[reportArgumentType]
