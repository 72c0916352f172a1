"""Leg interference over steps and moves: the paper's test, and the exact one."""

from __future__ import annotations

import math
from functools import partial

import numpy as np
import pytest
from hypothesis import assume, given, strategies as st
from limited_designs import limited
from numpy.typing import ArrayLike
from reference import read_reference
from refusals import refusal
from scipy.spatial.transform import Rotation
from strategies import (
    Case,
    ordinary_cases,
    ordinary_designs,
    positions,
    rotations,
    uniform_rotations,
)
from tool_moves import tool_move

from explorer import (
    PRESETS,
    Design,
    Pose,
    leg_clearances,
    rotation_from_quaternion,
    rotation_from_yaw_pitch_roll,
    tetrahedra_overlap,
)
from explorer.legs.clearance import PAIRS, joined_pairs, leg_axes, pair_rows
from explorer.legs.interference import step_overlaps, swept_tetrahedra
from explorer.legs.moves import move_clearance, move_clearances, pairs_are_clear, poses_between
from explorer.mechanism.configuration import Configuration
from explorer.numerics.arrays import FloatArray

OPTIMAL = PRESETS["paper-optimal"]
HOME = OPTIMAL.home_pose
JOINED = Design(a3=(10, 4), b1=(4, -1), b2=0.0, b3=2.0)


@st.composite
def moves(draw: st.DrawFn) -> tuple[Design, Pose, Pose]:
    """Draw a design and two poses, of one orientation in a third of the cases."""
    design = draw(ordinary_designs())
    first = draw(rotations())
    second = first if draw(st.integers(0, 2)) == 0 else draw(rotations())
    # Of half a turn neither way is the shorter one.
    assume(Rotation.from_matrix(second @ first.T).magnitude() < math.pi - 1e-6)
    size = design.reach
    start = Pose.of(size * draw(positions()), first)
    end = Pose.of(size * draw(positions()) + [0.01, 0.0, 0.0], second)
    return design, start, end


def random_moves(seed: int, count: int) -> tuple[FloatArray, FloatArray, FloatArray, FloatArray]:
    """Return moves about the optimal design's home, a third of them at constant orientation."""
    rng = np.random.default_rng(seed)
    first = np.array(HOME.position) + rng.uniform(-8.0, 8.0, (count, 3))
    last = first + rng.uniform(-5.0, 5.0, (count, 3))
    turn = rotation_from_quaternion(rng.normal(size=(count, 4)))
    turned = rotation_from_quaternion(rng.normal(size=(count, 4)))
    kept = np.arange(count) % 3 == 0
    turned[kept] = turn[kept]
    return first, turn, last, turned


def arrays(start: Pose, end: Pose) -> tuple[ArrayLike, ArrayLike, ArrayLike, ArrayLike]:
    return start.position, start.rotation, end.position, end.rotation


@given(moves(), st.floats(0.0, 1.0), st.floats(0.0, 1.0))
def test_swept_tetrahedra_constant_orientation_hold_the_legs(
    move: tuple[Design, Pose, Pose], share: float, along: float
) -> None:
    design, start, end = move
    end = Pose(end.position, start.quaternion)
    ends = Configuration.at(design, start), Configuration.at(design, end)
    swept = swept_tetrahedra(*ends)
    assert swept.shape == (4, 4, 3)
    axes = leg_axes(Configuration(design, *poses_between(start, end, share)))
    points = axes[:, 0] + along * (axes[:, 1] - axes[:, 0])
    assert tetrahedra_overlap(swept, np.repeat(points[:, None], 4, axis=1)).all()
    overlaps = step_overlaps(*ends)
    # Legs within disjoint tetrahedra are apart.
    poses = poses_between(start, end, np.linspace(0.0, 1.0, 101))
    assert (
        leg_clearances(Configuration(design, *poses)).clearance.min(axis=0)[~overlaps] > 0.0
    ).all()


def test_move_clearance_pair_with_a_shared_joint_is_left_out() -> None:
    start, end = Pose((3, 2, 4), (1, 0.2, 0.1, -0.4)), Pose((4, 3, 5), (1, 0.2, 0.3, -0.4))
    joined = int(joined_pairs(JOINED).argmax())
    assert PAIRS[joined] == (2, 4)
    found = move_clearance(JOINED, start, end, steps=3)
    assert not found.overlaps[joined]
    assert math.isinf(found.bound[joined])
    assert math.isinf(found.clearance[joined])
    assert found.closest != joined
    others = np.arange(6) != joined
    assert np.isfinite(found.bound[others]).all()
    assert bool(pairs_are_clear(JOINED, *arrays(start, end)).all()) is found.is_clear


