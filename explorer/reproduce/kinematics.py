"""Claims on the kinematics and on singular poses.

A closed form with eight modes, the same as that of the 6-4; a flat tetrahedron in each singular
pose, and a singular pose on each path between modes.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from scipy.spatial.transform import Rotation

from explorer.mechanism.configuration import Configuration
from explorer.mechanism.design import Design
from explorer.mechanism.design_file import PRESETS
from explorer.mechanism.folds import from_folds, to_folds
from explorer.mechanism.kinematics import forward, inverse
from explorer.mechanism.margins import margins, mode_of
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
from explorer.reproduce.six_legs import six_four_twin
from explorer.singularity.ellipsoids import (
    determinant,
    inverse_condition,
    jacobian,
    tetrahedron_volumes,
)

OPTIMAL = PRESETS["paper-optimal"]
DESIGNS, POSES, A2X = 6, 500, (5.0, 12.0, 26.0)
# Errors that count as none, of joints over the reach and of poses.
EXACT, SAME = 1e-9, 1e-6
# Designs and poses for the flat tetrahedra, and the errors of these that count as none.
FLAT_DESIGNS, FLAT_POSES, FLAT = 12, 2000, 1e-12
# Margins over the reach of poses that count as off all singular planes.
OFF = 0.05
PATHS, ON_PATH, HALVINGS = 500, 200, 60
# Inverse condition of J up to which a pose on a path counts as singular.
SINGULAR = 1e-9
# Share of a margin that rounding may take.
ROUNDING = 1e-9


def closed_form() -> Measurement:
    """Solve the forward kinematics of the joints of random poses."""
    random = np.random.default_rng(4)
    off, missed, least = 0.0, 0.0, 8
    for design in (*PRESETS.values(), *(random_design(random) for _ in range(DESIGNS))):
        position, rotation = random_poses(random, POSES, 0.7 * design.reach)
        joints = inverse(design, position, rotation)
        p, r, _ = forward(design, joints)
        off = max(off, float(np.abs(inverse(design, p, r) - joints[:, None]).max()) / design.reach)
        apart = np.abs(p - position[:, None]).max(axis=-1) / design.reach
        apart += np.abs(r - rotation[:, None]).max(axis=(-2, -1))
        missed = max(missed, float(apart.min(axis=1).max()))
        modes = np.sort(mode_of(margins(p, r)), axis=1)
        least = min(least, 1 + int((np.diff(modes) > 0).sum(axis=1).min()))
    return judge_closed_form(off, missed, least)


def judge_closed_form(joints: float, pose: float, modes: int) -> Measurement:
    """Return the measurement of the closed form.

    Args:
        joints: Largest error of the joints of its poses, over the reach.
        pose: Largest distance of a pose from the nearest of those with its joints.
        modes: Least number of triples of signs of the margins in these.
    """
    text = (
        f"For the joints of {POSES} random poses of each of {len(PRESETS) + DESIGNS} designs, "
        "three trilaterations, with two mirror points each, lead to eight poses with these joints "
        f"to {below(joints, EXACT)} of the reach. Their margins have {modes} triples of signs. "
        f"Each of the random poses is one of the eight of its joints, to {below(pose, SAME)}: "
        "there are no others."
    )
    is_so = joints < EXACT and pose < SAME and modes == 8
    values = {"joints": joints, "pose": pose, "modes": modes}
    return Measurement(text, "confirmed" if is_so else "not confirmed", values)


def same_kinematics() -> Measurement:
    """Compare the actuated variables, modes and singular poses of the 4-4 and its 6-4 twin."""
    random = np.random.default_rng(11)
    errors = np.zeros(3)
    for design in (*PRESETS.values(), *(random_design(random) for _ in range(DESIGNS))):
        positions, rotations = random_poses(random, POSES, design.reach)
        joints = inverse(design, positions, rotations)
        p, r, _ = forward(design, joints)
        for a2x in A2X:
            twin = six_four_twin(design, a2x)
            given = twin.lengths(positions, rotations)
            modes = np.array([twin.lengths(p[:, k], r[:, k]) for k in range(8)])
            back = _joints_of(given, a2x)
            # The determinant over the margins is a constant of the design.
            own = twin.determinant(positions, rotations) * given.prod(axis=1)
            product = margins(positions, rotations).prod(axis=-1)
            constant = float(np.median(own / product))
            off = (modes - given, back - joints, (own / constant - product) / design.reach**2)
            errors = np.maximum(errors, [np.abs(each).max() / design.reach for each in off])
    return judge_same_kinematics(*errors.tolist())


def judge_same_kinematics(lengths: float, joints: float, determinant: float) -> Measurement:
    """Return the measurement of the twin.

    Args:
        lengths: Difference of the twin's lengths in the eight modes of the 4-4, over the reach.
        joints: Difference of the joints that these lengths give, over the reach.
        determinant: Relative error of the determinant of the twin by the margins.
    """
    text = (
        f"For {POSES} random poses of each of {len(PRESETS) + DESIGNS} designs and a2x = "
        f"{', '.join(f'{x:g}' for x in A2X)}, the lengths of the 6-4 and the joints of the 4-4 "
        "determine each other: all eight modes of the 4-4 give the six legs the same lengths, to "
        f"{below(lengths, EXACT)} of the reach, and these give back the joints by the theorem of "
        f"Pythagoras, to {below(joints, EXACT)}. The determinant of the 6-4 times its lengths is a "
        f"constant times δ1 δ2 δ3, to {below(determinant, EXACT)}. So both have the same modes and "
        "the same singular poses."
    )
    is_same = max(lengths, joints, determinant) < EXACT
    values = {"lengths": lengths, "joints": joints, "determinant": determinant}
    return Measurement(text, "confirmed" if is_same else "not confirmed", values)


def _joints_of(lengths: FloatArray, a2x: float) -> FloatArray:
    """Return the joints (n, 6) of the 4-4 by the lengths of its twin, in the order of `TWIN`."""
    l1, h1, h3, h2, h4, l4 = lengths.T
    d1, d3 = ((a * a - b * b + a2x * a2x) / (2.0 * a2x) for a, b in ((h1, h2), (h3, h4)))
    d2, d4 = (np.sqrt(h * h - d * d) for h, d in ((h1, d1), (h3, d3)))
    return np.stack([l1, d1, d2, d3, d4, l4], axis=-1)


def flat_tetrahedra() -> Measurement:
    """Compare volumes and det J with closed forms, and the condition of J on and off the planes."""
    random = np.random.default_rng(5)
    volumes = identity = on_planes = 0.0
    off_planes = np.inf
    for _ in range(FLAT_DESIGNS):
        design = random_design(random)
        p, r = random_poses(random, FLAT_POSES, design.reach)
        joints, delta = inverse(design, p, r), margins(p, r)
        by_margins = np.abs(tetrahedron_volumes(design, delta))
        off = np.abs(_volumes(design, p, r) - by_margins).max() / design.reach**3
        volumes = max(volumes, float(off))
        j = jacobian(design, p, r)
        rows = np.linalg.norm(j, axis=-1).prod(axis=-1)
        error = np.abs(np.linalg.det(j) - determinant(design, joints, delta)) / rows
        identity = max(identity, float(error.max()))
        condition = inverse_condition(j, design.reach)
        is_off = np.abs(delta).min(axis=-1) >= OFF * design.reach
        off_planes = min(off_planes, float(condition[is_off].min()))
        for column in (PHI1, PHI2, PHI3):
            flat = inverse_condition(jacobian(design, *flatten(p, r, column)), design.reach)
            on_planes = max(on_planes, float(flat.max()))
    return judge_flat(volumes, identity, on_planes, off_planes)


def judge_flat(volumes: float, identity: float, on_planes: float, off_planes: float) -> Measurement:
    """Return the measurement of the flat tetrahedra.

    Args:
        volumes: Error of the volumes of the tetrahedra by the margins, over the cubed reach.
        identity: Error of the formula of det J, over the product of the lengths of its rows.
        on_planes: Largest inverse condition of J at poses with a flat tetrahedron.
        off_planes: Least inverse condition of J at poses with every |δi| above `OFF`.
    """
    text = (
        f"In {FLAT_DESIGNS * FLAT_POSES:,} random poses of {FLAT_DESIGNS} random designs the "
        "volumes of the tetrahedra, computed from their points, are those of the margins to "
        f"{below(volumes, FLAT)} of the cubed reach, and det J · l1 d2 d4 l4 = "
        f"−b1y a3y (b3 − b2)² δ1 δ2 δ3 holds to {below(identity, FLAT)} of the product of the "
        "rows' lengths. Where a tetrahedron is flat the inverse condition of J is "
        f"{below(on_planes, FLAT)}; where every |δi| is at least {OFF:g} of the reach it is at "
        f"least {off_planes:.0e}."
    )
    is_so = max(volumes, identity, on_planes) < FLAT and off_planes > 1e6 * FLAT
    return Measurement(
        text,
        "confirmed" if is_so else "not confirmed",
        {
            "volumes": volumes,
            "identity": identity,
            "on_planes": on_planes,
            "off_planes": off_planes,
        },
    )


def _volumes(design: Design, position: FloatArray, rotation: FloatArray) -> FloatArray:
    """Return the volumes of the three tetrahedra from their points, shape (n, 3)."""
    at = Configuration(design, position, rotation).points
    tetrahedra = (
        (at.b1, at.b2, at.b3, at.a1),
        (at.a1, at.a2, at.b2, at.b3),
        (at.b4, at.a1, at.a2, at.a3),
    )
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
    """Curved paths between two poses: from a pose along a way, with a detour.

    Way and detour are shifts of b4 and rotation vectors, shape (n, 6); the detour is largest in the
    middle. Positions have the shape (n, 3), rotations (n, 3, 3).
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
