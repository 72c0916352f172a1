"""Singularities on the page: strata, uncoupled motions, distances, performance; no browser."""

from __future__ import annotations

import math
import re
from dataclasses import replace
from typing import Any

import numpy as np
import pytest
import viser
from desk import Desk, by_name, number, rows_of
from scipy.spatial.transform import Rotation, Slerp
from services import StubWorker, services_for

from explorer.app.features.feature import Services
from explorer.app.features.singularity.actions import (
    GoToSingularity,
    GoToStratum,
    Jog,
    stratum_name,
)
from explorer.app.features.singularity.distance import DistancePanel, distance_table
from explorer.app.features.singularity.feed import StrataFeed
from explorer.app.features.singularity.jog_panel import (
    BEYOND,
    HERE,
    NEVER,
    JogPanel,
    jog_amount,
    jog_label,
    jog_span,
    shown_travel,
    travel_marks,
)
from explorer.app.features.singularity.jog_scene import JogScene, motion_line, shown_motions
from explorer.app.features.singularity.panel import SingularityPanel, summary
from explorer.app.features.singularity.performance import performance_table
from explorer.app.features.singularity.scene import LONGEST, BallScene, EllipsoidScene, NearestGhost
from explorer.app.features.singularity.strata import GOALS, StrataPanel, distances_of, neighbours
from explorer.app.features.singularity.tasks import StrataRequest, strata_distances
from explorer.app.inputs.ranges import coordinate_span
from explorer.app.scene.placing import Placed
from explorer.app.state.actions import GoHome, Open, Set, SetPose, SetPosition
from explorer.app.state.frame import Frame
from explorer.app.state.state import State, opened
from explorer.app.state.view import SingularView
from explorer.errors import InputError
from explorer.mechanism.design_file import PRESETS
from explorer.mechanism.displacement import displacement
from explorer.mechanism.kinematics import attachment_points
from explorer.mechanism.margins import INCIDENCES, margins
from explorer.mechanism.pose import Pose
from explorer.singularity.bruhat import COVERED, OF_INCIDENCES, WORDS, conditions, incidences
from explorer.singularity.jacobian import jacobian
from explorer.singularity.nearest import nearest_singularities
from explorer.singularity.nearest_stratum import nearest_in_stratum
from explorer.singularity.strata import GENERIC, STRATA
from explorer.singularity.turning import least_turns
from explorer.singularity.uncoupled import UNCOUPLED

OPTIMAL = PRESETS["paper-optimal"]
MOTIONS = range(len(UNCOUPLED))


def random_states(count: int, seed: int = 3) -> list[State]:
    """Return the optimum in poses all about its home."""
    rng = np.random.default_rng(seed)
    return [
        opened(
            OPTIMAL,
            Pose.of_yaw_pitch_roll(rng.uniform(-8.0, 15.0, 3), rng.uniform(-80, 80, 3)),
        )
        for _ in range(count)
    ]


def singular_states() -> list[State]:
    """Return the home pose brought to each singular stratum."""
    return [GoToStratum(w).apply(opened(OPTIMAL)) for w in STRATA if w != GENERIC]


def viewed(state: State, **changes: Any) -> State:
    return Set("view.singular", replace(SingularView(), **changes)).apply(state)


def deltas(pose: Pose) -> np.ndarray[Any, np.dtype[np.float64]]:
    return margins(pose.position, pose.rotation)


def plain(html: str) -> str:
    """Return the words of HTML."""
    return re.sub(r"\s+", " ", re.sub("<.*?>", " ", html)).strip()


# Strata


