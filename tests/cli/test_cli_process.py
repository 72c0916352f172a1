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
from command_line import CommandLine

import explorer
from explorer.cli import COMMANDS, main, run
from explorer.cli.parsing import load_command

PROGRAM = [sys.executable, "-m", "explorer"]


def test_process_answer_is_one_json_object_and_status_0() -> None:
    argv = [*PROGRAM, "inverse", "--position", "10", "5", "9", "--json"]
    done = subprocess.run(argv, capture_output=True, encoding="utf-8", check=False)
    assert (done.returncode, done.stderr) == (0, "")
    assert set(json.loads(done.stdout)) == {"joints", "within_limits", "violations"}


@pytest.mark.parametrize(("words", "status"), [(["1"] * 6, 1), (["1", "2", "x"], 2)])
def test_main_without_answer_exits_with_status_and_one_line(
    monkeypatch: pytest.MonkeyPatch,
    capsys: pytest.CaptureFixture[str],
    words: list[str],
    status: int,
) -> None:
    monkeypatch.setattr(sys, "argv", ["explorer", "forward", "--joints", *words])
    with pytest.raises(SystemExit) as leave:
        main()
    assert leave.value.code == status
    captured = capsys.readouterr()
    assert captured.out == ""
    assert captured.err.count("\n") == 1


@pytest.mark.long
def test_installed_script_runs_the_module() -> None:
    script = Path(sys.executable).parent / "explorer"
    if not script.exists():
        pytest.skip("the project is not installed here")
    done = subprocess.run([script, "--version"], capture_output=True, text=True, check=True)
    assert done.stdout == f"explorer {explorer.__version__}\n"


@pytest.mark.parametrize("flag", ["--help", "-h"])
def test_help_lists_every_command(cli: CommandLine, flag: str) -> None:
    listed = cli.text(flag)
    for name, summary in COMMANDS.items():
        assert f"{name} " in listed
        assert summary in listed


@pytest.mark.parametrize("name", COMMANDS)
def test_help_of_a_command_describes_every_option(cli: CommandLine, name: str) -> None:
    page, command = cli.text(name, "--help"), load_command(name, COMMANDS)
    assert page.startswith(f"usage: explorer {name} ")
    assert COMMANDS[name] in page
    assert (inspect.getdoc(command) or "").splitlines()[0] == COMMANDS[name]
    for field in dataclasses.fields(command):
        option = f"--{field.name.replace('_', '-')}"
        is_placed = field.default is dataclasses.MISSING or f"[{field.name.upper()}]" in page
        assert option in page or (is_placed and "positional" in page)


def test_version_is_that_of_the_package(cli: CommandLine) -> None:
    assert cli.text("--version") == f"explorer {explorer.__version__}\n"


def test_small_commands_import_no_slow_library() -> None:
    code = (
        "import sys; from explorer.cli import run; "
        "run(['inverse']); run(['forward', '--joints', *'123456']); run(['--help']); "
        "large = {'viser', 'numba', 'trimesh', 'manifold3d', 'playwright', 'scipy.optimize'}; "
        "sys.stderr.write(repr(sorted(large & set(sys.modules))))"
    )
    done = subprocess.run([sys.executable, "-c", code], capture_output=True, text=True, check=True)
    assert done.stderr.endswith("[]")


def raise_in_command(monkeypatch: pytest.MonkeyPatch, error: BaseException) -> None:
    """Make each command that loads a design raise an error."""

    def load(name: str) -> object:
        raise error

    monkeypatch.setattr("explorer.cli.options.load_design", load)


def test_interrupt_is_silent_with_status_130(
    capsys: pytest.CaptureFixture[str], monkeypatch: pytest.MonkeyPatch
) -> None:
    raise_in_command(monkeypatch, KeyboardInterrupt())
    assert run(["inverse"]) == 130
    assert capsys.readouterr() == ("", "")


