"""Claims that follow from the two flags: strata, uncoupled motions and charts."""

from __future__ import annotations

import itertools

import numpy as np
from scipy.spatial.transform import Rotation, Slerp

from explorer.mechanism.design import JOINTS
from explorer.mechanism.design_file import PRESETS
from explorer.mechanism.home import home_pose
from explorer.mechanism.kinematics import forward, inverse
from explorer.mechanism.margins import margins
from explorer.mechanism.pose import Pose
from explorer.numerics.arrays import FloatArray
from explorer.reproduce.claim import Measured
from explorer.reproduce.samples import random_poses
from explorer.singularity.bruhat import is_below
from explorer.singularity.nearest_stratum import nearest_in_strata
from explorer.singularity.strata import STRATA, inversions, stratum
from explorer.singularity.uncoupled import UNCOUPLED

OPTIMAL = PRESETS["paper-optimal"]
NEIGHBOURS, NEAR = 200, 1e-3
POSES, ON_PATH = 300, 400
SAME = 1e-10
HALVINGS = 60


def strata() -> Measured:
    """Realise each of the 24 strata by a pose, and compare their closure order with its covers."""
    poses = {w: found.pose for w, found in nearest_in_strata(OPTIMAL, home_pose(OPTIMAL)).items()}
    realised, outside = 0, 0
    random = np.random.default_rng(6)
    for w, pose in poses.items():
        realised += tuple(stratum(pose.position, pose.rotation, OPTIMAL.reach).tolist()) == w
        shifts = NEAR * OPTIMAL.reach * random.normal(size=(NEIGHBOURS, 3))
        turns = Rotation.from_rotvec(NEAR * random.normal(size=(NEIGHBOURS, 3))).as_matrix()
        # A third of the neighbours are only shifted, and a third only turned.
        shifts[::3], turns[1::3] = 0.0, np.eye(3)
        near = np.array(pose.position) + shifts
        found = stratum(near, turns @ pose.rotation, OPTIMAL.reach).tolist()
        outside += sum(not is_below(w, tuple(other)) for other in found)
    order = {(a, b) for a in STRATA for b in STRATA if is_below(a, b)}
    agrees = order == _order_by_covers()
    counts = [sum(inversions(w) == k for w in STRATA) for k in range(7)]
    text = (
        f"{realised} of {len(STRATA)} strata are realised by poses of the mechanism; by dimension "
        f"0 to 6 there are {', '.join(map(str, counts))}. Of {len(STRATA) * NEIGHBOURS:,} "
        f"neighbouring poses {outside} lie in a stratum whose closure does not hold the first. The "
        f"closure order has {len(order)} pairs, {'the same' if agrees else 'not the same'} as the "
        "Bruhat order generated from its covers."
    )
    is_so = realised == len(STRATA) and outside == 0 and agrees
    return Measured(
        text,
        "confirmed" if is_so else "not confirmed",
        {"realised": realised, "by_dimension": counts, "outside": outside, "pairs": len(order)},
    )


def _order_by_covers() -> set[tuple[tuple[int, ...], tuple[int, ...]]]:
    """Return the Bruhat order from its covers: exchanges that add exactly one inversion."""
    above = {w: {w} for w in STRATA}
    for w in sorted(STRATA, key=inversions, reverse=True):
        for i, j in itertools.combinations(range(4), 2):
            other = list(w)
            other[i], other[j] = other[j], other[i]
            if inversions(tuple(other)) == inversions(w) + 1:
                above[w] |= above[tuple(other)]
    return {(w, other) for w, others in above.items() for other in others}


def uncoupled() -> Measured:
    """Move random poses along the six uncoupled motions, and by one actuator at a time."""
    random = np.random.default_rng(7)
    positions, rotations = random_poses(random, POSES, OPTIMAL.reach)
    worst = 0.0
    for position, rotation in zip(positions, rotations, strict=True):
        pose = Pose.of(tuple(position.tolist()), rotation)
        before = margins(pose.position, pose.rotation)
        for motion in UNCOUPLED:
            moved = motion.moved(pose, float(random.uniform(-1.0, 1.0)))
            change = np.abs(margins(moved.position, moved.rotation) - before)
            worst = max(worst, float(np.delete(change, motion.incidence - 1).max()))
    moves = _margins_of_actuators(positions, rotations, random)
    single = [name for name, which in moves.items() if len(which) == 1]
    each = "; ".join(f"{name}: {', '.join(which)}" for name, which in moves.items())
    text = (
        f"Each of the six motions leaves the other two margins the same within "
        f"{worst / OPTIMAL.reach:.1e} of the reach, over {POSES} random poses. Of the actuators "
        f"only {' and '.join(single)} move one margin alone ({each})."
    )
    is_so = worst < SAME * OPTIMAL.reach
    return Measured(
        text,
        "confirmed" if is_so else "not confirmed",
        {"largest_other_change": worst / OPTIMAL.reach, "margins_of_actuators": moves},
    )


