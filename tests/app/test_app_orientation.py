"""The tab of tilts: the map, its figures, angles that are set, and what is drawn over positions."""

from __future__ import annotations

import json
import re
from collections.abc import Generator
from html import unescape
from typing import Any

import numpy as np
import pytest
from services import StubJobs, services_for

from explorer.app.features.feature import Services
from explorer.app.features.orientation import maps, work
from explorer.app.features.orientation.feature import (
    ORIENTATION,
    best_words,
    nodes_beside_cut,
    summary,
)
from explorer.app.features.workspace.feeds import workspace_request
from explorer.app.features.workspace.slice_map import AXES
from explorer.app.features.workspace.work import draw_workspace
from explorer.app.state.actions import Set
from explorer.app.state.frame import Frame
from explorer.app.state.moves import set_angle, set_position
from explorer.app.state.state import State, open_state
from explorer.app.state.view import WorkspaceView
from explorer.errors import InputError
from explorer.mechanism.design_file import PRESETS
from explorer.mechanism.rgb import css
from explorer.mechanism.tilt_torsion import TiltTorsion, tilt_torsion_of
from explorer.workspace.orientations.share import orientation_share
from explorer.workspace.orientations.tilts import (
    GreatestTilt,
    TiltByTorsion,
    TiltMap,
    greatest_tilt,
    tilt_by_torsion,
    tilt_map,
)

pytestmark = pytest.mark.usefixtures("warm_kernels")

OPTIMAL = PRESETS["paper-optimal"]
HOME = tilt_torsion_of(OPTIMAL.home_pose.rotation)


def facts_of(markup: str) -> dict[str, Any]:
    (found,) = re.findall('data-map="([^"]+)"', markup)
    return json.loads(unescape(found))


@pytest.fixture(scope="module")
def tilts() -> Generator[work.TiltsDrawing]:
    """The tilts over the workspace at fewer nodes than the page has."""
    with pytest.MonkeyPatch.context() as patch:
        patch.setattr(work, "NODES", 8)
        services, jobs = services_and_worker()
        feed = services.get(work.TILTS_FEED)
        feed.follow(Frame(Set("view.tilts", True).apply(open_state(OPTIMAL))))
        jobs.work()
        assert feed.drawing is not None
        yield feed.drawing


@pytest.fixture(scope="module")
def by_torsion() -> TiltByTorsion:
    return tilt_by_torsion(OPTIMAL, (10.0, 5.0, 9.0))


def services_and_worker() -> tuple[Services, StubJobs]:
    services = services_for()
    assert isinstance(services.jobs, StubJobs)
    return services, services.jobs


def test_angles_that_are_set_are_those_of_the_pose() -> None:
    state = open_state(OPTIMAL)
    for axis, value in ((1, 25.0), (0, -140.0), (2, -50.0)):
        state = work.set_tilt_torsion(axis, value).apply(state)
        assert tilt_torsion_of(state.pose.rotation)[axis] == pytest.approx(value, abs=1e-9)
    assert tilt_torsion_of(state.pose.rotation) == pytest.approx((-140.0, 25.0, -50.0), abs=1e-9)
    assert state.pose.position == OPTIMAL.home_pose.position
    there = work.go_to_tilt(30.0, 20.0).apply(state)
    assert tilt_torsion_of(there.pose.rotation) == pytest.approx((30.0, 20.0, -50.0), abs=1e-9)
    assert work.set_tilt_torsion(1, 25.0).describe(state) == "tilt = 25°"
    assert work.go_to_tilt(30.0, 20.0).describe(there) == "Tilt 20° towards 30°"


