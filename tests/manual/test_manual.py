"""The README and the manual: every example runs, every link leads somewhere, pages are readable."""

from __future__ import annotations

import io
import itertools
import re
import shlex
import signal
import socket
import subprocess
import sys
import tomllib
from collections.abc import Callable, Iterator
from contextlib import ExitStack, redirect_stderr, redirect_stdout
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import msgspec
import pytest

import explorer
from explorer.cli import COMMANDS, run
from explorer.cli.parsing import load_command, parse
from explorer.errors import InputError
from explorer.files.manual import list_pages, read_page
from explorer.optimise.problem import OBJECTIVES

ROOT = Path(__file__).resolve().parents[2]
MANUAL = Path(explorer.__file__).parents[1] / "assets" / "manual"
DOCUMENTS = {"README.md": ROOT / "README.md", **{p.name: p for p in sorted(MANUAL.iterdir())}}
PROJECT = tomllib.loads((ROOT / "pyproject.toml").read_text(encoding="utf-8"))["project"]

BLOCK = re.compile(r"^```(\w+)\n(.*?)^```$", re.MULTILINE | re.DOTALL)
INLINE = re.compile(r"`(explorer(?: [^`]+)?)`")
NO_ANSWER = "# ends with status 1"
# The address of the scheduler that the manual names, which is another machine's.
SCHEDULER = "10.0.0.1:8786"


def read(name: str) -> str:
    return DOCUMENTS[name].read_text(encoding="utf-8")


def test_manual_pages_are_all_listed_glossary_first() -> None:
    pages = list_pages()
    assert sorted(page.file for page in pages) == sorted(path.name for path in MANUAL.iterdir())
    assert pages[0] == ("Glossary", "glossary.md")
    assert len({page.title for page in pages}) == len(pages)
    for page in pages:
        assert read_page(page.file).startswith(f"# {page.title}\n")
        assert f"(assets/manual/{page.file})" in read("README.md")


def test_manual_counts_the_objectives_of_the_optimiser() -> None:
    count = ("five", "six", "seven", "eight", "nine")[len(OBJECTIVES) - 5]
    assert f"The objective is one of {count}:" in read("optimise.md")


@pytest.mark.parametrize("name", ["", "../README.md", "nothing.md", "glossary"])
def test_manual_unknown_page_is_refused_with_the_names(name: str) -> None:
    with pytest.raises(InputError, match=r"no page .*glossary\.md"):
        read_page(name)


def test_readme_is_short_and_names_the_test_command() -> None:
    assert len(read("README.md").encode()) <= 10_000
    assert "```sh\nbash tests/run\n```" in read("README.md")


def test_citation_names_the_project_as_it_is() -> None:
    citation = (ROOT / "CITATION.cff").read_text(encoding="utf-8")
    assert f"\nversion: {explorer.__version__}\n" in citation
    assert f"\nlicense: {PROJECT['license']}\n" in citation
    assert f"\nauthors:\n  - name: {PROJECT['authors'][0]['name']}\n" in citation


@pytest.mark.parametrize("name", DOCUMENTS)
def test_document_links_lead_to_files(name: str) -> None:
    for target in re.findall(r"\]\(([^)#]+)", read(name)):
        assert (DOCUMENTS[name].parent / target).is_file(), target


@pytest.mark.parametrize("name", DOCUMENTS)
def test_document_commands_in_sentences_can_be_read(name: str) -> None:
    for text in INLINE.findall(BLOCK.sub("", read(name))):
        _, *argv = shlex.split(text)
        # A name by itself stands for the command, and an option by itself for what it needs.
        if len(argv) > 1 and argv[-1].startswith("--") and argv[0] in COMMANDS:
            assert argv[-1] in _options(argv[0]), text
        elif argv:
            assert _is_readable(argv), text


def _options(command: str) -> str:
    shown = io.StringIO()
    with redirect_stdout(shown):
        assert run([command, "--help"]) == 0
    return shown.getvalue()


def _is_readable(argv: list[str]) -> bool:
    if len(argv) == 1:
        return argv[0] in COMMANDS
    command, *options = argv if argv[0] in COMMANDS else ["serve", *argv]
    return parse(command, load_command(command, COMMANDS), options) is not None


