"""Designs by name, in the user's data folder; each is a design file of its own.

A name is what people call a design and never a path: a file is called after a part of it
and a hash, and the name itself lies within. So design files that are copied into the folder
by hand appear too. Several explorers may share the folder; each sees what the others did.
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

from explorer.app.storage.folder import alone_in, data_folder
from explorer.errors import InputError, StorageError
from explorer.files.writing import make_folder, move, read_at_most, write_whole
from explorer.mechanism.design import Design
from explorer.mechanism.design_file import LARGEST_FILE, decode_design, encode_design

DESIGNS = "designs"
"""The folder of named designs, in that of the user's data."""

TRASH = "trash"
"""Where deleted ones go, within the folder of designs."""

MOST_DELETED = 20
"""Deleted designs that are kept, the newest of them."""

LONGEST_NAME = 100

# The names of files by the order in which they were saved; without it the order is lost.
_ORDER = ".order"
# Characters of a name that its file is called after, and digits of the hash.
_SLUG, _DIGITS = 40, 12
# Characters of a file's name that it keeps in the trash, where it gets a number too.
_ENDING = 60

# What tells a copy from its original.
_COPY = re.compile(r" copy( \d+)?$")

_Order = dict[str, Annotated[int, msgspec.Meta(ge=0, le=2**53)]]


@dataclass(frozen=True)
class Entry:
    """A file in the library.

    Attributes:
        name: Of the design; of the file where there is no design to be had from it.
        file: The name of the file.
        design: The design, None if it cannot be used.
        problem: Why it cannot, None if it can.
        generation: Larger than that of all that were saved before it; 0 if unknown.
    """

    name: str
    file: str
    design: Design | None
    problem: str | None = None
    generation: int = 0

    @property
    def reach(self) -> float | None:
        """The characteristic length |a3| in design units."""
        return None if self.design is None else self.design.reach

    @property
    def unit_mm(self) -> float | None:
        """The millimetres in one design unit."""
        return None if self.design is None else self.design.unit_mm

    @property
    def variables(self) -> tuple[float, ...] | None:
        """X = (a3x, a3y, b1x, b1y, b2, b3) in design units."""
        return None if self.design is None else self.design.variables


@dataclass(frozen=True)
class Deleted:
    """A design that was deleted and is still kept.

    Attributes:
        name: It had; of the file where there is no design to be had from it.
        file: The name of the file in the trash, by which `restore` knows it.
    """

    name: str
    file: str


