"""Claims that follow from the two flags: strata, uncoupled motions and charts."""

from __future__ import annotations

import itertools
from dataclasses import asdict, dataclass

import numpy as np
from scipy.spatial.transform import Rotation, Slerp

from explorer.mechanism.design import JOINTS
from explorer.mechanism.design_file import PRESETS
from explorer.mechanism.home import home_pose
from explorer.mechanism.kinematics import forward, inverse
from explorer.mechanism.margins import margins, mode_of
from explorer.mechanism.pose import Pose
from explorer.numerics.arrays import FloatArray
from explorer.reproduce.claim import Measurement, below
from explorer.reproduce.samples import random_poses
from explorer.singularity.bruhat import is_below
from explorer.singularity.nearest_stratum import nearest_in_strata
from explorer.singularity.strata import STRATA, inversions, stratum
from explorer.singularity.uncoupled import UNCOUPLED
from explorer.workspace.limits.valid_poses import poses_are_valid

OPTIMAL = PRESETS["paper-optimal"]
NEIGHBOURS, NEAR = 200, 1e-3
POSES, SAME = 300, 1e-10
# Number of random poses, of pairs of them, and of poses on a path between a pair.
CHART_POSES, CHART_PAIRS, ON_PATH, HALVINGS = 20_000, 200, 400, 60
# Ratio of singular values up to which screws are dependent.
DEPENDENT = 1e-9


def strata() -> Measurement:
    """Find a pose in each of the 24 strata, and compare their neighbours with the closure order."""
    poses = {w: found.pose for w, found in nearest_in_strata(OPTIMAL, home_pose(OPTIMAL)).items()}
    found, outside = 0, 0
    random = np.random.default_rng(6)
    for w, pose in poses.items():
        found += tuple(stratum(pose.position, pose.rotation, OPTIMAL.reach).tolist()) == w
        shifts = NEAR * OPTIMAL.reach * random.normal(size=(NEIGHBOURS, 3))
        turns = Rotation.from_rotvec(NEAR * random.normal(size=(NEIGHBOURS, 3))).as_matrix()
        # A third of the neighbours are only shifted, and a third only turned.
        shifts[::3], turns[1::3] = 0.0, np.eye(3)
        near = stratum(np.array(pose.position) + shifts, turns @ pose.rotation, OPTIMAL.reach)
        outside += sum(not is_below(w, tuple(other)) for other in near.tolist())
    order = {(a, b) for a in STRATA for b in STRATA if is_below(a, b)}
    return judge_strata(found, outside, order == _order_by_covers())


