"""Identification of a machine: what it finds, what it cannot see, and what changes nothing."""

from __future__ import annotations

from dataclasses import replace

import msgspec
import numpy as np
import pytest
from measured_machines import (
    BAR,
    ELSEWHERE,
    GAUGE,
    MICROMETRE,
    PLACES,
    POSES,
    TARGETS,
    TYPICAL,
    WALLS,
    Session,
    design_itself,
    rms,
    tool_errors,
    true_machine,
    with_errors,
)
from numpy.testing import assert_allclose
from refusals import refusal
from scipy.spatial.transform import Rotation

from explorer import (
    PRESETS,
    BuiltMachine,
    Configuration,
    Measurement,
    NoAnswerError,
    Pose,
    calibrate,
    calibration_poses,
)
from explorer.calibration.identify import Loss
from explorer.calibration.poses import sample_poses
from explorer.calibration.unseen import frame_motions
from explorer.mechanism.built_machine import COUNT
from explorer.mechanism.design import VARIABLES
from explorer.mechanism.machine import GUIDE, PLATFORM
from explorer.mechanism.margins import margins
from explorer.numerics.arrays import FloatArray
from explorer.statics.accuracy import (
    IS_TILT,
    SOURCES,
    UNIFORM,
    error_by_source,
    source_errors,
    stated_tolerances,
)

RANDOM = sample_poses(TYPICAL, 30, seed=3)
CHOSEN = calibration_poses(TYPICAL, 30, POSES)
SPREAD = UNIFORM * source_errors(TYPICAL)
ALONG_GUIDE = "guide x with d1 and d3"
BASE = tuple(f"base {motion}{axis}" for axis in "xyz" for motion in ("", "turn "))
PLATFORM_FRAME = tuple(f"platform {motion}{axis}" for axis in "xyz" for motion in ("", "turn "))


def test_tool_of_fifty_machines_errs_by_the_bound_where_nothing_was_measured() -> None:
    before, after, bound, told_before, told, excess = (list[float]() for _ in range(6))
    tool = error_by_source(ELSEWHERE)[:, :3]
    for seed in range(50):
        session = Session.of(POSES, sample_poses(TYPICAL, 30, seed=seed), seed)
        found = calibrate(TYPICAL, session.readings, session.measured)
        assert found.seen == 30
        assert found.unseen == (ALONG_GUIDE,)
        assert not len(found.outliers)
        before.append(rms(tool_errors(session.machine, design_itself())))
        after.append(rms(tool_errors(session.machine, found.machine)))
        told_before.append(found.tool_before * TYPICAL.unit_mm)
        told.append(found.tool_after * TYPICAL.unit_mm)
        variances = np.einsum("kij,jl,kil->k", tool, found.covariance, tool)
        bound.append(float(np.sqrt(variances.mean())) * TYPICAL.unit_mm)
        excess.append(found.excess)
    # The Cramér–Rao bound is that of the linear model with the prior.
    assert 0.9 * rms(bound) < rms(after) < 1.05 * rms(bound)
    assert rms(after) < 0.01
    assert rms(before) > 0.99
    # Over other random poses the errors are much the same.
    assert rms(told) == pytest.approx(rms(bound), rel=0.2)
    assert rms(told_before) == pytest.approx(rms(before), rel=0.2)
    # The sum of squares is as large as it should be.
    assert abs(np.mean(excess)) < 0.4
    assert 0.7 < np.std(excess) < 1.3


def test_deviations_err_by_their_covariance() -> None:
    squares: list[float] = []
    for seed in range(20):
        session = Session.of(POSES, CHOSEN, seed)
        found = calibrate(TYPICAL, session.readings, session.measured)
        off = (found.machine.deviations - session.machine.deviations) / SPREAD
        covariance = found.covariance / np.outer(SPREAD, SPREAD)
        squares.append(float(off @ np.linalg.solve(covariance, off)))
    # Six standard deviations of the mean of 20 sums of 31 squares.
    assert abs(np.mean(squares) - COUNT) < 6.0 * np.sqrt(2.0 * COUNT / 20.0)


PRECISE = replace(BAR, sigma=np.array(MICROMETRE))


