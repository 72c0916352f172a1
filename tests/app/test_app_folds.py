"""The folds on the page: their sliders, dials, and the layer of the leaves; no browser."""

from __future__ import annotations

import itertools
import math
import re
from dataclasses import replace
from typing import Any

import numpy as np
import pytest
import viser
from desk import Desk, by_name, number, random_states, viewed
from hypothesis import given, strategies as st
from numpy.testing import assert_allclose

from explorer.app.features.feature import Services
from explorer.app.features.mechanism.feature import JOINT_HINTS, MovePanel
from explorer.app.features.mechanism.folds import (
    RADIUS,
    Leaves,
    colour_stops,
    fold_arcs,
    fold_span,
    leaf_corners,
)
from explorer.app.features.singularity.feature import fold_dial
from explorer.app.scene.placing import Placed
from explorer.app.session.history import start_history
from explorer.app.session.session import UNDO
from explorer.app.state.actions import Set, open_design
from explorer.app.state.frame import Frame
from explorer.app.state.moves import folds_of, set_fold, set_mode, set_pose
from explorer.app.state.state import State, open_state
from explorer.app.storage.session_file import decode_session, encode_session
from explorer.errors import InputError
from explorer.mechanism.design_file import PRESETS
from explorer.mechanism.folds import FOLDS, to_folds
from explorer.mechanism.margins import margins, mode_of, signs_of
from explorer.mechanism.rgb import Rgb
from explorer.numerics.arrays import FloatArray
from explorer.singularity.colours import SINGULAR, proximity_colour

OPTIMAL = PRESETS["paper-optimal"]
HOME = open_state(OPTIMAL)
R = FOLDS.index("r")
STATES = [set_mode(mode).apply(state) for state in random_states(3) for mode in range(8)]
# Indices of the margins that each coordinate changes.
CHANGED = ((0, 1, 2), (1, 2), (0, 1), (0,), (1,), (2,))


def margins_of(state: State) -> FloatArray:
    return margins(state.pose.position, state.pose.rotation)


def walls(state: State, index: int) -> tuple[float, float]:
    span = fold_span(state, index)
    return span.low, span.high


# Setting one


@pytest.mark.parametrize("index", range(6))
@pytest.mark.parametrize("state", STATES)
def test_coordinate_is_set_alone_and_changes_its_margins_alone(state: State, index: int) -> None:
    before, margins_before = folds_of(state), margins_of(state)
    low, high = walls(state, index)
    for share in (0.7, 0.01, 0.4):
        value = low + share * (high - low)
        state = set_fold(index, value).apply(state)
        after = folds_of(state)
        assert after[index] == value
        assert after[:index] == before[:index]
        assert after[index + 1 :] == before[index + 1 :]
        r, *angles = to_folds(state.pose.position, state.pose.rotation).tolist()
        assert_allclose((r, *np.degrees(angles)), after, atol=1e-9)
    kept = [margin for margin in range(3) if margin not in CHANGED[index]]
    change = np.abs(margins_of(state) - margins_before)
    assert_allclose(change[kept], 0.0, atol=1e-12)
    assert (change[list(CHANGED[index])] > 1e-3).all()
    assert state.mode == int(mode_of(margins_of(state)))


@pytest.mark.parametrize("index", range(6))
@pytest.mark.parametrize("state", STATES[:8])
def test_wall_is_reached_in_the_same_mode_and_left_with_all_others_as_they_were(
    state: State, index: int
) -> None:
    before = folds_of(state)
    # The upper end of r is no wall.
    for wall in walls(state, index)[: 1 if index == R else 2]:
        flat = set_fold(index, wall).apply(state)
        assert flat.mode == state.mode
        assert folds_of(flat)[index] == wall
        assert Frame(flat).verdict.kind == "singular"
        # The ends of all sliders stay.
        assert [walls(flat, each) for each in range(6)] == [walls(state, i) for i in range(6)]
        again = set_fold(index, before[index]).apply(flat)
        assert folds_of(again) == before
        assert_allclose(again.joints, state.joints, atol=1e-12)


