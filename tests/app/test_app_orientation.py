"""The tab of tilts: the map, its figures, angles that are set, and what is drawn over positions."""

from __future__ import annotations

import json
import math
import re
from dataclasses import replace
from html import unescape
from typing import Any

import msgspec
import numpy as np
import pytest
from limited_designs import limited
from services import StubWorker, services_for

from explorer.app.features.feature import Services
from explorer.app.features.orientation.actions import GoToTilt, SetTiltTorsion
from explorer.app.features.orientation.feature import ORIENTATION
from explorer.app.features.orientation.feeds import PositionFeed, RangeFeed, TiltsFeed
from explorer.app.features.orientation.panel import (
    best_words,
    range_words,
    share_words,
    strip_words,
    summary,
)
from explorer.app.features.orientation.polar_map import (
    CENTRE,
    COLOURS,
    FREE,
    RADIUS,
    colour_of,
    edge_of,
    legend,
    polar_map,
)
from explorer.app.features.orientation.scale import STOPS, colours_of, most_of, scale_of_tilts
from explorer.app.features.orientation.scene import kept_nodes
from explorer.app.features.orientation.tasks import (
    ORIENTATIONS,
    RangeRequest,
    TiltsDrawing,
    orientations_over,
)
from explorer.app.features.orientation.torsion_strip import LEFT, RIGHT, tilt_at, torsion_strip
from explorer.app.features.workspace.feed import workspace_request
from explorer.app.features.workspace.slice_map import AXES
from explorer.app.features.workspace.tasks import draw_workspace
from explorer.app.state.actions import Set, SetAngle, SetPosition
from explorer.app.state.frame import Frame
from explorer.app.state.state import State, opened
from explorer.app.state.view import WorkspaceView
from explorer.app.storage.packing import Packer, Unpacker, resolve
from explorer.app.widgets.colours import css
from explorer.errors import InputError
from explorer.mechanism.design import Swing
from explorer.mechanism.design_file import PRESETS
from explorer.mechanism.home import home_pose
from explorer.mechanism.tilt_torsion import (
    TiltTorsion,
    tilt_torsion_from_rotation,
    tilt_torsion_of,
)
from explorer.workspace.limits.constraints import GAP
from explorer.workspace.orientations.sets import cone_of_directions
from explorer.workspace.orientations.share import OrientationShare, orientation_share
from explorer.workspace.orientations.tilts import GreatestTilt, TiltMap, greatest_tilt, tilt_map
from explorer.workspace.orientations.torsions import tilt_by_torsion
from explorer.workspace.orientations.turns import limit_names
from explorer.workspace.solids.solids import inclusive_solid, total_solid

pytestmark = pytest.mark.usefixtures("warm_kernels")

OPTIMAL = PRESETS["paper-optimal"]
HOME = tilt_torsion_of(home_pose(OPTIMAL).rotation)


def shown(state: State, **changes: Any) -> State:
    return Set("view.orientation", replace(state.view.orientation, **changes)).apply(state)


def facts_of(markup: str) -> dict[str, Any]:
    found = re.search(r'data-tilts="([^"]+)"', markup)
    assert found is not None
    facts: dict[str, Any] = json.loads(unescape(found[1]))
    return facts


def test_angles_that_are_set_are_those_of_the_pose() -> None:
    state = opened(OPTIMAL)
    for axis, value in ((1, 25.0), (0, -140.0), (2, -50.0)):
        state = SetTiltTorsion(axis, value).apply(state)
        assert tilt_torsion_of(state.pose.rotation)[axis] == pytest.approx(value, abs=1e-9)
    assert tilt_torsion_of(state.pose.rotation) == pytest.approx((-140.0, 25.0, -50.0), abs=1e-9)
    assert state.pose.position == home_pose(OPTIMAL).position
    assert SetTiltTorsion(1, 25.0).words() == "tilt = 25°"


def test_going_to_a_tilt_keeps_position_and_torsion() -> None:
    state = GoToTilt(30.0, 20.0).apply(SetTiltTorsion(2, -60.0).apply(opened(OPTIMAL)))
    assert tilt_torsion_of(state.pose.rotation) == pytest.approx((30.0, 20.0, -60.0), abs=1e-9)
    assert GoToTilt(30.0, 20.0).words() == "Tilt 20° towards 30°"


