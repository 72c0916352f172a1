"""`explorer optimise` finds designs, writes them whole or not at all, and owns up to failure."""

from __future__ import annotations

import json
import re
import signal
from collections.abc import Callable
from pathlib import Path

import pytest
from command_line import CommandLine

import explorer
from explorer.cli import INTERRUPTED
from explorer.cli.commands.optimise import MOVED
from explorer.cli.streams import Meter
from explorer.find.requirement import PREFERENCES, RequiredLegs, RequiredLoad, Requirement
from explorer.optimise.outcome import load_record

COMMAND = ("optimise",)
BOX = ["--box", "0", "-12", "0", "20", "22", "18"]
PAPER = ["--design", "paper-initial", *BOX, "--target-volume", "8000"]
CONTRACT = {"design", "objective", "volume", "iterations", "evaluations", "seconds", "converged"}
IMPOSSIBLE = ["--target-volume", "12000", "--bounds", "a3x=5:22", "a3y=1:12"]


def test_optimise_paper_problem_converges(cli: CommandLine, tmp_path: Path) -> None:
    out = tmp_path / "design.json"
    found = cli.answer(*PAPER, "--clearance", "0.2", "--out", out)
    assert set(found) >= CONTRACT
    assert found["converged"] is True
    assert found["objective"] <= 1e-9
    assert found["iterations"] <= 15
    design = explorer.load_design(str(out))
    assert json.loads(explorer.encode_design(design)) == found["design"]
    assert explorer.workspace_volume(design).volume == found["volume"]
    assert found["volume"] == pytest.approx(8000.0, rel=1e-9)
    # The box is that of the option; the orientation and the ties to the reach are the start's.
    start = explorer.PRESETS["paper-initial"]
    assert design.limits.box == ((0.0, -12.0, 0.0), (20.0, 22.0, 18.0))
    assert design.home == start.home
    assert design.limits.l1 == (0.0, None)
    assert found["files"] == [str(out), str(tmp_path / "design.record.json")]


def test_optimise_repeat_gives_the_same_outcome(cli: CommandLine, tmp_path: Path) -> None:
    kept = tmp_path / "run.json"
    first = cli.answer(*PAPER, "--seed", "3", "--record", str(kept))
    record = load_record(kept)
    assert record.settings.seed == 3
    assert record.design.variables[0] == first["design"]["a3"][0]
    again = cli.answer("--repeat", str(kept))
    assert {**again, "seconds": 0, "files": []} == {**first, "seconds": 0, "files": []}


def test_optimise_text_has_start_beside_optimum(cli: CommandLine) -> None:
    out, progress = cli.run(*PAPER)
    assert "converged: F = " in out
    lines = {line.split("  ")[0]: line.split() for line in out.splitlines() if line}
    assert lines["a3x"][1] == "10.0000"
    assert lines["volume"][1:3] == ["870.697", "8000.00"]
    assert "start 1 of 1" in progress


def test_optimise_without_convergence_writes_no_design(cli: CommandLine, tmp_path: Path) -> None:
    out, kept = tmp_path / "design.json", tmp_path / "run.json"
    out.write_text("as it was")
    found = cli.answer(*IMPOSSIBLE, "--out", out, "--record", str(kept), status=1)
    assert found["converged"] is False
    assert found["status"] == "infeasible"
    message = found["message"].replace(",", "")
    number = message.removesuffix(" units³").rpartition(" ")[2]
    assert found["volume"] == pytest.approx(float(number), rel=1e-3)
    assert out.read_text() == "as it was"
    assert found["files"] == [str(kept)]
    assert load_record(kept).runs[0].status == "infeasible"
    page, complaint = cli.run(*IMPOSSIBLE, status=1)
    last = complaint.splitlines()[-1]
    assert last.startswith(
        "explorer: no design within the bounds was found with a volume of 12,000"
    )
    assert "best so far" in page
    assert sorted(path.name for path in tmp_path.iterdir()) == ["design.json", "run.json"]


@pytest.fixture
def interrupt(monkeypatch: pytest.MonkeyPatch) -> Callable[..., None]:
    """Function that has this process send itself signals at an iterate, told by its progress."""

    def use(words: str, number: int, count: int = 1) -> None:
        def show(_meter: Meter, text: str, _share: float) -> None:
            if words in text:
                for _ in range(count):
                    signal.raise_signal(number)

        monkeypatch.setattr(Meter, "show", show)

    return use


REACH = ["--objective", "smallest-reach", "--starts", "5", "--least", "1"]


@pytest.mark.parametrize("name", ["SIGINT", "SIGTERM", "SIGHUP"])
def test_interrupted_search_writes_the_best_so_far_and_its_record(
    cli: CommandLine, tmp_path: Path, interrupt: Callable[..., None], name: str
) -> None:
    number = getattr(signal, name, None)
    if number is None:
        pytest.skip("this system has no such signal")
    usual = signal.getsignal(number)
    out, kept = tmp_path / "design.json", tmp_path / "design.record.json"
    interrupt("solving 4", number)
    found = cli.answer(*PAPER, "--out", out, status=1)
    assert signal.getsignal(number) == usual
    assert (found["status"], found["converged"]) == ("cancelled", False)
    assert found["files"] == [str(out), str(kept)]
    design, record = explorer.load_design(str(out)), load_record(kept)
    assert json.loads(explorer.encode_design(design)) == found["design"]
    assert record.design.variables == design.variables
    assert [run.status for run in record.runs] == ["cancelled"]
    assert len(record.history) == 4
    best = record.history[record.runs[0].best]
    assert best.objective == found["objective"]
    assert record.problem.design_at(best.values).variables == design.variables
    # What it misses counts first, then the objective.
    assert best == min(record.history, key=lambda it: (max(0.0, -it.spare), it.objective))
    assert best.number > 0


