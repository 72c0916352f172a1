"""Poses that are held out: a machine is kept only if it tells them better than the design."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest
from measured_machines import BAR, POSES, TARGETS, TYPICAL, Session, design_itself

from explorer import Measurement, calibrate, calibration_poses
from explorer.calibration.poses import sample_poses

RANDOM = sample_poses(TYPICAL, 30, seed=3)
FINE = replace(BAR, sigma=0.1 * BAR.sigma)


@pytest.mark.parametrize("kind", [POSES, TARGETS, replace(TARGETS, in_base=False)])
def test_machine_tells_poses_held_out_within_their_errors(kind: Measurement) -> None:
    session = Session.of(kind, RANDOM, 3)
    found = calibrate(TYPICAL, session.readings, session.measured)
    (before, off), (after, rest) = found.by_design, found.by_machine
    assert found.gains
    assert found.faults == []
    assert 0.8 < after < 1.5
    assert before > 20.0
    # Three errors of 10 µm, in units of 10 mm, and what a tool of this machine is off.
    assert 1e-3 < rest < 3e-3
    assert 0.02 < off < 0.5


@pytest.mark.parametrize(
    ("kind", "count"), [(POSES, 30), (POSES, 3), (POSES, 1), (TARGETS, 30), (FINE, 60)]
)
def test_machine_without_errors_gains_nothing_and_stays_the_design(
    kind: Measurement, count: int
) -> None:
    poses = calibration_poses(TYPICAL, count, kind)
    session = Session.of(kind, poses, 4, design_itself())
    found = calibrate(TYPICAL, session.readings, session.measured)
    assert not found.gains
    assert not found.machine.deviations.any()
    assert "nothing gained" in found.faults[0]


def test_coarse_lines_give_no_machine_that_is_worse_than_the_design() -> None:
    session, gains = Session.of(POSES, RANDOM, 3), list[bool]()
    for seed in range(6):
        errors = np.random.default_rng(seed).normal(size=(30, 6)) * [*3 * [0.2], *3 * [0.01]]
        coarse = replace(session.measured, values=session.measured.values + errors)
        found = calibrate(TYPICAL, session.readings, coarse)
        assert found.gains == bool(found.machine.deviations.any())
        assert found.excess > 3.0
        assert found.faults
        gains.append(found.gains)
    assert not all(gains)


def test_few_poses_and_sums_of_squares_are_faults_with_their_names() -> None:
    few = Session.of(POSES, sample_poses(TYPICAL, 5, seed=3), 3)
    (words,) = calibrate(TYPICAL, few.readings, few.measured).faults
    assert words.startswith("too few poses, or too coarse, to see ")
    assert "a3x" in words
    session = Session.of(POSES, RANDOM, 3)
    values = session.measured.values.copy()
    values[7, 0] += 6.0 * POSES.sigma[0]
    fine = replace(session.measured, values=values, sigma=POSES.sigma / 1.5)
    found = calibrate(TYPICAL, session.readings, fine, loss="linear")
    (words,) = found.faults
    assert found.excess > 3.0
    assert 7 in found.worst_poses
    assert " 8" in words
    assert words.startswith(f"χ² is {found.excess:.1f}σ above its expectation, most in poses ")