@pytest.mark.parametrize(
    ("kind", "count", "unseen"),
    [
        (POSES, 30, (ALONG_GUIDE,)),
        (replace(TARGETS, points_known=True), 30, (ALONG_GUIDE,)),
        (TARGETS, 30, (ALONG_GUIDE, *PLATFORM_FRAME)),
        (
            replace(TARGETS, values=np.zeros((0, 3)), points=PLACES[:1]),
            40,
            (ALONG_GUIDE, *PLATFORM_FRAME),
        ),
        (replace(POSES, in_base=False), 30, (ALONG_GUIDE, *BASE)),
        (replace(TARGETS, in_base=False), 30, (ALONG_GUIDE, *BASE, *PLATFORM_FRAME)),
        (PRECISE, 100, (ALONG_GUIDE, *BASE, *PLATFORM_FRAME)),
        (GAUGE, 100, (ALONG_GUIDE, *BASE, *PLATFORM_FRAME)),
        (WALLS, 120, (ALONG_GUIDE, *BASE, *PLATFORM_FRAME)),
    ],
)
def test_kinds_of_measurement_see_all_but_what_is_named(
    kind: Measurement, count: int, unseen: tuple[str, ...]
) -> None:
    poses = calibration_poses(TYPICAL, count, kind)
    if not kind.in_base:
        turn = Rotation.from_rotvec([1.0, 2.0, -0.5]).as_matrix()
        machine = true_machine(np.random.default_rng(2))
        session = moved_session(kind, poses, machine, turn, np.array([300.0, -40.0, 20.0]))
    else:
        session = Session.of(kind, poses, 2)
    found = calibrate(TYPICAL, session.readings, session.measured)
    assert set(found.unseen) == set(unseen)
    assert found.seen == COUNT - len(unseen)
    assert abs(found.excess) < 3.0
    # But for the frames, the tool is where the machine that was found has it.
    frames = np.array(
        [motion for name, motion in frame_motions(TYPICAL, POSES).items() if name in unseen]
    )
    off = relative_errors(session.machine, found.machine, frames)
    assert rms(off) < 1.8 * found.tool_after
    assert found.tool_after < 30.0 * MICROMETRE
    assert found.tool_before > 20.0 * found.tool_after


def moved_session(
    kind: Measurement,
    poses: Configuration,
    machine: BuiltMachine,
    turn: FloatArray,
    shift: FloatArray,
) -> Session:
    """Return a session measured in a frame that is moved from the base's."""
    session = Session.of(replace(kind, in_base=True), poses, 2, machine)

    def move(measured: Measurement) -> Measurement:
        values = measured.values.copy()
        size = values.shape[1] if kind.kind == "targets" else 3
        points = values[:, :size].reshape(len(values), -1, 3) @ turn.T + shift
        values[:, :size] = points.reshape(len(values), -1)
        if kind.kind == "poses":
            vectors = Rotation.from_rotvec(values[:, 3:])
            values[:, 3:] = (Rotation.from_matrix(turn) * vectors).as_rotvec()
        return replace(measured, values=values, in_base=kind.in_base)

    return replace(session, exact=move(session.exact), measured=move(session.measured))


def relative_errors(true: BuiltMachine, found: BuiltMachine, frames: FloatArray) -> FloatArray:
    """Return how far tools of two machines are apart, in units, but for motions of frames."""
    tool = error_by_source(ELSEWHERE)
    reached = true.forward(found.inverse(ELSEWHERE.position, ELSEWHERE.rotation))
    turns = Rotation.from_matrix(reached.rotation @ np.swapaxes(ELSEWHERE.rotation, 1, 2))
    off = np.concatenate([reached.position - ELSEWHERE.position, turns.as_rotvec()], axis=1)
    by_frames = tool[:, :3] @ frames.T
    fit = np.linalg.lstsq(by_frames.reshape(-1, len(frames)), off[:, :3].ravel(), rcond=None)[0]
    return np.linalg.norm(off[:, :3] - by_frames @ fit, axis=1)


def test_wrong_lines_are_found_by_their_numbers() -> None:
    losses: tuple[Loss, Loss] = "cauchy", "linear"
    errors = {loss: list[float]() for loss in losses}
    for seed in range(10):
        session = Session.of(POSES, CHOSEN, seed)
        rng = np.random.default_rng(100 + seed)
        wrong = np.sort(rng.choice(30, 3, replace=False))
        values, off = session.measured.values.copy(), rng.normal(size=(3, 3))
        # A millimetre is a tenth of a unit.
        values[wrong, :3] += 0.1 * off / np.linalg.norm(off, axis=1, keepdims=True)
        measured = replace(session.measured, values=values)
        for loss in losses:
            one = calibrate(TYPICAL, session.readings, measured, loss=loss)
            errors[loss].append(rms(tool_errors(session.machine, one.machine)))
            assert one.outliers.tolist() == (wrong.tolist() if loss == "cauchy" else [])
            assert (one.excess > 100.0) == (loss == "linear")
    assert rms(errors["cauchy"]) < 0.008
    assert rms(errors["linear"]) > 0.05


