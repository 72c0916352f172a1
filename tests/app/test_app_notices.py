"""What the page says without being asked reaches browsers that come later; failing saves stand."""

from __future__ import annotations

from collections.abc import Generator
from contextlib import contextmanager
from dataclasses import replace
from pathlib import Path
from typing import Any

import pytest
from client import Client, client_of, press_update, presses_in, wait_for

from explorer.app.features.designs.name import UNSAVED
from explorer.app.server import Running, start
from explorer.app.session.faults import Faults
from explorer.app.storage.library import Library
from explorer.app.storage.session_file import SessionFile
from explorer.app.storage.user_data import UserData, open_user_data
from explorer.mechanism.design_file import PRESETS


@contextmanager
def explorer_with(data: UserData) -> Generator[Running]:
    running = start(PRESETS["paper-optimal"], port=0, user_data=data)
    try:
        yield running
    finally:
        running.stop()


def notices_of(client: Client) -> list[dict[str, Any]]:
    """Return the notices of a client until it is quiet."""
    messages = client.read_until_quiet(0.5)
    return [m["props"] for m in messages if m["type"] == "NotificationShowMessage"]


def has_warning(running: Running) -> bool:
    return (UNSAVED, "") in presses_in(running)


@pytest.fixture
def folder(tmp_path: Path) -> Path:
    """A data folder that cannot be made: a file lies in its place."""
    (tmp_path / "data").write_bytes(b"")
    return tmp_path / "data"


def data_in(folder: Path) -> UserData:
    store = SessionFile(folder / "sessions")
    return UserData(Library(folder / "designs"), store, faults=Faults(folder / "faults"))


def test_data_folder_unwritable_from_the_start_stands_in_the_bar_until_it_can_be_written(
    folder: Path,
) -> None:
    with explorer_with(data_in(folder)) as running:
        page = running.page
        assert page.autosaver is not None
        # The save fails while no browser is there.
        assert not page.autosaver.flush()
        assert page.session.wait_until_idle()
        wait_for(lambda: has_warning(running))
        with client_of(running) as client:
            client.read_until_quiet(0.5)
            (bar,) = (
                props["content"]
                for props in client.controls.values()
                if 'class="ex-bar"' in str(props.get("content", ""))
            )
            assert "Session not saved" in bar
            assert "EXPLORER_DATA" in bar
            # A press shows the whole reason.
            client.update(*press_update(running, UNSAVED))
            (notice,) = notices_of(client)
            assert "a file lies where a folder is meant" in notice["body"]
        folder.unlink()
        assert page.autosaver.flush()
        wait_for(lambda: not has_warning(running))


def test_notice_before_any_browser_is_shown_to_the_first_one_alone(tmp_path: Path) -> None:
    messages = tuple(f"file {number} is damaged" for number in range(3))
    with explorer_with(replace(data_in(tmp_path), messages=messages)) as running:
        running.page.services.tell("the study has ended")
        with client_of(running) as client:
            notices = notices_of(client)
            assert [notice["body"] for notice in notices] == [
                *(f"File {number} is damaged." for number in range(3)),
                "the study has ended",
            ]
            # They stay until they are closed, since the page may still be loading.
            assert {notice["auto_close_seconds"] for notice in notices} == {None}
        with client_of(running) as other:
            assert notices_of(other) == []


def test_notices_without_a_browser_keep_the_newest(tmp_path: Path) -> None:
    with explorer_with(data_in(tmp_path)) as running:
        for number in range(100):
            running.page.services.tell(f"notice {number}")
        with client_of(running) as client:
            bodies = [notice["body"] for notice in notices_of(client)]
        assert 0 < len(bodies) <= 20
        assert bodies == [f"notice {number}" for number in range(100 - len(bodies), 100)]


def test_damaged_session_is_shown_to_the_first_browser(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setenv("EXPLORER_DATA", str(tmp_path))
    (tmp_path / "sessions").mkdir()
    (tmp_path / "sessions" / "one.json").write_bytes(b"damaged")
    with explorer_with(open_user_data(resume=True)) as running, client_of(running) as client:
        (notice,) = notices_of(client)
        assert "'one.json.broken'" in notice["body"]
