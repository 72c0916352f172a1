"""Atomic writing of files: what is forced to the disk, and the messages of failures."""

from __future__ import annotations

import errno
import os
import stat
import sys
import threading
from pathlib import Path

import pytest
from refusals import refusal

from explorer.errors import DesignError, StorageError
from explorer.files.writing import check_writable, make_folder, move, read_at_most, write_whole
from explorer.mechanism.design_file import load_design

REMEDIES = {
    errno.ENOSPC: "make room",
    errno.EDQUOT: "quota",
    errno.EFBIG: "larger files",
    errno.EACCES: "may write",
    errno.EPERM: "may write",
    errno.EROFS: "can be written",
    errno.EIO: "cannot write",
}


def contents(folder: Path) -> dict[str, bytes]:
    return {path.name: path.read_bytes() for path in folder.iterdir()}


@pytest.mark.parametrize("step", ["open", "fsync", "replace"])
def test_write_failure_leaves_the_old_file_and_names_the_remedy(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch, step: str
) -> None:
    path = tmp_path / "file"
    path.write_bytes(b"old")

    for code, remedy in REMEDIES.items():

        def fail(*_: object, code: int = code, **__: object) -> None:
            raise OSError(code, os.strerror(code))

        with monkeypatch.context() as patch:
            patch.setattr(os if step == "fsync" else Path, step, fail)
            message = refusal(write_whole, path, b"new", kind=StorageError)
        assert all(words in message for words in (remedy, os.strerror(code), repr(str(path))))
        assert contents(tmp_path) == {"file": b"old"}


