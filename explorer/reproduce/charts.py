"""The claim on charts: the folds are amounts of uncoupled motions, and coordinates of each cell.

In the folds of `explorer.mechanism.folds` a pose is what the platform reaches by six motions on its
own axes from the pose in which both flags coincide. A stratum is reached by some of them alone.
"""

from __future__ import annotations

import itertools
from dataclasses import asdict, dataclass

import numpy as np

from explorer.mechanism.design_file import PRESETS
from explorer.mechanism.folds import from_folds, to_folds
from explorer.mechanism.margins import margins
from explorer.mechanism.pose import Pose
from explorer.numerics.arrays import FloatArray
from explorer.reproduce.claim import (
    BETA,
    EPSILON,
    PHI1,
    PHI2,
    PHI3,
    Measurement,
    R,
    below,
    random_folds,
    random_poses,
)
from explorer.singularity.strata import STRATA, inversions, stratum
from explorer.singularity.uncoupled import UNCOUPLED

OPTIMAL = PRESETS["paper-optimal"]
# Number of random poses, of poses in each stratum, and of poses that motions make.
POSES, PLACES, MADE = 20_000, 200, 300
# Largest error of a law that holds exactly, and of a determinant by differences of a step.
EXACT, STEP, BY_DIFFERENCES = 1e-12, 1e-5, 1e-8
# Least determinant, over r², of a regular chart.
REGULAR = 1e-3

_TURN_PLANE, _TURN_LINE, _MOVE_POINT = UNCOUPLED[:3]
MOTIONS = (
    (_TURN_PLANE, PHI3, 1.0),
    (_TURN_LINE, BETA, 1.0),
    (_MOVE_POINT, R, 1.0),
    (_TURN_PLANE, PHI2, -1.0),
    (_TURN_LINE, EPSILON, 1.0),
    (_TURN_PLANE, PHI1, -1.0),
)
"""The motions that make a pose, each with the column of its amount and a sign."""

STRATUM_FOLDS = tuple(
    (R, BETA, PHI3)[:of_b4] + (EPSILON, PHI2)[:of_line] + (PHI1,)[:of_plane]
    for of_b4, of_line, of_plane in itertools.product(range(4), range(3), range(2))
)
"""Columns of the coordinates of each stratum; the others are zero in it."""

TABLE = (
    "amount   motion of the platform    range         margins that it changes",
    "φ3       turn about its x          0 to ±180°    δ3",
    "β        turn about its z          0 to 180°     δ2, δ3 in size",
    "r        move along its x          above 0       δ1, δ2, δ3 in size",
    "−φ2      turn about its x          0 to ±180°    δ2",
    "ε        turn about its z          0 to 180°     δ1, δ2 in size",
    "−φ1      turn about its x          0 to ±180°    δ1",
)
"""The coordinates in the order of their motions, as in `MOTIONS`."""


@dataclass(frozen=True)
class ChartErrors:
    """The errors of the folds as a chart, with the reach as unit of length.

    Attributes:
        poses: Largest error of a pose by its folds.
        folds: Largest error of the coordinates of a stratum by the pose that they make.
        strata: Number of strata that have as many coordinates as dimensions.
        motions: Largest error of a pose that the platform's motions make.
        margins: Largest error of the margins as products of r and sines.
        determinant: Largest error of sin β sin ε as the determinant of the chart over r².
        at_home: That determinant at the home pose of the optimum.
    """

    poses: float
    folds: float
    strata: int
    motions: float
    margins: float
    determinant: float
    at_home: float


def chart() -> Measurement:
    """Try the folds as coordinates of all poses, of each stratum, and of the home pose."""
    random, home = np.random.default_rng(9), OPTIMAL.home_pose
    p, r = random_poses(random, POSES, 1.0)
    p[0], r[0] = np.array(home.position) / OPTIMAL.reach, home.rotation
    folds = to_folds(p, r)
    sines = np.sin(folds[:, 1:])
    beta, epsilon = sines[:, 0], sines[:, 1]
    products = folds[:, :1] * sines[:, 2:]
    products *= np.stack([epsilon, beta * epsilon, beta], axis=-1)
    determinants = np.abs(np.linalg.det(_twists(folds))) / folds[:, R] ** 2
    free = np.repeat([np.isin(range(6), columns) for columns in STRATUM_FOLDS], PLACES, axis=0)
    of_strata = random_folds(random, free)
    poses = from_folds(of_strata)
    found = stratum(*poses, 1.0).reshape(-1, PLACES, 4)
    ours = {
        tuple(rows[0].tolist())
        for rows, columns in zip(found, STRATUM_FOLDS, strict=True)
        if (rows == rows[0]).all() and inversions(tuple(rows[0])) == len(columns)
    }
    return judge_chart(
        ChartErrors(
            poses=_largest_difference(from_folds(folds), (p, r)),
            folds=_error_of_folds(of_strata, to_folds(*poses)),
            strata=len(ours),
            motions=_error_of_motions(random_folds(random, np.full((MADE, 6), True))),
            margins=float(np.abs(products - margins(p, r)).max()),
            determinant=float(np.abs(determinants - beta * epsilon).max()),
            at_home=float(determinants[0]),
        )
    )


