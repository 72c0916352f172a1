"""Claims on singular poses: in each a tetrahedron is flat, and each path between modes has one."""

from __future__ import annotations

from dataclasses import asdict, dataclass

import numpy as np
from scipy.spatial.transform import Rotation

from explorer.mechanism.configuration import Configuration
from explorer.mechanism.design import Design
from explorer.mechanism.design_file import PRESETS
from explorer.mechanism.folds import from_folds, to_folds
from explorer.mechanism.kinematics import forward, inverse
from explorer.mechanism.margins import margins
from explorer.numerics.arrays import FloatArray
from explorer.reproduce.claim import (
    PHI1,
    PHI2,
    PHI3,
    Measurement,
    below,
    flatten,
    random_design,
    random_poses,
)
from explorer.singularity.jacobian import (
    determinant,
    inverse_condition,
    jacobian,
    tetrahedron_volumes,
)

DESIGNS, POSES = 12, 2000
# Margins over the reach of poses that count as off all singular planes.
OFF = 0.05
EXACT = 1e-12

OPTIMAL = PRESETS["paper-optimal"]
PATHS, ON_PATH, HALVINGS = 500, 200, 60
# Inverse condition of J up to which a pose on a path counts as singular.
SINGULAR = 1e-9
# Share of a margin that rounding may take.
ROUNDING = 1e-9


@dataclass
class Errors:
    """The largest errors over all poses, and the conditions of J on and off the singular planes.

    Attributes:
        volumes: Error of the volumes of the tetrahedra by the margins, over the cubed reach.
        identity: Error of the formula of det J, over the product of the lengths of its rows.
        on_planes: Largest inverse condition of J at poses with a flat tetrahedron.
        off_planes: Least inverse condition of J at poses with every |δi| above `OFF`.
    """

    volumes: float = 0.0
    identity: float = 0.0
    on_planes: float = 0.0
    off_planes: float = float("inf")


def flat_tetrahedra() -> Measurement:
    """Compare volumes and det J with closed forms, and the condition of J on and off the planes."""
    random = np.random.default_rng(5)
    errors = Errors()
    for _ in range(DESIGNS):
        design = random_design(random)
        p, r = random_poses(random, POSES, design.reach)
        joints, delta = inverse(design, p, r), margins(p, r)
        by_margins = np.abs(tetrahedron_volumes(design, delta))
        off = np.abs(_volumes(design, p, r) - by_margins).max() / design.reach**3
        errors.volumes = max(errors.volumes, float(off))
        j = jacobian(design, p, r)
        rows = np.linalg.norm(j, axis=-1).prod(axis=-1)
        error = np.abs(np.linalg.det(j) - determinant(design, joints, delta)) / rows
        errors.identity = max(errors.identity, float(error.max()))
        condition = inverse_condition(j, design.reach)
        is_off = np.abs(delta).min(axis=-1) >= OFF * design.reach
        errors.off_planes = min(errors.off_planes, float(condition[is_off].min()))
        for column in (PHI1, PHI2, PHI3):
            flat = inverse_condition(jacobian(design, *flatten(p, r, column)), design.reach)
            errors.on_planes = max(errors.on_planes, float(flat.max()))
    return judge_flat(errors)


def judge_flat(errors: Errors) -> Measurement:
    """Return the measurement of the errors and conditions."""
    text = (
        f"In {DESIGNS * POSES:,} random poses of {DESIGNS} random designs the volumes of the "
        "tetrahedra, computed from their points, are those of the margins to "
        f"{below(errors.volumes, EXACT)} of the cubed reach, and det J · l1 d2 d4 l4 = "
        "−b1y a3y (b3 − b2)² δ1 δ2 δ3 holds to "
        f"{below(errors.identity, EXACT)} of the product of the rows' lengths. Where a tetrahedron "
        f"is flat the inverse condition of J is {below(errors.on_planes, EXACT)}; where every |δi| "
        f"is at least {OFF:g} of the reach it is at least {errors.off_planes:.0e}."
    )
    is_so = max(errors.volumes, errors.identity, errors.on_planes) < EXACT
    is_regular = errors.off_planes > 1e6 * EXACT
    verdict = "confirmed" if is_so and is_regular else "not confirmed"
    return Measurement(text, verdict, asdict(errors))


def _volumes(design: Design, position: FloatArray, rotation: FloatArray) -> FloatArray:
    """Return the volumes of the three tetrahedra from their points, shape (n, 3)."""
    points = Configuration(design, position, rotation).points
    a1, a3 = np.zeros(3), np.array([*design.a3, 0.0])
    a2 = np.array([design.a2x, 0.0, 0.0])
    b1, b2, b3, b4 = points.b1, points.b2, points.b3, points.b4
    tetrahedra = ((b1, b2, b3, a1), (a1, a2, b2, b3), (b4, a1, a2, a3))
    return np.stack(
        [
            np.abs(np.linalg.det(np.stack(np.broadcast_arrays(q - o, r - o, s - o), axis=-1))) / 6.0
            for o, q, r, s in tetrahedra
        ],
        axis=-1,
    )


