"""The folds: reference cases, round trips up to the walls, margins, modes, straight lines."""

from __future__ import annotations

import math
from typing import Any

import numpy as np
import pytest
from numpy.testing import assert_allclose, assert_array_equal
from reference import read_reference
from refusals import refusal
from strategies import QUARTER_TURNS

from explorer import (
    PRESETS,
    forward,
    from_folds,
    inverse,
    margins,
    rotation_from_quaternion,
    to_folds,
)
from explorer.mechanism.margins import mode_of
from explorer.numerics.arrays import FloatArray

CASES: list[dict[str, Any]] = read_reference("folds")["cases"]
LENGTHS = [0, 2, 4, 5]
TWO_PI = 2.0 * math.pi
LONG = pytest.mark.long


def margins_of(folds: FloatArray) -> FloatArray:
    """Return the margins as products of r and sines."""
    r, beta, epsilon, phi1, phi2, phi3 = np.moveaxis(folds, -1, 0)
    return np.stack(
        [
            r * np.sin(epsilon) * np.sin(phi1),
            r * np.sin(beta) * np.sin(epsilon) * np.sin(phi2),
            r * np.sin(beta) * np.sin(phi3),
        ],
        axis=-1,
    )


def random_poses(count: int, seed: int) -> tuple[FloatArray, FloatArray]:
    rng = np.random.default_rng(seed)
    position = rng.normal(size=(count, 3)) * 10.0
    return position, rotation_from_quaternion(rng.normal(size=(count, 4)))


def random_folds(count: int, seed: int, flat: float = 0.0) -> FloatArray:
    """Return coordinates (count, 6); some of the angles are within `flat` of a wall."""
    rng = np.random.default_rng(seed)
    folds = np.empty((count, 6))
    folds[:, 0] = rng.uniform(0.1, 30.0, count)
    angles = rng.uniform(0.0, math.pi, (count, 5))
    near = rng.uniform(0.0, flat, (count, 5))
    angles = np.where(rng.random((count, 5)) < 0.3, near, angles) if flat else angles
    angles = np.where(rng.random((count, 5)) < 0.5, math.pi - angles, angles)
    signs = rng.choice([-1.0, 1.0], (count, 3))
    folds[:, 1:3], folds[:, 3:] = angles[:, :2], signs * angles[:, 2:]
    return folds


def test_reference_cases_have_their_folds_poses_and_margins() -> None:
    assert len(CASES) == 120
    position = np.array([case["position"] for case in CASES])
    rotation = rotation_from_quaternion([case["quaternion"] for case in CASES])
    expected = np.array([case["folds"] for case in CASES])
    found = to_folds(position, rotation)
    assert_allclose(found[:, 0], expected[:, 0], rtol=1e-12)
    apart = (found - expected)[:, 1:]
    assert_allclose(apart - TWO_PI * np.round(apart / TWO_PI), 0.0, atol=1e-12)
    back = from_folds(expected)
    assert_allclose(back[0], position, rtol=0, atol=1e-12 * np.abs(position).max())
    assert_allclose(back[1], rotation, rtol=0, atol=1e-12)
    given = np.array([case["margins"] for case in CASES])
    assert_allclose(margins_of(found), given, rtol=0, atol=1e-12 * np.abs(given).max())


@pytest.mark.parametrize("count", [1, 7, 100_000, pytest.param(1_000_000, marks=LONG)])
def test_random_poses_come_back_in_their_ranges_with_their_margins(count: int) -> None:
    position, rotation = random_poses(count, 1)
    folds = to_folds(position, rotation)
    again = from_folds(folds)
    assert_allclose(again[0], position, rtol=0, atol=1e-12)
    assert_allclose(again[1], rotation, rtol=0, atol=1e-12)
    assert (folds[:, :3] >= 0.0).all()
    assert (folds[:, 1:3] <= math.pi).all()
    assert (np.abs(folds[:, 3:]) <= math.pi).all()
    margin = margins(position, rotation)
    assert_allclose(margins_of(folds), margin, rtol=0, atol=1e-12)
    # The signs of the folds are those of the margins.
    assert_array_equal(mode_of(folds[:, 3:]), mode_of(margin))


@pytest.mark.parametrize("flat", [1e-1, 1e-4, 1e-8, 1e-12, 1e-15])
def test_poses_near_the_walls_come_back(flat: float) -> None:
    position, rotation = from_folds(random_folds(20_000, 2, flat))
    again = from_folds(to_folds(position, rotation))
    assert_allclose(again[0], position, rtol=0, atol=1e-12)
    assert_allclose(again[1], rotation, rtol=0, atol=1e-12)


def test_folds_that_are_flat_to_rounding_are_above_minus_a_half_turn() -> None:
    flat = np.round(random_folds(100_000, 5) / math.pi) * math.pi
    given = np.where(
        np.random.default_rng(5).random(flat.shape) < 0.4, flat, random_folds(100_000, 6)
    )
    given[:, :3] = random_folds(100_000, 6)[:, :3]
    position, rotation = from_folds(given)
    folds = to_folds(position, rotation)[:, 3:]
    assert (folds == math.pi).sum() > 1000
    assert (folds > -math.pi).all()
    assert (folds <= math.pi).all()


