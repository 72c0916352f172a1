"""Where the studies lie that the page shows: in the user's data, or named on the command line.

The page knows them by name; no name leads anywhere else. A study of the page is kept as a file
beside the folder of its results, so that it is known before there are any.
"""

from __future__ import annotations

import unicodedata
from collections.abc import Sequence
from pathlib import Path

from explorer.app.storage.folder import made_folder
from explorer.errors import InputError
from explorer.files.writing import read_at_most, write_whole
from explorer.sweep.parts import BadPartError, part_paths, read_part
from explorer.sweep.study import LARGEST_FILE, Study, decode_study, encode_study

STUDIES_FOLDER = "studies"
"""In the user's data folder."""

_LONGEST = 60


class StudyFolders:
    """The folders of results that the page may show.

    Args:
        home: Where studies of the page are kept, a folder each; made when it is needed.
        given: Others that the page may show.
    """

    def __init__(self, home: Path, given: Sequence[Path] = ()) -> None:
        self.home = home
        self.given = tuple(path.absolute() for path in given)

    def found(self) -> dict[str, Path]:
        """Return the folders that hold a study, by name; those that were given first."""
        found: dict[str, Path] = {}
        try:
            # A study without results yet has no folder.
            own = sorted({path.with_suffix("") for path in self.home.iterdir()})
        except OSError:
            own = []
        for path in (*self.given, *own):
            if not _is_study(path):
                continue
            name, number = path.name, 2
            while name in found:
                name, number = f"{path.name} ({number})", number + 1
            found[name] = path
        return found

    def folder(self, name: str) -> Path:
        """Return the folder of a study.

        Raises:
            InputError: there is none of that name.
        """
        found = self.found()
        if name not in found:
            known = ", ".join(found) or "none yet"
            raise InputError(f"there is no study {name!r}; there are {known}")
        return found[name]

    def new(self, name: str) -> Path:
        """Return a folder for a new study, called after it, which is not there yet.

        Raises:
            StorageError: the folder of studies cannot be made.
        """
        plain = unicodedata.normalize("NFKD", name).encode("ascii", "ignore").decode()
        words = "".join(c if c.isalnum() else " " for c in plain).split()
        slug = "-".join(words)[:_LONGEST].strip("-") or "study"
        home = made_folder(self.home)
        number = 1
        taken = {path.stem for path in home.iterdir()}
        while f"{slug}-{number}" in taken:
            number += 1
        return home / f"{slug}-{number}"


def check_given(folders: Sequence[Path]) -> None:
    """Check that folders that were named hold studies.

    Raises:
        InputError: one does not.
    """
    for folder in folders:
        if not _is_study(folder.absolute()):
            raise InputError(
                f"{str(folder)!r} holds no results of a study; explorer sweep STUDY --out FOLDER "
                "makes some"
            )


def keep_study(folder: Path, study: Study) -> None:
    """Keep a study beside the folder that its results are to come to.

    Raises:
        StorageError: it cannot be written.
    """
    write_whole(_file_beside(folder), encode_study(study))


def study_in(folder: Path) -> Study:
    """Return the study whose results a folder holds, though there be none yet.

    Raises:
        InputError: it holds none.
        StorageError: it cannot be read.
        MissingExtraError: pyarrow is not installed.
    """
    for path in part_paths(folder):
        try:
            return decode_study(read_part(path, [])[0].study, str(path))
        except BadPartError:
            continue
    file = _file_beside(folder)
    return decode_study(read_at_most(file, LARGEST_FILE), str(file))


def _file_beside(folder: Path) -> Path:
    return folder.with_name(f"{folder.name}.json")


def _is_study(path: Path) -> bool:
    try:
        return bool(part_paths(path)) or _file_beside(path).is_file()
    except OSError:
        return False
