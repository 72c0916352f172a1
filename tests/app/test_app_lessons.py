"""Lessons: what each step asks for, by mathematics of the test's own, and what stays of them."""

from __future__ import annotations

import contextlib
import math
import re
from base64 import b64decode
from collections.abc import Callable
from dataclasses import replace
from html import escape
from itertools import pairwise
from typing import NamedTuple
from xml.etree.ElementTree import fromstring

import numpy as np
import pytest
from hypothesis import given, settings, strategies as st
from scipy.spatial.transform import Rotation, Slerp
from tour_desk import BROWSER, ONE, OTHER, TourDesk

from explorer.app.features.help.guide import Card, card_words
from explorer.app.features.help.handout import handout_html, solve
from explorer.app.features.help.lessons import (
    TABS,
    TOUR,
    Course,
    Step,
    arrange,
    list_courses,
    parse_course,
)
from explorer.app.features.help.search import SearchDialog
from explorer.app.features.optimise.actions import start_run
from explorer.app.features.paths.actions import advance_journey, go, play
from explorer.app.features.paths.state import Paths, Stop, is_playing
from explorer.app.features.singularity.work import go_to_singularity
from explorer.app.server import Running
from explorer.app.session.session import UNDO
from explorer.app.state.actions import Action, Set, open_design
from explorer.app.state.frame import Frame
from explorer.app.state.moves import set_mode, set_pose, set_position
from explorer.app.state.parts import with_value
from explorer.app.state.state import State, open_state
from explorer.errors import InputError
from explorer.files.packaged import packaged_file
from explorer.mechanism.design import Design
from explorer.mechanism.design_file import PRESETS
from explorer.mechanism.pose import Pose
from explorer.numerics.arrays import FloatArray
from explorer.page.widgets.search import find

pytestmark = pytest.mark.usefixtures("warm_kernels")

COURSES = list_courses()
LESSONS = [course for course in COURSES.values() if course.is_lesson]
SINGULAR, NEAR, MODES = LESSONS
CASES = 200
"""Random states for each lesson."""


class Mechanism(NamedTuple):
    """A design in a pose, all lengths in mm: what the conditions are recomputed from."""

    position: FloatArray
    rotation: FloatArray
    reach: float
    ends: dict[str, FloatArray]
    tool: FloatArray

    def margins(self) -> FloatArray:
        """Return the signed margins."""
        return margins_of(self.position, self.rotation)

    def joints(self, turn: FloatArray, shift: FloatArray) -> FloatArray:
        """Return the joints after a small turn about b4 and a shift."""
        r, p = Rotation.from_rotvec(turn).as_matrix() @ self.rotation, self.position + shift
        b1, b2, b3 = (r @ self.ends[name] + p for name in ("b1", "b2", "b3"))
        lengths = [np.linalg.norm(b1), b2[0], math.hypot(*b2[1:]), b3[0], math.hypot(*b3[1:])]
        return np.array([*lengths, np.linalg.norm(p - self.ends["a3"])])

    def jacobian(self) -> FloatArray:
        """Return rates of joints by velocity and by angular velocity times the reach, (6, 6)."""
        step, none = 1e-6, np.zeros(3)
        shifts, turns = step * self.reach * np.eye(3), step * np.eye(3)
        moved = [self.joints(none, each) - self.joints(none, -each) for each in shifts]
        turned = [self.joints(each, none) - self.joints(-each, none) for each in turns]
        return np.array([*moved, *turned]).T / (2.0 * step * self.reach)


def margins_of(p: FloatArray, r: FloatArray) -> FloatArray:
    """Return the signed margins of positions (..., 3) and rotations (..., 3, 3)."""
    across = np.cross([1.0, 0.0, 0.0], r[..., 0])
    planes = np.stack([-r[..., 2], across, np.broadcast_to([0.0, 0.0, 1.0], p.shape)], axis=-2)
    return np.einsum("...ij,...j", planes, p)