@pytest.mark.parametrize("turn", range(24))
def test_poses_of_lower_strata_come_back_with_the_chosen_coordinates(turn: int) -> None:
    rotation = QUARTER_TURNS[turn]
    places = np.array(
        [[0, 0, 0], [3, 0, 0], [-3, 0, 0], [0, 2, 0], [0, 0, -2], [1, 2, 0], [1, 2, 3]]
    )
    for position in places.astype(float):
        folds = to_folds(position, rotation)
        again = from_folds(folds)
        assert_allclose(again[0], position, rtol=0, atol=1e-14)
        assert_allclose(again[1], rotation, rtol=0, atol=1e-14)
        r, beta, epsilon, _, phi2, phi3 = folds
        if r == 0.0:
            assert beta == 0.0
        if math.sin(beta) < 1e-15:
            assert phi3 == 0.0
        if math.sin(epsilon) < 1e-15:
            assert phi2 == 0.0


def test_straight_line_between_poses_of_one_mode_keeps_every_margin_of_its_ends() -> None:
    lines, points = 10_000, 100
    folds = random_folds(2 * lines, 3).reshape(2, lines, 6)
    folds[1, :, 3:] = np.abs(folds[1, :, 3:]) * np.sign(folds[0, :, 3:])
    shares = np.linspace(0.0, 1.0, points)[:, None, None]
    along = folds[0] + shares * (folds[1] - folds[0])
    margin = np.abs(margins(*from_folds(along)))
    ends = np.minimum(margin[0], margin[-1])
    assert (margin >= ends - 1e-13).all()
    assert_array_equal(
        np.sign(margins_of(along)),
        np.broadcast_to(np.sign(folds[0, :, 3:]), along.shape[:-1] + (3,)),
    )


def test_lengths_follow_from_the_folds() -> None:
    design = PRESETS["paper-optimal"]
    folds = random_folds(1000, 4)
    joints = inverse(design, *from_folds(folds))
    r, beta, epsilon, phi1, phi2, phi3 = folds.T
    between = np.cos(beta) * np.cos(epsilon) - np.sin(beta) * np.sin(epsilon) * np.cos(phi2)
    (a3x, a3y), (b1x, b1y) = design.a3, design.b1
    expected = [
        np.sqrt(
            r**2
            + b1x**2
            + b1y**2
            + 2 * r * (b1x * np.cos(epsilon) - b1y * np.sin(epsilon) * np.cos(phi1))
        ),
        r * np.cos(beta) + design.b2 * between,
        np.hypot(joints[:, 1], joints[:, 2]),
        r * np.cos(beta) + design.b3 * between,
        np.hypot(joints[:, 3], joints[:, 4]),
        np.sqrt(
            r**2
            + a3x**2
            + a3y**2
            - 2 * r * (a3x * np.cos(beta) + a3y * np.sin(beta) * np.cos(phi3))
        ),
    ]
    for index in (0, 1, 3, 5):
        assert_allclose(joints[:, index], expected[index], rtol=0, atol=1e-12)
    for b, index in ((design.b2, 2), (design.b3, 4)):
        assert_allclose(expected[index] ** 2, r**2 + b**2 + 2 * r * b * np.cos(epsilon), rtol=1e-12)


def test_folds_are_zero_on_the_sides_that_are_named() -> None:
    """φ3 towards the base's y, φ1 with a1 on the side of the platform's y, φ2 with β + ε."""
    position, rotation = from_folds([5.0, 1.0, 1.2, 0.0, 0.0, 0.0])
    assert position[1] > 0.0 == position[2]
    assert rotation[:, 1] @ -position > 0.0
    assert_allclose(rotation[0, 0], math.cos(1.0 + 1.2), rtol=1e-15)


@pytest.mark.parametrize("name", list(PRESETS))
def test_joints_near_walls_that_are_told_to_close_are_those_of_the_poses(name: str) -> None:
    """Also where d2 and d4 are short, and a difference of their squares is small as well."""
    design, rng = PRESETS[name], np.random.default_rng(6)
    count = 50_000
    folds = np.abs(random_folds(count, 7))
    near = np.where(rng.random((count, 5)) < 0.5, 10.0 ** rng.uniform(-9, -1, (count, 5)), 1.0)
    folds[:, 1:] *= near
    folds[:, 1:] = np.where(rng.random((count, 5)) < 0.5, math.pi - folds[:, 1:], folds[:, 1:])
    joints = inverse(design, *from_folds(folds))
    off = joints + 10.0 ** rng.uniform(-14, -4, (count, 1)) * rng.normal(size=(count, 6))
    # Lengths stay positive, carriages where they are.
    off[:, LENGTHS] = np.abs(off[:, LENGTHS])
    found = forward(design, off)
    closing = found.feasible
    assert 0.3 < closing.mean() < 0.9
    again = inverse(design, found.position[closing], found.rotation[closing])
    # Near several walls the square root of a rounding error is lost.
    expected = np.broadcast_to(off[closing, None], again.shape)
    assert_allclose(again, expected, atol=5e-7 * design.reach)
    l1, l4 = 5.823194897943329, 20.377205114955085
    d1, d3, d2, d4 = (
        2.6546564093549114,
        4.957346548482986,
        4.0106217088879415e-4,
        7.990750078334867e-4,
    )
    short = forward(PRESETS["paper-optimal"], [l1, d1, d2, d3, d4, l4])
    assert not short.feasible


def test_unusable_folds_are_refused() -> None:
    assert "shape" in refusal(from_folds, [1.0, 2.0])
    assert "finite" in refusal(from_folds, [1.0, 1.0, 1.0, math.nan, 1.0, 1.0])
    assert "distance r must not be negative" in refusal(from_folds, [-1.0, 1.0, 1.0, 1.0, 1.0, 1.0])
