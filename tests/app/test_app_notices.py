"""Notices, files, and the theme."""

from __future__ import annotations

from collections.abc import Generator
from contextlib import contextmanager
from dataclasses import replace
from pathlib import Path
from types import SimpleNamespace
from typing import Any, NoReturn
from unittest.mock import Mock

import pytest
from client import Client, client_of, press_update, presses_in, wait_for
from services import StubJobs

from explorer.app.features.designs.feature import UNSAVED
from explorer.app.features.paths.state import Stop
from explorer.app.server import Running, start
from explorer.app.session.session import move_to
from explorer.app.state.actions import Set
from explorer.app.state.moves import set_position
from explorer.app.storage.library import Library
from explorer.app.storage.session_file import SessionFile
from explorer.app.storage.user_data import UserData
from explorer.app.widgets.downloads import Downloads
from explorer.errors import InputError
from explorer.mechanism.design_file import PRESETS


@contextmanager
def explorer_with(data: UserData) -> Generator[Running]:
    running = start(PRESETS["paper-optimal"], port=0, user_data=data)
    try:
        yield running
    finally:
        running.stop()


def notices_until(client: Client, words: str) -> list[dict[str, Any]]:
    """Return the notices that a client is sent, up to the first with these words in it."""
    notices: list[dict[str, Any]] = []
    while not any(words in notice["body"] for notice in notices):
        messages = client.read()
        notices += [m["props"] for m in messages if m["type"] == "NotificationShowMessage"]
    return notices


def has_warning(running: Running) -> bool:
    return (UNSAVED, "") in presses_in(running)


@pytest.fixture
def folder(tmp_path: Path) -> Path:
    """A data folder that cannot be made: a file lies in its place."""
    (tmp_path / "data").write_bytes(b"")
    return tmp_path / "data"


def data_in(folder: Path) -> UserData:
    store = SessionFile(folder / "sessions")
    return UserData(Library(folder / "designs"), store)


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
            client.read_all_sent(running)
            (bar,) = (
                props["content"]
                for props in client.controls.values()
                if 'class="ex-bar"' in str(props.get("content", ""))
            )
            assert "Session not saved" in bar
            assert "EXPLORER_DATA" in bar
            # A press shows the whole reason.
            client.update(*press_update(running, UNSAVED))
            assert len(notices_until(client, "a file lies where a folder is meant")) == 1
        folder.unlink()
        assert page.autosaver.flush()
        wait_for(lambda: not has_warning(running))


def test_notice_before_any_browser_is_shown_to_the_first_one_alone(tmp_path: Path) -> None:
    messages = tuple(f"file {number} is damaged" for number in range(3))
    with explorer_with(replace(data_in(tmp_path), messages=messages)) as running:
        running.page.services.tell("the study has ended")
        with client_of(running) as client:
            notices = notices_until(client, "the study has ended")
            assert [notice["body"] for notice in notices] == [
                *(f"File {number} is damaged." for number in range(3)),
                "the study has ended",
            ]
            # They stay until they are closed, since the page may still be loading.
            assert {notice["auto_close_seconds"] for notice in notices} == {None}
        with client_of(running) as other:
            running.page.services.tell("the next study has ended")
            assert len(notices_until(other, "the next study has ended")) == 1


def test_file_that_cannot_be_drawn_is_refused_to_the_tab_that_asks_alone(tmp_path: Path) -> None:
    def refuse(_: object) -> NoReturn:
        raise InputError("the scene is too large")

    with (
        explorer_with(data_in(tmp_path)) as running,
        client_of(running) as client,
        client_of(running) as other,
    ):
        running.page.services.downloads.make(client.client_id, "Drawing", refuse)
        assert notices_until(client, "too large")[-1]["body"] == "the scene is too large"
        assert "too large" not in str(other.read_all_sent(running))


