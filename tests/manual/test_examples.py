"""The example scripts: short, and each runs by itself in an empty folder."""

from __future__ import annotations

import ast
import runpy
import subprocess
import sys
from pathlib import Path

import pytest
from compiled_kernel import COMPILER, compile_c

import explorer
from explorer.export.controller import kernel_files

FOLDER = Path(__file__).resolve().parents[2] / "assets" / "examples"
EXAMPLES = sorted(FOLDER.iterdir())
MOST_LINES = 40

WRITTEN = {
    "sweep.py": "sweep.csv",
    "plot.py": "margins.png",
    "optimum.py": "optimum.json",
    "path.py": "path.csv",
}
"""Files that examples write."""


def modules_of(source: str) -> set[str]:
    """Return the modules that a script imports."""
    found: set[str] = set()
    for each in ast.walk(ast.parse(source)):
        if isinstance(each, ast.Import):
            found |= {name.name for name in each.names}
        elif isinstance(each, ast.ImportFrom):
            found.add(each.module or "")
    return found


def test_there_are_eight_short_examples() -> None:
    assert len(EXAMPLES) == 8
    for file in EXAMPLES:
        assert file.read_text(encoding="utf-8").count("\n") <= MOST_LINES, file.name


@pytest.mark.skipif(COMPILER is None, reason="there is no C compiler")
def test_example_in_c_stops_at_the_top_of_the_box(tmp_path: Path) -> None:
    for name, data in kernel_files(explorer.PRESETS["paper-optimal"]).items():
        (tmp_path / name).write_bytes(data)
    sources = (FOLDER / "kernel.c", tmp_path / "flagged44.c")
    program = compile_c(tmp_path / "move", sources)
    answer = subprocess.run([program], capture_output=True, text=True, check=True).stdout
    assert answer.splitlines()[-1].startswith("stop below z = 180.5 mm, where limits 0x4 break")


@pytest.mark.parametrize(
    "file", [file for file in EXAMPLES if file.suffix == ".py"], ids=lambda file: file.name
)
def test_example_runs(
    file: Path,
    tmp_path: Path,
    monkeypatch: pytest.MonkeyPatch,
    request: pytest.FixtureRequest,
) -> None:
    for module in sorted(modules_of(file.read_text(encoding="utf-8"))):
        pytest.importorskip(module, reason=f"{file.name} needs {module}")
    if request.config.getoption("--all"):
        subprocess.run([sys.executable, str(file)], cwd=tmp_path, check=True)
    else:
        monkeypatch.chdir(tmp_path)
        runpy.run_path(str(file))
    expected = [WRITTEN[file.name]] if file.name in WRITTEN else []
    assert [each.name for each in tmp_path.iterdir()] == expected
