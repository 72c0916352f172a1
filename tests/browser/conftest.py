"""A browser for the whole run, and for each test an explorer of its own and its tabs."""

from __future__ import annotations

from collections.abc import Callable, Iterator

import pytest
from graphics import quick_browser
from playwright.sync_api import Browser, expect
from tab import Tab

from explorer.app.screenshot import PATIENCE_SECONDS
from explorer.app.server import Running, start
from explorer.mechanism.design_file import PRESETS

OpenTab = Callable[[], Tab]

expect.set_options(timeout=1000 * PATIENCE_SECONDS)


@pytest.fixture(scope="session")
def browser() -> Iterator[Browser]:
    """A Chromium; without one every test that needs it fails and says how to get one."""
    with quick_browser() as browser:
        yield browser


@pytest.fixture
def running(capfd: pytest.CaptureFixture[str]) -> Iterator[Running]:
    """An explorer with the paper's optimum; none of its threads may have failed in the end."""
    running = start(PRESETS["paper-optimal"], port=0)
    yield running
    running.stop()
    assert capfd.readouterr().err == ""


@pytest.fixture
def open_tab(browser: Browser, running: Running) -> Iterator[OpenTab]:
    """Open tabs of the explorer; at the end none may have complained."""
    tabs: list[Tab] = []

    def opened() -> Tab:
        tabs.append(Tab(browser, running))
        return tabs[-1]

    yield opened
    complaints = [complaint for tab in tabs for complaint in tab.complaints()]
    for tab in tabs:
        tab.close()
    assert complaints == []


@pytest.fixture
def tab(open_tab: OpenTab) -> Tab:
    """A tab of the explorer."""
    return open_tab()