@pytest.mark.parametrize("stratum", [w for w in STRATA if w != GENERIC])
def test_a_stratum_is_gone_to_by_the_shortest_way(stratum: tuple[int, ...]) -> None:
    for state in random_states(2):
        after = GoToStratum(stratum).apply(state)
        expected = nearest_in_stratum(OPTIMAL, state.pose, stratum)
        assert Frame(after).snapshot.stratum == expected.seen == stratum
        way = displacement(
            OPTIMAL,
            state.pose.position,
            state.pose.rotation,
            after.pose.position,
            after.pose.rotation,
        )
        assert float(way) == pytest.approx(expected.distance, rel=1e-9)


@pytest.mark.parametrize("lower", [(2, 4, 3, 1), (1, 2, 3, 4)])
def test_what_has_no_nearest_pose_is_refused_in_words(lower: tuple[int, ...]) -> None:
    state = GoToStratum(lower).apply(opened(OPTIMAL))
    with pytest.raises(InputError, match="arbitrarily close to every pose"):
        GoToStratum(GENERIC).apply(state)
    with pytest.raises(InputError, match=rf"lies in {re.escape(stratum_name(lower))} already"):
        GoToStratum(lower).apply(state)
    with pytest.raises(InputError, match=r"\(3, 4, 2, 1\) borders on"):
        GoToStratum((3, 4, 2, 1)).apply(state)
    with pytest.raises(InputError, match="permutation"):
        GoToStratum((1, 1, 2, 3)).apply(state)


def test_each_node_of_the_diagram_leads_to_its_stratum(services: Services, desk: Desk) -> None:
    panel = StrataPanel(services)
    desk.session.do(Set("view.singular", SingularView(strata=True)))
    contents = [
        str(value)
        for _, name, value in panel.updates(Frame(desk.state))
        if name == "content" and "data-press" in str(value)
    ]
    (html,) = contents
    goals = re.findall(r'data-press="strata.go" data-value="(\d{4})" title="(\([\d, ]+\))', html)
    digits = {name: stratum_name(stratum) for name, stratum in GOALS.items()}
    assert dict(goals) == digits
    assert len(goals) == len(STRATA) - 1
    assert stratum_name(GENERIC) in html
    desk.press(services.buttons, "strata.go", "3412")
    assert Frame(desk.state).snapshot.stratum == (3, 4, 1, 2)
    desk.press(services.buttons, "strata.go", "3421")
    desk.state  # noqa: B018 - waits until it is done
    assert "borders on" in desk.complaints[-1]


def test_no_diagram_is_made_while_it_is_closed(
    services: Services, desk: Desk, worker: StubWorker
) -> None:
    panel = StrataPanel(services)
    desk.session.do(Set("view.singular.strata", value=False))
    services.get(StrataFeed).follow(Frame(desk.state))
    assert worker.orders == []
    contents = [v for _, n, v in panel.updates(Frame(desk.state)) if n == "content"]
    assert len(contents) == 1


@pytest.mark.parametrize("state", [opened(OPTIMAL), *singular_states()])
def test_the_panel_says_where_one_more_incidence_leads(state: State) -> None:
    frame = Frame(state)
    here = frame.snapshot.stratum
    words = plain(neighbours(frame, strata_distances(_request(state)).distances))
    assert stratum_name(here) in words
    # Those of a generic pose stand in the table of the margins.
    for lower in COVERED[here] if here != GENERIC else ():
        zero = ", ".join(f"δ{i}" for i in incidences(lower))
        assert f"{zero} = 0: {', '.join(WORDS[c] for c in conditions(lower))}" in words
    assert ("Both flags coincide" in words) is (here == (1, 2, 3, 4))


def test_distances_come_from_the_worker_but_those_of_one_incidence_at_once() -> None:
    state = viewed(random_states(1)[0], strata=True)
    feed = StrataFeed(services_for())
    known = distances_of(Frame(state), feed)
    assert set(known) == {GENERIC, *OF_INCIDENCES}
    every = strata_distances(_request(state)).distances
    assert set(every) == set(STRATA)
    for stratum, distance in known.items():
        assert distance == pytest.approx(every[stratum], rel=1e-9, abs=1e-12)


