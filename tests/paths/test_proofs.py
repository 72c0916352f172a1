"""Straight lines in the folds within no limit but the margins, and near the walls of a mode."""

from __future__ import annotations

import numpy as np
import pytest
from limited_designs import limited
from numpy.testing import assert_array_equal

from explorer import PRESETS, Pose, from_folds, margins, rotation_from_quaternion, to_folds
from explorer.mechanism.margins import mode_of, signs_of
from explorer.numerics.arrays import FloatArray
from explorer.paths.crossings import path_margins
from explorer.paths.proofs import Proofs
from explorer.workspace.limits.valid_moves import moves_are_valid
from explorer.workspace.limits.valid_poses import Rules

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
