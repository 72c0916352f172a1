"""Violations are those of a plain comparison, and valid moves have valid poses all along."""

from __future__ import annotations

import itertools
import math
import re
from typing import Any

import msgspec
import numpy as np
import pytest
from clear_moves import moves_are_clear
from hypothesis import given, strategies as st
from limited_designs import limited, ordinary_case, shell_case, thin_case, troubled_case
from scipy.spatial.transform import Rotation
from strategies import Case, ordinary_cases
from tool_moves import tool_move

from explorer import JOINTS, PRESETS, Design, InputError, Limits, Pose, evaluate, inverse, margins
from explorer.legs.clearance import PAIRS, leg_clearances
from explorer.legs.moves import poses_between
from explorer.mechanism.configuration import Configuration
from explorer.mechanism.design import LENGTHS, Swing
from explorer.mechanism.folds import from_folds, to_folds
from explorer.mechanism.margins import signs_of
from explorer.numerics.arrays import BoolArray, FloatArray
from explorer.numerics.number_text import UNITS, Unit
from explorer.workspace.limits.constraints import Cone, slacks
from explorer.workspace.limits.table import demands_of
from explorer.workspace.limits.valid_moves import moves_are_valid
from explorer.workspace.limits.valid_poses import (
    Collision,
    Rules,
    Violation,
    poses_are_valid,
    violations,
)
from explorer.workspace.workspace import Workspace

Signs = tuple[int, int, int]
ANY: dict[str, Any] = dict.fromkeys(LENGTHS, (0.0, 1e6))
FREE = Limits(**ANY, carriage_order="any", margin=None)


def with_only(design: Design, **limits: Any) -> Design:
    """Return the design with these limits and no others."""
    return msgspec.structs.replace(design, limits=msgspec.structs.replace(FREE, **limits))


def broken(
    design: Design, position: FloatArray, rotation: FloatArray, signs: Signs | None = None
) -> tuple[Violation, ...]:
    """Return the violations of ranges in one pose."""
    (found,) = violations(Configuration(design, position, rotation), signs)
    return tuple(each for each in found if isinstance(each, Violation))


def ranges(low: float, high: float) -> st.SearchStrategy[tuple[float, float]]:
    ends = st.tuples(st.floats(low, high), st.floats(low, high))
    return ends.map(lambda pair: (min(pair), max(pair)))


@given(
    ordinary_cases(),
    st.tuples(*[ranges(0.0, 20.0)] * 4),
    ranges(-20.0, 50.0),
    st.tuples(*[ranges(-30.0, 30.0)] * 3),
)
def test_length_carriage_or_coordinate_outside_its_range_is_a_violation(
    case: Case,
    lengths: tuple[tuple[float, float], ...],
    guide: tuple[float, float],
    sides: tuple[tuple[float, float], ...],
) -> None:
    lows, highs = zip(*sides, strict=True)
    limits: dict[str, Any] = dict(zip(LENGTHS, lengths, strict=True))
    design = with_only(case.design, **limits, guide=guide, box=(lows, highs))
    joints = dict(zip(JOINTS, inverse(design, case.position, case.rotation).tolist(), strict=True))
    found = {v.limit: v for v in broken(design, case.position, case.rotation)}
    values = joints | dict(zip(("box x", "box y", "box z"), case.position.tolist(), strict=True))
    for name, (low, high) in zip(
        (*LENGTHS, "d1", "d3", "box x", "box y", "box z"),
        (*lengths, guide, guide, *sides),
        strict=True,
    ):
        value = values[name]
        if not low - 1e-9 <= value <= high + 1e-9:
            above = value > high
            violation = found[name]
            assert (violation.value, violation.above) == (pytest.approx(value), above)
            assert violation.bound == (high if above else low)
        elif low <= value <= high:
            assert name not in found


@given(ordinary_cases())
def test_maximum_of_none_is_the_reach_and_a_margin_of_none_demands_nothing(case: Case) -> None:
    design = with_only(case.design, l1=(0.0, None))
    reach = math.hypot(*case.design.a3)
    l1 = float(inverse(design, case.position, case.rotation)[0])
    found = broken(design, case.position, case.rotation)
    assert [v.limit for v in found] == (["l1"] if l1 > reach * (1.0 + 1e-12) else [])
    assert all(v.bound == reach for v in found)


