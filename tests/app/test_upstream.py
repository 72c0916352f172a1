"""The patches for viser: each one's own test fails before it, and passes after it."""

from __future__ import annotations

import os
import shutil
import subprocess
import sys
from pathlib import Path

import pytest
import viser

PATCHES = sorted((Path(__file__).parents[2] / "assets/upstream").glob("*.patch"))
# What viser's own tests have too.
SERVER = """
import pytest
import viser

@pytest.fixture
def viser_server():
    server = viser.ViserServer(port=0, verbose=False)
    yield server
    server.stop()
"""


@pytest.fixture
def copy(tmp_path: Path) -> Path:
    """A folder like viser's repository, without the files of the browser."""
    source = Path(viser.__file__).parent
    ignore = shutil.ignore_patterns("node_modules", "src", "__pycache__", ".nodeenv")
    shutil.copytree(source, tmp_path / "src/viser", ignore=ignore)
    (tmp_path / "tests").mkdir()
    (tmp_path / "tests/conftest.py").write_text(SERVER, "utf-8")
    return tmp_path


@pytest.mark.parametrize("patch", PATCHES, ids=lambda patch: patch.stem)
def test_patch_of_viser_mends_what_its_test_finds(copy: Path, patch: Path) -> None:
    def passes(*parts: str) -> bool:
        options = [f"--include={part}/*" for part in parts]
        subprocess.run(["git", "apply", *options, str(patch)], cwd=copy, check=True)
        run = subprocess.run(
            [sys.executable, "-m", "pytest", "-q", "-p", "no:cacheprovider", "tests"],
            cwd=copy,
            env={**os.environ, "PYTHONPATH": str(copy / "src")},
            check=False,
            capture_output=True,
            text=True,
        )
        assert run.returncode in (0, 1), run.stdout
        return run.returncode == 0

    assert not passes("tests")
    assert passes("src")