def test_map_draws_each_tilt_at_its_place_in_the_colour_of_its_limit() -> None:
    tilts = tilt_map(OPTIMAL, (10.0, 5.0, 9.0))
    here = TiltTorsion(40.0, 30.0, tilts.torsion)
    least = greatest_tilt(OPTIMAL, (10.0, 5.0, 9.0))
    markup = polar_map(tilts, least, here, HOME)
    facts = facts_of(markup)
    assert facts == {"centre": list(CENTRE), "radius": RADIUS, "edge": edge_of(tilts, here, HOME)}
    points = re.search(r'class="possible" points="([^"]+)"', markup)
    assert points is not None
    for pair, azimuth, tilt in zip(points[1].split(), tilts.azimuths, tilts.tilts, strict=True):
        x, y = map(float, pair.split(","))
        distance = RADIUS * tilt / facts["edge"]
        angle = np.radians(azimuth)
        assert x == pytest.approx(CENTRE[0] + distance * np.cos(angle), abs=0.06)
        assert y == pytest.approx(CENTRE[1] - distance * np.sin(angle), abs=0.06)
    # The border goes through every tilt, in the colour of what ends it.
    borders = re.findall(r'class="border" stroke="([^"]+)" d="M([^"]+)"', markup)
    assert {stroke for stroke, _ in borders} == {css(colour_of(limit)) for limit in tilts.limits}
    for pair, limit in zip(points[1].split(), tilts.limits, strict=True):
        at = pair.replace(",", " ")
        own = [path.split("L") for stroke, path in borders if stroke == css(colour_of(limit))]
        assert any(at in path for path in own)
    # Home is always drawn, dashed where its torsion is another one.
    assert 'class="home"' in markup
    assert 'class="home is-other"' in polar_map(tilts, least, here._replace(torsion=0.0), HOME)
    assert edge_of(tilts, here, HOME._replace(tilt=170.0)) == 180.0
    # The circle of the greatest tilt in every azimuth touches the border where it ends.
    circle = re.search(
        r'class="least".* r="([^"]+)"/><circle class="dot" cx="(.+?)" cy="(.+?)"', markup
    )
    assert circle is not None
    radius, x, y = map(float, circle.groups())
    assert radius == pytest.approx(RADIUS * least.tilt / facts["edge"], abs=0.06)
    assert np.hypot(x - CENTRE[0], y - CENTRE[1]) == pytest.approx(radius, abs=0.15)
    border = [list(map(float, pair.split(","))) for pair in points[1].split()]
    assert np.hypot(*(np.array(border) - [x, y]).T).min() < 5.0


def test_map_without_any_tilt_is_drawn_too() -> None:
    nothing = TiltMap(0.0, np.arange(0.0, 360.0, 5.0), np.full(72, np.nan), ("l1 maximum",) * 72)
    level = TiltTorsion(0.0, 0.0, 0.0)
    none = GreatestTilt(0.0, np.nan, np.nan, "l1 maximum")
    markup = polar_map(nothing, none, level, HOME)
    assert "nan" not in markup
    assert 'class="least"' not in markup
    assert "l1 maximum" in legend(nothing)
    free = TiltMap(0.0, np.arange(0.0, 360.0, 5.0), np.full(72, 180.0), (None,) * 72)
    assert edge_of(free, level, HOME) == 180.0
    assert 'class="dot"' not in polar_map(free, GreatestTilt(0.0, 180.0, np.nan, None), level, HOME)
    assert "no limit" in legend(free)


def test_limits_have_colours_of_their_own() -> None:
    assert len(set(COLOURS.values())) == len(COLOURS)
    assert colour_of("d2 maximum") == colour_of("d2 minimum") == COLOURS["d2"]
    assert colour_of(None) == FREE not in COLOURS.values()
    design = limited(
        OPTIMAL,
        guide=(0.0, 20.0),
        gap=0.5,
        swing=Swing(a1=60.0, a3=60.0, b1=60.0, b2=60.0, b3=60.0, b4=60.0),
    )
    names = limit_names(design)
    assert {"d1 minimum", "d3 maximum", GAP, "box z minimum", "l4 maximum"} < {*names}
    for name in names:
        assert colour_of(name) != FREE, name


