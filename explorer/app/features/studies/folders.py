"""Folders of studies that the page may show: the user's, and those named on the command line.

The page knows them by name, and no name leads to any other folder. A study of the page is
kept as a file beside the folder of its results, so that it is known before there are any.
"""

from __future__ import annotations

import contextlib
import itertools
from collections.abc import Sequence
from pathlib import Path
from typing import TYPE_CHECKING

from explorer.errors import InputError
from explorer.files.writing import read_at_most, write_whole
from explorer.page.storage.folder import make_data_folder, plain_words
from explorer.sweep.parts import BadPartError, part_paths, read_part
from explorer.sweep.study import Study, decode_study, encode_study

if TYPE_CHECKING:
    # The processes need no viser.
    from explorer.app.features.feature import Services

STUDIES_FOLDER = "studies"
"""Name of the folder of studies in the user's data folder."""

# Number of characters of a study's name in the name of its folder.
_LONGEST = 60


def study_folders(_: Services) -> StudyFolders:
    """Return the folders that the page shares; for `Services.get`.

    Raises:
        RuntimeError: The page offers no studies.
    """
    raise RuntimeError("a page without folders of studies draws none")


class StudyFolders:
    """The folders of results that the page may show.

    Args:
        home: Folder of the page's own studies, a folder each; made when it is needed.
        given: Folders of other studies that the page may show.
    """

    def __init__(self, home: Path, given: Sequence[Path] = ()) -> None:
        self.home = home
        # The name of ".." is that of the folder that it means.
        self.given = tuple(
            path.resolve() if path.name in ("", "..") else path.absolute() for path in given
        )

    def by_name(self) -> dict[str, Path]:
        """Return the folders that hold a study, by name; those that were given first."""
        folders: dict[str, Path] = {}
        # A study without results yet has no folder.
        own = sorted({path.with_suffix("") for path in self.home.glob("*")})
        for path in filter(_is_study, (*self.given, *own)):
            name, number = path.name, 2
            while name in folders:
                name, number = f"{path.name} ({number})", number + 1
            folders[name] = path
        return folders

    def folder(self, name: str) -> Path:
        """Return the folder of a study.

        Raises:
            InputError: There is none of that name.
        """
        folders = self.by_name()
        if name not in folders:
            known = ", ".join(folders) or "none yet"
            raise InputError(f"there is no study {name!r}; there are {known}")
        return folders[name]

    def drop(self, name: str) -> None:
        """Remove a study of the page from the list, unless it has results."""
        folder = self.by_name().get(name)
        if folder is not None and folder.parent == self.home and not part_paths(folder):
            with contextlib.suppress(OSError):
                _file_beside(folder).unlink()

    def new(self, name: str) -> Path:
        """Return a folder that does not exist yet, whose name no study has, for a new study.

        Raises:
            StorageError: The folder of studies cannot be made.
        """
        slug, home = plain_words(name, _LONGEST) or "study", make_data_folder(self.home)
        taken = {path.stem for path in home.iterdir()} | {*self.by_name()}
        names = (f"{slug}-{number}" for number in itertools.count(1))
        return home / next(name for name in names if name not in taken)


def check_given(folders: Sequence[Path]) -> None:
    """Check that the folders named on the command line hold studies.

    Raises:
        InputError: One holds none.
    """
    for folder in folders:
        if not _is_study(folder.absolute()):
            raise InputError(
                f"{str(folder)!r} holds no results of a study; explorer sweep STUDY --out FOLDER "
                "makes some"
            )


def keep_study(folder: Path, study: Study) -> None:
    """Write the file of a study beside the folder for its results.

    Raises:
        StorageError: It cannot be written.
    """
    write_whole(_file_beside(folder), encode_study(study))


def study_in(folder: Path) -> Study:
    """Return the study of a folder of results, even before there are any.

    Raises:
        InputError: It holds none.
        StorageError: It cannot be read.
        MissingExtraError: Pyarrow is not installed.
    """
    for path in part_paths(folder):
        try:
            return decode_study(read_part(path, [])[0].study, str(path))
        except BadPartError:
            continue
    file = _file_beside(folder)
    return decode_study(read_at_most(file), str(file))


def _file_beside(folder: Path) -> Path:
    return folder.with_name(f"{folder.name}.json")


def _is_study(path: Path) -> bool:
    try:
        return bool(part_paths(path)) or _file_beside(path).is_file()
    except OSError:
        return False
