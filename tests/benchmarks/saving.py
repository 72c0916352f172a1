"""Saving a session of fifty steps so that it outlasts a power failure, and opening it again."""

from __future__ import annotations

import sqlite3
import tempfile
from collections.abc import Iterator
from pathlib import Path

import msgspec

from benchmarks.samples import DESIGN
from benchmarks.table import Row, seconds, times
from benchmarks.timing import Spread, elapsed
from explorer.app.session.history import History, Step
from explorer.app.state.action import Action
from explorer.app.state.actions import SetAngle, SetPosition, SetVariable
from explorer.app.state.state import State, opened
from explorer.app.storage.packing import Packer
from explorer.app.storage.session_file import SessionFile
from explorer.app.storage.session_format import MOST_STEPS

SAVES = 60


def run() -> Iterator[Row]:
    """Yield a row for saving and one for opening."""
    history = session()
    with tempfile.TemporaryDirectory() as name:
        folder = Path(name) / "sessions"
        store = SessionFile(folder)
        ours = Spread.of([elapsed(lambda: store.save(history)) for _ in range(SAVES)])
        path = store.path
        size = 0 if path is None else path.stat().st_size
        store.close()
        opening = Spread.of([elapsed(lambda: _reopened(folder)) for _ in range(SAVES)])
        base = _table(Path(name) / "session.db")
        theirs = Spread.of([elapsed(lambda: _commit(base, history)) for _ in range(SAVES)])
        base.close()
    yield Row(
        f"one save of a session, {MOST_STEPS} steps, median; p95",
        f"{seconds(ours.p50)}; {seconds(ours.p95)}, {size / 1000:.0f} kB",
        "–",
        f"a commit of each step as JSON to sqlite3: {seconds(theirs.p50)}, "
        f"{_plain_size(history) / 1000:.0f} kB; {times(theirs.p50 / ours.p50)}",
    )
    yield Row("opening it at the next start, median", seconds(opening.p50))


def session() -> History:
    """Return a session in which pose and design were changed by turns."""
    state = opened(DESIGN)
    steps = [Step(0, "Open", state)]
    for number in range(1, MOST_STEPS):
        share = number / MOST_STEPS
        action: Action = (
            SetPosition(number % 3, 4.0 + 5.0 * share),
            SetAngle(number % 3, 10.0 + share),
            SetVariable("b2", 2.6 + 0.1 * share),
        )[number % 3]
        state = action.apply(state)
        steps.append(Step(number, f"Step {number}", state))
    return History(tuple(steps), len(steps) - 1)


def _reopened(folder: Path) -> None:
    store = SessionFile(folder)
    assert store.resume().history is not None
    store.close()


def _table(path: Path) -> sqlite3.Connection:
    base = sqlite3.connect(path)
    # As the file is: nothing that was acknowledged is lost when the power fails.
    base.execute("PRAGMA synchronous = EXTRA")
    base.execute("CREATE TABLE steps (number INTEGER PRIMARY KEY, state BLOB)")
    return base


def _commit(base: sqlite3.Connection, history: History) -> None:
    with base:
        rows = enumerate(_plain(step.state) for step in history.steps)
        base.executemany("INSERT OR REPLACE INTO steps VALUES (?, ?)", rows)


def _plain_size(history: History) -> int:
    return sum(len(_plain(step.state)) for step in history.steps)


def _plain(state: State) -> bytes:
    packer = Packer()
    packer.add(state)
    return msgspec.json.encode(packer.objects)
