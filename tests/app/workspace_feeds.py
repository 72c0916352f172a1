"""The feeds of the workspace, with a worker that draws at once when it is told to."""

from __future__ import annotations

from services import StubWorker, services_for

from explorer.app.features.feature import Services
from explorer.app.features.workspace.feature import WORKSPACE
from explorer.app.features.workspace.feed import WorkspaceFeed
from explorer.app.features.workspace.tasks import WorkspaceDrawing
from explorer.app.state.frame import Frame
from explorer.app.state.state import State


def follow(services: Services, state: State) -> StubWorker:
    """Have both feeds of the workspace request and get what a state needs."""
    worker = services.worker
    assert isinstance(worker, StubWorker)
    for kind in WORKSPACE.feeds:
        services.get(kind).follow(Frame(state))
    worker.work()
    return worker


def drawing_of(state: State) -> WorkspaceDrawing:
    """Return the drawing of the workspace of a state."""
    services = services_for()
    follow(services, state)
    drawing = services.get(WorkspaceFeed).drawing
    assert drawing is not None
    return drawing
