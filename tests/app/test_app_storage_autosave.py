"""Saved sessions outlast kills, full disks, clocks set back and other explorers."""

from __future__ import annotations

import json
import os
import subprocess
import sys
import threading
import time
from collections.abc import Callable
from concurrent.futures import ThreadPoolExecutor
from dataclasses import dataclass, field, replace
from pathlib import Path

import pytest
from client import wait_for
from desk import Desk

from explorer.app.features.optimise.actions import StartRun
from explorer.app.session.history import History, start_history
from explorer.app.session.session import REDO, UNDO, Session
from explorer.app.state.actions import SetName, SetPosition
from explorer.app.state.state import joints_of, opened
from explorer.app.storage.autosaver import Autosaver
from explorer.app.storage.folder import data_folder, lock_folder
from explorer.app.storage.session_file import MOST_ORPHANS, SessionFile
from explorer.app.storage.session_format import (
    LARGEST_GENERATION,
    decode_header,
    encode_session,
)
from explorer.app.storage.user_data import open_user_data
from explorer.errors import StorageError
from explorer.mechanism.design_file import PRESETS
from explorer.mechanism.pose import Pose

HERE = Path(__file__).parent
# Seconds that no test waits, and those after which a test gives up.
NEVER, PATIENCE = 1e6, 60.0


def numbered(number: int) -> History:
    """Return a session that is known by a number: the first coordinate of b4."""
    return start_history(SetPosition(0, float(number)).apply(opened(PRESETS["paper-optimal"])))


def number_of(history: History | None) -> float | None:
    return None if history is None else history.step.state.pose.position[0]


def leave_session(folder: Path, number: int) -> Path:
    """Save a session as an explorer does that ends; return its file."""
    store = SessionFile(folder)
    store.save(numbered(number))
    path = store.path
    store.close()
    assert path is not None
    return path


def resume(folder: Path) -> float | None:
    """Return the session with which the next explorer starts, and leave it again."""
    store = SessionFile(folder)
    resumed = store.resume()
    store.close()
    assert resumed.messages == ()
    return number_of(resumed.history)


def contents(folder: Path) -> dict[str, bytes]:
    """Return the contents of all files in a folder except locks, by name."""
    files = [path for path in folder.iterdir() if not path.name.endswith(".lock")]
    return {path.name: path.read_bytes() for path in files}


def test_next_explorer_continues_in_the_same_file(tmp_path: Path) -> None:
    folder = tmp_path / "new" / "sessions"
    first = SessionFile(folder)
    assert first.resume().history is None
    assert first.path is None
    for number in range(5):
        generation = first.save(numbered(number))
        assert first.path is not None
        data = first.path.read_bytes()
        assert data == encode_session(numbered(number), generation)
        assert decode_header(data, "file").generation == generation == 1 + number
    first.close()
    second = SessionFile(folder)
    resumed = second.resume()
    assert (resumed.history, resumed.messages) == (numbered(4), ())
    assert second.path == first.path or first.path is None
    assert second.save(numbered(5)) == 6
    second.close()
    assert len(contents(folder)) == 1
    assert resume(folder) == 5


def test_explorers_side_by_side_have_a_file_each_and_the_last_save_is_the_newest(
    tmp_path: Path,
) -> None:
    leave_session(tmp_path, 0)
    one, two, three = (SessionFile(tmp_path) for _ in range(3))
    assert number_of(one.resume().history) == 0
    assert two.resume().history is None
    # As with a design that is opened from a file, which resumes no session.
    three.save(numbered(30))
    for number in range(1, 10):
        one.save(numbered(number))
    two.save(numbered(20))
    assert len({one.path, two.path, three.path}) == 3
    one.save(numbered(10))
    for store in (one, two, three):
        store.close()
    stores = [SessionFile(tmp_path) for _ in range(4)]
    assert [number_of(store.resume().history) for store in stores] == [10, 20, 30, None]
    for store in stores:
        store.close()


