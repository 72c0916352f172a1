"""The verdict on a pose: the worse of margins and distances, on the page, on paper and in text."""

from __future__ import annotations

import math
import re
from dataclasses import replace

import numpy as np
import pytest
from hypothesis import given
from strategies import Case, all_cases

from explorer.app.features.singularity.actions import GoToSingularity, Jog
from explorer.app.features.singularity.panel import summary
from explorer.app.state.frame import Frame
from explorer.app.state.state import opened
from explorer.app.widgets.colours import SINGULAR, WARNED, proximity_colour
from explorer.measures.snapshot import evaluate
from explorer.measures.verdict import DISTANCE_SHARE, TITLES, verdict
from explorer.mechanism.design import Design
from explorer.mechanism.design_file import PRESETS
from explorer.mechanism.pose import Pose
from explorer.singularity.colours import WARN_SHARE, css
from explorer.singularity.uncoupled import UNCOUPLED

OPTIMAL = PRESETS["paper-optimal"]
ABOUT_PLATFORM_Z = next(
    index
    for index, motion in enumerate(UNCOUPLED)
    if (motion.frame, motion.kind, motion.axis) == ("platform", "rotation", "z")
)


def nearly_meeting_lines() -> Frame:
    """Return a frame 7 degrees, or 2.5 mm, from where the lines meet; every margin is long."""
    return Frame(Jog(ABOUT_PLATFORM_Z, 66.0).apply(opened(OPTIMAL)))


def test_verdict_seven_degrees_from_an_incidence_is_near() -> None:
    frame = nearly_meeting_lines()
    assert np.abs(frame.snapshot.margins).min() > frame.state.warn_below
    text = summary(frame)
    assert "Near a singularity" in text
    assert "Clear of singularities" not in text
    assert "2.52 mm from δ2 = 0, lines a1a2 and b2b3 meeting" in text


def test_summary_colours_the_incidence_that_the_verdict_names() -> None:
    frame = nearly_meeting_lines()
    colours = re.findall(r'class="ex-swatch" style="--colour:(#\w+)"', summary(frame))
    levels = frame.verdict.levels
    assert colours == [css(proximity_colour(level, 1.0)) for level in levels]
    assert [level < 1.0 for level in levels] == [False, True, False]


@pytest.mark.parametrize("design", PRESETS.values(), ids=lambda design: design.name)
def test_verdict_of_a_preset_at_home_is_clear(design: Design) -> None:
    assert Frame(opened(design)).verdict.kind == "clear"


@pytest.mark.parametrize("incidence", [1, 2, 3])
def test_verdict_at_the_nearest_singular_pose_is_singular(incidence: int) -> None:
    found = Frame(GoToSingularity(incidence).apply(opened(OPTIMAL))).verdict
    assert found.kind == "singular"
    assert found.incidences == (incidence,)
    assert found.levels[incidence - 1] == 0.0
    assert found.distance == 0.0


def test_verdict_of_poses_with_an_ill_conditioned_jacobian_is_never_clear() -> None:
    rng = np.random.default_rng(3)
    ill = 0
    for _ in range(400):
        # Around the singular poses, where the conditioning is low.
        place = rng.uniform([-15.0, -15.0, 0.2], [15.0, 15.0, 15.0])
        start = Pose.of_yaw_pitch_roll(place.tolist(), rng.uniform(-90.0, 90.0, 3).tolist())
        state = GoToSingularity(int(rng.integers(1, 4))).apply(opened(OPTIMAL, start))
        x, y, z = (np.array(state.pose.position) + rng.normal(scale=0.03, size=3)).tolist()
        snapshot = evaluate(OPTIMAL, Pose((x, y, z), state.pose.quaternion))
        if snapshot.inverse_condition < 5e-4:
            ill += 1
            assert verdict(snapshot, WARN_SHARE * OPTIMAL.reach).kind != "clear"
    assert ill > 50


@given(all_cases())
def test_verdict_is_the_worse_of_margins_and_distances(case: Case) -> None:
    design, pose = case.design, Pose.of(case.position, case.rotation)
    snapshot, warn = evaluate(design, pose), WARN_SHARE * design.reach
    found = verdict(snapshot, warn)
    for index, level in enumerate(found.levels):
        if level > 0.0:
            by_margin = abs(float(snapshot.margins[index])) / warn
            by_distance = snapshot.nearest[index].distance / (DISTANCE_SHARE * warn)
            assert level == pytest.approx(min(by_margin, by_distance))
    if found.kind != "singular":
        assert (found.kind == "near") == (min(found.levels) < 1.0)
    first = found.incidences[0] - 1
    if found.kind == "near":
        assert found.levels[first] == min(found.levels)
    if found.kind == "clear":
        assert found.distance == snapshot.nearest[first].distance
        assert found.distance == min(each.distance for each in snapshot.nearest)


def test_verdict_scales_with_the_warning_length() -> None:
    state = opened(OPTIMAL)
    wide = replace(state, view=replace(state.view, warn_below=30.0))
    assert Frame(state).verdict.title == TITLES["clear"]
    assert Frame(wide).verdict.title == TITLES["near"]
    ratio = 30.0 / state.warn_below
    for narrow, near in zip(Frame(state).verdict.levels, Frame(wide).verdict.levels, strict=True):
        assert math.isclose(narrow, near * ratio)


def test_warned_levels_are_orange() -> None:
    assert proximity_colour(0.0, 1.0) == SINGULAR
    assert proximity_colour(math.nextafter(1.0, 0.0), 1.0) == WARNED
