"""Design studies: designs a second, workers beside one, Dask beside processes, killed workers."""

from __future__ import annotations

import importlib
import os
import random
import signal
import tempfile
import threading
import time
from collections.abc import Iterator, Sequence
from operator import attrgetter
from pathlib import Path
from typing import Any, NamedTuple

import msgspec
import numpy as np

from benchmarks.table import Row, per_second, seconds, times
from benchmarks.timing import best_of, elapsed
from explorer import (
    DaskWorkers,
    Design,
    LocalWorkers,
    Pose,
    evaluate,
    home_pose,
    leg_clearances,
    margins,
    poses_are_valid,
    run_study,
    workspace_volume,
)
from explorer.numerics.compiled import warm
from explorer.sweep import rows
from explorer.sweep.results import load_results
from explorer.sweep.rows import design_of
from explorer.sweep.sampling import samples
from explorer.sweep.study import STUDIES, Sampling, Study, encode_study
from explorer.sweep.workers import Workers

NODES, DESIGNS, BY_HAND, BY_NODE = 20, 256, 32, 1
SHARED, KILLED, EVERY = 3072, 2000, 5.0
ROUNDS = 3
# Of those that are compared with one another; each takes its turn in every one.
TURNS = 5

STUDY = msgspec.structs.replace(
    STUDIES["trade-off"],
    measures=(
        "volume",
        "worst_margin",
        "mean_margin",
        *(f"margin_{k}" for k in (1, 2, 3)),
        "clearance",
        *(f"clearance_{pair}" for pair in (12, 13, 14, 23, 24, 34)),
    ),
    objectives=(),
    nodes=NODES,
)


def of_designs(count: int, chunk: int = 32) -> Study:
    """Return the study of so many designs."""
    return msgspec.structs.replace(STUDY, sampling=Sampling(count=count, seed=1), chunk=chunk)


def run() -> Iterator[Row]:
    """Yield the rows."""
    warm()
    yield _one_core()
    yield from _shared()
    yield _killed()


def _one_core() -> Row:
    study, encoded = of_designs(DESIGNS), encode_study(of_designs(DESIGNS))
    rows.evaluate(encoded, 0, 4)
    rate = DESIGNS / best_of(ROUNDS, lambda: rows.evaluate(encoded, 0, DESIGNS))
    designs = [
        design_of(study, dict(zip(study.variables, values, strict=True)))
        for values in samples(study, range(BY_HAND)).tolist()
    ]
    batched = BY_HAND / best_of(ROUNDS, lambda: [_by_hand(design) for design in designs])
    single = BY_NODE / elapsed(lambda: [_node_by_node(design) for design in designs[:BY_NODE]])
    return Row(
        f"exact volume, margins and clearances on {NODES} nodes an axis, one core",
        per_second(rate),
        "100/s",
        f"a loop over the public functions on arrays of nodes: {per_second(batched)}; "
        f"{times(rate / batched)}; node by node: {per_second(single)}; {times(rate / single)}",
    )


def _grid(design: Design) -> Any:
    lows, highs = design.limits.box or ((0.0,) * 3, (0.0,) * 3)
    axes = [
        low + (high - low) * (np.arange(NODES) + 0.5) / NODES
        for low, high in zip(lows, highs, strict=True)
    ]
    return np.stack(np.meshgrid(*axes, indexing="ij"), axis=-1).reshape(-1, 3)


def _by_hand(design: Design) -> tuple[Any, ...]:
    """Measure a design with what is public, all nodes at once."""
    rotation = home_pose(design).rotation
    nodes = _grid(design)
    nodes = nodes[poses_are_valid(design, nodes, rotation)]
    distances = np.abs(margins(nodes, rotation))
    off = (distances >= 0.05 * design.reach).all(axis=1)
    clear = leg_clearances(design, nodes, rotation).clearance
    least = clear[off].min(axis=0)
    volume = workspace_volume(design).volume
    share = (clear > 0.0).all(axis=1).mean()
    return volume, distances.min(axis=0), distances.min(axis=1).mean(), least, share


def _node_by_node(design: Design) -> tuple[Any, ...]:
    """Measure a design with what is public, pose by pose."""
    home = home_pose(design)
    found = [evaluate(design, Pose(tuple(p), home.quaternion)) for p in _grid(design).tolist()]
    kept = [each for each in found if not each.violations]
    distances = np.abs([each.margins for each in kept])
    clear = np.array([each.clearances.clearance for each in kept])
    return workspace_volume(design).volume, distances.min(axis=0), clear.min(axis=0)


class Spent(NamedTuple):
    """Seconds of a run: by the clock, and of processors by workers and sweep."""

    clock: float
    workers: float
    sweep: float

    @property
    def processors(self) -> float:
        """Of all processors."""
        return self.workers + self.sweep


