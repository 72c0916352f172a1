"""Every benchmark is listed and runs: a short round of each is one of the long tests."""

from __future__ import annotations

import ast
import subprocess
import sys
from pathlib import Path

import pytest

ROOT = Path(__file__).resolve().parents[2]
FOLDER = ROOT / "tests" / "benchmarks"


def constants_of(module: ast.Module) -> set[str]:
    """Return the names that a module assigns or imports."""
    assigned = (each for each in module.body if isinstance(each, ast.Assign))
    targets = (target for each in assigned for target in each.targets)
    names = {n.id for target in targets for n in ast.walk(target) if isinstance(n, ast.Name)}
    imports = (each for each in module.body if isinstance(each, ast.ImportFrom))
    return names | {alias.name for each in imports for alias in each.names}


# What runs is told from what it shares by what its short round changes.
SOURCES = {path.stem: ast.parse(path.read_text("utf-8")) for path in FOLDER.glob("*.py")}
NAMES = sorted(name for name, module in SOURCES.items() if "SHORT" in constants_of(module))


def run(*arguments: str) -> str:
    """Run the benchmarks with arguments, and return what they print."""
    done = subprocess.run(
        [sys.executable, FOLDER, *arguments], cwd=ROOT, capture_output=True, text=True, check=False
    )
    assert done.returncode == 0, done.stderr
    return done.stdout


def test_benchmarks_are_all_listed() -> None:
    assert sorted(line.split()[0] for line in run("--list").splitlines()) == NAMES


@pytest.mark.parametrize("name", NAMES)
def test_short_round_of_a_benchmark_changes_constants_that_it_has(name: str) -> None:
    (short,) = (
        each.value
        for each in SOURCES[name].body
        if isinstance(each, ast.Assign) and ast.unparse(each.targets[0]) == "SHORT"
    )
    assert ast.literal_eval(short).keys() <= constants_of(SOURCES[name])


@pytest.mark.long
# Some start browsers and processes that compile, and have all that they import to load.
@pytest.mark.timeout(1800)
@pytest.mark.parametrize("name", NAMES)
def test_benchmark_runs_a_short_round(name: str) -> None:
    head, _, *table = run("--short", name).splitlines()
    assert "cores" in head
    assert len(table) > 2
    assert not any("not measured" in row for row in table)
