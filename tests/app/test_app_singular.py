"""Singularities and assembly modes on the page: strata, distances, tables; no browser."""

from __future__ import annotations

import re
from collections.abc import Generator
from dataclasses import replace
from types import SimpleNamespace
from typing import Any

import numpy as np
import pytest
import server_clock
from desk import CLIENT, Desk, by_name, markup_of, number, random_states
from hypothesis import given
from services import StubJobs, services_for
from strategies import Case, all_cases

from explorer.app.features.feature import Services
from explorer.app.features.mechanism import modes
from explorer.app.features.mechanism.feature import limits_figure
from explorer.app.features.singularity import work
from explorer.app.features.singularity.feature import (
    GOALS,
    SingularityPanel,
    add_strata,
    distance_table,
    distances_of,
    performance_table,
    summary,
)
from explorer.app.features.singularity.scene import (
    AMPLITUDE,
    FRAME_SECONDS,
    PERIOD,
    PERIODS,
    BallScene,
    EllipsoidScene,
    FreeMotion,
    NearestGhost,
    show_button,
)
from explorer.app.inputs.controls import Controls
from explorer.app.scene.placing import Placed
from explorer.app.session.session import UNDO
from explorer.app.state.actions import Set
from explorer.app.state.frame import Frame
from explorer.app.state.moves import set_mode, set_position
from explorer.app.state.state import State, open_state
from explorer.app.state.view import SingularView
from explorer.app.widgets.blocks import render
from explorer.errors import InputError
from explorer.measures.blocks.singularity import freedoms
from explorer.mechanism.configuration import Configuration
from explorer.mechanism.design_file import PRESETS
from explorer.mechanism.margins import INCIDENCES
from explorer.mechanism.pose import Pose
from explorer.singularity.freedoms import least_turns
from explorer.singularity.nearest import displacement, nearest_singularities
from explorer.singularity.nearest_stratum import nearest_in_stratum
from explorer.singularity.strata import GENERIC, OF_INCIDENCES, STRATA, incidences

OPTIMAL = PRESETS["paper-optimal"]
BATCHED = ("batched_positions", "batched_scales")


def singular_states() -> list[State]:
    """Return the home pose brought to each singular stratum."""
    return [work.go_to_stratum(w).apply(open_state(OPTIMAL)) for w in STRATA if w != GENERIC]


def viewed(state: State, **changes: Any) -> State:
    return Set("view.singular", replace(SingularView(), **changes)).apply(state)


def plain(html: str) -> str:
    """Return the words of HTML."""
    return re.sub(r"\s+", " ", re.sub("<.*?>", " ", html)).strip()


# Strata


@pytest.mark.parametrize("stratum", [w for w in STRATA if w != GENERIC])
def test_stratum_is_reached_by_the_shortest_way(stratum: tuple[int, ...]) -> None:
    for state in random_states(2):
        after = work.go_to_stratum(stratum).apply(state)
        expected = nearest_in_stratum(OPTIMAL, state.pose, stratum)
        assert Frame(after).snapshot.stratum == stratum
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
    state = work.go_to_stratum(lower).apply(open_state(OPTIMAL))
    for goal, words in (
        (GENERIC, "arbitrarily close to every pose"),
        (lower, rf"lies in {re.escape(work.stratum_name(lower))} already"),
        ((3, 4, 2, 1), r"\(3, 4, 2, 1\) borders on"),
        ((1, 1, 2, 3), "permutation"),
    ):
        with pytest.raises(InputError, match=words):
            work.go_to_stratum(goal).apply(state)


def test_diagram_has_a_node_for_each_stratum_and_is_made_only_while_it_is_open(
    services: Services, desk: Desk, jobs: StubJobs
) -> None:
    panel = Controls(services)
    add_strata(services, panel)

    def contents() -> list[str]:
        updates = panel.updates(Frame(desk.state))
        return [str(value) for _, name, value in updates if name == "content"]

    desk.session.do(Set("view.singular.strata", value=False))
    services.get(work.STRATA_FEED).follow(Frame(desk.state))
    assert jobs.orders == []
    assert len(contents()) == 1
    desk.session.do(Set("view.singular.strata", value=True))
    (html,) = (content for content in contents() if "data-press" in content)
    goals = re.findall(r'data-press="strata.go" data-value="(\d{4})" title="(\([\d, ]+\))', html)
    assert dict(goals) == {name: work.stratum_name(stratum) for name, stratum in GOALS.items()}
    assert len(goals) == len(STRATA) - 1
    desk.press(services.buttons, "strata.go", "3412")
    assert Frame(desk.state).snapshot.stratum == (3, 4, 1, 2)


