"""Drawings of feeds, with a jobs that computes on request; those of the workspace."""

from __future__ import annotations

from collections.abc import Callable
from typing import Any, TypeVar

from services import StubJobs, services_for

from explorer.app.features.feature import Services
from explorer.app.features.workspace.feature import WORKSPACE
from explorer.app.features.workspace.feeds import WORKSPACE_FEED
from explorer.app.features.workspace.work import WorkspaceDrawing
from explorer.app.session.feed import Feed
from explorer.app.state.frame import Frame
from explorer.app.state.state import State

Drawing = TypeVar("Drawing")


def follow(services: Services, state: State) -> StubJobs:
    """Have both feeds of the workspace request and get what a state needs."""
    jobs = services.jobs
    assert isinstance(jobs, StubJobs)
    for kind in WORKSPACE.feeds:
        services.get(kind).follow(Frame(state))
    jobs.work()
    return jobs


def draw(
    services: Services, kind: Callable[[Services], Feed[Any, Drawing]], state: State
) -> Drawing:
    """Have a feed request the drawing of a state; return it."""
    jobs, feed = services.jobs, services.get(kind)
    assert isinstance(jobs, StubJobs)
    feed.follow(Frame(state))
    jobs.work()
    assert feed.drawing is not None
    return feed.drawing


def drawing_of(state: State) -> WorkspaceDrawing:
    """Return the drawing of the workspace of a state."""
    services = services_for()
    follow(services, state)
    drawing = services.get(WORKSPACE_FEED).drawing
    assert drawing is not None
    return drawing
