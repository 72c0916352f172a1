"""Errors of the tool: the reference, all corners, random errors, other dimensions."""

from __future__ import annotations

import itertools

import msgspec
import numpy as np
import pytest
from numpy.testing import assert_allclose
from refusals import refusal
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


def test_errors_are_the_largest_and_the_mean_of_random_errors_of_forward_kinematics() -> None:
    (position,), (rotation,) = random_poses(OPTIMAL, 1, margin=0.2)
    held, mode = inverse(OPTIMAL, position, rotation), int(mode_of(margins(position, rotation)))
    # So small that the second order is negligible; the corners are among them.
    largest = 1e-6 * ERRORS
    corners = np.array(list(itertools.product((-1.0, 1.0), repeat=6)))
    random = np.random.default_rng(0).uniform(-1.0, 1.0, (30_000, 6))
    found = forward(OPTIMAL, held + largest * np.concatenate([corners, random]))
    turned = found.rotation[:, mode]
    moves = found.position[:, mode] + turned @ TOOL - position - rotation @ TOOL
    turns = Rotation.from_matrix(turned @ rotation.T).as_rotvec()
    given = OPTIMAL, position, rotation, largest, TOOL
    for vectors, worst, mean in zip(
        (moves, turns), worst_error(*given), rms_error(*given), strict=True
    ):
        assert np.linalg.norm(vectors, axis=1).max() == pytest.approx(worst, rel=1e-4)
        # Errors of equal chance within ± e.
        squares = (vectors[len(corners) :] ** 2).sum(axis=1)
        assert np.sqrt(squares.mean()) == pytest.approx(mean, rel=0.02)


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
