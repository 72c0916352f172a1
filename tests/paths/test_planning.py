"""Planned paths and lines in the folds keep all limits; a failure states its reason."""

from __future__ import annotations

import itertools
import math
import sys
from functools import cache
from importlib.util import find_spec
from typing import Any

import numpy as np
import pytest
from clear_moves import moves_are_clear
from limited_designs import limited
from long_cases import long_after
from numpy.testing import assert_allclose, assert_array_equal
from scipy.spatial.transform import Rotation
from tool_moves import tool_move

from explorer import (
    PRESETS,
    Design,
    InputError,
    MissingExtraError,
    NoAnswerError,
    Pose,
    evaluate,
    forward,
    from_folds,
    inverse,
    margins,
    rotation_from_quaternion,
    to_folds,
)
from explorer.legs.moves import move_clearances, poses_between
from explorer.mechanism.margins import mode_of, signs_of
from explorer.numerics.arrays import FloatArray
from explorer.paths.crossings import path_margins
from explorer.paths.planning import NoPathError, PlannedPath, plan_path
from explorer.paths.search import (
    Proofs,
    lengths_of_moves,
    load_ompl,
    positions_and_rotations,
    smooth,
)
from explorer.singularity.nearest import displacement
from explorer.workspace.limits.valid_moves import moves_are_valid
from explorer.workspace.limits.valid_poses import Rules, poses_are_valid

DESIGN = limited(PRESETS["paper-optimal"], leg_radii=(0.2,) * 4)
HOME = DESIGN.home_pose
PROOFS = Proofs(DESIGN, Rules.of(DESIGN))
needs_ompl = pytest.mark.skipif(find_spec("ompl") is None, reason="OMPL is not installed")


@cache
def valid_poses(design: Design = DESIGN) -> tuple[Pose, ...]:
    rng = np.random.default_rng(3)
    positions = rng.uniform([0, -12, 0], [20, 22, 18], (40_000, 3))
    rotations = Rotation.random(40_000, random_state=rng).as_matrix()
    valid = poses_are_valid(design, positions, rotations)
    pairs = zip(positions[valid], rotations[valid], strict=True)
    return tuple(Pose.of(p, r) for p, r in pairs)


def order(pose: Pose) -> list[int]:
    _, d1, _, d3, _, _ = inverse(DESIGN, pose.position, pose.rotation).tolist()
    return np.argsort([0.0, d1, d3]).tolist()


@cache
def pairs(moves: int) -> tuple[tuple[Pose, Pose], ...]:
    """Return pairs of poses of one order whose line in the folds has so many moves, 0 for none."""
    found: list[tuple[Pose, Pose]] = []
    for a, b in itertools.pairwise(valid_poses()):
        if order(a) == order(b) and len(found) < 12:
            folds = to_folds(*positions_and_rotations((a, b)))
            corners = PROOFS.prove_line(*folds)
            if moves == (0 if corners is None else len(corners) - 1):
                found.append((a, b))
    return tuple(found)


def assert_keeps_everything(path: PlannedPath, poses: tuple[Pose, ...]) -> None:
    room = (path.margin - 2e-4 * DESIGN.reach, path.clearance - 1e-4 * DESIGN.reach)
    tool = np.array(path.tool or (0.0, 0.0, 0.0))
    for start, end in itertools.pairwise(poses):
        positions, rotations = tool_move(start, end, np.linspace(0.0, 1.0, 50), tool)
        assert poses_are_valid(DESIGN, positions, rotations).all()
        ends = (start.position, start.rotation, end.position, end.rotation)
        assert moves_are_clear(DESIGN, *ends, tool=tool)
        assert moves_are_clear(DESIGN, *ends, clearance=room[1], tool=tool) or room[1] < 0.0
    margins = path_margins(poses, tool=tool)
    assert margins.crossings == ()
    assert margins.lies_in == ()
    assert min(margins.least) >= room[0]


def travel(poses: tuple[Pose, ...]) -> float:
    """Return the way of b1 to b4 along a path; the sum of its moves leaves out how they bend."""
    shares = np.linspace(0.0, 1.0, 101)
    total = 0.0
    for start, end in itertools.pairwise(poses):
        p, r = poses_between(start, end, shares)
        total += float(displacement(DESIGN, p[:-1], r[:-1], p[1:], r[1:]).sum())
    return total


