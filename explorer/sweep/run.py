"""Runs of studies: workers evaluate the chunks, and their rows become parts of the results.

A run that is killed at any point can be continued: a chunk is done once its whole part lies in
the folder. Tasks under way are few, so that memory does not grow with the study.
"""

from __future__ import annotations

import time
from collections import Counter, deque
from collections.abc import Callable, Iterator
from concurrent.futures import FIRST_COMPLETED, CancelledError, Future, wait
from dataclasses import dataclass, field
from pathlib import Path

from explorer.errors import ExplorerError
from explorer.files.packaged import versions
from explorer.numerics.compiled import warm
from explorer.sweep.parts import claim, pyarrow, sound_parts, write_part
from explorer.sweep.rows import Rows, check_study, evaluate, load_kernels, rows_of_dead_workers
from explorer.sweep.study import Study, encode_study
from explorer.sweep.workers import RunError, Workers

# Tasks under way for each worker, so that no worker waits for this process.
AHEAD = 4
# Deaths of its worker after which the designs of a chunk are tried one by one, and after which a
# design tried with nothing else under way is given up.
CHUNK_DEATHS, DESIGN_DEATHS = 2, 3
# Seconds between two calls of `stop`.
STOP_SECONDS = 0.1


@dataclass(frozen=True)
class Progress:
    """Progress of a run.

    Attributes:
        total: Number of designs of the study.
        done: Number of designs with a row.
        kept: Number of designs that had a row when the run began.
        counts: Number of rows of each status.
        seconds: Time since the run began.
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
        """Designs per second in this run; 0 before the first."""
        return (self.done - self.kept) / self.seconds if self.seconds > 0.0 else 0.0

    @property
    def seconds_left(self) -> float | None:
        """Time that the rest takes at this rate, in seconds; None before the first design."""
        return (self.total - self.done) / self.rate if self.rate > 0.0 else None


def run_study(
    study: Study,
    folder: str | Path,
    workers: Workers,
    *,
    limit: int | None = None,
    watch: Callable[[Progress], None] | None = None,
    stop: Callable[[], bool] | None = None,
) -> Progress:
    """Compute the rows that a results folder lacks.

    Args:
        study: The study.
        folder: Folder of its parts; made if it does not exist.
        workers: Executor that evaluates the designs.
        limit: Number of designs after which to end, rounded up to whole chunks.
        watch: Called when the run begins, and after each part that is written.
        stop: Called some times a second; True ends the run and drops unfinished chunks.

    Raises:
        InputError: No design of the study can be made, or the folder belongs to another
            study or is in use.
        StorageError: The folder cannot be written.
        MissingExtraError: Pyarrow is not installed.
        RunError: The workers are gone, or have other versions of the libraries.
    """
    pyarrow()
    check_study(study)
    path = Path(folder)
    with claim(path, study):
        # What is missing is compiled once here, rather than in each worker.
        load_kernels(study)
        warm()
        return _Run(study, path, workers, watch or (lambda _: None)).run(limit, stop)


@dataclass
class _Piece:
    """Designs of a task: those of a chunk, or one of them."""

    chunk: int
    indices: range
    deaths: int = 0


@dataclass
class _Run:
    """One run; see `run_study` for the arguments."""

    study: Study
    folder: Path
    workers: Workers
    watch: Callable[[Progress], None]
    counts: Counter[str] = field(default_factory=Counter[str])
    retries: deque[_Piece] = field(default_factory=deque[_Piece])
    # Designs whose evaluation may have killed a worker; each is tried alone.
    suspects: deque[_Piece] = field(default_factory=deque[_Piece])
    under_way: dict[Future[Rows], _Piece] = field(default_factory=dict[Future[Rows], _Piece])
    # Rows of the chunks that have no part yet.
    pending: dict[int, list[Rows]] = field(default_factory=dict[int, list[Rows]])
    kept: int = 0
    began: float = 0.0

    def run(self, limit: int | None, stop: Callable[[], bool] | None) -> Progress:
        """Compute the missing rows."""
        written: set[int] = set()
        # Damaged parts are computed again.
        for _, chunk, table in sound_parts(self.folder, [], self.study):
            written.add(chunk)
            self.counts.update(table.column("status").to_pylist())
        self.kept, self.began = self.counts.total(), time.monotonic()
        self.watch(self._progress())
        missing = self._missing(written, limit)
        try:
            while self._submit_tasks(missing):
                if stop is not None and stop():
                    break
                done, _ = wait(self.under_way, timeout=STOP_SECONDS, return_when=FIRST_COMPLETED)
                for future in done:
                    self._collect(future)
        finally:
            for future in self.under_way:
                future.cancel()
        return self._progress()

    def _missing(self, written: set[int], limit: int | None) -> Iterator[_Piece]:
        designs = 0
        for chunk in range(self.study.chunks):
            if limit is not None and designs >= limit:
                return
            if chunk not in written:
                indices = self.study.rows_of(chunk)
                designs += len(indices)
                self.pending[chunk] = []
                yield _Piece(chunk, indices)

    def _submit_tasks(self, missing: Iterator[_Piece]) -> bool:
        """Keep the workers busy; return whether any task is under way."""
        most = AHEAD * self.workers.size
        while len(self.under_way) < most:
            piece = self.retries.popleft() if self.retries else next(missing, None)
            if piece is None:
                break
            self._submit(piece)
        if not self.under_way and self.suspects:
            self._submit(self.suspects.popleft())
        return bool(self.under_way)

    def _submit(self, piece: _Piece) -> None:
        study, rows = encode_study(self.study), piece.indices
        self.under_way[self.workers.submit(evaluate, study, rows.start, rows.stop)] = piece

    def _collect(self, future: Future[Rows]) -> None:
        """Add the rows of a task, or queue it again if its worker died."""
        piece = self.under_way.pop(future)
        try:
            rows = future.result()
        except self.workers.died:
            self._retry(piece)
            return
        except CancelledError:
            raise RunError(
                "the scheduler dropped the tasks; finished parts are kept, and the same "
                "command continues"
            ) from None
        except ExplorerError:
            raise
        except Exception as error:
            raise RunError(
                f"the workers cannot do the tasks: {type(error).__name__}: {error}"
            ) from error
        if rows.versions != versions():
            there, here = (
                ", ".join(map(" ".join, each.items())) for each in (rows.versions, versions())
            )
            raise RunError(
                f"the workers have other versions than this process: {there} there, {here} "
                "here; install the same everywhere"
            )
        self._add(piece.chunk, rows)

    def _retry(self, piece: _Piece) -> None:
        """Queue a task again whose worker died.

        The designs of a chunk are tried one by one after some deaths, and in the end each with
        nothing else under way: a scheduler blames all tasks that a dead worker had.
        """
        piece.deaths += 1
        if len(piece.indices) > 1:
            if piece.deaths < CHUNK_DEATHS:
                self.retries.append(piece)
            else:
                self.retries.extend(
                    _Piece(piece.chunk, range(index, index + 1)) for index in piece.indices
                )
        elif piece.deaths <= DESIGN_DEATHS:
            self.suspects.append(piece)
        else:
            reason = f"{DESIGN_DEATHS} workers in a row died of it, with nothing else under way"
            self._add(piece.chunk, rows_of_dead_workers(self.study, piece.indices, reason))

    def _add(self, chunk: int, rows: Rows) -> None:
        """Add rows of a chunk, and write its part once all are there."""
        pieces = self.pending[chunk]
        pieces.append(rows)
        if sum(len(piece.indices) for piece in pieces) < len(self.study.rows_of(chunk)):
            return
        del self.pending[chunk]
        pieces.sort(key=lambda piece: piece.indices.start)
        write_part(self.folder, self.study, chunk, pieces)
        for piece in pieces:
            self.counts.update(str(status) for status in piece.columns["status"])
        self.watch(self._progress())

    def _progress(self) -> Progress:
        return Progress(
            total=self.study.count,
            done=self.counts.total(),
            kept=self.kept,
            counts=dict(self.counts),
            seconds=time.monotonic() - self.began,
        )
