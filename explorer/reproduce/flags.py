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
from explorer.mechanism.kinematics import forward, inverse
from explorer.mechanism.margins import margins, mode_of
from explorer.mechanism.pose import Pose
from explorer.numerics.arrays import FloatArray, lengths_of
from explorer.reproduce.claim import (
    BETA,
    EPSILON,
    PHI1,
    PHI2,
    PHI3,
    Measurement,
    R,
    below,
    flatten,
    random_folds,
    random_poses,
)
from explorer.singularity.ellipsoids import jacobian
from explorer.singularity.freedoms import UNCOUPLED
from explorer.singularity.strata import STRATA, inversions, is_below, stratum

OPTIMAL = PRESETS["paper-optimal"]
# Number of neighbours of a pose, and their distance in folds.
NEIGHBOURS, NEAR = 20, 1e-2
MOVED, SAME = 300, 1e-10
# Largest relative rate of a locked actuator.
LOCKED = 1e-12

Order = set[tuple[tuple[int, ...], tuple[int, ...]]]


def strata() -> Measurement:
    """Place poses in the strata by some of six motions, and their neighbours by more of them."""
    random = np.random.default_rng(6)
    choices = np.array(list(itertools.product((False, True), repeat=6)))
    pairs = [(a, b) for a in choices for b in choices if (a <= b).all()]
    some, more = np.repeat(np.array(pairs), NEIGHBOURS, axis=0).swapaxes(0, 1)
    at = random_folds(random, some)
    near = at + NEAR * random_folds(random, more & ~some)
    of, others = (map(tuple, stratum(*from_folds(each), 1.0).tolist()) for each in (at, near))
    return judge_strata(set(zip(of, others, strict=True)), len(at))


def judge_strata(neighbours: Order, count: int) -> Measurement:
    """Return the measurement of the strata.

    Args:
        neighbours: Strata of a pose and of a neighbour of it, as they were found.
        count: Number of poses with a neighbour.
    """
    found = {w for w, _ in neighbours}
    order = {(w, other) for w in STRATA for other in STRATA if is_below(w, other)}
    outside, missing = len(neighbours - order), len(order - neighbours)
    counts = [sum(inversions(w) == k for w in STRATA) for k in range(7)]
    text = (
        f"Poses are found in {len(found)} of the {len(STRATA)} strata, "
        f"{', '.join(map(str, counts))} of which have the dimensions 0 to 6. {count:,} poses with "
        f"a neighbour show {len(neighbours)} pairs of a stratum and one that it borders on, "
        f"{outside} of them outside the Bruhat order, of whose {len(order)} pairs {missing} are "
        "missing: the closure of a stratum is it and all that are below it in this order. A "
        "stratum depends on the relative position of the flags alone, and on no parameter of the "
        "design."
    )
    is_so = len(found) == len(STRATA) and neighbours == order
    return Measurement(
        text,
        "confirmed" if is_so else "not confirmed",
        {"found": len(found), "by_dimension": counts, "outside": outside, "missing": missing},
    )


def uncoupled() -> Measurement:
    """Move random poses along the six uncoupled motions, by one actuator, and at a singularity."""
    random = np.random.default_rng(7)
    positions, rotations = random_poses(random, MOVED, OPTIMAL.reach)
    own, others = np.inf, 0.0
    for position, rotation in zip(positions, rotations, strict=True):
        pose = Pose.of(tuple(position.tolist()), rotation)
        before = margins(pose.position, pose.rotation)
        for motion in UNCOUPLED:
            moved = motion.moved(pose, float(random.uniform(0.5, 1.0)))
            change = np.abs(margins(moved.position, moved.rotation) - before) / OPTIMAL.reach
            own = min(own, float(change[motion.incidence - 1]))
            others = max(others, float(np.delete(change, motion.incidence - 1).max()))
    of_actuators = _margins_of_actuators(positions, rotations, random)
    return judge_uncoupled(own, others, of_actuators, _rates_of_freedoms(positions, rotations))