def _request(state: State) -> StrataRequest:
    return StrataRequest(state.design, state.pose)


# Uncoupled motions


@pytest.mark.parametrize("motion", MOTIONS)
def test_a_jog_moves_one_margin_and_no_other(motion: int) -> None:
    rng = np.random.default_rng(motion)
    moved = UNCOUPLED[motion].incidence - 1
    others = [i for i in range(3) if i != moved]
    for state in (*random_states(10), *singular_states()):
        after = Jog(motion, float(rng.uniform(-60.0, 60.0))).apply(state)
        before, now = deltas(state.pose), deltas(after.pose)
        size = float(np.linalg.norm(after.pose.position)) + 1.0
        np.testing.assert_allclose(now[others], before[others], atol=1e-13 * size)


@pytest.mark.parametrize("motion", MOTIONS)
def test_a_jog_counts_from_where_it_began_and_leads_back_there(motion: int) -> None:
    start = random_states(1)[0]
    state = start
    for amount in (3.0, -7.5, 20.0):
        state = Jog(motion, amount).apply(state)
        assert jog_amount(state, motion) == amount
        assert [jog_amount(state, other) for other in MOTIONS if other != motion] == [0.0] * 5
    direct = Jog(motion, 20.0).apply(start)
    assert state.pose == direct.pose
    assert Jog(motion, 0.0).apply(state).pose == start.pose


def test_anything_else_that_moves_the_platform_ends_a_jog() -> None:
    state = Jog(2, 4.0).apply(random_states(1)[0])
    for action in (SetPosition(0, 3.0), GoHome(), Open(OPTIMAL), Jog(5, 2.0)):
        after = action.apply(state)
        assert jog_amount(after, 2) == 0.0
    # The next one begins where the platform is then.
    after = Jog(2, 1.0).apply(SetPosition(0, 3.0).apply(state))
    assert after.jog is not None
    assert after.jog.start.position[0] == 3.0


@pytest.mark.parametrize("state", random_states(6))
def test_the_ends_of_a_slider_say_where_the_margin_vanishes(state: State) -> None:
    frame = Frame(state)
    for index, motion in enumerate(UNCOUPLED):
        travel, span = shown_travel(state, index), jog_span(state, index)
        marks = travel_marks(frame, index)
        for (at, shown), end in zip(marks, (travel.low, travel.high), strict=True):
            assert span.low <= at <= span.high
            if math.isinf(end):
                assert shown == NEVER
                continue
            if shown == BEYOND:
                assert abs(end) > abs(at)
            else:
                assert at == end
                assert number(shown.rstrip("°")) == pytest.approx(end, abs=0.06)
            after = Jog(index, end).apply(state)
            size = float(np.linalg.norm(after.pose.position)) + 1.0
            assert abs(deltas(after.pose)[motion.incidence - 1]) < 1e-12 * size


def test_no_number_of_a_motion_is_larger_than_its_slider_on_any_path() -> None:
    # On the way from mode 1 to mode 5 here, b4 passes where the motion along x does nothing.
    paper = Pose.of_yaw_pitch_roll((14.0, -2.0, 6.0), (-40.0, 0.0, 0.0))
    states = [opened(OPTIMAL, paper), *random_states(12, seed=8), *singular_states()]
    for state in states:
        here = Frame(state)
        modes = here.snapshot.modes
        first, last = modes.position[1], modes.position[5]
        turns = Rotation.from_matrix(modes.rotation[[1, 5]])
        between = Slerp([0.0, 1.0], turns)
        for share in (0.0, 0.25, 0.5 - 1e-9, 0.5, 0.5 + 1e-13, 0.75, 1.0):
            there = opened(
                OPTIMAL,
                Pose.of((1.0 - share) * first + share * last, between(share).as_matrix()),
            )
            edge = coordinate_span(there).high
            for index, motion in enumerate(UNCOUPLED):
                most = edge if motion.kind == "translation" else 180.0
                for at, shown in travel_marks(Frame(there), index):
                    assert abs(at) <= most
                    if shown not in (NEVER, BEYOND, HERE, ""):
                        assert abs(number(shown.rstrip("°"))) <= most
                    assert "e" not in shown or shown in (NEVER, BEYOND, HERE)


