"""Errors of the tool: the reference, all corners, random errors, other dimensions."""

from __future__ import annotations

import itertools

import msgspec
import numpy as np
import pytest
from numpy.testing import assert_allclose
from refusals import refusal
from scipy.optimize import root
from scipy.spatial.transform import Rotation
from statics_cases import CASES, random_poses

from explorer import (
    PRESETS,
    Actuators,
    InputError,
    Struts,
    Tolerances,
    compliance,
    error_by_actuator,
    errors_alone,
    forward,
    home_pose,
    inverse,
    margins,
    pose_error_by_geometry,
    pose_precision,
    rms_error,
    source_errors,
    worst_error,
)
from explorer.mechanism.machine import DIMENSIONS
from explorer.mechanism.margins import mode_of
from explorer.numerics.arrays import FloatArray
from explorer.statics.compliance import stiffness_of
from explorer.statics.equilibrium import twists_of_actuators
from explorer.statics.error_sources import by_source

OPTIMAL = PRESETS["paper-optimal"]
ERRORS = np.array([0.01, 0.02, 0.015, 0.005, 0.02, 0.01])
TOOL = np.array([0.5, -0.3, 1.5])


def test_errors_of_reference_are_those_of_the_reference() -> None:
    for case in CASES:
        worst = worst_error(*case.pose, case.actuator_errors, case.tool)
        assert_allclose(worst, (case.worst_displacement, case.worst_turn), rtol=1e-9)
        found = pose_error_by_geometry(*case.pose, case.tool)
        expected = case.pose_error_by_geometry
        assert_allclose(found, expected, atol=1e-9 * np.abs(expected).max())


def test_worst_error_is_the_largest_of_all_corners() -> None:
    positions, rotations = random_poses(OPTIMAL, 40)
    worst = worst_error(OPTIMAL, positions, rotations, ERRORS, TOOL)
    corners = ERRORS * np.array(list(itertools.product((-1.0, 1.0), repeat=6)))
    twists = np.einsum(
        "nij,cj->nci", twists_of_actuators(OPTIMAL, positions, rotations, TOOL), corners
    )
    for half, found in ((slice(0, 3), worst.displacement), (slice(3, 6), worst.turn)):
        assert_allclose(np.linalg.norm(twists[..., half], axis=-1).max(axis=1), found, rtol=1e-12)
    alone = error_by_actuator(OPTIMAL, positions, rotations, ERRORS, TOOL)
    assert (alone.displacement.sum(axis=1) >= worst.displacement * (1.0 - 1e-12)).all()
    assert (alone.turn.max(axis=1) <= worst.turn * (1.0 + 1e-12)).all()


@pytest.mark.parametrize("seed", range(2))
def test_errors_bound_40000_poses_of_forward_kinematics_to_the_second_order(seed: int) -> None:
    rng = np.random.default_rng(seed)
    (position,), (rotation,) = random_poses(OPTIMAL, 1, seed, margin=0.2)
    tool = rng.uniform(-0.2, 0.2, 3) * OPTIMAL.reach
    held, mode = inverse(OPTIMAL, position, rotation), int(mode_of(margins(position, rotation)))
    largest = 1e-4 * OPTIMAL.reach * rng.uniform(0.5, 1.0, 6)
    # Every error comes with its opposite, and the corners are among them.
    corners = np.array(list(itertools.product((-1.0, 1.0), repeat=6)))[:32]
    signs = np.concatenate([corners, rng.uniform(-1.0, 1.0, (20_000 - len(corners), 6))])

    def moved(errors: FloatArray) -> tuple[FloatArray, FloatArray]:
        found = forward(OPTIMAL, held + errors)
        turned = found.rotation[:, mode]
        at = found.position[:, mode] + turned @ tool
        turn = Rotation.from_matrix(turned @ rotation.T).as_rotvec()
        return at - position - rotation @ tool, turn

    def odd_and_even(size: float) -> list[tuple[FloatArray, FloatArray]]:
        ends = zip(moved(size * signs * largest), moved(-size * signs * largest), strict=True)
        return [(0.5 * (high - low), 0.5 * (high + low)) for high, low in ends]

    given = OPTIMAL, position, rotation
    worst, rms = (each(*given, largest, tool) for each in (worst_error, rms_error))
    for bound, mean, whole, half in zip(
        worst, rms, odd_and_even(1.0), odd_and_even(0.5), strict=True
    ):
        odd, even = (np.linalg.norm(each, axis=1) for each in whole)
        assert even.max() < 0.05 * bound
        # Without the part of the second order no sample exceeds the worst, but for the third
        # order, and a corner reaches it.
        assert odd.max() == pytest.approx(bound, rel=5.0 * float(even.max() / bound) ** 2)
        # That part falls by four when the errors halve, so that the model is exact to first order.
        assert_allclose(np.linalg.norm(half[1], axis=1).max(), 0.25 * even.max(), rtol=1e-3)
        squares = [((whole[0] + sign * whole[1]) ** 2).sum(axis=1) for sign in (1.0, -1.0)]
        # Errors of equal chance within ± e.
        assert np.sqrt(np.mean(squares)) == pytest.approx(mean, rel=0.01)


def joints_of(dimensions: FloatArray, position: FloatArray, rotation: FloatArray) -> FloatArray:
    """Return the joints of a machine whose dimensions deviate, in the order of `DIMENSIONS`."""
    a1, a3, offset = dimensions[:3], dimensions[3:6], dimensions[6:9]
    # The exact turn of the guide, of which the model has the first order.
    turn = Rotation.from_rotvec([0.0, *dimensions[9:11]]).as_matrix()
    b1, b2, b3, b4 = (position + rotation @ row for row in dimensions[11:].reshape(4, 3))
    along = turn[:, 0]
    joints = [float(np.linalg.norm(b1 - a1))]
    for point in (b2, b3):
        from_guide = point - offset
        d = from_guide @ along
        joints += [d, float(np.linalg.norm(from_guide - d * along))]
    return np.array([*joints, float(np.linalg.norm(b4 - a3))])