def local_cluster() -> Any:
    """Return a Dask cluster of two processes with one thread each."""
    distributed: Any = importlib.import_module("distributed")
    return distributed.LocalCluster(
        n_workers=2, threads_per_worker=1, processes=True, dashboard_address=":0"
    )


def _shared() -> Iterator[Row]:
    study = of_designs(SHARED)
    with (
        LocalWorkers(1) as one,
        LocalWorkers(2) as two,
        local_cluster() as cluster,
        cluster.get_client() as client,
        DaskWorkers(cluster.scheduler_address) as dask,
    ):
        # The first round loads what tasks need.
        for workers in (one, two, dask):
            _spent(of_designs(64, 8), workers, [])
        ids: list[int] = list(client.run(os.getpid).values())
        everyone = ((one, one.process_ids), (two, two.process_ids), (dask, ids))
        rounds = [[_spent(study, *each) for each in everyone] for _ in range(TURNS)]
        most = _most(two, encode_study(study))
    alone, both, by_dask = (
        min(found, key=lambda s: s.clock) for found in zip(*rounds, strict=True)
    )
    more = [
        np.median([get(by_dask) / get(both) - 1.0 for _, both, by_dask in rounds])
        for get in (attrgetter("clock"), attrgetter("processors"))
    ]
    # One worker leaves the other core to the sweep; two share both with it.
    free = max(alone.workers, alone.sweep) / (0.5 * both.processors)
    yield Row(
        f"{SHARED} designs on two workers, {os.cpu_count()} cores, parts written",
        f"{per_second(SHARED / both.clock)}; {seconds(both.workers)} of processors in the workers, "
        f"{seconds(both.sweep)} in the sweep",
        "1.8 times one worker",
        f"one worker: {per_second(SHARED / alone.clock)}; {times(alone.clock / both.clock)} by the "
        f"clock, {times(free)} by the time of processors, as on two that are free; two processes "
        f"with one long task each, and nothing between them: {times(most)}",
    )
    yield Row(
        f"{SHARED} designs on Dask, a local cluster of two processes",
        per_second(SHARED / by_dask.clock),
        "10 % overhead",
        f"two plain processes: {per_second(SHARED / both.clock)}; in the median of {TURNS} turns "
        f"Dask takes {more[0]:+.1%} by the clock, {more[1]:+.1%} of the time of processors",
    )


def _most(workers: Workers, study: bytes) -> float:
    """Return how much more two processes get done here than one, when they share nothing."""

    def tasks(many: int) -> None:
        futures = [workers.submit(rows.evaluate, study, 0, SHARED // 2) for _ in range(many)]
        for each in futures:
            each.result()

    return 2.0 * best_of(ROUNDS, lambda: tasks(1)) / best_of(ROUNDS, lambda: tasks(2))


def _spent(study: Study, workers: Workers, ids: Sequence[int]) -> Spent:
    psutil: Any = importlib.import_module("psutil")

    def busy() -> float:
        times = [psutil.Process(each).cpu_times() for each in ids]
        return sum(each.user + each.system for each in times)

    with tempfile.TemporaryDirectory() as folder:
        before, own = busy(), time.process_time()
        clock = elapsed(lambda: run_study(study, Path(folder) / "results", workers))
        return Spent(clock, busy() - before, time.process_time() - own)


def _killed() -> Row:
    """Run a study while one of its two workers is killed every few seconds."""
    deaths, is_over = 0, threading.Event()
    # Finer grids, so that there is time for some deaths.
    study = msgspec.structs.replace(of_designs(KILLED, 16), nodes=2 * NODES)

    with tempfile.TemporaryDirectory() as folder, LocalWorkers(2) as workers:

        def kill() -> None:
            nonlocal deaths
            choice = random.Random(0)
            while not is_over.wait(EVERY):
                os.kill(choice.choice(workers.process_ids), signal.SIGKILL)
                deaths += 1

        killer = threading.Thread(target=kill)
        killer.start()
        began = time.perf_counter()
        progress = run_study(study, Path(folder) / "results", workers)
        duration = time.perf_counter() - began
        is_over.set()
        killer.join()
        indices = load_results(Path(folder) / "results").columns["index"].tolist()
    once = "once each" if indices == list(range(KILLED)) else "NOT once each"
    counts = ", ".join(f"{count} {status}" for status, count in progress.counts.items())
    return Row(
        f"a worker killed every {EVERY:g} s during {KILLED} designs, {2 * NODES} nodes an axis",
        f"{len(indices)} rows, {once}: {counts}; {deaths} deaths in {seconds(duration)}",
        f"all {KILLED} rows, once each",
    )
