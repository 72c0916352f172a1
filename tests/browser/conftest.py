"""A browser, an explorer and a tab of it for the whole run, begun anew for each test."""

from __future__ import annotations

from collections.abc import Iterator

import pytest
from graphics import quick_browser
from kept_tab import KeptTab, OpenTab
from playwright.sync_api import Browser, expect
from tab import Tab

from explorer.app.screenshot import PATIENCE_SECONDS
from explorer.app.server import Running, start
from explorer.mechanism.design_file import PRESETS

expect.set_options(timeout=1000 * PATIENCE_SECONDS)


@pytest.fixture(scope="session")
def browser() -> Iterator[Browser]:
    """A Chromium; without one every test that needs it fails and says how to get one."""
    with quick_browser() as browser:
        yield browser


@pytest.fixture(scope="session")
def kept_tab(browser: Browser) -> Iterator[KeptTab]:
    """The tab that tests hand on."""
    kept = KeptTab(lambda: Tab(browser, start(PRESETS["paper-optimal"], port=0)))
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
    """Open tabs of one explorer, the kept one first."""
    with kept_tab.watch(request, capfd) as tabs:

        def opened() -> Tab:
            tab = Tab(browser, tabs[0].running) if tabs else kept_tab.begin()
            tabs.append(tab)
            return tab

        yield opened


@pytest.fixture
def tab(open_tab: OpenTab) -> Tab:
    """A tab of the explorer."""
    return open_tab()