def test_distances_come_from_the_worker_but_those_of_one_incidence_at_once() -> None:
    state = viewed(random_states(1)[0], strata=True)
    feed = work.STRATA_FEED(services_for())
    known = distances_of(Frame(state), feed)
    assert set(known) == {GENERIC, *OF_INCIDENCES}
    every = work.strata_distances((state.design, state.pose))
    assert set(every) == set(STRATA)
    for stratum, distance in known.items():
        assert distance == pytest.approx(every[stratum], rel=1e-9, abs=1e-12)


# Distances


@pytest.mark.parametrize("state", random_states(2))
def test_distances_and_their_ghosts_are_those_of_the_nearest_poses(
    services: Services, state: State
) -> None:
    nearest = nearest_singularities(OPTIMAL, state.pose)
    words = plain(distance_table(Frame(state)))
    distances = [each.distance for each in nearest]
    turns = np.degrees(least_turns(state.pose.position, state.pose.rotation))
    for index, margin in enumerate(Frame(state).snapshot.margins):
        row = re.search(rf"δ{index + 1} (\S+) (\S+) (\S+) Go {INCIDENCES[index]}", words)
        assert row is not None
        lengths = OPTIMAL.unit_mm * np.array((margin, distances[index]))
        expected = (*lengths, turns[index])
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
        there = Configuration(
            OPTIMAL, nearest[index].pose.position, nearest[index].pose.rotation
        ).points
        ends = placed.scale * np.array([there.b1, there.b2, there.b3, there.b4])
        np.testing.assert_allclose(ways[:, 1], ends, rtol=1e-4, atol=1e-4)


def test_buttons_lead_to_the_nearest_pose_and_refuse_where_it_is_reached(
    services: Services, desk: Desk
) -> None:
    SingularityPanel(services)
    expected = nearest_singularities(OPTIMAL, desk.state.pose)[1].pose
    desk.press(services.buttons, "singular.go", "2")
    assert desk.state.pose == expected
    assert Frame(desk.state).snapshot.stratum == (4, 2, 3, 1)
    drawn = by_name(
        NearestGhost(services).updates(Placed(Frame(viewed(desk.state, ghost="δ2 = 0"))))
    )
    assert not any(each["visible"] for each in drawn.values())
    with pytest.raises(InputError, match="δ2 = 0 already: lines a1a2 and b2b3 meeting"):
        work.go_to_singularity(2).apply(viewed(work.go_to_stratum((2, 1, 4, 3)).apply(desk.state)))


# Singular poses


@pytest.mark.parametrize("state", singular_states())
@pytest.mark.filterwarnings("error")
def test_singular_pose_is_named_and_drawn_without_infinite_numbers(
    services: Services, desk: Desk, state: State
) -> None:
    shown = viewed(state, ghost="nearest", strata=True, ellipsoid="speed", ball=True)
    frame = Frame(shown)
    words = plain(summary(frame))
    for index in incidences(frame.snapshot.stratum):
        assert f"δ{index} = 0: {INCIDENCES[index - 1]}" in words
    found = frame.snapshot.freedoms
    assert "With all actuators locked the platform" in words
    assert words.count("it turns") == words.count("Show the motion") == len(found.turns)
    assert ("at any angle" in words) == any(turn.is_finite for turn in found.turns)
    panel = SingularityPanel(services)
    assert not re.search(r"\b(nan|inf)\b", plain(markup_of(panel, frame.state)))
    assert "none: δ" in plain(performance_table(frame))
    placed = Placed(frame)
    motion = FreeMotion(services)
    list(motion.updates(placed))
    desk.press(services.buttons, "singular.show", found.turns[0].incidence)
    for scene in (EllipsoidScene(services), BallScene(services), NearestGhost(services), motion):
        for _, name, value in scene.updates(placed):
            if name in ("points", "scale", "position", "wxyz", *BATCHED):
                assert np.isfinite(np.asarray(value, dtype=np.float64)).all()


@pytest.mark.parametrize(
    ("incidence", "line", "through"),
    [(1, "the line b2b3", "b4"), (2, "the line a1b4", "a1"), (3, "the guide", "a1")],
)
def test_singular_pose_says_about_which_line_locked_actuators_let_the_platform_turn(
    incidence: int, line: str, through: str
) -> None:
    assert not list(freedoms(Frame(open_state(OPTIMAL)).snapshot))
    frame = Frame(work.go_to_singularity(incidence).apply(random_states(1)[0]))
    words = plain(render(freedoms(frame.snapshot), {f"show {incidence}": show_button(incidence)}))
    place, rotation = np.array(frame.state.pose.position), frame.state.pose.rotation
    found = re.fullmatch(
        f"With all actuators locked the platform can still move: it turns about {line}, pitch 0, "
        rf"through {through}(?: \((.*)\) units)?, along \((.*)\) Show the motion",
        words,
    )
    assert found is not None
    point, along = ([number(each) for each in (text or "0").split(",")] for text in found.groups())
    np.testing.assert_allclose(point, place if incidence == 1 else [0.0], atol=0.06)
    expected = [rotation[:, 0], place / np.linalg.norm(place), [1.0, 0.0, 0.0]][incidence - 1]
    np.testing.assert_allclose(along, expected, atol=0.006)


