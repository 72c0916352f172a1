"""A tab that goes from test to test, begun anew for each."""

from __future__ import annotations

from collections.abc import Callable, Generator
from contextlib import contextmanager
from dataclasses import dataclass

import pytest
from tab import Tab

OpenTab = Callable[[], Tab]


@dataclass
class KeptTab:
    """The tab that goes from test to test, since an explorer and a page take seconds to start.

    Attributes:
        open: Function that starts an explorer and opens the tab.
        tidy: Function that removes what a test has left, before the next one begins.
        tab: The tab; None before it is opened, and after a test that failed in it.
    """

    open: Callable[[], Tab]
    tidy: Callable[[Tab], None] = lambda _: None
    tab: Tab | None = None

    def begin(self, *, draws: bool = False) -> Tab:
        """Return the tab as if it was opened now, drawing its scene or not."""
        if self.tab is None:
            self.tab = self.open()
            self.tab.settle()
        else:
            self.tidy(self.tab)
            self.tab.begin_anew()
        self.tab.draw(draws)
        return self.tab

    def close(self) -> None:
        """Close the tab and stop its explorer; the next test starts others."""
        if self.tab is not None:
            self.tab.close()
            self.tab.running.stop()
            self.tab = None

    @contextmanager
    def watch(
        self, request: pytest.FixtureRequest, capfd: pytest.CaptureFixture[str]
    ) -> Generator[list[Tab]]:
        """Yield a list for the tabs of a test, this one first; none may have complained."""
        failures = request.session.testsfailed
        tabs: list[Tab] = []
        yield tabs
        complaints = [complaint for tab in tabs for complaint in tab.complaints()]
        for tab in tabs[1:]:
            tab.close()
        error = capfd.readouterr().err
        if complaints or error or request.session.testsfailed > failures:
            self.close()
        assert not complaints, complaints
        assert error == ""