@needs_ompl
@pytest.mark.parametrize("index", long_after(4, range(10)))
def test_plan_path_between_valid_ends_keeps_everything_and_is_no_detour_when_smoothed(
    index: int,
) -> None:
    """Every other move is that of a tool."""
    start, goal = pairs(0)[index]
    tool = (1.0, -0.5, 3.0) if index % 2 else None
    path = plan_path(DESIGN, start, goal, seconds=60.0, tool=tool)
    assert path.tool == tool
    # Nearly all of the ends' margin and half of their clearance is kept, or else none.
    ends = [evaluate(DESIGN, each) for each in (start, goal)]
    margin = min(0.9 * float(abs(e.margins).min()) for e in ends)
    assert path.margin in (pytest.approx(margin), 0.0)
    assert (path.clearance > 0.0) == (path.margin > 0.0)
    if tool is None:
        assert len(path.unsmoothed) > 2
        assert path.checked > 2
        assert path.length == pytest.approx(float(lengths_of_moves(DESIGN, path.poses).sum()))
        # Smoothing compares displacements, so that by the way it may lose some per cent.
        assert travel(path.poses) <= 1.1 * travel(path.unsmoothed)
    for poses in (path.poses, path.unsmoothed):
        assert poses[0] is start
        assert poses[-1] is goal
        assert_keeps_everything(path, poses)


def test_smooth_detour_in_free_space_becomes_straight() -> None:
    x, y, z = HOME.position
    corner = Pose((x, y + 2.0, z), HOME.quaternion)
    end = Pose((x + 2.0, y + 2.0, z), HOME.quaternion)
    assert PROOFS.are_valid([(HOME, end)]) == [True]
    assert smooth(PROOFS, [HOME, corner, end]) == (HOME, end)