def test_explorers_that_start_at_once_resume_a_session_each(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    # On a slow disk the last in the row waits long.
    monkeypatch.setattr("explorer.app.storage.folder.PATIENCE_SECONDS", PATIENCE)
    for number in range(4):
        leave_session(tmp_path, number)
    stores = [SessionFile(tmp_path) for _ in range(8)]
    with ThreadPoolExecutor(len(stores)) as threads:
        resumed = [number_of(each.history) for each in threads.map(SessionFile.resume, stores)]
    assert sorted(each for each in resumed if each is not None) == [0, 1, 2, 3]
    for store in stores:
        store.close()


def test_only_the_newest_sessions_are_kept_although_clocks_were_set_back(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    living = SessionFile(tmp_path)
    living.save(numbered(-1))
    now = time.time()
    for number in range(MOST_ORPHANS + 5):
        # Each start of the explorer is a year before the last one.
        before = now - number * 365.25 * 86400.0
        monkeypatch.setattr(time, "time", lambda before=before: before)
        os.utime(leave_session(tmp_path, number), (before, before))
    store = SessionFile(tmp_path)
    assert number_of(store.resume().history) == MOST_ORPHANS + 4
    # Its own, those without an explorer, and that of the explorer that runs.
    assert len(contents(tmp_path)) == 1 + MOST_ORPHANS + 1
    assert living.save(numbered(-2)) > 0
    store.close()
    living.close()
    assert resume(tmp_path) == -2


def test_leftovers_are_removed_unless_their_explorer_runs_and_other_paths_ignored(
    tmp_path: Path,
) -> None:
    living = SessionFile(tmp_path)
    living.save(numbered(1))
    assert living.path is not None
    path = leave_session(tmp_path, 2)
    writing = tmp_path / f".{living.path.name}.0123.part"
    dead = [tmp_path / f".{path.name}.0123.part", tmp_path / ".0123.json.4.part"]
    dead.append(tmp_path / "0123.lock")
    for each in (writing, *dead):
        each.write_bytes(b"part")
    # Folders, links and pipes named like sessions are ignored.
    (tmp_path / "folder.json").mkdir()
    (tmp_path / "gone.json").symlink_to(tmp_path / "nowhere")
    if hasattr(os, "mkfifo"):
        os.mkfifo(tmp_path / "pipe.json")
    assert resume(tmp_path) == 2
    assert writing.exists()
    assert not any(each.exists() for each in dead)
    living.close()


OPENED = opened(PRESETS["paper-optimal"])
FAR = Pose((1e39, 0.0, 0.0), OPENED.pose.quaternion)
TOO_FAR = start_history(replace(OPENED, pose=FAR, joints=joints_of(OPENED.design, FAR)))
DAMAGES: dict[str, Callable[[bytes], bytes]] = {
    "cut": lambda whole: whole[: len(whole) // 2],
    "changed": lambda whole: whole.replace(b"2.0", b"3.0", 1),
    "empty": lambda _: b"",
    "other": lambda _: b'{"schema": 1}\n',
    # No page can show it.
    "too far": lambda _: encode_session(TOO_FAR, 3),
}


@pytest.mark.parametrize("damage", DAMAGES)
def test_damaged_file_is_renamed_and_the_session_before_is_resumed(
    tmp_path: Path, damage: str
) -> None:
    leave_session(tmp_path, 1)
    path = leave_session(tmp_path, 2)
    damaged = DAMAGES[damage](path.read_bytes())
    for ending in (".broken", ".broken2"):
        path.write_bytes(damaged)
        store = SessionFile(tmp_path)
        resumed = store.resume()
        store.close()
        assert number_of(resumed.history) == 1
        (message,) = resumed.messages
        assert "\n" not in message
        assert path.name in message
        assert repr(path.name + ending) in message
        assert (tmp_path / (path.name + ending)).read_bytes() == damaged
        assert not path.exists()
    assert resume(tmp_path) == 1


def test_file_of_a_newer_explorer_is_left_alone_and_new_saves_are_newer(tmp_path: Path) -> None:
    leave_session(tmp_path, 1)
    newer = tmp_path / "newer.json"
    newer.write_bytes(b'{"schema": 99, "generation": 1000, "more": [1]}\nbinary \xff')
    before = newer.read_bytes()
    store = SessionFile(tmp_path)
    resumed = store.resume()
    assert number_of(resumed.history) == 1
    (message,) = resumed.messages
    assert "newer" in message
    assert newer.read_bytes() == before
    assert store.save(numbered(2)) == 1001
    store.close()
    # Even the largest generation leaves later sessions readable.
    (tmp_path / "0.json").write_bytes(encode_session(numbered(3), LARGEST_GENERATION))
    for number in (4, 5):
        store = SessionFile(tmp_path)
        assert number_of(store.resume().history) == number - 1
        store.save(numbered(number))
        store.close()


def test_session_is_only_read_where_nothing_can_be_written(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    def refuse(*_: object) -> None:
        raise StorageError("read-only")

    for number in (1, 2):
        path = leave_session(tmp_path, number)
    path.write_bytes(b"damaged")
    before = contents(tmp_path)
    with monkeypatch.context() as patch:
        patch.setattr("explorer.app.storage.session_file.lock_folder", refuse)
        store = SessionFile(tmp_path)
        resumed = store.resume()
        assert number_of(resumed.history) == 1
        assert any("read-only" in message for message in resumed.messages)
        assert any(path.name in message for message in resumed.messages)
        with pytest.raises(StorageError, match="read-only"):
            store.save(numbered(3))
        assert contents(tmp_path) == before
    # Once it can be written, the session is saved in a file of its own.
    store.save(numbered(3))
    assert {*contents(tmp_path)} > {*before}
    store.close()


def test_folder_that_is_a_file_or_locked_is_reported_in_one_line(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    (tmp_path / "data").write_bytes(b"")
    store = SessionFile(tmp_path / "data" / "sessions")
    resumed = store.resume()
    assert resumed.history is None
    with pytest.raises(StorageError, match="EXPLORER_DATA") as refusal:
        store.save(numbered(1))
    assert resumed.messages == (str(refusal.value),)
    assert "\n" not in str(refusal.value)
    # So is a folder that another explorer locks.
    monkeypatch.setattr("explorer.app.storage.folder.PATIENCE_SECONDS", 0.0)
    with lock_folder(tmp_path), pytest.raises(StorageError, match="another explorer"):
        SessionFile(tmp_path).save(numbered(1))


def test_session_whose_folder_is_moved_is_saved_in_a_new_one(tmp_path: Path) -> None:
    folder = tmp_path / "sessions"
    store = SessionFile(folder)
    store.save(numbered(1))
    folder.rename(tmp_path / "elsewhere")
    store.save(numbered(2))
    store.close()
    assert resume(folder) == 2
    assert resume(tmp_path / "elsewhere") == 1


def test_data_folder_is_that_of_the_environment(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setenv("EXPLORER_DATA", str(tmp_path))
    leave_session(tmp_path / "sessions", 5)
    # An explorer that is opened with a design leaves the saved session.
    fresh, again = open_user_data(resume=False), open_user_data(resume=True)
    assert fresh.history is None
    assert number_of(again.history) == 5
    again.store.close()
    monkeypatch.setenv("EXPLORER_DATA", "~/mine")
    assert data_folder() == Path.home() / "mine"
    monkeypatch.setenv("EXPLORER_DATA", "")
    assert data_folder().name == "flagged-explorer"
    assert data_folder().is_absolute()


@pytest.mark.skipif(not hasattr(os, "fork"), reason="writers are forked")
@pytest.mark.parametrize("kills", [10, pytest.param(200, marks=pytest.mark.long)])
def test_writers_killed_at_any_moment_lose_no_acknowledged_save(tmp_path: Path, kills: int) -> None:
    done = subprocess.run(
        [sys.executable, str(HERE / "killed.py"), str(tmp_path / "sessions"), str(kills), "7"],
        env={**os.environ, "PYTHONPATH": str(HERE.parents[1])},
        capture_output=True,
        text=True,
        check=False,
    )
    assert done.returncode == 0, done.stderr
    found = json.loads(done.stdout)
    assert found["kills"] == kills
    # Four of five writers are killed after their first save.
    assert found["number"] >= found["saves"] >= 0.8 * kills


@dataclass
class MemoryStore:
    """A store in memory that can fail and block."""

    saved: list[float | None] = field(default_factory=list[float | None])
    problem: Exception | None = None
    may_save: threading.Event = field(default_factory=threading.Event)
    began: threading.Event = field(default_factory=threading.Event)
    is_closed: bool = False

    def __post_init__(self) -> None:
        self.may_save.set()

    def save(self, history: History) -> int:
        assert threading.current_thread() is not threading.main_thread()
        assert not self.is_closed
        self.began.set()
        assert self.may_save.wait(PATIENCE)
        if self.problem is not None:
            raise self.problem
        self.saved.append(number_of(history))
        return len(self.saved)

    def close(self) -> None:
        self.is_closed = True


def start_autosaver(
    store: MemoryStore, quiet: float, longest: float
) -> tuple[Autosaver, list[str]]:
    messages: list[str] = []
    saver = Autosaver(store, messages.append, quiet=quiet, longest=longest, retry=NEVER)
    return saver, messages


def test_last_of_many_changes_is_saved_and_one_posted_during_a_save_is_next() -> None:
    store = MemoryStore()
    saver, messages = start_autosaver(store, NEVER, NEVER)
    for number in range(100):
        saver.post(numbered(number))
    assert store.saved == []
    assert saver.flush(PATIENCE)
    assert store.saved == [99]
    # Without a change nothing is saved; and the next change waits again.
    assert saver.flush(PATIENCE)
    saver.post(numbered(100))
    assert store.saved == [99]
    saver.stop()
    assert store.saved == [99, 100]
    assert store.is_closed
    assert messages == []
    store = MemoryStore()
    store.may_save.clear()
    saver, _ = start_autosaver(store, 0.0, 0.0)
    saver.post(numbered(1))
    assert store.began.wait(PATIENCE)
    saver.post(numbered(2))
    store.may_save.set()
    assert saver.flush(PATIENCE)
    assert store.saved == [1, 2]
    saver.stop()


@pytest.mark.parametrize(
    ("quiet", "longest", "is_endless"), [(0.01, NEVER, False), (NEVER, 0.05, True)]
)
def test_change_is_saved_once_it_is_quiet_or_after_the_longest_time(
    quiet: float, longest: float, is_endless: bool
) -> None:
    store = MemoryStore()
    saver, _ = start_autosaver(store, quiet, longest)
    saver.post(numbered(0))

    def is_saved() -> bool:
        if is_endless:
            saver.post(numbered(len(store.saved)))
        return len(store.saved) >= (3 if is_endless else 1)

    wait_for(is_saved)
    saver.stop()


def test_failure_is_reported_once_and_so_is_its_end() -> None:
    store = MemoryStore(problem=StorageError("the disk is full; make room"))
    saver, messages = start_autosaver(store, 0.0, 0.0)
    for number in range(3):
        saver.post(numbered(number))
        assert not saver.flush(PATIENCE)
    assert messages == [
        "The session is not saved: the disk is full; make room. The explorer keeps trying."
    ]
    store.problem = None
    # The last one posted is not lost.
    assert saver.flush(PATIENCE)
    assert store.saved == [2]
    assert messages[1:] == ["The session is saved again."]
    store.problem = ZeroDivisionError("a\nfault")
    saver.post(numbered(3))
    assert not saver.flush(PATIENCE)
    assert "\n" not in messages[2]
    assert "a fault" in messages[2]
    saver.stop()
    # It ends although it cannot save.
    assert store.saved == [2]
    assert store.is_closed
    assert len(messages) == 3


def test_failed_save_is_tried_again_while_changes_are_posted() -> None:
    store = MemoryStore(problem=StorageError("full"))
    saver, messages = start_autosaver(store, NEVER, 0.05)
    saver.post(numbered(0))
    wait_for(lambda: messages)
    store.problem = None

    def is_saved() -> bool:
        saver.post(numbered(1))
        return bool(store.saved)

    wait_for(is_saved)
    saver.stop()


def test_resumed_session_is_undone_and_redone(desk: Desk, tmp_path: Path) -> None:
    saver = Autosaver(SessionFile(tmp_path), desk.complaints.append)
    for action in (SetName("mine"), SetPosition(0, 12.0)):
        desk.session.do(action)
        saver.follow(desk.state, desk.session.history)
    # Until a search ends, the session before it is saved.
    before = desk.session.history
    desk.session.do(StartRun())
    saver.follow(desk.state, desk.session.history)
    assert desk.state.optimisation.is_on
    saver.stop()

    history = SessionFile(tmp_path).resume().history
    assert history is not None
    assert [(step.number, step.words, step.state) for step in history.steps] == [
        (step.number, step.words, step.state) for step in before.steps
    ]
    assert history.step.state == before.step.state
    session = Session(history.step.state, lambda _: None, print, print, history)
    try:
        for travel, expected in ((UNDO, before.steps[0]), (REDO, before.steps[2])):
            for _ in range(2):
                session.travel(travel)
            assert session.wait_until_idle()
            assert session.state == expected.state
    finally:
        session.stop()
    assert desk.complaints == []