@dataclass
class Reader:
    """A reader of one document who runs its examples, in order, in one folder.

    Attributes:
        name: Name of the document.
        stack: Where what is started is ended.
        output: What the last shell block printed.
        names: The names of the Python blocks.
        port: The port that stands for the scheduler's.
    """

    name: str
    stack: ExitStack
    output: str
    names: dict[str, Any]
    port: int

    def follow(self, kind: str, text: str, before: str) -> None:
        """Run a block of a kind, given the text before it."""
        if kind == "sh":
            self.output = "".join(map(self.enter, text.replace("\\\n", " ").splitlines()))
        elif kind == "python":
            exec(compile(text, f"{self.name}, a block", "exec"), self.names)
        elif kind == "text":
            for line in text.splitlines():
                assert line in self.output.splitlines(), line
        else:
            assert kind == "json", f"no way to run {kind}"
            file = re.findall(r"`([\w-]+\.json)`", before)[-1]
            msgspec.json.decode(text)
            Path(file).write_text(text, encoding="utf-8")

    def enter(self, line: str) -> str:
        """Run a line of a shell and return what it printed."""
        here = line.replace(SCHEDULER, f"127.0.0.1:{self.port}").replace("8786", str(self.port))
        words = shlex.split(here, comments=True)
        parts = [list(group) for end, group in itertools.groupby(words, "&&".__eq__) if not end]
        return "".join(self.execute(part, NO_ANSWER in line) for part in parts)

    def execute(self, words: list[str], is_without_answer: bool) -> str:
        """Run a simple command and return what it printed."""
        program, *argv = words
        match Path(program).name:
            case "explorer":
                return _explorer(argv, is_without_answer)
            case "dask":
                command = [sys.executable, "-m", "dask", *argv]
                if argv[0] == "scheduler":
                    command += ["--host", "127.0.0.1", "--no-dashboard", "--no-show"]
                self.stack.callback(_end, subprocess.Popen(command, stderr=subprocess.DEVNULL))
            case "pip":
                _check_installation(argv)
            case "bash":
                assert (ROOT / argv[0]).is_file()
            case _:
                # The environment of the tests stands for the one that is made.
                assert argv == ["-m", "venv", ".venv"], words
        return ""


def _explorer(argv: list[str], is_without_answer: bool) -> str:
    if not argv or (argv[0].startswith("-") and argv[0] != "--help"):
        return _serve(argv)
    printed = io.StringIO()
    target = None
    if ">" in argv:
        argv, target = argv[:-2], Path(argv[-1])
    with redirect_stdout(printed), redirect_stderr(io.StringIO() if target else printed):
        status = run(argv)
    assert status == is_without_answer, f"explorer {shlex.join(argv)}: {printed.getvalue()}"
    if target is not None:
        target.write_text(printed.getvalue(), encoding="utf-8")
    return printed.getvalue()


def _serve(argv: list[str]) -> str:
    """Serve the page on any free port until it says where, and return what it says."""
    elsewhere = [] if "--port" in argv else ["--port", "0"]
    quiet = [] if "--no-open" in argv else ["--no-open"]
    command = [sys.executable, "-m", "explorer", *argv, *elsewhere, *quiet]
    with subprocess.Popen(command, stderr=subprocess.PIPE, encoding="utf-8") as process:
        assert process.stderr is not None
        said: list[str] = []
        for line in process.stderr:
            said.append(line)
            if "http://" in line:
                break
        process.send_signal(signal.SIGINT)
        said += process.stderr.readlines()
    assert process.returncode == 0, "".join(said)
    return "".join(said)


def _check_installation(argv: list[str]) -> None:
    """Check that what pip is given is this project with extras that it has."""
    assert "explorer" in PROJECT["scripts"]
    for wanted in (word for word in argv[1:] if not word.startswith("-")):
        named = re.fullmatch(r"(?:flagged-explorer|\.)(?:\[([\w,]+)\])?", wanted)
        assert named is not None, wanted
        extras = (named[1] or "").split(",") if named[1] else []
        assert set(extras) <= set(PROJECT["optional-dependencies"])


def _end(process: subprocess.Popen[bytes]) -> None:
    process.terminate()
    process.wait(timeout=30)


def _free_port() -> int:
    with socket.socket() as made:
        made.bind(("127.0.0.1", 0))
        return made.getsockname()[1]


@pytest.fixture
def reader(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> Iterator[Callable[[str], Reader]]:
    """Return what makes the reader of a document, in a folder and with data of its own."""
    monkeypatch.chdir(tmp_path)
    monkeypatch.setenv("EXPLORER_DATA", str(tmp_path / "data"))
    with ExitStack() as stack:
        yield lambda name: Reader(name, stack, "", {}, _free_port())


@pytest.mark.timeout(900)
@pytest.mark.parametrize("name", DOCUMENTS)
def test_document_examples_run(name: str, reader: Callable[[str], Reader]) -> None:
    follows, text, end = reader(name), read(name), 0
    for block in BLOCK.finditer(text):
        follows.follow(block[1], block[2], text[end : block.start()])
        end = block.end()
    assert text.count("```") == 2 * len(BLOCK.findall(text))
