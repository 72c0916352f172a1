"""Drawings of feeds, with a worker that computes on request; those of the workspace."""

from __future__ import annotations

from collections.abc import Callable
from typing import Any, TypeVar

from services import StubWorker, services_for

from explorer.app.features.feature import Services
from explorer.app.features.workspace.feature import WORKSPACE
from explorer.app.features.workspace.feeds import WORKSPACE_FEED
from explorer.app.features.workspace.work import WorkspaceDrawing
from explorer.app.session.feed import Feed
from explorer.app.state.frame import Frame
from explorer.app.state.state import State

Drawing = TypeVar("Drawing")


def follow(services: Services, state: State) -> StubWorker:
    """Have both feeds of the workspace request and get what a state needs."""
    worker = services.worker
    assert isinstance(worker, StubWorker)
    for kind in WORKSPACE.feeds:
        services.get(kind).follow(Frame(state))
    worker.work()
    return worker


def draw(
    services: Services, kind: Callable[[Services], Feed[Any, Drawing]], state: State
) -> Drawing:
    """Have a feed request the drawing of a state; return it."""
    worker, feed = services.worker, services.get(kind)
    assert isinstance(worker, StubWorker)
    feed.follow(Frame(state))
    worker.work()
    assert feed.drawing is not None
    return feed.drawing


def drawing_of(state: State) -> WorkspaceDrawing:
    """Return the drawing of the workspace of a state."""
    services = services_for()
    follow(services, state)
    drawing = services.get(WORKSPACE_FEED).drawing
    assert drawing is not None
    return drawing