def crossing() -> tuple[Design, Pose, Pose]:
    """Return a move in which b1 passes through leg 4, and so leg 1 does."""
    design = Design(a3=(10.0, 4.0), b1=(4.0, -1.0), b2=3.0, b3=1.5)
    rotation = rotation_from_yaw_pitch_roll([-40.0, 10.0, 5.0])
    # Half way b1 is in the middle of leg 4, from a3 to b4.
    arm = rotation @ [*design.b1, 0.0]
    position = np.array([*design.a3, 0.0]) - 2.0 * arm
    side = np.cross(arm, [0.3, 0.5, 0.8])
    side /= np.linalg.norm(side)
    return design, Pose.of(position - side, rotation), Pose.of(position + side, rotation)


def test_move_clearance_legs_that_cross_fail_both_tests() -> None:
    design, start, end = crossing()
    found = move_clearance(design, start, end, steps=7)
    pair = PAIRS.index((1, 4))
    assert found.overlaps[pair]
    assert not found.is_free
    assert not found.is_clear
    assert found.clearance[pair] <= found.tolerance
    assert found.bound[pair] == pytest.approx(0.0, abs=1e-15)
    assert found.share[pair] == pytest.approx(0.5, abs=1e-4)
    assert not pairs_are_clear(design, *arrays(start, end)).all()
    assert step_overlaps(*(Configuration.at(design, pose) for pose in (start, end))).any()


@given(moves(), st.sampled_from((None, 1e-2, 1e-6)), st.none() | positions())
def test_move_clearance_bound_holds_and_is_nearly_attained(
    move: tuple[Design, Pose, Pose], share: float | None, place: FloatArray | None
) -> None:
    """The move is that of b4, or of a tool."""
    design, start, end = move
    tool = np.zeros(3) if place is None else design.reach * place
    x, y, z = tool.tolist()
    radii = (0.1, 0.2, 0.3, 0.4)
    design = limited(design, leg_radii=radii)
    longest = 10.0 * design.reach
    found = move_clearance(design, start, end, tool=(x, y, z))
    pairs = ~joined_pairs(design)
    if share is not None:
        loose = move_clearances(design, *arrays(start, end), tolerance=share * longest)
        assert (loose.clearance[pairs] - loose.bound[pairs] <= share * longest * 1.000001).all()
    poses = tool_move(start, end, np.linspace(0.0, 1.0, 501), tool)
    least = leg_clearances(Configuration(design, *poses)).clearance.min(axis=0)[pairs]
    rounding = 1e-12 * longest
    bound, clearance = found.bound[pairs], found.clearance[pairs]
    assert (bound <= least + rounding).all()
    assert (bound <= clearance).all()
    assert (clearance <= bound + found.tolerance * (1.0 + 1e-9)).all()
    assert (clearance <= least + found.tolerance).all()
    at = leg_clearances(Configuration(design, *tool_move(start, end, found.share, tool)))
    attained = at.clearance[np.arange(6), np.arange(6)][pairs]
    np.testing.assert_allclose(attained, clearance, atol=rounding)
    apart = np.linalg.norm(found.points[:, 0] - found.points[:, 1], axis=-1)[pairs]
    sums = np.array([radii[i - 1] + radii[j - 1] for i, j in PAIRS])[pairs]
    np.testing.assert_allclose(apart - sums, clearance, atol=rounding)


def test_pairs_are_clear_any_clearance_agrees_with_the_least() -> None:
    design = limited(OPTIMAL, leg_radii=(0.1, 0.2, 0.2, 0.3))
    many = random_moves(4, 500)
    least = move_clearances(design, *many).bound.min(axis=-1)
    for clearance in (-0.2, 0.5):
        clear = np.asarray(pairs_are_clear(design, *many, clearance=clearance).all(axis=-1))
        decided = np.abs(least - clearance) > 1e-4
        np.testing.assert_array_equal(clear[decided], least[decided] > clearance)
        assert 0.02 < clear.mean() < 0.98


