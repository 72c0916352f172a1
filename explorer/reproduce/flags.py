"""Claims that follow from the two flags: strata, uncoupled motions, and charts of the cells.

In the folds of `explorer.mechanism.folds` a pose is what the platform reaches by six motions on its
own axes from the pose in which both flags coincide. A stratum is reached by some of them alone.
"""

from __future__ import annotations

import itertools

import numpy as np

from explorer.mechanism.design import JOINTS
from explorer.mechanism.design_file import PRESETS
from explorer.mechanism.folds import from_folds, to_folds
from explorer.mechanism.kinematics import forward, inverse, jacobian
from explorer.mechanism.margins import margins, mode_of
from explorer.mechanism.pose import Pose
from explorer.numerics.arrays import FloatArray, lengths_of
from explorer.reproduce import claim
from explorer.singularity.freedoms import UNCOUPLED
from explorer.singularity.strata import STRATA, inversions, is_below, stratum

OPTIMAL = PRESETS["paper-optimal"]
# Number of neighbours of a pose, and their distance in folds.
NEIGHBOURS, NEAR = 20, 1e-2
MOVED, SAME = 300, 1e-10
# Largest relative rate of a locked actuator.
LOCKED = 1e-12


def measure_strata() -> claim.Measurement:
    """Place poses in the strata by some of six motions, and their neighbours by more of them."""
    random = np.random.default_rng(6)
    choices = np.array(list(itertools.product((False, True), repeat=6)))
    pairs = [(a, b) for a in choices for b in choices if (a <= b).all()]
    some, more = np.repeat(np.array(pairs), NEIGHBOURS, axis=0).swapaxes(0, 1)
    at = claim.random_folds(random, some)
    near = at + NEAR * claim.random_folds(random, more & ~some)
    of, others = (map(tuple, stratum(*from_folds(each), 1.0).tolist()) for each in (at, near))
    neighbours = set(zip(of, others, strict=True))
    found = {w for w, _ in neighbours}
    order = {(w, other) for w in STRATA for other in STRATA if is_below(w, other)}
    outside, missing = len(neighbours - order), len(order - neighbours)
    counts = [sum(inversions(w) == k for w in STRATA) for k in range(7)]
    words = {"strata": len(STRATA), "counts": ", ".join(map(str, counts)), "poses": len(at)}
    words |= {"pairs": len(neighbours), "order": len(order)}
    values = {"found": len(found), "by_dimension": counts, "outside": outside, "missing": missing}
    return claim.judge(len(found) == len(STRATA) and neighbours == order, words, values)


def measure_uncoupled_motions() -> claim.Measurement:
    """Move random poses along the six uncoupled motions, by one actuator, and at a singularity."""
    random = np.random.default_rng(7)
    positions, rotations = claim.random_poses(random, MOVED, OPTIMAL.reach)
    own, others = np.inf, 0.0
    for position, rotation in zip(positions, rotations, strict=True):
        pose = Pose.of(tuple(position.tolist()), rotation)
        before = margins(pose.position, pose.rotation)
        for motion in UNCOUPLED:
            moved = motion.move(pose, float(random.uniform(0.5, 1.0)))
            change = np.abs(margins(moved.position, moved.rotation) - before) / OPTIMAL.reach
            own = min(own, float(change[motion.incidence - 1]))
            others = max(others, float(np.delete(change, motion.incidence - 1).max()))
    of_actuators = _margins_of_actuators(positions, rotations, random)
    rate = _rates_of_freedoms(positions, rotations)
    single = [f"{name} moves {which[0]}" for name, which in of_actuators.items() if len(which) == 1]
    several = [name for name, which in of_actuators.items() if len(which) > 1]
    words = {
        "poses": MOVED,
        "others": claim.below(others, SAME),
        "single": " and ".join(single),
        "several": ", ".join(several),
        "rate": claim.below(rate, LOCKED),
    }
    values = {
        "least_own_change": own,
        "largest_other_change": others,
        "margins_of_actuators": of_actuators,
        "largest_rate_of_a_freedom": rate,
    }
    return claim.judge(others < SAME < own and rate < LOCKED, words, values)


def _margins_of_actuators(
    positions: FloatArray, rotations: FloatArray, random: np.random.Generator
) -> dict[str, tuple[str, ...]]:
    """Return which margins change with each actuator alone, over random poses."""
    reach = OPTIMAL.reach
    before = margins(positions, rotations)
    joints = inverse(OPTIMAL, positions, rotations)
    rows, mode = np.arange(len(positions)), mode_of(before)
    moves: dict[str, tuple[str, ...]] = {}
    for index, name in enumerate(JOINTS):
        changed = joints.copy()
        changed[:, index] += 0.02 * reach * random.uniform(0.5, 1.0, len(joints))
        p, r, feasible = forward(OPTIMAL, changed)
        after = margins(p[rows, mode], r[rows, mode])
        change = np.abs(after - before)[feasible].max(axis=0)
        moves[name] = tuple(f"δ{k + 1}" for k in range(3) if change[k] > 1e-7 * reach)
    return moves


def _rates_of_freedoms(positions: FloatArray, rotations: FloatArray) -> float:
    """Return the largest rate of an actuator, relative to J, as a flat fold turns."""
    worst = 0.0
    for column in (claim.PHI1, claim.PHI2, claim.PHI3):
        p, r = claim.flatten(positions, rotations, column)
        guide = np.broadcast_to([1.0, 0.0, 0.0], p.shape)
        axis = (r[..., 0], p / lengths_of(p)[:, None], guide)[column - claim.PHI1]
        # b4 lies on the first two lines; the third passes through a1.
        velocity = np.cross(axis, p) if column == claim.PHI3 else np.zeros_like(p)
        twist = np.concatenate([velocity, axis], axis=-1)
        j = jacobian(OPTIMAL, p, r)
        rates = np.abs(np.einsum("nij,nj->ni", j, twist))
        scale = np.linalg.norm(j, axis=-1) * np.linalg.norm(twist, axis=-1)[:, None]
        worst = max(worst, float((rates / scale).max()))
    return worst