def mechanism_of(state: State) -> Mechanism:
    """Return the mechanism of a state."""
    design, mm = state.design, state.design.unit_mm
    a3x, a3y, b1x, b1y, b2, b3 = design.variables
    ends = {"a3": (a3x, a3y), "b1": (b1x, b1y), "b2": (b2, 0.0), "b3": (b3, 0.0)}
    w, x, y, z = state.pose.quaternion
    return Mechanism(
        mm * np.array(state.pose.position),
        Rotation.from_quat([x, y, z, w]).as_matrix(),
        mm * math.hypot(a3x, a3y),
        {name: mm * np.array([*point, 0.0]) for name, point in ends.items()},
        mm * np.array(design.tool.position),
    )


def sizes(state: State) -> FloatArray:
    return np.abs(mechanism_of(state).margins())


def is_singular(state: State) -> bool:
    return bool(sizes(state).min() <= 1e-8 * mechanism_of(state).reach)


def amplification(state: State) -> float:
    least = np.linalg.svd(mechanism_of(state).jacobian(), compute_uv=False)[-1]
    return 1.0 / max(float(least), 1e-12)


def is_unheld(state: State) -> bool:
    """Whether the typed force and moment do work in a motion that no joint feels."""
    it, forces = mechanism_of(state), state.view.forces
    _, values, twists = np.linalg.svd(it.jacobian())
    force, moment = np.array(forces.force), 1e3 * np.array(forces.moment)
    moment = moment + np.cross(it.rotation @ it.tool, force)
    wrench = np.concatenate([it.reach * force, moment])
    work = np.abs(twists[values < 1e-5] @ wrench)
    return bool(np.any(work > 1e-6 * np.linalg.norm(wrench)))


def sign_changes(state: State) -> int:
    """Return how often a margin changes its sign at many points of the straight moves."""
    journey = Paths.of(state).journey
    if journey is None or journey.design != state.design:
        return -1
    # No point is in the middle, where the signs of two modes change.
    count, shares = 0, np.linspace(0.0, 1.0, 1996)
    for one, other in pairwise(journey.poses):
        ends = Rotation.from_quat([one.quaternion, other.quaternion], scalar_first=True)
        places = np.outer(1.0 - shares, one.position) + np.outer(shares, other.position)
        values = margins_of(places, Slerp([0.0, 1.0], ends)(shares).as_matrix())
        for margin in values.T:
            # A path may begin in a singular pose.
            signs = np.sign(margin[np.abs(margin) > 1e-7 * state.design.reach])
            count += int((np.diff(signs) != 0.0).sum())
    return count


def exceeds_warning(state: State) -> bool:
    mm, warned = state.design.unit_mm, state.view.warn_below
    least = mechanism_of(state).reach / 20.0 if warned is None else mm * warned
    return bool(sizes(state).min() >= least * (1.0 - 1e-9))


def flattest(index: int) -> Callable[[State], bool]:
    return lambda state: int(sizes(state).argmin()) == index


CONDITIONS: dict[str, Callable[[State], bool]] = {
    "Come close to a singular pose": lambda state: bool(
        sizes(state).min() < 0.01 * mechanism_of(state).reach
    ),
    "See what still moves": is_singular,
    "Find a load that nothing holds": is_unheld,
    "See what it costs to be near": lambda state: (
        not is_singular(state) and amplification(state) > 99.9
    ),
    "Go where it is safe": lambda state: exceeds_warning(state) and amplification(state) < 100.1,
    "The platform and a1": flattest(0),
    "The two lines": flattest(1),
    "The base and b4": flattest(2),
    "Two at once": lambda state: bool(
        sizes(state)[[0, 2]].max() < 0.01 * mechanism_of(state).reach
    ),
    "Eight poses of the same legs": lambda state: state.view.ghosts,
    "Go to mode 5": lambda state: (
        np.sign(mechanism_of(state).margins()).tolist() == [1.0, -1.0, 1.0]
    ),
    "The way to the next mode": lambda state: sign_changes(state) == 1,
    "Two signs": lambda state: sign_changes(state) > 1,
}
"""What the steps ask for, at least, by their titles, from the mechanism alone."""