def test_move_clearance_clear_move_is_free_at_fine_steps() -> None:
    start = HOME
    end = Pose((13.0, 2.0, 5.0), (0.7, 0.2, -0.3, -0.5))
    coarse = move_clearance(OPTIMAL, start, end, steps=1)
    fine = move_clearance(OPTIMAL, start, end, steps=200)
    # In one step the tetrahedra of legs 2 and 3 overlap, although the legs do not cross.
    assert coarse.is_clear
    assert not coarse.is_free
    assert [PAIRS[k] for k in np.flatnonzero(coarse.overlaps)] == [(2, 3)]
    assert fine.is_free
    np.testing.assert_allclose(coarse.bound, fine.bound)


def test_poses_between_shares_zero_and_one_are_the_ends() -> None:
    end = Pose((1.0, 2.0, 3.0), (0.1, 0.7, -0.2, 0.4))
    position, rotation = poses_between(HOME, end, [[0.0, 0.5, 1.0]])
    assert position.shape == (1, 3, 3)
    assert rotation.shape == (1, 3, 3, 3)
    np.testing.assert_allclose(position[0, [0, 2]], [HOME.position, end.position])
    np.testing.assert_allclose(rotation[0, [0, 2]], [HOME.rotation, end.rotation], atol=1e-14)
    half = rotation[0, 1] @ HOME.rotation.T
    np.testing.assert_allclose(half @ half @ HOME.rotation, end.rotation, atol=1e-14)


def test_move_clearance_no_length_is_refused() -> None:
    assert "two poses that differ" in refusal(move_clearance, OPTIMAL, HOME, HOME)
    turned = Pose(HOME.position, (1.0, 0.0, 0.0, 0.0))
    moved = Pose((10.0, 5.0, 9.0 + 1e-6), HOME.quaternion)
    for end in (turned, moved):
        assert move_clearance(OPTIMAL, HOME, end).is_clear


@pytest.mark.parametrize("steps", [0, -3])
def test_move_clearance_unusable_number_of_steps_is_refused(steps: int) -> None:
    end = Pose((9, 5, 9), HOME.quaternion)
    words = refusal(partial(move_clearance, steps=steps), OPTIMAL, HOME, end)
    assert f"at least one step; got {steps}" in words


@pytest.mark.parametrize("tolerance", [0.0, -1.0, 1e-12, math.nan])
def test_move_clearances_unusable_tolerance_is_refused(tolerance: float) -> None:
    ends = arrays(HOME, Pose((9, 5, 9), HOME.quaternion))
    words = refusal(partial(move_clearances, tolerance=tolerance), OPTIMAL, *ends)
    assert "tolerance must be at least" in words


def closest_points(a: FloatArray, b: FloatArray) -> tuple[FloatArray, FloatArray]:
    """Return distances (n,) and closest points (n, 2, 3) of segments as axes of legs 1 and 2."""
    axes = np.zeros((len(a), 4, 2, 3))
    axes[:, 0], axes[:, 1] = a, b
    distance, points = np.empty((len(a), 6)), np.empty((len(a), 6, 2, 3))
    pair_rows(len(a), axes, distance, points)
    return distance[:, 0], points[:, 0]


def random_segments(seed: int, count: int = 2000) -> tuple[FloatArray, FloatArray]:
    """Return pairs of segments: general, parallel, of no length, collinear, flat, meeting."""
    rng = np.random.default_rng(seed)
    a, b = rng.uniform(-1.0, 1.0, (2, count, 2, 3))
    kind = np.arange(count) % 8
    along = a[:, 1] - a[:, 0]
    share = rng.uniform(-1.0, 2.0, (count, 1))
    parallel = b[:, 0] + share * along
    b[kind == 1, 1] = parallel[kind == 1]
    b[kind == 2, 1] = b[kind == 2, 0]
    both = kind == 3
    a[both, 1], b[both, 1] = a[both, 0], b[both, 0]
    collinear = a[:, :1] + rng.uniform(-2.0, 2.0, (count, 2, 1)) * along[:, None, :]
    b[kind == 4] = collinear[kind == 4]
    a[kind == 5, :, 2] = b[kind == 5, :, 2] = 0.0
    # Nearly parallel: an angle of 1e-1 to 1e-12.
    tilt = 10.0 ** -rng.integers(1, 13, (count, 1)) * rng.uniform(-1.0, 1.0, (count, 3))
    b[kind == 6, 1] = (parallel + tilt)[kind == 6]
    on_a = a[:, 0] + rng.uniform(0.0, 1.0, (count, 1)) * along
    b[kind == 7, 0] = on_a[kind == 7]
    return a, b


