"""A browser, an explorer and a tab of it for the whole run, begun anew for each test."""

from __future__ import annotations

from collections.abc import Callable, Iterator
from dataclasses import dataclass

import pytest
from graphics import quick_browser
from playwright.sync_api import Browser, expect
from tab import Tab

from explorer.app.screenshot import PATIENCE_SECONDS
from explorer.app.server import Running, start
from explorer.mechanism.design_file import PRESETS

OpenTab = Callable[[], Tab]

expect.set_options(timeout=1000 * PATIENCE_SECONDS)


@dataclass
class KeptTab:
    """The tab that goes from test to test, since an explorer and a page take seconds to start.

    Attributes:
        tab: The tab; None before it is opened, and after a test that failed in it.
    """

    tab: Tab | None = None

    def begin(self, browser: Browser) -> Tab:
        """Return the tab as if it was opened now."""
        if self.tab is None:
            self.tab = Tab(browser, start(PRESETS["paper-optimal"], port=0))
        else:
            self.tab.begin_anew()
        return self.tab

    def close(self) -> None:
        """Close the tab and stop its explorer; the next test starts others."""
        if self.tab is not None:
            self.tab.close()
            self.tab.running.stop()
            self.tab = None


@pytest.fixture(scope="session")
def browser() -> Iterator[Browser]:
    """A Chromium; without one every test that needs it fails and says how to get one."""
    with quick_browser() as browser:
        yield browser


@pytest.fixture(scope="session")
def kept_tab(browser: Browser) -> Iterator[KeptTab]:
    """The tab that tests hand on."""
    del browser  # It is closed later.
    kept = KeptTab()
    yield kept
    kept.close()


@pytest.fixture
def running(capfd: pytest.CaptureFixture[str]) -> Iterator[Running]:
    """An explorer with the paper's optimum; none of its threads may have failed in the end."""
    running = start(PRESETS["paper-optimal"], port=0)
    yield running
    running.stop()
    assert capfd.readouterr().err == ""


@pytest.fixture
def open_tab(
    request: pytest.FixtureRequest,
    browser: Browser,
    kept_tab: KeptTab,
    capfd: pytest.CaptureFixture[str],
) -> Iterator[OpenTab]:
    """Open tabs of one explorer, the kept one first; at the end none may have complained."""
    tabs: list[Tab] = []
    failures = request.session.testsfailed

    def opened() -> Tab:
        tab = Tab(browser, tabs[0].running) if tabs else kept_tab.begin(browser)
        tabs.append(tab)
        return tab

    yield opened
    complaints = [complaint for tab in tabs for complaint in tab.complaints()]
    for tab in tabs[1:]:
        tab.close()
    error = capfd.readouterr().err
    if complaints or error or request.session.testsfailed > failures:
        kept_tab.close()
    assert complaints == []
    assert error == ""


@pytest.fixture
def tab(open_tab: OpenTab) -> Tab:
    """A tab of the explorer."""
    return open_tab()
