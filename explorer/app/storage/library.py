"""Designs by name, in the user's data folder; each is a design file of its own.

A name is never a path: the name of a file is made of a part of the design's name and a hash, and
the design's name itself is in the file. So design files that are copied into the folder by hand
appear too. Several explorers may share the folder; each sees the changes of the others.
"""

from __future__ import annotations

import contextlib
import hashlib
import re
import unicodedata
from dataclasses import dataclass
from pathlib import Path
from typing import Annotated

import msgspec

from explorer.app.storage.folder import data_folder, lock_folder, plain_words
from explorer.errors import InputError, StorageError
from explorer.files.writing import make_folder, move, read_at_most, write_whole
from explorer.mechanism.design import Design
from explorer.mechanism.design_file import LARGEST_FILE, decode_design, encode_design

DESIGNS = "designs"
"""Name of the folder of designs in the user's data folder."""

TRASH = "trash"
"""Name of the folder of deleted designs in the folder of designs."""

MOST_DELETED = 20
"""Largest number of deleted designs that are kept; the newest are."""

LONGEST_NAME = 100

# File of the numbers by which designs are ordered, the newest last.
_ORDER = ".order"
# Number of characters of a design's name in its file's name, and of digits of the hash.
_SLUG, _DIGITS = 40, 12
# Number of characters of a file's name that it keeps in the trash, after a number.
_ENDING = 60

# Suffix of the name of a copy.
_COPY = re.compile(r" copy( \d+)?$")

_Order = dict[str, Annotated[int, msgspec.Meta(ge=0, le=2**53)]]


@dataclass(frozen=True)
class Entry:
    """A file in the library.

    Attributes:
        name: Name of the design; of the file if it holds no usable design.
        file: Name of the file.
        design: The design; None if it cannot be used.
        problem: Why it cannot be used; None if it can.
        generation: A number larger than those of all designs saved before; 0 if unknown.
    """

    name: str
    file: str
    design: Design | None
    problem: str | None = None
    generation: int = 0


@dataclass(frozen=True)
class Deleted:
    """A design that was deleted and is still kept.

    Attributes:
        name: Name that it had; name of the file if it holds no usable design.
        file: Name of the file in the trash, the argument of `restore`.
    """

    name: str
    file: str


