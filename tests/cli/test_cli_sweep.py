"""`explorer sweep` computes studies, goes on where it was, and refuses in one line."""

from __future__ import annotations

import importlib
import json
from pathlib import Path
from typing import Any

import msgspec
import pytest
from command_line import CommandLine
from sweep_faults import HereWorkers

import explorer
from explorer.app.storage.library import Library
from explorer.sweep.cluster import DaskWorkers
from explorer.sweep.results import load_results
from explorer.sweep.study import Objective, Sampling, Study, decode_study, encode_study

COMMAND = ("sweep",)
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


@pytest.fixture(autouse=True)
def _workers_in_this_process(  # pyright: ignore[reportUnusedFunction]
    monkeypatch: pytest.MonkeyPatch,
) -> None:
    monkeypatch.setattr("explorer.sweep.workers.LocalWorkers", HereWorkers)


@pytest.fixture
def file(tmp_path: Path) -> Path:
    path = tmp_path / "study.json"
    path.write_bytes(encode_study(STUDY))
    return path


def test_sweep_study_continues_and_is_summarised(
    cli: CommandLine, file: Path, tmp_path: Path
) -> None:
    out = tmp_path / "results"
    first = cli.answer(file, "--out", out, "--workers", 1, "--limit", 7)
    assert first["done"] == first["computed"] == 8
    assert first["complete"] is False
    rest = cli.answer(file, "--out", out, "--workers", 1)
    assert (rest["done"], rest["computed"], rest["total"]) == (20, 12, 20)
    # b1y = 0 is degenerate.
    assert rest["counts"] == {"done": 16, "invalid design": 4}
    assert cli.answer(file, "--out", out)["computed"] == 0

    summary = cli.answer("--out", out, "--summary")
    assert summary["complete"] is True
    assert summary["counts"] == rest["counts"]
    assert summary["objectives"] == [
        {"measure": "volume", "sense": "max"},
        {"measure": "reach", "sense": "min"},
    ]
    results = load_results(out)
    assert {row["index"] for row in summary["front"]} == {*results.front().nonzero()[0].tolist()}
    page = cli.text("--out", out, "--summary")
    assert "small: 20 of 20 designs" in page
    assert "invalid design: 4" in page
    assert f"Pareto front (volume max, reach min): {len(summary['front'])} designs" in page


def test_sweep_summary_names_damaged_parts_and_strays(
    cli: CommandLine, file: Path, tmp_path: Path
) -> None:
    out = tmp_path / "results"
    cli.answer(file, "--out", out, "--workers", 1, "--limit", 8)
    (out / "part-000001 copy.parquet").write_bytes((out / "part-000001.parquet").read_bytes())
    (out / "part-000001.parquet").write_bytes(b"")
    page, remarks = cli.run("--out", out, "--summary")
    assert "small: 4 of 20 designs" in page
    first, second = remarks.splitlines()
    assert "damaged parts are left out; a run computes them again: 1" in first
    assert "has that name: 'part-000001 copy.parquet'; move" in second


def test_sweep_summary_counts_incomparable_designs(cli: CommandLine, tmp_path: Path) -> None:
    file, out = tmp_path / "study.json", tmp_path / "results"
    study = msgspec.structs.replace(
        STUDY,
        # Some are degenerate, which is another thing.
        measures=("volume", "reach", "clearance"),
        objectives=(Objective("clearance", "max"),),
        clearance_margin=50.0,
    )
    file.write_bytes(encode_study(study))
    cli.answer(file, "--out", out, "--workers", 1)
    summary = cli.answer("--out", out, "--summary")
    assert summary["incomparable"] == summary["counts"]["done"] == 16
    assert summary["front"] == []
    assert "without a value of an objective, so not in the front: 16" in cli.text(
        "--out", out, "--summary"
    )


def test_sweep_row_is_a_design_file(cli: CommandLine, file: Path, tmp_path: Path) -> None:
    out = tmp_path / "results"
    cli.answer(file, "--out", out, "--workers", 1, "--limit", 4)
    design = explorer.decode_design(cli.text("--out", out, "--row", "3").encode(), "row")
    row = load_results(out)
    assert design.name == "small #3"
    assert explorer.workspace_volume(design).volume == row.columns["volume"][3]
    assert "design 19 has not been computed yet" in cli.refusal("--out", out, "--row", 19)
    assert "degenerate" in cli.refusal("--out", out, "--row", 2)


def test_sweep_design_replaces_that_of_the_study(
    cli: CommandLine, file: Path, tmp_path: Path
) -> None:
    out = tmp_path / "results"
    file.write_bytes(encode_study(msgspec.structs.replace(STUDY, objectives=())))
    cli.answer(file, "--design", "paper-optimal", "--out", out, "--limit", 1, "--workers", 1)
    assert load_results(out).study.base.name == "paper-optimal"
    assert "another study" in cli.refusal(file, "--out", out)
    assert "names no objectives" in cli.text("--out", out, "--summary")
    assert decode_study(cli.text("--new").encode(), "new").name == "trade-off"


def test_sweep_saved_design_is_found_by_name(
    cli: CommandLine, monkeypatch: pytest.MonkeyPatch, file: Path, tmp_path: Path
) -> None:
    monkeypatch.setenv("EXPLORER_DATA", str(tmp_path / "data"))
    # No file can have the second name, of 300 bytes.
    for number, name in enumerate(("mine", 100 * "あ")):
        Library().save(name, explorer.PRESETS["paper-optimal"])
        out = tmp_path / f"results-{number}"
        cli.answer(file, "--design", name, "--out", out, "--limit", 1, "--workers", 1)
        assert load_results(out).study.base.name == name


def test_sweep_bad_input_is_one_line_and_writes_nothing(
    cli: CommandLine, monkeypatch: pytest.MonkeyPatch, file: Path, tmp_path: Path
) -> None:
    out = tmp_path / "results"
    monkeypatch.setattr(DaskWorkers.__init__, "__kwdefaults__", {"patience": 0.3})

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
        ([file, "--out", out, "--scheduler", "here"], "address, such as tcp://"),
        ([file, "--out", out, "--scheduler", "tcp://h:1", "--workers", 2], "not both"),
        ([file, "--out", out, "--scheduler", "tcp://127.0.0.1:9"], "no Dask scheduler answers"),
        ([file, "--out", file], "study.json"),
        ([file, "--design", "paper", "--out", out], "no preset and no file named 'paper'"),
        ([file, "--design", LONG, "--out", out], "File name too long"),
        ([LONG, "--out", out], "no study and no file named"),
        (["--out", LONG, "--summary"], "File name too long"),
        ([file, "--out", LONG], "choose a shorter name"),
    ]
    for argv, words in cases:
        assert words in cli.refusal(*argv)
        assert not out.exists()


@pytest.mark.long
def test_sweep_scheduler_without_workers_is_reported(
    file: Path, tmp_path: Path, cli: CommandLine, monkeypatch: pytest.MonkeyPatch
) -> None:
    distributed: Any = importlib.import_module("distributed")
    said: list[str] = []
    with distributed.LocalCluster(
        n_workers=0, threads_per_worker=1, processes=True, dashboard_address=":0"
    ) as farm:

        def send_one(words: str) -> None:
            said.append(words)
            farm.scale(1)

        monkeypatch.setattr("explorer.cli.commands.sweep.write_error", send_one)
        scheduler = farm.scheduler_address
        found = cli.answer(file, "--out", tmp_path / "out", "--scheduler", scheduler)
    assert (found["done"], found["complete"]) == (20, True)
    assert said == [f"the scheduler has no worker yet: start one with dask worker {scheduler}"]
