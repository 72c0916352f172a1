"""The user's designs on the page: saved, opened, copied, renamed, deleted and brought back."""

from __future__ import annotations

from collections.abc import Generator
from pathlib import Path

import msgspec
import pytest
import viser
from desk import Desk
from services import services_for

from explorer.app.features.designs.feature import DesignsPanel, SavedDesigns, rows_of
from explorer.app.features.feature import Services
from explorer.app.features.history.feature import HISTORY, MOVE, UndoButtons
from explorer.app.session.session import UNDO
from explorer.app.state.actions import Set, mark_saved, open_design, set_name
from explorer.app.state.frame import Frame
from explorer.app.state.geometry import set_variable
from explorer.app.storage.library import Library
from explorer.app.storage.session_file import SessionFile, encode_session
from explorer.app.storage.user_data import UserData
from explorer.app.widgets.buttons import Buttons
from explorer.errors import InputError, StorageError
from explorer.mechanism.design_file import PRESETS, encode_design

OPTIMAL = PRESETS["paper-optimal"]


@pytest.fixture
def library(tmp_path: Path) -> Library:
    return Library(tmp_path / "designs")


@pytest.fixture
def services(
    server: viser.ViserServer, desk: Desk, buttons: Buttons, library: Library
) -> Generator[Services]:
    services = services_for(
        server,
        desk.session,
        buttons=buttons,
        complain=desk.complain,
        user_data=UserData(library, SessionFile()),
        declared=(HISTORY,),
    )
    yield services
    services.stop()


@pytest.fixture
def saved(services: Services) -> SavedDesigns:
    return services.get(SavedDesigns)


def settle(desk: Desk, saved: SavedDesigns) -> None:
    assert saved.wait_until_idle()
    assert desk.session.wait_until_idle()


def names(saved: SavedDesigns) -> list[str]:
    return [entry.name for entry in saved.entries]


def save_as(desk: Desk, saved: SavedDesigns, name: str) -> None:
    desk.session.do(set_name(name))
    saved.save(desk.state.design)
    settle(desk, saved)


def markup_of_rows(desk: Desk, saved: SavedDesigns, panel: DesignsPanel) -> str:
    """Return the markup of the list of designs."""
    settle(desk, saved)
    updates = panel.updates(Frame(desk.state))
    return str(next(v for each, name, v in updates if (each, name) == (panel.list, "content")))


def test_design_saved_again_replaces_the_first_which_can_be_restored(
    desk: Desk, saved: SavedDesigns, library: Library
) -> None:
    save_as(desk, saved, "mine")
    first = desk.state.design
    # What reset returns to is what was saved.
    assert library.open("mine") == first == desk.state.base
    saved.save(first)
    settle(desk, saved)
    assert library.last_deleted is None
    desk.session.do(Set("design.unit_mm", 3.0))
    save_as(desk, saved, "mine")
    assert library.open("mine").unit_mm == 3.0
    saved.restore()
    settle(desk, saved)
    assert library.open("mine copy") == msgspec.structs.replace(first, name="mine copy")
    assert desk.complaints == []


def test_preset_is_saved_only_as_a_copy(desk: Desk, saved: SavedDesigns) -> None:
    saved.save(desk.state.design)
    settle(desk, saved)
    assert names(saved) == []
    (complaint,) = desk.complaints
    assert complaint.startswith("'paper-optimal' is a preset and stays as it is")
    saved.save_copy(desk.state.design)
    settle(desk, saved)
    assert names(saved) == [desk.state.design.name] == ["paper-optimal copy"]


def test_design_is_renamed_copied_deleted_and_restored(
    desk: Desk, saved: SavedDesigns, library: Library
) -> None:
    save_as(desk, saved, "mine")
    for act, expected in (
        (lambda: saved.rename("mine", "yours"), ["yours"]),
        (lambda: saved.copy("yours"), ["yours", "yours copy"]),
        (lambda: saved.delete("yours"), ["yours copy"]),
        (saved.restore, ["yours", "yours copy"]),
        (saved.restore, ["yours", "yours copy"]),
    ):
        act()
        settle(desk, saved)
        assert sorted(names(saved)) == expected
    assert desk.state.base.name == "yours"
    assert desk.complaints == ["nothing has been deleted"]


def test_opened_design_is_a_step_that_is_undone(desk: Desk, saved: SavedDesigns) -> None:
    save_as(desk, saved, "mine")
    desk.session.do(open_design(PRESETS["paper-initial"]))
    saved.open("mine")
    settle(desk, saved)
    assert desk.state.design.name == "mine"
    desk.session.do(UNDO)
    assert desk.state.design.name == "paper-initial"


def test_design_changed_while_it_is_saved_keeps_its_change(desk: Desk) -> None:
    before = desk.state.design
    desk.session.do(set_variable("a3x", 15.0))
    changed = desk.state.design
    desk.session.do(mark_saved(before))
    assert (desk.state.design, desk.state.base) == (changed, before)


@pytest.mark.parametrize("name", ["", " ", "two\nlines", "x" * 101, "\x00"])
def test_name_of_a_design_is_one_printable_line(desk: Desk, name: str) -> None:
    with pytest.raises(InputError, match="name"):
        set_name(name).apply(desk.state)