class Library:
    """The user's named designs.

    Args:
        folder: That they are in; that in the user's data folder if None.
    """

    def __init__(self, folder: Path | None = None) -> None:
        self.folder = data_folder() / DESIGNS if folder is None else folder

    def list(self) -> tuple[Entry, ...]:
        """Return what is in the library, the one saved last first, files of no use last."""
        order = self._order()
        entries: dict[str, Entry] = {}
        problems: list[Entry] = []
        # A file of the library's own goes before one that was copied in under its name.
        found = [_read(path, order) for path in _files(self.folder)]
        for entry in sorted(found, key=lambda each: each.file != file_of(each.name)):
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
        """Return the design of a name.

        Raises:
            InputError: there is none, or its file is of no use.
        """
        return _design_of(self._entry(name))

    def save(self, name: str, design: Design, *, replace: bool = False) -> Design:
        """Save a design under a name, which it has from then on.

        Args:
            name: One printable line of at most 100 characters; surrounding space is left out.
            design: What to save.
            replace: Whether it takes the place of the one that has the name; that goes to the
                trash unless it is the same.

        Returns:
            The design with its new name.

        Raises:
            InputError: no such name can be had, or another design has it.
            StorageError: it cannot be written.
        """
        named = _named(design, name)
        with alone_in(self.folder):
            if replace:
                self._keep_copies(named)
            else:
                self._check_free(named.name)
            self._write(named)
        return named

    def duplicate(self, name: str, new: str | None = None) -> Design:
        """Save a design of the library again, as "… copy" unless told otherwise.

        Raises:
            InputError: there is no such design, or the new name cannot be had.
            StorageError: it cannot be written.
        """
        with alone_in(self.folder):
            design = _design_of(self._entry(name))
            taken = {each.name for each in self.list()}
            copy = _named(design, copy_name(design.name, taken) if new is None else new)
            self._check_free(copy.name)
            self._write(copy)
        return copy

    def rename(self, name: str, new: str) -> Design:
        """Give a design of the library another name.

        Raises:
            InputError: there is no such design, or the new name cannot be had.
            StorageError: it cannot be written.
        """
        with alone_in(self.folder):
            entry = self._entry(name)
            renamed = _named(_design_of(entry), new)
            if renamed.name == entry.name:
                return renamed
            self._check_free(renamed.name)
            # Killed between the two, it has both names; never none.
            self._write(renamed)
            with contextlib.suppress(FileNotFoundError):
                (self.folder / entry.file).unlink()
        return renamed

    def delete(self, name: str) -> Deleted:
        """Move a design, or a file of no use by its own name, to the trash.

        Raises:
            InputError: there is no such design.
            StorageError: it cannot be moved.
        """
        with alone_in(self.folder):
            entry = self._entry(name)
            place = self._place_in_trash(entry)
            move(self.folder / entry.file, place)
            self._empty_trash()
        return Deleted(entry.name, place.name)

    def deleted(self) -> tuple[Deleted, ...]:
        """Return what is in the trash, the one deleted last first."""
        return tuple(Deleted(_name_in(path), path.name) for path in reversed(_files(self._trash)))

    def restore(self, file: str, name: str | None = None) -> Design:
        """Bring a deleted design back.

        Args:
            file: Of `Deleted`.
            name: Another one than it had.

        Raises:
            InputError: it is not in the trash, is of no use, or its name is taken.
            StorageError: it cannot be written.
        """
        with alone_in(self.folder):
            # Looked up, so that no text of anyone's is used as a path.
            path = next((each for each in _files(self._trash) if each.name == file), None)
            if path is None:
                raise InputError(f"{file!r} is not in the trash any more")
            design = _design_of(_read(path, {}))
            restored = _named(design, design.name if name is None else name)
            self._check_free(restored.name)
            self._write(restored)
            path.unlink(missing_ok=True)
        return restored

    @property
    def _trash(self) -> Path:
        return self.folder / TRASH

    def _entry(self, name: str) -> Entry:
        entries = self.list()
        wanted = _tidy(name)
        for entry in entries:
            if entry.name in (name, wanted):
                return entry
        names = [_shown(each.name) for each in entries if each.problem is None]
        known = ", ".join(names[:8]) + (", …" if len(names) > 8 else "")
        raise InputError(
            f"no design is called {_shown(name)}; "
            + (f"there are {known}" if names else "none has been saved yet")
        )

    def _keep_copies(self, design: Design) -> None:
        """Put copies of what is to be replaced by a design into the trash."""
        for entry in self.list():
            if entry.design is not None and entry.name == design.name and entry.design != design:
                write_whole(self._place_in_trash(entry), encode_design(entry.design))
                self._empty_trash()

    def _place_in_trash(self, entry: Entry) -> Path:
        make_folder(self._trash)
        number = 1 + max((_number(path) for path in _files(self._trash)), default=0)
        return self._trash / f"{number:08d}-{entry.file[-_ENDING:]}"

    def _empty_trash(self) -> None:
        """Remove from the trash what has been there longest."""
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
        """Write a design, alone in the folder."""
        for folder in (self.folder, self._trash):
            for scratch in folder.glob(".*.part"):
                # Of a writer that was killed.
                with contextlib.suppress(OSError):
                    scratch.unlink()
        order = self._order()
        file = file_of(design.name)
        replaced = [each.file for each in self.list() if each.name == design.name and each.design]
        write_whole(self.folder / file, encode_design(design))
        for other in replaced:
            # One that was copied in by hand is called what it likes.
            if other != file:
                (self.folder / other).unlink(missing_ok=True)
        order[file] = 1 + max(order.values(), default=0)
        kept = {name: number for name, number in order.items() if (self.folder / name).exists()}
        write_whole(self.folder / _ORDER, msgspec.json.encode(kept))

    def _order(self) -> dict[str, int]:
        try:
            data = read_at_most(self.folder / _ORDER, LARGEST_FILE)
            return msgspec.json.decode(data, type=_Order)
        except (StorageError, msgspec.MsgspecError, UnicodeDecodeError):
            return {}


def file_of(name: str) -> str:
    """Return what the file of a name is called: plain on every system, its own for each name."""
    plain = unicodedata.normalize("NFKD", name).encode("ascii", "ignore").decode().lower()
    slug = "-".join("".join(c if c.isalnum() else " " for c in plain).split())[:_SLUG].strip("-")
    digest = hashlib.blake2b(name.encode("utf-8", "surrogatepass")).hexdigest()[:_DIGITS]
    return f"{slug or 'design'}-{digest}.json"


def _tidy(name: str) -> str:
    """Return a name as it is kept: what looks the same is the same."""
    return unicodedata.normalize("NFC", name).strip()


def _named(design: Design, name: str) -> Design:
    tidy = _tidy(name)
    if not tidy or len(tidy) > LONGEST_NAME or not tidy.isprintable():
        raise InputError(
            f"a name is one printable line of 1 to {LONGEST_NAME} characters; got {_shown(name)}"
        )
    return msgspec.structs.replace(design, name=tidy)


def copy_name(name: str, taken: set[str]) -> str:
    """Return the name of a copy: that of the original with "copy" and perhaps a number."""
    name = _COPY.sub("", name)
    number = 1
    while True:
        suffix = " copy" if number == 1 else f" copy {number}"
        copy = name[: LONGEST_NAME - len(suffix)].rstrip() + suffix
        if copy not in taken:
            return copy
        number += 1


def _files(folder: Path) -> list[Path]:
    """Return the files in a folder that are meant as designs, by name."""
    try:
        return sorted(
            each
            for each in folder.iterdir()
            if each.name.endswith(".json") and not each.name.startswith(".")
        )
    except OSError:
        return []


def _read(path: Path, order: dict[str, int]) -> Entry:
    shown = "".join(c if c.isprintable() else "�" for c in path.name)
    try:
        design = decode_design(read_at_most(path, LARGEST_FILE), repr(shown))
    except InputError as error:
        return Entry(shown, path.name, None, str(error))
    name = _tidy(design.name)
    if not name:
        return Entry(shown, path.name, None, f"{shown!r}: the design has no name; give it one")
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


def _shown(name: str) -> str:
    return repr(name if len(name) <= 40 else f"{name[:39]}…")
