"""`explorer find` and `explorer check`: designs that keep a requirement, and what others miss."""

from __future__ import annotations

import errno
import json
import os
import re
import signal
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from command_line import CommandLine

import explorer
from explorer import rotation_from_quaternion
from explorer.cli.streams import Meter
from explorer.mechanism.design import LENGTHS

EASY: dict[str, Any] = {
    "kind": "requirement",
    "name": "easy",
    "box_mm": [100, 80, 60],
    "tilt_deg": 5,
    "legs": {"ratio": 2.0, "push_n": 100, "diameter_mm": 5},
    "payload": {"mass_kg": 1},
}
DEMAND = {"name", "kept", "worst", "limit", "spare", "unit", "position_mm", "quaternion", "proven"}
DESIGN = {
    *("file", "box", "longest_mm", "largest_utilisation", "clearance_mm", "transmission"),
    *("error_mm", "proven", "poses_checked"),
}
QUICK = ("--seconds", "0.5", "--count", "2")


def write_need(folder: Path, **changes: Any) -> Path:
    """Write the easy requirement with other values of some fields, and return its file."""
    file = folder / "need.json"
    file.write_text(json.dumps(EASY | changes))
    return file


def test_find_writes_designs_that_keep_the_requirement(cli: CommandLine, tmp_path: Path) -> None:
    need, out = write_need(tmp_path), tmp_path / "found"
    argv = ("find", need, "--out", out, *QUICK)
    cli.has_progress = True
    found = cli.answer(*argv)
    assert set(found) == {"designs", "bound_mm", "binding", "nearest"}
    assert sorted(each["file"] for each in found["designs"]) == sorted(map(str, out.iterdir()))
    for each in found["designs"]:
        assert set(each) == DESIGN
        assert found["bound_mm"] <= each["longest_mm"]
        design = explorer.load_design(each["file"])
        assert each["longest_mm"] == pytest.approx(
            design.unit_mm * max(high or 0.0 for _, high in map(design.length_range, LENGTHS))
        )
        box = design.unit_mm * np.array(design.required_box)
        assert each["box"] == {
            "centre_mm": pytest.approx(box.mean(axis=0).tolist()),
            "yaw_deg": design.required_yaw,
        }
        assert np.diff(box, axis=0)[0] == pytest.approx(EASY["box_mm"])
        check = cli.answer("check", "--design", each["file"], "--requirement", need)
        assert check["kept"] is True
    assert cli.answer(*argv) == found
    text = cli.text(*argv)
    assert "no machine has legs below" in text
    assert str(out / "1-balanced.json") in text


def test_check_tells_the_worst_pose_of_each_demand(cli: CommandLine, tmp_path: Path) -> None:
    need = write_need(tmp_path, swing_deg=40, transmission=0.9, buildable=True)
    design = explorer.PRESETS["paper-optimal"]
    check = cli.answer("check", "--design", "paper-optimal", "--requirement", need, status=1)
    assert set(check) == {"kept", "demands"}
    assert check["kept"] is False
    assert all(set(each) == DEMAND for each in check["demands"])
    of = {each["name"]: each for each in check["demands"]}
    assert not all(each["kept"] for each in check["demands"])
    length = of["length"]
    pose = (
        np.array(length["position_mm"]) / design.unit_mm,
        rotation_from_quaternion(length["quaternion"]),
    )
    joints = dict(zip(explorer.JOINTS, explorer.inverse(design, *pose), strict=True))
    index = of["transmission index"]
    assert index["spare"] == pytest.approx(index["worst"] - index["limit"])
    out, err = cli.run("check", "--design", "paper-optimal", "--requirement", need, status=1)
    assert "missed" in out
    end, joint = re.findall(r"length \((longest|shortest) (..)\)", out)[0]
    assert (end == "longest") == (length["spare"] == length["limit"] - length["worst"])
    assert design.unit_mm * joints[joint] == pytest.approx(length["worst"])
    assert err.startswith("explorer: the design misses ")


