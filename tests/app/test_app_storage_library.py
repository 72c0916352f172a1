"""The library behaves as a dictionary, whatever the names, the files and other explorers."""

from __future__ import annotations

import os
import unicodedata
from collections.abc import Callable, Generator
from concurrent.futures import ThreadPoolExecutor
from functools import partial
from pathlib import Path

import msgspec
import pytest
from hypothesis import example, given, strategies as st
from killed import run_until_killed

from explorer.app.storage.library import MOST_DELETED, Entry, Library, copy_name, file_of
from explorer.errors import InputError, StorageError
from explorer.mechanism.design import Design
from explorer.mechanism.design_file import PRESETS, decode_design, encode_design

OPTIMAL = PRESETS["paper-optimal"]

HOSTILE = (
    "../../../etc/passwd", "C:\\Windows\\system32", "..", ".", "~", "NUL.json", ".lock", ".order",
    "trash", 'a/b\\c:d*e?f"g<h>i|j', "$(rm -rf ~)", "%00", "<b>bold</b>", "é", "δ1 = 0 ✓",
    "🦾" * 100,
)  # fmt: skip

REFUSED = ("", " ", "two\nlines", "nul\0", "x" * 101, "\ud800", "\u202e", "a\u2028b")


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


def problems(library: Library) -> list[Entry]:
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


def test_saved_designs_are_opened_and_listed_newest_first_although_clocks_were_set_back(
    library: Library,
) -> None:
    assert library.list() == ()
    for number, name in enumerate(("c", "a", " b ")):
        saved = library.save(name, design(number))
        assert saved == msgspec.structs.replace(design(number), name=name.strip())
        assert library.open(name) == library.open(name.strip()) == saved
        for path in library.folder.iterdir():
            os.utime(path, (1e9 - 1e6 * number, 1e9 - 1e6 * number))
    assert names(library) == ["b", "a", "c"]
    library.save("a", design(9), replace=True)
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
        gone = library.delete(name)
        assert library.list() == ()
        assert library.restore(gone.file).name == wanted
        library.delete(name)
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


def test_taken_name_is_refused_unless_the_design_is_to_be_replaced(library: Library) -> None:
    library.save("caf\u00e9", design(1))
    # Names that look the same are the same.
    with pytest.raises(InputError, match=r"replace it.*'café copy'"):
        library.save("cafe\u0301 ", design(3))
    library.save("café", design(1), replace=True)
    # The same design replaces nothing.
    assert library.deleted() == ()
    library.save("café", design(3), replace=True)
    (deleted,) = library.deleted()
    assert library.restore(deleted.file, "before").b2 == design(1).b2
    assert library.rename("café", " café ").name == "café"


def test_copies_have_numbered_names_of_at_most_100_characters() -> None:
    taken = {"a b copy", *(f"a b copy {number}" for number in range(2, 1000))}
    assert copy_name("a b", taken) == copy_name("a b copy 7", taken) == "a b copy 1000"
    assert copy_name("x" * 100, {"x" * 95 + " copy"}) == "x" * 93 + " copy 2"


def test_newest_deleted_designs_are_kept_and_can_be_restored(library: Library) -> None:
    for number in range(MOST_DELETED + 5):
        library.save("same", design(number))
        library.delete("same")
    deleted = library.deleted()
    assert [each.name for each in deleted] == ["same"] * MOST_DELETED
    assert library.restore(deleted[0].file).b2 == design(MOST_DELETED + 4).b2
    assert [each.file for each in library.deleted()] == [each.file for each in deleted[1:]]
    with pytest.raises(InputError, match="already"):
        library.restore(deleted[1].file)
    assert library.restore(deleted[1].file, "another").name == "another"
    for file in (deleted[0].file, "../" + deleted[2].file, "", "..", "\0"):
        with pytest.raises(InputError, match="not in the trash"):
            library.restore(file)
    library.delete("same")
    assert library.deleted()[0].name == "same"


def test_file_copied_into_the_folder_appears_by_the_name_inside(library: Library) -> None:
    library.save("own", design(1))
    copied = copy_in(library, "My Design (1).json", "theirs", 2)
    assert names(library) == ["own", "theirs"]
    assert library.open("theirs").b2 == design(2).b2
    # One that is replaced or renamed gets a file of the library's own.
    library.save("theirs", design(3), replace=True)
    assert not copied.exists()
    copy_in(library, "x.json", "fourth", 4)
    library.rename("fourth", "mine")
    files = {path.name for path in library.folder.glob("*.json")}
    assert files == {file_of(name) for name in ("own", "theirs", "mine")}
    # A file of the library precedes others with the same name.
    for file in ("0.json", "z.json"):
        copy_in(library, file, "own", 5)
    assert [each.file for each in problems(library)] == ["0.json", "z.json"]
    assert all("has the name 'own' too" in (each.problem or "") for each in problems(library))
    library.delete("0.json")
    assert library.open("own").b2 == design(1).b2
    assert [each.file for each in problems(library)] == ["z.json"]