# Number of random poses, of poses in each stratum, and of poses that motions make.
POSES, PLACES, MADE = 20_000, 200, 300
# Largest error of a law that holds exactly, and of a determinant by differences of a step.
EXACT, STEP, BY_DIFFERENCES = 1e-12, 1e-5, 1e-8
# Least determinant, over r², of a regular chart.
REGULAR = 1e-3

_TURN_PLANE, _TURN_LINE, _MOVE_POINT = UNCOUPLED[:3]
MOTIONS = (
    (_TURN_PLANE, claim.PHI3, 1.0),
    (_TURN_LINE, claim.BETA, 1.0),
    (_MOVE_POINT, claim.R, 1.0),
    (_TURN_PLANE, claim.PHI2, -1.0),
    (_TURN_LINE, claim.EPSILON, 1.0),
    (_TURN_PLANE, claim.PHI1, -1.0),
)
"""The motions that make a pose, each with the column of its amount and a sign."""

STRATUM_FOLDS = tuple(
    (claim.R, claim.BETA, claim.PHI3)[:of_b4]
    + (claim.EPSILON, claim.PHI2)[:of_line]
    + (claim.PHI1,)[:of_plane]
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


def measure_charts() -> claim.Measurement:
    """Try the folds as coordinates of all poses, of each stratum, and of the home pose."""
    random, home = np.random.default_rng(9), OPTIMAL.home_pose
    p, r = claim.random_poses(random, POSES, 1.0)
    p[0], r[0] = np.array(home.position) / OPTIMAL.reach, home.rotation
    folds = to_folds(p, r)
    sines = np.sin(folds[:, 1:])
    beta, epsilon = sines[:, 0], sines[:, 1]
    products = folds[:, :1] * sines[:, 2:]
    products *= np.stack([epsilon, beta * epsilon, beta], axis=-1)
    determinants = np.abs(np.linalg.det(_twists(folds))) / folds[:, claim.R] ** 2
    free = np.repeat([np.isin(range(6), columns) for columns in STRATUM_FOLDS], PLACES, axis=0)
    of_strata = claim.random_folds(random, free)
    poses = from_folds(of_strata)
    places = stratum(*poses, 1.0).reshape(-1, PLACES, 4)
    ours = {
        tuple(rows[0].tolist())
        for rows, columns in zip(places, STRATUM_FOLDS, strict=True)
        if (rows == rows[0]).all() and inversions(tuple(rows[0])) == len(columns)
    }
    back = zip(from_folds(folds), (p, r), strict=True)
    errors = {
        "poses": max(float(np.abs(found - given).max()) for found, given in back),
        "folds": _error_of_folds(of_strata, to_folds(*poses)),
        "motions": _error_of_motions(claim.random_folds(random, np.full((MADE, 6), True))),
        "margins": float(np.abs(products - margins(p, r)).max()),
    }
    exact, at_home = max(errors.values()), float(determinants[0])
    determinant = float(np.abs(determinants - beta * epsilon).max())
    words = {
        "poses": POSES,
        "all": len(STRATA),
        "exact": claim.below(exact, EXACT),
        "determinant": claim.below(determinant, BY_DIFFERENCES),
    }
    is_exact = exact < EXACT and determinant < BY_DIFFERENCES
    is_so = is_exact and len(ours) == len(STRATA) and at_home > REGULAR
    values = {**errors, "strata": len(ours), "determinant": determinant, "at_home": at_home}
    return claim.judge(is_so, words, values, TABLE)


def _twists(folds: FloatArray) -> FloatArray:
    """Return the twists (v; ω) of b4 per unit of each coordinate, as columns (n, 6, 6)."""
    shifts = STEP * np.eye(6)
    (p, r), (q, s) = (from_folds(folds[:, None] + shift) for shift in (-shifts, shifts))
    turns = (s - r) @ np.swapaxes(from_folds(folds)[1], -1, -2)[:, None]
    spins = [turns[..., 2, 1], turns[..., 0, 2], turns[..., 1, 0]]
    twists = np.concatenate([q - p, np.stack(spins, axis=-1)], axis=-1) / (2.0 * STEP)
    return np.swapaxes(twists, -1, -2)


def _error_of_folds(given: FloatArray, found: FloatArray) -> float:
    """Return the largest error of the folds of poses by the folds of which they are made."""
    # Where a1 is on the line b2b3, ε is 0 and φ1 + φ2 alone is determined.
    straight, found = given[:, claim.EPSILON] == 0.0, found.copy()
    found[straight, claim.PHI1] += found[straight, claim.PHI2]
    found[straight, claim.PHI2] = 0.0
    apart = found - given
    apart[:, claim.BETA :] -= 2.0 * np.pi * np.round(apart[:, claim.BETA :] / (2.0 * np.pi))
    return float(np.abs(apart).max())


def _error_of_motions(folds: FloatArray) -> float:
    """Return the largest error of the poses of folds by the platform's own motions."""
    worst = 0.0
    for row, position, rotation in zip(folds, *from_folds(folds), strict=True):
        pose = Pose.of((0.0, 0.0, 0.0), np.eye(3))
        for motion, column, sign in MOTIONS:
            pose = motion.move(pose, sign * float(row[column]))
        worst = max(worst, float(np.abs(np.subtract(pose.position, position)).max()))
        worst = max(worst, float(np.abs(pose.rotation - rotation).max()))
    return worst