@pytest.mark.parametrize("seed", range(3))
def test_error_by_geometry_is_that_of_a_machine_with_23_other_dimensions(seed: int) -> None:
    rng = np.random.default_rng(seed)
    (position,), (rotation,) = random_poses(OPTIMAL, 1, seed)
    tool = rng.uniform(-0.2, 0.2, 3) * OPTIMAL.reach
    nominal = np.zeros(23)
    nominal[3:5] = OPTIMAL.a3
    nominal[11:13] = OPTIMAL.b1
    nominal[14], nominal[17] = OPTIMAL.b2, OPTIMAL.b3
    held = joints_of(nominal, position, rotation)
    found = pose_error_by_geometry(OPTIMAL, position, rotation, tool)

    def moved(errors: FloatArray) -> FloatArray:
        """Return the twist that meets the loop equations with other dimensions."""

        def unmet(twist: FloatArray) -> FloatArray:
            turn = Rotation.from_rotvec(twist[3:]).as_matrix() @ rotation
            place = position + rotation @ tool + twist[:3] - turn @ tool
            return joints_of(nominal + errors, place, turn) - held

        solved = root(unmet, np.zeros(6), tol=1e-15)
        assert np.abs(solved.fun).max() < 1e-12
        return np.asarray(solved.x)

    for _ in range(8):
        errors = rng.normal(size=23)
        errors *= 1e-2 / np.abs(found @ errors).max()
        # What the linear model lacks falls by four when all errors halve.
        lack = [moved(size * errors) - found @ (size * errors) for size in (1.0, 0.5)]
        size = np.abs(lack[0]).max()

        assert 1e-8 < size < 1e-2
        assert_allclose(lack[1], 0.25 * lack[0], atol=0.01 * size)


def test_error_by_geometry_of_a_shift_of_the_whole_base_is_that_shift() -> None:
    positions, rotations = random_poses(OPTIMAL, 30)
    found = pose_error_by_geometry(OPTIMAL, positions, rotations, TOOL)
    scale = np.abs(found).max(axis=(1, 2))[:, None, None]
    base = found[..., 0:3] + found[..., 3:6] + found[..., 6:9]
    shift = np.concatenate([np.eye(3), np.zeros((3, 3))])
    assert (np.abs(base - shift) < 1e-12 * scale).all()
    # Points that move together on the platform leave the tool behind.
    platform = sum(found[..., start : start + 3] for start in (11, 14, 17, 20))
    behind = np.concatenate([-rotations, np.zeros_like(rotations)], axis=1)
    assert (np.abs(platform - behind) < 1e-12 * scale).all()


def test_precision_of_poses_is_that_of_the_single_functions() -> None:
    design = msgspec.structs.replace(
        OPTIMAL,
        actuators=Actuators(
            error_mm=(0.1, 0.2, 0.1, 0.2, 0.1, 0.05),
            stiffness_n_mm=(50.0, 60.0, 50.0, 60.0, 50.0, 40.0),
        ),
        struts=Struts(outer_mm=6.0, inner_mm=4.0),
        tolerances=Tolerances(a3=(0.1, 0.2, 0.0), guide_tilt_deg=(0.1, 0.0)),
    )
    positions, rotations = random_poses(design, 500)
    found = pose_precision(design, positions, rotations, TOOL)
    errors = np.array(design.actuators.error_mm) / design.unit_mm
    given = design, positions, rotations
    for each, function in (
        (found.worst, worst_error),
        (found.rms, rms_error),
        (found.by_actuator, error_by_actuator),
    ):
        assert_allclose(each, function(*given, errors, TOOL))
    assert_allclose(found.by_geometry, pose_error_by_geometry(*given, TOOL))
    assert_allclose(found.compliance, compliance(*given, *stiffness_of(design), TOOL))
    alone = errors_alone(by_source(found), source_errors(design))
    assert_allclose(alone.displacement[:, :6], found.by_actuator.displacement)
    assert_allclose(alone.turn[:, :6], found.by_actuator.turn)
    used = np.flatnonzero(alone.displacement[:, 6:].any(axis=0))
    assert [DIMENSIONS[index] for index in used] == ["a3x", "a3y", "guide tilt y"]


@pytest.mark.parametrize("count", [1, 600])
def test_errors_of_singular_pose_are_infinite(count: int) -> None:
    positions = np.resize([3.0, 4.0, 5.0], (count, 3))
    for function in (worst_error, rms_error, error_by_actuator):
        for error in function(OPTIMAL, positions, np.eye(3), ERRORS):
            assert (error == np.inf).all()
    assert (pose_error_by_geometry(OPTIMAL, positions, np.eye(3)) == np.inf).all()


def test_errors_of_unusable_arguments_are_refused() -> None:
    home = home_pose(OPTIMAL)
    given = OPTIMAL, home.position, home.rotation
    for errors in ([-1.0] * 6, [1.0] * 5, [np.nan] * 6, [np.inf] * 6):
        assert "six finite" in refusal(worst_error, *given, errors, kind=InputError)
    refusal(pose_error_by_geometry, *given, [1.0, 2.0], kind=InputError)
    none = worst_error(*given, np.zeros(6))
    assert (none.displacement, none.turn) == (0.0, 0.0)