def random_state(rng: np.random.Generator) -> State:
    """Return a design in a random pose, often near a singular one, with a random view."""
    design = list(PRESETS.values())[rng.integers(3)]
    size, mm = design.reach, design.unit_mm
    rotation = Rotation.random(random_state=rng).as_matrix()
    position = rng.uniform(-1.2, 1.2, 3) * size
    if rng.random() < 0.6:
        # Next to one of the planes, or two, of singular positions.
        across = np.cross([1.0, 0.0, 0.0], rotation[:, 0])
        planes = np.array([-rotation[:, 2], across, [0.0, 0.0, 1.0]])
        some = planes[rng.permutation(3)[: rng.integers(1, 3)]]
        aim = 10.0 ** rng.uniform(-2.0, 1.5, len(some)) / mm * (rng.random(len(some)) < 0.9)
        position += np.linalg.pinv(some) @ (aim - some @ position)
    state = open_state(design, Pose.of(position, rotation))
    if rng.random() < 0.2:
        state = set_mode(int(rng.integers(8))).apply(state)
    if rng.random() < 0.5:
        goal = int(rng.integers(8)) if rng.random() < 0.7 else design.home_pose
        # Two ends that are the same pose make no path.
        with contextlib.suppress(InputError):
            state = go().apply(with_value(state, "paths.stops", (Stop(), Stop(goal))))
    view = replace(
        state.view,
        ghosts=bool(rng.random() < 0.5),
        tetrahedra=tuple((rng.random(3) < 0.7).tolist()),
        coordinates=("position", "lengths", "folds")[rng.integers(3)],
        lengths=("mm", "design units")[rng.integers(2)],
        forces=replace(
            state.view.forces,
            force=tuple((rng.normal(size=3) * rng.integers(2)).tolist()),
            moment=tuple((rng.normal(size=3) * rng.integers(2)).tolist()),
        ),
    )
    return replace(state, view=view)


def is_done(course: Course, at: int, frame: Frame) -> bool:
    """Whether the card of a step is done in a frame, in which the step began."""
    card = Card(BROWSER, course, at, frame)
    card.turn(0, frame)
    assert card.is_waiting != card.is_done
    return card.is_done


@pytest.mark.parametrize("design", PRESETS.values(), ids=str)
@pytest.mark.parametrize("lesson", LESSONS, ids=lambda lesson: lesson.title)
def test_lesson_is_solved_step_by_step_and_no_step_by_the_one_before(
    lesson: Course, design: Design
) -> None:
    state = open_state(design)
    for at, (step, frame) in enumerate(solve(lesson, state)):
        begun = arrange("", step.first).apply(state)
        assert not is_done(lesson, at, Frame(begun)), step.title
        assert not CONDITIONS[step.title](begun), step.title
        state = frame.state
        assert is_done(lesson, at, frame), step.title
        assert CONDITIONS[step.title](state), step.title


@pytest.mark.parametrize("lesson", LESSONS, ids=lambda lesson: lesson.title)
def test_wrong_state_passes_no_step(lesson: Course) -> None:
    rng = np.random.default_rng(55)
    wrong, passed = np.zeros((2, len(lesson.steps)), dtype=int)
    for _ in range(CASES):
        frame = Frame(random_state(rng))
        for at, step in enumerate(lesson.steps):
            holds, is_passed = CONDITIONS[step.title](frame.state), is_done(lesson, at, frame)
            assert holds or not is_passed, step.title
            wrong[at] += not holds
            passed[at] += is_passed
    # Both kinds of states are among them.
    assert wrong.min() >= CASES // 5
    assert passed.sum() >= CASES // 5


SCALES = st.sampled_from((0.005, 1.0, 300.0))


@settings(max_examples=60)
@given(
    st.sampled_from([(lesson, step) for lesson in LESSONS for step in lesson.steps]),
    st.integers(0, 2**32 - 1),
    SCALES,
    st.sampled_from((None, 0.001, 1.0)),
)
def test_show_me_does_each_step_from_any_state_of_a_design_of_any_size(
    of: tuple[Course, Step], seed: int, scale: float, warned: float | None
) -> None:
    state, (_, step) = random_state(np.random.default_rng(seed)), of
    design = state.design.with_variables([scale * each for each in state.design.variables])
    position = np.multiply(state.pose.position, scale)
    state = open_state(design, Pose.of(position, state.pose.rotation))
    if warned is not None:
        # The largest is longer than any margin of the home pose.
        state = with_value(state, "view.warn_below", warned * state.design.reach)
    start = Frame(arrange("", step.first).apply(state))
    try:
        after = step.solve(start.state, start).apply(start.state)
    except InputError:
        assert step.title == "Go where it is safe"
        assert not CONDITIONS[step.title](open_state(design))
    else:
        assert step.is_done(Frame(after), start)
        assert CONDITIONS[step.title](after)