def mode_paths() -> Measurement:
    """Find a singular pose on random paths between modes, and try to stay off them in a mode."""
    random = np.random.default_rng(8)
    worst = float(conditions_at_crossings(random_paths(random, PATHS)).max())
    return judge_paths(worst, _kept_share(random))


def judge_paths(worst: float, kept: float) -> Measurement:
    """Return the measurement of paths.

    Args:
        worst: Largest inverse condition of J at the singular poses, one on each path.
        kept: Least |δi| on paths in a mode over the smaller of its ends.
    """
    text = (
        f"On each of {PATHS} random curved paths between two modes of the same joints there is a "
        f"pose at which the inverse condition of J is {below(worst, SINGULAR)}. It must be there: "
        "the modes of the same joints differ in a sign of δ1, δ2 and δ3, these are continuous "
        "along a path, and by the intermediate value theorem one that changes its sign vanishes on "
        "the way. Within a mode a path needs none: along straight lines in the folds, between "
        f"{PATHS} pairs of random poses of one mode, each |δi| is at least {kept:.3f} times the "
        "smaller of its ends."
    )
    return Measurement(
        text,
        "confirmed" if worst < SINGULAR and kept > 1.0 - ROUNDING else "not confirmed",
        {"paths": PATHS, "largest_inverse_condition": worst, "kept_share_of_margins": kept},
    )


@dataclass(frozen=True)
class Paths:
    """Curved paths between two poses: shifts of b4 and turns, with a detour.

    Attributes:
        position, rotation: Poses at the start, shapes (n, 3) and (n, 3, 3).
        way: Shift and rotation vector from start to end, shape (n, 6).
        detour: Shift and rotation vector that are added in the middle of the way, shape (n, 6).
    """

    position: FloatArray
    rotation: FloatArray
    way: FloatArray
    detour: FloatArray

    def at(self, shares: FloatArray) -> tuple[FloatArray, FloatArray]:
        """Return positions (n, 3) and rotations (n, 3, 3) at a share of each path, shape (n,)."""
        s = shares[:, None]
        moves = s * self.way + np.sin(np.pi * s) * self.detour
        turns = np.asarray(Rotation.from_rotvec(moves[:, 3:]).as_matrix())
        return self.position + moves[:, :3], turns @ self.rotation


def random_paths(random: np.random.Generator, count: int) -> Paths:
    """Return paths between two modes of the joints of random poses."""
    reach = OPTIMAL.reach
    p, r, _ = forward(OPTIMAL, inverse(OPTIMAL, *random_poses(random, count, reach)))
    first, last = random.permuted(np.tile(np.arange(8), (count, 1)), axis=1)[:, :2].T
    rows = np.arange(count)
    start, end = r[rows, first], r[rows, last]
    turn = Rotation.from_matrix(end @ np.swapaxes(start, 1, 2)).as_rotvec()
    way = np.concatenate([p[rows, last] - p[rows, first], turn], axis=1)
    detour = random.normal(size=(count, 6)) * [reach, reach, reach, 1.0, 1.0, 1.0]
    return Paths(p[rows, first], start, way, detour)


def conditions_at_crossings(paths: Paths) -> FloatArray:
    """Return the inverse condition of J where a margin changes its sign on each path, shape (n,).

    It is the first margin whose signs at both ends differ. Without one the end of the path counts.
    """
    rows = np.arange(len(paths.position))

    def signs(shares: FloatArray) -> FloatArray:
        return np.sign(margins(*paths.at(shares)))

    low, high = np.zeros(len(rows)), np.ones(len(rows))
    start = signs(low)
    which = (start != signs(high)).argmax(axis=1)
    for _ in range(HALVINGS):
        middle = 0.5 * (low + high)
        is_before = (signs(middle) == start)[rows, which]
        low, high = np.where(is_before, middle, low), np.where(is_before, high, middle)
    return inverse_condition(jacobian(OPTIMAL, *paths.at(low)), OPTIMAL.reach)


def _kept_share(random: np.random.Generator) -> float:
    """Return the least |δi| on straight lines in the folds over the smaller of its ends."""
    one, other = (to_folds(*random_poses(random, PATHS, OPTIMAL.reach)) for _ in range(2))
    other[:, 3:] = np.copysign(other[:, 3:], one[:, 3:])
    shares = np.linspace(0.0, 1.0, ON_PATH)[:, None, None]
    sizes = np.abs(margins(*from_folds(one + shares * (other - one))))
    return float((sizes / np.minimum(sizes[0], sizes[-1])).min())