@pytest.mark.parametrize("index", range(3, 6))
@pytest.mark.parametrize("wall", [0.0, 180.0])
def test_flat_fold_belongs_to_both_modes(index: int, wall: float) -> None:
    bit = 4 >> (index - 3)
    start = set_mode(bit).apply(HOME)
    flat = set_fold(index, wall).apply(start)
    other = set_mode(flat.mode & ~bit).apply(flat)
    assert folds_of(flat)[index] == wall
    assert folds_of(other)[index] == pytest.approx(-wall, abs=1e-5)
    assert walls(other, index) == (-180.0, 0.0)


def test_fold_of_the_other_sign_goes_to_the_other_mode() -> None:
    for index, mode in itertools.product(range(3, 6), range(8)):
        state = set_mode(mode).apply(HOME)
        after = set_fold(index, -folds_of(state)[index]).apply(state)
        assert after.mode == mode ^ (4 >> (index - 3)) == int(mode_of(margins_of(after)))
        # It is the mirror image that the same legs allow.
        there = set_mode(after.mode).apply(state)
        assert_allclose(after.pose.position, there.pose.position, atol=1e-9)


@pytest.mark.parametrize(
    ("index", "value"),
    [(0, -1.0), (0, math.inf), (1, -0.1), (2, 180.1), (3, 181.0), (5, -200.0), (4, math.nan)],
)
def test_coordinate_beyond_its_range_is_refused(index: int, value: float) -> None:
    range_of = "negative" if index == 0 else " (0|−180)° to 180°; got"
    if value == math.inf:
        range_of = "finite"
    with pytest.raises(InputError, match=f"{FOLDS[index]}.*{range_of}"):
        set_fold(index, value).apply(HOME)


@given(st.integers(0, 5), st.floats(0.0, 1.0), st.integers(0, 7))
def test_folds_that_were_set_count_for_their_pose_alone(
    index: int, share: float, mode: int
) -> None:
    state = set_mode(mode).apply(HOME)
    low, high = walls(state, index)
    state = set_fold(index, low + share * (high - low)).apply(state)
    moved = set_pose(HOME.pose).apply(state)
    assert_allclose(folds_of(moved), folds_of(HOME), atol=1e-9)
    # What the pose tells alone gives the same margins.
    told = folds_of(replace(state, set_folds=None))
    assert_allclose(margins_of(state), _margins(told), atol=1e-9)


def _margins(folds: tuple[float, ...]) -> list[float]:
    r, *degrees = folds
    beta, epsilon, phi1, phi2, phi3 = np.sin(np.radians(degrees))
    return [r * epsilon * phi1, r * beta * epsilon * phi2, r * beta * phi3]


# The sliders


def sliders_of(panel: MovePanel, desk: Desk) -> dict[str, Any]:
    """Return the visible sliders by their labels, after a panel has shown the state."""
    found: dict[str, Any] = {}
    for handle, name, value in panel.updates(Frame(desk.state)):
        setattr(handle, name, value)
        if isinstance(handle, viser.GuiSliderHandle):
            found[handle.label] = handle
    return {label: handle for label, handle in found.items() if handle.visible}


def test_choice_shows_six_sliders_in_place_of_six_and_is_kept(
    services: Services, desk: Desk
) -> None:
    panel = MovePanel(services)
    by_position = list(sliders_of(panel, desk))
    assert by_position == ["x", "y", "z", "yaw (°)", "pitch (°)", "roll (°)"]
    before = desk.state
    desk.press(services.buttons, "view.coordinates", "folds")
    after = desk.state
    assert after.view.coordinates == "folds"
    assert replace(after, view=before.view) == before
    # Like all that is shown it is no step of its own.
    assert desk.session.history.at == 0
    assert list(sliders_of(panel, desk)) == [
        "r",
        "β (°)",
        "ε (°)",
        "φ1 (°)",
        "φ2 (°)",
        "φ3 (°)",
    ]
    desk.press(services.buttons, "view.coordinates", "lengths")
    assert list(sliders_of(panel, desk)) == list(JOINT_HINTS)
    # It stays with the next design, and in the file of the session.
    assert open_design(PRESETS["paper-initial"]).apply(after).view.coordinates == "folds"
    saved = decode_session(encode_session(start_history(after)), "test")
    assert saved.step.state.view.coordinates == "folds"
    desk.press(services.buttons, "view.coordinates", "position")
    assert list(sliders_of(panel, desk)) == by_position