@pytest.mark.parametrize("index", [0, 1, 2])
@pytest.mark.parametrize("lesson", LESSONS, ids=lambda lesson: lesson.title)
def test_show_me_does_each_step_from_a_singular_pose(lesson: Course, index: int) -> None:
    state = go_to_singularity(index + 1).apply(open_state(PRESETS["paper-optimal"]))
    for at, step in enumerate(lesson.steps):
        desk = TourDesk()
        desk.do(set_pose(state.pose), ONE)
        desk.begin("Show me", file=lesson.file, at=at)
        assert CONDITIONS[step.title](desk.state), step.title
        assert desk.complaints == desk.told == []


@pytest.mark.parametrize("index", [0, 1, 2])
def test_amplification_in_a_singular_pose_is_told_as_infinite(index: int) -> None:
    frame = Frame(go_to_singularity(index + 1).apply(open_state(PRESETS["buildable"])))
    (step,) = (each for each in SINGULAR.steps if each.title == "See what it costs to be near")
    assert "Amplification: infinite; asked: above 100" in step.readings(frame, frame)


def test_step_that_a_design_cannot_do_is_told_with_what_is_lacking() -> None:
    # Base and platform are nearly lines, so that home has a large amplification.
    design = PRESETS["paper-optimal"].with_variables((7.0, 0.002, 3.0, 0.002, 2.0, 4.0))
    state = open_state(design)
    desk = TourDesk()
    expected = desk.do(open_design(design))
    desk.begin("Show me", file=SINGULAR.file, at=len(SINGULAR.steps) - 1)
    assert desk.state == expected
    assert ["cannot do the step" in each for each in desk.complaints] == [True]
    assert desk.complaints[0].endswith("; asked: below 100")
    assert "; asked: below 100. This design cannot do the step." in handout_html(SINGULAR, state)


DAMAGED = {
    "": (1, "# TITLE"),
    "# A\n\nText.": (1, "## TITLE"),
    "# A\n# B\n## C": (2, "## TITLE"),
    "Text.\n# A\n## B": (2, "# TITLE"),
    "# A\n## B\n- tab: Pose": (2, "lacks text and asked and shown"),
    "# A\n## B\n- tab: Poses": (3, "'Poses' is not among the tabs: Pose, Design"),
    "# A\n## B\nText.\n- asks: mode = 1": (4, "'asks' is not among the keys: text, tab"),
    "# A\n## B\n- asked: mode is 1": (3, "NAME < NUMBER"),
    "# A\n## B\n- asked: δ4 < 2": (3, "'δ4' is not among the values: platform, design"),
    "# A\n## B\n- asked: δ1 < 2": (3, "a length such as 1 % of the reach; got '2'"),
    "# A\n## B\n- asked: δ1 < 2 mm": (3, "a length such as 1 % of the reach; got '2 mm'"),
    "# A\n## B\n- asked: amplification > many": (3, "a number; got 'many'"),
    "# A\n## B\n- asked: mode = 8": (3, "'8' is not among the words of mode: 0, 1, 2"),
    "# A\n## B\n- asked: mode < 4": (3, "'<' is not among the signs of mode: =, ≠"),
    "# A\n## B\n- shown: δ1 < 2": (3, "'<' is not among the signs of δ1: ="),
    "# A\n## B\n- shown: amplification = 3": (
        3,
        "'amplification' is not among what can be set: platform",
    ),
    "# A\n## B\n- first: ghosts = yes": (3, "'yes' is not among the words of ghosts: on, off"),
}


@pytest.mark.parametrize("text", DAMAGED)
def test_damaged_lesson_is_refused_with_its_line_and_what_is_allowed(text: str) -> None:
    line, words = DAMAGED[text]
    with pytest.raises(InputError, match=re.escape(words)) as caught:
        parse_course("own.md", text)
    assert str(caught.value).startswith(f"lesson own.md, line {line}: ")


