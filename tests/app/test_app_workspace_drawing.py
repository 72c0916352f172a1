"""Workspaces drawn by the worker: they follow the newest state, in bands of colour and cut open.

Long drawings send their stages, can be cancelled, and are bounded.
"""

from __future__ import annotations

import threading
from collections.abc import Callable, Iterator, Sequence
from concurrent.futures import CancelledError
from dataclasses import replace
from typing import Any

import msgspec
import numpy as np
import pytest
from desk import viewed
from services import StubJobs, services_for

from explorer.app.features.workspace import work
from explorer.app.features.workspace.feeds import WORKSPACE_FEED, surface_of
from explorer.app.features.workspace.words import drawing_words
from explorer.app.scene.surfaces import MOST_COLOURED, Colouring, Shell, creased_faces
from explorer.app.session import feed as session_feed
from explorer.app.session.feed import Stage
from explorer.app.state.actions import Set
from explorer.app.state.frame import Frame
from explorer.app.state.geometry import set_variable
from explorer.app.state.state import State, open_state
from explorer.app.state.view import WorkspaceView
from explorer.jobs.jobs import Jobs
from explorer.jobs.process import Channel
from explorer.mechanism.design import Design
from explorer.mechanism.design_file import PRESETS
from explorer.mechanism.margins import margins
from explorer.mechanism.pose import rotation_from_yaw_pitch_roll
from explorer.numerics.arrays import FloatArray
from explorer.singularity.colours import BAND_EDGES, band_colours
from explorer.workspace.accessible.radii import with_radius
from explorer.workspace.slices.volume import node_count_of
from explorer.workspace.solids.solids import workspace_solid
from explorer.workspace.workspace import Workspace

OPTIMAL = PRESETS["paper-optimal"]
HOME_ROWS = tuple(tuple(row) for row in OPTIMAL.home_pose.rotation.tolist())
PATIENCE = 120.0


def a_request(**changes: Any) -> work.WorkspaceRequest:
    plain = work.WorkspaceRequest(
        design=OPTIMAL,
        rotation=HOME_ROWS,
        region="limits",
        start=None,
        colour="plain",
        cut=None,
        level=0.0,
        flipped=False,
        tolerance=0.2,
        hull=False,
        warn_below=1.0,
    )
    return replace(plain, **changes)


@pytest.fixture(scope="module")
def jobs() -> Iterator[Jobs]:
    jobs = Jobs(pytest.fail)
    yield jobs
    jobs.stop()


def with_solid(state: State) -> State:
    return Set("view.workspace.solid", True).apply(state)


def test_drawing_follows_the_newest_design_and_its_surface_comes_before_its_numbers(
    jobs: Jobs,
) -> None:
    redraws = threading.Semaphore(0)
    feed = WORKSPACE_FEED(services_for(jobs=jobs, redraw=redraws.release))
    feed.follow(Frame(open_state(OPTIMAL)))
    assert jobs.wait_until_idle(PATIENCE)
    # A hidden drawing is not requested.
    assert jobs.process_ids() == []
    assert feed.drawing is None
    state = with_solid(open_state(OPTIMAL))
    for i in range(25):
        state = set_variable("a3x", 18.0 + 0.05 * i).apply(state)
        feed.follow(Frame(state))
    assert jobs.wait_until_idle(PATIENCE)
    assert feed.drawing is not None
    assert feed.is_current
    assert feed.drawing.request.design.a3[0] == 18.0 + 0.05 * 24
    while redraws.acquire(blocking=False):
        pass
    feed.follow(Frame(set_variable("a3x", 18.5).apply(state)))
    assert redraws.acquire(timeout=PATIENCE)
    surface = surface_of(feed)
    assert surface is not None
    assert surface.request.design.a3[0] == 18.5
    assert jobs.wait_until_idle(PATIENCE)
    assert feed.drawing is not None
    assert surface_of(feed) is feed.drawing.surface
    feed.follow(Frame(open_state(OPTIMAL)))
    assert surface_of(feed) is None


def area(shells: Sequence[Shell]) -> float:
    triangles = np.concatenate([shell.vertices[shell.faces] for shell in shells])
    a, b, c = np.moveaxis(triangles, 1, 0)
    return 0.5 * float(np.linalg.norm(np.cross(b - a, c - a), axis=1).sum())


