"""The verdict on a pose is the worst of its measures; a singular pose is the boundary of modes."""

from __future__ import annotations

import math
import re
from dataclasses import replace
from typing import Literal

import numpy as np
import pytest
from hypothesis import given
from services import StubJobs, services_for
from strategies import Case, all_cases

from explorer.app.features.mechanism.modes import modes_table, present_mode
from explorer.app.features.singularity.feature import (
    distance_table,
    distances_of,
    neighbours,
    summary,
)
from explorer.app.features.singularity.work import STRATA_FEED, go_to_singularity
from explorer.app.state.actions import Set
from explorer.app.state.frame import Frame
from explorer.app.state.state import open_state
from explorer.measures.position_bands import position_bands
from explorer.measures.snapshot import evaluate
from explorer.measures.verdict import DISTANCE_SHARE, TITLES, verdict, warnings
from explorer.mechanism.design import Design
from explorer.mechanism.design_file import PRESETS
from explorer.mechanism.kinematics import jacobian_factors
from explorer.mechanism.margins import describe_modes
from explorer.mechanism.pose import Pose, rotation_from_yaw_pitch_roll
from explorer.mechanism.rgb import css
from explorer.numerics.number_text import Unit
from explorer.singularity.colours import SINGULAR, WARN_SHARE, WARNED, proximity_colour
from explorer.singularity.strata import COVERED, OF_INCIDENCES, incidences
from explorer.workspace.workspace import Workspace

OPTIMAL = PRESETS["paper-optimal"]


def test_verdict_seven_degrees_from_an_incidence_is_near_and_so_is_its_margin() -> None:
    # Where the lines nearly meet every margin is long.
    home = OPTIMAL.home_pose
    turn = rotation_from_yaw_pitch_roll((66.0, 0.0, 0.0))
    frame = Frame(open_state(OPTIMAL, Pose.of(home.position, home.rotation @ turn)))
    assert np.abs(frame.snapshot.margins).min() > frame.state.warn_below
    text = summary(frame)
    assert "Near a singularity" in text
    words = "to the nearest singular pose, lines a1a2 and b2b3 meeting (δ2 = 0)"
    assert f"2.52 mm of motion {words}" in text
    colours = re.findall(r'class="ex-swatch" style="--colour:(#\w+)"', distance_table(frame))
    levels = frame.verdict.levels
    assert colours == [css(proximity_colour(level)) for level in levels]
    assert [level < 1.0 for level in levels] == [False, True, False]
    assert proximity_colour(0.0) == SINGULAR
    assert proximity_colour(math.nextafter(1.0, 0.0)) == WARNED


@pytest.mark.parametrize("incidence", [1, 2, 3])
def test_nearest_singular_pose_is_the_boundary_of_two_modes(incidence: int) -> None:
    frame = Frame(go_to_singularity(incidence).apply(open_state(OPTIMAL)))
    found = frame.verdict
    assert (found.kind, found.incidences, found.distance) == ("singular", (incidence,), 0.0)
    assert found.levels[incidence - 1] == 0.0
    assert found.brief(Unit("mm", 10.0)) == f"Singular: δ{incidence} = 0"
    first, second = frame.snapshot.bordering_modes
    assert second - first == 4 >> (incidence - 1)
    text = re.sub("<[^>]*>", " ", present_mode(frame))
    assert f"Boundary of modes {first} and {second}" in text
    assert f"ode {frame.state.mode}" not in text
    marks = r'data-press="modes.go" data-value="(\d)"[^>]*aria-pressed="true"'
    assert re.findall(marks, modes_table(frame, "")) == [str(first), str(second)]


@given(all_cases())
def test_verdict_is_the_worst_of_margins_distances_turns_and_conditioning(case: Case) -> None:
    design, pose = case.design, Pose.of(case.position, case.rotation)
    snapshot = evaluate(design, pose)
    found, warn = verdict(snapshot), warnings(design.reach)
    worst = int(jacobian_factors(design, snapshot.joints, snapshot.margins).argmin())
    for index, level in enumerate(found.levels):
        if level > 0.0:
            measures = [
                abs(float(snapshot.margins[index])) / warn.margin,
                snapshot.nearest[index].distance / warn.distance,
                snapshot.least_turns[index] / warn.turn,
            ]
            if index == worst:
                measures.append(float(snapshot.inverse_condition) / warn.condition)
            assert level == pytest.approx(min(measures))
    if found.kind != "singular":
        assert (found.kind == "near") == (min(found.levels) < 1.0)
    first = found.incidences[0] - 1
    if found.kind == "near" and found.cause == "distance":
        sizes = np.abs(snapshot.margins)
        assert found.distance == min(
            each.distance
            for size, each in zip(sizes, snapshot.nearest, strict=True)
            if size < warn.margin or each.distance < warn.distance
        )
    if found.kind == "clear":
        assert found.distance == snapshot.nearest[first].distance
        assert found.distance == min(each.distance for each in snapshot.nearest)
        assert found.distance >= warn.distance
        assert snapshot.inverse_condition >= warn.condition


