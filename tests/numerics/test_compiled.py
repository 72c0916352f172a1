"""Kernels: each is compiled once on a machine, requested ones first."""

from __future__ import annotations

import os
import subprocess
import sys
import threading
from collections.abc import Callable
from pathlib import Path
from types import FunctionType
from typing import Any

import pytest

import explorer
from explorer.legs import clearance, tetrahedra
from explorer.numerics import kernel_cache
from explorer.numerics.compiled import Kernel
from explorer.numerics.kernel_cache import Cacheable, await_cached, compile_all, fingerprint_of
from explorer.optimise.defaults import make_problem
from explorer.optimise.solver import optimise_design
from explorer.workspace.slices import nodes


@pytest.fixture
def empty_cache(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> Path:
    """Let the cache be an empty folder."""
    monkeypatch.setattr(kernel_cache, "cache_folder", lambda: tmp_path)
    return tmp_path


def function_of(source: str, module: str) -> Callable[..., Any]:
    names: dict[str, Any] = {"__name__": module}
    exec(source, names)
    return names["area"]


HELPER = """
SCALE = {scale}
def square(x):
    return {body}
def unused(x):
    return {other}
def area(x):
    return SCALE * square(x)
"""


def fingerprint(
    scale: str = "2.0",
    body: str = "x * x",
    other: str = "x",
    options: object = "f8(f8)",
    module: str = "areas",
) -> str:
    area = function_of(HELPER.format(scale=scale, body=body, other=other), module)
    assert isinstance(area, FunctionType)
    helpers = {area.__globals__["square"], area.__globals__["unused"]}
    return fingerprint_of(area, helpers, options)[0]


def test_fingerprint_changes_with_what_the_code_depends_on_and_nothing_else() -> None:
    assert fingerprint() == fingerprint(other="x + 1.0")
    assert fingerprint() != fingerprint(body="x * x * x")
    assert fingerprint() != fingerprint(scale="3.0")
    assert fingerprint() != fingerprint(options="f4(f4)")
    # Compiled code names the modules of its functions: what was moved is compiled again.
    assert fingerprint() != fingerprint(module="rooms.areas")


def test_kernels_have_fingerprints_of_their_own() -> None:
    kernels = (clearance.pair_rows, tetrahedra.overlap_rows, nodes.count_nodes)
    assert len({each.entry.fingerprint for each in kernels}) == len(kernels)


class Stand:
    """A kernel whose compilation writes a file and records the order."""

    def __init__(self, kernel: Cacheable, folder: Path, order: list[str]) -> None:
        self.entry = kernel.entry
        self._folder = folder
        self._order = order

    def compile_here(self) -> None:
        self._order.append(self.entry.name)
        (self._folder / f"stand-{self.entry.fingerprint}.nbc").touch()


def stand_in(
    monkeypatch: pytest.MonkeyPatch, folder: Path, *kernels: Kernel[...]
) -> tuple[list[Stand], list[str]]:
    order: list[str] = []
    stands = [Stand(each, folder, order) for each in kernels]
    for each, stand in zip(kernels, stands, strict=True):
        module = {clearance: "pair_rows", tetrahedra: "overlap_rows", nodes: "count_nodes"}
        for place, name in module.items():
            if getattr(place, name) is each:
                monkeypatch.setattr(place, name, stand)
    return stands, order


def test_compiling_takes_requested_kernels_first_then_the_shortest(
    empty_cache: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    kernels = (nodes.count_nodes, clearance.pair_rows, tetrahedra.overlap_rows)
    stands, order = stand_in(monkeypatch, empty_cache, *kernels)
    by_effort = sorted(stands, key=lambda each: each.entry.effort)
    longest = by_effort[-1].entry
    longest.request()
    assert compile_all([each.entry.label for each in stands]) == 0
    assert order == [longest.name, *(each.entry.name for each in by_effort[:-1])]
    assert all(each.entry.is_filled for each in stands)
    # What is there is not compiled again, whoever asks for it.
    longest.request()
    assert compile_all([each.entry.label for each in stands]) == 0
    assert len(order) == len(stands)


def test_request_of_another_version_is_ignored(
    empty_cache: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    (stand,), order = stand_in(monkeypatch, empty_cache, clearance.pair_rows)
    requests = empty_cache / "requests"
    requests.mkdir()
    other = requests / f"pair_rows-{'0' * 16}"
    other.write_text(stand.entry.label, encoding="utf-8")
    foreign = requests / f"system-{'1' * 16}"
    foreign.write_text("os:system", encoding="utf-8")
    assert compile_all([]) == 0
    assert order == []
    assert other.exists()


def test_kernel_compiled_by_another_process_is_awaited_not_compiled_again(
    empty_cache: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    (stand,), order = stand_in(monkeypatch, empty_cache, clearance.pair_rows)
    started: list[object] = []

    def start(*given: object, **_: object) -> None:
        started.append(given)

    monkeypatch.setattr(subprocess, "Popen", start)
    lock = kernel_cache.FileLock(empty_cache / "compiling.lock", is_singleton=False)
    ready: list[Stand] = []
    with lock.acquire():
        assert compile_all([stand.entry.label]) == kernel_cache.BUSY
        waiter = threading.Thread(target=lambda: ready.extend(await_cached([stand], urgent=True)))
        waiter.start()
        while not any((empty_cache / "requests").glob("*")):
            waiter.join(0.01)
        assert not ready
        stand.compile_here()
        waiter.join(30.0)
    assert ready == [stand]
    assert not started
    assert order == ["pair_rows"]
    assert not any((empty_cache / "requests").glob("*"))


def test_kernel_with_many_rows_is_compiled_by_a_child_into_the_cache(tmp_path: Path) -> None:
    program = """
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
np.testing.assert_allclose(found, same, rtol=1e-12)
"""
    environment = {**os.environ, "XDG_CACHE_HOME": str(tmp_path), "LOCALAPPDATA": str(tmp_path)}
    for _ in range(2):
        subprocess.run([sys.executable, "-c", program], check=True, env=environment)
    made = [path.name for path in tmp_path.rglob("*.nbc") if "pair_rows" in path.name]
    assert len(made) == 1
    # The code of helpers, requests and the lock aside, nothing else was made.
    assert not any("overlap_rows" in path.name for path in tmp_path.rglob("*"))


def test_kernel_is_compiled_if_the_cache_cannot_be_written(tmp_path: Path) -> None:
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
    environment = {**os.environ, "XDG_CACHE_HOME": str(blocked), "LOCALAPPDATA": str(blocked)}
    subprocess.run([sys.executable, "-c", program], check=True, env=environment)


def test_search_needs_no_compiled_volume(monkeypatch: pytest.MonkeyPatch) -> None:
    from explorer.workspace.slices.integration import integrate_slices

    monkeypatch.setattr(integrate_slices, "_compiled", None)
    monkeypatch.setattr("explorer.optimise.solver.warm_in_background", lambda: None)
    problem = make_problem(explorer.PRESETS["paper-optimal"], "match-volume", volume=7500.0)
    outcome = optimise_design(problem)
    assert outcome.converged
    assert not integrate_slices.ready
