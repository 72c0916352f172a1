"""Errors of the tool: the reference, all corners and signs, random errors, degenerate sets."""

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
    Tolerances,
    forward,
    inverse,
    margins,
    pose_error_by_geometry,
    worst_error,
)
from explorer.mechanism.configuration import Configuration
from explorer.mechanism.machine import DIMENSIONS
from explorer.mechanism.margins import mode_of
from explorer.motion.inverse_jacobian import twists_of_actuators
from explorer.numerics.arrays import FloatArray
from explorer.statics.accuracy import (
    IS_TILT,
    SOURCES,
    actuator_errors,
    error_by_source,
    errors_alone,
    largest_error,
    rms_of_sources,
    source_errors,
)

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
    poses = Configuration(OPTIMAL, positions, rotations, TOOL)
    twists = np.einsum("nij,cj->nci", twists_of_actuators(poses), corners)
    for half, found in ((slice(0, 3), worst.displacement), (slice(3, 6), worst.turn)):
        assert_allclose(np.linalg.norm(twists[..., half], axis=-1).max(axis=1), found, rtol=1e-12)
    alone = errors_alone(twists_of_actuators(poses), ERRORS)
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
    poses = Configuration(OPTIMAL, position, rotation, TOOL)
    for vectors, worst, mean in zip(
        (moves, turns),
        worst_error(*given),
        rms_of_sources(twists_of_actuators(poses), largest),
        strict=True,
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


def test_errors_alone_of_the_actuators_are_those_of_a_machine_without_tolerances() -> None:
    design = msgspec.structs.replace(
        OPTIMAL,
        actuators=Actuators(
            error_mm=(0.1, 0.2, 0.1, 0.2, 0.1, 0.05),
        ),
        tolerances=Tolerances(a3=(0.1, 0.2, 0.0), guide_tilt_deg=(0.1, 0.0)),
    )
    positions, rotations = random_poses(design, 500)
    poses = Configuration(design, positions, rotations, TOOL)
    alone = errors_alone(error_by_source(poses), source_errors(design))
    moved = np.linalg.norm(twists_of_actuators(poses)[:, :3], axis=1) * actuator_errors(design)
    assert_allclose(alone.displacement[:, :6], moved)
    used = np.flatnonzero(alone.displacement[:, 6:].any(axis=0))
    assert [DIMENSIONS[index] for index in used] == ["a3x", "a3y", "guide tilt y"]


@pytest.mark.parametrize("count", [1, 600])
def test_errors_of_singular_pose_are_infinite(count: int) -> None:
    positions = np.resize([3.0, 4.0, 5.0], (count, 3))
    for error in worst_error(OPTIMAL, positions, np.eye(3), ERRORS):
        assert (error == np.inf).all()
    assert (pose_error_by_geometry(OPTIMAL, positions, np.eye(3)) == np.inf).all()


def test_errors_of_unusable_arguments_are_refused() -> None:
    home = OPTIMAL.home_pose
    given = OPTIMAL, home.position, home.rotation
    assert "six" in refusal(worst_error, *given, [1.0] * 5)
    for bound, words in ((-1.0, "must not be negative"), (np.nan, "finite"), (np.inf, "finite")):
        assert words in refusal(worst_error, *given, [bound] * 6)
    refusal(pose_error_by_geometry, *given, [1.0, 2.0])
    none = worst_error(*given, np.zeros(6))
    assert (none.displacement, none.turn) == (0.0, 0.0)


SIGNS = np.array(list(itertools.product((-1.0, 1.0), repeat=12)))
BOUNDS = np.random.default_rng(7).uniform(0.0, 0.02, len(SOURCES))


def longest_of_all_signs(vectors: FloatArray) -> float:
    """Return the largest |Σ ± v_i| of columns, shape (3, n), over all signs."""
    scale = float(np.abs(vectors).max()) or 1.0
    sums = SIGNS[:, : vectors.shape[1]] @ (vectors.T / scale)
    return scale * float(np.linalg.norm(sums, axis=1).max())


def draw_sets(rng: np.random.Generator) -> dict[str, FloatArray]:
    """Return sets of up to twelve vectors as columns, shape (3, n), by what they have in common."""
    m = int(rng.integers(1, 13))
    vectors, plane = rng.normal(size=(3, m)), rng.normal(size=(3, 2))
    grid = rng.integers(-1, 2, (3, m)).astype(float)
    noise = float(np.exp2(rng.uniform(-55.0, -15.0))) * vectors
    return {
        "nothing": vectors,
        "many in one plane, parallel or zero": grid,
        "nearly so": grid + noise,
        "all in one plane": plane @ grid[:2],
        "all nearly in one plane": plane @ grid[:2] + noise,
        "all parallel": plane[:, :1] * grid[0],
        "many sizes": vectors * np.exp2(rng.uniform(-60.0, 60.0, m)),
    }


@pytest.mark.parametrize("seed", range(20))
def test_largest_error_is_the_longest_sum_of_all_signs(seed: int) -> None:
    rng = np.random.default_rng(seed)
    for kind, vectors in draw_sets(rng).items():
        bounds = rng.uniform(0.5, 2.0, len(vectors.T))
        found = largest_error(np.concatenate([vectors, vectors[::-1]]), bounds)
        expected = longest_of_all_signs(vectors * bounds)
        assert_allclose(found[:2], expected, rtol=1e-14, err_msg=kind)
        # The signs are those of that sum.
        total: FloatArray = vectors @ (bounds * found.signs[0])
        assert_allclose(total, found.vectors[0], rtol=0.0, atol=1e-14 * expected)
        assert (np.abs(found.signs[0]) == vectors.any(axis=0)).all()


def test_largest_error_of_a_machine_exceeds_random_errors_and_all_its_neighbours() -> None:
    positions, rotations = random_poses(OPTIMAL, 300)
    sources = error_by_source(Configuration(OPTIMAL, positions, rotations, TOOL))
    found = largest_error(sources, BOUNDS)
    rng = np.random.default_rng(2)
    drawn = BOUNDS * np.sign(rng.normal(size=(2000, len(SOURCES))))
    for half, size in ((slice(0, 3), found.displacement), (slice(3, 6), found.turn)):
        sums = np.einsum("nij,cj->nci", sources[:, half], drawn)
        assert (np.linalg.norm(sums, axis=-1).max(axis=1) <= size * (1.0 + 1e-12)).all()
        # The vertex is the farthest along its own direction, which is that of a sum of |v · n|.
        vectors = found.vectors[:, half.start // 3]
        along = vectors / size[:, None]
        reach = np.abs(np.einsum("nij,ni->nj", sources[:, half], along)) @ BOUNDS
        assert_allclose(reach, size, rtol=1e-12)


def test_errors_of_sources_are_those_of_actuators_and_dimensions() -> None:
    design = msgspec.structs.replace(
        OPTIMAL,
        actuators=Actuators(error_mm=(0.1, 0.2, 0.3, 0.4, 0.5, 0.6)),
        tolerances=Tolerances(a1=(0.1, 0.2, 0.3), guide_tilt_deg=(0.1, 0.2), square_deg=(0.3, 0.4)),
    )
    errors = source_errors(design)
    assert errors.shape == (len(SOURCES),) == (31,)
    assert_allclose(errors[:9], [0.01, 0.02, 0.03, 0.04, 0.05, 0.06, 0.01, 0.02, 0.03])
    assert_allclose(np.degrees(errors[IS_TILT]), [0.1, 0.2, 0.3, 0.4])
    positions, rotations = random_poses(design, 5)
    found = error_by_source(Configuration(design, positions, rotations, TOOL))
    given = design, positions, rotations, TOOL
    assert_allclose(found[..., :6], twists_of_actuators(Configuration(*given)))
    assert_allclose(found[..., 6:29], pose_error_by_geometry(*given))
    # Struts that lean forwards by ε read d1 too small by d2 ε, and d3 by d4 ε.
    joints = inverse(design, positions, rotations)
    assert_allclose(found[..., 29], found[..., 1] * joints[:, 2:3], rtol=1e-12)
    assert_allclose(found[..., 30], found[..., 3] * joints[:, 4:5], rtol=1e-12)


@pytest.mark.parametrize("count", [1, 600])
def test_largest_error_of_singular_pose_is_infinite(count: int) -> None:
    positions = np.resize([3.0, 4.0, 5.0], (count, 3))
    singular = error_by_source(Configuration(OPTIMAL, positions, np.eye(3)))
    found = largest_error(singular, np.full(31, 1.0))
    assert (found.displacement == np.inf).all()
    assert (found.turn == np.inf).all()
    assert np.isnan(found.vectors).all()
    assert (found.signs == 0.0).all()
    assert (largest_error(singular, np.zeros(31)).displacement == np.inf).all()
    assert (rms_of_sources(singular, np.zeros(31)).turn == np.inf).all()


def test_largest_error_without_errors_is_zero_and_of_unusable_bounds_refused() -> None:
    home = OPTIMAL.home_pose
    sources = error_by_source(Configuration.at(OPTIMAL, home))
    found = largest_error(sources, source_errors(OPTIMAL))
    assert (float(found.displacement), float(found.turn)) == (0.0, 0.0)
    assert not found.vectors.any()
    for function, bound in itertools.product((largest_error, rms_of_sources), (-1.0, np.nan)):
        assert "the bounds of errors must" in refusal(function, sources, [bound] * 31)
