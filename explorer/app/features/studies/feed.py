"""Keeps the plots of the open study in step with what is brushed, picked and computed.

It reads and draws on a thread of its own, only what is new, so that nothing of it is in the
way of a hand on a slider.
"""

from __future__ import annotations

import itertools
import threading
import time
from collections import Counter
from collections.abc import Callable, Sequence
from dataclasses import dataclass, replace
from pathlib import Path

import numpy as np

from explorer.app.features.studies.figures import encoded, parallel, scatter
from explorer.app.features.studies.folders import StudyFolders, study_in
from explorer.app.features.studies.shown import Shown, ordered_front, shown
from explorer.app.session.jobs import LatestWins
from explorer.app.state.frame import Frame
from explorer.app.state.studies import Studies, StudyWish
from explorer.errors import ExplorerError, InputError
from explorer.numerics.arrays import BoolArray, IntArray
from explorer.sweep.parts import pyarrow
from explorer.sweep.results import Results, load_results
from explorer.sweep.rows import columns_of
from explorer.sweep.study import Study

MOST_ON_PAGE = 100_000
"""Designs of the largest study that the page shows."""

NO_WISH = StudyWish()


class PlotJson:
    """A figure as viser takes one, made already.

    Args:
        text: The figure as JSON.
    """

    def __init__(self, text: str) -> None:
        self.text = text

    def to_json(self) -> str:
        """Return the figure as JSON."""
        return self.text


@dataclass(frozen=True)
class Request:
    """What is to be drawn.

    Attributes:
        studies: What is looked at, and how; without the wish, which changes nothing.
        version: Of what has been computed.
        dark: Whether the page is dark.
    """

    studies: Studies
    version: int
    dark: bool


@dataclass(frozen=True)
class StudyDrawing:
    """A study as it is drawn.

    Attributes:
        request: What was asked for.
        results: All rows so far.
        front: Rows on the Pareto front, the best in the first objective first.
        inside: Which rows lie within all brushes, shape (n,).
        shown: What the plots show; None while there is nothing to show.
        plots: The parallel lines, and the scatter plot.
        reasons: How many rows are not done, by status and reason, most frequent first.
    """

    request: Request
    results: Results
    front: IntArray
    inside: BoolArray
    shown: Shown | None
    plots: tuple[PlotJson, PlotJson] | None
    reasons: tuple[tuple[str, str, int], ...]

    @property
    def study(self) -> Study:
        """The study."""
        return self.results.study

    @property
    def is_complete(self) -> bool:
        """Whether every design has its row."""
        return self.results.count >= self.study.count

    @property
    def front_inside(self) -> IntArray:
        """The rows of the front that lie within all brushes."""
        return self.front[self.inside[self.front]]

    def row_of(self, index: int) -> int:
        """Return the row of a design.

        Raises:
            InputError: it has none.
        """
        found = np.flatnonzero(self.results.columns["index"] == index)
        if not len(found):
            raise InputError(f"design {index} has not been computed yet")
        return int(found[0])

    def beside(self, picked: int | None, step: int) -> int | None:
        """Return the index of the design a step along the front; None where there is none.

        Args:
            picked: The index of the design to go from; the first of the front if it is not
                on it.
            step: 1 for the next one, −1 for the one before.
        """
        indices: list[int] = self.results.columns["index"][self.front_inside].tolist()
        if not indices:
            return None
        if picked not in indices:
            return indices[0]
        at = indices.index(picked) + step
        return indices[at] if 0 <= at < len(indices) else None


