"""The plots of the open study, in step with its brushes, its pick and its new results.

The process of the page reads and draws them, so that the controls stay quick.
"""

from __future__ import annotations

import itertools
from collections import Counter
from collections.abc import Callable
from dataclasses import dataclass, replace
from functools import lru_cache
from pathlib import Path
from typing import TypeAlias

import numpy as np

from explorer.app.features.studies.figures import PlotRows, lines_html, points_html, select_rows
from explorer.app.features.studies.folders import StudyFolders, study_in
from explorer.app.features.studies.state import Studies, StudyPlan
from explorer.app.session.feed import Feed, FeedOf
from explorer.app.state.frame import Frame
from explorer.app.state.view import View
from explorer.errors import ExplorerError, InputError
from explorer.jobs.jobs import Jobs
from explorer.numerics.arrays import BoolArray, IntArray
from explorer.numerics.number_text import Unit, format_number
from explorer.sweep.parts import pyarrow
from explorer.sweep.results import Results, costs, load_results

MOST_ON_PAGE = 100_000
"""Number of designs of the largest study that the page shows."""


Request: TypeAlias = tuple[StudyFolders, Studies, View, int]
"""What is drawn: the folders, the studies without the plan, the unit of lengths, the version of the
results."""


@dataclass(frozen=True)
class StudyDrawing:
    """A study that has been drawn.

    Attributes:
        studies: Open study, brushes, axes and pick; without the plan, which changes nothing.
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


class StudyFeed(Feed[Request, StudyDrawing]):
    """The feed of the open study, and the names of all studies; each change calls `redraw`."""

    def __init__(self, folders: StudyFolders, jobs: Jobs, redraw: Callable[[], None]) -> None:
        super().__init__(FeedOf(draw_study, self._request_of, in_scene=False), jobs, redraw)
        self.folders, self._redraw = folders, redraw
        self.names = tuple(folders.by_name())
        self._version = itertools.count(1)
        self._computed = 0

    @property
    def drawing(self) -> StudyDrawing | None:
        """The newest drawing of the open study."""
        drawing, request = super().drawing, self.request
        if drawing is None or request is None:
            return None
        return drawing if drawing.studies.name == request[1].name else None

    def look(self) -> None:
        """List the studies again."""
        self.names = tuple(self.folders.by_name())
        self._redraw()

    def refresh(self) -> None:
        """Draw again, since there are new results."""
        self._computed = next(self._version)
        self._redraw()

    def _request_of(self, frame: Frame) -> Request | None:
        studies, view = Studies.of(frame.state), View(lengths=frame.state.view.lengths)
        if studies.name is None:
            return None
        return self.folders, replace(studies, plan=StudyPlan()), view, self._computed


def draw_study(request: Request) -> StudyDrawing:
    """Return a study, read and drawn.

    Raises:
        InputError: There is no such study, or it is too large or damaged.
    """
    folders, studies, view, version = request
    try:
        results, front = _results(folders.folder(str(studies.name)), version)
        lengths, plots = view.unit_for(results.study.base), ("", "")
        seen = select_rows(results, lengths, front, studies)
        inside = np.ones(results.count, dtype=np.bool_) if seen is None else seen.inside
        if seen is not None:
            plots = lines_html(seen), points_html(seen)
        ordered = sort_front(results, front)
        why = reasons(results)
    except ExplorerError:
        raise
    except Exception as error:
        # A bad file is no error of the explorer.
        kind = type(error).__name__
        raise InputError(f"the study cannot be drawn: {kind}: {error}") from error
    return StudyDrawing(studies, results, lengths, ordered, inside, seen, plots, why)


@lru_cache(maxsize=1)
def _results(folder: Path, _: int) -> tuple[Results, BoolArray]:
    """Return the rows in a folder and which are on the front, for a version of the results."""
    pyarrow()
    study = study_in(folder)
    if study.count > MOST_ON_PAGE:
        raise InputError(
            f"{study.name} has {format_number(study.count)} designs and the page shows "
            f"studies of up to {format_number(MOST_ON_PAGE)}; explorer sweep --summary "
            "prints its front"
        )
    results = load_results(folder, study)
    return results, results.front()


def reasons(results: Results) -> tuple[tuple[str, str, int], ...]:
    """Return counts of the rows that are not done, by status and reason, most frequent first."""
    columns = results.columns
    not_done = columns["status"] != "done"
    pairs = zip(columns["status"][not_done], columns["reason"][not_done], strict=True)
    return tuple((*pair, count) for pair, count in Counter(pairs).most_common())


def sort_front(results: Results, front: BoolArray) -> IntArray:
    """Return the rows on the front, given for each row, the best in the first objective first."""
    rows = np.flatnonzero(front)
    if not len(rows):
        return rows
    first = costs(results.columns, results.study.objectives[:1])[rows, 0]
    return rows[np.argsort(first, kind="stable")]