@pytest.mark.parametrize("state", random_states(4))
def test_the_marks_of_a_motion_stay_where_it_is_singular_while_it_goes(
    services: Services, desk: Desk, state: State
) -> None:
    desk.session.do(SetPose(state.pose))
    panel = JogPanel(services)
    index = 1
    marks: list[list[tuple[float, str]]] = []
    for amount in (0.0, 10.0, 25.0):
        desk.session.do(Jog(index, amount))
        found: list[Any] = [v for _, n, v in panel.updates(Frame(desk.state)) if n == "marks"]
        marks.append(list(found[index]))
    assert marks[0] == marks[1] == marks[2]
    travel = shown_travel(state, index)
    assert [value for value, _ in marks[0]] == pytest.approx([travel.low, travel.high])


def test_a_slider_jogs(services: Services, desk: Desk) -> None:
    panel = JogPanel(services)
    sliders: dict[str, Any] = {
        handle.label: handle
        for handle, _, _ in panel.updates(Frame(desk.state))
        if isinstance(handle, viser.GuiSliderHandle)
    }
    label = jog_label(UNCOUPLED[0])
    before = desk.state
    desk.use(sliders[label], 12.0)
    assert desk.state.pose == Jog(0, 12.0).apply(before).pose
    assert len(sliders) == 6


def test_at_a_singular_pose_motions_say_so_and_lead_away() -> None:
    for index, motion in enumerate(UNCOUPLED):
        home = opened(OPTIMAL)
        state = GoToSingularity(motion.incidence).apply(home)
        # A margin that is zero but for rounding is zero.
        travel = motion.travel(state.pose)
        assert min(abs(travel.low), abs(travel.high)) < 1e-9
        assert travel_marks(Frame(state), index) == ((0.0, HERE), (0.0, ""))
        assert f"δ{motion.incidence} = 0: {INCIDENCES[motion.incidence - 1]}" in plain(
            summary(Frame(state))
        )
        after = Jog(index, 5.0).apply(state)
        moved = motion.moved(state.pose, 1e-6)
        change = margins(moved.position, moved.rotation)[motion.incidence - 1]
        if abs(change) > 1e-9:
            assert Frame(after).snapshot.stratum == GENERIC


@pytest.mark.parametrize("state", [*random_states(3), *singular_states()])
def test_sliders_of_motions_hold_their_start_and_their_marks(state: State) -> None:
    for index in MOTIONS:
        span = jog_span(state, index)
        assert span.low <= 0.0 <= span.high
        assert span.low < span.high
        # The start is among the values of the slider.
        assert abs(span.low / span.step - round(span.low / span.step)) < 1e-6
        for at, _ in travel_marks(Frame(state), index):
            assert span.low <= at <= span.high


@pytest.mark.parametrize("state", random_states(5))
def test_a_motion_is_drawn_from_singularity_to_singularity(state: State) -> None:
    placed = Placed(Frame(state))
    for index, motion in enumerate(UNCOUPLED):
        drawn = motion_line(placed, motion, placed.frame.travels[index])
        for end, is_singular, amount in zip(
            (0, -1),
            drawn.singular,
            (placed.frame.travels[index].low, placed.frame.travels[index].high),
            strict=True,
        ):
            if is_singular and motion.frame == "base":
                there = motion.moved(state.pose, amount)
                np.testing.assert_allclose(
                    drawn.points[end], placed.scale * np.array(there.position), atol=1e-9
                )
            if not is_singular:
                assert motion.kind == "translation"
        assert np.isfinite(drawn.points).all()


