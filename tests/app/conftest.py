"""What the tests of the page share: a server without a browser, and a session with hands."""

from __future__ import annotations

from collections.abc import Generator

import pytest
import viser
from desk import Desk

from explorer.app.browser.viser_gaps import start_viser, stop_viser
from explorer.app.state.state import opened
from explorer.mechanism.design_file import PRESETS


@pytest.fixture(scope="module")
def server() -> Generator[viser.ViserServer]:
    made = start_viser("127.0.0.1", 0)
    yield made
    stop_viser(made)


@pytest.fixture
def desk() -> Generator[Desk]:
    made = Desk(opened(PRESETS["paper-optimal"]))
    yield made
    made.session.stop()