BROKEN = {
    "empty.json": b"",
    "half.json": encode_design(OPTIMAL)[:100],
    "other.json": b'{"what": 1}',
    "bytes.json": bytes(range(256)),
    "deep.json": b"[" * 200_000,
    "large.json": b" " * 2_000_000,
    "degenerate.json": encode_design(OPTIMAL).replace(b"7.0062", b"0.0000"),
    "nameless.json": encode_design(msgspec.structs.replace(OPTIMAL, name=" ")),
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
    assert len(library.list()) == 1 + count - 3
    for deleted in library.deleted():
        with pytest.raises(InputError):
            library.restore(deleted.file)
    # An unusable file stays in the trash.
    assert len(library.deleted()) == 3


OPERATIONS = ("save", "replace", "rename", "duplicate", "delete", "restore", "open")
NAMES = ("a", "A", "á", "b/..", "a copy")


@given(
    st.lists(
        st.tuples(
            st.sampled_from(OPERATIONS),
            st.sampled_from(NAMES),
            st.sampled_from(NAMES),
            st.integers(0, 1),
        ),
        max_size=15,
    )
)
def test_two_explorers_see_one_dictionary(
    tmp_path_factory: pytest.TempPathFactory, operations: list[tuple[str, str, str, int]]
) -> None:
    folder = tmp_path_factory.mktemp("designs")
    libraries = Library(folder), Library(folder)
    known: dict[str, float] = {}
    trash: list[tuple[str, str, float]] = []
    for number, (act, name, other, who) in enumerate(operations):
        library, new = libraries[who], design(number)
        try:
            match act:
                case "save":
                    library.save(name, new)
                    assert name not in known
                    known[name] = new.b2
                case "replace":
                    library.save(name, new, replace=True)
                    if name in known:
                        trash.append((name, library.deleted()[0].file, known[name]))
                    known[name] = new.b2
                case "rename":
                    library.rename(name, other)
                    assert name == other or other not in known
                    known[other] = known.pop(name)
                case "duplicate":
                    copy = library.duplicate(name)
                    assert copy.name not in known
                    known[copy.name] = known[name]
                case "delete":
                    trash.append((name, library.delete(name).file, known.pop(name)))
                case "restore":
                    if trash:
                        was, file, value = trash[-1]
                        assert library.restore(file).name == was
                        assert was not in known
                        known[was] = value
                        trash.pop()
                case _:
                    assert library.open(name).b2 == known[name]
        except InputError:
            assert act != "replace"
            expected = {
                "save": name in known,
                "rename": name not in known or (other in known and other != name),
                "restore": bool(trash) and trash[-1][0] in known,
            }
            assert expected.get(act, name not in known)
        for each in libraries:
            assert {entry.name: entry.design.b2 for entry in each.list() if entry.design} == known
            assert [deleted.file for deleted in each.deleted()] == [
                file for _, file, _ in trash[::-1]
            ]


def test_designs_saved_by_many_threads_at_once_are_all_kept(
    library: Library, monkeypatch: pytest.MonkeyPatch
) -> None:
    # On a slow disk the last in the row waits long.
    monkeypatch.setattr("explorer.app.storage.folder.PATIENCE_SECONDS", 60.0)

    def work(worker: int) -> None:
        own = Library(library.folder)
        for number in range(3):
            own.save(f"{worker}-{number}", design(number))
            own.duplicate(f"{worker}-{number}")
            own.delete(f"{worker}-{number}")

    with ThreadPoolExecutor(4) as threads:
        list(threads.map(work, range(4)))
    assert sorted(names(library)) == sorted(f"{w}-{n} copy" for w in range(4) for n in range(3))


def full_disk(_: int) -> None:
    raise OSError(28, "No space left on device")


CHANGES: dict[str, Callable[[Library], object]] = {
    "save": lambda library: library.save("new", design(3)),
    "replace": lambda library: library.save("mine", design(3), replace=True),
    "rename": lambda library: library.rename("mine", "new"),
    "duplicate": lambda library: library.duplicate("mine"),
    "delete": lambda library: library.delete("mine"),
    "restore": lambda library: library.restore(library.deleted()[0].file),
}


@pytest.fixture
def filled(library: Library) -> Library:
    """A library with a design, and another one in its trash."""
    library.save("gone", design(2))
    library.delete("gone")
    library.save("mine", design(1))
    return library


@pytest.mark.parametrize("act", [act for act in CHANGES if act != "delete"])
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
    start = contents(filled)
    writes, is_killed = 0, True
    while is_killed:
        is_killed = run_until_killed(partial(CHANGES[act], filled), writes)
        found = Library(filled.folder)
        there = {entry.design.b2 for entry in found.list() if entry.design}
        restored = {found.restore(each.file, f"back {each.file}").b2 for each in found.deleted()}
        assert {design(1).b2, design(2).b2} <= there | restored
        assert problems(found) == []
        # A half-written file is gone after the next write.
        found.save("next", OPTIMAL)
        assert not [path for path in contents(filled) if path.endswith(".part")]
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
    assert library.list() == library.deleted() == ()
    with pytest.raises(StorageError, match="a file lies where") as refusal:
        library.save("mine", OPTIMAL)
    assert "\n" not in str(refusal.value)
