"""Singular poses on paths: all are found, and a path between two modes has one."""

from __future__ import annotations

import math

import numpy as np
import pytest
from hypothesis import assume, given, strategies as st
from scipy.spatial.transform import Rotation
from strategies import WAYS, Case, cases, singular_cases
from tool_moves import tool_move

from explorer import PRESETS, Design, Pose, forward, inverse, margins
from explorer.legs.moves import poses_between
from explorer.mechanism.margins import mode_of
from explorer.paths.crossings import path_margins

OPTIMAL = PRESETS["paper-optimal"]
HOME = OPTIMAL.home_pose


def random_pose(rng: np.random.Generator, size: float = 5.0) -> Pose:
    return Pose.of(size * rng.uniform(-1, 1, 3), Rotation.random(random_state=rng).as_matrix())


@given(st.integers(0, 2**32), st.sampled_from((0.0, 3.0, 20.0)))
def test_path_margins_move_of_b4_or_a_tool_has_all_crossings(seed: int, size: float) -> None:
    rng = np.random.default_rng(seed)
    start, end, tool = random_pose(rng), random_pose(rng), size * rng.uniform(-1.0, 1.0, 3)
    found = path_margins([start, end], tool=tool)
    assert found.lies_in == ()
    shares = [each.share for each in found.crossings]
    assert shares == sorted(shares)
    for each in found.crossings:
        position, rotation = tool_move(start, end, each.share, tool)
        assert abs(margins(position, rotation)[0, each.incidence - 1]) < 1e-12 * (5.0 + size)
        np.testing.assert_allclose(each.pose.position, position[0], atol=1e-12 * (5.0 + size))
    finely = margins(*tool_move(start, end, np.linspace(0.0, 1.0, 4001), tool))
    signs = finely > 0.0
    changes = (signs[1:] != signs[:-1]).sum(axis=0).tolist()
    crossed = [sum(c.incidence == k for c in found.crossings) for k in (1, 2, 3)]
    assert crossed == changes
    sampled = np.where(changes, 0.0, np.abs(finely).min(axis=0))
    least = np.array(found.least)
    assert (least <= sampled + 1e-12 * (5.0 + size)).all()
    np.testing.assert_allclose(least, sampled, atol=1e-5 * (5.0 + size))


@given(cases(), st.integers(0, 4), st.integers(0, 2**32))
def test_path_margins_between_modes_cross_the_margins_that_differ(
    case: Case, corners: int, seed: int
) -> None:
    """The claim: modes are the sign triples, so a path to another crosses what differs."""
    modes = forward(case.design, inverse(case.design, case.position, case.rotation))
    assume(bool(modes.feasible))
    # All eight have the same |δ| but for the rounding of the joints, which a platform of a
    # millionth of the size blows up until an end may lie on the singular set.
    found_margins = margins(modes.position, modes.rotation)
    assume(bool(np.abs(found_margins).min() > 1e-6 * case.size))
    assume(bool((mode_of(found_margins) == np.arange(8)).all()))
    rng = np.random.default_rng(seed)
    first, last = rng.choice(8, 2, replace=False).tolist()
    ends = [Pose.of(modes.position[k], modes.rotation[k]) for k in (first, last)]
    path = [ends[0], *(random_pose(rng, case.size) for _ in range(corners)), ends[1]]
    found = path_margins(path)
    signs = np.sign([margins(each.position, each.rotation) for each in ends])
    expected = {k + 1 for k in range(3) if signs[0][k] != signs[1][k]}
    assert expected
    for incidence in (1, 2, 3):
        crossed = sum(c.incidence == incidence and c.changes_sign for c in found.crossings)
        # An odd number where the signs differ, else an even one.
        assert crossed % 2 == int(incidence in expected)


