"""Explorers that are killed, one after the other, on one folder of data."""

from __future__ import annotations

import os
import subprocess
import sys
from collections.abc import Generator
from contextlib import closing, contextmanager
from dataclasses import dataclass
from pathlib import Path

import pytest
from client import Client, opened, wait_for

from explorer.app.storage.session_file import decode_session


@dataclass(frozen=True)
class Served:
    """An explorer in a process of its own, and what it said when it started."""

    process: subprocess.Popen[str]
    url: str
    said: str

    def value(self, label: str) -> object:
        """Return the value of a slider."""
        with closing(opened(self.url)) as connection:
            client = Client(connection)
            return client.controls[client.find(label)]["value"]

    def drag(self, label: str, *values: float) -> None:
        """Drag a slider."""
        with closing(opened(self.url)) as connection:
            client = Client(connection)
            for value in values:
                client.update(client.find(label), value)
            client.flush()


@contextmanager
def serve(data: Path) -> Generator[Served]:
    """Start an explorer on a folder of data; in the end it is killed, if it is still there."""
    process = subprocess.Popen(
        [sys.executable, "-m", "explorer", "--port", "0", "--no-open"],
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


def is_saved(data: Path, x: float) -> bool:
    """Whether a session was saved with b4 at an x, not only on the way to it."""
    histories = (decode_session(f.read_bytes(), "") for f in (data / "sessions").glob("*.json"))
    return any(history.step.state.pose.position[0] == x for history in histories)


@pytest.mark.skipif(sys.platform == "win32", reason="there is no SIGKILL")
def test_session_of_a_killed_explorer_is_resumed_by_the_next_one_alone(tmp_path: Path) -> None:
    with serve(tmp_path) as first:
        assert "Going on" not in first.said
        first.drag("x", 110.0, 115.0, 122.5)
        wait_for(lambda: is_saved(tmp_path, 122.5))
        first.process.kill()
        first.process.wait()
    with serve(tmp_path) as second:
        assert "Going on with 'buildable'" in second.said
        assert second.value("x") == 122.5
