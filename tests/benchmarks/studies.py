"""Design studies: designs a second, two workers beside one, and the memory of a million."""

from __future__ import annotations

import json
import os
import subprocess
import sys
import tempfile
from collections.abc import Iterator
from pathlib import Path
from typing import Any

import msgspec
import numpy as np
from sweep_faults import HereWorkers

from benchmarks.table import Row, per_second, times
from benchmarks.timing import ROOT, best_of, elapsed
from explorer import Design, leg_clearances, margins, poses_are_valid, run_study, workspace_volume
from explorer.mechanism.configuration import Configuration
from explorer.numerics.compiled import warm
from explorer.sweep import rows, run as runs
from explorer.sweep.rows import samples
from explorer.sweep.study import STUDIES, Sampling, Study, encode_study
from explorer.sweep.workers import LocalWorkers, Workers

NODES, DESIGNS, BY_HAND, SHARED, ROUNDS = 20, 256, 32, 3072, 3
CHUNK, SIZES = 1024, (1_000, 50_000, 1_000_000)
SHORT = {"DESIGNS": 4, "BY_HAND": 2, "SHARED": 64, "ROUNDS": 1, "SIZES": (100,)}

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
# A run whose workers hand in rows without computing them, as a process of its own.
ALONE = f"""
import json, resource, sys
sys.path[:1] = [{str(ROOT / "tests")!r}, {str(ROOT / "tests" / "support")!r}, {str(ROOT)!r}]
from benchmarks.studies import run_without_measures
progress = run_without_measures(int(sys.argv[1]))
most = resource.getrusage(resource.RUSAGE_SELF).ru_maxrss / 1024
print(json.dumps([progress.done, most, progress.seconds]))
"""


def study_of(count: int, chunk: int = 32) -> Study:
    """Return the study of so many designs."""
    return msgspec.structs.replace(STUDY, sampling=Sampling(count=count, seed=1), chunk=chunk)


def run() -> Iterator[Row]:
    """Yield the rows."""
    warm()
    yield _one_core()
    yield _two_workers()
    yield _memory()


def _one_core() -> Row:
    study, encoded = study_of(DESIGNS), encode_study(study_of(DESIGNS))
    rows.evaluate(encoded, 0, 4)
    rate = DESIGNS / best_of(ROUNDS, lambda: rows.evaluate(encoded, 0, DESIGNS))
    designs = [
        rows.design_of(study, dict(zip(study.variables, values, strict=True)))
        for values in samples(study, range(BY_HAND)).tolist()
    ]
    by_hand = BY_HAND / best_of(ROUNDS, lambda: [_measure_by_hand(design) for design in designs])
    return Row(
        f"exact volume, margins and clearances on {NODES} nodes an axis, one core",
        per_second(rate),
        "100/s",
        f"a loop over the public functions on arrays of nodes: {per_second(by_hand)}; "
        f"{times(rate / by_hand)}",
    )


def _measure_by_hand(design: Design) -> tuple[Any, ...]:
    """Measure a design with what is public, all nodes at once."""
    rotation = design.home_pose.rotation
    lows, highs = design.limits.box or ((0.0,) * 3, (0.0,) * 3)
    axes = [
        low + (high - low) * (np.arange(NODES) + 0.5) / NODES
        for low, high in zip(lows, highs, strict=True)
    ]
    nodes = np.stack(np.meshgrid(*axes, indexing="ij"), axis=-1).reshape(-1, 3)
    nodes = nodes[poses_are_valid(design, nodes, rotation)]
    distances = np.abs(margins(nodes, rotation))
    off = (distances >= 0.05 * design.reach).all(axis=1)
    clear = leg_clearances(Configuration(design, nodes, rotation)).clearance
    volume, share = workspace_volume(design).volume, (clear > 0.0).all(axis=1).mean()
    return volume, distances.min(axis=0), distances.mean(), clear[off].min(axis=0), share


def _two_workers() -> Row:
    study = study_of(SHARED)

    def clock(workers: Workers) -> float:
        with tempfile.TemporaryDirectory() as folder:
            return elapsed(lambda: run_study(study, Path(folder) / "results", workers))

    with LocalWorkers(1) as one, LocalWorkers(2) as two:
        # The first round loads what tasks need.
        found = [[clock(one), clock(two)] for _ in range(ROUNDS + 1)][1:]
    alone, both = (min(column) for column in zip(*found, strict=True))
    return Row(
        f"{SHARED} designs on two workers, {os.cpu_count()} cores, parts written",
        per_second(SHARED / both),
        "1.8 times one worker",
        f"one worker: {per_second(SHARED / alone)}; {times(alone / both)}",
    )


def run_without_measures(count: int) -> Any:
    """Run a study whose workers compute nothing: only the sweep itself is at work."""
    study = study_of(count, CHUNK)

    def evaluate(_: bytes, start: int, stop: int) -> rows.Rows:
        return rows.rows_of_dead_workers(study, range(start, stop), "")

    runs.evaluate = evaluate
    with tempfile.TemporaryDirectory() as folder:
        return run_study(study, Path(folder) / "results", HereWorkers())


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
