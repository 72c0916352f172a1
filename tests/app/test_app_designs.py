"""The user's designs on the page: saved, opened, copied, renamed, deleted and brought back."""

from __future__ import annotations

from collections.abc import Generator
from pathlib import Path

import msgspec
import pytest
import viser
from desk import Desk
from services import services_for

from explorer.app.features.designs.panel import ROWS, DesignsPanel, rows_of
from explorer.app.features.designs.saved_designs import SavedDesigns
from explorer.app.features.feature import Services
from explorer.app.session.session import UNDO
from explorer.app.state.actions import MarkSaved, Open, Set, SetName, SetVariable
from explorer.app.state.frame import Frame
from explorer.app.storage.library import Library
from explorer.app.storage.session_file import SessionFile
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
    user_data = UserData(library, SessionFile())
    made = services_for(
        server, desk.session, buttons=buttons, complain=desk.complain, user_data=user_data
    )
    yield made
    made.stop()


@pytest.fixture
def saved(services: Services) -> SavedDesigns:
    return services.get(SavedDesigns)


def settle(desk: Desk, saved: SavedDesigns) -> None:
    assert saved.wait_until_idle()
    assert desk.session.wait_until_idle()


def names(saved: SavedDesigns) -> list[str]:
    return [entry.name for entry in saved.entries]


def save_as(desk: Desk, saved: SavedDesigns, name: str) -> None:
    desk.session.do(SetName(name))
    saved.save(desk.state.design)
    settle(desk, saved)


def test_a_design_is_saved_under_its_name_and_reset_returns_to_it(
    desk: Desk, saved: SavedDesigns, library: Library
) -> None:
    desk.session.do(SetVariable("a3x", 15.0))
    save_as(desk, saved, "mine")
    assert library.open("mine") == desk.state.design == desk.state.base
    assert names(saved) == ["mine"]
    assert desk.complaints == []


def test_saving_again_keeps_what_is_replaced(
    desk: Desk, saved: SavedDesigns, library: Library
) -> None:
    save_as(desk, saved, "mine")
    first = desk.state.design
    saved.save(first)
    settle(desk, saved)
    assert library.deleted() == ()
    desk.session.do(Set("design.unit_mm", 3.0))
    save_as(desk, saved, "mine")
    assert library.open("mine").unit_mm == 3.0
    saved.restore()
    settle(desk, saved)
    assert library.open("mine copy") == msgspec.structs.replace(first, name="mine copy")


def test_presets_stay_as_they_are(desk: Desk, saved: SavedDesigns) -> None:
    saved.save(desk.state.design)
    settle(desk, saved)
    assert names(saved) == []
    assert desk.complaints == [
        "'paper-optimal' is a preset and stays as it is; give yours another name"
    ]
    saved.save_copy(desk.state.design)
    settle(desk, saved)
    assert names(saved) == [desk.state.design.name] == ["paper-optimal copy"]


def test_renaming_and_deleting_and_bringing_back(desk: Desk, saved: SavedDesigns) -> None:
    save_as(desk, saved, "mine")
    saved.rename("mine", "yours")
    settle(desk, saved)
    assert names(saved) == [desk.state.base.name] == ["yours"]
    saved.duplicate("yours")
    settle(desk, saved)
    saved.delete("yours")
    settle(desk, saved)
    assert names(saved) == ["yours copy"]
    saved.restore()
    settle(desk, saved)
    assert sorted(names(saved)) == ["yours", "yours copy"]
    saved.restore()
    settle(desk, saved)
    assert desk.complaints == ["nothing has been deleted"]


def test_opening_is_a_step_that_can_be_undone(desk: Desk, saved: SavedDesigns) -> None:
    save_as(desk, saved, "mine")
    desk.session.do(Open(PRESETS["paper-initial"]))
    saved.open("mine")
    settle(desk, saved)
    assert desk.state.design.name == "mine"
    desk.session.travel(UNDO)
    assert desk.state.design.name == "paper-initial"
    saved.open("nobody's")
    settle(desk, saved)
    assert "no design is called" in desk.complaints[0]


def test_what_is_saved_later_than_it_was_asked_for_loses_no_change(desk: Desk) -> None:
    asked = desk.state.design
    desk.session.do(SetVariable("a3x", 15.0))
    changed = desk.state.design
    desk.session.do(MarkSaved(asked))
    assert (desk.state.design, desk.state.base) == (changed, asked)


@pytest.mark.parametrize("name", ["", " ", "two\nlines", "x" * 101, "\x00"])
def test_a_name_is_one_printable_line(desk: Desk, name: str) -> None:
    with pytest.raises(InputError, match="name"):
        SetName(name).apply(desk.state)


