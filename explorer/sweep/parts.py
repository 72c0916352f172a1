"""Parts of a study's results: a Parquet file for each chunk, written whole or not at all.

The bytes of a part are a function of the study, its chunk and the versions of the libraries,
without times and paths. Its metadata hold the study, the study's hash, the seed, the chunk and the
versions. One process at a time computes in a folder. Needs the extra `study`.
"""

from __future__ import annotations

import contextlib
import hashlib
import io
import json
from collections.abc import Generator, Iterator, Mapping, Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import Any

from filelock import FileLock, Timeout

from explorer.errors import InputError
from explorer.files.extras import load_extra
from explorer.files.json_text import one_line
from explorer.files.writing import make_folder, storage_error, write_whole
from explorer.sweep.rows import Rows, columns_of
from explorer.sweep.study import Study, decode_study, encode_study, study_hash

SUFFIX = ".parquet"

_STUDY, _HASH, _SEED = b"explorer.study", b"explorer.study_hash", b"explorer.seed"
_CHUNK, _VERSIONS = b"explorer.chunk", b"explorer.versions"


class BadPartError(InputError):
    """A part that is damaged, cut off or not of this study."""


@dataclass(frozen=True)
class PartMetadata:
    """Metadata of a part: encoded study, its hash, and the chunk."""

    study: bytes
    study_hash: str
    chunk: int


def part_path(folder: Path, chunk: int) -> Path:
    """Return the file of a chunk's part."""
    return folder / f"part-{chunk:06d}{SUFFIX}"


def part_paths(folder: Path) -> list[Path]:
    """Return the files in a folder with names of parts, in the order of their chunks."""
    return [path for _, path in _numbered(folder)]


def stray_paths(folder: Path, study: Study) -> list[Path]:
    """Return the Parquet files in a folder that have the name of no part of a study.

    A program that reads all Parquet of a folder reads the rows of a copied part twice.
    """
    own = {path for chunk, path in _numbered(folder) if chunk < study.chunks}
    return sorted(set(_visible(folder)) - own)


def _numbered(folder: Path) -> list[tuple[int, Path]]:
    """Return the chunks and the files that have exactly the names of their parts, in order."""
    parts: list[tuple[int, Path]] = []
    for path in _visible(folder):
        number = path.stem.removeprefix("part-")
        if number.isascii() and number.isdigit() and path == part_path(folder, int(number)):
            parts.append((int(number), path))
    return sorted(parts)


def words_of_paths(paths: Sequence[Path]) -> str:
    """Return the name of the first file and the number of the others."""
    return paths[0].name + (f" and {len(paths) - 1} more" if len(paths) > 1 else "")


def _visible(folder: Path) -> list[Path]:
    try:
        paths = list(folder.glob(f"*{SUFFIX}"))
    except OSError as error:
        raise storage_error("read", folder, error) from None
    # Readers of Parquet folders ignore the others.
    return [path for path in paths if not path.name.startswith((".", "_"))]


def write_part(folder: Path, study: Study, chunk: int, pieces: Sequence[Rows]) -> None:
    """Write the part of a chunk into a results folder: its rows, in order and without gaps.

    Raises:
        StorageError: The part cannot be written; a part that was there is unchanged.
    """
    arrow = pyarrow()
    metadata = {
        _STUDY: encode_study(study),
        _HASH: study_hash(study).encode(),
        _SEED: str(study.sampling.seed).encode(),
        _CHUNK: str(chunk).encode(),
        _VERSIONS: json.dumps(pieces[0].versions, sort_keys=True).encode(),
    }
    kinds = columns_of(study)
    fields = [(name, arrow.type_for_alias(kind)) for name, kind in kinds.items()]
    columns = {name: [value for piece in pieces for value in piece.columns[name]] for name in kinds}
    table = arrow.table(columns, schema=arrow.schema(fields, metadata=metadata))
    data = io.BytesIO()
    arrow.parquet.write_table(table, data, compression="zstd", write_page_checksum=True)
    write_whole(part_path(folder, chunk), data.getvalue())