def test_upload_is_read_strictly_and_its_name_is_no_path(
    desk: Desk, saved: SavedDesigns, library: Library, services: Services, tmp_path: Path
) -> None:
    named = msgspec.structs.replace(OPTIMAL, name="../../evil")
    saved.take(encode_design(named), "../../evil.json")
    settle(desk, saved)
    assert desk.state.design == named
    save_as(desk, saved, "../../evil")
    assert library.open("../../evil").name == "../../evil"
    # Beside the designs' own folder there is nothing new.
    assert [each.name for each in tmp_path.iterdir()] == ["designs"]
    # A session is one step; its own steps are not taken over.
    desk.session.do(set_variable("a3x", 15.0))
    changed = desk.state.design
    session = encode_session(desk.session.history)
    desk.session.do(open_design(OPTIMAL))
    for encoding in ("utf-8", "utf-8-sig", "utf-16"):
        saved.take(session.decode().encode(encoding), "left.json")
        settle(desk, saved)
        assert desk.state.design == changed
        desk.session.do(UNDO)
        assert desk.state.design == OPTIMAL
    before = desk.state
    for data in (b"", b"{", b"[" * 10000, b'{"schema": 2, "a3": [1, 2, 3]}', b"\xff\xfe"):
        saved.take(data, "broken.json")
    settle(desk, saved)
    assert desk.state.design == before.design
    assert desk.complaints
    assert all(each.startswith("broken.json") for each in desk.complaints)


def test_full_disk_is_reported_and_loses_nothing(
    desk: Desk, saved: SavedDesigns, library: Library, monkeypatch: pytest.MonkeyPatch
) -> None:
    save_as(desk, saved, "mine")
    kept = library.open("mine")

    def full(*_: object, **__: object) -> None:
        raise StorageError("cannot write: the disk is full; free some space")

    monkeypatch.setattr("explorer.app.storage.library.write_whole", full)
    desk.session.do(Set("design.unit_mm", 3.0))
    save_as(desk, saved, "mine")
    assert desk.complaints == ["cannot write: the disk is full; free some space"]
    monkeypatch.undo()
    assert library.open("mine") == kept
    assert desk.state.design.unit_mm == 3.0
    assert desk.state.base == kept


def test_panel_lists_opens_copies_and_deletes_designs(
    desk: Desk, saved: SavedDesigns, services: Services, buttons: Buttons
) -> None:
    panel = DesignsPanel(services)
    save_as(desk, saved, "mine <b>")
    content = markup_of_rows(desk, saved, panel)
    for text in ("mine &lt;b&gt;", "20.42 units"):
        assert text in content
    assert "<b>" not in content
    assert [row.name for row in rows_of(saved.entries)] == ["mine <b>", *PRESETS]
    assert content.count('data-press="designs.delete"') == 1
    for name, value, expected in (
        ("open", "paper-initial", ["mine <b>"]),
        ("duplicate", "mine <b>", ["mine <b> copy", "mine <b>"]),
        ("duplicate", "paper-initial", ["paper-initial copy", "mine <b> copy", "mine <b>"]),
        ("delete", "mine <b> copy", ["paper-initial copy", "mine <b>"]),
        # What is no longer in the list is refused, and presets are not deleted.
        ("open", "gone", ["paper-initial copy", "mine <b>"]),
        ("delete", "paper-initial", ["paper-initial copy", "mine <b>"]),
    ):
        desk.press(buttons, f"designs.{name}", value)
        markup_of_rows(desk, saved, panel)
        assert [row.name for row in rows_of(saved.entries)] == [*expected, *PRESETS]
        assert desk.state.design == PRESETS["paper-initial"]
    desk.click(panel.restore)
    markup_of_rows(desk, saved, panel)
    assert rows_of(saved.entries)[0].name == "mine <b> copy"
    gone, preset = desk.complaints
    assert "no design is called 'gone'" in gone
    assert "no design is called 'paper-initial'" in preset


def test_list_shows_what_other_explorers_save_the_last_on_top(
    desk: Desk, saved: SavedDesigns, services: Services, library: Library
) -> None:
    panel = DesignsPanel(services)
    for number in range(3):
        Library(library.folder).save(f"design {number}", OPTIMAL)
    saved.open("design 0")
    markup_of_rows(desk, saved, panel)
    assert [row.name for row in rows_of(saved.entries)] == [
        "design 2",
        "design 1",
        "design 0",
        *PRESETS,
    ]


def test_missing_design_is_neither_renamed_nor_opened_with_a_short_reason(
    desk: Desk, saved: SavedDesigns, library: Library
) -> None:
    for number in range(9):
        library.save(f"{number}" + "x" * 99, OPTIMAL)
    saved.rename("nobody's", "mine")
    saved.open("nobody's")
    settle(desk, saved)
    assert desk.complaints[0] == "the design is not saved yet; save it before you rename it"
    assert "no design is called" in desk.complaints[1]
    assert len(desk.complaints[1]) < 500


def test_undo_right_after_a_deletion_brings_the_design_back(
    desk: Desk, saved: SavedDesigns, services: Services, buttons: Buttons
) -> None:
    bar = UndoButtons(services)
    save_as(desk, saved, "mine")
    here = desk.state
    saved.delete("mine")
    settle(desk, saved)
    assert 'aria-label="Undo Delete mine"' in bar(Frame(desk.state))
    desk.press(buttons, MOVE, "Undo")
    settle(desk, saved)
    assert names(saved) == ["mine"]
    assert desk.state == here
    # What was done since is undone first, and then nothing is left to bring back.
    saved.delete("mine")
    settle(desk, saved)
    desk.session.do(set_variable("b2", 3.0))
    settle(desk, saved)
    assert "Delete mine" not in bar(Frame(desk.state))
    desk.press(buttons, MOVE, "Undo")
    settle(desk, saved)
    assert names(saved) == []
    assert desk.state.design == here.design