@pytest.mark.parametrize("kind", [POSES, replace(TARGETS, points_known=True)])
def test_noise_free_data_give_the_machine_but_for_what_changes_no_pose(kind: Measurement) -> None:
    session = Session.of(kind, RANDOM, 5)
    exact = replace(session.exact, sigma=1e-6 * kind.sigma)
    found = calibrate(TYPICAL, session.readings, exact).machine
    assert tool_errors(session.machine, found).max() < 1e-9
    # The guide of the machine that was found starts elsewhere on the true one.
    off = session.machine.deviations - found.deviations
    off[6:][GUIDE] += off[1] * found.turns[1][:, 0]
    off[[1, 3]] -= off[1]
    assert_allclose(off, 0.0, atol=1e-10)


def test_moved_frame_of_measurement_changes_nothing_but_the_frame() -> None:
    machine = true_machine(np.random.default_rng(7))
    turn = Rotation.from_rotvec([0.4, -2.0, 1.0]).as_matrix()
    for kind, poses in ((POSES, RANDOM), (TARGETS, RANDOM)):
        free = replace(kind, in_base=False)
        here, there = (
            moved_session(free, poses, machine, each, shift)
            for each, shift in ((np.eye(3), np.zeros(3)), (turn, np.array([50.0, -700.0, 9.0])))
        )
        found = [calibrate(TYPICAL, each.readings, each.measured) for each in (here, there)]
        first, second = (each.machine.deviations for each in found)
        assert_allclose(second, first, atol=1e-7)
        assert found[0].seen == found[1].seen
        assert found[1].chi_square == pytest.approx(found[0].chi_square, rel=1e-5)


def test_small_motion_of_the_base_frame_changes_the_numbers_of_the_frame_alone() -> None:
    machine = true_machine(np.random.default_rng(7))
    turn, shift = Rotation.from_rotvec([3e-4, -2e-4, 4e-4]).as_matrix(), np.array([3e-3, 0.0, 5e-3])
    sessions = [
        moved_session(POSES, RANDOM, machine, *motion)
        for motion in ((np.eye(3), np.zeros(3)), (turn, shift))
    ]
    precise = [replace(each.exact, sigma=1e-4 * POSES.sigma) for each in sessions]
    first, second = (
        calibrate(TYPICAL, session.readings, measured).machine
        for session, measured in zip(sessions, precise, strict=True)
    )
    # In the moved frame the second machine has the poses of the first.
    positions, rotations = RANDOM.position @ turn.T + shift, turn @ RANDOM.rotation
    expected = first.inverse(RANDOM.position, RANDOM.rotation)
    assert_allclose(second.inverse(positions, rotations), expected, atol=1e-9)
    off = second.deviations - first.deviations
    motions = frame_motions(TYPICAL, POSES)
    frames = np.array([motions[name] for name in (ALONG_GUIDE, *BASE)])
    rest = off - np.linalg.lstsq(frames.T, off, rcond=None)[0] @ frames
    assert np.abs(off).max() > 5e-3
    assert np.abs(rest).max() < 1e-5
    assert_allclose(off[6:][PLATFORM], 0.0, atol=1e-5)


def test_order_of_the_lines_does_not_count() -> None:
    session = Session.of(POSES, RANDOM, 1)
    order = np.random.default_rng(0).permutation(30)
    values = session.measured.values.copy()
    values[7, 0] += 1.0
    found = calibrate(TYPICAL, session.readings, replace(session.measured, values=values))
    measured = replace(session.measured, values=values[order])
    other = calibrate(TYPICAL, session.readings[order], measured)
    assert_allclose(other.machine.deviations, found.machine.deviations, atol=1e-9)
    assert order[other.outliers].tolist() == found.outliers.tolist() == [7]


def test_unit_of_the_design_does_not_count() -> None:
    session = Session.of(TARGETS, RANDOM, 1)
    times = 10.0
    box = tuple(tuple(times * x for x in end) for end in TYPICAL.limits.box or ())
    small = msgspec.structs.replace(
        TYPICAL.with_variables([times * x for x in TYPICAL.variables]).with_limits(box=box),
        unit_mm=TYPICAL.unit_mm / times,
        home=Pose.of(times * np.array(TYPICAL.home_pose.position), TYPICAL.home_pose.rotation),
    )
    measured = session.measured
    scaled = replace(
        measured,
        values=times * measured.values,
        sigma=times * measured.sigma,
        points=times * measured.points,
    )
    found = calibrate(TYPICAL, session.readings, measured)
    other = calibrate(small, times * session.readings, scaled)
    sizes = np.where(IS_TILT, 1.0, times)
    assert_allclose(other.machine.deviations, sizes * found.machine.deviations, atol=1e-7)
    assert other.seen == found.seen
    assert other.tool_after == pytest.approx(times * found.tool_after, rel=1e-6)


