"""The payload's force of any direction, beside forces of many directions one by one."""

from __future__ import annotations

import msgspec
import numpy as np
import pytest
from machines import FULL
from numpy.testing import assert_allclose, assert_array_equal

from explorer import (
    PRESETS,
    Actuators,
    Design,
    Payload,
    Pose,
    Tool,
    limit_shares,
    reactions,
    rotation_from_yaw_pitch_roll,
)
from explorer.mechanism.home import home_pose, home_signs
from explorer.mechanism.margins import margins
from explorer.numerics.arrays import FloatArray
from explorer.singularity.ellipsoids import planes_of_singularity
from explorer.statics.held import largest_shares, limit_values, load_case
from explorer.statics.reactions import part_limits
from explorer.statics.weights import design_weights

OPTIMAL = PRESETS["paper-optimal"]
ROTATION = home_pose(OPTIMAL).rotation


def loaded(force: float) -> Design:
    """Return a design with a payload that adds a force, and limits of all parts."""
    payload = msgspec.structs.replace(FULL.payload, force_n=force)
    return msgspec.structs.replace(FULL, payload=payload)


def positions(count: int) -> FloatArray:
    """Return regular positions in the mode of home, shape (count, 3)."""
    return np.random.default_rng(7).uniform((4, 1, 4), (16, 9, 14), (count, 3))


def shares(design: Design, at: FloatArray, load: FloatArray) -> FloatArray:
    """Return the shares of the limits under a load at the tool, besides the payload's weight."""
    weights = design_weights(design)
    held = reactions(design, at, ROTATION, load, design.tool.position, weights)
    return limit_shares(design, held)


def test_shares_are_the_largest_of_all_directions() -> None:
    at = positions(20)
    ours = shares(loaded(7.0), at, np.zeros(6))
    directions = np.random.default_rng(1).normal(size=(10_000, 3))
    directions /= np.linalg.norm(directions, axis=1, keepdims=True)
    loads = np.zeros((len(directions), 1, 6))
    loads[:, 0, :3] = 7.0 * directions
    sampled = shares(loaded(0.0), at, loads).max(axis=0)
    assert (sampled <= ours * (1.0 + 1e-12)).all()
    assert_allclose(sampled, ours, rtol=2e-3)


@pytest.mark.parametrize("force", [0.0, 7.0])
def test_kernel_of_regions_has_the_same_shares(force: float) -> None:
    design, at = loaded(force), positions(300)
    load = np.array([3.0, -2.0, 5.0, 10.0, -20.0, 5.0])
    expected = shares(design, at, load).max(axis=1)
    case = load_case(design, ROTATION, load)
    found, parts = largest_shares(case, ROTATION, at)
    assert_allclose(found, expected, rtol=1e-9)
    assert set(parts.tolist()) <= set(range(part_limits(design).shape[1]))
    least = limit_values(case, ROTATION, np.arange(20), at).min(axis=0)
    assert (np.abs(found - 1.0) > 1e-9).all()
    assert_array_equal(least > 0.0, found < 1.0)


def test_functions_of_limits_cross_a_singular_plane_without_fold_or_jump() -> None:
    """f(l4) grows towards δ3 = 0; without a moment about b4 f(l1) does not."""
    design = msgspec.structs.replace(
        loaded(0.0),
        tool=Tool(),
        payload=Payload(),
        actuators=Actuators(push_n=(15, 15, 15, 15, 15, 15)),
    )
    rotation = rotation_from_yaw_pitch_roll((-73.1, 40.0, 30.0))
    design = msgspec.structs.replace(design, home=Pose.of((10.0, 5.0, 9.0), rotation))
    case = load_case(design, rotation, np.array([3.0, -2.0, -10.0, 0.0, 0.0, 0.0]))
    heights = np.linspace(0.01, -0.01, 41)[:, None]

    def across(plane: int) -> FloatArray:
        """Return the functions along a line across a face of the home mode."""
        inward = planes_of_singularity(rotation)[plane] * home_signs(design)[plane]
        at = np.random.default_rng(2).uniform(-20.0, 20.0, (500, 3))
        at -= (at @ inward)[:, None] * inward
        depths = margins(at, rotation) * home_signs(design)
        depths[:, plane] = np.inf
        inner = at[depths.min(axis=1).argmax()]
        return limit_values(case, rotation, np.arange(20), inner + heights * inward)

    values = across(2)[[5, 15]]
    grows = values[values[:, 20].argmin()]
    assert grows[20] == pytest.approx(-1.0, abs=1e-6)
    assert (np.diff(grows) < 1e-12).all()
    values = across(0)
    assert values[[0, 10]] == pytest.approx(1.0, abs=1e-6)
    assert values.min() > -1.0
    assert np.abs(np.diff(values, n=2)).max() < 1e-4
