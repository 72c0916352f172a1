"""Designs by name, in the user's data folder; each is a design file of its own.

A name is never a path: the name of a file is made of a part of the design's name and a hash, and
the design's name itself is in the file. So design files that are copied into the folder by hand
appear too. Several explorers may share the folder; each sees the changes of the others.
"""

from __future__ import annotations

import contextlib
import hashlib
import itertools
import os
import re
import time
from dataclasses import dataclass
from pathlib import Path

import msgspec

from explorer.errors import InputError
from explorer.files.writing import make_folder, move, read_at_most, write_whole
from explorer.mechanism.design import Design
from explorer.mechanism.design_file import decode_design, encode_design
from explorer.numerics.checks import LONGEST_NAME, tidy_name
from explorer.page.storage.folder import data_folder, make_data_folder, newest_first, plain_words

# Names of the folder of designs in the user's data folder, and of the folder in it that keeps those
# deleted or replaced.
DESIGNS, TRASH = "designs", "trash"
# Number of characters of a design's name in its file's name, and of digits of the hash.
_SLUG, _DIGITS = 40, 12
# Suffix of the name of a copy.
_COPY = re.compile(r" copy( \d+)?$")


@dataclass(frozen=True)
class LibraryFile:
    """A file in the library.

    Its name is that of the design, or of the file if the design cannot be used; the problem then
    says why.
    """

    name: str
    file: str
    design: Design | None
    problem: str | None = None


class Library:
    """The user's named designs in a folder; that in the user's data folder if none is given."""

    def __init__(self, folder: Path | None = None) -> None:
        self.folder = data_folder() / DESIGNS if folder is None else folder
        self._trash = self.folder / TRASH

    def list(self) -> tuple[LibraryFile, ...]:
        """Return all entries: the design saved last first, unusable files last."""
        entries: list[LibraryFile] = []
        names: set[str] = set()
        for path in newest_first(self.folder):
            entry = _read(path)
            if entry.design is not None and entry.name in names:
                problem = f"another file has the name {entry.name!r} too; change it in one of them"
                entry = LibraryFile(entry.file, entry.file, None, problem)
            names.add(entry.name)
            entries.append(entry)
        return tuple(sorted(entries, key=lambda each: each.design is None))

    def open(self, name: str) -> Design:
        """Return the design with a name.

        Raises:
            InputError: There is no such design, or its file cannot be used.
        """
        entry = self._entry(name)
        if entry.design is None:
            raise InputError(f"{entry.name!r} cannot be opened: {entry.problem}")
        return entry.design

    def save(self, name: str, design: Design) -> Design:
        """Save a design under a name; return the design with this name.

        Args:
            name: Name of the design, see `Design`.
            design: The design; another one that has the name goes to the trash.

        Raises:
            InputError: A name that cannot be used.
            StorageError: It cannot be written.
        """
        named = msgspec.structs.replace(design, name=name)
        entry = self._designs().get(named.name)
        make_data_folder(self.folder)
        if entry is not None and entry.design is not None and entry.design != named:
            self._write(self._trash, entry.file, entry.design)
        self._write(self.folder, file_of(named.name) if entry is None else entry.file, named)
        return named

    def rename(self, name: str, new: str) -> Design:
        """Give a design of the library another name.

        Raises:
            InputError: There is no such design, or the new name cannot be used or is taken.
            StorageError: It cannot be written.
        """
        entry = self._entry(name)
        renamed = msgspec.structs.replace(self.open(name), name=new)
        if renamed.name != entry.name:
            if renamed.name in self._designs():
                raise InputError(f"there is a design called {renamed.name!r} already")
            # A process killed in between leaves the design under both names, never under none.
            self.save(new, renamed)
            (self.folder / entry.file).unlink(missing_ok=True)
        return renamed

    def delete(self, name: str) -> None:
        """Move a design, or an unusable file by the file's name, to the trash.

        Raises:
            InputError: There is no such design.
            StorageError: It cannot be moved.
        """
        file = self._entry(name).file
        make_folder(self._trash)
        move(self.folder / file, self._trash / file)
        _date(self._trash / file)

    @property
    def last_deleted(self) -> str | None:
        """Name of the design that was deleted or replaced last; None if the trash is empty."""
        paths = newest_first(self._trash)
        return _read(paths[0]).name if paths else None

    def restore(self) -> None:
        """Bring back what was deleted or replaced last, as a copy if its name is taken.

        Raises:
            InputError: The trash is empty, or another file lies in its place.
            StorageError: It cannot be moved.
        """
        path = next(iter(newest_first(self._trash)), None)
        if path is None:
            raise InputError("nothing has been deleted")
        entry, designs = _read(path), self._designs()
        if entry.design is not None and entry.name in designs:
            self.save(copy_name(entry.name, {*designs}), entry.design)
            path.unlink(missing_ok=True)
        elif (self.folder / path.name).exists():
            raise InputError(f"a file {path.name!r} lies in {str(self.folder)!r}; rename it")
        else:
            move(path, self.folder / path.name)

    def _designs(self) -> dict[str, LibraryFile]:
        return {each.name: each for each in self.list() if each.design is not None}

    @staticmethod
    def _write(folder: Path, file: str, design: Design) -> None:
        make_folder(folder)
        write_whole(folder / file, encode_design(design))
        _date(folder / file)

    def _entry(self, name: str) -> LibraryFile:
        entries = self.list()
        for entry in entries:
            if entry.name in (name, tidy_name(name)):
                return entry
        names = [repr(each.name) for each in entries if each.design is not None]
        known = ", ".join(names[:4]) + (", …" if len(names) > 4 else "")
        raise InputError(
            f"no design is called {name!r}; "
            + (f"there are {known}" if names else "none has been saved yet")
        )


def file_of(name: str) -> str:
    """Return the name of a design's file: plain on every system, different for each name."""
    slug = plain_words(name, _SLUG).lower() or "design"
    digest = hashlib.blake2b(name.encode("utf-8", "surrogatepass")).hexdigest()[:_DIGITS]
    return f"{slug}-{digest}.json"


def copy_name(name: str, taken: set[str]) -> str:
    """Return the name of a copy: that of the original with "copy", and a number if need be."""
    name = _COPY.sub("", name)
    suffixes = itertools.chain([" copy"], (f" copy {number}" for number in itertools.count(2)))
    copies = (name[: LONGEST_NAME - len(suffix)].rstrip() + suffix for suffix in suffixes)
    return next(copy for copy in copies if copy not in taken)


def _date(path: Path) -> None:
    """Date a file, by which lists are ordered; a system may date those of 10 ms alike."""
    now = time.time_ns()
    with contextlib.suppress(OSError):
        os.utime(path, ns=(now, now))


def _read(path: Path) -> LibraryFile:
    printable = "".join(c if c.isprintable() else "�" for c in path.name)
    try:
        design = decode_design(read_at_most(path), repr(printable))
    except InputError as error:
        return LibraryFile(printable, path.name, None, str(error))
    return LibraryFile(design.name, path.name, design)