def _margins_of_actuators(
    positions: FloatArray, rotations: FloatArray, random: np.random.Generator
) -> dict[str, tuple[str, ...]]:
    """Return which margins change with each actuator alone, over random poses."""
    reach = OPTIMAL.reach
    before = margins(positions, rotations)
    mode = (before > 0.0) @ np.array([4, 2, 1])
    joints = inverse(OPTIMAL, positions, rotations)
    rows = np.arange(len(positions))
    moves: dict[str, tuple[str, ...]] = {}
    for index, name in enumerate(JOINTS):
        changed = joints.copy()
        changed[:, index] += 0.02 * reach * random.uniform(0.5, 1.0, len(joints))
        p, r, feasible = forward(OPTIMAL, changed)
        after = margins(p[rows, mode], r[rows, mode])
        change = np.abs(after - before)[feasible].max(axis=0)
        moves[name] = tuple(f"δ{k + 1}" for k in range(3) if change[k] > 1e-7 * reach)
    return moves


def chart() -> Measured:
    """Look for a pose within a mode in which the screws of the six uncoupled motions lose rank."""
    random = np.random.default_rng(9)
    while True:
        p, r = random_poses(random, 2, OPTIMAL.reach)
        low, high = (_screws_determinant(p[k], r[k]) for k in (0, 1))
        if low * high >= 0.0:
            continue
        turn = Slerp([0.0, 1.0], Rotation.from_matrix(r))
        shares = np.linspace(0.0, 1.0, ON_PATH)
        on_way = margins(
            p[0] + shares[:, None] * (p[1] - p[0]), np.asarray(turn(shares).as_matrix())
        )
        if (np.sign(on_way) == np.sign(on_way[0])).all():
            break
    start, end = 0.0, 1.0
    for _ in range(HALVINGS):
        middle = 0.5 * (start + end)
        value = _screws_determinant(
            p[0] + middle * (p[1] - p[0]), np.asarray(turn(middle).as_matrix())
        )
        start, end = (middle, end) if value * low > 0.0 else (start, middle)
    position, rotation = p[0] + start * (p[1] - p[0]), np.asarray(turn(start).as_matrix())
    screws = _screws(position, rotation)
    values = np.linalg.svd(screws, compute_uv=False)
    least = np.abs(margins(position, rotation)).min() / OPTIMAL.reach
    ratio = float(values[-1] / values[0])
    pose = Pose.of(tuple(position.tolist()), rotation)
    text = (
        "Each singular plane is crossed by a translation and a rotation that change its margin "
        "alone, so that near it the margins are coordinates. The six motions together are no chart "
        f"of a mode: at b4 = ({', '.join(f'{x:.3f}' for x in pose.position)}), quaternion "
        f"({', '.join(f'{x:.4f}' for x in pose.quaternion)}), inside a mode, with every |δi| at "
        f"least {least:.3f} of the reach, their six screws are dependent (singular values in the "
        f"ratio {ratio:.0e}). The three margins of the platform's motions and those of the base's "
        "are the same three functions."
    )
    is_counterexample = ratio < 1e-9 and least > 1e-3
    return Measured(
        text,
        "not confirmed" if is_counterexample else "confirmed",
        {
            "position": pose.position,
            "quaternion": pose.quaternion,
            "least_margin": float(least),
            "ratio_of_singular_values": ratio,
        },
    )


def _screws(position: FloatArray, rotation: FloatArray) -> FloatArray:
    """Return the screws (v at b4 over the reach; ω) of the six motions, as columns (6, 6)."""
    pose = Pose.of(tuple(position.tolist()), rotation)
    columns: list[FloatArray] = []
    for motion in UNCOUPLED:
        point, axis = motion.line(pose)
        if motion.kind == "translation":
            columns.append(np.concatenate([axis, np.zeros(3)]))
        else:
            velocity = np.cross(axis, position - point) / OPTIMAL.reach
            columns.append(np.concatenate([velocity, axis]))
    return np.column_stack(columns)


def _screws_determinant(position: FloatArray, rotation: FloatArray) -> float:
    return float(np.linalg.det(_screws(position, rotation)))
