"""Runs of studies: every row once, the same bytes whatever interrupts them, nothing overwritten."""

from __future__ import annotations

import functools
import importlib
import io
import json
import math
import os
import random
import re
import signal
import socket
import subprocess
import sys
import threading
import time
from collections.abc import Iterator
from contextlib import ExitStack, suppress
from pathlib import Path
from typing import Any

import msgspec
import numpy as np
import pytest
from filelock import FileLock
from sweep_faults import DEADLY, HereWorkers, broken, deadly, foreign

import explorer
from explorer import InputError, workspace_volume
from explorer.errors import MissingExtraError
from explorer.jobs.jobs import WorkerDiedError
from explorer.numerics.number_text import UNITS, Unit
from explorer.sweep import run as runs
from explorer.sweep.cluster import DaskWorkers
from explorer.sweep.parts import LOCK_FILE, part_path, part_paths, read_part
from explorer.sweep.results import Results, csv_bytes, front, load_results, parquet_bytes, summarise
from explorer.sweep.rows import columns_of, samples
from explorer.sweep.run import Progress, RunError, run_study
from explorer.sweep.study import Objective, Sampling, Study, encode_study
from explorer.sweep.workers import LocalWorkers

STUDY = Study(
    name="small",
    design="paper-optimal",
    variables={"a3x": (12.0, 22.0), "a3y": (2.0, 10.0), "b1y": (-6.0, 2.0)},
    sampling=Sampling(method="latin-hypercube", count=83, seed=4),
    measures=("volume", "reach", "clearance"),
    nodes=4,
    objectives=(Objective("volume", "max"), Objective("reach", "min")),
    chunk=8,
)


ENVIRONMENT = {**os.environ, "PYTHONPATH": str(Path(explorer.__file__).parents[1])}


def copy_parts(source: Path, target: Path) -> None:
    for path in part_paths(source):
        (target / path.name).write_bytes(path.read_bytes())


def files_that_differ(folder: Path, other: Path) -> list[str]:
    """Return the names of the files of a folder whose bytes differ in another."""
    before, after = contents(folder), contents(other)
    return [name for name in before if before[name] != after[name]]


def contents(folder: Path) -> dict[str, bytes]:
    """Return the bytes of every file that a run leaves behind but the lock."""
    return {
        path.name: path.read_bytes() for path in sorted(folder.iterdir()) if path.name != LOCK_FILE
    }


@pytest.fixture(scope="module")
def whole(tmp_path_factory: pytest.TempPathFactory) -> Path:
    """A folder with the results of a run that nothing interrupted."""
    folder = tmp_path_factory.mktemp("whole")
    assert run_study(STUDY, folder, HereWorkers()).is_complete
    return folder


@pytest.fixture(scope="module")
def two() -> Iterator[LocalWorkers]:
    with LocalWorkers(2) as workers:
        yield workers


def test_run_writes_one_row_of_every_design_in_order(whole: Path) -> None:
    results, summary = load_results(whole), summarise(whole)
    assert results.columns["index"].tolist() == list(range(83))
    assert list(results.columns) == list(columns_of(STUDY))
    found = np.column_stack([results.columns[name] for name in STUDY.variables])
    assert np.array_equal(found, samples(STUDY, range(83)))
    assert set(results.columns["status"]) == {"done"}
    assert (summary.counts, summary.damaged) == ({"done": 83}, 0)
    mask = front(results.columns, STUDY.objectives)
    assert np.array_equal(results.front(), mask)
    assert sorted(row["index"] for row in summary.front) == np.flatnonzero(mask).tolist()  # pyright: ignore[reportArgumentType]
    volumes = [row["volume"] for row in summary.front]
    assert volumes == sorted(volumes, reverse=True)  # pyright: ignore[reportArgumentType]
    for row in (0, 40, 82):
        design = results.design_of_row(row)
        assert design.name == f"small #{row}"
        assert workspace_volume(design).volume == results.columns["volume"][row]
        assert results.design_at(row) == design
    for read in (results.design_of_row, results.design_at):
        with pytest.raises(InputError, match="within 0 to 82"):
            read(83)
    for chunk, path in enumerate(part_paths(whole)):
        part, table = read_part(path)
        assert (part.chunk, part.study) == (chunk, encode_study(STUDY))
        versions = json.loads(table.schema.metadata[b"explorer.versions"])
        assert versions["numpy"] == np.__version__
        assert {"python", "scipy", "flagged-explorer"} <= {*versions}
        assert table.schema.metadata[b"explorer.seed"] == b"4"


