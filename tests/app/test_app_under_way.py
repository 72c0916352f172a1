"""Drawings that take long: they tell their stages, can be cancelled, and are bounded."""

from __future__ import annotations

import threading
from collections.abc import Iterator
from dataclasses import replace
from typing import Any

import msgspec
import pytest
from desk import viewed
from services import StubWorker, services_for

from explorer.app.features.legs.tasks import RadiusRequest, draw_radius_curve
from explorer.app.features.workspace.feed import WorkspaceFeed
from explorer.app.features.workspace.regions import MOST_LIVE_NODES, find_accessible
from explorer.app.features.workspace.tasks import (
    WorkspaceRequest,
    WorkspaceSurface,
    draw_workspace,
)
from explorer.app.features.workspace.words import drawing_words
from explorer.app.session import feed as session_feed
from explorer.app.session.feed import Stage
from explorer.app.session.jobs import Worker
from explorer.app.session.worker import CancelledError, Channel
from explorer.app.state.actions import Set, SetVariable
from explorer.app.state.frame import Frame
from explorer.app.state.state import State, opened
from explorer.app.state.view import WorkspaceView
from explorer.mechanism.design import Design
from explorer.mechanism.design_file import PRESETS
from explorer.mechanism.home import home_pose
from explorer.workspace.accessible.radii import with_radius
from explorer.workspace.slices.volume import workspace_nodes

PATIENCE = 300.0
THICK = with_radius(PRESETS["paper-optimal"], 0.3)
"""With these radii several pairs of legs collide within the limits."""


def rows_of(design: Design) -> tuple[tuple[float, ...], ...]:
    return tuple(tuple(row) for row in home_pose(design).rotation.tolist())


def accessible_request(design: Design, **changes: Any) -> WorkspaceRequest:
    request = WorkspaceRequest(
        design=design,
        rotation=rows_of(design),
        region="accessible",
        start=None,
        colour="plain",
        cut=None,
        level=0.0,
        flipped=False,
        tolerance=0.5,
        hull=False,
        warn_below=1.0,
    )
    return replace(request, **changes)


class Watched:
    """A line that keeps what is told, and cancels at a stage."""

    def __init__(self, last: int | None = None) -> None:
        self.stages: list[Stage] = []
        self.surfaces: list[WorkspaceSurface] = []
        self.line = Channel(self._keep, lambda: len(self.stages) == last)

    def _keep(self, value: Stage | WorkspaceSurface) -> None:
        if isinstance(value, Stage):
            self.stages.append(value)
        else:
            self.surfaces.append(value)


def test_accessible_workspace_reports_each_pair_of_legs_that_it_carves() -> None:
    watched = Watched()
    drawing = draw_workspace(accessible_request(THICK, level=1.0), watched.line)
    assert drawing.accessible is not None
    blocking = [pair.legs for pair in drawing.accessible.pairs if pair.blocked_volume > 0.0]
    assert len(blocking) > 1
    words = " ".join(stage.words for stage in watched.stages)
    assert all(f"legs {first}–{second}" in words for first, second in blocking)
    shares = [stage.share for stage in watched.stages]
    assert shares == sorted(set(shares))
    assert shares[0] == 0.0
    assert shares[-1] < 1.0
    assert watched.surfaces == [drawing.surface]


@pytest.mark.parametrize("last", [0, 2, 3])
def test_a_cancelled_drawing_ends_at_the_next_stage_and_keeps_nothing_of_it(last: int) -> None:
    # A tolerance that no other test asks for, so that nothing is kept yet.
    request = accessible_request(THICK, tolerance=0.51)
    watched = Watched(last)
    with pytest.raises(CancelledError):
        draw_workspace(request, watched.line)
    assert len(watched.stages) == last
    curve = Watched(last)
    with pytest.raises(CancelledError):
        draw_radius_curve(RadiusRequest(THICK, rows_of(THICK), None), curve.line)
    assert len(curve.stages) == last