@pytest.mark.parametrize("moves", [2, 3])
def test_plan_path_line_in_the_folds_of_some_moves_needs_no_search(
    moves: int, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setitem(sys.modules, "ompl.base", None)
    for start, goal in pairs(moves):
        path = plan_path(DESIGN, start, goal)
        assert path.poses == path.unsmoothed
        assert path.poses[0] is start
        assert path.poses[-1] is goal
        # The corners lie on the line, at its halves, quarters and so on.
        folds = to_folds(*positions_and_rotations(path.poses))
        shares = np.divide(folds - folds[:1], folds[-1:] - folds[:1])
        fractions = np.round(4096.0 * shares[:, :1]) / 4096.0
        assert_allclose(shares, np.broadcast_to(fractions, shares.shape), rtol=0, atol=1e-9)
        assert_keeps_everything(path, path.poses)


def test_plan_path_without_ompl_names_its_extra(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setitem(sys.modules, "ompl.util", None)
    load_ompl.cache_clear()
    with pytest.raises(MissingExtraError, match=r"\.\[planning\]"):
        plan_path(DESIGN, *pairs(0)[0])


@pytest.mark.parametrize("mode", [0, 3, 7])
def test_plan_path_other_mode_names_the_folds_and_their_incidences(mode: int) -> None:
    modes = forward(DESIGN, inverse(DESIGN, HOME.position, HOME.rotation))
    goal = Pose.of(modes.position[mode], modes.rotation[mode])
    with pytest.raises(NoPathError, match="is in mode") as caught:
        plan_path(DESIGN, HOME, goal)
    assert caught.value.reason == "other mode"
    assert isinstance(caught.value, NoAnswerError)
    flat = [
        "fold φ1 at the line b2b3 is flat or undefined (a1 on the platform plane)",
        "fold φ2 at the line a1b4 is flat or undefined (lines a1a2 and b2b3 meeting)",
        "fold φ3 at the guide is flat or undefined (b4 on the base plane)",
    ]
    differ = [words for words, bit in zip(flat, (4, 2, 1), strict=True) if (1 ^ mode) & bit]
    poses = " and one where ".join(differ)
    assert f": every path between them passes a pose where {poses}" in str(caught.value)


@pytest.mark.parametrize("demanded", ["home", "any"])
def test_plan_path_other_carriage_order_names_both_orders(demanded: str) -> None:
    plain = limited(DESIGN, carriage_order="any")
    start = next(each for each in valid_poses(plain) if order(each) == [0, 1, 2])
    goal = next(each for each in valid_poses(plain) if order(each) == [0, 2, 1])
    with pytest.raises(NoPathError, match="order a1, d1, d3, the goal a1, d3, d1") as caught:
        plan_path(limited(DESIGN, carriage_order=demanded), start, goal)
    assert caught.value.reason == "other order"
    # On the straight move, too, the legs 2 and 3 meet.
    least = move_clearances(
        DESIGN, start.position, start.rotation, goal.position, goal.rotation
    ).clearance[3]
    assert least < -0.39


@needs_ompl
def test_plan_path_too_little_time_names_it() -> None:
    with pytest.raises(NoPathError, match="1e-09 s") as caught:
        plan_path(DESIGN, *pairs(0)[0], seconds=1e-9)
    assert caught.value.reason == "out of time"


def test_plan_path_end_outside_limits_names_them() -> None:
    x, y, z = HOME.position
    far = Pose((40.0, y, z), HOME.quaternion)
    broken = [str(each) for each in evaluate(DESIGN, far).violations]
    with pytest.raises(InputError, match="the goal is outside the limits") as caught:
        plan_path(DESIGN, HOME, far)
    assert len(broken) >= 2
    assert all(each in str(caught.value) for each in broken)
    with pytest.raises(InputError, match="the start is outside the limits"):
        plan_path(DESIGN, far, HOME)
    thick = limited(DESIGN, leg_radii=(3.0,) * 4)
    with pytest.raises(InputError, match="legs 2 and 3 overlap by 5"):
        plan_path(thick, HOME, Pose((x, y + 1, z), HOME.quaternion))


def test_plan_path_singular_end_names_its_incidence() -> None:
    x, y, _ = HOME.position
    singular = Pose.of_yaw_pitch_roll((x, y, 0.0), (-70.0, 20.0, 30.0))
    for ends in ((singular, HOME), (HOME, singular)):
        with pytest.raises(InputError, match="b4 on the base plane"):
            plan_path(DESIGN, *ends)


def test_plan_path_mode_other_than_the_home_has_a_path() -> None:
    modes = forward(DESIGN, inverse(DESIGN, HOME.position, HOME.rotation))
    free = limited(PRESETS["paper-optimal"], box=None)
    start = Pose.of(modes.position[6], modes.rotation[6])
    x, y, z = start.position
    goal = Pose((x + 0.1, y, z + 0.1), start.quaternion)
    assert plan_path(free, start, goal).poses == (start, goal)


def test_plan_path_with_an_unusable_tool_or_time_is_refused() -> None:
    tools: list[Any] = [(math.nan, 0.0, 0.0), (math.inf, 0.0, 0.0), (1.0, 2.0)]
    for tool in tools:
        with pytest.raises(InputError, match="tool must"):
            plan_path(DESIGN, HOME, HOME, tool=tool)
    for seconds in (0.0, math.nan, math.inf):
        with pytest.raises(InputError, match="time above zero"):
            plan_path(DESIGN, HOME, HOME, seconds=seconds)


FREE = limited(
    PRESETS["paper-optimal"],
    **dict.fromkeys(("l1", "d2", "d4", "l4"), (0.0, 1e3)),
    box=None,
    carriage_order="any",
)
MODE = 5


def poses_of_mode(count: int) -> tuple[FloatArray, FloatArray]:
    """Return random poses of one mode, at distances up to some times the reach."""
    rng = np.random.default_rng(0)
    position = 10.0 * rng.normal(size=(12 * count, 3))
    rotation = rotation_from_quaternion(rng.normal(size=(12 * count, 4)))
    chosen = np.flatnonzero(mode_of(margins(position, rotation)) == MODE)[:count]
    return position[chosen], rotation[chosen]


def proofs(margin: float, tolerance: float) -> Proofs:
    """Return proofs that demand a margin and the signs of the mode, and nothing else."""
    rules = Rules.of(FREE, signs_of(MODE)).without_clearances().tighten(margin, 0.0)
    return Proofs(FREE, rules, tolerance=tolerance)


@pytest.mark.parametrize("count", [1000, pytest.param(10_000, marks=pytest.mark.long)])
def test_line_between_any_two_poses_of_a_mode_is_proven_where_a_quarter_of_moves_fail(
    count: int,
) -> None:
    position, rotation = poses_of_mode(2 * count)
    folds = to_folds(position, rotation)
    rules = proofs(0.0, 0.0).rules
    ends = position[:count], rotation[:count], position[count:], rotation[count:]
    straight = moves_are_valid(FREE, *ends, rules=rules)
    assert 0.7 < straight.mean() < 0.8
    for first, last, is_straight in zip(folds[:count], folds[count:], straight, strict=True):
        least = min(float(np.abs(margins(*from_folds(end))).min()) for end in (first, last))
        corners = proofs(0.5 * least, min(1e-4 * FREE.reach, 0.1 * least)).prove_line(first, last)
        assert corners is not None
        assert len(corners) > 2 or is_straight
        poses = [Pose.of(*from_folds(corner)) for corner in corners]
        along = path_margins(poses)
        assert along.crossings == ()
        assert min(along.least) >= 0.4 * least


@pytest.mark.parametrize("flat", [1e-2, 1e-4])
@pytest.mark.parametrize("wall", range(1, 6))
def test_line_along_a_wall_of_a_mode_is_proven(wall: int, flat: float) -> None:
    rng = np.random.default_rng(wall)
    first, last = rng.uniform([5.0, *[0.3] * 5], [20.0, *[2.8] * 5], (2, 6))
    signs = np.array([1.0, 1.0, 1.0, *signs_of(MODE)])
    first[wall] = last[wall] = flat
    first, last = signs * first, signs * last
    least = min(float(np.abs(margins(*from_folds(end))).min()) for end in (first, last))
    corners = proofs(0.0, 0.1 * least).prove_line(first, last)
    assert corners is not None
    assert_array_equal(corners[0], first)
    assert_array_equal(corners[-1], last)
