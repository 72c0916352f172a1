"""Runs small studies from the page in a process of their own, one at a time."""

from __future__ import annotations

import threading
import time
from collections.abc import Callable
from dataclasses import dataclass, replace
from pathlib import Path

from explorer.app.features.studies import tasks
from explorer.app.features.studies.actions import OpenStudy
from explorer.app.features.studies.feed import StudyFeed
from explorer.app.features.studies.folders import keep_study, study_in
from explorer.app.session.faults import Faults
from explorer.app.session.jobs import Worker
from explorer.app.session.session import Session, Who
from explorer.app.state.studies import StudyWish, study_around
from explorer.errors import ExplorerError, InputError
from explorer.mechanism.design import Design
from explorer.sweep.run import Progress
from explorer.sweep.study import Study

# Seconds between two times that what is there is drawn anew.
PACE = 1.0
# Seconds after which a study that was cancelled ends with its process; one that is about to
# begin hears of it late.
PATIENCE = 5.0
DIED = "the study's process died; what is finished is kept, and Go on starts it again"


@dataclass(frozen=True)
class Run:
    """A study that is being computed.

    Attributes:
        name: Of its folder.
        study: The study.
        progress: How far it is; None before the first word of it.
        is_cancelled: Whether it is asked to end.
    """

    name: str
    study: Study
    progress: Progress | None = None
    is_cancelled: bool = False


class StudyRunner:
    """Starts, cancels and goes on with studies of the page.

    Args:
        session: In which they are opened.
        feed: That draws them; it is told when there is more to draw.
        complain: Called with a message for people and the client it is for.
        faults: Where requests are kept that failed unexpectedly; None to keep none.
    """

    def __init__(
        self,
        session: Session,
        feed: StudyFeed,
        complain: Callable[[str, Who], None],
        faults: Faults | None = None,
    ) -> None:
        self.worker = Worker(
            lambda message: complain(message, None),
            preload=[tasks.__name__],
            died=DIED,
            faults=faults,
        )
        self._session = session
        self._feed = feed
        self._complain = complain
        self._lock = threading.Lock()
        self._run: Run | None = None
        self._order = 0
        self._drawn = 0.0

    @property
    def run(self) -> Run | None:
        """The study that is being computed, if one is."""
        return self._run

    def start(self, design: Design, wish: StudyWish, who: Who = None) -> None:
        """Start a small study around a design, and open it.

        Args:
            design: The design.
            wish: What varies and what is measured.
            who: The client to tell should it not be possible.
        """
        self._begin(lambda: self._new(design, wish), who)

    def go_on(self, name: str, who: Who = None) -> None:
        """Go on with a study that is not complete."""

        def known() -> tuple[Study, Path]:
            folder = self._feed.folders.folder(name)
            return study_in(folder), folder

        self._begin(known, who)

    def cancel(self) -> None:
        """End the study under way; what is finished is kept."""
        with self._lock:
            if self._run is None or self._run.is_cancelled:
                return
            self._run = replace(self._run, is_cancelled=True)
            order = self._order
        self.worker.cancel(order, PATIENCE)
        self._session.redraw()

    def wait_until_idle(self, timeout: float = 60.0) -> bool:
        """Wait until no study is under way; say whether none is."""
        return self.worker.wait_until_idle(timeout) and self._run is None

    def stop(self) -> None:
        """End the process."""
        self.worker.stop()

    def _new(self, design: Design, wish: StudyWish) -> tuple[Study, Path]:
        folder = self._feed.folders.new(design.name)
        study = study_around(design, wish, folder.name)
        # So that it can be opened, and gone on with, before its first part is there.
        keep_study(folder, study)
        return study, folder

    def _begin(self, made: Callable[[], tuple[Study, Path]], who: Who) -> None:
        with self._lock:
            if self._run is not None:
                message = f"the study {self._run.name!r} is being computed: wait, or cancel it"
                self._complain(message, who)
                return
            try:
                study, folder = made()
                found = self._feed.folders.found()
                name = next((name for name, path in found.items() if path == folder), None)
                if name is None:
                    raise InputError(f"{str(folder)!r} holds no study")
            except ExplorerError as error:
                self._complain(str(error), who)
                return
            self._run = Run(name, study)
            self._order = self.worker.submit(
                "study", tasks.run, (study, folder), self._ended, self._failed, told=self._told
            )
        self._feed.look()
        self._session.do(OpenStudy(name), who=who)

    def _told(self, progress: Progress) -> None:
        with self._lock:
            if self._run is not None:
                self._run = replace(self._run, progress=progress)
        now = time.monotonic()
        if now - self._drawn >= PACE:
            self._drawn = now
            self._feed.refresh()
        else:
            self._session.redraw()

    def _ended(self, _: Progress) -> None:
        self._over()

    def _failed(self, problem: str) -> None:
        run = self._run
        self._over()
        # One that was cancelled may have had to be ended with its process.
        if run is not None and not run.is_cancelled:
            self._complain(problem, None)

    def _over(self) -> None:
        with self._lock:
            self._run = None
        self._feed.refresh()
