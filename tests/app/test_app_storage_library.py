"""The library behaves as a dictionary, whatever the names, the files and other explorers."""

from __future__ import annotations

import os
import unicodedata
from collections.abc import Callable, Generator
from functools import partial
from pathlib import Path

import msgspec
import pytest
from hypothesis import example, given, strategies as st
from killed import run_until_killed

from explorer.app.storage.library import Library, LibraryFile, copy_name, file_of
from explorer.errors import InputError, StorageError
from explorer.mechanism.design import Design
from explorer.mechanism.design_file import PRESETS, decode_design, encode_design

OPTIMAL = PRESETS["paper-optimal"]

HOSTILE = (
    "../../../etc/passwd", "C:\\Windows\\system32", "..x", "~", "NUL.json", ".lock",
    "trash", 'a/b\\c:d*e?f"g<h>i|j', "$(rm -rf ~)", "%00", "<b>bold</b>", "é", "δ1 = 0 ✓",
    "🦾" * 100,
)  # fmt: skip

REFUSED = ("", " ", "..", ". .", "two\nlines", "nul\0", "x" * 101, "\ud800", "\u202e", "a\u2028b")


def design(number: int) -> Design:
    return msgspec.structs.replace(OPTIMAL, b2=1.0 + 0.125 * number)


def names(library: Library) -> list[str]:
    """Return the names in a library, all of whose files can be used."""
    entries = library.list()
    assert all(each.problem is None for each in entries)
    return [each.name for each in entries]


def contents(library: Library) -> dict[str, bytes]:
    """Return the contents of all files of a library, the trash included, by path."""
    files = [path for path in library.folder.rglob("*") if path.is_file()]
    return {str(path): path.read_bytes() for path in files}


def copy_in(library: Library, file: str, name: str, number: int) -> Path:
    """Write a design into a file of the library as a user does by hand."""
    path = library.folder / file
    path.write_bytes(encode_design(msgspec.structs.replace(design(number), name=name)))
    return path


def problems(library: Library) -> list[LibraryFile]:
    return [each for each in library.list() if each.problem is not None]


@pytest.fixture(autouse=True, scope="module")
def _without_fsync() -> Generator[None]:  # pyright: ignore[reportUnusedFunction]
    """Save the time that forcing to the disk takes; no power fails here."""

    def return_at_once(_: int) -> None:
        pass

    with pytest.MonkeyPatch.context() as patch:
        patch.setattr(os, "fsync", return_at_once)
        yield


@pytest.fixture
def library(tmp_path: Path) -> Library:
    return Library(tmp_path / "data" / "designs")


def test_saved_designs_are_opened_and_listed_newest_first(library: Library) -> None:
    assert library.list() == ()
    for number, name in enumerate(("c", "a", " b ")):
        saved = library.save(name, design(number))
        assert saved == msgspec.structs.replace(design(number), name=name.strip())
        assert library.open(name) == library.open(name.strip()) == saved
    assert names(library) == ["b", "a", "c"]
    library.save("a", design(9))
    assert names(library) == ["a", "b", "c"]
    # Each file is a design file as any other.
    for entry in library.list():
        assert decode_design((library.folder / entry.file).read_bytes(), "file") == entry.design


def test_hostile_name_is_never_a_path(library: Library) -> None:
    outside = library.folder.parent
    for name in HOSTILE:
        library.save(name, OPTIMAL)
        wanted = unicodedata.normalize("NFC", name)
        assert names(library) == [wanted]
        assert library.open(name).name == wanted
        (file,) = (path for path in library.folder.iterdir() if path.suffix == ".json")
        assert file.name == file_of(wanted)
        library.delete(name)
        assert library.list() == ()
        library.restore()
        assert names(library) == [wanted]
        library.delete(name)
        (library.folder / "trash" / file.name).unlink()
        assert [path.name for path in outside.iterdir()] == ["designs"]