def test_find_impossible_is_refused_with_its_bound(cli: CommandLine, tmp_path: Path) -> None:
    legs = {"ratio": 2.0, "longest_mm": 100.0}
    need, out = write_need(tmp_path, legs=legs, error_mm=0.1), tmp_path / "found"
    cli.has_progress = True
    found = cli.answer("find", need, "--out", out, "--seconds", "0.2", status=1)
    assert found["designs"] == []
    assert found["bound_mm"] > 100.0
    assert any("no machine has legs below" in clause for clause in found["binding"])
    assert [*out.iterdir()] == []
    for each in found["nearest"]:
        assert set(each) == {"demand", "value", "unit"}


def test_find_from_a_design_improves_it(cli: CommandLine, tmp_path: Path) -> None:
    need, out = write_need(tmp_path), tmp_path / "found"
    cli.has_progress = True
    first = cli.answer("find", need, "--out", out, "--seconds", "1", "--count", "1")
    start = first["designs"][0]
    argv = ("--design", start["file"], "--seconds", "1", "--count", "1")
    better = cli.answer("find", need, "--out", tmp_path / "better", *argv)
    assert better["designs"][0]["longest_mm"] <= 1.01 * start["longest_mm"]


def test_find_interrupted_keeps_what_was_found(
    cli: CommandLine, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    need, out = write_need(tmp_path), tmp_path / "found"

    sent: list[str] = []

    def show(_: Meter, text: str, _share: float) -> None:
        if "longest leg" in text and not sent:
            sent.append(text)
            signal.raise_signal(signal.SIGINT)

    monkeypatch.setattr(Meter, "show", show)
    usual = signal.getsignal(signal.SIGINT)
    found = cli.answer("find", need, "--out", out, "--seconds", "600")
    assert signal.getsignal(signal.SIGINT) == usual
    assert [each["file"] for each in found["designs"]] == [*map(str, out.iterdir())]
    assert found["designs"]


def test_find_answers_though_the_disk_is_full(
    cli: CommandLine, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    def fail(*_: object) -> None:
        raise OSError(errno.ENOSPC, os.strerror(errno.ENOSPC))

    need, out = write_need(tmp_path), tmp_path / "found"
    cli.has_progress = True
    monkeypatch.setattr(os, "fsync", fail)
    found = cli.answer("find", need, "--out", out, *QUICK, status=1)
    assert found["designs"]
    assert {each["file"] for each in found["designs"]} == {None}
    assert [*out.iterdir()] == []


@pytest.mark.parametrize(
    ("argv", "words"),
    [
        (("find", "need.json"), "--out"),
        (("find", "--out", "found"), "REQUIREMENT"),
        (("find", "nowhere.json", "--out", "found"), "cannot read 'nowhere.json'"),
        (("find", "design.json", "--out", "found"), "design.json"),
        (("find", "need.json", "--out", "found", "--count", "8"), "--count must lie within 1 to 7"),
        (("find", "need.json", "--out", "found", "--seconds", "0"), "--seconds must be a positive"),
        (("find", "need.json", "--out", "need.json"), "a file lies where the folder is meant"),
        (("find", "need.json", "--out", "found", "--design", "nobody"), "nobody"),
        (("check", "--design", "paper-optimal"), "--requirement"),
        (("check", "--requirement", "design.json"), "design.json"),
        (("check", "--requirement", "need.json", "--design", "need.json"), "need.json"),
    ],
)
def test_requirement_bad_input_is_refused_in_one_line(
    cli: CommandLine,
    tmp_path: Path,
    monkeypatch: pytest.MonkeyPatch,
    argv: tuple[str, ...],
    words: str,
) -> None:
    monkeypatch.chdir(tmp_path)
    write_need(tmp_path)
    design = explorer.PRESETS["paper-optimal"]
    (tmp_path / "design.json").write_bytes(explorer.encode_design(design))
    refusal = cli.refusal(*argv)
    assert words in refusal