def test_pose_within_the_limits_looks_safe_unless_it_is_singular() -> None:
    regular = open_state(OPTIMAL)
    singular = work.go_to_singularity(2).apply(regular)
    for state, kept in ((regular, "kept"), (singular, "kept, but singular")):
        frame = Frame(state)
        assert not frame.snapshot.violations
        assert plain(limits_figure(frame)) == f"Limits {kept}"
        for html in (limits_figure(frame), modes.modes_table(frame, "")):
            assert ("ex-within" in html) == (state == regular)


def test_page_counts_colliding_legs_among_the_broken_limits() -> None:
    frame = Frame(open_state(OPTIMAL.with_limits(leg_radii=(0.4, 0.4, 0.4, 0.4))))
    assert plain(limits_figure(frame)) == "Limits 1 broken"
    assert "legs 2 and 3 overlap by 1.306 mm" in limits_figure(frame)
    assert "legs 2 and 3 overlap by 1.306 mm" in modes.present_mode(frame)
    assert rows_of_modes(frame)[frame.state.mode][5] == "legs 2–3"


@pytest.fixture
def still_clock() -> Generator[None]:
    """A clock that stands all but still unless it is advanced."""
    server_clock.set_pace(1e-6)
    yield
    server_clock.set_pace(1.0)


@pytest.mark.usefixtures("still_clock")
def test_motion_swings_a_ghost_by_a_share_of_the_reach_and_leaves_the_state_alone(
    services: Services, desk: Desk
) -> None:
    desk.session.do(work.go_to_singularity(2))
    motion, before, steps = FreeMotion(services), desk.state, desk.session.history
    frames: list[Frame] = []

    def keep(frame: Frame) -> None:
        frames.append(frame)

    desk.draw = keep

    def tips() -> Any:
        """Return b1 to b4 of the ghost in the scene; None if none is drawn."""
        scene = by_name(motion.updates(Placed(Frame(desk.state))))
        shown = {name: values["visible"] for name, values in scene.items()}
        assert len(set(shown.values())) == 1
        return scene["/freedom/legs"]["points"][:, 1] if shown["/freedom/legs"] else None

    assert tips() is None
    # No turn about the line b2b3 is free here.
    desk.press(services.buttons, "singular.show", "1")
    assert tips() is None
    desk.press(services.buttons, "singular.show", "2")
    placed = Placed(Frame(before))
    ways: list[Any] = []
    for _ in range(4):
        ways.append(tips() - placed.struts[1])
        assert "turns about the line a1b4" in str(
            by_name(motion.updates(placed))["/freedom/label"]["text"]
        )
        server_clock.advance(0.25 * PERIOD)
    sizes = [np.linalg.norm(way, axis=1).max() / placed.reach for way in ways]
    np.testing.assert_allclose(sizes, [0.0, AMPLITUDE, 0.0, AMPLITUDE], atol=2e-3)
    # To either side.
    assert float(np.sum(ways[1] * ways[3])) < 0.0
    drawn = len(frames)
    server_clock.advance(FRAME_SECONDS)
    desk.wait(lambda _: len(frames) > drawn)
    server_clock.advance(PERIODS * PERIOD)
    assert server_clock.wait_until_quiet(60.0)
    assert tips() is None
    assert desk.state == before
    assert desk.session.history == steps


@pytest.mark.usefixtures("still_clock")
def test_motion_ends_once_the_platform_is_moved(services: Services, desk: Desk) -> None:
    desk.session.do(work.go_to_singularity(3))
    motion = FreeMotion(services)

    def is_shown() -> bool:
        scene = by_name(motion.updates(Placed(Frame(desk.state))))
        return bool(scene["/freedom/axis"]["visible"])

    assert not is_shown()
    desk.press(services.buttons, "singular.show", "3")
    assert is_shown()
    desk.session.do(set_position(0, 9.0))
    assert not is_shown()
    desk.session.do(UNDO)
    assert not is_shown()
    server_clock.advance(FRAME_SECONDS)
    assert server_clock.wait_until_quiet(60.0)


# Assembly modes


def rows_of_modes(frame: Frame) -> list[list[str]]:
    """Return the cells of each row of the table."""
    buttons = re.findall(r"<button[^>]*modes\.go.*?</button>", modes.modes_table(frame, ""))
    cells = [re.findall(r"<(?:b|span)(?: [^>]*)?>([^<]*)", button) for button in buttons]
    return [[cell for cell in row if cell] for row in cells]


