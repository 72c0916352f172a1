"""Names of the project in docstrings, comments and Markdown, in backticks, lead to what there is.

A dotted name from `explorer` on is imported; an attribute of a class of the project is looked for
in the class and its bases, a path or a source among the files, an option among those of a command.
Any other name is a word of the code, outside of its docstrings and comments: of the package for its
own text and the manual, of package and tests for all else.
"""

from __future__ import annotations

import ast
import dataclasses
import importlib
import re
import tomllib
from collections.abc import Iterator
from functools import cache
from pathlib import Path
from typing import NamedTuple

import pytest

from explorer.cli import COMMANDS
from explorer.cli.parsing import load_command
from explorer.errors import InputError
from explorer.export.pose_tables import parse_table
from explorer.measures.catalogue import CATALOGUE

ROOT = Path(__file__).resolve().parents[2]
FOLDERS = ("explorer", "tests", "assets")
FILES = [
    *(path for path in sorted(ROOT.iterdir()) if path.is_file()),
    *(
        path
        for folder in FOLDERS
        for path in sorted((ROOT / folder).rglob("*"))
        if path.is_file() and "__pycache__" not in path.parts
    ),
]
PROJECT = tomllib.loads((ROOT / "pyproject.toml").read_text("utf-8"))
# Files and folders, from the checkout on; also as they are installed.
PLACES = {
    part.relative_to(ROOT).as_posix()
    for path in FILES
    for part in (path, *path.parents)
    if part.is_relative_to(ROOT)
} | {*PROJECT["tool"]["hatch"]["build"]["targets"]["wheel"]["force-include"].values()}
PYTHON = {path for path in FILES if path.suffix in (".py", ".pyi")}
MARKDOWN = [path for path in FILES if path.suffix == ".md"]
OTHER_CODE = (".js", ".css", ".html", ".c", ".in", ".json", ".toml")

# A class of another program that no code of ours has, and a heading that tables may not have.
FOREIGN = {"TopoDS_Shape", "yaw_degree"}

COMMENT = re.compile(r"(?:^\s*|  )# .*")
SPAN = re.compile(r"(?<!`)`([^`]+)`(?!`)")
BLOCK = re.compile(r"^```.*?^```$", re.MULTILINE | re.DOTALL)
NAME = re.compile(r"[A-Za-z_]\w*")
DOTTED = re.compile(r"explorer(\.\w+)+")
MEMBER = re.compile(r"([A-Z]\w*)\.(\w+)")
# What a module is said to have, as a value that stands "in" it.
HAS = re.compile(r"`(\w+)`\s+(?:in|of)\s+`(explorer(?:\.\w+)+)`")
PATH = re.compile(rf"(?:{'|'.join(FOLDERS)}|look)/[\w./-]*|[\w.]+\.(?:py|pyi|js|css|in)")
PLACEHOLDER = re.compile(r"\bNAME\b.*")
OPTION = re.compile(r"--[a-z][\w-]*")
COMMAND = re.compile(r"explorer ([a-z]+)\b")


class Source(NamedTuple):
    """A source of Python: its tree, its texts by their first lines, and what is left without them.

    Texts are docstrings, of values too, and comments, which the formatter sets apart by two blanks.
    """

    tree: ast.Module
    texts: list[tuple[int, str]]
    code: str


def statements(node: ast.AST) -> Iterator[ast.stmt]:
    """Yield the statements below a node."""
    for field in ("body", "orelse", "handlers", "finalbody"):
        for each in getattr(node, field, ()):
            if isinstance(each, ast.stmt):
                yield each
            yield from statements(each)


@cache
def source_of(path: Path) -> Source:
    source = path.read_text("utf-8")
    tree, lines, texts = ast.parse(source), source.split("\n"), list[tuple[int, str]]()
    for each in statements(tree):
        value = each.value if isinstance(each, ast.Expr) else None
        if isinstance(value, ast.Constant) and isinstance(value.value, str):
            texts.append((value.lineno, value.value))
            end = value.end_lineno or value.lineno
            lines[value.lineno - 1 : end] = [""] * (end - value.lineno + 1)
    for number, line in enumerate(lines, 1):
        if comment := COMMENT.search(line):
            texts.append((number, comment[0]))
            lines[number - 1] = line[: comment.start()]
    return Source(tree, texts, "\n".join(lines))


def texts_of(path: Path) -> list[tuple[int, str]]:
    """Return the docstrings and comments of a source, or a page's text, with their first lines."""
    if path.suffix == ".md":
        page = path.read_text("utf-8")
        return [(1, BLOCK.sub(lambda block: "\n" * block[0].count("\n"), page))]
    return source_of(path).texts


@cache
def code_of(folder: str) -> str:
    """Return the code below a folder, of pages and data too."""
    own = [path for path in FILES if path.is_relative_to(ROOT / folder)]
    python = [source_of(path).code for path in own if path in PYTHON]
    return "\n".join(
        python + [each.read_text("utf-8") for each in own if each.suffix in OTHER_CODE]
    )


@cache
def words_of(folder: str) -> frozenset[str]:
    """Return the words of the code below a folder."""
    return frozenset(NAME.findall(code_of(folder)))


