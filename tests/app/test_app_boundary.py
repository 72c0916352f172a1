"""A singular pose on the page lies on the boundary of modes; distances of deeper strata."""

from __future__ import annotations

import re

import pytest
from hypothesis import given
from services import services_for
from strategies import Case, all_cases

from explorer.app.features.mechanism.modes import modes_table
from explorer.app.features.singularity.actions import GoToSingularity, GoToStratum
from explorer.app.features.singularity.feed import StrataFeed
from explorer.app.features.singularity.panel import summary
from explorer.app.features.singularity.strata import distances_of, neighbours
from explorer.app.session.jobs import Worker
from explorer.app.state.actions import Set
from explorer.app.state.frame import Frame
from explorer.app.state.state import State, opened
from explorer.measures.snapshot import evaluate
from explorer.mechanism.design_file import PRESETS
from explorer.mechanism.margins import describe_modes
from explorer.mechanism.pose import Pose
from explorer.singularity.bruhat import COVERED, OF_INCIDENCES, incidences

OPTIMAL = PRESETS["paper-optimal"]


def at(incidence: int) -> State:
    return GoToSingularity(incidence).apply(opened(OPTIMAL))


@given(all_cases())
def test_modes_that_meet_in_a_pose_differ_in_the_signs_that_vanish(case: Case) -> None:
    snapshot = evaluate(case.design, Pose.of(case.position, case.rotation))
    vanishing = incidences(snapshot.stratum)
    modes = snapshot.bordering_modes
    assert len(modes) == 2 ** len(vanishing)
    assert snapshot.mode in modes
    differing = {bit for mode in modes for bit in (1, 2, 3) if (mode ^ modes[0]) & (4 >> (bit - 1))}
    assert differing == set(vanishing)
    assert [index for index, sign in enumerate(snapshot.sign_words.split(), 1) if sign == "0"] == [
        *vanishing
    ]


@pytest.mark.parametrize("incidence", [1, 2, 3])
def test_singular_pose_is_named_as_the_boundary_of_two_modes(incidence: int) -> None:
    frame = Frame(at(incidence))
    first, second = frame.snapshot.bordering_modes
    assert second - first == 4 >> (incidence - 1)
    text = re.sub("<[^>]*>", " ", summary(frame))
    assert f"Boundary of modes {first} and {second}" in text
    assert f"ode {frame.state.mode}" not in text


def test_deeper_pose_is_named_as_the_boundary_of_four_or_eight_modes() -> None:
    assert describe_modes((1, 3, 5, 7)) == "boundary of modes 1, 3, 5 and 7"
    coinciding = GoToStratum((1, 2, 3, 4)).apply(opened(OPTIMAL))
    assert "Boundary of all eight modes" in summary(Frame(coinciding))


def test_table_of_modes_marks_all_that_meet_in_a_singular_pose() -> None:
    for frame, marked, words in (
        (Frame(at(2)), ["1", "3"], "Boundary of modes 1 and 3 (− 0 +)"),
        (Frame(opened(OPTIMAL)), ["1"], "Mode 1 (− − +)"),
        (Frame(at(1)), ["1", "5"], "Boundary of modes 1 and 5 (0 − +)"),
    ):
        html = modes_table(frame, "")
        rows = re.findall(r'data-press="modes.go" data-value="(\d)"[^>]*aria-pressed="true"', html)
        assert rows == marked
        assert words in html


@given(all_cases())
def test_a_singular_pose_is_the_boundary_of_its_modes_in_all_words(case: Case) -> None:
    frame = Frame(opened(case.design, Pose.of(case.position, case.rotation)))
    snapshot = frame.snapshot
    modes = snapshot.bordering_modes
    expected = describe_modes(modes) if len(modes) > 1 else f"mode {snapshot.mode}"
    assert snapshot.mode_words == f"{expected} ({snapshot.sign_words})"
    for html in (summary(frame), modes_table(frame, "")):
        assert snapshot.mode_words.capitalize() in html


def test_distances_of_deeper_strata_arrive_at_a_singular_pose_without_the_diagram() -> None:
    frame = Frame(Set("view.singular.strata", value=False).apply(at(2)))
    worker = Worker(pytest.fail)
    feed = StrataFeed(services_for(worker=worker))
    try:
        feed.follow(frame)
        assert worker.wait_until_idle(60.0)
        distances = distances_of(frame, feed)
        assert set(COVERED[OF_INCIDENCES[1]]) <= set(distances)
        assert "…" not in neighbours(frame, distances)
        # Nothing is computed where nothing of it is shown.
        feed.follow(Frame(Set("view.singular.strata", value=False).apply(opened(OPTIMAL))))
        assert feed.request is None
    finally:
        worker.stop()