def test_feeds_compute_what_is_shown_and_nothing_else() -> None:
    services, state = services_for(), opened(OPTIMAL)
    worker = services.worker
    assert isinstance(worker, StubWorker)

    def follow(now: State) -> None:
        for kind in ORIENTATION.later_feeds:
            services.get(kind).follow(Frame(now))
        worker.work()

    follow(state)
    assert [order.task.__name__ for order in worker.orders] == ["orientations_at"]
    drawing = services.get(PositionFeed).drawing
    assert drawing is not None
    assert drawing.share == orientation_share(OPTIMAL, state.pose.position)
    best = tilt_by_torsion(OPTIMAL, state.pose.position).best
    assert drawing.by_torsion.best == best
    follow(shown(state, tilts=True, over="total", range=15.0))
    tilts = services.get(TiltsFeed).drawing
    assert tilts is not None
    for index in np.random.default_rng(0).integers(len(tilts.tilts), size=20):
        expected = greatest_tilt(OPTIMAL, tilts.positions[index], tilts.request.torsion).tilt
        assert tilts.tilts[index] == pytest.approx(expected, abs=1e-6)
    volumes: dict[str, float] = {}
    for over, make in (("total", total_solid), ("inclusive", inclusive_solid)):
        follow(shown(state, over=over, range=15.0))
        ranged = services.get(RangeFeed).drawing
        assert ranged is not None
        rotations = cone_of_directions(home_pose(OPTIMAL).rotation, 15.0, ORIENTATIONS)
        volumes[over] = ranged.solid.volume
        assert volumes[over] == pytest.approx(make(OPTIMAL, rotations).volume, rel=1e-3)
    assert volumes["total"] < volumes["inclusive"]


def test_range_turns_the_tilted_orientations_either_way() -> None:
    home = home_pose(OPTIMAL)
    tilted = orientations_over(RangeRequest(OPTIMAL, home, 15.0, 0.0, "total"))
    np.testing.assert_array_equal(tilted, cone_of_directions(home.rotation, 15.0, ORIENTATIONS))
    turned = orientations_over(RangeRequest(OPTIMAL, home, 15.0, 10.0, "total"))
    angles = tilt_torsion_from_rotation(home.rotation.T @ turned)
    assert angles[:, 1].max() == pytest.approx(15.0, abs=1e-9)
    torsions, counts = np.unique(angles[:, 2].round(6), return_counts=True)
    assert torsions.tolist() == [-10.0, 0.0, 10.0]
    assert len(set(counts.tolist())) == 1


@pytest.mark.parametrize("turn", [-1.0, 181.0])
def test_turns_beyond_half_a_turn_are_refused(turn: float) -> None:
    with pytest.raises(InputError, match="turns must be 0° to 180°"):
        shown(opened(OPTIMAL), turn=turn)


def test_strip_of_torsions_has_the_tilts_and_a_mark_at_the_torsion() -> None:
    found = tilt_by_torsion(OPTIMAL, (10.0, 5.0, 9.0))
    markup = torsion_strip(found, -90.0, 0.0)
    told = re.search(r'data-torsions="([^"]+)"', markup)
    assert told is not None
    facts: dict[str, Any] = json.loads(unescape(told[1]))
    assert facts["tilts"] == [
        None if np.isnan(tilt) else pytest.approx(tilt, abs=0.05) for tilt in found.tilts
    ]
    assert f'class="here" d="M{0.75 * LEFT + 0.25 * RIGHT:.1f} ' in markup
    nowhere = tilt_by_torsion(OPTIMAL, (30.0, 5.0, 9.0))
    empty = torsion_strip(nowhere, 0.0, np.nan)
    assert "nan" not in empty
    assert 'class="curve"' not in empty
    assert 'class="possible"' not in empty
    assert 'class="dot"' not in empty
    assert best_words(nowhere.best, np.nan) == "none"
    assert best_words(found.best, found.best.tilt).endswith(", as here")
    assert "at" in best_words(found.best, found.best.tilt - 1.0).split()


