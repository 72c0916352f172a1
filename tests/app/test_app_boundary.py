"""A singular pose on the page lies on the boundary of modes; distances of deeper strata."""

from __future__ import annotations

import re

import pytest
from hypothesis import given
from services import StubWorker, services_for
from strategies import Case, all_cases

from explorer.app.features.mechanism.modes import modes_table
from explorer.app.features.singularity.actions import GoToSingularity, GoToStratum
from explorer.app.features.singularity.feed import StrataFeed
from explorer.app.features.singularity.panel import summary
from explorer.app.features.singularity.strata import distances_of, neighbours
from explorer.app.state.actions import Set
from explorer.app.state.frame import Frame
from explorer.app.state.state import State, opened
from explorer.mechanism.design_file import PRESETS
from explorer.mechanism.margins import describe_modes
from explorer.mechanism.pose import Pose
from explorer.singularity.bruhat import COVERED, OF_INCIDENCES, incidences

OPTIMAL = PRESETS["paper-optimal"]


def at(incidence: int) -> State:
    return GoToSingularity(incidence).apply(opened(OPTIMAL))


@given(all_cases())
def test_modes_that_meet_in_a_pose_differ_in_the_signs_that_vanish(case: Case) -> None:
    frame = Frame(opened(case.design, Pose.of(case.position, case.rotation)))
    snapshot = frame.snapshot
    vanishing = incidences(snapshot.stratum)
    modes = snapshot.bordering_modes
    assert len(modes) == 2 ** len(vanishing)
    assert snapshot.mode in modes
    differing = {bit for mode in modes for bit in (1, 2, 3) if (mode ^ modes[0]) & (4 >> (bit - 1))}
    assert differing == set(vanishing)
    signs = snapshot.sign_words.split()
    assert [index for index, sign in enumerate(signs, 1) if sign == "0"] == [*vanishing]
    expected = describe_modes(modes) if len(modes) > 1 else f"mode {snapshot.mode}"
    assert snapshot.mode_words == f"{expected} ({snapshot.sign_words})"
    for html in (summary(frame), modes_table(frame, "")):
        assert snapshot.mode_words.capitalize() in html


@pytest.mark.parametrize("incidence", [1, 2, 3])
def test_singular_pose_is_named_as_the_boundary_of_two_modes(incidence: int) -> None:
    frame = Frame(at(incidence))
    first, second = frame.snapshot.bordering_modes
    assert second - first == 4 >> (incidence - 1)
    text = re.sub("<[^>]*>", " ", summary(frame))
    assert f"Boundary of modes {first} and {second}" in text
    assert f"ode {frame.state.mode}" not in text
    marks = r'data-press="modes.go" data-value="(\d)"[^>]*aria-pressed="true"'
    assert re.findall(marks, modes_table(frame, "")) == [str(first), str(second)]


def test_deeper_pose_is_named_as_the_boundary_of_four_or_eight_modes() -> None:
    assert describe_modes((1, 3, 5, 7)) == "boundary of modes 1, 3, 5 and 7"
    coinciding = GoToStratum((1, 2, 3, 4)).apply(opened(OPTIMAL))
    assert "Boundary of all eight modes" in summary(Frame(coinciding))


def test_distances_of_deeper_strata_are_shown_at_a_singular_pose_without_the_diagram() -> None:
    frame = Frame(Set("view.singular.strata", value=False).apply(at(2)))
    worker = StubWorker(at_once=True)
    feed = StrataFeed(services_for(worker=worker))
    feed.follow(frame)
    distances = distances_of(frame, feed)
    assert set(COVERED[OF_INCIDENCES[1]]) <= set(distances)
    assert "…" not in neighbours(frame, distances)
    # Nothing is computed where nothing of it is shown.
    feed.follow(Frame(Set("view.singular.strata", value=False).apply(opened(OPTIMAL))))
    assert feed.request is None
