"""A singular pose on the page lies on the boundary of modes; distances of deeper strata."""

from __future__ import annotations

import re
from collections.abc import Iterable

import pytest
import viser
from desk import Desk
from hypothesis import given
from services import services_for
from strategies import Case, all_cases

from explorer.app.features.mechanism.pose_panel import MODES, MovePanel, mode_options
from explorer.app.features.singularity.actions import GoToSingularity, GoToStratum
from explorer.app.features.singularity.feed import StrataFeed
from explorer.app.features.singularity.panel import summary
from explorer.app.features.singularity.strata import distances_of, neighbours
from explorer.app.session.jobs import Worker
from explorer.app.state.frame import Frame
from explorer.app.state.state import State, opened
from explorer.app.widgets.assigning import Update
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
    assert f"boundary of modes {first} and {second}" in text
    assert f"({frame.state.mode})" not in text


def test_deeper_pose_is_named_as_the_boundary_of_four_or_eight_modes() -> None:
    assert describe_modes((1, 3, 5, 7)) == "boundary of modes 1, 3, 5 and 7"
    coinciding = GoToStratum((1, 2, 3, 4)).apply(opened(OPTIMAL))
    assert "boundary of all eight modes" in summary(Frame(coinciding))


def test_list_of_modes_has_the_boundary_only_at_a_singular_pose(
    server: viser.ViserServer,
) -> None:
    desk = Desk(at(2))
    panel = MovePanel(services_for(server, desk.session))
    first = list(panel.updates(Frame(desk.state)))
    (shown,) = (
        handle
        for handle, name, value in first
        if name == "options" and value == mode_options(Frame(desk.state))
    )

    def show(updates: Iterable[Update]) -> None:
        for handle, name, value in updates:
            if handle is shown:
                setattr(handle, name, value)

    show(first)
    assert len(shown.options) == 9
    assert shown.value == "− 0 +:  boundary of modes 1 and 3"
    show(panel.updates(Frame(opened(OPTIMAL))))
    assert shown.options == MODES
    assert shown.value == MODES[1]
    show(panel.updates(Frame(at(1))))
    assert shown.value == "0 − +:  boundary of modes 1 and 5"
    # To choose the boundary itself changes nothing; to choose a mode leaves it.
    before = desk.state
    desk.use(shown, mode_options(Frame(before))[-1])
    assert desk.state.pose == before.pose
    desk.use(shown, MODES[0])
    assert desk.state.mode == 0
    desk.session.stop()


def test_distances_of_deeper_strata_arrive_at_a_singular_pose_without_the_diagram() -> None:
    frame = Frame(at(2))
    assert not frame.state.view.singular.strata
    worker = Worker(pytest.fail)
    feed = StrataFeed(services_for(worker=worker))
    try:
        feed.follow(frame)
        assert worker.wait_until_idle(60.0)
        distances = distances_of(frame, feed)
        assert set(COVERED[OF_INCIDENCES[1]]) <= set(distances)
        assert "…" not in neighbours(frame, distances)
        # Nothing is computed where nothing of it is shown.
        feed.follow(Frame(opened(OPTIMAL)))
        assert feed.request is None
    finally:
        worker.stop()