class Library:
    """The user's named designs.

    Args:
        folder: The folder of designs; that in the user's data folder if None.
    """

    def __init__(self, folder: Path | None = None) -> None:
        self.folder = data_folder() / DESIGNS if folder is None else folder

    def list(self) -> tuple[Entry, ...]:
        """Return all entries: the design saved last first, unusable files last."""
        order = self._order()
        entries: dict[str, Entry] = {}
        problems: list[Entry] = []
        # A file that the library wrote takes precedence over one copied in with the same name.
        files = [_read(path, order) for path in _files(self.folder)]
        for entry in sorted(files, key=lambda each: each.file != file_of(each.name)):
            if entry.problem is not None:
                problems.append(entry)
            elif entry.name in entries:
                other = entries[entry.name].file
                reason = f"{other!r} has the name {entry.name!r} too; change it in one of them"
                problems.append(Entry(entry.file, entry.file, None, reason))
            else:
                entries[entry.name] = entry
        good = sorted(entries.values(), key=lambda each: (-each.generation, each.name))
        return (*good, *sorted(problems, key=lambda each: each.file))

    def open(self, name: str) -> Design:
        """Return the design with a name.

        Raises:
            InputError: there is no such design, or its file cannot be used.
        """
        return _design_of(self._entry(name))

    def save(self, name: str, design: Design, *, replace: bool = False) -> Design:
        """Save a design under a name; return the design with this name.

        Args:
            name: One printable line of at most 100 characters; surrounding space is removed.
            design: The design.
            replace: Whether to replace a design with this name; the old one goes to the trash
                unless both are the same.

        Raises:
            InputError: a name that cannot be used, or that another design has.
            StorageError: it cannot be written.
        """
        named = _with_name(design, name)
        with lock_folder(self.folder):
            if replace:
                self._copy_to_trash(named)
            else:
                self._check_free(named.name)
            self._write(named)
        return named

    def duplicate(self, name: str) -> Design:
        """Save a design of the library again, as "… copy".

        Raises:
            InputError: there is no such design.
            StorageError: it cannot be written.
        """
        with lock_folder(self.folder):
            design = _design_of(self._entry(name))
            taken = {each.name for each in self.list()}
            copy = _with_name(design, copy_name(design.name, taken))
            self._write(copy)
        return copy

    def rename(self, name: str, new: str) -> Design:
        """Give a design of the library another name.

        Raises:
            InputError: there is no such design, or the new name cannot be used.
            StorageError: it cannot be written.
        """
        with lock_folder(self.folder):
            entry = self._entry(name)
            renamed = _with_name(_design_of(entry), new)
            if renamed.name == entry.name:
                return renamed
            self._check_free(renamed.name)
            # A process killed in between leaves the design under both names, never under none.
            self._write(renamed)
            with contextlib.suppress(FileNotFoundError):
                (self.folder / entry.file).unlink()
        return renamed

    def delete(self, name: str) -> Deleted:
        """Move a design, or an unusable file by the file's name, to the trash.

        Raises:
            InputError: there is no such design.
            StorageError: it cannot be moved.
        """
        with lock_folder(self.folder):
            entry = self._entry(name)
            place = self._place_in_trash(entry)
            move(self.folder / entry.file, place)
            self._empty_trash()
        return Deleted(entry.name, place.name)

    def deleted(self) -> tuple[Deleted, ...]:
        """Return the designs in the trash, the one deleted last first."""
        return tuple(Deleted(_name_in(path), path.name) for path in reversed(_files(self._trash)))

    def restore(self, file: str, name: str | None = None) -> Design:
        """Bring a deleted design back.

        Args:
            file: Name of the file in the trash.
            name: New name of the design; its old one if None.

        Raises:
            InputError: it is not in the trash, cannot be used, or its name is taken.
            StorageError: it cannot be written.
        """
        with lock_folder(self.folder):
            # Looked up, so that no argument is used as a path.
            path = next((each for each in _files(self._trash) if each.name == file), None)
            if path is None:
                raise InputError(f"{file!r} is not in the trash any more")
            design = _design_of(_read(path, {}))
            restored = _with_name(design, design.name if name is None else name)
            self._check_free(restored.name)
            self._write(restored)
            path.unlink(missing_ok=True)
        return restored

    @property
    def _trash(self) -> Path:
        return self.folder / TRASH

    def _entry(self, name: str) -> Entry:
        entries = self.list()
        tidy = _tidy(name)
        for entry in entries:
            if entry.name in (name, tidy):
                return entry
        names = [_quoted(each.name) for each in entries if each.problem is None]
        known = ", ".join(names[:8]) + (", …" if len(names) > 8 else "")
        raise InputError(
            f"no design is called {_quoted(name)}; "
            + (f"there are {known}" if names else "none has been saved yet")
        )

    def _copy_to_trash(self, design: Design) -> None:
        """Copy the designs that a design is about to replace into the trash."""
        for entry in self.list():
            if entry.design is not None and entry.name == design.name and entry.design != design:
                write_whole(self._place_in_trash(entry), encode_design(entry.design))
                self._empty_trash()

    def _place_in_trash(self, entry: Entry) -> Path:
        make_folder(self._trash)
        number = 1 + max((_number(path) for path in _files(self._trash)), default=0)
        return self._trash / f"{number:08d}-{entry.file[-_ENDING:]}"

    def _empty_trash(self) -> None:
        """Remove the oldest files from the trash."""
        for old in _files(self._trash)[:-MOST_DELETED]:
            with contextlib.suppress(OSError):
                old.unlink()

    def _check_free(self, name: str) -> None:
        names = {each.name for each in self.list() if each.problem is None}
        if name in names:
            raise InputError(
                f"there is a design called {name!r} already; replace it, or take another name "
                f"such as {copy_name(name, names)!r}"
            )

    def _write(self, design: Design) -> None:
        """Write a design while the folder is locked."""
        for folder in (self.folder, self._trash):
            for scratch in folder.glob(".*.part"):
                # A writer was killed before it renamed this file.
                with contextlib.suppress(OSError):
                    scratch.unlink()
        order = self._order()
        file = file_of(design.name)
        replaced = [each.file for each in self.list() if each.name == design.name and each.design]
        write_whole(self.folder / file, encode_design(design))
        for other in replaced:
            # A file that was copied in by hand may have any name.
            if other != file:
                (self.folder / other).unlink(missing_ok=True)
        order[file] = 1 + max(order.values(), default=0)
        existing = {name: number for name, number in order.items() if (self.folder / name).exists()}
        write_whole(self.folder / _ORDER, msgspec.json.encode(existing))

    def _order(self) -> dict[str, int]:
        try:
            data = read_at_most(self.folder / _ORDER, LARGEST_FILE)
            return msgspec.json.decode(data, type=_Order)
        except (StorageError, msgspec.MsgspecError, UnicodeDecodeError):
            return {}