def test_mirrored_machine_has_mirrored_deviations() -> None:
    mirror = np.diag([1.0, -1.0, 1.0])
    flipped = [
        -value if name.endswith("y") else value
        for name, value in zip(VARIABLES, TYPICAL.variables, strict=True)
    ]
    home = TYPICAL.home_pose
    design = msgspec.structs.replace(
        TYPICAL.with_variables(flipped).with_limits(box=None),
        home=Pose.of(mirror @ home.position, mirror @ home.rotation @ mirror),
    )
    session = Session.of(POSES, RANDOM, 1)
    values = session.measured.values.copy()
    turns = mirror @ Rotation.from_rotvec(values[:, 3:]).as_matrix() @ mirror
    values[:, :3] = values[:, :3] @ mirror
    values[:, 3:] = Rotation.from_matrix(turns).as_rotvec()
    found = calibrate(TYPICAL, session.readings, session.measured).machine.deviations
    measured = replace(session.measured, values=values)
    other = calibrate(design, session.readings, measured).machine.deviations
    # Lengths along y change their signs, and so do turns about z.
    odd = [
        name.endswith("z" if is_tilt else "y")
        for name, is_tilt in zip(SOURCES, IS_TILT, strict=True)
    ]
    assert sum(odd) == 8
    assert_allclose(other, np.where(odd, -found, found), atol=1e-9)


def test_poses_in_which_the_design_does_not_close_count_in_the_end() -> None:
    rng = np.random.default_rng(5)
    machine = true_machine(rng)
    low, high = TYPICAL.limits.box or ((0.0,) * 3,) * 2
    positions = rng.uniform(low, high, (40_000, 3))
    turns = Rotation.from_rotvec(0.7 * rng.normal(size=(40_000, 3))).as_matrix()
    rotations = turns @ TYPICAL.home_pose.rotation
    deltas = margins(positions, rotations)
    near = np.abs(deltas).min(axis=1) * TYPICAL.unit_mm
    own = (np.sign(deltas) == TYPICAL.home_signs).all(axis=1) & (near > 8.0) & (near < 12.0)
    positions, rotations = positions[own][:60], rotations[own][:60]
    readings = machine.inverse(positions, rotations)
    closes = design_itself().forward(readings).closes
    assert 5 < (~closes).sum() < 30
    exact = replace(POSES, values=POSES.model(positions, rotations, np.zeros(0)))
    found = calibrate(TYPICAL, readings, with_errors(exact, rng))
    assert not len(found.outliers)
    assert np.isfinite(found.residuals).all()
    assert rms(tool_errors(machine, found.machine)) < 0.01


@pytest.mark.parametrize("kind", [TARGETS, POSES, replace(POSES, in_base=False)])
def test_poses_that_cannot_close_and_values_that_are_missing_are_left_out(
    kind: Measurement,
) -> None:
    session = Session.of(kind, RANDOM, 1)
    readings, values = session.readings.copy(), session.measured.values.copy()
    readings[4, 5] += 30.0
    values[9, 3:] = np.nan
    values[11] = np.nan
    measured = replace(session.measured, values=values)
    found = calibrate(TYPICAL, readings, measured)
    assert found.outliers.tolist() == [4]
    width = values.shape[1]
    assert np.isnan(found.residuals).sum() == 3 * width - 3
    assert found.degrees_of_freedom == 27 * width + 3 - kind.unknowns - found.seen
    keep = np.setdiff1d(np.arange(30), [4, 11])
    other = calibrate(TYPICAL, readings[keep], replace(measured, values=values[keep]))
    assert_allclose(other.machine.deviations, found.machine.deviations, atol=1e-7)


def test_deviations_without_a_tolerance_are_zero_and_named_as_nothing() -> None:
    session = Session.of(POSES, RANDOM, 1)
    tolerances = stated_tolerances(TYPICAL)
    fixed = [SOURCES.index(name) for name in ("l1", "guide x", "b2y", "strut 2 tilt")]
    tolerances[fixed] = 0.0
    found = calibrate(TYPICAL, session.readings, session.measured, tolerances)
    assert (found.machine.deviations[fixed] == 0.0).all()
    assert (found.covariance[fixed] == 0.0).all()
    # The carriages no longer slide with the guide, so that all that is left is seen.
    assert found.unseen == ()
    assert found.seen == COUNT - 4


