"""Workspaces drawn by the worker follow the newest state, in bands of colour and cut open."""

from __future__ import annotations

import threading
from collections.abc import Iterator
from dataclasses import replace
from typing import Any

import msgspec
import numpy as np
import pytest
from services import services_for

from explorer.app.features.workspace import tasks
from explorer.app.features.workspace.feed import WorkspaceFeed
from explorer.app.features.workspace.tasks import (
    WorkspaceRequest,
    WorkspaceSurface,
    draw_workspace,
)
from explorer.app.scene.bands import COLOURED_EDGE, MOST_COLOURED, Colouring
from explorer.app.scene.creases import creased_faces
from explorer.app.server import start
from explorer.app.session.jobs import Worker
from explorer.app.session.worker import Channel
from explorer.app.state.actions import Set, SetVariable
from explorer.app.state.frame import Frame
from explorer.app.state.state import State, opened
from explorer.mechanism.design import Design, Limits
from explorer.mechanism.design_file import PRESETS
from explorer.mechanism.home import home_pose
from explorer.mechanism.margins import margins
from explorer.mechanism.pose import rotation_from_yaw_pitch_roll
from explorer.numerics.arrays import FloatArray
from explorer.singularity.colours import BAND_EDGES, band_colours
from explorer.workspace.solids.solids import workspace_solid

OPTIMAL = PRESETS["paper-optimal"]
PATIENCE = 120.0