def test_internal_error_is_one_line_with_status_70(
    cli: CommandLine, monkeypatch: pytest.MonkeyPatch
) -> None:
    raise_in_command(monkeypatch, ZeroDivisionError("a\nb"))
    monkeypatch.delenv("EXPLORER_DEBUG", raising=False)
    refused = cli.refusal("inverse", "--json", status=70)
    assert "ZeroDivisionError" in refused
    assert "report" in refused
    monkeypatch.setenv("EXPLORER_DEBUG", "1")
    assert run(["inverse", "--json"]) == 70
    assert "Traceback" in cli.capsys.readouterr().err


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


@pytest.mark.skipif(not Path("/dev/full").exists(), reason="needs a full device")
@pytest.mark.parametrize(
    ("argv", "status"),
    [
        (("inverse", "--json"), 0),
        (("inverse", "--design", "nowhere"), 2),
    ],
)
def test_full_standard_error_keeps_answer_and_status(argv: tuple[str, ...], status: int) -> None:
    with Path("/dev/full").open("w") as full:
        done = subprocess.run([*PROGRAM, *argv], stdout=subprocess.PIPE, stderr=full, check=False)
    assert done.returncode == status
    assert done.stdout.count(b"\n") == (status == 0)


@pytest.mark.long
@pytest.mark.skipif(os.name != "posix", reason="limits of POSIX")
def test_record_that_no_longer_fits_on_the_disk_keeps_design_and_answer(tmp_path: Path) -> None:
    argv = ("optimise", "--design", "paper-initial", "--target-volume", "900", "--json")
    # A file of at most 4 kB: the design fits, the record does not.
    limit = "import resource, sys; resource.setrlimit(resource.RLIMIT_FSIZE, (4096, 4096)); "
    code = f"{limit}from explorer.cli import run; sys.exit(run(sys.argv[1:]))"
    done = subprocess.run(
        [sys.executable, "-c", code, *argv, "--out", str(tmp_path / "best.json")],
        capture_output=True,
        encoding="utf-8",
        check=False,
    )
    assert done.returncode == 1
    found = json.loads(done.stdout)
    assert found["converged"] is True
    assert found["files"] == [str(tmp_path / "best.json")]
    assert explorer.load_design(found["files"][0]).name == found["design"]["name"]
    assert [path.name for path in tmp_path.iterdir()] == ["best.json"]
    last = done.stderr.splitlines()[-1]
    assert last.startswith(f"explorer: cannot write {str(tmp_path / 'best.record.json')!r}: ")


ALIKE = ("−-", "–-", "⁻-", "×x", "≤<=", "≥>=", "²2", "³3", '“"', '”"', "′'", "öo", "±+-", "° deg")
LETTERS = ("δdelta", "ΔDelta", "øo", "ŁL", "ßss", "ǿo", "ẑz", "æae")
LIKE = {pair[0]: pair[1:] for pair in (*ALIKE, *LETTERS, "½1/2", "≠!=", "µu", "漢?")}


def encodes(letter: str, encoding: str) -> bool:
    try:
        return bool(letter.encode(encoding))
    except UnicodeEncodeError:
        return False


@pytest.mark.parametrize("encoding", ["ascii", "cp1252", "utf-8"])
def test_terminal_gets_the_characters_most_like_those_that_it_lacks(encoding: str) -> None:
    text = "−1.5 – 2×3 ≤ 4² ≥ “Größe” 漢δ 10⁻³ ±½° V′ ≠ΔøŁǿẑæµ"
    code = (
        "from explorer.cli import streams; streams.prepare(); "
        f"streams.write({text!r}); streams.write_error({text!r})"
    )
    done = subprocess.run(
        [sys.executable, "-c", code],
        capture_output=True,
        env={**os.environ, "PYTHONIOENCODING": encoding, "PYTHONUTF8": "0"},
        check=True,
    )
    shown = "".join(each if encodes(each, encoding) else LIKE[each] for each in text)
    assert done.stdout.decode(encoding) == shown
    assert done.stderr.decode(encoding).rstrip() == shown
