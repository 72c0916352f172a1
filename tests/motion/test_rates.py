"""Rates and accelerations of the joints, judged by differences along smooth motions."""

from __future__ import annotations

import numpy as np
import pytest
from numpy.testing import assert_allclose, assert_array_equal
from refusals import refusal
from smooth_motion import Motion, derivatives, random_motions
from statics_cases import CASES

from explorer import PRESETS, inverse, joint_accelerations, joint_rates
from explorer.numerics.arrays import FloatArray

OPTIMAL = PRESETS["paper-optimal"]


@pytest.mark.parametrize("case", range(12))
def test_joint_rates_and_accelerations_are_the_differences_along_a_motion(case: int) -> None:
    design = CASES[12 * case].pose[0]
    motions = random_motions(design, 20, case, rate=1.0)
    rates, accelerations = joint_rates(design, *motions[:3]), joint_accelerations(design, *motions)
    for rate, acceleration, motion in zip(rates, accelerations, motions.each(), strict=True):

        def joints(time: float, motion: Motion = motion) -> FloatArray:
            return inverse(design, *motion.pose_at(time))

        first, second = derivatives(joints)
        assert_allclose(rate, first, atol=1e-9 * design.reach)
        assert_allclose(acceleration, second, atol=1e-7 * np.abs(second).max())


def test_joint_accelerations_of_a_joint_without_length_are_zero() -> None:
    position, twist = (*OPTIMAL.a3, 0.0), np.ones(6)
    found = joint_accelerations(OPTIMAL, position, OPTIMAL.home_pose.rotation, twist, twist)
    assert np.isfinite(found).all()
    assert found[-1] == 0.0


def test_joint_rates_and_accelerations_broadcast_over_batches() -> None:
    positions, rotations, twists, accelerations = random_motions(OPTIMAL, 6, 1, rate=1.0)
    rates = joint_rates(OPTIMAL, positions[:, None], rotations[:, None], twists)
    found = joint_accelerations(
        OPTIMAL, positions[:, None, None], rotations[:, None, None], twists[:, None], accelerations
    )
    assert rates.shape == (6, 6, 6)
    assert found.shape == (6, 6, 6, 6)
    assert_array_equal(rates[2, 3], joint_rates(OPTIMAL, positions[2], rotations[2], twists[3]))
    one = joint_accelerations(OPTIMAL, positions[2], rotations[2], twists[3], accelerations[4])
    assert_allclose(found[2, 3, 4], one, rtol=1e-14, atol=1e-14)


@pytest.mark.parametrize("odd", [np.ones(5), np.full(6, np.nan), np.full(6, 1e30)])
def test_motion_that_is_not_six_usable_numbers_is_refused(odd: FloatArray) -> None:
    home = OPTIMAL.home_pose
    assert "twist" in refusal(lambda: joint_rates(OPTIMAL, home.position, home.rotation, odd))
    pose = OPTIMAL, home.position, home.rotation, np.zeros(6)
    assert "acceleration" in refusal(lambda: joint_accelerations(*pose, odd))