def test_cut_lesson_is_a_lesson_or_refused_in_words() -> None:
    text = packaged_file("lessons", SINGULAR.file).read_text("utf-8")
    for end in range(0, len(text), 7):
        with contextlib.suppress(InputError):
            assert parse_course("cut.md", text[:end]).steps


OF_USERS = st.one_of(
    st.builds(set_position, st.integers(0, 2), st.sampled_from((3.25, 4.5, 6.75))),
    st.builds(Set, st.sampled_from(("view.grid", "view.ghosts")), st.booleans()),
    st.builds(Set, st.just("view.forces.moment"), st.just((0.5, 0.25, 2.0))),
    st.builds(advance_journey, st.sampled_from((0.5, 2.0, 20.0))),
)
PRESSES = st.sampled_from(("Show me", "Show me", "Next", "Skip", "Skip", "Back"))
OF_MOVES = st.one_of(
    st.builds(set_position, st.integers(0, 2), st.sampled_from((3.25, 4.5, 6.75))),
    st.builds(Set, st.sampled_from(("view.grid", "view.ghosts")), st.booleans()),
)


@settings(max_examples=60)
@given(
    st.sampled_from(LESSONS),
    st.integers(0, 3),
    st.lists(PRESSES | OF_USERS, max_size=12),
    st.sampled_from(("Leave", "leave")),
)
def test_lesson_leaves_what_users_did_as_if_there_had_been_none(
    lesson: Course, at: int, events: list[str | Action], end: str
) -> None:
    desk = TourDesk()
    expected = first = desk.state
    desk.begin(file=lesson.file, at=at)
    for event in events:
        if isinstance(event, str):
            desk.tour(event)
            continue
        journey = Paths.of(desk.state).journey
        if journey is not None and event.apply(expected).pose != expected.pose:
            # Else it would take the platform back to the path.
            desk.do(play(on=False))
        # What is set to the value that it has already is no change.
        if desk.state != desk.do(event):
            expected = event.apply(expected)
    desk.leave() if end == "leave" else desk.tour("Leave")
    left = desk.state
    assert (left.design, left.view) == (expected.design, expected.view)
    assert Paths.of(left) == Paths.of(first)
    assert left.pose.position == pytest.approx(expected.pose.position, abs=1e-12)
    assert left.pose.quaternion == pytest.approx(expected.pose.quaternion, abs=1e-15)
    np.testing.assert_allclose(left.joints, expected.joints, rtol=1e-12)
    assert left.mode == expected.mode


@settings(max_examples=60)
@given(
    st.lists(
        st.sampled_from([(lesson, at) for lesson in LESSONS for at in range(len(lesson.steps))]),
        min_size=2,
        max_size=2,
    ),
    st.lists(st.sampled_from((ONE, OTHER)) | OF_MOVES, max_size=8),
    st.permutations((ONE, OTHER)),
)
def test_lessons_of_two_browsers_leave_what_was_done_by_hand(
    steps: list[tuple[Course, int]], events: list[int | Action], order: list[int]
) -> None:
    desk, started = TourDesk(), set[int]()
    expected = desk.state
    for event in events:
        if isinstance(event, int):
            if event not in started:
                lesson, at = steps[event - ONE]
                desk.begin(file=lesson.file, at=at, who=event)
            started.add(event)
            desk.tour("Show me", event)
        # What is set to the value that it has already is no change.
        elif desk.state != desk.do(event):
            expected = event.apply(expected)
    for who in order:
        desk.tour("Leave", who)
    assert desk.state.view == expected.view
    assert desk.state.pose.position == pytest.approx(expected.pose.position, abs=1e-12)
    assert desk.state.pose.quaternion == pytest.approx(expected.pose.quaternion, abs=1e-15)


def test_lesson_leaves_the_mode_that_was_undone_and_chosen_by_hand() -> None:
    desk = TourDesk()
    desk.begin("Show me", file=MODES.file, at=1)
    desk.session.do(UNDO, who=ONE)
    expected = desk.do(set_mode(5), ONE)
    desk.tour("Leave")
    assert (desk.state.pose, desk.state.mode) == (expected.pose, 5)


