"""The tab of tilts: the map, its figures, angles that are set, and what is drawn over positions."""

from __future__ import annotations

import json
import re
from dataclasses import replace
from html import unescape
from typing import Any

import numpy as np
import pytest
from services import StubWorker, services_for

from explorer.app.features.orientation.actions import GoToTilt, SetTiltTorsion
from explorer.app.features.orientation.feature import ORIENTATION
from explorer.app.features.orientation.feeds import RangeFeed, ShareFeed, TiltsFeed
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
from explorer.app.features.orientation.tasks import ORIENTATIONS
from explorer.app.state.actions import Set
from explorer.app.state.frame import Frame
from explorer.app.state.state import State, opened
from explorer.errors import InputError
from explorer.mechanism.design_file import PRESETS
from explorer.mechanism.home import home_pose
from explorer.mechanism.tilt_torsion import TiltTorsion, tilt_torsion_of
from explorer.workspace.orientations.sets import cone_of_directions
from explorer.workspace.orientations.share import orientation_share
from explorer.workspace.orientations.tilts import TiltMap, greatest_tilt, tilt_map
from explorer.workspace.solids.solids import dexterous_solid, reachable_solid

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
    markup = polar_map(tilts, here, HOME)
    facts = facts_of(markup)
    assert facts == {"centre": list(CENTRE), "radius": RADIUS, "edge": edge_of(tilts, here)}
    points = re.search(r'class="possible" points="([^"]+)"', markup)
    assert points is not None
    for pair, azimuth, tilt in zip(points[1].split(), tilts.azimuths, tilts.tilts, strict=True):
        x, y = map(float, pair.split(","))
        distance = RADIUS * tilt / facts["edge"]
        angle = np.radians(azimuth)
        assert x == pytest.approx(CENTRE[0] + distance * np.cos(angle), abs=0.06)
        assert y == pytest.approx(CENTRE[1] - distance * np.sin(angle), abs=0.06)
    strokes = re.findall(r'class="border" stroke="([^"]+)"', markup)
    assert len(strokes) == len(tilts.limits)
    assert len(set(strokes)) == len({colour_of(limit) for limit in tilts.limits})
    # Home is drawn, since the torsion is its own.
    assert 'class="home"' in markup
    assert 'class="home"' not in polar_map(tilts, here._replace(torsion=0.0), HOME)


def test_map_without_any_tilt_is_drawn_too() -> None:
    nothing = TiltMap(0.0, np.arange(0.0, 360.0, 5.0), np.full(72, np.nan), ("l1 maximum",) * 72)
    markup = polar_map(nothing, TiltTorsion(0.0, 0.0, 0.0), HOME)
    assert "nan" not in markup
    assert "l1 maximum" in legend(nothing)
    free = TiltMap(0.0, np.arange(0.0, 360.0, 5.0), np.full(72, 180.0), (None,) * 72)
    assert edge_of(free, TiltTorsion(0.0, 0.0, 0.0)) == 180.0
    assert "no limit" in legend(free)


def test_limits_have_colours_of_their_own() -> None:
    assert len(set(COLOURS.values())) == len(COLOURS)
    assert colour_of("d2 maximum") == colour_of("d2 minimum") == COLOURS["d2"]
    assert colour_of(None) == colour_of("box z minimum") == FREE


def test_feeds_compute_what_is_shown_and_nothing_else() -> None:
    services, state = services_for(), opened(OPTIMAL)
    worker = services.worker
    assert isinstance(worker, StubWorker)

    def follow(now: State) -> None:
        for kind in ORIENTATION.later_feeds:
            kind(services).follow(Frame(now))
        worker.work()

    follow(state)
    assert [order.task.__name__ for order in worker.orders] == ["share_at"]
    drawing = services.get(ShareFeed).drawing
    assert drawing is not None
    assert drawing.share == orientation_share(OPTIMAL, state.pose.position)
    follow(shown(state, tilts=True, over="dexterous", range=15.0))
    tilts = services.get(TiltsFeed).drawing
    assert tilts is not None
    for index in np.random.default_rng(0).integers(len(tilts.tilts), size=20):
        expected = greatest_tilt(OPTIMAL, tilts.positions[index], tilts.request.torsion).tilt
        assert tilts.tilts[index] == pytest.approx(expected, abs=1e-6)
    ranged = services.get(RangeFeed).drawing
    assert ranged is not None
    assert ranged.reachable is not None
    assert ranged.dexterous is not None
    rotations = cone_of_directions(home_pose(OPTIMAL).rotation, 15.0, ORIENTATIONS)
    assert ranged.reachable.volume == reachable_solid(OPTIMAL, rotations).volume
    assert ranged.dexterous.volume == dexterous_solid(OPTIMAL, rotations).volume
    assert ranged.dexterous.volume < ranged.reachable.volume


def test_scale_ends_at_a_round_tilt_with_the_colours_of_its_stops() -> None:
    services, state = services_for(), shown(opened(OPTIMAL), tilts=True)
    feed = services.get(TiltsFeed)
    feed.follow(Frame(state))
    worker = services.worker
    assert isinstance(worker, StubWorker)
    worker.work()
    drawing = feed.drawing
    assert drawing is not None
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
