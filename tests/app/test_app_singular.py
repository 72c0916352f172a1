"""Singularities on the page: strata, uncoupled motions, distances, performance; no browser."""

from __future__ import annotations

import math
import re
from dataclasses import replace
from typing import Any

import numpy as np
import pytest
import viser
from desk import Desk, by_name, number
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
from explorer.app.features.singularity.strata import GOALS, StrataPanel, distances_of
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
from explorer.singularity.bruhat import OF_INCIDENCES, incidences
from explorer.singularity.nearest import nearest_singularities
from explorer.singularity.nearest_stratum import nearest_in_stratum
from explorer.singularity.strata import GENERIC, STRATA
from explorer.singularity.turning import least_turns
from explorer.singularity.uncoupled import UNCOUPLED

OPTIMAL = PRESETS["paper-optimal"]
MOTIONS = range(len(UNCOUPLED))
BATCHED = ("batched_positions", "batched_scales")


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
def test_stratum_is_reached_by_the_shortest_way(stratum: tuple[int, ...]) -> None:
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
def test_stratum_without_a_nearest_pose_is_refused(lower: tuple[int, ...]) -> None:
    state = GoToStratum(lower).apply(opened(OPTIMAL))
    for goal, words in (
        (GENERIC, "arbitrarily close to every pose"),
        (lower, rf"lies in {re.escape(stratum_name(lower))} already"),
        ((3, 4, 2, 1), r"\(3, 4, 2, 1\) borders on"),
        ((1, 1, 2, 3), "permutation"),
    ):
        with pytest.raises(InputError, match=words):
            GoToStratum(goal).apply(state)


def test_diagram_has_a_node_for_each_stratum_and_is_made_only_while_it_is_open(
    services: Services, desk: Desk, worker: StubWorker
) -> None:
    panel = StrataPanel(services)

    def contents() -> list[str]:
        updates = panel.updates(Frame(desk.state))
        return [str(value) for _, name, value in updates if name == "content"]

    desk.session.do(Set("view.singular.strata", value=False))
    services.get(StrataFeed).follow(Frame(desk.state))
    assert worker.orders == []
    assert len(contents()) == 1
    desk.session.do(Set("view.singular.strata", value=True))
    (html,) = (content for content in contents() if "data-press" in content)
    goals = re.findall(r'data-press="strata.go" data-value="(\d{4})" title="(\([\d, ]+\))', html)
    assert dict(goals) == {name: stratum_name(stratum) for name, stratum in GOALS.items()}
    assert len(goals) == len(STRATA) - 1
    desk.press(services.buttons, "strata.go", "3412")
    assert Frame(desk.state).snapshot.stratum == (3, 4, 1, 2)


def test_distances_come_from_the_worker_but_those_of_one_incidence_at_once() -> None:
    state = viewed(random_states(1)[0], strata=True)
    feed = StrataFeed(services_for())
    known = distances_of(Frame(state), feed)
    assert set(known) == {GENERIC, *OF_INCIDENCES}
    every = strata_distances(StrataRequest(state.design, state.pose)).distances
    assert set(every) == set(STRATA)
    for stratum, distance in known.items():
        assert distance == pytest.approx(every[stratum], rel=1e-9, abs=1e-12)


# Uncoupled motions


@pytest.mark.parametrize("motion", MOTIONS)
def test_jog_counts_from_its_start_and_leads_back_there(motion: int) -> None:
    start = random_states(1)[0]
    state = start
    for amount in (3.0, -7.5, 20.0):
        state = Jog(motion, amount).apply(state)
        assert jog_amount(state, motion) == amount
        assert [jog_amount(state, other) for other in MOTIONS if other != motion] == [0.0] * 5
    direct = Jog(motion, 20.0).apply(start)
    assert state.pose == direct.pose
    assert Jog(motion, 0.0).apply(state).pose == start.pose


def test_jog_ends_when_the_platform_moves_otherwise() -> None:
    state = Jog(2, 4.0).apply(random_states(1)[0])
    for action in (SetPosition(0, 3.0), GoHome(), Open(OPTIMAL), Jog(5, 2.0)):
        after = action.apply(state)
        assert jog_amount(after, 2) == 0.0
    # The next one begins where the platform is then.
    after = Jog(2, 1.0).apply(SetPosition(0, 3.0).apply(state))
    assert after.jog is not None
    assert after.jog.start.position[0] == 3.0


@pytest.mark.parametrize("state", random_states(4))
def test_slider_of_a_motion_has_marks_where_the_margin_vanishes(state: State) -> None:
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