@given(ordinary_cases(), st.floats(0.0, 20.0))
def test_carriages_closer_than_the_gap_are_a_violation(case: Case, gap: float) -> None:
    design = with_only(case.design, gap=gap)
    joints = inverse(design, case.position, case.rotation)
    apart = abs(float(joints[1]) - float(joints[3]))
    found = broken(design, case.position, case.rotation)
    if apart < gap - 1e-9:
        (violation,) = found
        assert violation.limit.startswith("gap")
        assert not violation.above
    elif apart >= gap:
        assert found == ()


@given(ordinary_cases(), st.floats(0.0, 10.0), st.integers(0, 7))
def test_margin_of_another_sign_or_too_small_is_a_violation(
    case: Case, least: float, mode: int
) -> None:
    design = with_only(case.design, margin=least)
    signs = signs_of(mode)
    found = {v.limit: v for v in broken(design, case.position, case.rotation, signs)}
    margin = margins(case.position, case.rotation).tolist()
    for index, (value, sign) in enumerate(zip(margin, signs, strict=True), 1):
        name = f"margin δ{index}"
        if sign * value < least - 1e-9:
            violation = found[name]
            assert (violation.value, violation.above) == (pytest.approx(value), sign < 0)
            assert violation.bound == sign * least
        elif sign * value >= least:
            assert name not in found


def test_violations_are_in_the_order_of_the_design_file() -> None:
    design = with_only(
        PRESETS["paper-initial"],
        **dict.fromkeys(LENGTHS, (0.0, 0.0)),
        guide=(100.0, 101.0),
        gap=50.0,
        box=((100.0, 100.0, 100.0), (101.0, 101.0, 101.0)),
        margin=100.0,
    )
    found = broken(design, np.array([3.0, 4.0, 5.0]), np.eye(3), (1, -1, 1))
    assert [v.limit for v in found] == [
        *LENGTHS,
        *("d1", "d3", "gap |d1 − d3|"),
        *("box x", "box y", "box z"),
        *("margin δ1", "margin δ2", "margin δ3"),
    ]


@given(st.integers(0, 2**32))
def test_violated_limits_are_those_of_the_solids_and_of_validity(seed: int) -> None:
    rng = np.random.default_rng(seed)
    case = (ordinary_case, shell_case, thin_case, troubled_case)[seed % 4]
    design = case(seed)[0]
    angles = {name: float(rng.uniform(1.0, 180.0)) for name in ("a1", "a3", "b2", "b4")}
    design = limited(design, swing=Swing(**angles), gap=0.1 * design.reach)
    home = design.home_pose
    spread = float(rng.choice([1e-9, 1e-3, 0.1, 1.0]))
    turn = Rotation.from_rotvec(spread * rng.normal(size=3)).as_matrix()
    rotation = turn @ home.rotation
    position = np.array(home.position) + spread * design.reach * rng.normal(size=3)
    solids = Workspace(design, rotation).limits
    slack, size = slacks(solids, position), max(design.reach, float(np.abs(position).max()))
    # Close to a surface rounding decides.
    if (np.abs(slack) <= 1e-9 * np.where([isinstance(s, Cone) for s in solids], 1.0, size)).any():
        return
    beyond = {solid.name for solid, value in zip(solids, slack, strict=True) if value < 0.0}
    found = broken(design, position, rotation)
    assert {violation.demand.end_names()[int(violation.above)] for violation in found} == beyond
    rules = Rules.of(design).without_clearances()
    assert poses_are_valid(design, position, rotation, rules=rules) == (not found)


OPTIMAL = PRESETS["paper-optimal"]
RADIUS = 0.2
THICK = limited(OPTIMAL, leg_radii=(RADIUS,) * 4)


def poses_about(design: Design, seed: int, count: int) -> list[Pose]:
    """Return random poses at distances from near the home to far from it."""
    rng = np.random.default_rng(seed)
    home, size = design.home_pose, design.reach
    spread = rng.choice([1e-3, 0.1, 0.5], (count, 1))
    places = np.array(home.position) + size * spread * rng.uniform(-1.0, 1.0, (count, 3))
    turns = Rotation.from_rotvec(spread * rng.normal(size=(count, 3))).as_matrix()
    return [Pose.of(p, turn @ home.rotation) for p, turn in zip(places, turns, strict=True)]


def arrays_of(poses: list[Pose]) -> tuple[FloatArray, FloatArray]:
    return np.array([each.position for each in poses]), np.array([p.rotation for p in poses])


def with_swing(design: Design, seed: int) -> Design:
    rng = np.random.default_rng(seed)
    angles = {name: float(rng.uniform(20.0, 180.0)) for name in ("a1", "a3", "b1", "b2", "b3")}
    radii = tuple((0.02 * design.reach * rng.uniform(0.0, 1.0, 4)).tolist())
    return limited(design, swing=Swing(**angles), leg_radii=radii, gap=0.01 * design.reach)