def judge_strata(found: int, outside: int, is_bruhat: bool) -> Measurement:
    """Return the measurement of the strata.

    Args:
        found: Number of strata in which a pose was found.
        outside: Number of neighbouring poses whose stratum's closure does not hold the first pose.
        is_bruhat: Whether the closure order is the Bruhat order generated from its covers.
    """
    counts = [sum(inversions(w) == k for w in STRATA) for k in range(7)]
    text = (
        f"Poses are found in {found} of the {len(STRATA)} strata, {', '.join(map(str, counts))} of "
        f"which have the dimensions 0 to 6. Of {len(STRATA) * NEIGHBOURS:,} neighbours of these "
        f"poses {outside} lie in a stratum whose closure does not hold the pose. The closure order "
        f"is {'' if is_bruhat else 'not '}the Bruhat order generated from its covers. A stratum "
        "depends on the relative position of the flags alone, and on no parameter of the design."
    )
    is_so = found == len(STRATA) and outside == 0 and is_bruhat
    return Measurement(
        text,
        "confirmed" if is_so else "not confirmed",
        {"found": found, "by_dimension": counts, "outside": outside, "is_bruhat": is_bruhat},
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


def uncoupled() -> Measurement:
    """Move random poses along the six uncoupled motions, and by one actuator at a time."""
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
    return judge_uncoupled(own, others, _margins_of_actuators(positions, rotations, random))


def judge_uncoupled(
    own: float, others: float, of_actuators: dict[str, tuple[str, ...]]
) -> Measurement:
    """Return the measurement of the uncoupled motions.

    Args:
        own: Least change of the margin that a motion moves, over the reach.
        others: Largest change of the two others, over the reach.
        of_actuators: Margins that change with each actuator alone.
    """
    single = [f"{name} moves {which[0]}" for name, which in of_actuators.items() if len(which) == 1]
    text = (
        f"Over {POSES} random poses each of six motions, four of them rotations and two "
        f"translations, changes its margin and leaves the other two to {below(others, SAME)} of "
        f"the reach. As single actuators {' and '.join(single)} alone; d1 to d4 move all three."
    )
    values = {
        "least_own_change": own,
        "largest_other_change": others,
        "margins_of_actuators": of_actuators,
    }
    is_so = others < SAME < own
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


@dataclass(frozen=True)
class DependentScrews:
    """A pose within the limits at which the screws of the six uncoupled motions are dependent.

    Attributes:
        position, quaternion: The pose.
        least_margin: Least |δi| over the reach.
        ratio: Ratio of the least singular value of the six screws to the largest.
    """

    position: tuple[float, ...]
    quaternion: tuple[float, ...]
    least_margin: float
    ratio: float


def chart() -> Measurement:
    """Look for a pose within the limits at which the screws of the six motions are dependent."""
    random = np.random.default_rng(9)
    lows, highs = OPTIMAL.limits.box or ((-OPTIMAL.reach,) * 3, (OPTIMAL.reach,) * 3)
    p = random.uniform(lows, highs, (CHART_POSES, 3))
    r = np.asarray(Rotation.random(CHART_POSES, rng=random).as_matrix())
    valid = poses_are_valid(OPTIMAL, p, r)
    p, r = p[valid], r[valid]
    signs = np.array([_screws_determinant(*pose) > 0.0 for pose in zip(p, r, strict=True)])
    pairs = zip(np.flatnonzero(signs), np.flatnonzero(~signs), strict=False)
    for one, other in itertools.islice(pairs, CHART_PAIRS):
        found = _dependent_between(p[[one, other]], r[[one, other]])
        if found is not None:
            return judge_chart(found)
    return judge_chart(None)


def judge_chart(found: DependentScrews | None) -> Measurement:
    """Return the measurement of the charts, given a pose with dependent screws or none."""
    text = (
        "Platform and base have a translation and a rotation that change δ1 alone, the same for "
        "δ3, and two rotations for δ2. Amounts of these six motions, made one after the other "
        "from a pose, are coordinates near it if and only if the six screws are independent. "
    )
    if found is None or found.ratio >= DEPENDENT:
        return Measurement(
            f"{text}No pose with dependent screws was found.", "not testable from the paper"
        )
    position = ", ".join(f"{x:.3f}" for x in found.position)
    quaternion = ", ".join(f"{x:.4f}" for x in found.quaternion)
    text += (
        f"They are dependent at b4 = ({position}), quaternion ({quaternion}), a pose within all "
        f"limits of the optimum, with every |δi| at least {found.least_margin:.3f} of the reach. "
        "The six sliders of the explorer are therefore motions, and no chart of an assembly mode."
    )
    return Measurement(text, "not confirmed", asdict(found))


def _dependent_between(p: FloatArray, r: FloatArray) -> DependentScrews | None:
    """Return the pose with dependent screws on a path of valid poses between two, or None.

    The determinants of the screws at the two poses have different signs.
    """
    turn = Slerp([0.0, 1.0], Rotation.from_matrix(r))

    def at(shares: FloatArray) -> tuple[FloatArray, FloatArray]:
        return p[0] + shares[..., None] * (p[1] - p[0]), np.asarray(turn(shares).as_matrix())

    if not poses_are_valid(OPTIMAL, *at(np.linspace(0.0, 1.0, ON_PATH))).all():
        return None
    start, end = 0.0, 1.0
    for _ in range(HALVINGS):
        middle = 0.5 * (start + end)
        is_first = _screws_determinant(*at(np.array(middle))) > 0.0
        start, end = (middle, end) if is_first else (start, middle)
    position, rotation = at(np.array(start))
    values = np.linalg.svd(_screws(position, rotation), compute_uv=False)
    pose = Pose.of(tuple(position.tolist()), rotation)
    least = np.abs(margins(position, rotation)).min() / OPTIMAL.reach
    return DependentScrews(
        pose.position, pose.quaternion, float(least), float(values[-1] / values[0])
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