def judge_chart(errors: ChartErrors) -> Measurement:
    """Return the measurement of the folds as a chart."""
    exact = max(errors.poses, errors.folds, errors.motions, errors.margins)
    text = (
        "The amounts of six motions of the platform on its own axes, made one after the other from "
        "the pose in which both flags coincide, are such coordinates: r, β, ε and the folds φ1, φ2 "
        "and φ3. Each of these motions moves one element of the platform's flag and leaves two. "
        f"{POSES:,} random poses have coordinates that give them back, and the margins are "
        "δ1 = r sin ε sin φ1, δ2 = r sin β sin ε sin φ2 and δ3 = r sin β sin φ3. So the poses that "
        "are not singular are eight boxes, one for each triple of signs, connected and "
        "contractible; on the walls of a box a fold is flat, or r, sin β or sin ε vanishes. "
        f"Likewise {errors.strata} of the {len(STRATA)} strata have as many of the coordinates as "
        "dimensions; the others are zero, up to half turns about the platform's axes, which leave "
        f"its flag where it is. This holds to {below(exact, EXACT)} of the reach and in radians. "
        "The determinant of the chart is r² sin β sin ε, by finite differences to "
        f"{below(errors.determinant, BY_DIFFERENCES)} of r², so that it is regular in every box. A "
        "fold changes one margin; r, β and ε change several in size, and none in sign. The six "
        "motions of the claim uncoupled-motions, each made once, are no chart: at the optimum's "
        "home, as wherever the platform is parallel to the base, four of them move it parallel to "
        "the base, which has three freedoms; there the determinant of the folds is "
        f"{errors.at_home:.2f} r²."
    )
    is_exact = exact < EXACT and errors.determinant < BY_DIFFERENCES
    is_so = is_exact and errors.strata == len(STRATA) and errors.at_home > REGULAR
    verdict = "confirmed" if is_so else "not confirmed"
    return Measurement(text, verdict, asdict(errors), TABLE)


def _twists(folds: FloatArray) -> FloatArray:
    """Return the twists (v; ω) of b4 per unit of each coordinate, as columns (n, 6, 6)."""
    shifts = STEP * np.eye(6)
    (p, r), (q, s) = (from_folds(folds[:, None] + shift) for shift in (-shifts, shifts))
    turns = (s - r) @ np.swapaxes(from_folds(folds)[1], -1, -2)[:, None]
    spins = [turns[..., 2, 1], turns[..., 0, 2], turns[..., 1, 0]]
    twists = np.concatenate([q - p, np.stack(spins, axis=-1)], axis=-1) / (2.0 * STEP)
    return np.swapaxes(twists, -1, -2)


def _largest_difference(
    one: tuple[FloatArray, FloatArray], other: tuple[FloatArray, FloatArray]
) -> float:
    return max(float(np.abs(a - b).max()) for a, b in zip(one, other, strict=True))


def _error_of_folds(given: FloatArray, found: FloatArray) -> float:
    """Return the largest error of the folds of poses by the folds of which they are made."""
    # Where a1 is on the line b2b3, ε is 0 and φ1 + φ2 alone is determined.
    straight, found = given[:, EPSILON] == 0.0, found.copy()
    found[straight, PHI1] += found[straight, PHI2]
    found[straight, PHI2] = 0.0
    apart = found - given
    apart[:, BETA:] -= 2.0 * np.pi * np.round(apart[:, BETA:] / (2.0 * np.pi))
    return float(np.abs(apart).max())


def _error_of_motions(folds: FloatArray) -> float:
    """Return the largest error of the poses of folds by the platform's own motions."""
    worst = 0.0
    for row, position, rotation in zip(folds, *from_folds(folds), strict=True):
        pose = Pose.of((0.0, 0.0, 0.0), np.eye(3))
        for motion, column, sign in MOTIONS:
            pose = motion.moved(pose, sign * float(row[column]))
        found = np.array(pose.position), pose.rotation
        worst = max(worst, _largest_difference(found, (position, rotation)))
    return worst