@given(st.integers(0, 2**32))
def test_pose_is_valid_exactly_if_it_violates_nothing(seed: int) -> None:
    ordinary = ordinary_case(seed)[0]
    designs = troubled_case(seed)[0], ordinary, with_swing(ordinary, seed), THICK
    design = designs[seed % 4]
    position, rotation = arrays_of(poses_about(design, seed, 6))
    # In flat poses all legs are in one plane, where axes cross to rounding.
    flat = from_folds(to_folds(position, rotation) * [1, 1, 1, 0, 0, 0])
    position, rotation = np.vstack([position, flat[0]]), np.vstack([rotation, flat[1]])
    at = Configuration(design, position, rotation)
    found = violations(at)
    assert poses_are_valid(design, position, rotation).tolist() == [not broken for broken in found]
    for broken, clearances in zip(found, leg_clearances(at).clearance.tolist(), strict=True):
        told = {each.legs: each.depth for each in broken if isinstance(each, Collision)}
        for pair, clearance in zip(PAIRS, clearances, strict=True):
            if abs(clearance) > 1e-12 * design.reach:
                assert (pair in told) == (clearance < 0.0), (design, pair)
                assert told.get(pair, -clearance) == pytest.approx(-clearance)


def test_collision_is_told_with_the_length_of_the_overlap() -> None:
    (overlap,) = evaluate(limited(OPTIMAL, leg_radii=(0.4,) * 4), OPTIMAL.home_pose).violations
    assert (overlap.limit, str(overlap)) == ("legs 2–3", "legs 2 and 3 overlap by 0.1306")
    assert overlap.words(OPTIMAL.millimetres) == "legs 2 and 3 overlap by 1.306 mm"
    crossing = Pose((8.0, -4.0, 0.0), OPTIMAL.home_pose.quaternion)
    told = [str(each) for each in evaluate(OPTIMAL, crossing).violations]
    assert told == ["legs 2 and 4 touch", "legs 3 and 4 touch"]


def test_leg_without_a_direction_at_home_violates_its_cone() -> None:
    home = Pose((*OPTIMAL.a3, 0.0), OPTIMAL.home_pose.quaternion)
    free = limited(OPTIMAL, box=None, margin=None)
    design = msgspec.structs.replace(limited(free, swing=Swing(a3=90.0)), home=home)
    pose = OPTIMAL.home_pose
    assert poses_are_valid(free, pose.position, pose.rotation)
    assert not poses_are_valid(design, pose.position, pose.rotation)
    assert evaluate(design, pose).violations
    assert not moves_are_valid(design, pose.position, pose.rotation, pose.position, pose.rotation)


@pytest.mark.parametrize("share", [1.0, 0.2])
@pytest.mark.parametrize("tool", [(0.0, 0.0, 0.0), (3.0, -2.0, -1.0), (0.0, 0.0, 30.0)])
def test_move_valid_has_valid_poses_all_along(
    tool: tuple[float, float, float], share: float
) -> None:
    """Moves are those of a tool, at b4 or elsewhere, between valid poses or a share of each."""
    point = np.array(tool)
    rng = np.random.default_rng(7)
    places = rng.uniform([0, -12, 0], [20, 22, 18], (3600, 3))
    rotations = Rotation.random(3600, random_state=rng).as_matrix()
    valid = poses_are_valid(THICK, places, rotations)
    starts = [Pose.of(p, r) for p, r in zip(places[valid], rotations[valid], strict=True)][:61]
    moves: list[tuple[FloatArray, ...]] = []
    for start, end in itertools.pairwise(starts):
        position, rotation = tool_move(start, end, share, point)
        moves.append((np.array(start.position), start.rotation, position[0], rotation[0]))
    arrays = [np.array(column) for column in zip(*moves, strict=True)]
    found = moves_are_valid(THICK, *arrays, tool=tool)
    agree = 0
    for valid, (p, r, q, s) in zip(found.tolist(), moves, strict=True):
        poses = tool_move(Pose.of(p, r), Pose.of(q, s), np.linspace(0.0, 1.0, 100), point)
        along = poses_are_valid(THICK, *poses)
        # Limits have a tolerance on the way, which random moves do not come into.
        assert along.all() or not valid
        agree += int(along.all()) == valid
    # What is refused for being too near to a collision or a singularity is rare.
    assert agree >= 0.96 * len(found)
    assert found.any()
    assert moves_are_clear(THICK, *arrays, tool=tool)[found].all()
    # The move of b4 between the same poses is another one, unless the tool is at b4.
    differs = (moves_are_valid(THICK, *arrays) != found).any()
    assert differs == point.any() or share < 1.0


