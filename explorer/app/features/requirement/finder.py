"""The search for machines in a process of its own, and what it has found so far."""

from __future__ import annotations

from explorer.app.features.feature import Services
from explorer.app.features.requirement.state import CHECK_FEED, EXAMPLE, find_machines
from explorer.app.session.session import Who
from explorer.find.answers import FoundDesigns
from explorer.find.requirement import Requirement
from explorer.jobs.jobs import LongJob
from explorer.jobs.process import CANCELLED

FIND = "find"
"""Name of the process of the searches."""

DIED = "the process of the search died; “Find machines” starts it again"
# Seconds after which the process of a cancelled search is ended.
PATIENCE = 2.0


class Finder:
    """Starts and cancels searches.

    Attributes:
        found: What the last search has found; None before its first answer.
        job: The search that is under way; None if none is.
    """

    def __init__(self, services: Services) -> None:
        self._services = services
        self.requirement = EXAMPLE
        self.found: FoundDesigns | None = None
        self.job: LongJob | None = None
        self._count = 0

    def prepare(self) -> None:
        """Start the processes of searches and checks, before they are needed."""
        for process in (FIND, CHECK_FEED.process):
            self._services.jobs.prepare(process, [find_machines.__module__])

    def start(self, requirement: Requirement, who: Who = None) -> None:
        """Search for machines, in place of a search that is under way."""
        self.cancel()
        self._count += 1
        number, self.requirement, self.found = self._count, requirement, None

        def receive(found: FoundDesigns | None, *, is_last: bool = False) -> None:
            # What an earlier search still sends is dropped.
            if number == self._count:
                self.found, self.job = found or self.found, None if is_last else self.job
                self._services.session.redraw()

        def end(ending: FoundDesigns | str) -> None:
            if isinstance(ending, str) and ending != CANCELLED:
                self._services.complain(ending, who)
            receive(None if isinstance(ending, str) else ending, is_last=True)

        arguments, jobs = (requirement,), self._services.jobs
        self.job = jobs.start(find_machines, arguments, end, end, receive, process=FIND, died=DIED)
        self._services.session.redraw()

    def cancel(self) -> None:
        """End the search; what it has found is kept."""
        if self.job is not None:
            self.job.cancel(PATIENCE)
