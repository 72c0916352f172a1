"""The README and the manual: every example runs, every link leads somewhere, pages are readable."""

from __future__ import annotations

import ast
import io
import itertools
import re
import shlex
import signal
import socket
import subprocess
import sys
import tomllib
from contextlib import ExitStack, redirect_stderr, redirect_stdout
from dataclasses import dataclass, field
from importlib.util import find_spec
from pathlib import Path
from typing import Any

import msgspec
import names_page
import pytest
from sweep_faults import HereWorkers

import explorer
from explorer import __version__
from explorer.cli import COMMANDS, run
from explorer.cli.parsing import load_command, parse
from explorer.errors import InputError
from explorer.files.extras import EXTRAS
from explorer.files.packaged import list_pages, read_page
from explorer.optimise.problem import OBJECTIVES
from explorer.workspace.accessible.radii import with_radius
from explorer.workspace.accessible.workspace import accessible_workspace

ROOT = Path(__file__).resolve().parents[2]
MANUAL = Path(explorer.__file__).parents[1] / "assets" / "manual"
DOCUMENTS = {
    **{name: ROOT / name for name in ("README.md", "CHANGELOG.md", "CONTRIBUTING.md")},
    **{p.name: p for p in sorted(MANUAL.iterdir())},
}
PROJECT = tomllib.loads((ROOT / "pyproject.toml").read_text(encoding="utf-8"))["project"]

BLOCK = re.compile(r"^```(\w+)\n(.*?)^```$", re.MULTILINE | re.DOTALL)
INLINE = re.compile(r"`(explorer(?: [^`]+)?)`")
NO_ANSWER = "# ends with status 1"
# The address of the scheduler that the manual names, which is another machine's.
SCHEDULER = "10.0.0.1:8786"
# Readers of exported files, whose examples run where they are installed.
OTHER_READERS = {"pinocchio", "pydrake"}
# Documents whose claims are measured, and compared with the page, in tests/reproduce.
MEASURED = ("README.md", "claims.md")


def read(name: str) -> str:
    return DOCUMENTS[name].read_text(encoding="utf-8")


def test_first_command_of_the_readme_installs_what_the_page_offers() -> None:
    assert '".[full]"' in read("README.md").partition("## The first minute")[0]
    extras: dict[str, list[str]] = PROJECT["optional-dependencies"]
    whole, *others = extras["full"]
    included = set(re.findall(r"\w+", whole.partition("[")[2]))
    for extra in EXTRAS.keys() - {"cluster"} - included:
        assert all(any(each in other for other in others) for each in extras[extra])


def test_manual_pages_are_all_listed_glossary_first() -> None:
    pages = list_pages()
    assert sorted(page.file for page in pages) == sorted(path.name for path in MANUAL.iterdir())
    assert pages[0] == ("Glossary", "glossary.md")
    assert len({page.title for page in pages}) == len(pages)
    for page in pages:
        assert read_page(page.file).startswith(f"# {page.title}\n")
        assert f"(assets/manual/{page.file})" in read("README.md")


def test_manual_lists_the_public_names_with_their_rooms() -> None:
    stub = Path(explorer.__file__).with_suffix(".pyi").read_text(encoding="utf-8")
    public = [
        (each.module.split(".")[0], name.name)
        for each in ast.parse(stub).body
        if isinstance(each, ast.ImportFrom) and each.module
        for name in each.names
    ]
    listed = re.findall(r"^\| (\w+) \| `(\w+)` \| .+ \|$", read("python.md"), re.MULTILINE)
    assert sorted(listed) == sorted(public)
    assert {name for _, name in public} == {*explorer.__all__}


def test_page_of_the_public_names_is_made_from_their_docstrings() -> None:
    assert read("names.md") == names_page.page(), "run python tests/tools/names_page.py"


def test_changelog_begins_with_the_present_version() -> None:
    versions = re.findall(r"^## (.+)$", read("CHANGELOG.md"), re.MULTILINE)
    assert versions[0] == __version__


def test_manual_counts_the_objectives_of_the_optimiser() -> None:
    count = ("two", "three", "four", "five")[len(OBJECTIVES) - 2]
    assert f"The objective is one of {count}:" in read("optimise.md")


@pytest.mark.parametrize("name", ["", "../README.md", "nothing.md", "glossary"])
def test_manual_unknown_page_is_refused_with_the_names(name: str) -> None:
    with pytest.raises(InputError, match=r"no page .*glossary\.md"):
        read_page(name)


