"""Sessions outlast kills, full disks, clocks set back and each other."""

from __future__ import annotations

import json
import os
import subprocess
import sys
import threading
import time
from collections.abc import Callable
from dataclasses import dataclass, field, replace
from pathlib import Path

import pytest

from explorer.app.state.actions import SetPosition
from explorer.app.state.state import opened
from explorer.app.storage.autosave import MOST_ORPHANS, Autosave
from explorer.app.storage.autosaver import Autosaver
from explorer.app.storage.document import Document, decode_header, encode_document
from explorer.app.storage.folder import alone_in, data_folder, taken
from explorer.errors import StorageError
from explorer.mechanism.design_file import PRESETS

HERE = Path(__file__).parent
NEVER = 1e6
"""Seconds that no test waits."""


def numbered(number: int) -> Document:
    """Return a session that is known by a number: the first coordinate of b4."""
    return Document(SetPosition(0, float(number)).apply(opened(PRESETS["paper-optimal"])))


def number_of(document: Document | None) -> float | None:
    return None if document is None else document.present.pose.position[0]


def left(folder: Path, number: int) -> Path:
    """Leave a session as an explorer does that ends; return its file."""
    store = Autosave(folder)
    store.save(numbered(number))
    path = store.path
    store.close()
    assert path is not None
    return path


def next_session(folder: Path) -> float | None:
    """Return the session with which the next explorer starts, and leave it again."""
    store = Autosave(folder)
    found = store.adopt()
    store.close()
    assert found.messages == ()
    return number_of(found.document)


def contents(folder: Path) -> dict[str, bytes]:
    """Return the contents of all files in a folder but locks, by name."""
    files = [path for path in folder.iterdir() if not path.name.endswith(".lock")]
    return {path.name: path.read_bytes() for path in files}


def refuse(reason: str) -> Callable[..., None]:
    def refused(*_: object, **__: object) -> None:
        raise StorageError(reason)

    return refused


def test_the_next_start_goes_on_in_the_same_file(tmp_path: Path) -> None:
    folder = tmp_path / "new" / "sessions"
    first = Autosave(folder)
    assert first.adopt().document is None
    assert first.path is None
    generations = [first.save(numbered(number)) for number in range(5)]
    assert generations == sorted({*generations})
    path = first.path
    first.close()
    second = Autosave(folder)
    found = second.adopt()
    assert (found.document, found.messages) == (numbered(4), ())
    assert second.path == path
    assert second.save(numbered(5)) > generations[-1]
    second.close()
    assert next_session(folder) == 5


