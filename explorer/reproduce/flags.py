"""Claims that follow from the two flags: strata and uncoupled motions."""

from __future__ import annotations

import itertools

import numpy as np

from explorer.mechanism.design import JOINTS
from explorer.mechanism.design_file import PRESETS
from explorer.mechanism.folds import from_folds
from explorer.mechanism.kinematics import forward, inverse
from explorer.mechanism.margins import margins, mode_of
from explorer.mechanism.pose import Pose
from explorer.numerics.arrays import FloatArray, lengths_of
from explorer.reproduce.claim import (
    PHI1,
    PHI2,
    PHI3,
    Measurement,
    below,
    flatten,
    random_folds,
    random_poses,
)
from explorer.singularity.bruhat import is_below
from explorer.singularity.jacobian import jacobian
from explorer.singularity.strata import STRATA, inversions, stratum
from explorer.singularity.uncoupled import UNCOUPLED

OPTIMAL = PRESETS["paper-optimal"]
# Number of neighbours of a pose, and their distance in folds.
NEIGHBOURS, NEAR = 20, 1e-2
POSES, SAME = 300, 1e-10
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
    positions, rotations = random_poses(random, POSES, OPTIMAL.reach)
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
        f"Over {POSES} random poses each of six motions, four of them rotations and two "
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