@pytest.mark.parametrize("azimuth", [-150.0, 20.0, 100.0])
def test_tilt_beyond_the_map_goes_to_its_border_in_the_same_mode_and_says_why(
    azimuth: float,
) -> None:
    state = open_state(OPTIMAL)
    border = tilt_map(OPTIMAL, state.position, state.tilt_torsion.torsion, [azimuth])
    most, limit = float(border.tilts[0]), border.limits[0]
    beyond = work.go_to_tilt(azimuth, 170.0)
    after = beyond.apply(state)
    assert after.tilt_torsion.tilt == pytest.approx(most - work.INSIDE)
    assert after.mode == state.mode
    assert not Frame(after).snapshot.violations
    assert after.remark is not None
    assert limit is not None
    assert f"{most:.1f}°, by {limit}" in after.remark
    assert f"Tilt {most - work.INSIDE:.4g}°" in beyond.describe(after)
    # No tilt is reached from one that is beyond a limit itself.
    outside = set_position(0, 30.0).apply(state)
    with pytest.raises(InputError, match="no tilt is possible here"):
        work.go_to_tilt(azimuth, 5.0).apply(outside)


def test_map_draws_each_tilt_at_its_place_in_the_colour_of_its_limit() -> None:
    tilts = tilt_map(OPTIMAL, (10.0, 5.0, 9.0))
    here = TiltTorsion(40.0, 30.0, tilts.torsion)
    least = greatest_tilt(OPTIMAL, (10.0, 5.0, 9.0))
    markup = maps.polar_map(tilts, least, here, HOME)
    facts = facts_of(markup)
    edge = maps.edge_of(tilts, here, HOME)
    # The frame is about the circle, in whose centre there is no tilt.
    left, bottom, scale = facts["place"]
    centre = left - facts["lows"][0] * scale, bottom + facts["lows"][1] * scale
    assert centre == pytest.approx(maps.CENTRE)
    assert facts["radius"] == facts["highs"][0] == facts["highs"][1] == edge
    assert scale * edge == pytest.approx(maps.RADIUS)
    (pairs,) = re.findall(r'class="possible" d="M([^"]+)Z"', markup)
    points = np.array([pair.split(",") for pair in pairs.split("L")], dtype=float)
    distances, angles = maps.RADIUS * tilts.tilts / edge, np.radians(tilts.azimuths)
    expected = maps.CENTRE + distances[:, None] * np.stack(
        [np.cos(angles), -np.sin(angles)], axis=1
    )
    np.testing.assert_allclose(points, expected, atol=0.06)
    # The border goes through every tilt, in the colour of what ends it.
    borders = re.findall(r'class="border" stroke="([^"]+)" d="M([^"]+)"', markup)
    assert {stroke for stroke, _ in borders} == {
        css(maps.colour_of(limit)) for limit in tilts.limits
    }
    for pair, limit in zip(pairs.split("L"), tilts.limits, strict=True):
        own = [path.split("L") for stroke, path in borders if stroke == css(maps.colour_of(limit))]
        assert any(pair in path for path in own)
    # Home is always drawn, dashed where its torsion is another one.
    assert 'class="home"' in markup
    assert 'class="home is-other"' in maps.polar_map(tilts, least, here._replace(torsion=0.0), HOME)


def test_map_without_any_tilt_is_drawn_too() -> None:
    nothing = TiltMap(0.0, np.arange(0.0, 360.0, 5.0), np.full(72, np.nan), ("l1 maximum",) * 72)
    level = TiltTorsion(0.0, 0.0, 0.0)
    none = GreatestTilt(0.0, np.nan, np.nan, "l1 maximum")
    markup = maps.polar_map(nothing, none, level, HOME)
    assert "nan" not in markup
    assert 'class="least"' not in markup
    assert "l1 maximum" in maps.legend(nothing)
    free = TiltMap(0.0, np.arange(0.0, 360.0, 5.0), np.full(72, 180.0), (None,) * 72)
    assert maps.edge_of(free, level, HOME) == 180.0
    assert 'class="dot"' not in maps.polar_map(
        free, GreatestTilt(0.0, 180.0, np.nan, None), level, HOME
    )
    assert "no limit" in maps.legend(free)


def test_position_feed_computes_share_and_torsions() -> None:
    services, jobs = services_and_worker()
    state = open_state(OPTIMAL)
    for kind in ORIENTATION.later_feeds:
        services.get(kind).follow(Frame(state))
    jobs.work()
    # Nothing else is shown.
    assert [order.task.__name__ for order in jobs.orders] == ["orientations_at"]
    drawing = services.get(work.POSITION_FEED).drawing
    assert drawing is not None
    assert drawing.share == orientation_share(OPTIMAL, state.pose.position)
    assert drawing.by_torsion.best == tilt_by_torsion(OPTIMAL, state.pose.position).best