class StudyFeed:
    """Reads and draws the open study.

    Args:
        folders: Where studies lie.
        redraw: Called when something new is there.
        inbox: The id of the control that events of the plots go to.
    """

    def __init__(
        self, folders: StudyFolders, redraw: Callable[[], None], inbox: Callable[[], str]
    ) -> None:
        self.folders = folders
        # Here and not on the thread, which would draw while the page is being made.
        self.names = tuple(folders.found())
        self.problem: str | None = None
        self._redraw = redraw
        self._inbox = inbox
        self._version = itertools.count(1)
        self._revision = itertools.count(1)
        self._lock = threading.Lock()
        self._computed = 0
        self._seen: tuple[Studies, int, bool] | None = None
        self._asked: Request | None = None
        self._drawing: StudyDrawing | None = None
        # Of the thread alone: what was read last.
        self._read: tuple[tuple[str, int], Results, BoolArray] | None = None
        self._jobs: LatestWins[Request | None] = LatestWins(self._do, "studies")

    @property
    def drawing(self) -> StudyDrawing | None:
        """The newest drawing of the open study."""
        found, asked = self._drawing, self._asked
        if found is None or asked is None or found.request.studies.name != asked.studies.name:
            return None
        return found

    @property
    def is_current(self) -> bool:
        """Whether the drawing is what was last asked for."""
        return self._asked is None or (
            self._drawing is not None and self._drawing.request == self._asked
        )

    def follow(self, frame: Frame, *, dark: bool = False) -> None:
        """Have the study drawn that a frame shows, unless it is drawn already."""
        studies = frame.state.studies
        seen = (studies, self._computed, dark)
        if self._seen is not None and all(
            a is b or a == b for a, b in zip(seen, self._seen, strict=True)
        ):
            return
        self._seen = seen
        if studies.name is None:
            self._asked = self._drawing = self.problem = None
            return
        request = Request(replace(studies, wish=NO_WISH), self._computed, dark)
        if request != self._asked:
            self._asked = request
            self._jobs.post("draw", time.monotonic(), request)

    def look(self) -> None:
        """Look again which studies there are; this returns at once."""
        self._jobs.post("look", time.monotonic(), None)

    def refresh(self) -> None:
        """Say that more has been computed."""
        with self._lock:
            self._computed = next(self._version)
        self._redraw()

    def wait_until_idle(self, timeout: float = 10.0) -> bool:
        """Wait until all that was asked for is drawn; say whether it is."""
        return self._jobs.wait_until_idle(timeout)

    def stop(self) -> None:
        """End the thread."""
        self._jobs.stop()

    def _do(self, requests: Sequence[Request | None]) -> None:
        for request in requests:
            if request is None:
                self.names = tuple(self.folders.found())
                continue
            try:
                self._drawing, self.problem = self._drawn(request), None
            except ExplorerError as error:
                self._drawing, self.problem = None, str(error)
            except Exception as error:  # noqa: BLE001 - a bad file must not end the thread
                message = f"the study cannot be drawn: {type(error).__name__}: {error}"
                self._drawing, self.problem = None, message
        self._redraw()

    def _drawn(self, request: Request) -> StudyDrawing:
        results, front = self._results(str(request.studies.name), request.version)
        seen = shown(results, front, request.studies)
        if seen is None:
            plots, inside = None, np.ones(results.count, dtype=np.bool_)
        else:
            revision, inbox = next(self._revision), self._inbox()
            plots, inside = (
                (
                    PlotJson(encoded(parallel(seen, inbox, revision, dark=request.dark))),
                    PlotJson(encoded(scatter(seen, inbox, revision, dark=request.dark))),
                ),
                seen.inside,
            )
        ordered = ordered_front(results, front)
        return StudyDrawing(request, results, ordered, inside, seen, plots, reasons(results))

    def _results(self, name: str, version: int) -> tuple[Results, BoolArray]:
        key = (name, version)
        if self._read is None or self._read[0] != key:
            results = results_in(self.folders.folder(name))
            self._read = (key, results, results.front())
        return self._read[1:]


def results_in(folder: Path) -> Results:
    """Return the rows of a study as far as they have been computed, though there be none.

    Raises:
        InputError: the folder holds no study, or one of too many designs for the page.
        MissingExtraError: pyarrow is not installed.
    """
    pyarrow()
    study = study_in(folder)
    if study.count > MOST_ON_PAGE:
        raise InputError(
            f"{study.name} has {study.count} designs and the page shows studies of up to "
            f"{MOST_ON_PAGE}; explorer sweep --summary prints its front"
        )
    try:
        return load_results(folder)
    except InputError:
        if any(folder.glob("part-*")):
            raise
    types = {"count": np.int64, "number": np.float64, "flag": np.float64, "text": object}
    kinds = columns_of(study)
    return Results(study, {name: np.zeros(0, dtype=types[kind]) for name, kind in kinds.items()})


def reasons(results: Results) -> tuple[tuple[str, str, int], ...]:
    """Return how many rows are not done, by status and reason, most frequent first."""
    columns = results.columns
    odd = columns["status"] != "done"
    pairs = zip(columns["status"][odd].tolist(), columns["reason"][odd].tolist(), strict=True)
    counted = Counter((str(status), str(reason or "")) for status, reason in pairs)
    return tuple((*pair, count) for pair, count in counted.most_common())