@pytest.mark.parametrize("measure", ["margin", "condition"])
@pytest.mark.parametrize("share", [None, 0.02, 0.11])
def test_verdict_where_the_map_warns_is_never_clear(
    measure: Literal["margin", "condition"], share: float | None
) -> None:
    for design in PRESETS.values():
        rng, reach, place = np.random.default_rng(7), design.reach, design.home_pose
        warn_below = WARN_SHARE * reach if share is None else share * reach
        bands = position_bands(Workspace(design, place.rotation), measure, warn_below=warn_below)
        points = rng.uniform([-reach, -reach, 0.0], reach, (500, 3))
        warned = points[bands.values(points) < 1.0][:30]
        assert len(warned) > 5
        for x, y, z in warned.tolist():
            snapshot = evaluate(design, Pose((x, y, z), place.quaternion))
            assert verdict(snapshot, None if share is None else warn_below).kind != "clear"


def random_pose(design: Design, rng: np.random.Generator) -> Pose:
    reach = design.reach
    place = rng.uniform([-reach, -reach, 0.0], [reach, reach, reach])
    return Pose.of_yaw_pitch_roll(place.tolist(), rng.uniform(-90.0, 90.0, 3).tolist())


def test_verdict_on_a_nearly_degenerate_design_names_the_conditioning_and_its_margin() -> None:
    design = OPTIMAL.with_variable("b3", OPTIMAL.b2 + 0.02)
    pose = open_state(OPTIMAL).pose
    snapshot = evaluate(design, pose)
    found = verdict(snapshot)
    assert snapshot.inverse_condition < 1e-3
    assert found.kind == "near"
    assert found.cause == "condition"
    # The line b2b3 has hardly a length.
    assert found.incidences[0] == 2
    assert re.match(
        r"1/cond J is \S+, most by δ2; δ2 = 0 is \S+ mm of motion away",
        found.reason(Unit("mm", 10.0)),
    )
    assert found.brief(Unit("mm", 10.0)).startswith("1/cond J ")


def test_verdict_names_a_measure_that_is_below_its_warning_value() -> None:
    # Of a platform as large as the base, which a small turn displaces much.
    design = OPTIMAL.with_variables([19.0, 7.0, 14.0, -13.0, 12.0, 18.0])
    rng, warn, causes = np.random.default_rng(0), warnings(design.reach), set[str]()
    for _ in range(400):
        snapshot = evaluate(design, random_pose(design, rng))
        found = verdict(snapshot)
        if found.kind == "near":
            causes.add(found.cause)
            margin = abs(snapshot.margins[found.incidences[0] - 1])
            assert {
                "distance": min(found.distance, margin * DISTANCE_SHARE) < warn.distance,
                "turn": found.turn < warn.turn,
                "condition": found.condition < warn.condition,
            }[found.cause]
    assert causes == {"distance", "turn", "condition"}


def test_verdict_scales_with_the_warning_length() -> None:
    state = open_state(OPTIMAL)
    wide = replace(state, view=replace(state.view, warn_below=30.0))
    assert Frame(state).verdict.title == TITLES["clear"]
    assert Frame(wide).verdict.title == TITLES["near"]
    ratio = 30.0 / state.warn_below
    for narrow, near in zip(Frame(state).verdict.levels, Frame(wide).verdict.levels, strict=True):
        assert math.isclose(narrow, near * ratio)


@given(all_cases())
def test_modes_that_meet_in_a_pose_differ_in_the_signs_that_vanish(case: Case) -> None:
    frame = Frame(open_state(case.design, Pose.of(case.position, case.rotation)))
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
    assert snapshot.mode_words.capitalize() in present_mode(frame)


def test_distances_of_deeper_strata_are_shown_at_a_singular_pose_without_the_diagram() -> None:
    singular = go_to_singularity(2).apply(open_state(OPTIMAL))
    frame = Frame(Set("view.singular.strata", value=False).apply(singular))
    jobs = StubJobs(at_once=True)
    feed = STRATA_FEED(services_for(jobs=jobs))
    feed.follow(frame)
    distances = distances_of(frame, feed)
    assert set(COVERED[OF_INCIDENCES[1]]) <= set(distances)
    assert "…" not in neighbours(frame, distances)
    # Nothing is computed where nothing of it is shown.
    feed.follow(Frame(Set("view.singular.strata", value=False).apply(open_state(OPTIMAL))))
    assert feed.request is None