def test_search_interrupted_after_a_start_that_converged_is_no_whole_search(
    cli: CommandLine, tmp_path: Path, interrupt: Callable[..., None]
) -> None:
    kept = tmp_path / "run.json"
    interrupt("start 2 of 5, solving 3", signal.SIGTERM)
    page, complaint = cli.run(*REACH, "--record", kept, status=1)
    record = load_record(kept)
    assert (record.chosen, [run.status for run in record.runs]) == (0, ["converged", "cancelled"])
    words = "explorer: cancelled in start 2; the best so far is of start 1, converged: "
    assert complaint.startswith(words)
    assert "best so far" in page
    assert str(kept) in page


def test_second_interruption_ends_the_command_at_once(
    cli: CommandLine, tmp_path: Path, interrupt: Callable[..., None]
) -> None:
    interrupt("solving 2", signal.SIGINT, 2)
    assert cli.run(*REACH, "--out", tmp_path / "design.json", status=INTERRUPTED) == ("", "")
    assert not [*tmp_path.iterdir()]


@pytest.mark.parametrize("json_too", [False, True])
def test_optimise_volume_beyond_the_box_is_refused_at_once(
    cli: CommandLine, monkeypatch: pytest.MonkeyPatch, json_too: bool
) -> None:
    def never(*_: object, **__: object) -> None:
        pytest.fail("it searches, or compiles for a search")

    monkeypatch.setattr("explorer.optimise.solver.optimise_design", never)
    monkeypatch.setattr("explorer.numerics.compiled.warm", never)
    words = (
        "the box holds at most 2,499 of the 8,000 units³ asked for: lift the box with --box none, "
        "or take the paper's with --box 0 -12 0 20 22 18"
    )
    argv = ["--design", "paper-initial", "--target-volume", "8000", "--clearance", "0.2"]
    if json_too:
        found = cli.answer(*argv, status=1)
        assert set(found) >= CONTRACT
        assert found["converged"] is False
        assert (found["status"], found["holding"]) == ("infeasible", "box")
        assert (found["message"], found["iterations"], found["volume"]) == (words, 0, None)
    else:
        assert cli.refusal(*argv, status=1) == f"explorer: {words}"
    huge = ["--design", "paper-initial", "--target-volume", "20000"]
    assert cli.refusal(*huge, status=1).endswith("asked for: lift the box with --box none")


def test_optimise_box_none_lifts_the_box(cli: CommandLine) -> None:
    argv = ["--design", "paper-initial", "--target-volume", "8000", "--clearance", "0.2"]
    found = cli.answer(*argv, "--box", "none")
    assert found["converged"] is True
    assert found["objective"] <= 1e-9
    assert found["design"]["limits"]["box"] is None
    assert "none lifts that of the design" in " ".join(cli.text("--help").split())


def test_optimise_other_objectives_and_variables(cli: CommandLine) -> None:
    smallest = cli.answer(
        *("--objective", "smallest-reach", "--starts", "2", "--least", "1"),
        *("--bounds", "b1x=-10:10", "b1y=-10:10", "b2=-10:10", "b3=-10:10", "a3y=1:40"),
    )
    assert smallest["objective"] == smallest["reach"] <= 17.90
    assert len(smallest["runs"]) == 2
    largest = cli.answer(
        *("--objective", "largest-volume", "--target-reach", "15"), *("--free", "yaw", "reach")
    )
    assert largest["longest_leg"] <= 15.0 + 1e-6
    assert set(largest["values"]) == {"a3x", "a3y", "b1x", "b1y", "b2", "b3", "yaw", "reach"}


@pytest.mark.parametrize(
    ("argv", "words"),
    [
        (["--required-box", "8", "4", "6", "12", "8", "10"], "box_mm"),
        (["--required_box=8"], "box_mm"),
        (["--tilt", "5"], "tilt_deg"),
        (["--held"], "payload"),
        (["--error", "0.1"], "error_mm"),
        (["--stroke-ratio", "2"], "ratio of legs"),
        (["--objective", "largest-margin"], "margin_mm"),
        (["--objective=smallest-load"], '"prefer": "little-force"'),
        (["--free", "yaw", "shift-x"], "box_mm"),
        (["--bounds", "shift-z=-3:6"], "box_mm"),
    ],
)
def test_words_about_a_box_are_refused_with_what_a_requirement_states(
    cli: CommandLine, argv: list[str], words: str
) -> None:
    message = cli.refusal("--target-volume", "5000", *argv, status=2)
    assert f"state {words}" in message
    assert "explorer find NEED.json" in message


def test_every_key_of_a_requirement_that_replaces_an_option_is_one() -> None:
    known = {*Requirement.__struct_fields__, *RequiredLegs.__struct_fields__}
    known |= {*RequiredLoad.__struct_fields__, *PREFERENCES}
    for words in MOVED.values():
        keys = {*re.findall(r"[a-z][a-z_-]+", words)} - {"and", "of", "or"}
        assert keys <= known
