"""A browser, and tabs of two explorers for the whole run, begun anew for each test.

A tab draws its scene only in tests with the mark `draws`, which read pixels or frames.
"""

from __future__ import annotations

import shutil
from collections.abc import Iterator

import pytest
from graphics import quick_browser
from kept_tab import KeptTab, OpenTab
from playwright.sync_api import Browser, expect
from tab import IN_UNITS, Tab

from explorer.app.features.designs.feature import SavedDesigns
from explorer.app.features.studies.feature import StudiesPanel
from explorer.app.features.studies.folders import StudyFolders
from explorer.app.screenshot import PATIENCE_SECONDS
from explorer.app.server import Running, start
from explorer.app.storage.library import Library
from explorer.app.storage.session_file import SessionFile
from explorer.app.storage.user_data import UserData
from explorer.mechanism.design_file import PRESETS

OPTIMAL = PRESETS["paper-optimal"]

expect.set_options(timeout=1000 * PATIENCE_SECONDS)


DRAWS = "draws: the page draws its scene all the time, see Tab"


def pytest_configure(config: pytest.Config) -> None:
    config.addinivalue_line("markers", DRAWS)


def draws(request: pytest.FixtureRequest) -> bool:
    """Whether a test is marked as one in which the page draws its scene all the time."""
    return request.node.get_closest_marker("draws") is not None


@pytest.fixture(scope="session")
def browser() -> Iterator[Browser]:
    """A Chromium; without one every test that needs it fails and says how to get one."""
    with quick_browser() as browser:
        yield browser


@pytest.fixture(scope="session")
def kept_tab(browser: Browser) -> Iterator[KeptTab]:
    """The tab that tests hand on."""
    kept = KeptTab(lambda: Tab(browser, start(OPTIMAL, port=0, view=IN_UNITS), draws=True))
    yield kept
    kept.close()


@pytest.fixture
def running(capfd: pytest.CaptureFixture[str]) -> Iterator[Running]:
    """An explorer with the paper's optimum; none of its threads may have failed in the end."""
    running = start(OPTIMAL, port=0, view=IN_UNITS)
    yield running
    running.stop()
    assert capfd.readouterr().err == ""


@pytest.fixture(scope="session")
def kept_data_tab(browser: Browser, tmp_path_factory: pytest.TempPathFactory) -> Iterator[KeptTab]:
    """The tab of an explorer with the user's data, which tests hand on too."""
    home = tmp_path_factory.mktemp("user")
    designs, studies = home / "designs", home / "studies"

    def open_tab() -> Tab:
        data = UserData(Library(designs), SessionFile(home / "sessions"))
        folders = StudyFolders(studies)
        running = start(OPTIMAL, port=0, view=IN_UNITS, user_data=data, studies=folders)
        return Tab(browser, running)

    def tidy(tab: Tab) -> None:
        for folder in (designs, studies):
            shutil.rmtree(folder, ignore_errors=True)
        services = tab.running.page.services
        services.get(SavedDesigns).refresh()
        services.get(StudiesPanel).feed.look()

    kept = KeptTab(open_tab, tidy)
    yield kept
    kept.close()


@pytest.fixture
def open_tab(
    request: pytest.FixtureRequest,
    browser: Browser,
    kept_tab: KeptTab,
    capfd: pytest.CaptureFixture[str],
) -> Iterator[OpenTab]:
    """Open tabs of one explorer, the kept one first."""
    with kept_tab.watch(request, capfd) as tabs:

        def open_another() -> Tab:
            if tabs:
                tab = Tab(browser, tabs[0].running, draws=draws(request))
            else:
                tab = kept_tab.begin(draws=draws(request))
            tabs.append(tab)
            return tab

        yield open_another


@pytest.fixture
def tab(open_tab: OpenTab) -> Tab:
    """A tab of the explorer."""
    return open_tab()


@pytest.fixture
def data_tab(
    request: pytest.FixtureRequest, kept_data_tab: KeptTab, capfd: pytest.CaptureFixture[str]
) -> Iterator[Tab]:
    """A tab of an explorer with the user's data: saved designs and studies, none at first."""
    with kept_data_tab.watch(request, capfd) as tabs:
        tabs.append(kept_data_tab.begin(draws=draws(request)))
        yield tabs[0]
