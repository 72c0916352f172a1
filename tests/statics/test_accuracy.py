"""Errors of the tool: the reference, all corners, Monte Carlo, perturbed dimensions."""

from __future__ import annotations

import itertools

import msgspec
import numpy as np
import pytest
from numpy.testing import assert_allclose
from refusals import refusal
from scipy.optimize import least_squares
from scipy.spatial.transform import Rotation
from statics_cases import CASES, Loaded, random_poses

from explorer import (
    PRESETS,
    Actuators,
    InputError,
    Struts,
    Tolerances,
    compliance,
    error_by_actuator,
    geometry_error,
    home_pose,
    pose_error_by_geometry,
    pose_precision,
    rms_error,
    worst_error,
)
from explorer.mechanism.machine import DIMENSIONS
from explorer.numerics.arrays import FloatArray
from explorer.statics.compliance import stiffness_of
from explorer.statics.equilibrium import twists_of_actuators

OPTIMAL = PRESETS["paper-optimal"]
ERRORS = np.array([0.01, 0.02, 0.015, 0.005, 0.02, 0.01])
TOOL = np.array([0.5, -0.3, 1.5])


@pytest.mark.parametrize("case", CASES)
def test_errors_of_reference_are_those_of_the_reference(case: Loaded) -> None:
    worst = worst_error(*case.pose, case.actuator_errors, case.tool)
    assert float(worst.displacement) == pytest.approx(float(case.worst_displacement), rel=1e-9)
    assert float(worst.turn) == pytest.approx(float(case.worst_turn), rel=1e-9)
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


def test_rms_error_is_that_of_random_errors() -> None:
    positions, rotations = random_poses(OPTIMAL, 5)
    rms = rms_error(OPTIMAL, positions, rotations, ERRORS, TOOL)
    drawn = np.random.default_rng(3).normal(size=(100_000, 6)) * ERRORS
    for k, matrix in enumerate(twists_of_actuators(OPTIMAL, positions, rotations, TOOL)):
        twists = drawn @ matrix.T
        squares = [(twists[:, half] ** 2).sum(axis=1).mean() for half in (slice(3), slice(3, 6))]
        assert float(rms.displacement[k]) == pytest.approx(np.sqrt(squares[0]), rel=0.01)
        assert float(rms.turn[k]) == pytest.approx(np.sqrt(squares[1]), rel=0.01)


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


def test_error_by_geometry_is_that_of_a_machine_with_other_dimensions() -> None:
    home = home_pose(OPTIMAL)
    position, rotation = np.array(home.position), home.rotation
    nominal = np.zeros(23)
    nominal[3:5] = OPTIMAL.a3
    nominal[11:13] = OPTIMAL.b1
    nominal[14], nominal[17] = OPTIMAL.b2, OPTIMAL.b3
    held = joints_of(nominal, position, rotation)
    found = pose_error_by_geometry(OPTIMAL, position, rotation, TOOL)
    step = 1e-4
    for index, name in enumerate(DIMENSIONS):
        ends: list[FloatArray] = []
        for sign in (1.0, -1.0):
            dimensions = nominal + sign * step * np.eye(23)[index]

            def unmet(twist: FloatArray, dimensions: FloatArray = dimensions) -> FloatArray:
                turn = Rotation.from_rotvec(twist[3:]).as_matrix() @ rotation
                place = position + rotation @ TOOL + twist[:3] - turn @ TOOL
                return joints_of(dimensions, place, turn) - held

            solved = least_squares(unmet, np.zeros(6), xtol=1e-15, ftol=1e-15, gtol=1e-15)
            ends.append(solved.x)
        slope = (ends[0] - ends[1]) / (2.0 * step)
        assert_allclose(slope, found[:, index], atol=1e-5 * np.abs(found).max(), err_msg=name)


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
    moved = geometry_error(design, found.by_geometry)
    assert moved.displacement.shape == (500, 23)
    used = np.flatnonzero(moved.displacement.any(axis=0))
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