def test_same_refusal_is_told_to_each_browser_that_meets_it_and_once_while_it_stays(
    tmp_path: Path,
) -> None:
    with (
        explorer_with(data_in(tmp_path)) as running,
        client_of(running) as one,
        client_of(running) as other,
    ):
        session = running.page.session
        for client in (one, other, one):
            session.do(lambda _: Set("paths.stops", (Stop(pause=-5.0),)), who=client.client_id)
        session.do(Set("paths.duration", 0.0), who=one.client_id)
        refusals = [notices_until(one, "a path needs a time"), notices_until(other, "got -5 s")]
        assert [[n["body"].count("got -5 s") for n in each] for each in refusals] == [[1, 0], [1]]


def encoded(what: str) -> bytes:
    return what.encode()


@pytest.fixture
def files(jobs: StubJobs) -> Downloads:
    server: Any = SimpleNamespace(get_clients=lambda: {1: Mock(), 2: Mock()})
    return Downloads(server, jobs, lambda message, who: pytest.fail(f"{who}: {message}"))


def test_only_a_file_of_the_same_name_and_browser_without_a_notice_is_replaced(
    files: Downloads, jobs: StubJobs
) -> None:
    for who, name in ((1, "workspace.3mf"), (1, "hull.3mf"), (2, "hull.3mf"), (1, "hull.3mf")):
        files.compute(who, name, encoded, (name,))
    workspace, hull, of_another, again = (order.key for order in jobs.orders)
    assert hull == again
    assert len({workspace, hull, of_another}) == 3
    for _ in range(2):
        files.compute(1, "report.pdf", encoded, ("report",), ("Report", "A moment."))
    # What has no key is never replaced.
    assert [order.key for order in jobs.orders[4:]] == [None, None]
    # For a browser that is gone none is made.
    files.compute(7, "hull.3mf", encoded, ("hull",))
    assert len(jobs.orders) == 6


@pytest.mark.parametrize(
    ("design", "file"),
    [("study #12", "study 12.json"), ("#", "design.json"), (".x", "design.x.json")],
)
def test_file_of_any_design_has_a_name_that_shows(design: str, file: str) -> None:
    client = Mock()
    server: Any = SimpleNamespace(get_clients=lambda: {1: client})
    Downloads(server, StubJobs(), Mock()).send(1, f"{design}.json", b"")
    assert client.send_file_download.call_args.args[0] == file


def test_theme_is_that_of_each_browser_and_no_step_of_the_history(tmp_path: Path) -> None:
    with (
        explorer_with(data_in(tmp_path)) as running,
        client_of(running) as one,
        client_of(running) as other,
    ):
        is_dark_for = running.page.services.theme.is_dark_for
        for client in (one, other):
            client.read_all_sent(running)
        for dark in (True, False):
            one.update(*press_update(running, "theme", "dark" if dark else "light"))
            wait_for(lambda dark=dark: is_dark_for(one.client_id) is dark)
            sent = one.read_all_sent(running)
            (theme,) = (m for m in sent if m["type"] == "ThemeConfigurationMessage")
            # No tunnel to anywhere is offered in either.
            assert (theme["dark_mode"], theme["show_share_button"]) == (dark, False)
            painted = [m["name"] for m in sent if m["type"] == "SceneNodeUpdateMessage"]
            assert {"/grid", "/shadow"} <= {*painted}
        assert not is_dark_for(other.client_id)
        types = {m["type"] for m in other.read_all_sent(running)}
        assert not types & {"ThemeConfigurationMessage", "SceneNodeUpdateMessage"}
        assert len(running.page.session.history.steps) == 1


def test_step_names_its_browser_to_others_and_who_undoes_it_is_told_to_it(tmp_path: Path) -> None:
    with explorer_with(data_in(tmp_path)) as running, client_of(running) as one:
        session = running.page.session
        session.do(set_position(0, 11.0), who=one.client_id)
        assert session.wait_until_idle()
        one.read_all_sent(running)
        assert "ex-author" not in str(one.controls)
        with client_of(running) as other:
            session.do(set_position(0, 12.0), who=other.client_id)
            assert session.wait_until_idle()
            other.read_all_sent(running)
            for client in (one, other):
                assert f'ex-author" data-who="{client.client_id}"' in str(other.controls)
            # The first one undoes the other one's step, and its own before it.
            session.do(move_to(0), who=one.client_id)
            (notice,) = notices_until(other, "Another browser has undone")
            assert "x = 12" in notice["body"]
