"""Saved sessions come back to the last bit, and outlast kills, damage and other explorers."""

from __future__ import annotations

import os
from collections.abc import Callable
from dataclasses import fields, is_dataclass, replace
from functools import partial
from pathlib import Path
from typing import Any

import pytest
from client import wait_for
from desk import Desk
from hypothesis import example, given, strategies as st
from killed import run_until_killed
from sample_states import OPTIMAL, Sample, rich_state, samples, states_of

from explorer.app.features.optimise.actions import start_run
from explorer.app.features.optimise.state import Optimisation, SearchRun
from explorer.app.features.paths.state import Paths
from explorer.app.session.history import History, HistoryStep, start_history
from explorer.app.session.session import REDO, UNDO, Session
from explorer.app.state.actions import set_name
from explorer.app.state.moves import set_position
from explorer.app.state.parts import with_value
from explorer.app.state.state import State, open_state
from explorer.app.storage import user_data
from explorer.app.storage.session_file import (
    MOST_ORPHANS,
    MOST_STEPS,
    SCHEMA,
    DamagedError,
    SessionFile,
    decode_session,
    encode_session,
)
from explorer.app.storage.user_data import Autosaver, open_user_data
from explorer.errors import StorageError
from explorer.page.storage.folder import data_folder

DATA = Path(__file__).parents[1] / "data"
RICH, OPENED = rich_state(), open_state(OPTIMAL)
WHOLE = encode_session(History((HistoryStep(7, "Open", OPENED), HistoryStep(8, "All", RICH)), 1))


def saved_part_of(state: State) -> State:
    """Return what a file holds of a state: all but what goes on or is computed again."""
    paths, found = Paths.of(state), Optimisation.of(state)
    journey = None if paths.journey is None else replace(paths.journey, is_playing=False)
    paths = replace(paths, request=0, planning=None, problem=None, journey=journey)
    run = None if found.run is None else saved_run_of(found.run)
    found = replace(found, run=run)
    state = with_value(with_value(state, "paths", paths), "optimisation", found)
    return replace(state, taken=None, gesture=None)


def saved_run_of(run: SearchRun) -> SearchRun:
    best = run.best
    shown = tuple(each for each in run.iterates if best is not None and each.run == best.run)
    return replace(run, own=saved_part_of(run.own), iterates=shown, comparison=None)


def history_of(states: list[State], words: str = "Step {} «é»") -> History:
    steps = (
        HistoryStep(number, words.format(number), state) for number, state in enumerate(states)
    )
    return History(tuple(steps), len(states) - 1)


def moves(state: State, count: int) -> list[State]:
    """Return a state and those after moves along x."""
    states = [state]
    for number in range(count):
        states.append(set_position(0, 5.0 + 0.01 * number).apply(states[-1]))
    return states


def leaves(value: Any, path: str = "") -> dict[str, Any]:
    """Return the values within the parts of a state, by their paths."""
    if not is_dataclass(value):
        return {path: value}
    found: dict[str, Any] = {}
    for each in fields(value):
        if each.name != "parts":
            found |= leaves(getattr(value, each.name), f"{path}.{each.name}")
    for name, part in getattr(value, "parts", {}).items():
        found |= leaves(part, f"{path}.{name}")
    return found


def test_rich_state_differs_from_a_new_one_in_every_saved_value() -> None:
    new, rich = leaves(open_state(OPTIMAL)), leaves(RICH)
    transient = {"taken", "gesture", "paths.request", "paths.planning", "paths.problem"}
    same = {path[1:] for path, value in new.items() if rich.get(path, ...) == value}
    assert same == transient


@given(samples())
def test_session_after_any_actions_is_read_back_to_the_last_bit(actions: list[Sample]) -> None:
    # A search is a step once it has ended.
    history = history_of([state for state in states_of(actions) if not state.busy])
    read = decode_session(encode_session(history), "file")
    assert [(step.number, step.words) for step in read.steps] == [
        (step.number, step.words) for step in history.steps
    ]
    assert read.at == history.at
    for step, found in zip(history.steps, read.steps, strict=True):
        # As text, in which no bit of a number and no sign of a zero is lost.
        assert repr(found.state) == repr(saved_part_of(step.state))
        assert found.state == saved_part_of(step.state)