def test_readme_is_short_and_names_the_test_command_and_the_contributors_page() -> None:
    assert len(read("README.md").encode()) <= 10_000
    assert "```sh\nbash tests/run\n```" in read("README.md")
    assert "(CONTRIBUTING.md)" in read("README.md")


def test_citation_names_the_project_as_it_is() -> None:
    citation = (ROOT / "CITATION.cff").read_text(encoding="utf-8")
    assert f"\nversion: {__version__}\n" in citation
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
            assert argv[-1] in options_of(argv[0]), text
        elif argv:
            assert is_readable(argv), text


def options_of(command: str) -> str:
    shown = io.StringIO()
    with redirect_stdout(shown):
        assert run([command, "--help"]) == 0
    return shown.getvalue()


def is_readable(argv: list[str]) -> bool:
    if len(argv) == 1:
        return argv[0] in COMMANDS
    command, *options = argv if argv[0] in COMMANDS else ["serve", *argv]
    return parse(command, load_command(command, COMMANDS), options) is not None


def find_port() -> int:
    with socket.socket() as free:
        free.bind(("127.0.0.1", 0))
        return free.getsockname()[1]


@dataclass
class Reader:
    """A reader of one document who runs its examples, in order, in one folder.

    Attributes:
        name: Name of the document.
        stack: Where processes are ended.
        as_processes: Whether each command is a process, as for a user; else it runs in this one.
        output: What the last shell block printed; None if it was only parsed.
        printed: What all blocks so far have printed.
        names: The names of the Python blocks.
        port: The port that stands for the scheduler's.
    """

    name: str
    stack: ExitStack
    as_processes: bool
    output: str | None = ""
    printed: str = ""
    names: dict[str, Any] = field(default_factory=dict[str, Any])
    port: int = field(default_factory=find_port)

    def follow(self, kind: str, text: str, before: str) -> None:
        """Run a block of a kind, given the text before it."""
        if kind == "sh":
            printed = [self.enter(line) for line in text.replace("\\\n", " ").splitlines()]
            self.output = None if None in printed else "".join(map(str, printed))
            self.printed += self.output or ""
        elif kind == "python":
            imported = re.findall(r"^(?:import|from) (\w+)", text, re.MULTILINE)
            if all(find_spec(name) for name in OTHER_READERS.intersection(imported)):
                exec(compile(text, f"{self.name}, a block", "exec"), self.names)
        elif kind == "text":
            for line in text.splitlines() if self.output is not None else ():
                assert line in str(self.output).splitlines(), line
        else:
            assert kind in ("json", "csv"), f"no way to run {kind}"
            file = re.findall(rf"`([\w-]+\.{kind})`", before)[-1]
            if kind == "json":
                msgspec.json.decode(text)
            Path(file).write_text(text, encoding="utf-8")

    def compare_tables(self, text: str) -> None:
        """Check that the decimals in tables of a text are printed numbers, rounded."""
        found = [abs(float(number)) for number in re.findall(r"\d+\.\d+", self.printed)]
        for row in () if self.name in MEASURED else re.findall(r"^\|.*\|$", text, re.MULTILINE):
            for number in re.findall(r"\d+\.\d\d+", row):
                decimals = len(number.partition(".")[2])
                assert float(number) in {round(each, decimals) for each in found}, (number, row)

    def enter(self, line: str) -> str | None:
        """Run a line of a shell and return what it printed."""
        here = line.replace(SCHEDULER, f"127.0.0.1:{self.port}").replace("8786", str(self.port))
        words = shlex.split(here, comments=True)
        printed: str | None = ""
        for is_end, group in itertools.groupby(words, "&&".__eq__):
            if not is_end:
                printed = self.execute(list(group), int(NO_ANSWER in line))
        return printed

    def execute(self, words: list[str], status: int) -> str | None:
        """Run a simple command, which ends with a status, and return what it printed."""
        program, *argv = words
        match Path(program).name:
            case "explorer" if not argv or (argv[0].startswith("-") and argv[0] != "--help"):
                return serve_page(argv) if self.as_processes else check_serving(argv)
            case "explorer" if self.as_processes:
                return run_process(argv, status)
            case "explorer":
                return self.run_here(argv, status)
            case "dask" if self.as_processes:
                command = [sys.executable, "-m", "dask", *argv]
                if argv[0] == "scheduler":
                    command += ["--host", "127.0.0.1", "--no-dashboard", "--no-show"]
                self.stack.callback(end, subprocess.Popen(command, stderr=subprocess.DEVNULL))
            case "dask":
                assert argv[0] in ("scheduler", "worker")
            case "pip":
                check_installation(argv)
            case "bash":
                assert (ROOT / argv[0]).is_file()
            case _:
                # The environment of the tests stands for the one that is made.
                assert argv == ["-m", "venv", ".venv"], words
        return ""

    def run_here(self, argv: list[str], status: int) -> str | None:
        """Run a command in this process and return what it printed, None if it is only parsed."""
        if argv[0] == "reproduce" and self.name in MEASURED:
            assert is_readable(argv)
            return None
        if "--scheduler" in argv:
            assert is_readable(argv)
            argv = argv[: argv.index("--scheduler")]
        printed, target = io.StringIO(), None
        if ">" in argv:
            argv, target = argv[:-2], Path(argv[-1])
        with redirect_stdout(printed), redirect_stderr(io.StringIO() if target else printed):
            found = run(argv)
        assert found == status, f"explorer {shlex.join(argv)}: {printed.getvalue()}"
        if target is not None:
            target.write_text(printed.getvalue(), encoding="utf-8")
        return printed.getvalue()


