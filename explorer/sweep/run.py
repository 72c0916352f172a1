"""A study is run: its chunks go to workers, their rows come back and become parts.

Killed at any point it goes on where it was: what counts as done is what lies in the folder
as whole parts. Tasks under way are few, so that memory does not grow with the study.
"""

from __future__ import annotations

import time
from collections import Counter, deque
from collections.abc import Callable, Iterator
from concurrent.futures import FIRST_COMPLETED, CancelledError, Future, wait
from dataclasses import dataclass, field
from itertools import islice
from pathlib import Path

from explorer.errors import ExplorerError
from explorer.files.versions import versions
from explorer.numerics.compiled import fill_cache
from explorer.sweep.folder import claimed
from explorer.sweep.parts import pyarrow, sound_parts, write_part
from explorer.sweep.rows import Answer, Rows, answer, check_study, evaluate, load_kernels, lost
from explorer.sweep.study import Study, encode_study
from explorer.sweep.workers import NoWorkerError, Workers

# Tasks under way for each worker: enough that none waits for this process.
AHEAD = 4
# How often a chunk may lose its worker before its designs are tried one by one, and how often
# a design with nothing else under way.
CHUNK_DEATHS, DESIGN_DEATHS = 2, 3
# Seconds between two looks at whether to stop.
GLANCE = 0.1


class RunError(ExplorerError):
    """A run that cannot go on; what was finished is kept."""

    exit_status = 1


@dataclass(frozen=True)
class Progress:
    """How far a run has got.

    Attributes:
        total: How many designs the study has.
        done: How many of them have their row.
        kept: How many of these had it when the run began.
        counts: How many rows have each status.
        seconds: Since the run began.
    """

    total: int
    done: int
    kept: int
    counts: dict[str, int]
    seconds: float

    @property
    def is_complete(self) -> bool:
        """Whether every design has its row."""
        return self.done == self.total

    @property
    def rate(self) -> float:
        """Designs per second in this run; 0 as long as there is none."""
        return (self.done - self.kept) / self.seconds if self.seconds > 0.0 else 0.0

    @property
    def seconds_left(self) -> float | None:
        """How long the rest takes at this rate; None as long as there is none."""
        return (self.total - self.done) / self.rate if self.rate > 0.0 else None


def run_study(
    study: Study,
    folder: str | Path,
    workers: Workers,
    *,
    limit: int | None = None,
    told: Callable[[Progress], None] | None = None,
    is_cut: Callable[[], bool] | None = None,
) -> Progress:
    """Compute what is missing in a results folder.

    Args:
        study: The study.
        folder: For its parts; made if it is not there.
        workers: Who evaluates the designs.
        limit: End after so many more designs, rounded up to whole chunks.
        told: Called when the run begins, and after every part that is written.
        is_cut: Asked some times a second whether to end early; what has not been finished
            then is dropped.

    Raises:
        InputError: no design of the study can be made, or the folder belongs to another
            study or is in use.
        StorageError: the folder cannot be written.
        MissingExtraError: pyarrow is not installed.
        RunError: the workers are gone, or have other versions of the libraries.
    """
    pyarrow()
    check_study(study)
    path = Path(folder)
    with claimed(path, study):
        # Once here, rather than in each worker.
        load_kernels(study)
        fill_cache()
        return _Run(study, path, workers, told or (lambda _: None)).run(limit, is_cut)


@dataclass
class _Piece:
    """Some designs that stay together: those of a chunk, or one of them."""

    chunk: int
    indices: range
    deaths: int = 0


@dataclass
class _Pending:
    """What is there of a chunk."""

    size: int
    pieces: list[Rows] = field(default_factory=list[Rows])

    @property
    def is_whole(self) -> bool:
        return sum(len(piece.indices) for piece in self.pieces) == self.size

    def in_order(self) -> list[Rows]:
        return sorted(self.pieces, key=lambda piece: piece.indices.start)