def test_long_history_loses_steps_far_from_the_present_one() -> None:
    history = history_of(moves(open_state(OPTIMAL), 3 * MOST_STEPS))
    read = decode_session(encode_session(history), "file")
    assert len(read.steps) == MOST_STEPS
    assert read.step.state == history.step.state
    assert read.step.number == history.step.number


def test_infinite_number_is_refused_when_the_session_is_written() -> None:
    state = replace(open_state(OPTIMAL), yaw_pitch_roll=(float("inf"), 0.0, 0.0))
    with pytest.raises(StorageError, match="no file can"):
        encode_session(start_history(state))


@given(st.integers(0, len(WHOLE) - 2))
def test_file_cut_short_is_refused(place: int) -> None:
    with pytest.raises(StorageError):
        decode_session(WHOLE[:place], "file")


@given(st.binary(max_size=300))
@example(b"\n")
@example(b"[" * 100_000)
@example(b'{"at":0,"first":0,"steps":[]}')
@example(b'{"at":0,"first":0,"steps":[{"words":"a","changes":{}}]}')
@example(b'{"at":0,"first":0,"steps":[{"words":"a","changes":{"pose":0,"what":0}}]}')
def test_any_bytes_are_refused_in_one_line(data: bytes) -> None:
    for each in (data, b'{"schema":%d}\n' % SCHEMA + data):
        with pytest.raises(StorageError) as refusal:
            decode_session(each, "file")
        assert "\n" not in str(refusal.value)


def test_file_of_this_version_opens_and_is_the_same_once_it_is_written_again() -> None:
    read = decode_session((DATA / "session.json").read_bytes(), "file")
    assert [step.words for step in read.steps] == ["Open é «one»", "All"]
    assert repr(decode_session(encode_session(read), "file")) == repr(read)


@pytest.mark.parametrize("schema", [1, SCHEMA - 1, SCHEMA + 1])
def test_file_of_another_version_is_refused_in_one_sentence_whatever_it_holds(schema: int) -> None:
    head = b'{"schema": %d, "generation": 5, "what": "nobody knows"}\n' % schema
    for rest in (b"", b"anything", b"\xff"):
        with pytest.raises(StorageError) as refusal:
            decode_session(head + rest, "file")
        assert not isinstance(refusal.value, DamagedError)
        assert str(refusal.value) == (
            "file is a session of another version of the explorer: "
            f"it has schema {schema}, and this version reads schema {SCHEMA}"
        )


# Seconds that no test waits.
NEVER = 1e6


@pytest.fixture
def saves_at_once(monkeypatch: pytest.MonkeyPatch) -> None:
    """A saver that waits neither before it saves nor before it tries again."""
    monkeypatch.setattr(user_data, "DELAY_SECONDS", 0.0)
    monkeypatch.setattr(user_data, "RETRY_SECONDS", 0.01)


@pytest.fixture
def saves_never(monkeypatch: pytest.MonkeyPatch) -> None:
    """A saver that does not save by itself."""
    monkeypatch.setattr(user_data, "DELAY_SECONDS", NEVER)


def numbered(number: int) -> History:
    """Return a session that is known by a number: the first coordinate of b4."""
    return start_history(set_position(0, float(number)).apply(OPENED))


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
    history, messages = store.resume()
    store.close()
    assert messages == ()
    return number_of(history)


def contents(folder: Path) -> dict[str, bytes]:
    """Return the contents of all files in a folder except locks, by name."""
    files = [path for path in folder.iterdir() if not path.name.endswith(".lock")]
    return {path.name: path.read_bytes() for path in files}


def saved_numbers(folder: Path) -> list[float | None]:
    """Return the numbers of the sessions in a folder, which an explorer may be writing."""
    files = sorted(folder.glob("*.json"))
    return [number_of(decode_session(file.read_bytes(), "file")) for file in files]