def file_of(name: str) -> str:
    """Return the name of a design's file: plain on every system, different for each name."""
    slug = plain_words(name, _SLUG).lower() or "design"
    digest = hashlib.blake2b(name.encode("utf-8", "surrogatepass")).hexdigest()[:_DIGITS]
    return f"{slug}-{digest}.json"


def _tidy(name: str) -> str:
    """Return a name without surrounding space, in normal form, so that equal looks are equal."""
    return unicodedata.normalize("NFC", name).strip()


def _with_name(design: Design, name: str) -> Design:
    tidy = _tidy(name)
    if not tidy or len(tidy) > LONGEST_NAME or not tidy.isprintable():
        raise InputError(
            f"a name is one printable line of 1 to {LONGEST_NAME} characters; got {_quoted(name)}"
        )
    return msgspec.structs.replace(design, name=tidy)


def copy_name(name: str, taken: set[str]) -> str:
    """Return the name of a copy: that of the original with "copy", and a number if need be."""
    name = _COPY.sub("", name)
    number = 1
    while True:
        suffix = " copy" if number == 1 else f" copy {number}"
        copy = name[: LONGEST_NAME - len(suffix)].rstrip() + suffix
        if copy not in taken:
            return copy
        number += 1


def _files(folder: Path) -> list[Path]:
    """Return the files of designs in a folder, by name."""
    try:
        return sorted(
            each
            for each in folder.iterdir()
            if each.name.endswith(".json") and not each.name.startswith(".")
        )
    except OSError:
        return []


def _read(path: Path, order: dict[str, int]) -> Entry:
    printable = "".join(c if c.isprintable() else "�" for c in path.name)
    try:
        design = decode_design(read_at_most(path, LARGEST_FILE), repr(printable))
    except InputError as error:
        return Entry(printable, path.name, None, str(error))
    name = _tidy(design.name)
    if not name:
        problem = f"{printable!r}: the design has no name; give it one"
        return Entry(printable, path.name, None, problem)
    return Entry(name, path.name, design, None, order.get(path.name, 0))


def _design_of(entry: Entry) -> Design:
    if entry.design is None:
        raise InputError(f"{entry.name!r} cannot be opened: {entry.problem}")
    return entry.design


def _name_in(path: Path) -> str:
    entry = _read(path, {})
    return entry.name if entry.design is not None else path.name.partition("-")[2] or path.name


def _number(path: Path) -> int:
    number = path.name.partition("-")[0]
    return int(number) if number.isascii() and number.isdigit() and len(number) < 18 else 0


def _quoted(name: str) -> str:
    return repr(name if len(name) <= 40 else f"{name[:39]}…")