def test_marks_of_a_motion_are_on_its_slider_on_any_path() -> None:
    # On the way from mode 1 to mode 5 here, b4 passes where the motion along x does nothing.
    paper = Pose.of_yaw_pitch_roll((14.0, -2.0, 6.0), (-40.0, 0.0, 0.0))
    states = [opened(OPTIMAL, paper), *random_states(4, seed=8), *singular_states()]
    for state in states:
        modes = Frame(state).snapshot.modes
        first, last = modes.position[1], modes.position[5]
        between = Slerp([0.0, 1.0], Rotation.from_matrix(modes.rotation[[1, 5]]))
        for share in (0.0, 0.5 - 1e-9, 0.5, 0.5 + 1e-13, 0.75):
            position = (1.0 - share) * first + share * last
            there = opened(OPTIMAL, Pose.of(position, between(share).as_matrix()))
            edge = coordinate_span(there).high
            for index, motion in enumerate(UNCOUPLED):
                most = edge if motion.kind == "translation" else 180.0
                span = jog_span(there, index)
                assert span.low <= 0.0 <= span.high
                # The start is among the values of the slider.
                assert abs(span.low / span.step - round(span.low / span.step)) < 1e-6
                for at, shown in travel_marks(Frame(there), index):
                    assert span.low <= at <= span.high
                    assert abs(at) <= most
                    if shown not in (NEVER, BEYOND, HERE, ""):
                        assert abs(number(shown.rstrip("°"))) <= most
                        assert "e" not in shown


def test_slider_of_a_motion_jogs(services: Services, desk: Desk) -> None:
    panel = JogPanel(services)
    sliders: dict[str, Any] = {
        handle.label: handle
        for handle, _, _ in panel.updates(Frame(desk.state))
        if isinstance(handle, viser.GuiSliderHandle)
    }
    assert len(sliders) == 6
    before = desk.state
    desk.use(sliders[jog_label(UNCOUPLED[0])], 12.0)
    assert desk.state.pose == Jog(0, 12.0).apply(before).pose


def test_marks_of_a_motion_stay_where_it_is_singular_while_it_moves(
    services: Services, desk: Desk
) -> None:
    (state,) = random_states(1)
    desk.session.do(SetPose(state.pose))
    panel, index = JogPanel(services), 1
    marks: list[list[tuple[float, str]]] = []
    for amount in (0.0, 10.0, 25.0):
        desk.session.do(Jog(index, amount))
        found: list[Any] = [v for _, n, v in panel.updates(Frame(desk.state)) if n == "marks"]
        marks.append(list(found[index]))
    assert marks[0] == marks[1] == marks[2]
    travel = shown_travel(state, index)
    assert [value for value, _ in marks[0]] == pytest.approx([travel.low, travel.high])


def test_motions_at_a_singular_pose_say_so_and_lead_away() -> None:
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


@pytest.mark.parametrize("state", random_states(3))
def test_motion_is_drawn_from_singularity_to_singularity(state: State) -> None:
    placed = Placed(Frame(state))
    for motion, travel in zip(UNCOUPLED, placed.frame.travels, strict=True):
        drawn = motion_line(placed, motion, travel)
        assert np.isfinite(drawn.points).all()
        ends = zip((0, -1), drawn.singular, (travel.low, travel.high), strict=True)
        for end, is_singular, amount in ends:
            if is_singular and motion.frame == "base":
                there = placed.scale * np.array(motion.moved(state.pose, amount).position)
                np.testing.assert_allclose(drawn.points[end], there, atol=1e-9)
            assert is_singular or motion.kind == "translation"


def test_motion_in_use_is_drawn_or_all_six_or_none(services: Services) -> None:
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


# Distances


@pytest.mark.parametrize("state", random_states(2))
def test_distances_and_their_ghosts_are_those_of_the_nearest_poses(
    services: Services, state: State
) -> None:
    nearest = nearest_singularities(OPTIMAL, state.pose)
    words = plain(distance_table(Frame(state)))
    distances = [each.distance for each in nearest]
    turns = np.degrees(least_turns(state.pose.position, state.pose.rotation))
    for index, margin in enumerate(deltas(state.pose).tolist()):
        row = re.search(rf"δ{index + 1} (\S+) (\S+) mm (\S+)° Go {INCIDENCES[index]}", words)
        assert row is not None
        expected = (margin, OPTIMAL.unit_mm * distances[index], turns[index])
        assert [number(text) for text in row.groups()] == pytest.approx(
            expected, rel=1e-2, abs=0.06
        )
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


def test_buttons_lead_to_the_nearest_pose_and_refuse_where_it_is_reached(
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


@pytest.mark.parametrize("state", random_states(2))
def test_ellipsoids_are_at_b4_and_have_their_axes(services: Services, state: State) -> None:
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


@pytest.mark.parametrize("state", singular_states())
@pytest.mark.filterwarnings("error")
def test_singular_pose_is_named_and_drawn_without_infinite_numbers(
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
        JogScene(services),
    ):
        for _, name, value in scene.updates(placed):
            if name in ("points", "scale", "position", "wxyz", *BATCHED):
                assert np.isfinite(np.asarray(value, dtype=np.float64)).all()