@pytest.mark.parametrize("name", REFUSED)
def test_unusable_name_is_refused_in_one_line(library: Library, name: str) -> None:
    library.save("mine", OPTIMAL)
    for refused in (lambda: library.save(name, OPTIMAL), lambda: library.rename("mine", name)):
        with pytest.raises(InputError, match="printable line of 1 to 100") as refusal:
            refused()
        assert len(str(refusal.value).splitlines()) == 1
    with pytest.raises(InputError, match="no design is called") as refusal:
        library.open(name)
    assert str(refusal.value).isprintable()
    assert names(library) == ["mine"]


@given(st.text(max_size=100), st.text(max_size=100))
@example("Mine", "mine")
@example("a b", "a-b")
@example("é", "e")
@example("İ", "i")
@example("ß", "ss")
@example("x" * 99 + "a", "x" * 99 + "b")
def test_different_names_have_different_files_on_any_system(one: str, other: str) -> None:
    for name in (one, other):
        file = file_of(name)
        assert file.isascii()
        assert len(file) <= 64
        assert {*file} <= {*"abcdefghijklmnopqrstuvwxyz0123456789-."}
        assert file[0].isalnum()
        assert Path(file).name == file
        assert file.endswith(".json")
    # Also where the system does not tell capitals from small letters.
    assert (file_of(one).casefold() == file_of(other).casefold()) == (one == other)


def test_replaced_design_can_be_brought_back_and_a_taken_name_is_refused(library: Library) -> None:
    library.save("caf\u00e9", design(1))
    # The same design replaces nothing; names that look the same are the same.
    library.save("cafe\u0301 ", design(1))
    assert library.last_deleted is None
    library.save("café", design(3))
    assert library.last_deleted == "café"
    library.restore()
    assert {name: library.open(name).b2 for name in names(library)} == {
        "café": design(3).b2,
        "café copy": design(1).b2,
    }
    assert library.last_deleted is None
    assert library.rename("café", " café ").name == "café"
    with pytest.raises(InputError, match="'café copy' already"):
        library.rename("café", "café copy")


def test_last_deleted_is_brought_back_first_and_of_a_name_the_last_one(library: Library) -> None:
    for number, name in enumerate(("a", "b", "a")):
        library.save(name, design(number))
        library.delete(name)
        assert library.last_deleted == name
    for expected in ({"a": design(2).b2}, {"a": design(2).b2, "b": design(1).b2}):
        library.restore()
        assert {name: library.open(name).b2 for name in names(library)} == expected
    with pytest.raises(InputError, match="nothing has been deleted"):
        library.restore()


def test_copies_have_numbered_names_of_at_most_100_characters() -> None:
    taken = {"a b copy", *(f"a b copy {number}" for number in range(2, 1000))}
    assert copy_name("a b", taken) == copy_name("a b copy 7", taken) == "a b copy 1000"
    assert copy_name("x" * 100, {"x" * 95 + " copy"}) == "x" * 93 + " copy 2"


def test_file_copied_into_the_folder_appears_by_the_name_inside(library: Library) -> None:
    library.save("own", design(1))
    copied = copy_in(library, "My Design (1).json", "theirs", 2)
    assert names(library) == ["theirs", "own"]
    assert library.open("theirs").b2 == design(2).b2
    # One that is replaced keeps its file, one that is renamed gets a file of the library's own.
    library.save("theirs", design(3))
    assert decode_design(copied.read_bytes(), "file").b2 == design(3).b2
    copy_in(library, "x.json", "fourth", 4)
    library.rename("fourth", "mine")
    files = {path.name for path in library.folder.glob("*.json")}
    assert files == {file_of(name) for name in ("own", "mine")} | {copied.name}
    # Of files with the same name the newest counts.
    copy_in(library, "0.json", "own", 5)
    assert library.open("own").b2 == design(5).b2
    (old,) = problems(library)
    assert old.file == file_of("own")
    assert "has the name 'own' too" in (old.problem or "")
    library.delete(old.name)
    assert library.open("own").b2 == design(5).b2
    assert problems(library) == []