def test_path_margins_of_roots_of_higher_order_change_sign_once() -> None:
    """All margins vanish halfway, where two zeros of the rates lie side by side."""
    third = np.array([[-1.0, 2.0, -2.0], [-2.0, 1.0, 2.0], [2.0, 2.0, 1.0]]) / 3.0
    design = Design(a3=(10.0, 10.0), b1=(0.0, 10.0), b2=0.0, b3=10.0)
    modes = forward(design, inverse(design, [7.5, 0.0, 5.0], third))
    path = [Pose.of(modes.position[mode], modes.rotation[mode]) for mode in (3, 4)]
    found = path_margins(path).crossings
    assert sorted(each.incidence for each in found) == [1, 2, 3]
    assert all(each.changes_sign and abs(each.share - 0.5) < 1e-6 for each in found)


@given(st.data(), st.sampled_from(WAYS))
def test_path_margins_singular_start_is_a_crossing(
    data: st.DataObject, way: tuple[int, ...]
) -> None:
    case = data.draw(singular_cases(way, st.just(OPTIMAL)))
    found = path_margins([Pose.of(case.position, case.rotation), HOME])
    for incidence in way:
        own = [c for c in found.crossings if c.incidence == incidence]
        assert incidence in found.lies_in or (own and own[0].share < 1e-6)


def test_path_margins_move_in_the_base_plane_lies_in_incidence_3() -> None:
    start = Pose((1.0, 2.0, 0.0), HOME.quaternion)
    end = Pose((3.0, -2.0, 0.0), (0.8, 0.3, -0.4, 0.2))
    assert path_margins([start, end]).lies_in == (3,)
    # Level in the base plane, every margin vanishes throughout.
    level = Pose((3.0, -2.0, 0.0), HOME.quaternion)
    assert path_margins([start, level]).lies_in == (1, 2, 3)
    # A pose that stays, on the set and off it.
    assert path_margins([start, start]).lies_in == (1, 2, 3)
    still = path_margins([HOME, HOME])
    assert still.lies_in == still.crossings == ()


@pytest.mark.parametrize("angle", [0.3, 0.7, 1.0, 1.2, 1.5])
def test_path_margins_margin_that_touches_zero_changes_no_sign(angle: float) -> None:
    # A tool at 1 above b4 and the base plane turns about x, so that δ3 = 1 − cos θ.
    tool, place = np.array([0.0, 0.0, 1.0]), np.array([5.0, 5.0, 1.0])
    turns = Rotation.from_rotvec([[-angle, 0.0, 0.0], [angle, 0.0, 0.0]]).as_matrix()
    found = path_margins([Pose.of(place - turn @ tool, turn) for turn in turns], tool=tool)
    (touch,) = [each for each in found.crossings if each.incidence == 3]
    assert touch.share == pytest.approx(0.5, abs=1e-7)
    assert not touch.changes_sign


@pytest.mark.parametrize("gap", [1e-2, 1e-5])
def test_path_margins_two_close_crossings_are_both_present(gap: float) -> None:
    # The platform turns about y by θ at b4 = (x, y, z): δ1 = −(x sin θ + z cos θ), which has
    # its extreme −|(x, z)| where the normal points away from a1. Taking b4 along keeps
    # that extreme at the middle and lets it come as close to zero as one likes.
    turn = Rotation.from_rotvec([0.0, 1.0, 0.0]).as_matrix()
    span = np.array([math.sin(0.5), 0.0, math.cos(0.5)])

    def path(lift: float) -> list[Pose]:
        # b4 crosses the platform plane through a1 twice, or not at all.
        across = np.array([math.cos(0.5), 0.0, -math.sin(0.5)])
        return [
            Pose.of(4.0 * across * s + lift * span + [0.0, 0.3, 0.0], r)
            for s, r in ((-1.0, np.eye(3)), (1.0, turn))
        ]

    def least(lift: float) -> float:
        shares = np.linspace(0.45, 0.55, 2001)
        start, end = path(lift)
        return float(margins(*poses_between(start, end, shares))[:, 0].max())

    low, high = -4.0, 4.0
    for _ in range(60):
        middle = 0.5 * (low + high)
        low, high = (low, middle) if least(middle) < 0.0 else (middle, high)
    counts = [
        [c.share for c in path_margins(path(low + d)).crossings if c.incidence == 1]
        for d in (gap**2, -(gap**2))
    ]
    lone, pair = sorted(counts, key=len)
    assert len(pair) - len(lone) == 2
    assert float(np.diff(pair).min()) < 20.0 * gap