def test_closest_points_reference_segments_have_its_distances() -> None:
    cases = read_reference("interference")["segments"]
    assert len(cases) == 200
    a, b = (np.array([case[key] for case in cases]) for key in "ab")
    expected = np.array([case["distance"] for case in cases])
    np.testing.assert_allclose(closest_points(a, b)[0], expected, rtol=1e-9)


def test_closest_points_any_segments_lie_on_them_with_nothing_closer() -> None:
    a, b = random_segments(2)
    distance, points = closest_points(a, b)
    x, y = points[:, 0], points[:, 1]
    np.testing.assert_allclose(np.linalg.norm(x - y, axis=-1), distance, atol=1e-14)
    # The points lie on the segments, and no end lies farther towards the other point.
    for point, ends in ((x, a), (y, b)):
        np.testing.assert_allclose(
            closest_points(np.stack([point, point], axis=1), ends)[0], 0.0, atol=1e-14
        )
    off = y - x
    for ends, point, sign in ((a, x, 1.0), (b, y, -1.0)):
        nearer = sign * np.einsum("ni,nki->nk", off, ends - point[:, None])
        assert nearer.max() < 1e-9


@pytest.mark.parametrize("size", [1e-8, 1e-5])
def test_closest_points_nearly_parallel_crossing_segments_meet(size: float) -> None:
    a = np.array([[-1.0, 0.0, 0.0], [1.0, 0.0, 0.0]])
    for share in np.linspace(-0.9, 0.9, 7):
        b = np.array([[-1.0, size * (-1.0 - share), 0.0], [1.0, size * (1.0 - share), 0.0]])
        assert closest_points(a[None], b[None])[0] < 1e-15


@given(ordinary_cases())
def test_leg_axes_any_pose_run_from_base_ends_to_platform_ends(case: Case) -> None:
    axes = leg_axes(Configuration(case.design, case.position, case.rotation))
    ends = case.position + case.design.platform_points @ case.rotation.T
    np.testing.assert_allclose(axes[:, 1], ends, atol=1e-12 * case.size)
    a3 = [*case.design.a3, 0.0]
    base = [[0.0, 0.0, 0.0], [ends[1, 0], 0.0, 0.0], [ends[2, 0], 0.0, 0.0], a3]
    np.testing.assert_allclose(axes[:, 0], base, atol=1e-12 * case.size)


@given(ordinary_cases())
def test_leg_clearances_any_pose_are_axis_distances_less_radii(case: Case) -> None:
    radii = (0.1, 0.2, 0.4, 0.8)
    design = limited(case.design, leg_radii=radii)
    axes = leg_axes(Configuration(design, case.position, case.rotation))
    found = leg_clearances(Configuration(design, case.position, case.rotation))
    for index, (i, j) in enumerate(PAIRS):
        if joined_pairs(design)[index]:
            continue
        distance, points = closest_points(axes[i - 1][None], axes[j - 1][None])
        assert found.distance[index] == pytest.approx(distance[0], abs=1e-12)
        np.testing.assert_allclose(found.points[index], points[0], atol=1e-12)
        expected = distance[0] - radii[i - 1] - radii[j - 1]
        assert found.clearance[index] == pytest.approx(expected, abs=1e-12)
    assert found.clearance[found.closest] == found.clearance.min()


@given(uniform_rotations(), st.sampled_from((0.0, 1e-14)))
def test_leg_clearances_pair_with_a_shared_joint_is_infinite(
    rotation: FloatArray, least: float
) -> None:
    position = np.array([1.0, 2.0, 3.0])
    second = leg_clearances(
        Configuration(Design(a3=(10, 4), b1=(4, -1), b2=least, b3=2), position, rotation)
    )
    third = leg_clearances(
        Configuration(Design(a3=(10, 4), b1=(4, -1), b2=2, b3=-least), position, rotation)
    )
    for found, pair in ((second, (2, 4)), (third, (3, 4))):
        infinite = [PAIRS[k] for k in range(6) if math.isinf(found.clearance[k])]
        assert infinite == [pair]
        np.testing.assert_allclose(found.points[PAIRS.index(pair)], [position] * 2)
        assert PAIRS[int(found.closest)] != pair