def test_missing_values_are_null_in_files_and_nan_in_columns(tmp_path: Path) -> None:
    study = msgspec.structs.replace(
        STUDY,
        variables={"b1y": (-1.0, 1.0)},
        sampling=Sampling(method="grid", count=3),
    )
    run_study(study, tmp_path, HereWorkers())
    results = load_results(tmp_path)
    assert results.columns["status"][1] == "invalid design"
    assert np.isnan(results.columns["volume"]).tolist() == [False, True, False]
    polars: Any = importlib.import_module("polars")
    assert polars.read_parquet(tmp_path)["volume"].null_count() == 1
    with pytest.raises(InputError, match="degenerate"):
        results.design_of_row(1)


def test_run_on_processes_has_the_same_bytes(
    whole: Path, two: LocalWorkers, tmp_path: Path
) -> None:
    seen: list[Progress] = []
    progress = run_study(STUDY, tmp_path, two, watch=seen.append)
    assert contents(tmp_path) == contents(whole)
    assert progress.counts == {"done": 83}
    assert [each.done for each in seen] == sorted(each.done for each in seen)
    assert seen[0].done == 0
    assert seen[0].seconds_left is None
    assert seen[-1].is_complete


@pytest.mark.parametrize("seed", range(2))
def test_interrupted_runs_write_the_same_bytes_and_repeat_no_part(
    seed: int, whole: Path, tmp_path: Path
) -> None:
    rng = random.Random(seed)
    pieces: list[range] = []
    while True:
        workers = HereWorkers()
        # Cut short after some chunks, or ended after some designs.
        looks = iter([False] * rng.randrange(3))
        progress = run_study(
            STUDY,
            tmp_path,
            workers,
            limit=rng.choice([None, 9, 20]),
            stop=functools.partial(next, looks, True),
        )
        pieces += workers.pieces
        kept = {part.name for part in part_paths(tmp_path)}
        assert len(kept) * 8 >= progress.done > 8 * (len(kept) - 1)
        if progress.is_complete:
            break
    assert contents(tmp_path) == contents(whole)
    # What was under way when it was cut is begun again, and nothing that had a part.
    assert {piece.start for piece in pieces} == set(range(0, 83, 8))
    run_study(STUDY, tmp_path, idle := HereWorkers())
    assert idle.pieces == []


