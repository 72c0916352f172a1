"""What the tests of the page share: a server without a browser, a session, and services."""

from __future__ import annotations

from collections.abc import Generator

import pytest
import viser
from desk import Desk
from services import StubJobs, services_for

from explorer.app.features.feature import Services
from explorer.app.features.optimise.runner import SEARCH
from explorer.app.features.studies.folders import StudyFolders
from explorer.app.server import Running, start
from explorer.app.state.state import open_state
from explorer.app.state.view import View
from explorer.app.storage.user_data import open_user_data
from explorer.app.widgets.buttons import Buttons
from explorer.jobs.jobs import Jobs
from explorer.mechanism.design_file import PRESETS
from explorer.page.browser.viser_server import start_viser, stop_viser


@pytest.fixture(scope="module")
def server() -> Generator[viser.ViserServer]:
    made = start_viser("127.0.0.1", 0)
    yield made
    stop_viser(made)


@pytest.fixture
def buttons(server: viser.ViserServer) -> Generator[Buttons]:
    made = Buttons(server)
    yield made
    made.stop()


@pytest.fixture
def desk() -> Generator[Desk]:
    # Controls then show what the state has.
    made = Desk(open_state(PRESETS["paper-optimal"], view=View(lengths="design units")))
    yield made
    made.session.stop()


@pytest.fixture
def jobs() -> Generator[StubJobs]:
    made = StubJobs()
    yield made
    made.stop()


@pytest.fixture(scope="module")
def idle_jobs() -> Generator[None]:
    """Give pages jobs that compute nothing but searches."""

    def make_jobs(*_: object, **__: object) -> StubJobs:
        return StubJobs(real=(SEARCH,))

    with pytest.MonkeyPatch.context() as patch:
        patch.setattr("explorer.app.page.Jobs", make_jobs)
        yield


@pytest.fixture(scope="module")
def running(tmp_path_factory: pytest.TempPathFactory) -> Generator[Running]:
    """An explorer with every feature: its page offers saved designs and studies."""
    studies = StudyFolders(tmp_path_factory.mktemp("studies"))
    made = start(
        PRESETS["paper-optimal"], port=0, user_data=open_user_data(resume=False), studies=studies
    )
    yield made
    made.stop()


@pytest.fixture
def services(
    server: viser.ViserServer, desk: Desk, jobs: Jobs, buttons: Buttons
) -> Generator[Services]:
    made = services_for(server, desk.session, jobs, buttons=buttons, complain=desk.complain)
    yield made
    made.stop()
