"""A study of a million designs: what was measured of its parts, and what follows for the whole."""

from __future__ import annotations

import heapq
import json
import pickle
import subprocess
import sys
import tempfile
from collections.abc import Iterator
from concurrent.futures import FIRST_COMPLETED, wait
from pathlib import Path
from typing import Any, NamedTuple

import numpy as np
from sweep_faults import HereWorkers

from benchmarks.processes import ROOT
from benchmarks.studies import local_cluster, of_designs
from benchmarks.table import Row, per_second, seconds
from benchmarks.timing import best_of, elapsed
from explorer import DaskWorkers, LocalWorkers
from explorer.numerics.compiled import warm
from explorer.sweep import rows, run as runs
from explorer.sweep.parts import part_path, write_part
from explorer.sweep.run import AHEAD
from explorer.sweep.study import encode_study
from explorer.sweep.workers import Workers

MILLION, WORKERS, CHUNK = 1_000_000, 100, 1024
TASKS, TIMED = 2000, 64
SIZES = (1_000, 50_000, MILLION)

# A run whose workers hand in rows without computing them, as a process of its own.
ALONE = f"""
import json, resource, sys, tempfile
sys.path[:1] = [{str(ROOT / "tests")!r}, {str(ROOT / "tests" / "support")!r}, {str(ROOT)!r}]
from benchmarks.studies_scale import idle_run
progress = idle_run(int(sys.argv[1]))
most = resource.getrusage(resource.RUSAGE_SELF).ru_maxrss / 1024
print(json.dumps([progress.done, most, progress.seconds]))
"""


class Cost(NamedTuple):
    """Seconds that a chunk takes of a worker, and of the sweep itself."""

    worker: float
    sweep: float


def run() -> Iterator[Row]:
    """Yield the rows."""
    warm()
    overheads = _overheads()
    yield Row(
        "overhead of a task that does nothing, two workers",
        ", ".join(f"{name} {seconds(each)}" for name, each in overheads.items()),
    )
    yield _memory()
    yield _million(overheads["Dask"])


def _overheads() -> dict[str, float]:
    with LocalWorkers(2) as local:
        plain = _per_task(local)
    with local_cluster() as cluster, DaskWorkers(cluster.scheduler_address) as dask:
        return {"plain processes": plain, "Dask": _per_task(dask)}


def _per_task(workers: Workers) -> float:
    """Return the seconds that a task takes, as many under way as in a run."""

    def all_tasks() -> None:
        left, under_way = TASKS, set[Any]()
        while left or under_way:
            while left and len(under_way) < AHEAD * workers.size:
                under_way.add(workers.submit(abs, left))
                left -= 1
            under_way = wait(under_way, return_when=FIRST_COMPLETED).not_done

    all_tasks()
    return best_of(2, all_tasks) / TASKS


def idle_run(count: int) -> Any:
    """Run a study whose workers compute nothing: only the sweep itself is at work."""
    study = of_designs(count, CHUNK)

    def without_measures(_: bytes, start: int, stop: int) -> rows.Rows:
        return rows.rows_of_dead_workers(study, range(start, stop), "")

    runs.evaluate = without_measures
    with tempfile.TemporaryDirectory() as folder:
        return runs.run_study(study, Path(folder) / "results", HereWorkers())


def _memory() -> Row:
    found: list[tuple[int, float, float]] = []
    for count in SIZES:
        command = [sys.executable, "-c", ALONE, str(count)]
        done = subprocess.run(command, capture_output=True, text=True, check=True, cwd=ROOT)
        found.append(tuple(json.loads(done.stdout)))
    shown = ", ".join(f"{most:.0f} MB for {count:,}" for count, most, _ in found)
    count, _, duration = found[-1]
    return Row(
        "most memory of the sweep itself, by the number of designs",
        f"{shown}; {per_second(count / duration)} sampled, packed and written",
        "constant",
    )


def _million(overhead: float) -> Row:
    """Simulate a million designs on many workers by what one chunk was seen to cost."""
    study = of_designs(MILLION, CHUNK)
    encoded = encode_study(study)
    timed = np.array([elapsed(lambda k=k: rows.evaluate(encoded, k, k + 1)) for k in range(TIMED)])
    chunk = rows.rows_of_dead_workers(study, range(CHUNK), "")
    with tempfile.TemporaryDirectory() as name:
        folder = Path(name)
        writing = best_of(3, lambda: write_part(folder, study, 0, [chunk]))
        size = part_path(folder, 0).stat().st_size
    # Rows without measures are smaller than those with them by what these take.
    full = size + 8 * CHUNK * len(study.measures)
    held = len(pickle.dumps(rows.evaluate(encoded, 0, TIMED))) * CHUNK / TIMED
    cost = Cost(worker=float(timed.mean()) * CHUNK, sweep=writing + overhead)
    duration = _simulated(study.chunks, cost, float(timed.std()) * CHUNK**0.5)
    ideal = study.chunks * cost.worker / WORKERS
    return Row(
        f"a million designs on {WORKERS} workers, simulated, {CHUNK:,} designs a chunk",
        f"{duration / 3600.0:.2f} h, {ideal / duration:.0%} of the workers' time at work; "
        f"{study.chunks} files, {study.chunks * full / 1e6:.0f} MB; at most "
        f"{AHEAD * WORKERS} tasks under way, with rows of "
        f"{AHEAD * WORKERS * held / 1e6:.0f} MB if all were done at once",
        beside=f"a chunk: {seconds(cost.worker)} of a worker, {seconds(cost.sweep)} of the sweep",
    )


def _simulated(chunks: int, cost: Cost, spread: float) -> float:
    """Return how long chunks take on workers that one process hands them to, one at a time."""
    random = np.random.default_rng(0)
    free = [0.0] * WORKERS
    sweep = 0.0
    finished: list[float] = []
    for work in random.normal(cost.worker, spread, chunks).tolist():
        # A worker takes the next task from those that lie ready: it waits for nobody.
        done = heapq.heappop(free) + max(0.0, work)
        heapq.heappush(free, done)
        finished.append(done)
    for done in sorted(finished):
        sweep = max(sweep, done) + cost.sweep
    return sweep
