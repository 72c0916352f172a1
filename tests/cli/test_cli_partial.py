"""An answer is printed whole, and once, also when a file of it cannot be written or it is none."""

from __future__ import annotations

import errno
import os
import re
from pathlib import Path
from typing import Any

import pytest
from command_line import CommandLine

from explorer import InputError, NoAnswerError
from explorer.cli.commands.sweep import Sweep
from explorer.sweep.run import RunError

# Commands that write files beside their answer, the option of each file, and what names it.
PAPER = ("optimise", "--design", "paper-initial", "--target-volume", "900")
WITH_FILES: dict[str, tuple[tuple[str, ...], tuple[str, ...]]] = {
    "path": (("path", "--to", "12", "8", "7"), ("--out",)),
    "budget": (("budget", "--typical", "--wanted", "5"), ("--out",)),
    "optimise": (PAPER, ("--out", "--record")),
}
PROGRESS = re.compile(r"\[[#.]*\] .*")


def run(cli: CommandLine, *argv: object, status: int) -> tuple[str, list[str]]:
    """Return standard output, and the lines of standard error without those of progress."""
    cli.has_progress = True
    out, err = cli.run(*argv, status=status)
    return out, [line for line in err.splitlines() if not PROGRESS.fullmatch(line)]


def fail_for_space(*_: object) -> None:
    raise OSError(errno.ENOSPC, os.strerror(errno.ENOSPC))


@pytest.mark.parametrize("name", WITH_FILES)
def test_answer_is_printed_though_the_disk_is_full(
    cli: CommandLine, tmp_path: Path, monkeypatch: pytest.MonkeyPatch, name: str
) -> None:
    argv, options = WITH_FILES[name]
    files = [(option, tmp_path / f"{option[2:]}.x") for option in options]
    given = [*argv, *(word for pair in files for word in pair)]

    whole = cli_answer(cli, *argv)
    text, _ = run(cli, *argv, status=0)
    monkeypatch.setattr(os, "fsync", fail_for_space)
    found = cli_answer(cli, *given, status=1)
    ignored = {"seconds", "trajectory"}
    assert {key: found[key] for key in whole if key not in ignored} == {
        key: value for key, value in whole.items() if key not in ignored
    }
    assert not any(str(path) in str(found) for _, path in files)
    page, complaints = run(cli, *given, status=1)
    without_numbers = [re.sub("[0-9.]+ (s|ms)", "", each) for each in (page, text)]
    assert without_numbers[0] == without_numbers[1]
    (line,) = complaints
    assert line.startswith("explorer: cannot write ")
    assert all(str(path) in line for _, path in files)
    assert os.strerror(errno.ENOSPC) in line
    assert list(tmp_path.iterdir()) == []


def cli_answer(cli: CommandLine, *argv: object, status: int = 0) -> dict[str, Any]:
    cli.has_progress = True
    return cli.answer(*argv, status=status)


@pytest.mark.parametrize("failing", ["design.json", "run.json"])
def test_optimise_writes_each_file_that_it_can(
    cli: CommandLine, tmp_path: Path, monkeypatch: pytest.MonkeyPatch, failing: str
) -> None:
    usual = Path.replace

    def replace(self: Path, target: Path) -> Path:
        if Path(target).name == failing:
            raise OSError(errno.ENOSPC, os.strerror(errno.ENOSPC))
        return usual(self, target)

    monkeypatch.setattr(Path, "replace", replace)
    out, record = tmp_path / "design.json", tmp_path / "run.json"
    found = cli_answer(cli, *PAPER, "--out", out, "--record", record, status=1)
    (left,) = tmp_path.iterdir()
    assert found["converged"] is True
    assert found["files"] == [str(left)]
    assert {left.name, failing} == {"design.json", "run.json"}


def test_optimise_without_convergence_and_disk_reports_both_in_a_line(
    cli: CommandLine, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setattr(os, "fsync", fail_for_space)
    argv = [*PAPER[:3], "--target-volume", "2000", "--iterations", "1"]
    out, complaints = run(cli, *argv, "--record", tmp_path / "run.json", status=1)
    assert "best so far" in out
    (line,) = complaints
    assert "iteration" in line
    assert "; cannot write " in line


@pytest.mark.parametrize(
    "argv",
    [
        ("forces", "--position", "3", "4", "0"),
        ("accuracy", "--position", "3", "4", "0"),
        ("budget", "--position", "3", "4", "0"),
        ("budget", "--over", "box"),
        ("budget", "--typical", "--keep-actuators", "--wanted", "1e-9"),
        ("path", "--to", "12", "8", "-7"),
        ("forward", "--joints", "1", "2", "3", "4", "5", "600"),
        ("optimise", "--design", "paper-initial", "--target-volume", "20000"),
        ("export", "workspace", "--out", "x.stl", "--yaw-pitch-roll", "0", "0", "0"),
    ],
)
def test_question_without_answer_gives_one_object_and_status_1(
    cli: CommandLine, tmp_path: Path, monkeypatch: pytest.MonkeyPatch, argv: tuple[str, ...]
) -> None:
    monkeypatch.chdir(tmp_path)
    found = cli.answer(*argv, status=1)
    _, complaint = cli.run(*argv, status=1)
    if not {"found", "feasible"} & set(found):
        assert complaint == f"explorer: {found['message']}\n"
    assert list(tmp_path.iterdir()) == []


@pytest.mark.parametrize(
    "argv",
    [
        ("path", "--from", "40", "8", "7", "--to", "12", "8", "7"),
        ("path", "--to", "40", "8", "7"),
        ("path", "--to", "12", "8", "0"),
        ("path",),
        ("inverse", "--design", "nowhere"),
        ("optimise",),
        ("export", "workspace", "--out", "x.stl", "--density", "3"),
        ("sweep", "--out", "nowhere", "--summary"),
    ],
)
def test_bad_input_gives_no_object_and_status_2(cli: CommandLine, argv: tuple[str, ...]) -> None:
    assert cli.refusal(*argv, "--json", status=2)


@pytest.mark.parametrize(
    ("error", "status"), [(RunError("lost"), 1), (NoAnswerError("none"), 1), (InputError("no"), 2)]
)
@pytest.mark.parametrize("as_json", [True, False])
def test_any_error_of_status_1_is_an_object(
    cli: CommandLine,
    monkeypatch: pytest.MonkeyPatch,
    error: Exception,
    status: int,
    as_json: bool,
) -> None:
    def fail(_: Sweep) -> None:
        raise error

    monkeypatch.setattr(Sweep, "run", fail)
    out, err = cli.run("sweep", *["--json"] * as_json, status=status)
    assert out == (f'{{"message": "{error}"}}\n' if as_json and status == 1 else "")
    assert err == f"explorer: {error}\n"