def read_part(path: Path, columns: Sequence[str] | None = None) -> tuple[PartMetadata, Any]:
    """Return the metadata and the table of a part, with some of its columns or all.

    Raises:
        BadPartError: The file is damaged or cut off, or no part of a study.
    """
    arrow = pyarrow()
    try:
        file = arrow.parquet.ParquetFile(path, page_checksum_verification=True)
        with file:
            part = _part_of(file.metadata.metadata or {})
            return part, file.read(columns=None if columns is None else list(columns))
    except (arrow.ArrowException, OSError, ValueError, KeyError) as error:
        raise BadPartError(one_line(f"{path} is no part of a study: {error}")) from None


def _part_of(metadata: Mapping[bytes, bytes]) -> PartMetadata:
    """Return the metadata of a part; a KeyError or a ValueError if they are damaged."""
    study, known_hash = metadata[_STUDY], metadata[_HASH].decode()
    if hashlib.sha256(study).hexdigest() != known_hash:
        raise ValueError("its metadata is damaged")
    return PartMetadata(study, known_hash, int(metadata[_CHUNK]))


def sound_parts(
    folder: Path, damaged: list[Path], study: Study | None = None
) -> Iterator[tuple[Study, int, Any]]:
    """Yield the study, the chunk and the table of each sound part in a results folder.

    Each part is read whole, since each column has checksums of its own, and must hold the rows of
    the chunk in its file name. Reading results and continuing a run see the same parts. Damaged
    parts, which a run computes again, are added to a list. If no study is given, it is that of the
    first part.

    Raises:
        InputError: A part is of another study.
    """
    known_hash = None if study is None else study_hash(study)
    for chunk, path in _numbered(folder):
        try:
            part, table = read_part(path)
        except BadPartError:
            if study is None or chunk < study.chunks:
                damaged.append(path)
            continue
        if study is None or known_hash is None:
            study, known_hash = decode_study(part.study, str(path)), part.study_hash
        if part.study_hash != known_hash:
            raise InputError(
                f"{folder} holds results of several studies: {path.name} is a part of another "
                "study; move it away"
            )
        if chunk >= study.chunks:
            continue
        has_columns = part.chunk == chunk and table.column_names == [*columns_of(study)]
        if has_columns and table.column("index").to_pylist() == [*study.rows_of(chunk)]:
            yield study, chunk, table
        else:
            damaged.append(path)


def pyarrow() -> Any:
    """Return the library that reads and writes Parquet, with its module `parquet`.

    Raises:
        MissingExtraError: It is not installed.
    """
    return load_extra("study", "pyarrow", "pyarrow.parquet")[0]


LOCK_FILE = ".lock"
"""Name of the lock in a results folder; readers of Parquet folders ignore it."""


@contextlib.contextmanager
def claim(folder: Path, study: Study) -> Generator[None]:
    """Make a folder if needed, and lock it for a study within a `with` block.

    Raises:
        InputError: The folder belongs to another study, or is in use.
        StorageError: The folder cannot be made or read.
    """
    make_folder(folder)
    # A folder of other files is left alone: not even a lock goes into it.
    _check_owner(folder, study)
    lock = FileLock(folder / LOCK_FILE, timeout=0)
    try:
        lock.acquire()
    except Timeout:
        raise InputError(
            f"another process is computing in {str(folder)!r}: wait for it, or use another folder"
        ) from None
    except OSError as error:
        raise InputError(f"cannot lock {str(folder)!r}: {error.strerror}") from None
    try:
        for path in folder.iterdir():
            # A killed process was writing it.
            if _is_scratch(path) and path.name != LOCK_FILE:
                path.unlink(missing_ok=True)
        yield
    finally:
        lock.release()


def _check_owner(folder: Path, study: Study) -> None:
    """Raise an `InputError` unless a folder is this study's, or empty."""
    for path in part_paths(folder):
        with contextlib.suppress(BadPartError):
            if read_part(path, [])[0].study_hash == study_hash(study):
                return
            raise InputError(
                f"{str(folder)!r} holds the results of another study; use another folder, or "
                "move them away"
            )
    try:
        others = sorted(path for path in folder.iterdir() if not _is_scratch(path))
    except OSError as error:
        raise storage_error("read", folder, error) from None
    if others:
        raise InputError(
            f"{str(folder)!r} is not empty, and holds no results of a study that can be read: "
            f"{words_of_paths(others)} cannot be; use another folder, or move them away"
        )


def _is_scratch(path: Path) -> bool:
    return path.name == LOCK_FILE or (path.name.startswith(".part-") and path.suffix == ".part")
