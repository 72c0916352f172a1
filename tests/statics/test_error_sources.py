"""The largest error of all sources: all combinations of signs, degenerate sets, one inversion."""

from __future__ import annotations

import itertools

import msgspec
import numpy as np
import pytest
from numpy.testing import assert_allclose
from refusals import refusal
from statics_cases import random_poses

from explorer import (
    PRESETS,
    SOURCES,
    Actuators,
    InputError,
    Tolerances,
    home_pose,
    largest_error,
    pose_error_by_geometry,
    pose_error_by_source,
    pose_precision,
    rms_error,
    rms_of_sources,
    source_errors,
    worst_error,
)
from explorer.numerics.arrays import FloatArray
from explorer.statics.equilibrium import twists_of_actuators
from explorer.statics.error_sources import by_source as by_source_of

OPTIMAL = PRESETS["paper-optimal"]
TOOL = np.array([0.5, -0.3, 1.5])
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
        "many sizes": vectors * np.exp2(rng.uniform(-500.0, 500.0, m)),
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
    by_source = pose_error_by_source(OPTIMAL, positions, rotations, TOOL)
    found = largest_error(by_source, BOUNDS)
    rng = np.random.default_rng(2)
    drawn = BOUNDS * np.sign(rng.normal(size=(2000, len(SOURCES))))
    for half, size in ((slice(0, 3), found.displacement), (slice(3, 6), found.turn)):
        sums = np.einsum("nij,cj->nci", by_source[:, half], drawn)
        assert (np.linalg.norm(sums, axis=-1).max(axis=1) <= size * (1.0 + 1e-12)).all()
        # The vertex is the farthest along its own direction, which is that of a sum of |v · n|.
        vectors = found.vectors[:, half.start // 3]
        along = vectors / size[:, None]
        reach = np.abs(np.einsum("nij,ni->nj", by_source[:, half], along)) @ BOUNDS
        assert_allclose(reach, size, rtol=1e-12)


def test_largest_error_of_actuators_alone_is_the_worst_error() -> None:
    positions, rotations = random_poses(OPTIMAL, 300)
    by_source = pose_error_by_source(OPTIMAL, positions, rotations, TOOL)
    found = largest_error(by_source[..., :6], BOUNDS[:6])
    expected = worst_error(OPTIMAL, positions, rotations, BOUNDS[:6], TOOL)
    assert_allclose(found.displacement, expected.displacement, rtol=1e-12)
    assert_allclose(found.turn, expected.turn, rtol=1e-12)
    rms = rms_of_sources(by_source[..., :6], BOUNDS[:6])
    assert_allclose(rms, rms_error(OPTIMAL, positions, rotations, BOUNDS[:6], TOOL), rtol=1e-12)
    assert (rms.displacement <= found.displacement).all()


def test_errors_of_sources_are_those_of_actuators_and_dimensions() -> None:
    design = msgspec.structs.replace(
        OPTIMAL,
        actuators=Actuators(error_mm=(0.1, 0.2, 0.3, 0.4, 0.5, 0.6)),
        tolerances=Tolerances(a1=(0.1, 0.2, 0.3), guide_tilt_deg=(0.1, 0.2)),
    )
    errors = source_errors(design)
    assert errors.shape == (len(SOURCES),) == (29,)
    assert_allclose(errors[:9], [0.01, 0.02, 0.03, 0.04, 0.05, 0.06, 0.01, 0.02, 0.03])
    assert_allclose(np.degrees(errors[[SOURCES.index("guide tilt y"), 16]]), [0.1, 0.2])
    positions, rotations = random_poses(design, 5)
    found = pose_error_by_source(design, positions, rotations, TOOL)
    given = design, positions, rotations, TOOL
    assert_allclose(found[..., :6], twists_of_actuators(*given))
    assert_allclose(found[..., 6:], pose_error_by_geometry(*given))
    assert_allclose(found, by_source_of(pose_precision(*given)))


@pytest.mark.parametrize("count", [1, 600])
def test_largest_error_of_singular_or_overflowing_pose_is_infinite(count: int) -> None:
    positions = np.resize([3.0, 4.0, 5.0], (count, 3))
    singular = pose_error_by_source(OPTIMAL, positions, np.eye(3))
    for by_source in (singular, np.full((count, 6, 29), 1e300)):
        found = largest_error(by_source, np.full(29, 1e10))
        assert (found.displacement == np.inf).all()
        assert (found.turn == np.inf).all()
        assert np.isnan(found.vectors).all()
        assert (found.signs == 0.0).all()
    assert (largest_error(singular, np.zeros(29)).displacement == np.inf).all()
    assert (rms_of_sources(singular, np.zeros(29)).turn == np.inf).all()


def test_largest_error_without_errors_is_zero_and_of_unusable_bounds_refused() -> None:
    home = home_pose(OPTIMAL)
    by_source = pose_error_by_source(OPTIMAL, home.position, home.rotation)
    found = largest_error(by_source, source_errors(OPTIMAL))
    assert (float(found.displacement), float(found.turn)) == (0.0, 0.0)
    assert not found.vectors.any()
    for function, bound in itertools.product((largest_error, rms_of_sources), (-1.0, np.nan)):
        assert "none negative" in refusal(function, by_source, [bound] * 29, kind=InputError)
