"""The user's designs on the page: saved, opened, copied, renamed, deleted and brought back."""

from __future__ import annotations

from collections.abc import Generator
from pathlib import Path

import msgspec
import pytest
import viser
from desk import Desk

from explorer.app.features.designs.panel import ROWS, DesignsPanel, rows_of
from explorer.app.features.designs.shelf import Shelf
from explorer.app.session.session import UNDO
from explorer.app.state.actions import MarkSaved, Open, SetName, SetUnit, SetVariable
from explorer.app.state.frame import Frame
from explorer.app.storage.library import Library
from explorer.errors import InputError, StorageError
from explorer.mechanism.design_file import PRESETS, encode_design

OPTIMAL = PRESETS["paper-optimal"]


@pytest.fixture
def library(tmp_path: Path) -> Library:
    return Library(tmp_path / "designs")


@pytest.fixture
def shelf(desk: Desk, library: Library) -> Generator[Shelf]:
    made = Shelf(library, desk.session, lambda message, _: desk.complaints.append(message))
    yield made
    made.stop()


def settle(desk: Desk, shelf: Shelf) -> None:
    assert shelf.wait_until_idle()
    assert desk.session.wait_until_idle()


def names(shelf: Shelf) -> list[str]:
    return [entry.name for entry in shelf.entries]


def save_as(desk: Desk, shelf: Shelf, name: str) -> None:
    desk.session.do(SetName(name))
    shelf.save(desk.state.design)
    settle(desk, shelf)


def test_a_design_is_saved_under_its_name_and_reset_returns_to_it(
    desk: Desk, shelf: Shelf, library: Library
) -> None:
    desk.session.do(SetVariable("a3x", 15.0))
    save_as(desk, shelf, "mine")
    assert library.open("mine") == desk.state.design == desk.state.base
    assert names(shelf) == ["mine"]
    assert desk.complaints == []


def test_saving_again_keeps_what_is_replaced(desk: Desk, shelf: Shelf, library: Library) -> None:
    save_as(desk, shelf, "mine")
    first = desk.state.design
    shelf.save(first)
    settle(desk, shelf)
    assert library.deleted() == ()
    desk.session.do(SetUnit(3.0))
    save_as(desk, shelf, "mine")
    assert library.open("mine").unit_mm == 3.0
    shelf.restore()
    settle(desk, shelf)
    assert library.open("mine copy") == msgspec.structs.replace(first, name="mine copy")


def test_presets_stay_as_they_are(desk: Desk, shelf: Shelf) -> None:
    shelf.save(desk.state.design)
    settle(desk, shelf)
    assert names(shelf) == []
    assert desk.complaints == [
        "'paper-optimal' is a preset and stays as it is; give yours another name"
    ]
    shelf.save_copy(desk.state.design)
    settle(desk, shelf)
    assert names(shelf) == [desk.state.design.name] == ["paper-optimal copy"]


def test_renaming_and_deleting_and_bringing_back(desk: Desk, shelf: Shelf) -> None:
    save_as(desk, shelf, "mine")
    shelf.rename("mine", "yours")
    settle(desk, shelf)
    assert names(shelf) == [desk.state.base.name] == ["yours"]
    shelf.duplicate("yours")
    settle(desk, shelf)
    shelf.delete("yours")
    settle(desk, shelf)
    assert names(shelf) == ["yours copy"]
    shelf.restore()
    settle(desk, shelf)
    assert sorted(names(shelf)) == ["yours", "yours copy"]
    shelf.restore()
    settle(desk, shelf)
    assert desk.complaints == ["nothing has been deleted"]


def test_opening_is_a_step_that_can_be_undone(desk: Desk, shelf: Shelf) -> None:
    save_as(desk, shelf, "mine")
    desk.session.do(Open(PRESETS["paper-initial"]))
    shelf.open("mine")
    settle(desk, shelf)
    assert desk.state.design.name == "mine"
    desk.session.travel(UNDO)
    assert desk.state.design.name == "paper-initial"
    shelf.open("nobody's")
    settle(desk, shelf)
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
    desk: Desk, shelf: Shelf, library: Library, tmp_path: Path
) -> None:
    named = msgspec.structs.replace(OPTIMAL, name="../../evil")
    shelf.take(encode_design(named), "../../evil.json")
    settle(desk, shelf)
    assert desk.state.design == named
    save_as(desk, shelf, "../../evil")
    assert library.open("../../evil").name == "../../evil"
    # Beside the designs' own folder there is nothing new.
    assert [each.name for each in tmp_path.iterdir()] == ["designs"]
    before = desk.state
    for data in (b"", b"{", b"[" * 10000, b'{"schema": 1, "a3": [1, 2, 3]}', b"\xff\xfe"):
        shelf.take(data, "broken.json")
    settle(desk, shelf)
    assert desk.state.design == before.design
    assert desk.complaints
    assert all(each.startswith("broken.json") for each in desk.complaints)


