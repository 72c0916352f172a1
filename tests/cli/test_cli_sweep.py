"""`explorer sweep` computes studies, goes on where it was, and refuses in one line."""

from __future__ import annotations

import importlib
import json
import os
import signal
import subprocess
import sys
import time
from pathlib import Path
from typing import Any

import msgspec
import pytest

import explorer
from explorer.app.storage.library import Library
from explorer.cli import run
from explorer.sweep import cluster
from explorer.sweep.parts import part_paths
from explorer.sweep.results import load_results
from explorer.sweep.study import Objective, Sampling, Study, decode_study, encode_study

STUDY = Study(
    name="small",
    design="paper-initial",
    variables={"a3x": (8.0, 12.0), "b1y": (-2.0, 2.0)},
    sampling=Sampling(method="grid", count={"a3x": 4, "b1y": 5}),
    measures=("volume", "reach"),
    nodes=4,
    objectives=(Objective("volume", "max"), Objective("reach", "min")),
    chunk=4,
)


LONG = 300 * "x"


@pytest.fixture
def file(tmp_path: Path) -> Path:
    path = tmp_path / "study.json"
    path.write_bytes(encode_study(STUDY))
    return path


def answer(capsys: pytest.CaptureFixture[str], *argv: object) -> dict[str, Any]:
    """Return the one JSON object that the command writes on standard output."""
    assert run(["sweep", *map(str, argv), "--json"]) == 0
    captured = capsys.readouterr()
    assert captured.out.count("\n") == 1
    found: dict[str, Any] = json.loads(captured.out)
    return found


def refusal(capsys: pytest.CaptureFixture[str], *argv: object) -> str:
    """Return the one line on standard error of arguments that are refused with status 2."""
    assert run(["sweep", *map(str, argv)]) == 2
    captured = capsys.readouterr()
    assert captured.out == ""
    assert captured.err.count("\n") == 1
    assert "Traceback" not in captured.err
    return captured.err


def test_sweep_study_continues_and_is_summarised(
    capsys: pytest.CaptureFixture[str], file: Path, tmp_path: Path
) -> None:
    out = tmp_path / "results"
    begun = answer(capsys, file, "--out", out, "--workers", 1, "--limit", 7)
    assert begun["done"] == begun["computed"] == 8
    assert begun["complete"] is False
    rest = answer(capsys, file, "--out", out, "--workers", 1)
    assert (rest["done"], rest["computed"], rest["total"]) == (20, 12, 20)
    # b1y = 0 is degenerate.
    assert rest["counts"] == {"done": 16, "invalid design": 4}
    assert answer(capsys, file, "--out", out)["computed"] == 0

    summary = answer(capsys, "--out", out, "--summary")
    assert summary["complete"] is True
    assert summary["counts"] == rest["counts"]
    assert summary["objectives"] == [
        {"measure": "volume", "sense": "max"},
        {"measure": "reach", "sense": "min"},
    ]
    results = load_results(out)
    assert {row["index"] for row in summary["front"]} == {*results.front().nonzero()[0].tolist()}
    assert run(["sweep", "--out", str(out), "--summary"]) == 0
    page = capsys.readouterr().out
    assert "small: 20 of 20 designs" in page
    assert "invalid design: 4" in page
    assert f"Pareto front (volume max, reach min): {len(summary['front'])} designs" in page


def test_sweep_summary_names_damaged_parts_and_strays(
    capsys: pytest.CaptureFixture[str], file: Path, tmp_path: Path
) -> None:
    out = tmp_path / "results"
    answer(capsys, file, "--out", out, "--workers", 1, "--limit", 8)
    (out / "part-000001 copy.parquet").write_bytes((out / "part-000001.parquet").read_bytes())
    (out / "part-000001.parquet").write_bytes(b"")
    assert run(["sweep", "--out", str(out), "--summary"]) == 0
    told = capsys.readouterr()
    assert "small: 4 of 20 designs" in told.out
    first, second = told.err.splitlines()
    assert "1 damaged part is left out; a run computes it again" in first
    assert "has that name: 'part-000001 copy.parquet'; move" in second