def test_tilts_over_positions_are_the_greatest_of_each(tilts: work.TiltsDrawing) -> None:
    torsion = round(open_state(OPTIMAL).tilt_torsion.torsion, work.DIGITS)
    for index in np.random.default_rng(0).integers(len(tilts.tilts), size=20):
        expected = greatest_tilt(OPTIMAL, tilts.positions[index], torsion).tilt
        assert tilts.tilts[index] == pytest.approx(expected, abs=1e-6)


def test_best_torsion_is_told_beside_the_present_one(by_torsion: TiltByTorsion) -> None:
    best = by_torsion.best
    assert best_words(best, best.tilt).endswith(", as here")
    assert "at" in best_words(best, best.tilt - 1.0).split()
    assert best_words(tilt_by_torsion(OPTIMAL, (30.0, 5.0, 9.0)).best, np.nan) == "none"


def test_angles_stay_as_they_were_set_at_tilts_that_do_not_determine_them() -> None:
    state = open_state(OPTIMAL)
    for axis, value in ((0, 60.0), (1, 20.0), (2, -50.0)):
        state = work.set_tilt_torsion(axis, value).apply(state)
    for tilt in (0.0, 180.0):
        at_end = work.set_tilt_torsion(1, tilt).apply(state)
        assert at_end.tilt_torsion == (60.0, tilt, -50.0)
        back = work.set_tilt_torsion(1, 20.0).apply(set_position(2, 8.0).apply(at_end))
        assert tilt_torsion_of(back.pose.rotation) == pytest.approx((60.0, 20.0, -50.0), abs=1e-9)
        clicked = work.go_to_tilt(30.0, 20.0).apply(at_end)
        assert clicked.tilt_torsion == (30.0, 20.0, -50.0)
    # Another rotation has angles of its own.
    turned = set_angle(0, 10.0).apply(work.set_tilt_torsion(1, 0.0).apply(state))
    assert turned.tilt_torsion == pytest.approx((0.0, 0.0, 10.0), abs=1e-9)


def test_panel_marks_values_of_an_older_position_as_outdated_and_shows_a_failure() -> None:
    services, jobs = services_and_worker()
    state, feed = open_state(OPTIMAL), services.get(work.POSITION_FEED)

    def text_at(state: State) -> str:
        here = state.tilt_torsion
        least = greatest_tilt(state.design, state.pose.position, here.torsion)
        return "".join(summary(Frame(state), here, least, feed))

    assert "…" in text_at(state)
    feed.follow(Frame(state))
    jobs.work()
    assert "is-outdated" not in text_at(state)
    after = set_position(2, 12.0).apply(state)
    feed.follow(Frame(after))
    assert text_at(after).count("is-outdated") == 2
    jobs.orders[-1].failed("the jobs ended")
    failed = text_at(after)
    assert "the jobs ended" in failed
    assert "…" not in failed


@pytest.mark.parametrize(("axis", "flipped"), [(0, False), (1, True), (2, False)])
def test_cut_of_the_workspace_opens_the_tilts_on_the_same_side(
    tilts: work.TiltsDrawing, axis: int, flipped: bool
) -> None:
    assert nodes_beside_cut(tilts, WorkspaceView()).all()
    view = WorkspaceView(solid=True, cut=AXES[axis], level=6.0, flipped=flipped)
    request = workspace_request(Frame(Set("view.workspace", view).apply(open_state(OPTIMAL))))
    assert request is not None
    surface = draw_workspace(request).surface
    ends = [shell.vertices[:, axis] for shell in surface.shells if len(shell.vertices)]
    low, high = min(map(np.min, ends)), max(map(np.max, ends))
    kept = tilts.positions[nodes_beside_cut(tilts, view), axis]
    assert len(kept)
    assert low - 1e-9 <= kept.min()
    assert kept.max() <= high + 1e-9