def test_move_along_a_limit_is_valid_to_the_tolerance() -> None:
    home = OPTIMAL.home_pose
    top = limited(OPTIMAL, box=((0, -12, 0), (20, 22, home.position[2])))
    x, y, z = home.position
    # On the face of the box all the way.
    assert moves_are_valid(top, (x, y, z), home.rotation, (x + 1, y - 1, z), home.rotation)
    # About b4 leg 1 turns: on the way it is shorter than at both ends.
    start, end = (
        Pose.of_yaw_pitch_roll(home.position, (yaw, 0.0, 0.0)) for yaw in (-100.0, -125.0)
    )
    ways = [start.position, start.rotation, end.position, end.rotation]
    lengths = [
        float(evaluate(OPTIMAL, Pose.of(home.position, r)).joints[0])
        for r in poses_between(start, end, np.linspace(0.0, 1.0, 101))[1]
    ]
    ends, least = min(lengths[0], lengths[-1]), min(lengths)
    assert least < ends - 1e-2
    # The carriages have another order there than at home.
    turned = limited(OPTIMAL, carriage_order="any")
    bounded = limited(turned, l1=(ends, 50.0))
    assert moves_are_valid(limited(turned, l1=(least, 50.0)), *ways)
    assert not moves_are_valid(bounded, *ways)
    assert not moves_are_valid(bounded, *ways, tolerance=0.5 * (ends - least))
    assert moves_are_valid(bounded, *ways, tolerance=2.5 * (ends - least))


def test_move_to_another_mode_is_invalid() -> None:
    home = OPTIMAL.home_pose
    free = limited(OPTIMAL, box=None)
    x, y, z = home.position
    assert not moves_are_valid(free, (x, y, z), home.rotation, (x, y, -z), home.rotation)


def test_move_of_half_a_turn_which_has_no_shorter_way_is_invalid() -> None:
    rng, count = np.random.default_rng(0), 40_000
    free = limited(OPTIMAL, box=None, carriage_order="any")
    start = 10.0 * rng.normal(size=(count, 3))
    end = start + 3.0 * rng.normal(size=(count, 3))
    first = Rotation.from_quat(rng.normal(size=(count, 4)))
    axis = rng.normal(size=(count, 3))
    axis /= np.linalg.norm(axis, axis=1, keepdims=True)

    def is_valid(angle: float) -> BoolArray:
        last = Rotation.from_rotvec(angle * axis) * first
        return moves_are_valid(free, start, first.as_matrix(), end, last.as_matrix())

    assert is_valid(math.pi - 1e-6).any()
    assert not is_valid(math.pi).any()


def test_poses_not_finite_are_refused() -> None:
    with pytest.raises(InputError, match="position"):
        poses_are_valid(OPTIMAL, [0.0, math.nan, 1.0], np.eye(3))
    with pytest.raises(InputError, match="end position"):
        moves_are_valid(OPTIMAL, [0.0, 1.0, 1.0], np.eye(3), [0.0, math.nan, 1.0], np.eye(3))


@pytest.mark.parametrize("beyond", [1e-4, 1e-7, 1e-9])
@pytest.mark.parametrize("unit", [None, UNITS, Unit("mm", 7.3)])
def test_violation_shows_a_value_that_differs_from_its_bound(
    beyond: float, unit: Unit | None
) -> None:
    cones = Swing(a1=40.0, a3=40.0, b1=40.0, b2=40.0, b3=40.0, b4=40.0)
    every: dict[str, Any] = dict.fromkeys(LENGTHS, (3.0, 20.0))
    box = ((1.0, -9.0, 1.0), (20.0, 22.0, 18.0))
    design = limited(
        OPTIMAL, **every, guide=(0.5, 20.0), gap=0.25, margin=0.7, box=box, swing=cones
    )
    every_end = [(demand, end) for demand in demands_of(design) for end in demand.finite_ends()]
    # A sign alone has no bound to show.
    ends = [(demand, bound.value, side) for demand, (bound, _, side) in every_end if bound.value]
    assert len(ends) > 20
    for demand, bound, side in ends:
        value = bound + side * beyond
        words = Violation(demand, value, above=side > 0.0).words(unit).partition(" = ")[2]
        first, _, second = re.split(r" is (above its maximum|below its minimum) ", words)
        assert first != second