class _Run:
    """One run.

    Args:
        study: The study.
        folder: For its parts.
        workers: Who evaluates the designs.
        told: Called with how far it has got.
    """

    def __init__(
        self, study: Study, folder: Path, workers: Workers, told: Callable[[Progress], None]
    ) -> None:
        self.study = study
        self.folder = folder
        self.workers = workers
        self.told = told
        self.encoded = encode_study(study)
        self.counts: Counter[str] = Counter()
        # One byte a chunk tells which there are.
        self.has = bytearray(study.chunks)
        self.again: deque[_Piece] = deque()
        # Designs that a worker may have died of; each is tried alone.
        self.suspects: deque[_Piece] = deque()
        self.under_way: dict[Future[Answer], list[_Piece]] = {}
        self.pending: dict[int, _Pending] = {}
        # Designs that workers have told of, and the seconds that they took.
        self.told_designs, self.told_seconds = 0, 0.0

    def run(self, limit: int | None, is_cut: Callable[[], bool] | None) -> Progress:
        """Compute what is missing."""
        self._look()
        self.kept, self.began = self.counts.total(), time.monotonic()
        self.told(self._progress())
        missing = self._missing(limit)
        try:
            while self._hand_out(missing):
                if is_cut is not None and is_cut():
                    break
                done, _ = wait(self.under_way, timeout=GLANCE, return_when=FIRST_COMPLETED)
                for future in done:
                    self._take(future)
        finally:
            for future in self.under_way:
                future.cancel()
        return self._progress()

    def _look(self) -> None:
        """Find out which parts there are; damaged ones are computed again."""
        for _, chunk, table in sound_parts(self.folder, [], self.study):
            self.has[chunk] = 1
            self.counts.update(table.column("status").to_pylist())

    def _missing(self, limit: int | None) -> Iterator[_Piece]:
        designs = 0
        for chunk in range(self.study.chunks):
            if limit is not None and designs >= limit:
                return
            if not self.has[chunk]:
                indices = self.study.rows_of(chunk)
                designs += len(indices)
                self.pending[chunk] = _Pending(len(indices))
                yield _Piece(chunk, indices)

    def _hand_out(self, missing: Iterator[_Piece]) -> bool:
        """Keep the workers busy; say whether anything is under way."""
        room = (AHEAD if self._knows_its_pace else 1) * self.workers.size
        while len(self.under_way) < room:
            pieces = [self.again.popleft()] if self.again else [*islice(missing, self._together())]
            if not pieces:
                break
            self._submit(pieces)
        if not self.under_way and self.suspects:
            self._submit([self.suspects.popleft()])
        return bool(self.under_way)

    @property
    def _knows_its_pace(self) -> bool:
        """Whether tasks may be of any length, or it is known by now how long they take."""
        return self.workers.task_seconds == 0.0 or self.told_designs > 0

    def _together(self) -> int:
        """Return how many chunks make the next task.

        As many as take the time that these workers ask for; fewer near the end, so that
        all of them end at the same time.
        """
        if self.workers.task_seconds == 0.0 or self.told_seconds == 0.0:
            return 1
        seconds = self.study.chunk * self.told_seconds / self.told_designs
        share = (self.has.count(0) - len(self.pending)) // (2 * self.workers.size)
        return max(1, min(int(self.workers.task_seconds / seconds), share))

    def _submit(self, pieces: list[_Piece]) -> None:
        ranges = [piece.indices for piece in pieces]
        self.under_way[self.workers.submit(answer, evaluate, self.encoded, ranges)] = pieces

    def _take(self, future: Future[Answer]) -> None:
        """Take in what came of a task."""
        pieces = self.under_way.pop(future)
        try:
            told = future.result()
        except self.workers.died:
            self._mourn(pieces)
            return
        except CancelledError:
            raise RunError(
                "the scheduler dropped the tasks; what is finished is kept, and the same "
                "command goes on"
            ) from None
        except NoWorkerError as error:
            raise RunError(str(error)) from None
        except ExplorerError:
            raise
        except Exception as error:
            raise RunError(
                f"the workers cannot do the tasks: {type(error).__name__}: {error}"
            ) from error
        self.told_designs += sum(len(piece.indices) for piece in pieces)
        self.told_seconds += told.seconds
        for piece, rows in zip(pieces, told.pieces, strict=True):
            if rows.versions != versions():
                raise RunError(
                    f"the workers have other versions than this process: {_shown(rows.versions)} "
                    f"there, {_shown(versions())} here; install the same everywhere"
                )
            self._add(piece.chunk, rows)

    def _mourn(self, pieces: list[_Piece]) -> None:
        """Have a task tried again whose worker died.

        At first chunk by chunk and each whole, then design by design, and in the end with
        nothing else under way: a scheduler blames all tasks that a dead worker had.
        """
        if len(pieces) > 1:
            self.again.extend(pieces)
            return
        (piece,) = pieces
        piece.deaths += 1
        if len(piece.indices) > 1:
            if piece.deaths < CHUNK_DEATHS:
                self.again.append(piece)
            else:
                self.again.extend(
                    _Piece(piece.chunk, range(index, index + 1)) for index in piece.indices
                )
        elif piece.deaths <= DESIGN_DEATHS:
            self.suspects.append(piece)
        else:
            reason = f"{DESIGN_DEATHS} workers in a row died of it, with nothing else under way"
            self._add(piece.chunk, lost(self.study, piece.indices, reason))

    def _add(self, chunk: int, rows: Rows) -> None:
        """Take in rows, and write the part that they complete."""
        pending = self.pending[chunk]
        pending.pieces.append(rows)
        if not pending.is_whole:
            return
        del self.pending[chunk]
        pieces = pending.in_order()
        write_part(self.folder, self.study, chunk, pieces)
        self.has[chunk] = 1
        for piece in pieces:
            self.counts.update(str(status) for status in piece.columns["status"])
        self.told(self._progress())

    def _progress(self) -> Progress:
        return Progress(
            total=self.study.count,
            done=self.counts.total(),
            kept=self.kept,
            counts=dict(self.counts),
            seconds=time.monotonic() - self.began,
        )


def _shown(found: dict[str, str]) -> str:
    return ", ".join(f"{name} {version}" for name, version in found.items())
