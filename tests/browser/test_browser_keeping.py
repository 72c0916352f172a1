"""Explorers that are killed, one after the other, on one folder of data."""

from __future__ import annotations

import os
import signal
import subprocess
import sys
import time
from collections.abc import Generator
from contextlib import closing, contextmanager
from dataclasses import dataclass
from pathlib import Path

import pytest
from client import Client, opened

from explorer.app.storage.session_format import decode_session

PATIENCE_SECONDS = 60.0


@dataclass(frozen=True)
class Served:
    """An explorer in a process of its own, and what it said when it started."""

    process: subprocess.Popen[str]
    url: str
    said: str

    def values(self) -> dict[str, float]:
        """Return the values of the sliders, by label."""
        with closing(opened(self.url)) as connection:
            client = Client(connection)
            return {
                str(each["label"]): float(each["value"])
                for each in client.controls.values()
                if each["type"] == "GuiSliderMessage"
            }

    def set(self, label: str, *values: float) -> None:
        """Drag a slider."""
        with closing(opened(self.url)) as connection:
            client = Client(connection)
            for value in values:
                client.update(client.find(label), value)
            # The page answers with what follows from it.
            client.read_until_quiet(0.3)


@contextmanager
def served(data: Path, *arguments: str) -> Generator[Served]:
    """Start an explorer on a folder of data; in the end it is killed, if it is still there."""
    process = subprocess.Popen(
        [sys.executable, "-m", "explorer", "--port", "0", "--no-open", *arguments],
        env={**os.environ, "EXPLORER_DATA": str(data)},
        stderr=subprocess.PIPE,
        text=True,
    )
    assert process.stderr is not None
    said = ""
    try:
        while "http://" not in said:
            line = process.stderr.readline()
            assert line, said
            said += line
        url = next(word for word in said.split() if word.startswith("http://"))
        yield Served(process, url, said)
    finally:
        process.kill()
        process.wait()
        process.stderr.close()


def wait_until_saved(data: Path, x: float) -> None:
    """Wait until a session was saved with b4 at an x, not only on the way to it."""
    deadline = time.monotonic() + PATIENCE_SECONDS
    while time.monotonic() < deadline:
        for file in (data / "sessions").glob("*.json"):
            history = decode_session(file.read_bytes(), "file")
            if history.step.state.pose.position[0] == x:
                return
        time.sleep(0.02)
    raise AssertionError("it was not saved")


@pytest.mark.skipif(sys.platform == "win32", reason="there is no SIGKILL")
def test_what_was_saved_outlasts_a_kill_and_comes_back(tmp_path: Path) -> None:
    with served(tmp_path) as first:
        assert "Going on" not in first.said
        first.set("x", 11.0, 11.5, 12.25)
        wait_until_saved(tmp_path, 12.25)
        first.process.send_signal(signal.SIGKILL)
        first.process.wait()
    with served(tmp_path) as second:
        assert "Going on with 'paper-optimal'" in second.said
        assert second.values()["x"] == 12.25
        # A second one at the same time begins anew, and takes nothing away.
        with served(tmp_path) as third:
            assert "Going on" not in third.said
            assert third.values()["x"] == 10.0
        assert second.values()["x"] == 12.25
