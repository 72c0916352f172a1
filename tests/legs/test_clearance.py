"""Distances between segments and clearances of the legs in a pose."""

from __future__ import annotations

import math

import numpy as np
import pytest
from hypothesis import given, strategies as st
from limited_designs import limited
from reference import read_reference
from strategies import Case, ordinary_cases, uniform_rotations

from explorer import Design, leg_clearances
from explorer.legs.clearance import PAIRS, joined_pairs, leg_axes, pair_rows
from explorer.mechanism.configuration import Configuration
from explorer.numerics.arrays import FloatArray


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