@cache
def members_of(name: str) -> frozenset[str] | None:
    """Return the attributes of a class of the project and of its bases; None if there is none."""
    found: set[str] = set()
    paths = [
        path for path in PYTHON if re.search(rf"^ *class {name}\b", source_of(path).code, re.M)
    ]
    for path in paths:
        for node in statements(source_of(path).tree):
            if not isinstance(node, ast.ClassDef) or node.name != name:
                continue
            for each in ast.walk(node):
                if isinstance(each, ast.FunctionDef | ast.AsyncFunctionDef):
                    found.add(each.name)
                elif isinstance(each, ast.Attribute) and isinstance(each.ctx, ast.Store):
                    found.add(each.attr)
                elif isinstance(each, ast.Name) and isinstance(each.ctx, ast.Store):
                    found.add(each.id)
            for base in node.bases:
                found |= members_of(ast.unparse(base).partition("[")[0]) or set()
    return frozenset(found) if paths else None


def is_foreign(name: str, path: Path) -> bool:
    """Whether a source imports a name from elsewhere than the project."""
    words = rf"^from (?!explorer)[\w.]+ import (?:\([^)]*|[^\n(]*)\b{name}\b"
    return path in PYTHON and re.search(words, source_of(path).code, re.MULTILINE) is not None


def is_imported(name: str) -> bool:
    """Whether a dotted name is that of a module of the package, or of something in one."""
    parts = name.split(".")
    for count in range(len(parts), 0, -1):
        try:
            found = importlib.import_module(".".join(parts[:count]))
        except ImportError:
            continue
        for part in parts[count:]:
            if not hasattr(found, part):
                return False
            found = getattr(found, part)
        return True
    return False


def is_place(path: str) -> bool:
    """Whether a file or a folder is there, given from the checkout on, or by its last parts."""
    named = PLACEHOLDER.sub("", path).rstrip("/.")
    return any(place == named or place.endswith(f"/{named}") for place in PLACES)


@cache
def options_of(command: str) -> frozenset[str]:
    """Return the options of a command of the explorer."""
    fields = dataclasses.fields(load_command(command, COMMANDS))
    names = {field.name.rstrip("_").replace("_", "-") for field in fields}
    return frozenset({"--help", *(f"--{name}" for name in names), *(f"--no-{n}" for n in names)})


@cache
def all_options() -> frozenset[str]:
    """Return the options of all commands, and those of tests, benchmarks and tools."""
    return frozenset(OPTION.findall(code_of("tests"))).union(*map(options_of, COMMANDS))


def is_heading(name: str) -> bool:
    """Whether tables of poses may have a column with a heading."""
    try:
        return bool(parse_table("", f"{name}\n1\n".encode(), 1.0).columns)
    except InputError:
        return False


def is_word(name: str, path: Path) -> bool:
    """Whether a name in a text is a word of the code, a measure, or a heading of a table."""
    is_of_package = not path.is_relative_to(ROOT / "tests") and path.parent != ROOT
    folders = ("explorer", "assets") if is_of_package else (".",)
    known = any(name in words_of(folder) for folder in folders)
    return known or name in CATALOGUE or name in FOREIGN or is_heading(name)


def is_known(span: str, path: Path) -> bool:
    """Whether what stands in backticks is there, if it is meant as a name of the project."""
    name = span.removesuffix("()")
    if NAME.fullmatch(name):
        return is_word(name, path)
    if DOTTED.fullmatch(name):
        # Or a file that the explorer writes, such as its log.
        return is_imported(name) or f'"{name}"' in code_of("explorer")
    if member := MEMBER.fullmatch(name):
        inner = members_of(member[1])
        return inner is None or member[2] in inner or is_foreign(member[1], path)
    command = COMMAND.match(span)
    if command is not None and command[1] not in COMMANDS:
        return False
    if command is not None or span.startswith("--"):
        known = all_options() if command is None else options_of(command[1])
        return known.issuperset(OPTION.findall(span))
    return all(is_place(part) for part in span.split() if PATH.fullmatch(part))


def unknown_names(path: Path) -> Iterator[str]:
    """Yield the names in the texts of a file that lead nowhere, each with its line."""
    for first, text in texts_of(path):
        spans = [(found, found[1]) for found in SPAN.finditer(text)]
        spans = [
            (found, span) for found, span in spans if not is_known(" ".join(span.split()), path)
        ]
        spans += [
            (found, f"{found[2]}.{found[1]}")
            for found in HAS.finditer(text)
            if not is_imported(f"{found[2]}.{found[1]}")
        ]
        for found, span in spans:
            line = first + text.count("\n", 0, found.start())
            yield f"{path.relative_to(ROOT)}:{line}: {span}"


@pytest.mark.parametrize("folder", [*FOLDERS, "."])
def test_names_in_docstrings_comments_and_pages_lead_to_what_there_is(folder: str) -> None:
    of_folder = [
        path for path in (*sorted(PYTHON), *MARKDOWN) if path.relative_to(ROOT).parts[0] == folder
    ]
    paths = of_folder or [path for path in MARKDOWN if path.parent == ROOT]
    unknown = [each for path in paths for each in unknown_names(path)]
    assert not unknown, "\n".join(unknown)