def test_slider_sets_a_fold_within_the_walls_of_the_mode_and_is_undone(
    services: Services, desk: Desk
) -> None:
    panel = MovePanel(services)
    desk.session.do(Set("view.coordinates", "folds"))
    for mode in range(8):
        desk.session.do(set_mode(mode))
        sliders = sliders_of(panel, desk)
        for index, sign in enumerate(signs_of(mode), start=1):
            slider = sliders[f"φ{index} (°)"]
            assert (slider.min, slider.max) == ((0.0, 180.0) if sign > 0 else (-180.0, 0.0))
        for name in "βε":
            assert (sliders[f"{name} (°)"].min, sliders[f"{name} (°)"].max) == (0.0, 180.0)
        assert sliders["r"].min == 0.0
    desk.session.do(set_mode(1))
    before = desk.state
    slider = sliders_of(panel, desk)["φ2 (°)"]
    desk.use(slider, -45.0)
    assert folds_of(desk.state)[4] == -45.0
    assert desk.session.history.step.words == "φ2 = −45°"
    desk.session.do(UNDO)
    assert replace(desk.state, gesture=None) == replace(before, gesture=None)
    # A number that is typed may lie beyond the wall; the slider's ends are those of its mode.
    desk.use(sliders_of(panel, desk)["φ2 (°)"], 45.0)
    assert desk.state.mode == 3
    slider = sliders_of(panel, desk)["φ2 (°)"]
    assert (slider.min, slider.max, slider.value) == (0.0, 180.0, 45.0)
    desk.use(sliders_of(panel, desk)["r"], 12.0)
    assert folds_of(desk.state)[0] == 12.0
    assert desk.session.history.step.words == "r = 12 units"


def stops_of(state: State, index: int) -> list[tuple[Rgb, float]]:
    """Return colours and shares of the stops of a track."""
    text = colour_stops(Frame(state), index, fold_span(state, index).high)
    found = re.findall(r"#(..)(..)(..) ([\d.]+)%", text)
    return [((int(r, 16), int(g, 16), int(b, 16)), float(at) / 100.0) for r, g, b, at in found]


@pytest.mark.parametrize("index", range(6))
@pytest.mark.parametrize("state", STATES[::5])
def test_stops_of_a_track_have_the_colours_of_the_margins_there(state: State, index: int) -> None:
    stops = stops_of(state, index)
    low, high = walls(state, index)
    shares = [share for _, share in stops]
    assert shares == sorted(shares)
    assert stops[0] == (SINGULAR, 0.0)
    assert shares[-1] == 1.0
    assert (stops[-1][0] == SINGULAR) == (index != R)
    for share in {share for _, share in stops}:
        there = set_fold(index, low + share * (high - low)).apply(state)
        level = np.abs(margins_of(there))[list(CHANGED[index])].min() / state.warn_below
        # Where the colour jumps there are two stops, one of which may be that of the other side.
        assert (
            min(
                max(abs(a - b) for a, b in zip(colour, proximity_colour(each), strict=True))
                for colour, at in stops
                if at == share
                for each in (0.99 * level, 1.01 * level)
            )
            <= 6
        )


# The dials


@pytest.mark.parametrize("state", STATES[:8])
def test_dial_points_at_the_fold_in_the_half_of_its_sign(state: State) -> None:
    for index, sign in enumerate(signs_of(state.mode)):
        fold = folds_of(state)[3 + index]
        html = fold_dial(Frame(state), index)
        needle = re.findall(r'd="M0 0L([-\d.]+) ([-\d.]+)"', html)[0]
        x, y = map(float, needle)
        assert math.degrees(math.atan2(-y, x)) == pytest.approx(fold, abs=0.1)
        _, top, _, height = map(float, re.findall(r'viewBox="([^"]*)"', html)[0].split())
        assert top < y < top + height
        assert (top < -10.0) == (sign > 0)
        text = html.removesuffix("°</span>").rpartition(">")[2]
        assert number(text) == pytest.approx(fold, abs=0.06)


