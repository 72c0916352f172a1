"""`explorer report`: a whole file or none, and commands in it that say the same again."""

from __future__ import annotations

import re
import shlex
import sys
from pathlib import Path

import msgspec
import pytest
from command_line import CommandLine
from report_page import read, table_of

import explorer
from explorer.mechanism.design_file import encode_design

COMMAND = ("report",)
OPTIMAL = explorer.PRESETS["paper-optimal"]


def test_report_json_is_one_object(cli: CommandLine, tmp_path: Path) -> None:
    out = tmp_path / "report.HTM"
    answer = cli.answer("--out", out)
    assert answer.pop("seconds") > 0.0
    assert answer == {"out": str(out), "format": "html", "bytes": out.stat().st_size}
    assert [each.name for each in tmp_path.iterdir()] == [out.name]
    assert next(read(out.read_text(encoding="utf-8")).all("h1")).text == "paper-optimal"


def test_report_commands_reproduce_its_figures(
    cli: CommandLine, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.chdir(tmp_path)
    design = msgspec.structs.replace(OPTIMAL, name="my; rm -rf $(own) 'design'", unit_mm=25.0)
    Path("mine.json").write_bytes(encode_design(design))
    turned = ["--position", "9", "4.5", "8", "--yaw-pitch-roll", "-70", "3", "2"]
    cli.text("--design", "mine.json", "--out", "first.html", *turned)
    page = read(Path("first.html").read_text(encoding="utf-8"))
    Path("design.json").write_bytes(page.one(id="design").text.encode())
    lines = page.one(id="commands").text.splitlines()
    assert len(lines) == 5
    answers: dict[str, dict[str, object]] = {}
    for line in lines:
        program, *argv = shlex.split(line)
        assert program == "explorer"
        answers[argv[0]] = CommandLine(cli.capsys).answer(*argv)
    undated = [
        re.sub(r"<time.*?</time>", "", Path(name).read_text(encoding="utf-8"))
        for name in ("first.html", "report.html")
    ]
    assert undated[0] == undated[1]
    volume = table_of(page, "Volumes")["exact volume"].values[0]
    assert answers["workspace"]["volume"] == volume
    condition = table_of(page, "Conditioning")["1/cond J"].values
    assert [answers["singularity"]["inverse_condition"]] == condition


@pytest.mark.parametrize(
    ("name", "options", "words"),
    [
        ("report.doc", [], "--out must end in .html or .pdf"),
        ("missing/report.html", [], "no folder"),
        ("report.html", ["--design", "no-such"], "no-such"),
        ("report.html", ["--record", "no-such.json"], "cannot read 'no-such.json'"),
        ("report.html", ["--record", __file__], "test_cli_report.py"),
    ],
)
def test_report_bad_input_is_one_line(
    cli: CommandLine, tmp_path: Path, name: str, options: list[str], words: str
) -> None:
    refused = cli.refusal("--out", str(tmp_path / name), *options)
    assert words in refused
    assert list(tmp_path.iterdir()) == []


def test_report_without_browser_refuses_pdf_only(
    cli: CommandLine, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setitem(sys.modules, "playwright.sync_api", None)
    out = tmp_path / "report.pdf"
    out.write_bytes(b"old")
    refused = cli.refusal("--out", out)
    assert 'pip install ".[screenshot]"' in refused
    assert out.read_bytes() == b"old"
    assert cli.text("--out", tmp_path / "report.html")