def test_table_has_the_eight_modes_with_b4_and_the_limits_that_each_breaks() -> None:
    frame = Frame(open_state(OPTIMAL))
    rows = rows_of_modes(frame)
    assert [row[0] for row in rows] == [str(mode) for mode in range(8)]
    for mode, row in enumerate(rows):
        assert f"{row[0]}:  {row[1]}" == modes.MODES[mode]
        there = Frame(set_mode(mode).apply(frame.state))
        np.testing.assert_allclose(
            [number(cell) for cell in row[2:5]],
            OPTIMAL.unit_mm * np.array(there.state.pose.position),
            atol=0.6,
        )
        # All numbers of the table have the same decimals.
        assert not any("." in cell for cell in row[2:5])
        broken = there.snapshot.violations
        assert (row[5] == "within") == (not broken)
        if broken:
            assert row[5].split(" +")[0] in broken[0].limit
            assert broken[0].words(OPTIMAL.millimetres) in modes.modes_table(frame, "").replace(
                "&#x27;", "'"
            )
            assert row[5].endswith(f" +{len(broken) - 1}") == (len(broken) > 1)


@given(all_cases())
def test_table_of_any_pose_has_eight_rows_with_numbers(case: Case) -> None:
    frame = Frame(open_state(case.design, Pose.of(case.position, case.rotation)))
    rows = rows_of_modes(frame)
    assert len(rows) == 8
    assert all(np.isfinite(number(cell)) for row in rows for cell in row[2:5])


@pytest.mark.parametrize("x", [8.0, 9.0, 9.5, 10.0])
def test_modes_that_meet_on_the_border_of_the_box_keep_the_same_limits(x: float) -> None:
    # Two modes of a pose on the base plane differ in the sign of z alone, where 0 is allowed.
    frame = Frame(set_position(0, x).apply(set_position(2, 0.0).apply(open_state(OPTIMAL))))
    broken = [row[5] for row in rows_of_modes(frame)]
    assert broken[::2] == broken[1::2]
    assert broken[frame.state.mode] == "within"


def test_press_on_a_row_goes_to_its_mode_and_one_in_the_head_switches_the_ghosts(
    services: Services, desk: Desk
) -> None:
    modes.ModesPanel(services)
    desk.press(services.buttons, "modes.go", "6")
    assert desk.state.mode == 6
    desk.press(services.buttons, "modes.go", "8")
    assert desk.state.mode == 6
    for on in (True, False):
        desk.press(services.buttons, "modes.ghosts")
        assert desk.state.view.ghosts is on
    labels = [command.label for command in services.commands.all]
    assert "Pose › Assembly mode › 3: − + +" in labels
    assert len(labels) == len(modes.MODES) + 1


def test_pointer_on_a_row_shows_one_ghost_with_its_number_and_leaves_no_step(
    services: Services, desk: Desk
) -> None:
    ghosts = modes.Ghosts(services)
    before, steps = desk.state, desk.session.history

    def drawn() -> dict[str, dict[str, Any]]:
        return by_name(ghosts.updates(Placed(Frame(desk.state))))

    def visible() -> list[str]:
        return [name for name, values in drawn().items() if values.get("visible")]

    assert visible() == []
    desk.press(services.buttons, "modes.hover", "6")
    assert sorted(visible()) == ["/ghosts/legs", "/ghosts/name/0", "/ghosts/platform/0"]
    scene = drawn()
    assert scene["/ghosts/name/0"]["text"] == modes.MODES[6]
    there = set_mode(6).apply(before).pose
    points = Configuration(OPTIMAL, there.position, there.rotation).points
    placed = Placed(Frame(desk.state))
    expected = placed.scale * np.array([points.b1, points.b2, points.b3, points.b4])
    np.testing.assert_allclose(modes.ghost_points(placed, [6])[0], expected, atol=1e-9)
    # The present mode has no ghost, and none is left once the pointer has gone.
    for value in (str(before.mode), ""):
        desk.press(services.buttons, "modes.hover", value)
        assert visible() == []
    assert desk.state == before
    assert desk.session.history == steps


def test_pointer_is_on_a_mode_or_on_none_and_leaves_with_its_browser(
    services: Services, desk: Desk
) -> None:
    hovered = services.get(modes.mode_hover)
    for text, row in (("9", None), ("-1", None), ("x", None), ("2", 2)):
        desk.press(services.buttons, "modes.hover", text)
        assert hovered.row == row
    for client_id, expected in ((CLIENT.client_id + 1, 2), (CLIENT.client_id, None)):
        client: Any = SimpleNamespace(client_id=client_id)
        for forget in list(getattr(services.server, "_client_disconnect_cb")):  # noqa: B009
            forget(client)
        assert hovered.row == expected
