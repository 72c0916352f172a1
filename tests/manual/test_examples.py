"""The example scripts: short, and each runs by itself in an empty folder."""

from __future__ import annotations

import ast
import runpy
import subprocess
import sys
from pathlib import Path

import pytest

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


@pytest.mark.parametrize("file", EXAMPLES, ids=lambda file: file.name)
def test_example_is_short_and_runs(
    file: Path,
    tmp_path: Path,
    monkeypatch: pytest.MonkeyPatch,
    request: pytest.FixtureRequest,
) -> None:
    source = file.read_text(encoding="utf-8")
    assert source.count("\n") <= MOST_LINES
    for module in sorted(modules_of(source)):
        pytest.importorskip(module, reason=f"{file.name} needs {module}")
    if request.config.getoption("--all"):
        subprocess.run([sys.executable, str(file)], cwd=tmp_path, check=True)
    else:
        monkeypatch.chdir(tmp_path)
        runpy.run_path(str(file))
    expected = [WRITTEN[file.name]] if file.name in WRITTEN else []
    assert [each.name for each in tmp_path.iterdir()] == expected
