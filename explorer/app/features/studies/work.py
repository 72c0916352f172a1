"""Small studies started on the page, computed in a process of their own, one at a time."""

from __future__ import annotations

import threading
import time
from collections.abc import Callable
from dataclasses import dataclass, replace
from pathlib import Path
from typing import TYPE_CHECKING

from explorer.app.features.studies.feed import StudyFeed
from explorer.app.features.studies.folders import keep_study, study_folders, study_in
from explorer.app.features.studies.state import Studies, StudyPlan, open_study, study_around
from explorer.app.session.session import Who
from explorer.errors import ExplorerError
from explorer.files.extras import check_extra
from explorer.jobs.jobs import LongJob
from explorer.jobs.process import Channel
from explorer.mechanism.design import Design
from explorer.sweep.run import Progress, run_study
from explorer.sweep.study import Study
from explorer.sweep.workers import LocalWorkers, cores

if TYPE_CHECKING:
    # The process of the studies needs no viser.
    from explorer.app.features.feature import Services

# Seconds between two drawings of the results so far.
PACE = 2.0
# Seconds after which the process of a cancelled study is ended; workers that are about to begin
# notice late.
PATIENCE = 5.0
DIED = "the study's process died; finished designs are kept; press Continue the study"


@dataclass(frozen=True)
class StudyRun:
    """A study that is being computed in the folder with its name; no progress is known at first."""

    name: str
    study: Study
    progress: Progress | None = None
    is_cancelled: bool = False

    @property
    def share(self) -> float:
        """The share of the designs that are done, from 0 to 1."""
        return 0.0 if self.progress is None else self.progress.done / self.progress.total


def run_in_worker(study: Study, folder: Path, channel: Channel) -> Progress:
    """Compute the missing designs of a study, and send the progress after each part.

    One core remains for the page.

    Raises:
        InputError: The study cannot be run, or the folder is another's or in use.
        StorageError: The folder cannot be written.
        MissingExtraError: Pyarrow is not installed.
        RunError: The workers are gone.
    """
    workers = LocalWorkers(max(1, cores() - 1))
    try:
        return run_study(study, folder, workers, watch=channel.send, stop=channel.is_cancelled)
    finally:
        # Designs of a cancelled study that are being computed are not needed.
        workers.shutdown(cancel_futures=True)


def study_feed(services: Services) -> StudyFeed:
    """Return the drawings of the open study of a page; for `Services.get`."""
    return services.get(StudyRunner).feed


class StudyRunner:
    """Starts, cancels and continues studies of the page; `run` is the present one, or None."""

    def __init__(self, services: Services) -> None:
        self._session, self._jobs = services.session, services.jobs
        self._complain = services.complain
        self.feed = StudyFeed(services.get(study_folders), self._jobs, self._session.redraw)
        self._lock = threading.Lock()
        self.run: StudyRun | None = None
        self._job: LongJob | None = None
        self._drawn = 0.0

    def start(self, design: Design, plan: StudyPlan, who: Who = None) -> None:
        """Start a small study around a design, and open it, or tell the client why it cannot be."""

        def make() -> tuple[str, Study, Path]:
            folder = self.feed.folders.new(design.name)
            study = study_around(design, plan, folder.name)
            # The study can be opened and continued before its first part is there.
            keep_study(folder, study)
            return folder.name, study, folder

        self._begin(make, who)

    def go_on(self, name: str, who: Who = None) -> None:
        """Continue a study that is not complete."""

        def load() -> tuple[str, Study, Path]:
            folder = self.feed.folders.folder(name)
            return name, study_in(folder), folder

        self._begin(load, who)

    def cancel(self) -> None:
        """End the present study; finished designs are kept."""
        with self._lock:
            if self.run is None or self.run.is_cancelled:
                return
            self.run = replace(self.run, is_cancelled=True)
            job = self._job
        if job is not None:
            job.cancel(PATIENCE)
        self._session.redraw()

    def _begin(self, make_study: Callable[[], tuple[str, Study, Path]], who: Who) -> None:
        with self._lock:
            if self.run is not None:
                message = f"the study {self.run.name!r} is being computed: wait, or cancel it"
                self._complain(message, who)
                return
            try:
                check_extra("study")
                name, study, folder = make_study()
            except ExplorerError as error:
                self._complain(str(error), who)
                return
            self.run = StudyRun(name, study)
            self._job = self._jobs.start(
                run_in_worker,
                (study, folder),
                lambda _: self._finish(),
                self._report_failure,
                self._receive,
                process="study",
                died=DIED,
            )
        self.feed.look()
        self._session.do(open_study(name), who=who)

    def _receive(self, progress: Progress) -> None:
        with self._lock:
            if self.run is not None:
                self.run = replace(self.run, progress=progress)
        now = time.monotonic()
        if now - self._drawn >= PACE:
            self._drawn = now
            self.feed.refresh()
        else:
            self._session.redraw()

    def _report_failure(self, problem: str) -> None:
        run = self.run
        self._finish()
        # The process of a cancelled study may have been ended.
        if run is None or run.is_cancelled:
            return
        self._complain(problem, None)
        if run.progress is None and problem != DIED:
            # It was refused: nothing remains of it.
            self.feed.folders.drop(run.name)
            self.feed.look()
            self._session.do(lambda s: open_study(None) if Studies.of(s).name == run.name else None)

    def _finish(self) -> None:
        with self._lock:
            self.run = None
        self.feed.refresh()