def a_request(**changes: Any) -> WorkspaceRequest:
    rotation = tuple(tuple(row) for row in home_pose(OPTIMAL).rotation.tolist())
    plain = WorkspaceRequest(
        design=OPTIMAL,
        rotation=rotation,
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


@pytest.fixture
def worker() -> Iterator[Worker]:
    made = Worker(pytest.fail)
    yield made
    made.stop()


class Followed:
    """A feed that is followed, and how often it asked to be drawn again."""

    def __init__(self, worker: Worker) -> None:
        self.drawn = threading.Semaphore(0)
        self.feed = WorkspaceFeed(services_for(worker=worker, redraw=self.drawn.release))

    def follow(self, state: State) -> None:
        self.feed.follow(Frame(state))


def shown(state: State, **changes: Any) -> State:
    workspace = replace(state.view.workspace, solid=True, **changes)
    return Set("view", replace(state.view, workspace=workspace)).apply(state)


def test_drawing_follows_the_design_up_to_the_newest(worker: Worker) -> None:
    followed = Followed(worker)
    state = shown(opened(OPTIMAL))
    for i in range(25):
        state = SetVariable("a3x", 18.0 + 0.05 * i).apply(state)
        followed.follow(state)
    assert worker.wait_until_idle(PATIENCE)
    drawing = followed.feed.drawing
    assert drawing is not None
    assert followed.feed.is_current
    assert drawing.request.design.a3[0] == 18.0 + 0.05 * 24


def test_surface_is_sent_before_anything_is_measured(monkeypatch: pytest.MonkeyPatch) -> None:
    sent: list[Any] = []

    def workspace_solid_later(*arguments: Any, **options: Any) -> Any:
        assert [type(each) for each in sent] == [WorkspaceSurface]
        return workspace_solid(*arguments, **options)

    monkeypatch.setattr(tasks, "workspace_solid", workspace_solid_later)
    drawing = draw_workspace(a_request(), Channel(sent.append, lambda: False))
    assert sent[0] is drawing.surface


def test_surface_of_the_newest_request_is_shown_before_its_numbers(worker: Worker) -> None:
    followed = Followed(worker)
    feed = followed.feed
    state = shown(opened(OPTIMAL))
    followed.follow(state)
    assert worker.wait_until_idle(PATIENCE)
    for a3x in (18.0, 18.5):
        while followed.drawn.acquire(blocking=False):
            pass
        followed.follow(SetVariable("a3x", a3x).apply(state))
        assert followed.drawn.acquire(timeout=PATIENCE)
        assert feed.surface is not None
        assert feed.surface.request.design.a3[0] == a3x
        assert worker.wait_until_idle(PATIENCE)
        assert feed.drawing is not None
        assert feed.surface is feed.drawing.surface
    followed.follow(opened(OPTIMAL))
    assert feed.surface is None


def test_strata_are_requested_after_the_solid(monkeypatch: pytest.MonkeyPatch) -> None:
    running = start(OPTIMAL, port=0)
    try:
        page = running.page
        view = shown(opened(OPTIMAL)).view
        view = replace(view, singular=replace(view.singular, strata=True))
        page.session.do(Set("view", view))
        assert page.wait_until_drawn(PATIENCE)
        requested: list[str] = []
        submit = page.worker.submit

        def record(key: object, task: Any, *arguments: Any, **options: Any) -> int:
            requested.append(task.__name__)
            return submit(key, task, *arguments, **options)

        monkeypatch.setattr(page.worker, "submit", record)
        page.session.do(SetVariable("a3x", 18.0))
        assert page.wait_until_drawn(PATIENCE)
        assert requested.index("draw_workspace") < requested.index("strata_distances")
    finally:
        running.stop()


def test_hidden_drawing_is_not_requested(worker: Worker) -> None:
    followed = Followed(worker)
    followed.follow(opened(OPTIMAL))
    assert worker.wait_until_idle(PATIENCE)
    assert worker.process_id is None
    assert followed.feed.drawing is None


def test_empty_workspace_names_the_limit_that_empties_it() -> None:
    limits = Limits(l1=(0.0, 1.0), box=((10.0, 10.0, 10.0), (11.0, 11.0, 11.0)))
    state = Set("design.limits", limits).apply(opened(OPTIMAL))
    drawing = draw_workspace(a_request(design=state.design, hull=True, cut="x", level=1.0))
    assert drawing.volume == 0.0
    assert drawing.surface.shells == ()
    assert drawing.extent is None
    assert "l1 maximum" in drawing.empty_because


def area(triangles: np.ndarray[Any, np.dtype[np.float64]]) -> float:
    a, b, c = np.moveaxis(triangles, 1, 0)
    return 0.5 * float(np.linalg.norm(np.cross(b - a, c - a), axis=1).sum())


@pytest.mark.parametrize("colour", ["margin", "condition"])
def test_coloured_bands_cover_the_same_surface(colour: str) -> None:
    plain = draw_workspace(a_request()).surface.shells[0]
    banded = draw_workspace(a_request(colour=colour)).surface.shells
    assert len(banded) > 1
    total = sum(area(shell.vertices[shell.faces]) for shell in banded)
    assert total == pytest.approx(area(plain.vertices[plain.faces]), rel=1e-9)


def large_beside_its_reach(reach: float) -> Design:
    """Return a design whose legs are far longer than its reach, and so is its workspace."""
    long: Any = (0.0, 20.0)
    limits = msgspec.structs.replace(OPTIMAL.limits, l1=long, d2=long, d4=long, l4=long)
    a3 = (0.6 * reach, 0.8 * reach)
    return msgspec.structs.replace(OPTIMAL, a3=a3, limits=limits, node_step=None)


@pytest.mark.parametrize("reach", [5.0, 2.0])
def test_workspace_large_beside_the_reach_has_a_bounded_number_of_facets(
    reach: float,
) -> None:
    design = large_beside_its_reach(reach)
    plain = draw_workspace(a_request(design=design)).surface.shells
    drawing = draw_workspace(a_request(design=design, colour="condition"))
    # A facet that lies in several bands is split between them.
    assert sum(len(shell.faces) for shell in drawing.surface.shells) < 1.5 * MOST_COLOURED
    total = sum(area(shell.vertices[shell.faces]) for shell in drawing.surface.shells)
    assert total == pytest.approx(sum(area(s.vertices[s.faces]) for s in plain), rel=1e-9)
    # Their edge is told, since the colours are coarser than usual; margins need no small facets.
    assert drawing.surface.coarse_edge is not None
    assert drawing.surface.coarse_edge > COLOURED_EDGE * design.reach
    assert draw_workspace(a_request(colour="condition")).surface.coarse_edge is None
    assert draw_workspace(a_request(design=design, colour="margin")).surface.coarse_edge is None


ORIENTATIONS = (
    home_pose(OPTIMAL).rotation,
    # Singular everywhere, and almost so.
    np.eye(3),
    rotation_from_yaw_pitch_roll((1e-7, 0.0, 0.0)),
    *(rotation_from_yaw_pitch_roll(angles) for angles in ((-40, 25, 10), (-120, -35, 60))),
)


@pytest.mark.parametrize("rotation", ORIENTATIONS)
@pytest.mark.parametrize("warn_below", [1.0, 0.3, 4.0])
def test_bands_of_margins_contain_the_values_of_their_colour(
    rotation: FloatArray, warn_below: float
) -> None:
    """Also within facets, which margins cross linearly and their minimum does not."""
    solid = workspace_solid(OPTIMAL, rotation, 0.3)
    colouring = Colouring(OPTIMAL, rotation, "margin", warn_below)
    shells, coarse_edge = colouring.shells(creased_faces(solid))
    assert coarse_edge is None
    rng = np.random.default_rng(3)
    for shell in shells:
        index = band_colours().index(shell.colour)
        weights = rng.dirichlet([0.5, 0.5, 0.5], len(shell.faces))
        points = (shell.vertices[shell.faces] * weights[:, :, None]).sum(axis=1)
        values = np.abs(margins(points, rotation)).min(axis=-1) / warn_below
        assert values.min() >= BAND_EDGES[index] - 1e-9
        if index + 1 < len(BAND_EDGES):
            assert values.max() <= BAND_EDGES[index + 1] + 1e-9


@pytest.mark.parametrize("colour", ["margin", "condition"])
@pytest.mark.parametrize("cut", [None, "x", "y", "z"])
def test_bands_meet_where_the_measure_is_their_level(colour: Any, cut: Any) -> None:
    drawing = draw_workspace(a_request(colour=colour, cut=cut, level=None))
    request = drawing.request
    colouring = Colouring(
        request.design, np.array(request.rotation), request.colour, request.warn_below
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


def test_cut_shows_the_slice_at_its_level() -> None:
    drawing = draw_workspace(a_request(cut="z", level=5.0, hull=True))
    assert drawing.extent is not None
    assert drawing.extent[1][2] == pytest.approx(18.0, abs=1e-6)
    highest = max(float(shell.vertices[:, 2].max()) for shell in drawing.surface.shells)
    assert highest == pytest.approx(5.0, abs=1e-6)
    assert drawing.slice_map is not None
    assert drawing.slice_map.plane == (0, 1)
    assert drawing.slice_map.level == drawing.level == 5.0
    assert drawing.hull_volume is not None
    assert drawing.hull_volume >= drawing.mesh_volume * (1.0 - 1e-12)