def test_what_another_explorer_saves_appears(desk: Desk, shelf: Shelf, library: Library) -> None:
    settle(desk, shelf)
    Library(library.folder).save("theirs", OPTIMAL)
    shelf.refresh()
    settle(desk, shelf)
    assert names(shelf) == ["theirs"]


def test_a_disk_that_is_full_is_told_and_loses_nothing(
    desk: Desk, shelf: Shelf, library: Library, monkeypatch: pytest.MonkeyPatch
) -> None:
    save_as(desk, shelf, "mine")
    kept = library.open("mine")

    def full(*_: object, **__: object) -> None:
        raise StorageError("cannot write: the disk is full; free some space")

    monkeypatch.setattr("explorer.app.storage.library.write_whole", full)
    desk.session.do(SetUnit(3.0))
    save_as(desk, shelf, "mine")
    assert desk.complaints == ["cannot write: the disk is full; free some space"]
    monkeypatch.undo()
    assert library.open("mine") == kept
    assert desk.state.design.unit_mm == 3.0
    assert desk.state.base == kept


def test_the_panel_lists_opens_copies_and_deletes(
    desk: Desk, shelf: Shelf, server: viser.ViserServer
) -> None:
    panel = DesignsPanel(server.gui, desk.session, shelf, lambda _: None)
    save_as(desk, shelf, "mine <b>")

    def show() -> dict[str, object]:
        settle(desk, shelf)
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
    visible = [shown[f"{id(button)}visible"] for button in panel.delete]
    assert visible == [True] + [False] * (ROWS - 1)

    initial = [row.name for row in panel.rows].index("paper-initial")
    desk.click(panel.open[initial])
    assert desk.state.design == PRESETS["paper-initial"]
    desk.click(panel.duplicate[0])
    show()
    assert [row.name for row in panel.rows] == ["mine <b> copy", "mine <b>", *PRESETS]
    desk.click(panel.duplicate[initial + 1])
    show()
    desk.click(panel.delete[1])
    show()
    assert [row.name for row in panel.rows] == ["paper-initial copy", "mine <b>", *PRESETS]
    desk.click(panel.restore)
    show()
    assert next(row.name for row in panel.rows) == "mine <b> copy"
    # Beyond the list there is nothing to push.
    desk.click(panel.open[ROWS - 1])
    show()
    assert desk.complaints == []


def test_every_saved_design_can_be_reached_however_many_there_are(
    desk: Desk, shelf: Shelf, server: viser.ViserServer, library: Library
) -> None:
    panel = DesignsPanel(server.gui, desk.session, shelf, lambda _: None)
    many = 2 * ROWS + 3
    for number in range(many):
        library.save(f"design {number}", OPTIMAL)
    shelf.refresh()

    def show() -> str:
        settle(desk, shelf)
        updates = panel.updates(Frame(desk.state))
        return str(next(v for each, name, v in updates if (each, name) == (panel.list, "content")))

    content = show()
    assert f"1 to {ROWS} of {many + 2}" in content
    seen = [row.name for row in panel.rows]
    for _ in range(2):
        desk.click(panel.older)
        content = show()
        seen += [row.name for row in panel.rows]
    assert f"{2 * ROWS + 1} to {many + 2} of {many + 2}" in content
    assert seen == [*(f"design {number}" for number in reversed(range(many))), *PRESETS]
    desk.click(panel.open[1])
    settle(desk, shelf)
    assert desk.state.design.name == panel.rows[1].name == "design 1"
    # With what was on it the last part of the list goes.
    for number in range(3):
        shelf.delete(f"design {number}")
    show()
    assert [row.name for row in panel.rows] == list(PRESETS)
    desk.click(panel.newer)
    show()
    assert panel.rows[0].name == f"design {ROWS + many % ROWS - 1}"
    for number in range(3, ROWS + 5):
        shelf.delete(f"design {number}")
    assert " of " not in show()
    assert [panel.rows[0].name, panel.rows[-1].name] == [f"design {many - 1}", list(PRESETS)[-1]]


def test_what_is_not_saved_cannot_be_renamed_and_is_told_so_in_short(
    desk: Desk, shelf: Shelf, library: Library
) -> None:
    for number in range(9):
        library.save(f"{number}" + "x" * 99, OPTIMAL)
    shelf.rename("nobody's", "mine")
    settle(desk, shelf)
    assert desk.complaints == ["the design is not saved yet, so no file has its name: Save it"]
    shelf.open("nobody's")
    settle(desk, shelf)
    assert len(desk.complaints[1]) < 500


def test_files_of_no_use_are_listed_with_the_reason(library: Library, shelf: Shelf) -> None:
    library.save("good", OPTIMAL)
    (library.folder / "broken.json").write_text("{")
    rows = rows_of(library.list())
    assert [row.name for row in rows] == ["good", "broken.json", *PRESETS]
    assert rows[1].design is None
    assert rows[1].problem
