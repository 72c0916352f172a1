"""Object code of kernels: packaged, else compiled once on a machine, requested ones first."""

from __future__ import annotations

import hashlib
import os
import runpy
import subprocess
import sys
import threading
from collections.abc import Iterable
from functools import partial
from pathlib import Path

import kernels
import numpy as np
import pytest
from filelock import FileLock

import explorer
from explorer.files.packaged import SOURCES
from explorer.legs import clearance, tetrahedra
from explorer.numerics import compiled, kernel_cache
from explorer.numerics.compiled import Kernel, all_kernels, warm
from explorer.numerics.kernel_cache import (
    DIGEST,
    PACKAGED,
    Entry,
    await_cached,
    compile_all,
    fingerprint_of,
)
from explorer.optimise.defaults import make_problem
from explorer.optimise.solver import optimise_design
from explorer.workspace.slices import nodes

# The processors for which object code is packaged.
COMMON = "linux-x86-64-v3"
KERNELS = (nodes.count_nodes, clearance.pair_rows, tetrahedra.overlap_rows)


@pytest.fixture
def empty_cache(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> Path:
    """Let nothing be packaged, and the cache be an empty folder."""
    monkeypatch.setattr(kernel_cache, "cache_folder", lambda: tmp_path)
    monkeypatch.setattr(kernel_cache, "_packaged", list)
    return tmp_path


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
    return fingerprint_of(names["area"], {names["square"], names["unused"]}, signature)[0]


def test_fingerprint_changes_with_the_code_and_constants_that_a_kernel_uses(tmp_path: Path) -> None:
    print_of = partial(fingerprint, tmp_path)
    assert print_of() == print_of(other="x + 1.0") == print_of(note="# A square.")
    assert print_of() != print_of(body="x * x * x")
    assert print_of() != print_of(scale="3.0")
    assert print_of() != print_of(signature="f4(f4)")
    assert print_of() != print_of(fields="b")


def is_whole(path: Path) -> bool:
    """Whether a file holds object code after the digest of it."""
    data = path.read_bytes()
    return hashlib.sha256(data[DIGEST:]).digest() == data[:DIGEST]


def test_object_code_of_every_kernel_is_packaged_for_common_processors() -> None:
    # To be mended by python tests/kernels.py on such a machine.
    kernels.import_all()
    names = {each.entry.file_name for each in all_kernels()}
    assert names == {path.name for path in kernels.FOLDER.with_name(COMMON).iterdir()}
    assert all(map(is_whole, kernels.FOLDER.with_name(COMMON).iterdir()))


def test_fingerprints_of_kernels_differ() -> None:
    assert len({each.entry.fingerprint for each in KERNELS}) == len(KERNELS)


@pytest.fixture
def order(empty_cache: Path, monkeypatch: pytest.MonkeyPatch) -> list[str]:
    """Let compiling write an empty file into the cache; return the names in their order."""
    names: list[str] = []

    def compile_into_cache(entry: Entry) -> None:
        names.append(entry.name)
        (empty_cache / entry.file_name).touch()

    for each in KERNELS:
        monkeypatch.setattr(each.entry, "compile_here", partial(compile_into_cache, each.entry))
    return names


def test_compiling_takes_requested_kernels_first_then_the_shortest(order: list[str]) -> None:
    entries = sorted((each.entry for each in KERNELS), key=lambda entry: entry.effort)
    longest = entries[-1]
    for _ in range(2):
        # The second time all are in the cache, and none is compiled again.
        longest.request()
        assert compile_all([entry.label for entry in entries]) == 0
        assert order == [longest.name, *(entry.name for entry in entries[:-1])]
        assert all(entry.is_filled for entry in entries)


def test_progress_of_compiling_is_the_share_of_the_work_done_and_only_what_is_missing_counts(
    empty_cache: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    stored, *missing = sorted(KERNELS, key=lambda each: each.entry.effort)
    (empty_cache / stored.entry.file_name).touch()
    monkeypatch.setattr(compiled, "_kernels", [*missing, stored])
    monkeypatch.setattr(compiled, "await_cached", by_effort)
    loaded: list[Entry] = []

    def load(kernel: Kernel[...]) -> None:
        loaded.append(kernel.entry)

    monkeypatch.setattr(Kernel, "ready", False)
    monkeypatch.setattr(Kernel, "load", load)
    shares: list[float] = []
    warm(shares.append)
    assert loaded == [each.entry for each in (stored, *missing)]
    first, second = (each.entry.effort for each in missing)
    assert shares == [0.0, first / (first + second), 1.0]
    shares.clear()
    for each in missing:
        (empty_cache / each.entry.file_name).touch()
    warm(shares.append)
    assert shares == []


def by_effort(entries: Iterable[Entry]) -> list[Entry]:
    return sorted(entries, key=lambda entry: entry.effort)


def test_request_of_another_version_or_package_is_ignored(
    empty_cache: Path, order: list[str]
) -> None:
    requests = empty_cache / "requests"
    requests.mkdir()
    label = clearance.pair_rows.entry.label
    for name, text in ((f"pair_rows-{'0' * 16}", label), (f"system-{'1' * 16}", "os:system")):
        (requests / name).write_text(text, encoding="utf-8")
    assert compile_all([]) == 0
    assert order == []
    assert len(list(requests.iterdir())) == 2


def test_kernel_compiled_by_another_process_is_awaited_not_compiled_again(
    empty_cache: Path, order: list[str], monkeypatch: pytest.MonkeyPatch
) -> None:
    entry = clearance.pair_rows.entry
    started: list[object] = []

    def start(*given: object, **_: object) -> None:
        started.append(given)

    monkeypatch.setattr(subprocess, "Popen", start)
    lock = FileLock(empty_cache / "compiling.lock", is_singleton=False)
    ready: list[Entry] = []
    with lock.acquire():
        assert compile_all([entry.label]) == kernel_cache.BUSY
        waiter = threading.Thread(target=lambda: ready.extend(await_cached([entry], urgent=True)))
        waiter.start()
        while not any((empty_cache / "requests").glob("*")):
            waiter.join(0.01)
        assert not ready
        entry.compile_here()
        waiter.join(30.0)
    assert ready == [entry]
    assert not started
    assert order == ["pair_rows"]
    assert not any((empty_cache / "requests").glob("*"))


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


def test_kernel_with_many_rows_is_compiled_by_a_child_into_the_cache(
    unpackaged: Path, tmp_path: Path
) -> None:
    program = """
import sys
import numpy as np
from explorer.legs import tetrahedra
from explorer.legs.clearance import pair_rows
axes = np.random.default_rng(0).normal(size=(300, 4, 2, 3))
found, same, points = np.zeros((300, 6)), np.zeros((300, 6)), np.zeros((300, 6, 2, 3))
pair_rows(1, axes, same, points)
assert not pair_rows.ready
pair_rows(300, axes, found, points)
assert pair_rows.ready
assert pair_rows.entry.is_filled
assert "numba" not in sys.modules
np.testing.assert_allclose(found, same, rtol=1e-12)
"""
    cache = tmp_path / "cache"
    for _ in range(2):
        run_program(program, unpackaged, cache)
    (made,) = (path for path in cache.rglob("*.o") if "pair_rows" in path.name)
    assert not any("overlap_rows" in path.name for path in cache.rglob("*"))
    # Damaged code is made again, rather than run.
    made.write_bytes(made.read_bytes()[:-1])
    run_program(program.replace('"numba" not in sys.modules', "True"), unpackaged, cache)
    assert is_whole(made)


def test_packaged_kernel_needs_neither_numba_nor_a_cache(tmp_path: Path) -> None:
    program = """
import sys
import numpy as np
from explorer.legs.clearance import pair_rows
axes = np.random.default_rng(0).normal(size=(300, 4, 2, 3))
pair_rows(300, axes, np.zeros((300, 6)), np.zeros((300, 6, 2, 3)))
assert pair_rows.ready
assert "numba" not in sys.modules
"""
    cache = tmp_path / "cache"
    run_program(program, SOURCES, cache)
    assert not cache.exists()


def test_kernel_takes_no_arrays_of_another_kind() -> None:
    axes, found = np.zeros((1, 4, 2, 3)), np.zeros((1, 6))
    points = np.zeros((1, 6, 2, 3))
    clearance.pair_rows.compile()
    clearance.pair_rows(1, axes, found, points)
    for wrong in (axes[..., ::-1], axes.astype(np.float32), axes[0], axes.tolist(), None):
        with pytest.raises(TypeError, match="argument 0"):
            clearance.pair_rows(1, wrong, found, points)  # pyright: ignore[reportArgumentType]


def test_kernel_is_compiled_if_the_cache_cannot_be_written(
    unpackaged: Path, tmp_path: Path
) -> None:
    blocked = tmp_path / "file"
    blocked.touch()
    program = """
import numpy as np
from explorer.legs.clearance import pair_rows
axes = np.random.default_rng(0).normal(size=(300, 4, 2, 3))
pair_rows(300, axes, np.zeros((300, 6)), np.zeros((300, 6, 2, 3)))
assert pair_rows.ready
assert not pair_rows.entry.is_filled
"""
    run_program(program, unpackaged, blocked)


def test_optimisation_needs_no_compiled_volume(monkeypatch: pytest.MonkeyPatch) -> None:
    from explorer.workspace.slices.integration import integrate_slices

    monkeypatch.setattr(integrate_slices, "_compiled", None)
    monkeypatch.setattr("explorer.optimise.solver.warm_in_background", lambda: None)
    problem = make_problem(explorer.PRESETS["paper-optimal"], "match-volume", volume=7500.0)
    outcome = optimise_design(problem)
    assert outcome.converged
    assert not integrate_slices.ready