def judge_uncoupled(
    own: float, others: float, of_actuators: dict[str, tuple[str, ...]], rate: float
) -> Measurement:
    """Return the measurement of the uncoupled motions.

    Args:
        own: Least change of the margin that a motion moves, over the reach.
        others: Largest change of the two others, over the reach.
        of_actuators: Margins that change with each actuator alone.
        rate: Largest relative rate of an actuator as a flat fold turns about its line.
    """
    single = [f"{name} moves {which[0]}" for name, which in of_actuators.items() if len(which) == 1]
    several = [name for name, which in of_actuators.items() if len(which) > 1]
    text = (
        f"Over {MOVED} random poses each of six motions, four of them rotations and two "
        f"translations, changes its margin and leaves the other two to {below(others, SAME)} of "
        f"the reach. As single actuators {' and '.join(single)} alone; "
        f"{', '.join(several)} move several margins. Where one margin vanishes, a rotation is "
        "free though all actuators are locked: about the line b2b3 where δ1 does, about the line "
        "a1b4 where δ2 does, and about the guide where δ3 does. The relative rates of the "
        f"actuators are {below(rate, LOCKED)} there."
    )
    values = {
        "least_own_change": own,
        "largest_other_change": others,
        "margins_of_actuators": of_actuators,
        "largest_rate_of_a_freedom": rate,
    }
    is_so = others < SAME < own and rate < LOCKED
    return Measurement(text, "confirmed" if is_so else "not confirmed", values)


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
    """Return the largest rate of an actuator as a flat fold turns about its line.

    The rate is relative to the length of J's row and that of the twist.
    """
    worst = 0.0
    for column in (PHI1, PHI2, PHI3):
        p, r = flatten(positions, rotations, column)
        guide = np.broadcast_to([1.0, 0.0, 0.0], p.shape)
        axis = {PHI1: r[..., 0], PHI2: p / lengths_of(p)[:, None], PHI3: guide}[column]
        # b4 lies on the first two lines; the third passes through a1.
        velocity = np.cross(axis, p) if column == PHI3 else np.zeros_like(p)
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
        poses=_largest_difference(from_folds(folds), (p, r)),
        folds=_error_of_folds(of_strata, to_folds(*poses)),
        strata=len(ours),
        motions=_error_of_motions(random_folds(random, np.full((MADE, 6), True))),
        margins=float(np.abs(products - margins(p, r)).max()),
        determinant=float(np.abs(determinants - beta * epsilon).max()),
        at_home=float(determinants[0]),
    )


def judge_chart(strata: int, determinant: float, at_home: float, **errors: float) -> Measurement:
    """Return the measurement of the folds as a chart, with the reach as unit of length.

    Args:
        strata: Number of strata that have as many coordinates as dimensions.
        determinant: Largest error of sin β sin ε as the determinant of the chart over r².
        at_home: That determinant at the home pose of the optimum.
        errors: Largest errors of `poses` by their folds, of the `folds` of a stratum by the pose
            that they make, of poses that the platform's `motions` make, and of the `margins` as
            products of r and sines.
    """
    exact = max(errors.values())
    text = (
        "The amounts of six motions of the platform on its own axes, made one after the other from "
        "the pose in which both flags coincide, are such coordinates: r, β, ε and the folds φ1, φ2 "
        "and φ3. Each of these motions moves one element of the platform's flag and leaves two. "
        f"{POSES:,} random poses have coordinates that give them back, and the margins are "
        "δ1 = r sin ε sin φ1, δ2 = r sin β sin ε sin φ2 and δ3 = r sin β sin φ3. So the poses that "
        "are not singular are eight boxes, one for each triple of signs, connected and "
        "contractible; on the walls of a box a fold is flat, or r, sin β or sin ε vanishes. "
        f"Likewise {strata} of the {len(STRATA)} strata have as many of the coordinates as "
        "dimensions; the others are zero, up to half turns about the platform's axes, which leave "
        f"its flag where it is. This holds to {below(exact, EXACT)} of the reach and in radians. "
        "The determinant of the chart is r² sin β sin ε, by finite differences to "
        f"{below(determinant, BY_DIFFERENCES)} of r², so that it is regular in every box. A "
        "fold changes one margin; r, β and ε change several in size, and none in sign. The six "
        "motions of the claim uncoupled-motions, each made once, are no chart: at the optimum's "
        "home, as wherever the platform is parallel to the base, four of them move it parallel to "
        "the base, which has three freedoms; there the determinant of the folds is "
        f"{at_home:.2f} r²."
    )
    is_exact = exact < EXACT and determinant < BY_DIFFERENCES
    is_so = is_exact and strata == len(STRATA) and at_home > REGULAR
    values = {**errors, "strata": strata, "determinant": determinant, "at_home": at_home}
    return Measurement(text, "confirmed" if is_so else "not confirmed", values, TABLE)


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