def test_next_explorer_continues_in_the_same_file(tmp_path: Path) -> None:
    folder = tmp_path / "new" / "sessions"
    first = SessionFile(folder)
    assert first.resume()[0] is None
    assert first.path is None
    for number in range(5):
        first.save(numbered(number))
        assert first.path is not None
        assert first.path.read_bytes() == encode_session(numbered(number))
    path = first.path
    first.close()
    second = SessionFile(folder)
    assert second.resume() == (numbered(4), ())
    assert second.path == path
    second.save(numbered(5))
    second.close()
    assert len(contents(folder)) == 1
    assert resume(folder) == 5


def test_explorers_side_by_side_have_a_file_each_and_the_last_save_is_the_newest(
    tmp_path: Path,
) -> None:
    leave_session(tmp_path, 0)
    one, two, three = (SessionFile(tmp_path) for _ in range(3))
    assert number_of(one.resume()[0]) == 0
    assert two.resume()[0] is None
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
    assert [number_of(store.resume()[0]) for store in stores] == [10, 20, 30, None]
    for store in stores:
        store.close()


def test_only_the_newest_sessions_are_kept_and_those_of_running_explorers(tmp_path: Path) -> None:
    living = SessionFile(tmp_path)
    living.save(numbered(-1))
    for number in range(MOST_ORPHANS + 5):
        leave_session(tmp_path, number)
    store = SessionFile(tmp_path)
    assert number_of(store.resume()[0]) == MOST_ORPHANS + 4
    numbers = saved_numbers(tmp_path)
    assert sorted(n for n in numbers if n is not None) == [-1, *range(4, MOST_ORPHANS + 5)]
    living.save(numbered(-2))
    store.close()
    living.close()
    assert resume(tmp_path) == -2