def test_sweep_summary_counts_incomparable_designs(
    capsys: pytest.CaptureFixture[str], tmp_path: Path
) -> None:
    file, out = tmp_path / "study.json", tmp_path / "results"
    study = msgspec.structs.replace(
        STUDY,
        # Some are degenerate, which is another thing.
        measures=("volume", "reach", "clearance"),
        objectives=(Objective("clearance", "max"),),
        clearance_margin=50.0,
    )
    file.write_bytes(encode_study(study))
    answer(capsys, file, "--out", out, "--workers", 1)
    summary = answer(capsys, "--out", out, "--summary")
    assert summary["incomparable"] == summary["counts"]["done"] == 16
    assert summary["front"] == []
    assert run(["sweep", "--out", str(out), "--summary"]) == 0
    assert "without a value of an objective, so not in the front: 16" in capsys.readouterr().out


def test_sweep_row_is_a_design_file(
    capsys: pytest.CaptureFixture[str], file: Path, tmp_path: Path
) -> None:
    out = tmp_path / "results"
    answer(capsys, file, "--out", out, "--workers", 1, "--limit", 4)
    assert run(["sweep", "--out", str(out), "--row", "3"]) == 0
    design = explorer.decode_design(capsys.readouterr().out.encode(), "row")
    row = load_results(out)
    assert design.name == "small #3"
    assert explorer.workspace_volume(design).volume == row.columns["volume"][3]
    assert "design 19 has not been computed yet" in refusal(capsys, "--out", out, "--row", 19)
    assert "degenerate" in refusal(capsys, "--out", out, "--row", 2)


def test_sweep_design_replaces_that_of_the_study(
    capsys: pytest.CaptureFixture[str], file: Path, tmp_path: Path
) -> None:
    out = tmp_path / "results"
    answer(capsys, file, "--design", "paper-optimal", "--out", out, "--limit", 1, "--workers", 1)
    assert load_results(out).study.base.name == "paper-optimal"
    assert "another study" in refusal(capsys, file, "--out", out)


def test_sweep_saved_design_is_found_by_name(
    capsys: pytest.CaptureFixture[str],
    monkeypatch: pytest.MonkeyPatch,
    file: Path,
    tmp_path: Path,
) -> None:
    monkeypatch.setenv("EXPLORER_DATA", str(tmp_path / "data"))
    # No file can have the second name, of 300 bytes.
    for number, name in enumerate(("mine", 100 * "あ")):
        Library().save(name, explorer.PRESETS["paper-optimal"])
        out = tmp_path / f"results-{number}"
        answer(capsys, file, "--design", name, "--out", out, "--limit", 1, "--workers", 1)
        assert load_results(out).study.base.name == name


def test_sweep_new_study_can_be_loaded(capsys: pytest.CaptureFixture[str]) -> None:
    assert run(["sweep", "--new"]) == 0
    study = decode_study(capsys.readouterr().out.encode(), "new")
    assert study.name == "trade-off"


def test_sweep_study_without_objectives_has_no_front(
    capsys: pytest.CaptureFixture[str], tmp_path: Path
) -> None:
    file = tmp_path / "study.json"
    file.write_bytes(encode_study(msgspec.structs.replace(STUDY, objectives=())))
    answer(capsys, file, "--out", tmp_path / "results", "--workers", 1, "--limit", 1)
    assert run(["sweep", "--out", str(tmp_path / "results"), "--summary"]) == 0
    assert "names no objectives" in capsys.readouterr().out