def test_strip_of_torsions_has_gaps_and_marks_the_best_torsion_unless_it_is_no_better() -> None:
    found = tilt_by_torsion(OPTIMAL, (10.0, 5.0, 9.0))
    curves = re.findall(r'class="curve" d="M([^"]+)"', torsion_strip(found, 0.0, 0.0))
    drawn = [float(pair.split()[0]) for curve in curves for pair in curve.split("L")]
    torsions = [*found.torsions.tolist(), 180.0]
    possible = np.isfinite([*found.tilts.tolist(), found.tilts[0]])
    assert 0 < possible.sum() < len(possible)
    expected = [LEFT + (RIGHT - LEFT) * (t + 180.0) / 360.0 for t in torsions]
    kept = [x for x, is_possible in zip(expected, possible, strict=True) if is_possible]
    assert drawn == pytest.approx(kept, abs=0.06)
    best = found.best
    for tilt, count in ((best.tilt - 0.06, 1), (best.tilt - 0.04, 0), (best.tilt, 0), (np.nan, 1)):
        assert torsion_strip(found, 0.0, tilt).count('class="dot"') == count
    middle = 0.5 * float(found.torsions[20] + found.torsions[21])
    assert tilt_at(found, middle) == pytest.approx(found.tilts[20:22].mean(), nan_ok=True)
    assert tilt_at(found, 540.0) == pytest.approx(found.tilts[0], nan_ok=True)
    for torsion in (1e308, -1e308):
        # A torsion of any size is one of the row.
        same = math.remainder(torsion, 360.0)
        assert tilt_at(found, torsion) == pytest.approx(tilt_at(found, same), nan_ok=True)


def test_share_of_none_or_all_names_the_number_of_orientations() -> None:
    assert share_words(OrientationShare(0.0, 0.0, 100_000)) == "none of 100,000"
    assert share_words(OrientationShare(1.0, 0.0, 100_000)) == "all of 100,000"
    assert share_words(OrientationShare(0.125, 0.0002, 100_000)) == "12.50 % ± 0.02 %"


def test_angles_stay_as_they_were_set_at_tilts_that_do_not_determine_them() -> None:
    state = opened(OPTIMAL)
    for axis, value in ((0, 60.0), (1, 20.0), (2, -50.0)):
        state = SetTiltTorsion(axis, value).apply(state)
    for tilt in (0.0, 180.0):
        at_end = SetTiltTorsion(1, tilt).apply(state)
        assert at_end.tilt_torsion == (60.0, tilt, -50.0)
        back = SetTiltTorsion(1, 20.0).apply(SetPosition(2, 8.0).apply(at_end))
        assert tilt_torsion_of(back.pose.rotation) == pytest.approx((60.0, 20.0, -50.0), abs=1e-9)
        clicked = GoToTilt(30.0, 20.0).apply(at_end)
        assert clicked.tilt_torsion == (30.0, 20.0, -50.0)
    # Another rotation has angles of its own.
    turned = SetAngle(0, 10.0).apply(SetTiltTorsion(1, 0.0).apply(state))
    assert turned.tilt_torsion == pytest.approx((0.0, 0.0, 10.0), abs=1e-9)


def test_angles_that_were_set_are_saved_and_older_files_lack_them() -> None:
    state = SetTiltTorsion(1, 0.0).apply(GoToTilt(60.0, 20.0).apply(opened(OPTIMAL)))
    packer = Packer()
    number = packer.add(state)
    objects = [msgspec.json.decode(each) for each in packer.objects]
    saved = resolve(objects)[number]
    assert Unpacker().state(saved).tilt_torsion == state.tilt_torsion
    assert state.tilt_torsion.azimuth == 60.0
    older = {name: value for name, value in saved.items() if name != "set_tilt_torsion"}
    assert Unpacker().state(older).tilt_torsion.azimuth == 0.0


def panel_text(services: Services, state: State) -> str:
    """Return what the panel shows of a position, as HTML."""
    here, feed = state.tilt_torsion, services.get(PositionFeed)
    least = greatest_tilt(state.design, state.pose.position, here.torsion)
    parts = summary(Frame(state), here, least, feed)
    return "".join(parts) + strip_words(feed, here, least)