def test_the_newest_is_told_by_generation_whatever_clocks_say(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    year = 365.25 * 86400.0
    now = time.time()
    for number in range(6):
        # Each start of the explorer is a year before the last one.
        monkeypatch.setattr(time, "time", lambda number=number: now - number * year)
        path = left(tmp_path, number)
        os.utime(path, (now - number * year, now - number * year))
    assert next_session(tmp_path) == 5


def test_two_explorers_never_share_a_file_and_the_last_to_save_is_the_newest(
    tmp_path: Path,
) -> None:
    left(tmp_path, 0)
    one, two, three = (Autosave(tmp_path) for _ in range(3))
    assert number_of(one.adopt().document) == 0
    assert two.adopt().document is None
    # As with a design that is opened from a file: nothing is gone on with.
    three.save(numbered(30))
    for number in range(1, 10):
        one.save(numbered(number))
    two.save(numbered(20))
    assert len({one.path, two.path, three.path}) == 3
    one.save(numbered(10))
    for store in (one, two, three):
        store.close()
    found: list[float | None] = []
    stores = [Autosave(tmp_path) for _ in range(4)]
    found = [number_of(store.adopt().document) for store in stores]
    assert found == [10, 20, 30, None]
    for store in stores:
        store.close()


def test_many_explorers_that_start_at_once_take_a_session_each(tmp_path: Path) -> None:
    for number in range(4):
        left(tmp_path, number)
    stores = [Autosave(tmp_path) for _ in range(8)]
    found: list[float | None] = []

    def adopt(store: Autosave) -> None:
        found.append(number_of(store.adopt().document))

    threads = [threading.Thread(target=adopt, args=(store,)) for store in stores]
    for thread in threads:
        thread.start()
    for thread in threads:
        thread.join()
    assert sorted(each for each in found if each is not None) == [0, 1, 2, 3]
    assert found.count(None) == 4
    for number, store in enumerate(stores):
        store.save(numbered(100 + number))
    assert len({store.path for store in stores}) == 8
    for store in stores:
        store.close()


def test_only_the_newest_sessions_without_an_explorer_are_kept(tmp_path: Path) -> None:
    living = Autosave(tmp_path)
    living.save(numbered(-1))
    for number in range(MOST_ORPHANS + 5):
        left(tmp_path, number)
    store = Autosave(tmp_path)
    assert number_of(store.adopt().document) == MOST_ORPHANS + 4
    # Its own, those without, and that of the explorer that runs.
    assert len(contents(tmp_path)) == 1 + MOST_ORPHANS + 1
    assert living.save(numbered(-2)) > 0
    store.close()
    living.close()
    assert next_session(tmp_path) == -2


def test_locks_and_scratch_files_of_the_dead_are_removed_and_those_of_the_living_are_not(
    tmp_path: Path,
) -> None:
    living = Autosave(tmp_path)
    living.save(numbered(1))
    assert living.path is not None
    path = left(tmp_path, 2)
    writing = tmp_path / f".{living.path.name}.0123.part"
    dead = [tmp_path / f".{path.name}.0123.part", tmp_path / ".0123.json.4.part"]
    dead.append(tmp_path / "0123.lock")
    for each in (writing, *dead):
        each.write_bytes(b"part")
    store = Autosave(tmp_path)
    assert number_of(store.adopt().document) == 2
    assert writing.exists()
    assert not any(each.exists() for each in dead)
    store.close()
    living.close()


@pytest.mark.parametrize("kind", ["cut", "changed", "empty", "other", "zeros"])
def test_a_damaged_file_is_put_aside_and_the_one_before_is_opened(
    tmp_path: Path, kind: str
) -> None:
    left(tmp_path, 1)
    path = left(tmp_path, 2)
    whole = path.read_bytes()
    damaged = {
        "cut": whole[: len(whole) // 2],
        "changed": whole.replace(b"2.0", b"3.0", 1),
        "empty": b"",
        "other": b'{"schema": 1}\n',
        "zeros": bytes(len(whole)),
    }[kind]
    for number in range(2):
        path.write_bytes(damaged)
        store = Autosave(tmp_path)
        found = store.adopt()
        store.close()
        assert number_of(found.document) == 1
        (message,) = found.messages
        assert path.name in message
        assert "\n" not in message
        aside = path.name + ".broken" + ("" if number == 0 else "2")
        assert (tmp_path / aside).read_bytes() == damaged
        assert repr(aside) in message
        assert not path.exists()
    assert next_session(tmp_path) == 1


def test_a_file_of_a_newer_explorer_is_left_alone_and_new_ones_are_newer(tmp_path: Path) -> None:
    left(tmp_path, 1)
    newer = tmp_path / "newer.json"
    newer.write_bytes(b'{"schema": 99, "generation": 1000, "more": [1]}\nbinary \xff')
    before = newer.read_bytes()
    store = Autosave(tmp_path)
    found = store.adopt()
    assert number_of(found.document) == 1
    (message,) = found.messages
    assert "newer" in message
    assert newer.read_bytes() == before
    assert store.save(numbered(2)) == 1001
    store.close()


def test_what_is_no_file_is_passed_over(tmp_path: Path) -> None:
    left(tmp_path, 1)
    (tmp_path / "folder.json").mkdir()
    (tmp_path / "gone.json").symlink_to(tmp_path / "nowhere")
    if hasattr(os, "mkfifo"):
        os.mkfifo(tmp_path / "pipe.json")
    assert next_session(tmp_path) == 1


def test_a_session_is_read_where_nothing_can_be_written(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    for number in (1, 2):
        path = left(tmp_path, number)
    path.write_bytes(b"damaged")
    before = contents(tmp_path)
    with monkeypatch.context() as patch:
        patch.setattr("explorer.app.storage.autosave.alone_in", refuse("read-only"))
        store = Autosave(tmp_path)
        found = store.adopt()
        assert number_of(found.document) == 1
        assert any("read-only" in message for message in found.messages)
        assert any(path.name in message for message in found.messages)
        with pytest.raises(StorageError, match="read-only"):
            store.save(numbered(3))
        assert contents(tmp_path) == before
    # Once it can be written, the session goes on in a file of its own.
    store.save(numbered(3))
    assert {*contents(tmp_path)} > {*before}
    store.close()


def test_a_file_in_place_of_the_folder_is_told_in_one_line(tmp_path: Path) -> None:
    (tmp_path / "data").write_bytes(b"")
    store = Autosave(tmp_path / "data" / "sessions")
    found = store.adopt()
    assert found.document is None
    with pytest.raises(StorageError, match="EXPLORER_DATA") as refusal:
        store.save(numbered(1))
    assert found.messages == (str(refusal.value),)
    assert "\n" not in str(refusal.value)
    assert "Traceback" not in str(refusal.value)


def test_a_folder_without_permission_is_told_in_one_line(tmp_path: Path) -> None:
    left(tmp_path, 1)
    tmp_path.chmod(0o500)
    try:
        if os.access(tmp_path, os.W_OK):
            pytest.skip("a superuser may write anywhere")
        store = Autosave(tmp_path)
        assert number_of(store.adopt().document) == 1
        with pytest.raises(StorageError, match="may write"):
            store.save(numbered(2))
    finally:
        tmp_path.chmod(0o700)


def test_a_session_goes_on_when_its_folder_is_taken_away(tmp_path: Path) -> None:
    folder = tmp_path / "sessions"
    store = Autosave(folder)
    store.save(numbered(1))
    folder.rename(tmp_path / "elsewhere")
    store.save(numbered(2))
    store.close()
    assert next_session(folder) == 2
    assert next_session(tmp_path / "elsewhere") == 1


def test_a_folder_that_another_explorer_keeps_is_told(tmp_path: Path) -> None:
    with alone_in(tmp_path), pytest.raises(StorageError, match="another explorer"):
        held(tmp_path)


def held(folder: Path) -> None:
    with alone_in(folder, patience=0.0):
        pass


def test_a_lock_is_had_once(tmp_path: Path) -> None:
    lock = taken(tmp_path / "x.lock")
    assert lock is not None
    assert taken(tmp_path / "x.lock") is None
    lock.release()
    again = taken(tmp_path / "x.lock")
    assert again is not None
    again.release()


def test_the_folder_of_tests_is_not_that_of_the_user(monkeypatch: pytest.MonkeyPatch) -> None:
    assert data_folder() == Path(os.environ["EXPLORER_DATA"])
    assert Autosave().folder == data_folder() / "sessions"
    monkeypatch.setenv("EXPLORER_DATA", "~/mine")
    assert data_folder() == Path.home() / "mine"
    # An empty name names none.
    monkeypatch.setenv("EXPLORER_DATA", "")
    assert data_folder().name == "flagged-explorer"
    assert data_folder().is_absolute()


@pytest.mark.skipif(not hasattr(os, "fork"), reason="writers are forked")
def test_writers_that_are_killed_at_any_moment_lose_nothing_that_was_acknowledged(
    tmp_path: Path,
) -> None:
    command = [sys.executable, str(HERE / "killed.py"), str(tmp_path / "sessions"), "50", "7"]
    environment = {**os.environ, "PYTHONPATH": str(HERE.parents[1])}
    done = subprocess.run(command, env=environment, capture_output=True, text=True, check=False)
    assert done.returncode == 0, done.stderr
    found = json.loads(done.stdout)
    assert found["kills"] == 50
    assert found["number"] >= found["saves"] >= 40


FULL = """
import json, resource, sys
from dataclasses import replace
from pathlib import Path
from explorer.app.state.state import opened
from explorer.app.storage.autosave import Autosave
from explorer.app.storage.autosaver import Autosaver
from explorer.app.storage.document import Document
from explorer.mechanism.design_file import PRESETS

folder, told, seen = Path(sys.argv[1]), [], []
state = opened(PRESETS["paper-optimal"])
saver = Autosaver(Autosave(folder), told.append, again=1e6)
for number, largest in enumerate((-1, 1000, 500, 0, -1)):
    resource.setrlimit(resource.RLIMIT_FSIZE, (largest, -1))
    saver.post(Document(state, first=number))
    done = saver.flush()
    seen.append((done, {path.suffix: path.stat().st_size for path in folder.iterdir()}))
saver.stop()
print(json.dumps([told, seen, Autosave(folder).adopt().document.first]))
"""


@pytest.mark.skipif(sys.platform == "win32", reason="files have no limit there")
def test_where_nothing_more_can_be_written_the_last_session_stays(tmp_path: Path) -> None:
    environment = {**os.environ, "PYTHONPATH": str(HERE.parents[1])}
    command = [sys.executable, "-c", FULL, str(tmp_path)]
    done = subprocess.run(command, env=environment, capture_output=True, text=True, check=False)
    assert done.returncode == 0, done.stderr
    told, seen, number = json.loads(done.stdout)
    assert [is_saved for is_saved, _ in seen] == [True, False, False, False, True]
    # The file is as long as ever, and nothing lies beside it.
    assert all(files == seen[0][1] for _, files in seen[:-1])
    assert seen[-1][1].keys() == seen[0][1].keys()
    assert seen[0][1][".json"] > 1000
    failed, works = told
    assert "File too large" in failed
    assert "goes on trying" in failed
    assert "saved again" in works
    assert number == 4


@dataclass
class Shelf:
    """A store in memory that can be broken and held up."""

    saved: list[Document] = field(default_factory=list[Document])
    problem: Exception | None = None
    may_go: threading.Event = field(default_factory=threading.Event)
    began: threading.Event = field(default_factory=threading.Event)
    is_closed: bool = False

    def __post_init__(self) -> None:
        self.may_go.set()

    def save(self, document: Document) -> int:
        assert threading.current_thread() is not threading.main_thread()
        assert not self.is_closed
        self.began.set()
        assert self.may_go.wait(30.0)
        if self.problem is not None:
            raise self.problem
        self.saved.append(document)
        return len(self.saved)

    def close(self) -> None:
        self.is_closed = True


def told_by(shelf: Shelf, quiet: float, longest: float) -> tuple[Autosaver, list[str]]:
    told: list[str] = []
    return Autosaver(shelf, told.append, quiet=quiet, longest=longest, again=NEVER), told


def marked(number: int) -> Document:
    return replace(numbered(1), first=number)


def waited(is_so: Callable[[], bool]) -> bool:
    end = time.monotonic() + 30.0
    while not is_so() and time.monotonic() < end:
        time.sleep(0.005)
    return is_so()


def test_of_many_changes_only_the_last_is_saved() -> None:
    shelf = Shelf()
    saver, told = told_by(shelf, NEVER, NEVER)
    for number in range(100):
        saver.post(marked(number))
    assert shelf.saved == []
    assert saver.flush()
    assert [each.first for each in shelf.saved] == [99]
    # Nothing new, nothing to do; and the next change waits again.
    assert saver.flush()
    saver.post(marked(100))
    assert len(shelf.saved) == 1
    saver.stop()
    assert [each.first for each in shelf.saved] == [99, 100]
    assert shelf.is_closed
    assert told == []


def test_a_change_is_saved_by_itself_once_it_is_quiet() -> None:
    shelf = Shelf()
    saver, _ = told_by(shelf, 0.01, NEVER)
    saver.post(marked(1))
    assert waited(lambda: [each.first for each in shelf.saved] == [1])
    saver.stop()


def test_what_never_rests_is_saved_all_the_same() -> None:
    shelf = Shelf()
    saver, _ = told_by(shelf, NEVER, 0.05)
    number = 0

    def more() -> bool:
        nonlocal number
        number += 1
        saver.post(marked(number))
        return len(shelf.saved) >= 3

    assert waited(more)
    saver.stop()
    assert shelf.saved[-1].first == number


def test_a_failure_is_told_once_and_so_is_that_it_works_again() -> None:
    shelf = Shelf(problem=StorageError("the disk is full; make room"))
    saver, told = told_by(shelf, 0.0, 0.0)
    for number in range(3):
        saver.post(marked(number))
        assert not saver.flush()
        assert saver.is_failing
    (message,) = told
    assert message == ("What you do is not saved: the disk is full; make room. It goes on trying.")
    shelf.problem = None
    # Nothing is lost of what was posted last.
    assert saver.flush()
    assert [each.first for each in shelf.saved] == [2]
    assert told[1:] == ["What you do is saved again."]
    shelf.problem = ZeroDivisionError("a\nfault")
    saver.post(marked(3))
    assert not saver.flush()
    assert "\n" not in told[2]
    assert "a fault" in told[2]
    shelf.problem = None
    saver.stop()
    assert [each.first for each in shelf.saved] == [2, 3]


def test_what_fails_is_tried_again_while_changes_go_on() -> None:
    shelf = Shelf(problem=StorageError("full"))
    saver, told = told_by(shelf, NEVER, 0.05)
    saver.post(marked(0))
    assert waited(lambda: bool(told))
    shelf.problem = None

    def more() -> bool:
        saver.post(marked(1))
        return bool(shelf.saved)

    assert waited(more)
    saver.stop()


def test_what_is_posted_while_it_saves_is_saved_next() -> None:
    shelf = Shelf()
    shelf.may_go.clear()
    saver, _ = told_by(shelf, 0.0, 0.0)
    saver.post(marked(1))
    assert shelf.began.wait(30.0)
    saver.post(marked(2))
    shelf.may_go.set()
    assert saver.flush()
    assert [each.first for each in shelf.saved] == [1, 2]
    saver.stop()


def test_a_stopped_one_that_cannot_save_ends_all_the_same() -> None:
    shelf = Shelf(problem=StorageError("full"))
    saver, told = told_by(shelf, NEVER, NEVER)
    saver.post(marked(1))
    saver.stop()
    assert shelf.is_closed
    assert len(told) == 1


def test_generations_are_those_in_the_file(tmp_path: Path) -> None:
    store = Autosave(tmp_path)
    for number in range(3):
        generation = store.save(numbered(number))
        assert store.path is not None
        data = store.path.read_bytes()
        assert decode_header(data, "file").generation == generation
        assert data == encode_document(numbered(number), generation)
    store.close()
