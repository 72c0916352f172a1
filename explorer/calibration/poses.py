"""In which poses to measure a machine, so that its tool errs least where nothing is measured.

Candidates are random poses within the limits, well conditioned, and with margins that let the legs
of the true machine close. Of them poses are chosen one by one, each of the largest gain, and then
exchanged while that gains (Fedorov, Theory of Optimal Experiments, 1972). The criterion is the mean
square of the tool's error over all candidates, for the linear model.
"""

from __future__ import annotations

import numpy as np
from scipy.spatial.transform import Rotation

from explorer.calibration.measurement import Kind, Measurement, setup_of
from explorer.errors import NoAnswerError
from explorer.mechanism.configuration import Configuration
from explorer.mechanism.design import Design
from explorer.numerics.arrays import FloatArray, IntArray, lengths_of
from explorer.numerics.checks import whole
from explorer.statics.accuracy import (
    SOURCES,
    UNIFORM,
    error_by_source,
    rms_of_sources,
    source_errors,
)
from explorer.workspace.limits.valid_poses import poses_are_valid

CANDIDATES = 500
"""Number of poses from which some are chosen."""

MOST_POSES = 1000
"""Largest number of poses that are chosen."""

CONDITION = 0.01
"""Least inverse condition number of a candidate."""

MARGIN_RATIO = 6.0
"""Least margin of a candidate, over a bound of the RMS error of its margins."""

# Random poses drawn at a time, most of these times, and most rounds of exchange.
DRAWN, TRIES, ROUNDS = 4096, 50, 20
# Share of a gain that is rounding.
ROUNDING = 1e-9


def sample_poses(design: Design, count: int, seed: int = 0) -> Configuration:
    """Return up to so many random poses that are fit to be measured; home alone if none is found.

    The margins allow for the tolerances that the design states.
    """
    rng, home = np.random.default_rng(seed), design.home_pose
    low, high = design.limits.box or ((-design.reach,) * 3, (design.reach,) * 3)
    errors = source_errors(design)
    positions, rotations = np.empty((0, 3)), np.empty((0, 3, 3))
    for _ in range(TRIES):
        p = rng.uniform(low, high, (DRAWN, 3))
        # Small turns as well as large ones, in radians.
        turns = rng.uniform(size=(DRAWN, 1)) * rng.normal(size=(DRAWN, 3))
        r = Rotation.from_rotvec(turns).as_matrix() @ home.rotation
        valid = poses_are_valid(design, p, r)
        c = Configuration(design, p[valid], r[valid])
        off = rms_of_sources(error_by_source(c), errors)
        least = MARGIN_RATIO * (off.displacement + lengths_of(c.position) * off.turn)
        fit = (np.abs(c.margins).min(axis=1) >= least) & (c.inverse_condition >= CONDITION)
        positions = np.concatenate([positions, c.position[fit]])[:count]
        rotations = np.concatenate([rotations, c.rotation[fit]])[:count]
        if len(positions) == count:
            break
    if not len(positions):
        positions, rotations = np.array([home.position]), home.rotation[None]
    return Configuration(design, positions, rotations)


def calibration_poses(
    design: Design,
    count: int,
    kind: Kind | Measurement,
    seed: int = 0,
) -> Configuration:
    """Choose a number of poses in which to measure a machine of a design with its tolerances.

    The kind is what is measured, or a setup with its deviations, whose values do not count. The
    seed is that of the random candidates.

    Raises:
        InputError: The number of poses is not usable, or the kind needs a setup.
        NoAnswerError: Too few poses within the limits are fit to be measured.
    """
    measured = setup_of(design, kind) if isinstance(kind, str) else kind
    most = max(CANDIDATES, whole("the number of poses", count, 1, MOST_POSES))
    found = sample_poses(design, most, seed)
    if len(found.positions) < count:
        raise NoAnswerError(
            f"of {TRIES * DRAWN:,} random poses {len(found.positions)} are within the limits and "
            f"far enough from singular ones; {count} are needed"
        )
    spread = UNIFORM * source_errors(design)
    slopes = measured.slopes(found.position, found.rotation, np.zeros(measured.unknowns))
    # The unknowns of the setup may be anything within the reach.
    by_source = slopes[..., :6] @ (error_by_source(found) * spread)
    rows = np.concatenate([by_source, slopes[..., 6:] * design.reach], axis=-1)
    rows /= np.broadcast_to(measured.sigma, rows.shape[:2])[..., None]
    moved = error_by_source(found.with_tool(design.tool.position))[:, :3] * spread
    wanted = np.zeros((rows.shape[2],) * 2)
    wanted[: len(SOURCES), : len(SOURCES)] = np.einsum("kij,kil->jl", moved, moved)
    chosen = _choose(rows, wanted, count)
    return Configuration(design, found.position[chosen], found.rotation[chosen])


def _choose(rows: FloatArray, wanted: FloatArray, count: int) -> IntArray:
    """Return candidates, (count,), of rows (n, m, k) and wanted weights of the covariance (k, k).

    Exchanges of one candidate for another do not reduce the weighted trace further.
    """
    chosen, information, kept = np.full(count, -1), np.eye(rows.shape[2]), 0
    for step in range(count * ROUNDS):
        k = step % count
        own, others = chosen[k], np.delete(chosen, k)
        if own >= 0:
            information -= rows[own].T @ rows[own]
        seen = rows @ np.linalg.inv(information)
        left = np.linalg.inv(np.eye(rows.shape[1]) + seen @ np.swapaxes(rows, 1, 2))
        gains = np.einsum("kij,kji->k", left, seen @ wanted @ np.swapaxes(seen, 1, 2))
        gains[others[others >= 0]] = -1.0
        best = gains.argmax()
        if own >= 0 and gains[best] <= gains[own] * (1.0 + ROUNDING):
            best = own
        kept = kept + 1 if best == own else 0
        chosen[k] = best
        information += rows[best].T @ rows[best]
        if kept == count:
            break
    return chosen