BROKEN = {
    "empty.json": b"",
    "half.json": encode_design(OPTIMAL)[:100],
    "other.json": b'{"what": 1}',
    "bytes.json": bytes(range(256)),
    "deep.json": b"[" * 200_000,
    "large.json": b" " * 2_000_000,
    "degenerate.json": encode_design(OPTIMAL).replace(b"7.0062", b"0.0000"),
    "nameless.json": encode_design(OPTIMAL).replace(b"paper-optimal", b" "),
    "odd \x1b[31m\n.json": b"{}",
    "x" * 245 + ".json": b"{}",
}


def test_unusable_files_are_listed_with_a_reason_and_can_be_deleted(library: Library) -> None:
    library.save("good", OPTIMAL)
    for file, data in BROKEN.items():
        (library.folder / file).write_bytes(data)
    (library.folder / "folder.json").mkdir()
    (library.folder / "gone.json").symlink_to(library.folder / "nowhere")
    count = len(BROKEN) + 2
    if hasattr(os, "mkfifo"):
        os.mkfifo(library.folder / "pipe.json")
        count += 1
    good, *others = library.list()
    assert (good.name, good.problem) == ("good", None)
    assert len(others) == count
    for entry in others:
        assert entry.design is None
        assert entry.name.isprintable()
        assert entry.problem
        assert entry.problem.isprintable()
        with pytest.raises(InputError, match="cannot be opened"):
            library.open(entry.name)
    for entry in others[:3]:
        library.delete(entry.name)
        assert library.last_deleted == entry.name
        assert len(library.list()) == count
        library.restore()
        assert sorted(each.file for each in library.list()[1:]) == sorted(e.file for e in others)
    # Another file has come in its place.
    library.delete("empty.json")
    (library.folder / "empty.json").write_bytes(b"")
    with pytest.raises(InputError, match="lies in"):
        library.restore()


NAMES = ("a", "A", "á", "b/..", "a copy")


def full_disk(_: int) -> None:
    raise OSError(28, "No space left on device")


CHANGES: dict[str, Callable[[Library], object]] = {
    "save": lambda library: library.save("new", design(3)),
    "replace": lambda library: library.save("mine", design(3)),
    "rename": lambda library: library.rename("mine", "new"),
    "delete": lambda library: library.delete("mine"),
    "restore": lambda library: library.restore(),
    "restore as a copy": lambda library: library.restore(),
}


@pytest.fixture
def filled(library: Library) -> Library:
    """A library with a design, and another one in its trash."""
    library.save("gone", design(2))
    library.delete("gone")
    library.save("mine", design(1))
    return library


@pytest.mark.parametrize("act", ["save", "replace", "rename"])
def test_write_that_fails_changes_nothing(
    filled: Library, monkeypatch: pytest.MonkeyPatch, act: str
) -> None:
    before = contents(filled)
    monkeypatch.setattr("os.fsync", full_disk)
    with pytest.raises(StorageError, match="make room"):
        CHANGES[act](filled)
    assert contents(filled) == before


@pytest.mark.parametrize("act", CHANGES)
def test_kill_between_any_two_writes_loses_no_design(filled: Library, act: str) -> None:
    if act == "restore as a copy":
        filled.save("gone", design(4))
    start = contents(filled)
    writes, is_killed = 0, True
    while is_killed:
        is_killed = run_until_killed(partial(CHANGES[act], filled), writes)
        kept = [each for path, each in contents(filled).items() if path.endswith(".json")]
        assert {design(1).b2, design(2).b2} <= {decode_design(each, "").b2 for each in kept}
        assert problems(filled) == []
        for path in contents(filled):
            Path(path).unlink()
        for path, data in start.items():
            Path(path).write_bytes(data)
        writes += 1
    assert writes > 1


def test_file_in_place_of_the_folder_is_reported_in_one_line(tmp_path: Path) -> None:
    assert Library().folder == Path(os.environ["EXPLORER_DATA"]) / "designs"
    (tmp_path / "file").write_bytes(b"")
    library = Library(tmp_path / "file")
    assert (library.list(), library.last_deleted) == ((), None)
    with pytest.raises(StorageError, match="a file lies where") as refusal:
        library.save("mine", OPTIMAL)
    assert "\n" not in str(refusal.value)