def test_paths_that_are_no_sessions_are_ignored(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setenv("EXPLORER_DATA", str(tmp_path))
    folder = tmp_path / "sessions"
    leave_session(folder, 2)
    (folder / ".one.json.0123.part").write_bytes(b"part")
    # Folders, links and pipes named like sessions are ignored.
    (folder / "folder.json").mkdir()
    (folder / "gone.json").symlink_to(folder / "nowhere")
    if hasattr(os, "mkfifo"):
        os.mkfifo(folder / "pipe.json")
    data = open_user_data(resume=True)
    data.store.close()
    assert (number_of(data.history), data.messages) == (2, ())


DAMAGES: dict[str, Callable[[bytes], bytes]] = {
    "cut": lambda whole: whole[: len(whole) // 2],
    "changed": lambda whole: whole.replace(b"[2.0", b"[true", 1),
    "empty": lambda _: b"",
    "other": lambda _: b'{"what": 1}\n',
}


@pytest.mark.parametrize("damage", DAMAGES)
def test_damaged_file_is_renamed_and_the_session_before_is_resumed(
    tmp_path: Path, damage: str
) -> None:
    leave_session(tmp_path, 1)
    path = leave_session(tmp_path, 2)
    damaged = DAMAGES[damage](path.read_bytes())
    path.write_bytes(damaged)
    store = SessionFile(tmp_path)
    history, messages = store.resume()
    store.close()
    assert number_of(history) == 1
    (message,) = messages
    assert "\n" not in message
    assert path.name in message
    assert message.endswith(f"; it is kept as {path.name + '.broken'!r}")
    assert path.with_name(path.name + ".broken").read_bytes() == damaged
    assert not path.exists()
    assert resume(tmp_path) == 1


def test_file_of_another_version_is_left_alone(tmp_path: Path) -> None:
    leave_session(tmp_path, 1)
    other = tmp_path / "other.json"
    other.write_bytes(b'{"schema": 99, "more": [1]}\n\xff')
    before = other.read_bytes()
    store = SessionFile(tmp_path)
    history, messages = store.resume()
    assert number_of(history) == 1
    (message,) = messages
    assert "another version" in message
    assert message.endswith("; it is left as it is")
    assert other.read_bytes() == before
    store.close()


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


def test_save_killed_between_any_two_writes_leaves_the_session_before_or_the_new_one(
    tmp_path: Path,
) -> None:
    leave_session(tmp_path, 1)
    number, writes, is_killed = 1, 0, True
    while is_killed:
        store = SessionFile(tmp_path)
        before = number_of(store.resume()[0])
        number += 1
        is_killed = run_until_killed(partial(store.save, numbered(number)), writes)
        # The system releases the lock of a process that is killed.
        store.close()
        assert resume(tmp_path) in ({before, number} if is_killed else {number})
        writes += 1
    assert writes > 1


@pytest.mark.usefixtures("saves_at_once")
def test_last_of_many_changes_is_saved_in_the_background_and_the_next_one_too(
    tmp_path: Path,
) -> None:
    messages: list[str] = []
    saver = Autosaver(SessionFile(tmp_path), messages.append)
    for number in range(20):
        saver.follow(numbered(number))
    wait_for(lambda: saved_numbers(tmp_path) == [19])
    saver.follow(numbered(20))
    wait_for(lambda: saved_numbers(tmp_path) == [20])
    saver.stop()
    assert messages == []


@pytest.mark.usefixtures("saves_never")
def test_change_is_saved_at_once_by_a_flush_and_when_the_explorer_stops(tmp_path: Path) -> None:
    saver = Autosaver(SessionFile(tmp_path), print)
    saver.follow(numbered(1))
    assert saved_numbers(tmp_path) == []
    assert saver.flush()
    assert saved_numbers(tmp_path) == [1]
    # Without a change nothing is written.
    before = contents(tmp_path)
    assert saver.flush()
    assert contents(tmp_path) == before
    saver.follow(numbered(2))
    saver.stop()
    assert resume(tmp_path) == 2


@pytest.mark.usefixtures("saves_never")
def test_failure_to_save_is_reported_once_and_so_is_its_end(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    (tmp_path / "file").write_bytes(b"")
    messages: list[str] = []
    store = SessionFile(tmp_path / "file")
    saver = Autosaver(store, messages.append)
    for number in range(3):
        saver.follow(numbered(number))
        assert not saver.flush()
    (message,) = messages
    assert message == saver.problem
    assert message.startswith("The session is not saved: cannot make the folder")
    assert message.endswith(". The explorer keeps trying.")
    (tmp_path / "file").unlink()
    # The last one posted is not lost.
    assert saver.flush()
    assert messages[1:] == ["The session is saved again."]
    assert saver.problem is None

    def fail(_: History) -> None:
        raise ZeroDivisionError("a\nfault")

    with monkeypatch.context() as patch:
        patch.setattr(store, "save", fail)
        saver.follow(numbered(3))
        assert not saver.flush()
    assert "\n" not in messages[2]
    assert "a fault" in messages[2]
    saver.stop()
    assert resume(tmp_path / "file") == 3


@pytest.mark.usefixtures("saves_at_once")
def test_failed_save_is_tried_again_without_another_change(tmp_path: Path) -> None:
    (tmp_path / "file").write_bytes(b"")
    messages: list[str] = []
    saver = Autosaver(SessionFile(tmp_path / "file"), messages.append)
    saver.follow(numbered(1))
    wait_for(lambda: messages)
    (tmp_path / "file").unlink()
    wait_for(lambda: saver.problem is None)
    saver.stop()
    assert resume(tmp_path / "file") == 1


def test_resumed_session_is_undone_and_redone(desk: Desk, tmp_path: Path) -> None:
    saver = Autosaver(SessionFile(tmp_path), desk.complaints.append)
    for action in (set_name("mine"), set_position(0, 12.0)):
        desk.session.do(action)
        desk.session.latest_state()
        saver.follow(desk.session.history)
    # Until a search ends, the session before it is saved.
    before = desk.session.history
    desk.session.do(start_run())
    assert desk.state.busy
    saver.follow(desk.session.history)
    saver.stop()

    history = SessionFile(tmp_path).resume()[0]
    assert history is not None
    assert [(step.number, step.words, step.state) for step in history.steps] == [
        (step.number, step.words, step.state) for step in before.steps
    ]
    assert history.step.state == before.step.state
    session = Session(history.step.state, lambda _: None, print, print, history)
    try:
        for travel, expected in ((UNDO, before.steps[0]), (REDO, before.steps[2])):
            for _ in range(2):
                session.do(travel)
            assert session.wait_until_idle()
            assert session.state == expected.state
    finally:
        session.stop()
    assert desk.complaints == []