@pytest.mark.parametrize("lesson", LESSONS, ids=lambda lesson: lesson.title)
def test_lesson_leaves_a_path_that_the_user_plays_as_it_is(lesson: Course) -> None:
    desk = TourDesk()
    desk.do(Set("paths.stops", (Stop(), Stop(4))), ONE)
    desk.do(go(), ONE)
    desk.begin("Show me", file=lesson.file)
    desk.do(advance_journey(1.0), ONE)
    before = Paths.of(desk.state)
    desk.tour("Leave")
    assert Paths.of(desk.state) == before
    assert is_playing(desk.state)


def test_lesson_takes_back_a_path_of_its_own_that_was_cleared_half_way() -> None:
    desk = TourDesk()
    first = desk.state
    desk.begin("Show me", file=MODES.file, at=2)
    desk.do(advance_journey(4.0), ONE)
    desk.do(Set("paths", Paths()), ONE)
    assert desk.state.pose != first.pose
    desk.tour("Leave")
    assert desk.state.pose == first.pose


def test_lesson_during_a_search_begins_and_is_taken_back_after_it() -> None:
    desk = TourDesk()
    first = desk.do(start_run())
    desk.begin("Show me", file=MODES.file)
    assert desk.state.view.ghosts
    desk.tour("Leave")
    desk.end_search(with_result=False)
    assert desk.state.view == first.view
    assert desk.complaints == []


def test_next_in_a_wrong_state_does_nothing_and_skip_goes_on() -> None:
    desk = TourDesk()
    desk.begin("Next", "Next", file=MODES.file)
    assert desk.card.at == 0
    desk.tour("Skip")
    assert desk.card.at == 1
    desk.do(set_mode(5), ONE)
    assert desk.card.is_done
    assert "Mode: 5; asked: 5" in card_words(desk.card, Frame(desk.state))
    # What was done stays done only as long as it is so.
    desk.do(set_mode(4), ONE)
    assert not desk.card.is_done
    desk.tour("Skip")
    desk.tour("Skip")
    # Nor does a press that comes late end the lesson.
    desk.tour("Next")
    assert desk.card.is_last


@pytest.mark.parametrize("lesson", LESSONS, ids=lambda lesson: lesson.title)
def test_lengths_of_a_step_have_one_unit_in_words_and_reading(lesson: Course) -> None:
    frame = Frame(with_value(open_state(PRESETS["paper-optimal"]), "view.lengths", "design units"))
    for step in lesson.steps:
        for reading in step.readings(frame, frame):
            asked = reading.partition("; asked: ")[2]
            assert "reach" not in reading or f"{asked} of the reach" in step.text
            assert not re.search(r"\d (mm|units)", reading + step.text)


@pytest.mark.parametrize("lesson", LESSONS, ids=lambda lesson: lesson.title)
@pytest.mark.parametrize("design", PRESETS.values(), ids=str)
def test_handout_has_each_step_with_a_picture_of_its_solution(
    lesson: Course, design: Design
) -> None:
    html = handout_html(lesson, open_state(design))
    assert re.findall(r"<h2>\d  (.*?)</h2>", html) == [escape(s.title) for s in lesson.steps]
    pictures = re.findall(r'src="data:image/svg\+xml;base64,([^"]+)"', html)
    assert len(pictures) == len(lesson.steps)
    for (step, frame), picture in zip(solve(lesson, open_state(design)), pictures, strict=True):
        drawn = fromstring(b64decode(picture))
        assert {"a1", "b4"} <= {each.text for each in drawn.iter() if each.text}
        for reading in step.readings(frame, frame):
            assert escape(reading, quote=False) in html
    # It fetches nothing.
    assert not re.search(r'(?:src|href)="(?!data:)', html)


def test_lessons_and_steps_are_found_by_the_search_and_tabs_are_those_of_the_page(
    running: Running,
) -> None:
    services = running.page.services
    entries = list(services.get(SearchDialog).entries)
    for lesson in LESSONS:
        for query in (lesson.title, *(step.title for step in lesson.steps)):
            labels = [each.label for each in find(query, entries)[:4]]
            assert any(label.startswith("Lessons › ") and query in label for label in labels)
        assert f"Lessons › {lesson.title} › Handout" in [each.label for each in entries]
    tabs = {tab.title for one in services.features for tab in one.tabs if tab.place != "dialog"}
    assert {*TABS} == tabs
    assert TOUR in COURSES