def test_workspace_large_beside_the_reach_has_a_bounded_number_of_facets() -> None:
    # Its legs are far longer than its reach, and so is its workspace.
    long: Any = (0.0, 20.0)
    limits = msgspec.structs.replace(OPTIMAL.limits, l1=long, d2=long, d4=long, l4=long)
    design = msgspec.structs.replace(OPTIMAL, a3=(1.2, 1.6), limits=limits, node_step=None)
    plain = work.draw_workspace(a_request(design=design)).surface.shells
    drawing = work.draw_workspace(a_request(design=design, colour="condition"))
    # A facet that lies in several bands is split between them.
    assert sum(len(shell.faces) for shell in drawing.surface.shells) < 1.5 * MOST_COLOURED
    assert area(drawing.surface.shells) == pytest.approx(area(plain), rel=1e-9)


ORIENTATIONS = (
    OPTIMAL.home_pose.rotation,
    # Singular everywhere, and almost so.
    np.eye(3),
    rotation_from_yaw_pitch_roll((1e-7, 0.0, 0.0)),
    *(rotation_from_yaw_pitch_roll(angles) for angles in ((-40, 25, 10), (-120, -35, 60))),
)


@pytest.mark.parametrize("rotation", ORIENTATIONS)
@pytest.mark.parametrize("warn_below", [1.0, 0.3])
def test_bands_of_margins_contain_the_values_of_their_colour(
    rotation: FloatArray, warn_below: float
) -> None:
    """Also within facets, which margins cross linearly and their minimum does not."""
    solid = workspace_solid(OPTIMAL, rotation, 0.3)
    colouring = Colouring(Workspace(OPTIMAL, rotation), "margin", warn_below)
    shells = colouring.shells(creased_faces(solid))
    rng = np.random.default_rng(3)
    for shell in shells:
        index = band_colours().index(shell.colour)
        weights = rng.dirichlet([0.5, 0.5, 0.5], len(shell.faces))
        points = (shell.vertices[shell.faces] * weights[:, :, None]).sum(axis=1)
        values = np.abs(margins(points, rotation)).min(axis=-1) / warn_below
        assert values.min() >= BAND_EDGES[index] - 1e-9
        if index + 1 < len(BAND_EDGES):
            assert values.max() <= BAND_EDGES[index + 1] + 1e-9


@pytest.mark.parametrize(("colour", "cut"), [("margin", None), ("margin", "x"), ("condition", "z")])
def test_bands_meet_where_the_measure_is_their_level(colour: Any, cut: Any) -> None:
    drawing = work.draw_workspace(a_request(colour=colour, cut=cut, level=None))
    request = drawing.request
    colouring = Colouring(
        Workspace(request.design, np.array(request.rotation)), request.colour, request.warn_below
    )
    shells = {band_colours().index(shell.colour): shell for shell in drawing.surface.shells}
    met = 0
    for index, upper in shells.items():
        lower = shells.get(index - 1)
        if lower is None:
            continue
        common = {*map(tuple, lower.vertices.tolist())} & {*map(tuple, upper.vertices.tolist())}
        values = colouring.bands.values(np.array(sorted(common)))
        assert values == pytest.approx(BAND_EDGES[index], abs=1e-5)
        met += len(common)
    assert met > 100


THICK = with_radius(OPTIMAL, 0.3)
"""With these radii several pairs of legs collide within the limits."""


def accessible_request(design: Design, **changes: Any) -> work.WorkspaceRequest:
    return a_request(**{"design": design, "region": "accessible", "tolerance": 0.5, **changes})


class Watched:
    """A channel that keeps what is sent, and cancels at a stage."""

    def __init__(self, last: int | None = None) -> None:
        self.stages: list[Stage] = []
        self.surfaces: list[work.WorkspaceSurface] = []
        self.line = Channel(self._keep, lambda: len(self.stages) == last)

    def _keep(self, value: Stage | work.WorkspaceSurface) -> None:
        if isinstance(value, Stage):
            self.stages.append(value)
        else:
            self.surfaces.append(value)