def test_a_grid_too_fine_to_look_at_each_step_leaves_the_rest_of_the_drawing() -> None:
    design = msgspec.structs.replace(PRESETS["paper-optimal"], node_step=0.25)
    assert workspace_nodes(design).count > MOST_LIVE_NODES
    drawing = draw_workspace(accessible_request(design))
    assert drawing.trouble is None
    assert drawing.accessible is not None
    assert drawing.accessible.node_count is None
    same = draw_workspace(accessible_request(PRESETS["paper-optimal"])).accessible
    assert same is not None
    assert same.node_count is not None
    assert drawing.accessible.volume == same.volume


def test_only_the_newest_accessible_workspaces_are_kept() -> None:
    asked: list[str] = []

    def reach(tolerance: float) -> None:
        find_accessible(
            THICK, rows_of(THICK), None, tolerance, lambda words, _: asked.append(words)
        )

    reach(0.52)
    assert asked
    asked.clear()
    reach(0.52)
    assert not asked


def test_a_stopped_drawing_leaves_none_of_an_older_design() -> None:
    worker = StubWorker()
    feed = WorkspaceFeed(services_for(worker=worker))
    state = viewed(opened(THICK), workspace=WorkspaceView(solid=True))
    feed.follow(Frame(state))
    drawing = draw_workspace(worker.orders[0].request)
    worker.orders[0].done(drawing)
    assert feed.drawing is drawing
    feed.follow(Frame(SetVariable("a3x", 18.0).apply(state)))
    assert feed.drawing is drawing
    feed.cancel()
    assert feed.drawing is None
    worker.orders[0].done(drawing)
    assert feed.drawing is None
    feed.retry()
    assert not feed.is_settled


class Followed:
    """A feed in a worker of its own, and a bell that rings when it is to be drawn again."""

    def __init__(self, worker: Worker) -> None:
        self.bell = threading.Semaphore(0)
        self.feed = WorkspaceFeed(services_for(worker=worker, redraw=self.bell.release))

    def wait_for(self, what: Any) -> None:
        while not what():
            assert self.bell.acquire(timeout=PATIENCE)


@pytest.fixture
def worker() -> Iterator[Worker]:
    made = Worker(lambda _: None)
    yield made
    made.stop()


def accessible_state() -> State:
    state = Set("design.limits", THICK.limits).apply(opened(PRESETS["paper-optimal"]))
    workspace = replace(state.view.workspace, solid=True, region="accessible")
    return Set("view", replace(state.view, workspace=workspace)).apply(state)


def test_a_drawing_shows_its_stage_and_can_be_cancelled_and_asked_for_again(
    worker: Worker, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setattr(session_feed, "LONG_SECONDS", 0.0)
    frame, followed = Frame(accessible_state()), Followed(worker)
    feed = followed.feed
    feed.follow(frame)
    followed.wait_for(lambda: feed.stage is not None)
    assert "% done" in drawing_words(frame, feed)
    feed.cancel()
    assert feed.is_cancelled
    assert feed.is_settled
    assert feed.stage is None
    assert "Stopped" in drawing_words(frame, feed)
    # The same frame does not ask for it again by itself.
    feed.follow(frame)
    assert worker.wait_until_idle(PATIENCE)
    assert feed.is_cancelled
    assert feed.drawing is None
    feed.retry()
    followed.wait_for(lambda: feed.is_current)
    assert not feed.is_cancelled
    assert "units³" in drawing_words(frame, feed)


def test_what_is_shown_no_more_is_not_computed_to_its_end(
    worker: Worker, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setattr(session_feed, "LONG_SECONDS", 0.0)
    state, followed = accessible_state(), Followed(worker)
    feed = followed.feed
    feed.follow(Frame(state))
    followed.wait_for(lambda: feed.stage is not None)
    workspace = replace(state.view.workspace, solid=False)
    feed.follow(Frame(Set("view", replace(state.view, workspace=workspace)).apply(state)))
    assert worker.wait_until_idle(PATIENCE)
    assert feed.problem is None
    assert feed.drawing is None
    feed.follow(Frame(state))
    followed.wait_for(lambda: feed.is_current)
