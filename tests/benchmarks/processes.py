"""The explorer started as a person does, from the command line of this checkout."""

from __future__ import annotations

import os
import re
import signal
import subprocess
import sys
from collections.abc import Generator, Mapping
from contextlib import contextmanager
from pathlib import Path

ROOT = Path(__file__).resolve().parents[2]
EXPLORER = (sys.executable, "-m", "explorer")


def run_to_end(*command: str, environment: Mapping[str, str] = os.environ) -> None:
    """Run a command and wait for it; its output is dropped.

    Raises:
        subprocess.CalledProcessError: it did not end well.
    """
    subprocess.run(command, cwd=ROOT, check=True, capture_output=True, env=environment)


def fresh_home(folder: Path) -> dict[str, str]:
    """Return the environment of somebody who has never run the explorer."""
    return {
        **os.environ,
        "XDG_CACHE_HOME": str(folder / "cache"),
        "LOCALAPPDATA": str(folder / "cache"),
        "EXPLORER_DATA": str(folder / "data"),
    }


@contextmanager
def served(environment: Mapping[str, str] = os.environ) -> Generator[str]:
    """Serve the page from a process of its own and give its address."""
    process = subprocess.Popen(
        [*EXPLORER, "serve", "--no-open", "--port", "0"],
        cwd=ROOT,
        env=environment,
        stderr=subprocess.PIPE,
        text=True,
        # It may have started a process to compile in, which must end with it.
        start_new_session=True,
    )
    try:
        assert process.stderr is not None
        yield _address(process.stderr.readline())
    finally:
        _end(process)


def _address(line: str) -> str:
    found = re.search(r"http://\S+", line)
    if found is None:
        raise RuntimeError(f"the explorer names no address but says {line!r}")
    return found[0]


def _end(process: subprocess.Popen[str]) -> None:
    if sys.platform == "win32":
        process.kill()
    else:
        os.killpg(process.pid, signal.SIGKILL)
    process.wait()
    if process.stderr is not None:
        process.stderr.close()