def test_sweep_bad_input_is_one_line_and_writes_nothing(
    capsys: pytest.CaptureFixture[str],
    monkeypatch: pytest.MonkeyPatch,
    file: Path,
    tmp_path: Path,
) -> None:
    out = tmp_path / "results"
    monkeypatch.setattr(cluster, "PATIENCE", 0.3)

    def changed(**changes: object) -> Path:
        path = tmp_path / "changed.json"
        path.write_text(json.dumps({**json.loads(file.read_bytes()), **changes}))
        return path

    cases: list[tuple[list[object], str]] = [
        ([], "--out"),
        (["--out", out], "name a study file"),
        (["nothing.json", "--out", out], "no study and no file named 'nothing.json'"),
        ([tmp_path, "--out", out], "no plain file"),
        ([changed(variables={"a4": [1, 2]}), "--out", out], "no variable 'a4'"),
        (["--out", out, "--summary"], "holds no results"),
        (["--out", out, "--row", 0], "holds no results"),
        ([file, "--out", out, "--workers", 0], "--workers must lie within 1 to 1024"),
        ([file, "--out", out, "--workers", "many"], "--workers must be a whole number"),
        ([file, "--out", out, "--limit", 0], "--limit must lie within 1"),
        ([file, "--out", out, "--scheduler", "here"], "an address such as tcp://"),
        ([file, "--out", out, "--scheduler", "tcp://h:1", "--workers", 2], "not both"),
        ([file, "--out", out, "--scheduler", "tcp://127.0.0.1:9"], "no Dask scheduler answers"),
        ([file, "--out", out, "--sumary"], "did you mean --summary?"),
        ([file, "--out", file], "study.json"),
        ([file, "--design", "paper", "--out", out], "no preset and no file named 'paper'"),
        ([file, "--design", LONG, "--out", out], "File name too long"),
        ([LONG, "--out", out], "File name too long"),
        (["--out", LONG, "--summary"], "File name too long"),
        ([file, "--out", LONG], "choose a shorter name"),
    ]
    for argv, words in cases:
        assert words in refusal(capsys, *argv)
        assert not out.exists()
    for field, value, words in [
        ("variables", {"a3x": [5, 5]}, "the range of a3x is empty"),
        ("sampling", {"method": "sobol", "count": 0}, "sampling.count must lie within 1"),
        ("colour", "red", "unknown field"),
    ]:
        assert words in refusal(capsys, changed(**{field: value}), "--out", out)
        assert not out.exists()


def test_sweep_scheduler_without_workers_is_reported(
    file: Path,
    tmp_path: Path,
    capsys: pytest.CaptureFixture[str],
    monkeypatch: pytest.MonkeyPatch,
) -> None:
    distributed: Any = importlib.import_module("distributed")
    said: list[str] = []
    with distributed.LocalCluster(
        n_workers=0, threads_per_worker=1, processes=True, dashboard_address=None
    ) as farm:

        def send_one(words: str) -> None:
            said.append(words)
            farm.scale(1)

        monkeypatch.setattr("explorer.cli.commands.sweep.write_error", send_one)
        scheduler = farm.scheduler_address
        found = answer(capsys, file, "--out", tmp_path / "out", "--scheduler", scheduler)
    assert (found["done"], found["complete"]) == (20, True)
    assert said == [f"the scheduler has no worker yet: start one with dask worker {scheduler}"]


def test_sweep_interrupt_keeps_finished_parts(file: Path, tmp_path: Path) -> None:
    many = msgspec.structs.replace(
        STUDY, sampling=Sampling(count=100_000), measures=("volume", "reach", "clearance"), nodes=20
    )
    file.write_bytes(encode_study(many))
    out = tmp_path / "results"
    process = subprocess.Popen(
        [sys.executable, "-m", "explorer", "sweep", str(file), "--out", str(out)],
        stdout=subprocess.PIPE,
        stderr=subprocess.PIPE,
        text=True,
        env={**os.environ, "PYTHONPATH": str(Path(explorer.__file__).parents[1])},
        # As in a terminal, where the workers get it too.
        start_new_session=True,
    )
    while process.poll() is None and len(part_paths(out)) < 2:
        time.sleep(0.01)
    os.killpg(process.pid, signal.SIGINT)
    written, complaint = process.communicate(timeout=60)
    assert process.returncode == 130
    assert written == ""
    assert "Traceback" not in complaint
    assert complaint.splitlines()[-1].startswith("stopped; finished designs are kept")
    assert " of 100000 designs" in complaint
    assert load_results(out).count % 4 == 0
    # Nobody is left in its group, some moments later.
    deadline = time.monotonic() + 30.0
    while _lives(process.pid) and time.monotonic() < deadline:
        time.sleep(0.02)
    assert not _lives(process.pid)


def _lives(group: int) -> bool:
    try:
        os.killpg(group, 0)
    except ProcessLookupError:
        return False
    return True