def test_uploads_are_read_strictly_and_never_used_as_a_path(
    desk: Desk, saved: SavedDesigns, library: Library, tmp_path: Path
) -> None:
    named = msgspec.structs.replace(OPTIMAL, name="../../evil")
    saved.take(encode_design(named), "../../evil.json")
    settle(desk, saved)
    assert desk.state.design == named
    save_as(desk, saved, "../../evil")
    assert library.open("../../evil").name == "../../evil"
    # Beside the designs' own folder there is nothing new.
    assert [each.name for each in tmp_path.iterdir()] == ["designs"]
    before = desk.state
    for data in (b"", b"{", b"[" * 10000, b'{"schema": 1, "a3": [1, 2, 3]}', b"\xff\xfe"):
        saved.take(data, "broken.json")
    settle(desk, saved)
    assert desk.state.design == before.design
    assert desk.complaints
    assert all(each.startswith("broken.json") for each in desk.complaints)


def test_what_another_explorer_saves_appears(
    desk: Desk, saved: SavedDesigns, library: Library
) -> None:
    settle(desk, saved)
    Library(library.folder).save("theirs", OPTIMAL)
    saved.refresh()
    settle(desk, saved)
    assert names(saved) == ["theirs"]


def test_a_disk_that_is_full_is_told_and_loses_nothing(
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

    def show() -> dict[str, object]:
        settle(desk, saved)
        updates = panel.updates(Frame(desk.state))
        return {f"{id(handle)}{name}": value for handle, name, value in updates}

    shown = show()
    content = str(shown[f"{id(panel.list)}content"])
    assert "mine &lt;b&gt;" in content
    assert "<b>" not in content
    assert "20.42 units" in content
    assert "204.2 mm" in content
    assert shown[f"{id(panel.status)}content"]
    assert [row.name for row in panel.rows] == ["mine <b>", *PRESETS]
    assert content.count('data-press="designs.delete"') == 1

    desk.press(buttons, "designs.open", "paper-initial")
    assert desk.state.design == PRESETS["paper-initial"]
    desk.press(buttons, "designs.duplicate", "mine <b>")
    show()
    assert [row.name for row in panel.rows] == ["mine <b> copy", "mine <b>", *PRESETS]
    desk.press(buttons, "designs.duplicate", "paper-initial")
    show()
    desk.press(buttons, "designs.delete", "mine <b> copy")
    show()
    assert [row.name for row in panel.rows] == ["paper-initial copy", "mine <b>", *PRESETS]
    desk.click(panel.restore)
    show()
    assert next(row.name for row in panel.rows) == "mine <b> copy"
    # What is no longer in the list is not opened, and presets are not deleted.
    desk.press(buttons, "designs.open", "gone")
    desk.press(buttons, "designs.delete", "paper-initial")
    show()
    assert desk.complaints == []


def test_every_saved_design_can_be_reached_however_many_there_are(
    desk: Desk, saved: SavedDesigns, services: Services, buttons: Buttons, library: Library
) -> None:
    panel = DesignsPanel(services)
    many = 2 * ROWS + 3
    for number in range(many):
        library.save(f"design {number}", OPTIMAL)
    saved.refresh()

    def show() -> str:
        settle(desk, saved)
        updates = panel.updates(Frame(desk.state))
        return str(next(v for each, name, v in updates if (each, name) == (panel.list, "content")))

    content = show()
    assert f"1 to {ROWS} of {many + 2}" in content
    seen = [row.name for row in panel.rows]
    for _ in range(2):
        desk.press(buttons, "designs.turn", "older")
        content = show()
        seen += [row.name for row in panel.rows]
    assert f"{2 * ROWS + 1} to {many + 2} of {many + 2}" in content
    assert seen == [*(f"design {number}" for number in reversed(range(many))), *PRESETS]
    desk.press(buttons, "designs.open", "design 1")
    settle(desk, saved)
    assert desk.state.design.name == panel.rows[1].name == "design 1"
    # With what was on it the last part of the list goes.
    for number in range(3):
        saved.delete(f"design {number}")
    show()
    assert [row.name for row in panel.rows] == list(PRESETS)
    desk.press(buttons, "designs.turn", "newer")
    show()
    assert panel.rows[0].name == f"design {ROWS + many % ROWS - 1}"
    for number in range(3, ROWS + 5):
        saved.delete(f"design {number}")
    assert " of " not in show()
    assert [panel.rows[0].name, panel.rows[-1].name] == [f"design {many - 1}", list(PRESETS)[-1]]


def test_what_is_not_saved_cannot_be_renamed_and_is_told_so_in_short(
    desk: Desk, saved: SavedDesigns, library: Library
) -> None:
    for number in range(9):
        library.save(f"{number}" + "x" * 99, OPTIMAL)
    saved.rename("nobody's", "mine")
    settle(desk, saved)
    assert desk.complaints == ["the design is not saved yet; save it before you rename it"]
    saved.open("nobody's")
    settle(desk, saved)
    assert len(desk.complaints[1]) < 500


def test_files_of_no_use_are_listed_with_the_reason(library: Library, saved: SavedDesigns) -> None:
    library.save("good", OPTIMAL)
    (library.folder / "broken.json").write_text("{")
    rows = rows_of(library.list())
    assert [row.name for row in rows] == ["good", "broken.json", *PRESETS]
    assert rows[1].design is None
    assert rows[1].problem