def test_the_motion_in_use_is_drawn_or_all_six_or_none(services: Services) -> None:
    scene = JogScene(services)
    state = random_states(1)[0]
    for arrows, at_rest, in_use in (
        ("one in use", (), (4,)),
        ("all six", tuple(MOTIONS), tuple(MOTIONS)),
        ("none", (), ()),
    ):
        rest = viewed(state, arrows=arrows)
        for each, expected in ((rest, at_rest), (Jog(4, 5.0).apply(rest), in_use)):
            placed = Placed(Frame(each))
            assert shown_motions(placed) == expected
            drawn = by_name(scene.updates(placed))
            lines = [drawn[f"/motion/{i}/line"]["visible"] for i in MOTIONS]
            assert lines == [i in expected for i in MOTIONS]


@pytest.mark.parametrize("state", singular_states())
def test_motions_are_drawn_at_singular_poses_too(services: Services, state: State) -> None:
    drawn = by_name(JogScene(services).updates(Placed(Frame(viewed(state, arrows="all six")))))
    for properties in drawn.values():
        for name in ("points", "batched_positions", "batched_scales"):
            if name in properties:
                assert np.isfinite(properties[name]).all()


# Distances


@pytest.mark.parametrize("state", random_states(4))
def test_the_distances_and_their_ghosts(services: Services, state: State) -> None:
    nearest = nearest_singularities(OPTIMAL, state.pose)
    words = plain(distance_table(Frame(state)))
    distances = [each.distance for each in nearest]
    turns = np.degrees(least_turns(state.pose.position, state.pose.rotation))
    for index, margin in enumerate(deltas(state.pose).tolist()):
        row = re.search(rf"δ{index + 1} (\S+) (\S+) mm (\S+)° Go {INCIDENCES[index]}", words)
        assert row is not None
        assert number(row[1]) == pytest.approx(margin, abs=5e-3)
        assert number(row[2]) == pytest.approx(OPTIMAL.unit_mm * distances[index], rel=1e-2)
        assert number(row[3]) == pytest.approx(turns[index], abs=0.06)
    scene = NearestGhost(services)
    least = int(np.argmin(distances))
    for ghost, index in (("δ1 = 0", 0), ("δ2 = 0", 1), ("δ3 = 0", 2), ("nearest", least)):
        placed = Placed(Frame(viewed(state, ghost=ghost)))
        drawn = by_name(scene.updates(placed))
        plate, ways = drawn["/nearest/platform"], drawn["/nearest/ways"]["points"]
        assert plate["visible"] is True
        assert plate["wxyz"] == nearest[index].pose.quaternion
        lengths = np.linalg.norm(ways[:, 1] - ways[:, 0], axis=1) / placed.scale
        assert float(np.sqrt((lengths**2).mean())) == pytest.approx(distances[index], rel=1e-4)
        assert f"δ{index + 1} = 0" in drawn["/nearest/label"]["text"]
        there = attachment_points(
            OPTIMAL, nearest[index].pose.position, nearest[index].pose.rotation
        )
        ends = placed.scale * np.array([there.b1, there.b2, there.b3, there.b4])
        np.testing.assert_allclose(ways[:, 1], ends, rtol=1e-4, atol=1e-4)


def test_the_buttons_go_to_the_nearest_pose_and_say_where_it_is_reached(
    services: Services, desk: Desk
) -> None:
    DistancePanel(services)
    expected = nearest_singularities(OPTIMAL, desk.state.pose)[1].pose
    desk.press(services.buttons, "singular.go", "2")
    assert desk.state.pose == expected
    assert Frame(desk.state).snapshot.stratum == (4, 2, 3, 1)
    drawn = by_name(
        NearestGhost(services).updates(Placed(Frame(viewed(desk.state, ghost="δ2 = 0"))))
    )
    assert not any(each["visible"] for each in drawn.values())
    with pytest.raises(InputError, match="δ2 = 0 already: lines a1a2 and b2b3 meeting"):
        GoToSingularity(2).apply(viewed(GoToStratum((2, 1, 4, 3)).apply(desk.state)))