def test_few_poses_name_what_would_have_to_be_known() -> None:
    precise = replace(POSES, sigma=1e-3 * POSES.sigma)
    session = Session.of(precise, sample_poses(TYPICAL, 4, seed=3), 1)
    found = calibrate(TYPICAL, session.readings, session.measured)
    assert found.seen == 24
    named = [name for name in found.unseen if name != ALONG_GUIDE]
    assert len(named) == COUNT - 1 - found.seen
    assert set(named) < set(SOURCES)
    # With these known, all is seen.
    tolerances = stated_tolerances(TYPICAL)
    tolerances[[SOURCES.index(name) for name in named]] = 0.0
    assert calibrate(TYPICAL, session.readings, session.exact, tolerances).unseen == (ALONG_GUIDE,)


@pytest.mark.parametrize("kind", [POSES, TARGETS, replace(BAR, sigma=TARGETS.sigma)])
@pytest.mark.parametrize("size", [0.3, 100.0])
def test_one_pose_that_is_grossly_wrong_is_left_out(kind: Measurement, size: float) -> None:
    session = Session.of(kind, CHOSEN, 4)
    values = session.measured.values.copy()
    values[5, 0] += size
    if kind.kind == "poses":
        values[5, 3:] = [0.0, 0.5 * np.pi, 0.0]
    found = calibrate(TYPICAL, session.readings, replace(session.measured, values=values))
    assert found.outliers.tolist() == [5]
    assert found.gains


def test_platform_that_turns_about_a_known_point_is_no_lack_of_poses() -> None:
    kind = replace(TARGETS, values=np.zeros((0, 3)), points=PLACES[:1], points_known=True)
    session = Session.of(kind, calibration_poses(TYPICAL, 40, kind), 1)
    found = calibrate(TYPICAL, session.readings, session.measured)
    assert found.faults == []
    assert found.unseen == (ALONG_GUIDE, *(f"platform turn {axis}" for axis in "xyz"))


def test_zero_beyond_its_tolerance_is_identified_and_told() -> None:
    session = Session.of(POSES, CHOSEN, 1)
    readings = session.readings.copy()
    readings[:, 0] -= 0.1
    found = calibrate(TYPICAL, readings, session.measured)
    assert found.faults == []
    assert found.beyond == ["l1"]
    off = found.machine.deviations[0] - session.machine.deviations[0] - 0.1
    # The tolerance pulls it back by a hundredth.
    assert abs(off) < 0.002


@pytest.mark.parametrize("kind", [TARGETS, PRECISE, WALLS])
def test_setup_may_be_stated_roughly(kind: Measurement) -> None:
    session = Session.of(kind, calibration_poses(TYPICAL, 100, kind), 2)
    found = calibrate(TYPICAL, session.readings, session.measured)
    rng = np.random.default_rng(0)
    rough = replace(
        session.measured,
        points=kind.points + rng.normal(size=kind.points.shape),
        base=kind.base + 0.1 * rng.normal(size=kind.base.shape),
    )
    other = calibrate(TYPICAL, session.readings, rough)
    assert other.chi_square == pytest.approx(found.chi_square, rel=1e-6)
    assert other.seen == found.seen
    assert_allclose(other.machine.deviations, found.machine.deviations, atol=1e-5)
    places = kind.points + found.unknowns[: kind.points.size].reshape(-1, 3)
    again = rough.points + other.unknowns[: kind.points.size].reshape(-1, 3)
    assert_allclose(again, places, atol=1e-4)


def test_unusable_measurements_are_refused() -> None:
    session = Session.of(POSES, RANDOM, 1)
    few = session.readings[:4]
    assert "got the shape (4, 6)" in refusal(calibrate, TYPICAL, few, session.measured)
    exact = PRESETS["paper-optimal"]
    given = exact, session.readings, session.measured
    assert "no deviation has a tolerance" in refusal(calibrate, *given)
    assert "must not be negative" in refusal(calibrate, *given, np.full(COUNT, -1.0))
    with pytest.raises(NoAnswerError, match="close in none of the poses"):
        calibrate(TYPICAL, 10.0 * session.readings, session.measured)
    assert "one for each pose" in refusal(Measurement, "bar", np.zeros(3), np.array(1.0))
    assert "rows of 6 numbers" in refusal(Measurement, "poses", np.zeros((3, 7)), np.array(1.0))
    assert "for each value" in refusal(Measurement, "poses", np.zeros((3, 6)), np.ones(2))
    one = replace(session.measured, values=session.measured.values[:1], in_base=False)
    assert "placed by three" in refusal(calibrate, TYPICAL, session.readings[:1], one)
    assert "must be positive" in refusal(Measurement, "bar", np.zeros((3, 1)), np.array(0.0))
