"""The command line as a process: its streams, its signals, what it imports."""

from __future__ import annotations

import dataclasses
import inspect
import json
import os
import subprocess
import sys
from pathlib import Path

import pytest

import explorer
from explorer.cli import COMMANDS, run
from explorer.cli.parsing import load_command

PROGRAM = [sys.executable, "-m", "explorer"]


def process(*argv: str, env: dict[str, str] | None = None) -> subprocess.CompletedProcess[str]:
    return subprocess.run(
        [*PROGRAM, *argv],
        capture_output=True,
        encoding="utf-8",
        env={**os.environ, **(env or {})},
        timeout=60,
        check=False,
    )


def test_process_answer_is_one_json_object_and_status_0() -> None:
    done = process("inverse", "--position", "10", "5", "9", "--json")
    assert (done.returncode, done.stderr) == (0, "")
    assert set(json.loads(done.stdout)) == {"joints", "within_limits", "violations"}


def test_process_no_answer_is_status_1_and_one_line() -> None:
    done = process("forward", "--joints", "1", "1", "1", "1", "1", "1", "--json")
    assert done.returncode == 1
    assert json.loads(done.stdout)["feasible"] is False
    assert done.stderr.count("\n") == 1


def test_process_bad_input_is_status_2_and_one_line() -> None:
    done = process("forward", "--joints", "1", "2", "x")
    assert (done.returncode, done.stdout) == (2, "")
    assert done.stderr.count("\n") == 1


def test_installed_script_runs_the_module() -> None:
    script = Path(sys.executable).parent / "explorer"
    if not script.exists():
        pytest.skip("the project is not installed here")
    done = subprocess.run([script, "--version"], capture_output=True, text=True, check=True)
    assert done.stdout == f"explorer {explorer.__version__}\n"


@pytest.mark.parametrize("flag", ["--help", "-h"])
def test_help_lists_every_command(capsys: pytest.CaptureFixture[str], flag: str) -> None:
    assert run([flag]) == 0
    listed = capsys.readouterr().out
    for name, summary in COMMANDS.items():
        assert f"{name} " in listed
        assert summary in listed


@pytest.mark.parametrize("name", COMMANDS)
def test_help_of_a_command_describes_every_option(
    capsys: pytest.CaptureFixture[str], name: str
) -> None:
    assert run([name, "--help"]) == 0
    captured = capsys.readouterr()
    assert captured.err == ""
    assert captured.out.startswith(f"usage: explorer {name} ")
    assert COMMANDS[name] in captured.out
    for field in dataclasses.fields(load_command(name, COMMANDS)):
        option = f"--{field.name.replace('_', '-')}"
        is_placed = (
            field.default is dataclasses.MISSING or f"[{field.name.upper()}]" in captured.out
        )
        has_place = is_placed and "positional" in captured.out
        assert option in captured.out or has_place


@pytest.mark.parametrize("name", COMMANDS)
def test_summary_of_a_command_is_its_first_line(name: str) -> None:
    doc = inspect.getdoc(load_command(name, COMMANDS))
    assert doc is not None
    assert doc.splitlines()[0] == COMMANDS[name]


def test_version_is_that_of_the_package(capsys: pytest.CaptureFixture[str]) -> None:
    assert run(["--version"]) == 0
    assert capsys.readouterr().out == f"explorer {explorer.__version__}\n"


@pytest.mark.parametrize("argv", [["inverse"], ["forward", "--joints", *"123456"], ["--help"]])
def test_small_commands_import_no_slow_library(argv: list[str]) -> None:
    code = (
        "import sys; from explorer.cli import run; run(sys.argv[1:]); "
        "large = {'viser', 'numba', 'trimesh', 'manifold3d', 'playwright', 'scipy.optimize'}; "
        "sys.stderr.write(repr(sorted(large & set(sys.modules))))"
    )
    done = subprocess.run(
        [sys.executable, "-c", code, *argv], capture_output=True, text=True, check=True
    )
    assert done.stderr.endswith("[]")


def test_interrupt_is_silent_with_status_130(
    capsys: pytest.CaptureFixture[str], monkeypatch: pytest.MonkeyPatch
) -> None:
    def interrupted(name: str) -> object:
        raise KeyboardInterrupt

    monkeypatch.setattr("explorer.cli.options.load_design", interrupted)
    assert run(["inverse"]) == 130
    captured = capsys.readouterr()
    assert (captured.out, captured.err) == ("", "")


def test_internal_error_is_one_line_with_status_70(
    capsys: pytest.CaptureFixture[str], monkeypatch: pytest.MonkeyPatch
) -> None:
    def faulty(name: str) -> object:
        raise ZeroDivisionError("a\nb")

    monkeypatch.setattr("explorer.cli.options.load_design", faulty)
    monkeypatch.delenv("EXPLORER_DEBUG", raising=False)
    assert run(["inverse", "--json"]) == 70
    captured = capsys.readouterr()
    assert captured.out == ""
    assert captured.err.count("\n") == 1
    assert "ZeroDivisionError" in captured.err
    assert "report" in captured.err

    monkeypatch.setenv("EXPLORER_DEBUG", "1")
    assert run(["inverse", "--json"]) == 70
    assert "Traceback" in capsys.readouterr().err


@pytest.mark.skipif(os.name != "posix", reason="pipes of POSIX")
def test_closed_pipe_is_silent() -> None:
    read, write = os.pipe()
    os.close(read)
    done = subprocess.run([*PROGRAM, "inverse"], stdout=write, stderr=subprocess.PIPE, check=False)
    os.close(write)
    assert (done.returncode, done.stderr) == (141, b"")


@pytest.mark.skipif(not Path("/dev/full").exists(), reason="needs a full device")
def test_full_disk_is_one_line() -> None:
    with Path("/dev/full").open("w") as full:
        done = subprocess.run(
            [*PROGRAM, "inverse", "--json"], stdout=full, stderr=subprocess.PIPE, check=False
        )
    assert done.returncode == 2
    assert done.stderr.startswith(b"explorer: cannot write to standard output: ")
    assert done.stderr.count(b"\n") == 1


def test_ascii_terminal_gets_text_with_replacements() -> None:
    done = process("singularity", env={"PYTHONIOENCODING": "ascii", "PYTHONUTF8": "0"})
    assert (done.returncode, done.stderr) == (0, "")
    assert "?1" in done.stdout
