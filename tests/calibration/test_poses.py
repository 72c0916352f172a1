"""Poses in which to measure: within the limits, in which every machine closes, and well chosen."""

from __future__ import annotations

from dataclasses import replace

import msgspec
import numpy as np
import pytest
from measured_machines import (
    ELSEWHERE,
    POSES,
    TARGETS,
    TYPICAL,
    WALLS,
    Session,
    design_itself,
    rms,
    tool_errors,
    true_machine,
)
from refusals import refusal

from explorer import (
    Measurement,
    NoAnswerError,
    calibrate,
    calibration_poses,
    poses_are_valid,
)
from explorer.calibration.measurement import setup_of
from explorer.calibration.poses import sample_poses
from explorer.statics.accuracy import stated_tolerances
from explorer.statics.budget import with_tolerances


def test_sampled_poses_are_within_limits_and_let_every_machine_close() -> None:
    poses = sample_poses(TYPICAL, 300, seed=4)
    assert len(poses.positions) == 300
    assert poses_are_valid(TYPICAL, poses.position, poses.rotation).all()
    assert poses.inverse_condition.min() >= 0.01
    readings = design_itself().inverse(poses.position, poses.rotation)
    for seed in range(100):
        machine = true_machine(np.random.default_rng(seed))
        assert machine.forward(readings).closes.all()
    # Larger tolerances ask for larger margins.
    rough = sample_poses(with_tolerances(TYPICAL, 3.0 * stated_tolerances(TYPICAL)), 300, seed=4)
    assert np.abs(rough.margins).min() > 2.0 * np.abs(poses.margins).min()
    assert (sample_poses(TYPICAL, 300, seed=4).position == poses.position).all()


def test_setup_may_be_left_out_where_it_says_nothing() -> None:
    chosen = calibration_poses(TYPICAL, 6, POSES)
    assert (calibration_poses(TYPICAL, 6, "poses").position == chosen.position).all()
    assert len(calibration_poses(TYPICAL, 6, "gauge").position) == 6
    targets, bar = (refusal(calibration_poses, TYPICAL, 6, kind) for kind in ("targets", "bar"))
    assert "targets need a table of where they are" in targets
    assert "where the ball of the base is" in bar
    assert "at most 3; got 4" in refusal(setup_of, TYPICAL, "targets", np.eye(4, 3))


def test_eight_chosen_poses_are_better_than_eight_random_ones() -> None:
    chosen, drawn = list[float](), list[float]()
    poses = calibration_poses(TYPICAL, 8, POSES)
    for seed in range(20):
        for where, errors in ((poses, chosen), (sample_poses(TYPICAL, 8, seed=seed), drawn)):
            session = Session.of(POSES, where, seed)
            found = calibrate(TYPICAL, session.readings, session.measured)
            errors.append(rms(tool_errors(session.machine, found.machine)))
    assert rms(chosen) < 0.012
    assert rms(drawn) > 2.0 * rms(chosen)


@pytest.mark.parametrize("kind", [POSES, replace(TARGETS, points_known=True), WALLS])
def test_chosen_poses_are_distinct_and_of_no_worse_trace_than_others(kind: Measurement) -> None:
    count = 8 if kind.kind != "gauge" else 60
    poses = calibration_poses(TYPICAL, count, kind, seed=2)
    assert poses.position.shape == (count, 3)
    assert len(np.unique(poses.position, axis=0)) == count
    assert poses_are_valid(TYPICAL, poses.position, poses.rotation).all()
    session = Session.of(kind, poses, 0)
    best = calibrate(TYPICAL, session.readings, session.measured).tool_after
    for seed in range(3):
        other = Session.of(kind, sample_poses(TYPICAL, count, seed=seed), 0)
        assert calibrate(TYPICAL, other.readings, other.measured).tool_after > best


def test_exchange_leaves_no_pose_that_another_one_beats() -> None:
    from explorer.calibration.poses import CANDIDATES
    from explorer.statics.accuracy import UNIFORM, error_by_source, source_errors

    count, spread = 6, UNIFORM * source_errors(TYPICAL)
    found = sample_poses(TYPICAL, CANDIDATES, seed=0)
    tool = error_by_source(found)[:, :3] * spread
    rows = POSES.slopes(found.position, found.rotation, np.zeros(0)) / POSES.sigma[:, None]
    rows = rows @ (error_by_source(found) * spread)
    chosen = [
        int(np.flatnonzero((found.position == each).all(axis=1))[0])
        for each in calibration_poses(TYPICAL, count, POSES).position
    ]

    def loss(places: list[int]) -> float:
        own = rows[places].reshape(-1, 31)
        covariance = np.linalg.inv(np.eye(31) + own.T @ own)
        return float(np.einsum("kij,jl,kil->", tool, covariance, tool))

    best = loss(chosen)
    others = np.random.default_rng(0).choice(CANDIDATES, 60, replace=False).tolist()
    for k in range(count):
        for other in others:
            if other not in chosen:
                assert loss([*chosen[:k], other, *chosen[k + 1 :]]) > best * (1.0 - 1e-6)


def test_too_few_poses_are_refused() -> None:
    tight = TYPICAL.with_limits(box=((9.9, 4.9, 8.9), (10.0, 5.0, 9.0)), l1=(1.0, 1.1))
    home = sample_poses(tight, 10)
    assert (home.position == [TYPICAL.home_pose.position]).all()
    with pytest.raises(NoAnswerError, match="random poses 1 are within"):
        calibration_poses(tight, 5, POSES)
    assert "number of poses" in refusal(calibration_poses, TYPICAL, 0, POSES)
    without = msgspec.structs.replace(
        TYPICAL, limits=msgspec.structs.replace(TYPICAL.limits, box=None)
    )
    assert len(sample_poses(without, 50).position) == 50
    assert len(ELSEWHERE.position) == 200