def test_run_computes_damaged_parts_again(whole: Path, tmp_path: Path) -> None:
    run_study(STUDY, tmp_path, HereWorkers())
    paths = [part_path(tmp_path, chunk) for chunk in range(STUDY.chunks)]
    data = [path.read_bytes() for path in paths]
    paths[0].write_bytes(data[0][: len(data[0]) // 2])
    paths[1].write_bytes(b"")
    # One bit within a column, which only its checksum shows.
    spoilt = bytearray(data[2])
    spoilt[40] ^= 1
    paths[2].write_bytes(spoilt)
    # A part under the name of another.
    paths[3].write_bytes(data[4])
    paths[5].unlink()
    (tmp_path / ".part-000006.0123.part").write_bytes(b"half")
    # The part under another's name too, whose rows would come twice.
    assert summarise(tmp_path).damaged == 4
    assert load_results(tmp_path).columns["index"].tolist() == [*range(32, 40), *range(48, 83)]
    workers = HereWorkers()
    progress = run_study(STUDY, tmp_path, workers)
    assert [piece.start for piece in workers.pieces] == [0, 8, 16, 24, 40]
    assert progress.kept == 83 - 5 * 8
    assert contents(tmp_path) == contents(whole)


def test_copies_of_parts_are_listed_as_strays(whole: Path, tmp_path: Path) -> None:
    run_study(STUDY, tmp_path, HereWorkers(), limit=40)
    # One of a chunk that is still missing, one beyond the last, and others.
    strays = [
        "part-000001 copy.parquet",
        "part-0000007.parquet",
        "part-000011.parquet",
        "part-1.parquet",
        "mine.parquet",
    ]
    for name in strays:
        (tmp_path / name).write_bytes(part_path(whole, 1).read_bytes())
    found = summarise(tmp_path)
    assert (found.count, found.damaged, found.strays) == (40, 0, sorted(strays))
    assert load_results(tmp_path).columns["index"].tolist() == [*range(40)]
    assert run_study(STUDY, tmp_path, HereWorkers()).kept == 40
    assert summarise(tmp_path).counts == {"done": 83}
    assert summarise(tmp_path).front == summarise(whole).front
    assert summarise(whole).strays == []


def test_part_with_a_damaged_study_is_damaged(whole: Path, tmp_path: Path) -> None:
    copy_parts(whole, tmp_path)
    # The study is read from the first part.
    path = part_path(tmp_path, 0)
    data = path.read_bytes()
    assert data.count(b'"paper-optimal"') == 1
    path.write_bytes(data.replace(b'"paper-optimal"', b'"paper-0ptimal"'))
    assert summarise(tmp_path).damaged == 1
    assert load_results(tmp_path).study == STUDY
    assert run_study(STUDY, tmp_path, HereWorkers()).kept == 83 - 8
    assert contents(tmp_path) == contents(whole)


def test_folder_of_another_study_is_refused_unchanged(whole: Path, tmp_path: Path) -> None:
    other = msgspec.structs.replace(STUDY, name="other", sampling=Sampling(count=8))
    # The first part may be damaged: the others name their study.
    copy_parts(whole, tmp_path)
    part_path(tmp_path, 0).write_bytes(b"")
    for folder in (whole, tmp_path):
        before = contents(folder)
        with pytest.raises(InputError, match="holds the results of another study"):
            run_study(other, folder, HereWorkers())
        assert contents(folder) == before
    # Nor does one part of another study pass.
    mixed = tmp_path / "mixed"
    run_study(other, mixed, HereWorkers())
    part_path(mixed, 5).write_bytes(part_path(whole, 5).read_bytes())
    with pytest.raises(InputError, match=r"part-000005.parquet is a part of another study"):
        run_study(other, mixed, HereWorkers())
    with pytest.raises(InputError, match="several studies"):
        load_results(mixed)


@pytest.mark.parametrize("name", ["thesis.txt", "part-000000.parquet", ".profile"])
def test_folder_of_other_files_is_refused_unchanged(name: str, tmp_path: Path) -> None:
    (tmp_path / name).write_text("mine")
    with pytest.raises(InputError, match="is not empty, and holds no results"):
        run_study(STUDY, tmp_path, HereWorkers())
    assert contents(tmp_path) == {name: b"mine"}
    assert [each.name for each in tmp_path.iterdir()] == [name]
    with pytest.raises(InputError, match="holds no results of a study"):
        load_results(tmp_path)


def test_folder_with_only_damaged_parts_names_them(tmp_path: Path) -> None:
    study = msgspec.structs.replace(STUDY, sampling=Sampling(count=16))
    run_study(study, tmp_path, HereWorkers())
    before = contents(tmp_path)
    for chunk in range(2):
        part_path(tmp_path, chunk).write_bytes(b"PAR1")
    for read in (load_results, summarise):
        with pytest.raises(InputError, match=r"can be read: part-000000.parquet and 1 more"):
            read(tmp_path)
    with pytest.raises(InputError, match=r"part-000000.parquet and 1 more cannot be; .*move"):
        run_study(study, tmp_path, HereWorkers())
    for chunk in range(2):
        part_path(tmp_path, chunk).unlink()
    run_study(study, tmp_path, HereWorkers())
    assert contents(tmp_path) == before


@pytest.mark.parametrize("name", ["csv", "parquet"])
def test_table_of_results_has_the_value_of_each_row_and_column(whole: Path, name: str) -> None:
    polars: Any = importlib.import_module("polars")
    results = load_results(whole)
    is_csv = name == "csv"
    data = io.BytesIO(csv_bytes(results, UNITS) if is_csv else parquet_bytes(results))
    table = polars.read_csv(data) if is_csv else polars.read_parquet(data)
    heads = [head.partition(" [")[0] for head in table.columns] if is_csv else table.columns
    assert heads == [*results.columns]
    table.columns = heads
    for column, values in results.columns.items():
        # A number that a row lacks is NaN here and nothing there.
        lacks = [str(each) in ("nan", "") for each in values.tolist()]
        assert [each in (None, "") for each in table[column]] == lacks
        there = [each for each in table[column] if each not in (None, "")]
        assert there == values[~np.array(lacks)].tolist()


@pytest.mark.parametrize("lengths", [UNITS, STUDY.base.millimetres])
def test_csv_of_results_has_the_unit_of_each_column_in_its_header(lengths: Unit) -> None:
    polars: Any = importlib.import_module("polars")
    ranges = dict.fromkeys(("yaw", "b2", "radius", "tool_x", "payload_mass"), (1.0, 3.0))
    study = msgspec.structs.replace(
        STUDY,
        variables=ranges,
        measures=("volume", "home_worst_turn", "inverse_condition"),
        objectives=(),
    )
    kinds = columns_of(study)
    columns = {name: np.array([2.0 if kind == "float64" else 1]) for name, kind in kinds.items()}
    table = polars.read_csv(io.BytesIO(csv_bytes(Results(study, columns), lengths)))
    unit, size = lengths.name, 2.0 * lengths.factor
    of_lengths = ("b2", "radius", "tool_x")
    volume = lengths.to_power(3, math.inf)
    expected = {
        **{f"{name} [{unit}]": size for name in of_lengths},
        f"volume [{volume.name}]": 2.0 * volume.factor,
        **dict.fromkeys(("yaw [°]", "home_worst_turn [°]"), 2.0),
        "payload_mass [kg]": 2.0,
        "inverse_condition": 2.0,
    }
    names = [name.partition(" [")[0] for name in table.columns]
    assert names == [*kinds]
    found = {name: table[name][0] for name in table.columns}
    assert {name: found[name] for name in expected} == pytest.approx(expected)
    assert found.keys() - expected.keys() == {"index", "status", "reason"}


def test_folder_in_use_is_refused(tmp_path: Path) -> None:
    with FileLock(tmp_path / LOCK_FILE), pytest.raises(InputError, match="another process"):
        run_study(STUDY, tmp_path, HereWorkers())
    # Another lock object of this process would share the file handle.
    assert run_study(STUDY, tmp_path, HereWorkers(), limit=1).done == 8


def test_run_without_pyarrow_names_the_extra(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setitem(sys.modules, "pyarrow", None)
    with pytest.raises(MissingExtraError, match=r"\.\[study\]"):
        run_study(STUDY, tmp_path / "new", HereWorkers())
    assert not (tmp_path / "new").exists()


def test_design_that_kills_workers_is_a_row_beside_the_others(
    whole: Path, two: LocalWorkers, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setattr(runs, "evaluate", deadly)
    progress = run_study(STUDY, tmp_path, two)
    assert progress.counts == {"done": 82, "worker died": 1}
    lost, intact = load_results(tmp_path).columns, load_results(whole).columns
    assert lost["index"].tolist() == list(range(83))
    assert lost["status"][DEADLY] == "worker died"
    assert "3 workers in a row" in lost["reason"][DEADLY]
    assert np.isnan(lost["volume"][DEADLY])
    assert lost["a3x"].tolist() == intact["a3x"].tolist()
    others = np.arange(83) != DEADLY
    assert lost["volume"][others].tolist() == intact["volume"][others].tolist()
    # Only the chunk with that design is another.
    assert files_that_differ(whole, tmp_path) == ["part-000001.parquet"]


@pytest.mark.long
def test_run_killed_and_continued_writes_the_same_bytes(tmp_path: Path) -> None:
    # So many designs that they are not done before it is killed, however late that is.
    study = msgspec.structs.replace(STUDY, nodes=40, sampling=Sampling(count=400, seed=2), chunk=2)
    file, folder = tmp_path / "study.json", tmp_path / "killed"
    file.write_bytes(encode_study(study))
    command = ["sweep", str(file), "--out", str(folder), "--workers", "1"]
    for _ in range(2):
        process = subprocess.Popen(
            [sys.executable, "-m", "explorer", *command],
            stdout=subprocess.DEVNULL,
            stderr=subprocess.DEVNULL,
            env=ENVIRONMENT,
        )
        before = len(part_paths(folder))
        # Killed once it has written something new.
        while process.poll() is None and len(part_paths(folder)) <= before:
            time.sleep(0.01)
        process.kill()
        process.wait()
    kept = load_results(folder).count
    progress = run_study(study, folder, HereWorkers())
    assert 4 <= kept == progress.kept < progress.done == 400
    run_study(study, tmp_path / "whole", HereWorkers())
    assert contents(folder) == contents(tmp_path / "whole")


@pytest.mark.long
def test_workers_of_a_killed_process_end(tmp_path: Path) -> None:
    script = tmp_path / "script.py"
    # They are at work, and do not read their pipes.
    work = "import os, time; print(os.getpid(), flush=True); time.sleep(600)"
    script.write_text(
        "from explorer.sweep.workers import LocalWorkers\n"
        "if __name__ == '__main__':\n"
        "    workers = LocalWorkers(2)\n"
        f"    tasks = [workers.submit(exec, {work!r}) for _ in range(2)]\n"
        "    tasks[0].result()\n"
    )
    command = [sys.executable, str(script)]
    # What a task prints does not get between the frames of its process.
    with subprocess.Popen(command, stderr=subprocess.PIPE, text=True, env=ENVIRONMENT) as process:
        assert process.stderr is not None
        ids = [int(process.stderr.readline()) for _ in range(2)]
        process.kill()
        process.wait()
    while any(_lives(each) for each in ids):
        time.sleep(0.05)


@pytest.mark.long
def test_script_without_main_guard_writes_the_same_bytes(whole: Path, tmp_path: Path) -> None:
    (tmp_path / "study.json").write_bytes(encode_study(STUDY))
    (tmp_path / "script.py").write_text(
        "from explorer.sweep.run import run_study\n"
        "from explorer.sweep.study import load_study\n"
        "from explorer.sweep.workers import LocalWorkers\n"
        "with LocalWorkers(2) as workers:\n"
        "    run_study(load_study('study.json'), 'results', workers)\n"
    )
    command = [sys.executable, "script.py"]
    subprocess.run(command, cwd=tmp_path, check=True, env=ENVIRONMENT)
    assert contents(tmp_path / "results") == contents(whole)


@pytest.mark.long
def test_workers_killed_at_their_start_are_started_again() -> None:
    with LocalWorkers(1) as workers:
        found = workers.submit(os.getpid)
        killed: set[int] = set()
        while len(killed) < 6:
            for process in workers.jobs.process_ids():
                with suppress(ProcessLookupError):
                    os.kill(process, signal.SIGKILL)
                killed.add(process)
            time.sleep(0.001)
        assert found.result(60.0) not in killed


def test_run_ends_when_workers_cannot_start_fail_or_have_other_versions(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    def refuse(*_: object, **__: object) -> None:
        raise BlockingIOError("Resource temporarily unavailable")

    for task, words in (
        (foreign, r"other versions.*numpy 1\.0"),
        (broken, "cannot do the tasks: ModuleNotFoundError"),
    ):
        monkeypatch.setattr(runs, "evaluate", task)
        with pytest.raises(RunError, match=words):
            run_study(STUDY, tmp_path, HereWorkers())
    monkeypatch.setattr(subprocess, "Popen", refuse)
    with LocalWorkers(2) as workers, pytest.raises(RunError, match="no worker process stays alive"):
        run_study(STUDY, tmp_path, workers)
    assert part_paths(tmp_path) == []


def _lives(process_id: int) -> bool:
    try:
        state = Path(f"/proc/{process_id}/stat").read_text().rpartition(")")[2].split()[0]
    except OSError:
        return False
    return state != "Z"


def test_run_that_stop_ends_writes_nothing_more(tmp_path: Path) -> None:
    # A chunk of these takes minutes.
    study = msgspec.structs.replace(STUDY, nodes=200, chunk=83)
    looks = iter([False, False])
    workers = LocalWorkers(1)
    try:
        progress = run_study(study, tmp_path, workers, stop=functools.partial(next, looks, True))
    finally:
        workers.shutdown(cancel_futures=True)
    assert progress.done == 0
    assert not part_paths(tmp_path)


def test_local_workers_import_nothing_from_the_working_folder(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    for name in ("types", "signal", "numpy"):
        (tmp_path / f"{name}.py").write_text("raise SystemExit('not the library')\n")
    monkeypatch.chdir(tmp_path)
    with LocalWorkers(1) as workers:
        assert workers.submit(abs, -1).result() == 1


def test_local_workers_return_results_raise_errors_and_survive_deaths() -> None:
    with LocalWorkers(2) as workers:
        assert [f.result() for f in [workers.submit(pow, k, 2) for k in range(9)]] == [
            k * k for k in range(9)
        ]
        assert isinstance(workers.submit(int, "x").exception(), ValueError)
        assert isinstance(workers.submit(os._exit, 3).exception(), WorkerDiedError)
        assert workers.submit(max, 1, 2).result() == 2
        # Arguments and results that cannot be pickled raise, and end nothing.
        assert workers.submit(lambda: 1).exception() is not None
        assert "cannot be sent" in str(workers.submit(eval, "lambda: 1").exception())
        assert workers.submit(os.getenv, "OMP_NUM_THREADS").result() == "1"
        running = [workers.submit(time.sleep, 600) for _ in range(2)]
        waiting = [workers.submit(time.sleep, 600) for _ in range(9)]
        while not all(each.running() for each in running):
            time.sleep(0.01)
        workers.shutdown(cancel_futures=True)
        assert all(isinstance(each.exception(), WorkerDiedError) for each in running)
        assert all(each.cancelled() for each in waiting)
        with pytest.raises(RuntimeError, match="shutdown"):
            workers.submit(max, 1, 2)
    for size in (0, -1, 10_000):
        with pytest.raises(InputError, match="workers must be from 1"):
            LocalWorkers(size)


@pytest.mark.long
def test_run_on_dask_with_a_killed_worker_writes_the_same_bytes(
    whole: Path, tmp_path: Path
) -> None:
    distributed: Any = importlib.import_module("distributed")
    with (
        distributed.LocalCluster(
            n_workers=2, threads_per_worker=1, processes=True, dashboard_address=":0"
        ) as farm,
        distributed.Client(farm) as client,
    ):
        ids: list[int] = list(client.run(os.getpid).values())
        killed: list[int] = []

        def kill_one(progress: Progress) -> None:
            if progress.done and not killed:
                killed.append(ids[0])
                os.kill(ids[0], signal.SIGKILL)

        with DaskWorkers(farm.scheduler_address) as workers:
            assert workers.size == 2
            run_study(STUDY, tmp_path, workers, watch=kill_one)
    assert killed
    assert contents(tmp_path) == contents(whole)


@pytest.mark.parametrize(
    "address",
    [
        *("tcp://127.0.0.1:9", "127.0.0.1:9", "tcp://", "http://127.0.0.1:8786"),
        *("tcp://127.0.0.1", "tcp://127.0.0.1:99999", "tcp://[::1", ""),
    ],
)
def test_missing_scheduler_is_refused_in_one_line(address: str) -> None:
    with pytest.raises(InputError, match=re.escape(f"answers at {address} within")) as caught:
        DaskWorkers(address, patience=0.5)
    assert "\n" not in str(caught.value)


@pytest.mark.parametrize("greeting", [b"", b"SSH-2.0-OpenSSH_9.2\r\n"], ids=["mute", "another"])
def test_listener_that_is_no_scheduler_is_refused_in_one_line(greeting: bytes) -> None:
    """Dask's client waited for ever for the answer to its greeting."""
    with socket.create_server(("127.0.0.1", 0)) as server, ExitStack() as callers:

        def greet() -> None:
            with suppress(OSError):
                while True:
                    caller = callers.enter_context(server.accept()[0])
                    caller.sendall(greeting)

        thread = threading.Thread(target=greet)
        thread.start()
        callers.callback(thread.join)
        callers.callback(server.shutdown, socket.SHUT_RDWR)
        port = server.getsockname()[1]
        with pytest.raises(
            InputError, match=rf"no Dask scheduler answers at \S+:{port} "
        ) as caught:
            DaskWorkers(f"tcp://127.0.0.1:{port}", patience=0.5)
        assert "\n" not in str(caught.value)


def test_workers_without_dask_name_the_extra(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setitem(sys.modules, "distributed", None)
    with pytest.raises(MissingExtraError, match="cluster"):
        DaskWorkers("tcp://127.0.0.1:8786")