def run_process(argv: list[str], status: int) -> str:
    """Run a command as a process and return what it printed."""
    target = None
    if ">" in argv:
        argv, target = argv[:-2], Path(argv[-1])
    command = [sys.executable, "-m", "explorer", *argv]
    done = subprocess.run(command, capture_output=True, encoding="utf-8", check=False)
    assert done.returncode == status, f"explorer {shlex.join(argv)}: {done.stderr}"
    if target is not None:
        target.write_text(done.stdout, encoding="utf-8")
    return done.stdout + done.stderr


def serve_page(argv: list[str]) -> str:
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


def check_serving(argv: list[str]) -> str:
    """Check that a page would be served with these options, its design and studies loaded."""
    served: list[object] = []

    def serve(design: object, **_: object) -> None:
        served.append(design)

    with pytest.MonkeyPatch.context() as patch:
        patch.setattr("explorer.app.server.serve", serve)
        assert run(["serve", *argv]) == 0
    assert len(served) == 1
    return ""


def check_installation(argv: list[str]) -> None:
    """Check that what pip is given is this project with extras that it has."""
    assert "explorer" in PROJECT["scripts"]
    for wanted in (word for word in argv[1:] if not word.startswith("-")):
        named = re.fullmatch(r"(?:flagged-explorer|\.)(?:\[([\w,]+)\])?", wanted)
        assert named is not None, wanted
        extras = (named[1] or "").split(",") if named[1] else []
        assert set(extras) <= set(PROJECT["optional-dependencies"])


def end(process: subprocess.Popen[bytes]) -> None:
    process.terminate()
    process.wait()


@pytest.mark.timeout(900)
@pytest.mark.parametrize("name", DOCUMENTS)
@pytest.mark.parametrize("as_processes", [False, pytest.param(True, marks=pytest.mark.long)])
def test_document_examples_run(
    name: str, as_processes: bool, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.chdir(tmp_path)
    monkeypatch.setenv("EXPLORER_DATA", str(tmp_path / "data"))
    if not as_processes:
        monkeypatch.setattr("explorer.sweep.workers.LocalWorkers", HereWorkers)
    text, last = read(name), 0
    with ExitStack() as stack:
        reader = Reader(name, stack, as_processes)
        for block in BLOCK.finditer(text):
            reader.compare_tables(text[last : block.start()])
            reader.follow(block[1], block[2], text[last : block.start()])
            last = block.end()
        reader.compare_tables(text[last:])
    assert text.count("```") == 2 * len(BLOCK.findall(text))


@pytest.mark.parametrize(("name", "column"), [("paper-initial", 1), ("paper-optimal", 3)])
def test_table_of_accessible_volumes_is_that_of_the_library(name: str, column: int) -> None:
    table = read("workspace.md").partition("| radius of all legs |")[2].partition("\n\n")[0]
    rows = [[cell.strip() for cell in row.split("|")[1:-1]] for row in table.splitlines()[2:]]
    assert len(rows) == 5
    for radius, volume, nodes in ([row[0], *row[column : column + 2]] for row in rows):
        design = with_radius(explorer.PRESETS[name], float(radius))
        if volume == "–":
            with pytest.raises(InputError, match=r"legs 2 and 3 overlap .* no valid position"):
                accessible_workspace(design)
            continue
        found = accessible_workspace(design)
        share = f"{100.0 * found.accessible_volume / found.volume:.1f} %"
        assert volume in (share, f"{found.accessible_volume:.6g}")
        assert nodes in (
            f"{found.accessible_node_count}",
            f"{found.accessible_node_count} of {found.node_count} nodes",
        )