# Performance


@pytest.mark.parametrize("state", random_states(4))
def test_the_ellipsoids_hold_what_unit_actuators_do(services: Services, state: State) -> None:
    rates = jacobian(OPTIMAL, state.pose.position, state.pose.rotation)
    rng = np.random.default_rng(1)
    joints = rng.normal(size=(4000, 6))
    joints /= np.linalg.norm(joints, axis=1, keepdims=True)
    speeds = np.linalg.norm((joints @ np.linalg.inv(rates).T)[:, :3], axis=1)
    rows = {row[0]: row[1:] for row in rows_of(performance_table(Frame(state)))}
    most = number(rows["speed of b4"][1])
    assert speeds.max() <= most * (1.0 + 5e-3)
    assert speeds.max() > 0.7 * most
    assert number(rows["force at b4"][0]) == pytest.approx(1.0 / most, rel=1e-2)
    scene = EllipsoidScene(services)
    for kind in ("speed", "force"):
        placed = Placed(Frame(viewed(state, ellipsoid=kind)))
        drawn = by_name(scene.updates(placed))
        body, axes = drawn["/ellipsoid/body"], drawn["/ellipsoid/axes"]["points"]
        assert body["visible"] is True
        assert max(body["scale"]) <= LONGEST
        np.testing.assert_allclose(
            np.linalg.norm(axes[:, 1] - axes[:, 0], axis=1), 2 * np.array(body["scale"]), rtol=1e-3
        )
        np.testing.assert_allclose(
            axes.mean(axis=1), np.tile(placed.points["b4"], (3, 1)), atol=1e-4
        )


@pytest.mark.parametrize("state", random_states(5))
def test_the_ball_touches_the_nearest_singular_plane(services: Services, state: State) -> None:
    placed = Placed(Frame(viewed(state, ball=True)))
    drawn = by_name(BallScene(services).updates(placed))
    radius = drawn["/ball/ball"]["scale"] / placed.scale
    touch = np.array(drawn["/ball/touch"]["position"]) / placed.scale
    p = np.array(state.pose.position)
    assert np.linalg.norm(touch - p) == pytest.approx(radius)
    assert np.abs(margins(touch, state.pose.rotation)).min() < 1e-9
    rng = np.random.default_rng(0)
    away = rng.normal(size=(500, 3))
    inside = p + 0.999 * radius * away / np.linalg.norm(away, axis=1, keepdims=True)
    assert (np.sign(margins(inside, state.pose.rotation)) == np.sign(deltas(state.pose))).all()


@pytest.mark.parametrize("state", singular_states())
@pytest.mark.filterwarnings("error")
def test_everything_is_told_and_drawn_at_singular_poses(
    services: Services, desk: Desk, state: State
) -> None:
    shown = viewed(
        state, ghost="nearest", strata=True, arrows="all six", ellipsoid="speed", ball=True
    )
    frame = Frame(shown)
    words = plain(summary(frame))
    for index in incidences(frame.snapshot.stratum):
        assert f"δ{index} = 0: {INCIDENCES[index - 1]}" in words
    panel = SingularityPanel(services)
    texts = [str(v) for _, n, v in panel.updates(frame) if n == "content"]
    assert not any(re.search(r"\b(nan|inf)\b", plain(text)) for text in texts)
    assert "none: δ" in plain(performance_table(frame))
    placed = Placed(frame)
    for scene in (
        EllipsoidScene(services),
        BallScene(services),
        NearestGhost(services),
    ):
        for _, name, value in scene.updates(placed):
            if name in ("points", "scale", "position", "wxyz"):
                assert np.isfinite(np.asarray(value, dtype=np.float64)).all()