@pytest.mark.skipif(sys.platform == "win32", reason="folders cannot be forced to the disk there")
def test_write_forces_the_file_then_the_folder_to_the_disk(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    path, forced = tmp_path / "file", list[tuple[bool, bool]]()
    usual = os.fsync

    def fsync(descriptor: int) -> None:
        is_folder = stat.S_ISDIR(os.fstat(descriptor).st_mode)
        # The file has its contents but not its name yet; the folder has the name.
        forced.append((is_folder, path.exists()))
        if not is_folder:
            assert os.fstat(descriptor).st_size == 3
        usual(descriptor)

    monkeypatch.setattr(os, "fsync", fsync)
    write_whole(path, b"new")
    assert forced == [(False, False), (True, True)]


def test_write_during_reads_shows_the_old_file_or_the_new_one(tmp_path: Path) -> None:
    path = tmp_path / "file"
    whole = [bytes([number]) * (10_000 + number) for number in range(50)]
    write_whole(path, whole[0])
    seen, is_done = set[bytes](), threading.Event()

    def read() -> None:
        # At least one read takes place even if the thread starts late.
        seen.add(path.read_bytes())
        while not is_done.is_set():
            seen.add(path.read_bytes())

    thread = threading.Thread(target=read)
    thread.start()
    for data in whole:
        write_whole(path, data)
    is_done.set()
    thread.join()
    assert seen
    assert seen <= {*whole}


@pytest.mark.parametrize("name", ["x" * 300, "nul\0", "é" * 200])
def test_path_names_that_no_system_takes_are_refused(tmp_path: Path, name: str) -> None:
    path = tmp_path / name
    refusal(write_whole, path, b"", kind=StorageError)
    refusal(read_at_most, path, 3, kind=StorageError)
    for action in (check_writable, make_folder):
        refusal(action, path, kind=StorageError)
    assert contents(tmp_path) == {}


@pytest.mark.parametrize("name", ["x" * 255, "é" * 127, "🦾" * 63])
def test_path_names_of_greatest_length_are_written(tmp_path: Path, name: str) -> None:
    write_whole(tmp_path / name, b"new")
    assert contents(tmp_path) == {name: b"new"}


def test_read_of_larger_missing_or_odd_file_is_refused(tmp_path: Path) -> None:
    path = tmp_path / "file"
    path.write_bytes(b"1234")
    assert read_at_most(path, 4) == b"1234"
    assert "larger than 3 bytes" in refusal(read_at_most, path, 3, kind=StorageError)
    missing = tmp_path / "missing"
    assert "No such file" in refusal(read_at_most, missing, 3, kind=StorageError)
    odd = [tmp_path, Path(os.devnull)]
    if hasattr(os, "mkfifo"):
        os.mkfifo(tmp_path / "pipe")
        odd.append(tmp_path / "pipe")
    for each in odd:
        assert "no plain file" in refusal(read_at_most, each, 3, kind=StorageError)


def test_folder_is_made_for_its_owner_alone(tmp_path: Path) -> None:
    folder = tmp_path / "one" / "two"
    make_folder(folder)
    make_folder(folder)
    assert folder.is_dir()
    if sys.platform != "win32":
        assert folder.stat().st_mode & 0o077 == 0
    (tmp_path / "file").write_bytes(b"")
    for path in (tmp_path / "file", tmp_path / "file" / "folder"):
        assert "a file lies where" in refusal(make_folder, path, kind=StorageError)


def test_move_replaces_the_target_and_refuses_a_missing_source(tmp_path: Path) -> None:
    (tmp_path / "one").write_bytes(b"1")
    (tmp_path / "two").write_bytes(b"2")
    move(tmp_path / "one", tmp_path / "two")
    assert contents(tmp_path) == {"two": b"1"}
    source, target = tmp_path / "one", tmp_path / "two"
    assert "No such file" in refusal(move, source, target, kind=StorageError)
    assert contents(tmp_path) == {"two": b"1"}


def test_write_to_a_link_replaces_its_target(tmp_path: Path) -> None:
    target, link = tmp_path / "target", tmp_path / "link"
    target.write_bytes(b"old")
    link.symlink_to(target)
    write_whole(link, b"new")
    assert link.is_symlink()
    assert target.read_bytes() == b"new"


@pytest.mark.parametrize(("name", "target"), [("gone", "missing/file"), ("circle", "circle")])
def test_link_that_leads_nowhere_is_named_with_its_target(
    tmp_path: Path, name: str, target: str
) -> None:
    link, below = tmp_path / name, tmp_path / name / "file"
    link.symlink_to(target)
    for path, subject in ((link, "it"), (below, repr(str(link)))):
        words = f"{subject} is a link that leads nowhere, to {target!r}: mend or remove it"
        for message in (
            refusal(check_writable, path, kind=StorageError),
            refusal(write_whole, path, b"new", kind=StorageError),
            refusal(read_at_most, path, 3, kind=StorageError),
            refusal(make_folder, path, kind=StorageError),
            refusal(load_design, str(path), kind=DesignError),
        ):
            assert message.endswith(f"{str(path)!r}: {words}")
    assert [each.name for each in tmp_path.iterdir()] == [name]
    assert link.is_symlink()


@pytest.mark.skipif(sys.platform == "win32", reason="Windows has no such modes")
@pytest.mark.parametrize("mode", [0o600, 0o640, 0o755, 0o444])
def test_written_file_keeps_the_mode_of_the_one_that_it_replaces(tmp_path: Path, mode: int) -> None:
    path, link, fresh = (tmp_path / name for name in ("file", "link", "fresh"))
    path.write_bytes(b"old")
    path.chmod(mode)
    link.symlink_to(path)
    for data, written in ((b"new", path), (b"newer", link)):
        write_whole(written, data)
        assert path.read_bytes() == data
        assert stat.S_IMODE(path.stat().st_mode) == mode
    (tmp_path / "other").touch()
    write_whole(fresh, b"")
    assert fresh.stat().st_mode == (tmp_path / "other").stat().st_mode


def test_write_to_a_link_makes_its_missing_target(tmp_path: Path) -> None:
    link = tmp_path / "link"
    link.symlink_to("target")
    write_whole(link, b"new")
    assert link.is_symlink()
    assert (tmp_path / "target").read_bytes() == b"new"