def test_accessible_workspace_sends_a_stage_for_each_pair_of_legs_that_it_carves() -> None:
    watched = Watched()
    drawing = work.draw_workspace(accessible_request(THICK, level=1.0), watched.line)
    assert drawing.part is not None
    blocking = [pair.legs for pair in drawing.part.pairs if pair.blocked_volume > 0.0]
    assert len(blocking) > 1
    words = " ".join(stage.words for stage in watched.stages)
    assert all(f"legs {first}–{second}" in words for first, second in blocking)
    shares = [stage.share for stage in watched.stages]
    assert shares == sorted(set(shares))
    assert shares[0] == 0.0
    assert shares[-1] < 1.0
    assert watched.surfaces == [drawing.surface]


@pytest.mark.parametrize("last", [0, 2])
def test_cancelled_drawing_ends_at_the_next_stage_and_keeps_nothing_of_it(last: int) -> None:
    # A tolerance that no other test asks for, so that nothing is kept yet.
    request = accessible_request(THICK, tolerance=0.51)
    watched = Watched(last)
    with pytest.raises(CancelledError):
        work.draw_workspace(request, watched.line)
    assert len(watched.stages) == last


def test_grid_too_fine_for_live_nodes_leaves_the_rest_of_the_drawing() -> None:
    design = msgspec.structs.replace(OPTIMAL, node_step=0.25)
    assert node_count_of(Workspace(design)).count > work.MOST_LIVE_NODES
    drawing = work.draw_workspace(accessible_request(design))
    assert drawing.trouble is None
    assert drawing.part is not None
    assert drawing.part.node_count is None
    same = work.draw_workspace(accessible_request(OPTIMAL)).part
    assert same is not None
    assert same.node_count is not None
    assert drawing.part.volume == same.volume


def test_cancelled_drawing_leaves_none_of_an_older_design() -> None:
    jobs = StubJobs()
    feed = WORKSPACE_FEED(services_for(jobs=jobs))
    state = viewed(open_state(THICK), workspace=WorkspaceView(solid=True))
    feed.follow(Frame(state))
    drawing = work.draw_workspace(jobs.orders[0].request)
    jobs.orders[0].done(drawing)
    assert feed.drawing is drawing
    feed.follow(Frame(set_variable("a3x", 18.0).apply(state)))
    assert feed.drawing is drawing
    feed.cancel()
    assert feed.drawing is None
    jobs.orders[0].done(drawing)
    assert feed.drawing is None
    feed.retry()
    assert not feed.is_settled


def test_drawing_shows_its_stage_and_is_cancelled_and_requested_again(
    monkeypatch: pytest.MonkeyPatch,
) -> None:
    monkeypatch.setattr(session_feed, "LONG_SECONDS", 0.0)
    jobs, redraws = Jobs(lambda _: None), threading.Semaphore(0)
    feed = WORKSPACE_FEED(services_for(jobs=jobs, redraw=redraws.release))

    def wait_for(condition: Callable[[], object]) -> None:
        while not condition():
            assert redraws.acquire(timeout=PATIENCE)

    state = Set("design.limits", THICK.limits).apply(open_state(OPTIMAL))
    state = viewed(state, workspace=WorkspaceView(solid=True, region="accessible"))
    frame = Frame(state)
    try:
        feed.follow(frame)
        wait_for(lambda: feed.stage is not None)
        assert "% done" in drawing_words(frame, feed)
        feed.cancel()
        assert (feed.is_cancelled, feed.is_settled, feed.stage) == (True, True, None)
        assert "Stopped" in drawing_words(frame, feed)
        # The same frame does not ask for it again by itself.
        feed.follow(frame)
        assert jobs.wait_until_idle(PATIENCE)
        assert feed.is_cancelled
        assert feed.drawing is None
        feed.retry()
        # What is shown no more is not computed to its end.
        wait_for(lambda: feed.stage is not None)
        feed.follow(Frame(viewed(state, workspace=WorkspaceView(region="accessible"))))
        assert jobs.wait_until_idle(PATIENCE)
        assert (feed.problem, feed.drawing) == (None, None)
        feed.follow(frame)
        wait_for(lambda: feed.is_current)
        assert not feed.is_cancelled
        assert "cm³" in drawing_words(frame, feed)
    finally:
        jobs.stop()
