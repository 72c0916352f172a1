"""Gaps: their ends lie on the elements of the two flags, and no shorter segment does."""

from __future__ import annotations

import math

import numpy as np
import pytest
from hypothesis import given
from incidence import distance_of_lines
from numpy.testing import assert_allclose
from strategies import EPSILON, Case, all_cases

from explorer import PRESETS
from explorer.mechanism.configuration import Configuration
from explorer.numerics.arrays import FloatArray
from explorer.singularity.gaps import FlagGaps, flag_gaps


def gaps_of(case: Case) -> FlagGaps:
    return flag_gaps(case.position, case.rotation)


def sine_of(case: Case) -> float:
    return math.hypot(case.rotation[1, 0], case.rotation[2, 0])


def misses(case: Case, gaps: FlagGaps) -> FloatArray:
    """Return how far each end is from its element, shape (3, 2), as computed from the axes."""
    local = (gaps.platform - case.position) @ case.rotation
    return np.array(
        [
            [math.hypot(*gaps.base[0]), abs(local[0, 2])],
            [math.hypot(*gaps.base[1, 1:]), math.hypot(*local[1, 1:])],
            [abs(gaps.base[2, 2]), math.hypot(*local[2])],
        ],
        dtype=np.float64,
    )


@given(all_cases())
def test_gaps_end_on_the_flags_and_have_the_lengths_of_the_margins(case: Case) -> None:
    gaps = gaps_of(case)
    # Where lines are nearly parallel, rounding moves their closest points along them.
    sizes = case.size * np.array([1.0, 1.0 / max(sine_of(case), 1e-14), 1.0])
    if gaps.are_parallel:
        sizes[1] = case.size
    assert (misses(case, gaps) <= 32.0 * EPSILON * sizes[:, None]).all()
    spans = np.linalg.norm(gaps.platform - gaps.base, axis=1)
    assert_allclose(spans, gaps.lengths, rtol=1e-12, atol=32.0 * EPSILON * case.size)
    first, second, third = gaps.lengths
    delta1, delta2, delta3 = np.abs(case.margins).tolist()
    assert_allclose((first, third), (delta1, delta3), rtol=1e-12, atol=8.0 * EPSILON * case.size)
    assert_allclose(second * sine_of(case), delta2, rtol=1e-9, atol=1e-13 * case.size)
    # The gap of an incidence is closed.
    holding = np.abs(case.margins) <= 8.0 * EPSILON * case.size
    for index in np.flatnonzero(holding):
        assert gaps.lengths[index] <= 1e-13 * case.size or (index == 1 and sine_of(case) < 0.1)


@pytest.mark.parametrize("angle", [0.0, math.pi])
def test_parallel_lines_have_the_gap_through_b4(angle: float) -> None:
    c, s = math.cos(angle), math.sin(angle)
    # Of a turn about z by half a turn, sin π is a rounding error.
    rotation = np.array([[c, -s, 0.0], [s, c, 0.0], [0.0, 0.0, 1.0]])
    position = np.array([7.0, 3.0, 4.0])
    gaps = flag_gaps(position, rotation)
    assert gaps.are_parallel
    assert gaps.lengths[1] == 5.0
    assert gaps.base[1].tolist() == [7.0, 0.0, 0.0]
    assert gaps.platform[1].tolist() == position.tolist()
    points = Configuration(PRESETS["paper-optimal"], position, rotation).points
    lines = (points.a1, points.a2), (points.b2, points.b3)
    assert distance_of_lines(*lines) == pytest.approx(5.0)
