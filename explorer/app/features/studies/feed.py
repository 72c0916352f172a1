"""The plots of the open study, in step with its brushes, its pick and its new results.

A thread of its own reads and draws them, so that the controls of the page stay quick.
"""

from __future__ import annotations

import itertools
import time
from collections import Counter
from collections.abc import Callable, Sequence
from dataclasses import dataclass, replace
from typing import TypeAlias

import numpy as np

from explorer.app.features.studies.figures import PlotRows, lines_html, points_html, select_rows
from explorer.app.features.studies.folders import StudyFolders, study_in
from explorer.app.features.studies.state import Studies, StudyPlan
from explorer.app.state.frame import Frame
from explorer.app.state.view import View
from explorer.errors import ExplorerError, InputError
from explorer.numerics.arrays import BoolArray, IntArray
from explorer.numerics.number_text import Unit, format_number
from explorer.page.session.latest import LatestWins
from explorer.sweep.parts import pyarrow
from explorer.sweep.results import Results, costs, load_results

MOST_ON_PAGE = 100_000
"""Number of designs of the largest study that the page shows."""


Request: TypeAlias = tuple[Studies, View, int]
"""What is drawn: the studies without the plan, the unit of lengths, the version of the results."""


@dataclass(frozen=True)
class StudyDrawing:
    """A study that has been drawn.

    Attributes:
        studies: Open study, brushes, axes and pick; without the plan, which changes nothing.
        results: All rows so far.
        lengths: Unit in which lengths are written.
        front: Rows on the Pareto front, the best in the first objective first.
        inside: Whether each row lies within all brushes, shape (n,).
        plotted: Rows and axes of the plots; None while there is nothing to show.
        plots: The lines and the points as HTML; empty while there is nothing to show.
        reasons: Counts of the rows that are not done, by status and reason, most frequent first.
    """

    studies: Studies
    results: Results
    lengths: Unit
    front: IntArray
    inside: BoolArray
    plotted: PlotRows | None
    plots: tuple[str, str]
    reasons: tuple[tuple[str, str, int], ...]

    @property
    def is_complete(self) -> bool:
        """Whether every design has its row."""
        return self.results.count >= self.results.study.count

    @property
    def front_inside(self) -> IntArray:
        """The rows of the front that lie within all brushes."""
        return self.front[self.inside[self.front]]


class StudyFeed:
    """Thread that reads and draws the open study.

    Args:
        folders: Folders of the studies.
        redraw: Called after each drawing.
    """

    def __init__(self, folders: StudyFolders, redraw: Callable[[], None]) -> None:
        self.folders = folders
        # Read here: the thread would redraw a page that is not complete yet.
        self.names = tuple(folders.by_name())
        self.problem: str | None = None
        self._redraw = redraw
        self._version = itertools.count(1)
        self._computed = 0
        self._request: Request | None = None
        self._drawing: StudyDrawing | None = None
        # Results that were read last; only the thread uses them.
        self._read: tuple[tuple[str, int], Results, BoolArray] | None = None
        self._jobs: LatestWins[Request | None] = LatestWins(self._do, "studies")

    @property
    def drawing(self) -> StudyDrawing | None:
        """The newest drawing of the open study."""
        drawing, request = self._drawing, self._request
        if drawing is None or request is None:
            return None
        return drawing if drawing.studies.name == request[0].name else None

    def follow(self, frame: Frame) -> None:
        """Draw the study of a frame, unless it is drawn already."""
        studies = Studies.of(frame.state)
        if studies.name is None:
            self._request = self._drawing = self.problem = None
            return
        view = View(lengths=frame.state.view.lengths)
        request = replace(studies, plan=StudyPlan()), view, self._computed
        if request != self._request:
            self._request = request
            self._jobs.post("draw", time.monotonic(), request)

    def look(self) -> None:
        """List the studies again; this returns at once."""
        self._jobs.post("look", time.monotonic(), None)

    def refresh(self) -> None:
        """Draw again, since there are new results."""
        self._computed = next(self._version)
        self._redraw()

    def wait_until_idle(self, timeout: float = 10.0) -> bool:
        """Wait until all requests are done; return whether they are."""
        return self._jobs.wait_until_idle(timeout)

    def stop(self) -> None:
        """End the thread."""
        self._jobs.stop()

    def _do(self, requests: Sequence[Request | None]) -> None:
        for request in requests:
            if request is None:
                self.names = tuple(self.folders.by_name())
                continue
            try:
                self._drawing, self.problem = self._draw(*request), None
            except Exception as error:  # noqa: BLE001 - a bad file must not end the thread
                is_known = isinstance(error, ExplorerError)
                why = "" if is_known else f"the study cannot be drawn: {type(error).__name__}: "
                self._drawing, self.problem = None, f"{why}{error}"
        self._redraw()

    def _draw(self, studies: Studies, view: View, version: int) -> StudyDrawing:
        results, front = self._results(str(studies.name), version)
        lengths, plots = view.unit_for(results.study.base), ("", "")
        seen = select_rows(results, lengths, front, studies)
        inside = np.ones(results.count, dtype=np.bool_) if seen is None else seen.inside
        if seen is not None:
            plots = lines_html(seen), points_html(seen)
        ordered = sort_front(results, front)
        why = reasons(results)
        return StudyDrawing(studies, results, lengths, ordered, inside, seen, plots, why)

    def _results(self, name: str, version: int) -> tuple[Results, BoolArray]:
        key = (name, version)
        if self._read is None or self._read[0] != key:
            pyarrow()
            folder = self.folders.folder(name)
            study = study_in(folder)
            if study.count > MOST_ON_PAGE:
                raise InputError(
                    f"{study.name} has {format_number(study.count)} designs and the page shows "
                    f"studies of up to {format_number(MOST_ON_PAGE)}; explorer sweep --summary "
                    "prints its front"
                )
            results = load_results(folder, study)
            self._read = (key, results, results.front())
        return self._read[1:]


def reasons(results: Results) -> tuple[tuple[str, str, int], ...]:
    """Return counts of the rows that are not done, by status and reason, most frequent first."""
    columns = results.columns
    not_done = columns["status"] != "done"
    pairs = zip(columns["status"][not_done], columns["reason"][not_done], strict=True)
    return tuple((*pair, count) for pair, count in Counter(pairs).most_common())


def sort_front(results: Results, front: BoolArray) -> IntArray:
    """Return the rows on the front, the best in the first objective first.

    Args:
        results: All rows.
        front: Whether each row is on the front, shape (n,).
    """
    rows = np.flatnonzero(front)
    if not len(rows):
        return rows
    first = costs(results.columns, results.study.objectives[:1])[rows, 0]
    return rows[np.argsort(first, kind="stable")]