def test_what_belongs_to_an_older_position_is_shown_as_outdated() -> None:
    services, state = services_for(), opened(OPTIMAL)
    worker = services.worker
    assert isinstance(worker, StubWorker)
    feed = services.get(PositionFeed)
    assert "…" in panel_text(services, state)
    feed.follow(Frame(state))
    worker.work()
    assert "is-outdated" not in panel_text(services, state)
    moved_on = SetPosition(2, 12.0).apply(state)
    feed.follow(Frame(moved_on))
    outdated = panel_text(services, moved_on)
    assert outdated.count("is-outdated") == 3
    # The best tilt of the older position is compared with that of the same position.
    assert ", as here" in outdated
    worker.work()
    assert "is-outdated" not in panel_text(services, moved_on)


def test_failure_of_the_share_is_shown() -> None:
    services, state = services_for(), opened(OPTIMAL)
    worker = services.worker
    assert isinstance(worker, StubWorker)
    services.get(PositionFeed).follow(Frame(state))
    worker.orders[-1].failed("the worker ended")
    shown_text = panel_text(services, state)
    assert "The share and the largest tilt could not be computed" in shown_text
    assert "the worker ended" in shown_text
    assert "…" not in shown_text


@pytest.mark.parametrize(("over", "bound"), [("inclusive", "at least"), ("total", "at most")])
def test_volume_over_sampled_orientations_is_a_bound(over: str, bound: str) -> None:
    services, state = services_for(), shown(opened(OPTIMAL), over=over, range=15.0)
    worker = services.worker
    assert isinstance(worker, StubWorker)
    services.get(RangeFeed).follow(Frame(state))
    worker.work()
    assert f"{bound} " in range_words(services.get(RangeFeed))


def tilts_over(state: State) -> TiltsDrawing:
    """Return the tilts over the workspace that the worker draws for a state."""
    services = services_for()
    feed, worker = services.get(TiltsFeed), services.worker
    feed.follow(Frame(state))
    assert isinstance(worker, StubWorker)
    worker.work()
    assert feed.drawing is not None
    return feed.drawing


def test_cut_of_the_workspace_opens_the_tilts_on_the_same_side() -> None:
    state = shown(opened(OPTIMAL), tilts=True)
    drawing = tilts_over(state)
    assert kept_nodes(drawing, WorkspaceView()).all()
    for axis, cut in enumerate(AXES):
        for flipped in (False, True):
            view = WorkspaceView(solid=True, cut=cut, level=6.0, flipped=flipped)
            request = workspace_request(Frame(Set("view.workspace", view).apply(state)))
            assert request is not None
            surface = draw_workspace(request).surface
            ends = [shell.vertices[:, axis] for shell in surface.shells if len(shell.vertices)]
            low, high = min(map(np.min, ends)), max(map(np.max, ends))
            kept = drawing.positions[kept_nodes(drawing, view), axis]
            assert len(kept)
            assert low - 1e-9 <= kept.min()
            assert kept.max() <= high + 1e-9


def test_scale_ends_at_a_round_tilt_with_the_colours_of_its_stops() -> None:
    drawing = tilts_over(shown(opened(OPTIMAL), tilts=True))
    most = most_of(drawing)
    assert most - 10.0 < drawing.tilts.max() <= most
    places = np.linspace(0.0, most, len(STOPS))
    assert [tuple(colour) for colour in colours_of(places, most).tolist()] == list(STOPS)
    assert f"{len(drawing.tilts):,} nodes" in scale_of_tilts(drawing)
    empty = replace(drawing, positions=np.zeros((0, 3)), tilts=np.zeros(0))
    assert "beyond a limit" in scale_of_tilts(empty)


@pytest.mark.parametrize("tilt", [0.0, -1.0, 181.0])
def test_range_beyond_half_a_turn_is_refused(tilt: float) -> None:
    with pytest.raises(InputError, match="above 0° and up to 180°"):
        shown(opened(OPTIMAL), range=tilt)