# The leaves


def angle_between(a: FloatArray, b: FloatArray, about: FloatArray) -> float:
    """Return the angle in degrees that turns one direction into another about an axis."""
    return math.degrees(math.atan2(float(np.cross(a, b) @ about), float(a @ b)))


@pytest.mark.parametrize("state", STATES)
def test_arcs_span_the_folds_between_base_leaves_and_platform(state: State) -> None:
    placed = Placed(Frame(state))
    hinges, arcs = fold_arcs(placed)
    points, rotation = placed.points, state.pose.rotation
    a1, b4, line = points["a1"], points["b4"], rotation[:, 0]
    along = b4 / np.linalg.norm(b4)
    starts, ends = arcs[:, 0] - hinges[:, 0], arcs[:, -1] - hinges[:, 0]
    radii = np.linalg.norm(arcs - hinges, axis=2)
    assert_allclose(radii, RADIUS * placed.reach, rtol=1e-9)
    # Each fold turns about its hinge, that at the guide forwards and the other two backwards.
    axes = (-line, -along, np.array([1.0, 0.0, 0.0]))
    for index, axis in enumerate(axes):
        assert_allclose((arcs[index] - hinges[index]) @ axis, 0.0, atol=1e-9)
        fold = angle_between(starts[index], ends[index], axis)
        assert fold == pytest.approx(folds_of(state)[3 + index], abs=1e-6)
        halfway = angle_between(starts[index], arcs[index, 12] - hinges[index, 0], axis)
        assert 2.0 * halfway == pytest.approx(fold, abs=1e-6)
    # φ1 from the leaf's own side, where a1 is, to the platform's y; φ2 from beyond the line a1b4,
    # as seen from the guide, to the side to which the platform's line goes; φ3 from y to b4.
    assert_allclose(ends[0] / radii[0, 0], rotation[:, 1], atol=1e-9)
    assert starts[0] @ np.cross(line, along) == pytest.approx(0.0, abs=1e-9)
    assert starts[0] @ (a1 - b4) > 0.0
    assert starts[1] @ np.array([1.0, 0.0, 0.0]) < 0.0
    assert starts[1] @ np.cross(along, [1.0, 0.0, 0.0]) == pytest.approx(0.0, abs=1e-9)
    assert ends[1] @ line > 0.0
    assert ends[1] @ np.cross(along, line) == pytest.approx(0.0, abs=1e-9)
    assert_allclose(starts[2] / radii[2, 0], [0.0, 1.0, 0.0], atol=1e-9)
    assert ends[2] @ b4 > 0.0


def test_leaves_hold_the_hinges_and_are_off_at_first(services: Services) -> None:
    layer = Leaves(services)
    for state in STATES[::3]:
        drawn = by_name(layer.updates(Placed(Frame(state))))
        assert not any(each["visible"] for each in drawn.values())
        placed = Placed(Frame(viewed(state, leaves=True)))
        first, second = leaf_corners(placed)
        assert_allclose(first, [placed.points[name] for name in ("a1", "a2", "b4")])
        normal = np.cross(second[1] - second[0], second[2] - second[0])
        for name in ("a1", "b2", "b3", "b4"):
            assert (placed.points[name] - second[0]) @ normal == pytest.approx(0.0, abs=1e-9)
        drawn = by_name(layer.updates(placed))
        assert all(each["visible"] for each in drawn.values())
        texts = [drawn[f"/leaves/label/{index}"]["text"] for index in (1, 2, 3)]
        for index, text in enumerate(texts, start=1):
            name, angle = text.removesuffix("°").split()
            assert name == f"φ{index}"
            assert number(angle) == pytest.approx(folds_of(state)[2 + index], abs=0.51)
